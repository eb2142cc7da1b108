// Lists that follow the time: program, what happened, the tree of frames.

// Comments of a program are { ... } over any number of lines, and // to the end of one; those of poses and of topics # to
// the end of a line.
const COMMENTS = { Program: /(\{[^}]*\}?|\/\/[^\r\n]*)/, Poses: /(#[^\r\n]*)/, Topics: /(#[^\r\n]*)/ };

function codeLines(text) {
  const lines = [[]];
  const parts = text.split(COMMENTS[data.text_kind]);
  for (const [place, part] of parts.entries()) {
    const comment = place % 2 === 1;
    part.split(/\r\n|\r|\n/).forEach((piece, i) => {
      if (i) lines.push([]);
      if (piece) lines.at(-1).push(comment ? make("span", { className: "comment", textContent: piece }) : piece);
    });
  }
  if (lines.length > 1 && !lines.at(-1).length) lines.pop();
  return lines;
}

function programLine(pieces, i) {
  const first = data.effects.findIndex((effect) => effect.line === i + 1);
  const words = data.messages.filter((message) => message.line === i + 1);
  const cells = [
    make("span", { className: "mark" }),
    make("span", { className: "num", textContent: i + 1 }),
    make("span", { className: "text" }, ...pieces),
  ];
  const line = make("li", { title: words.map((word) => `${word.severity} ${word.code}: ${word.text}`).join("\n") });
  line.classList.toggle("said", words.length > 0);
  if (first < 0) {
    line.append(...cells);
    return line;
  }
  line.classList.add("can");
  line.append(make("button", { type: "button" }, ...cells));
  line.addEventListener("click", () => seek(data.effects[first].t0, first));
  return line;
}

function fillProgram() {
  byId("program-name").textContent = data.program_name;
  byId("program-title").textContent = data.text_kind;
  if (data.text_kind !== "Program") byId("program-empty").textContent = "No file.";
  const empty = !data.program_text.trim();
  byId("program-empty").hidden = !empty;
  if (!empty) byId("program").append(...codeLines(data.program_text).map(programLine));
}

// Scrolls the list alone, never the page.
function keepInSight(list, row) {
  if (!row) return;
  const [top, bottom] = [row.offsetTop, row.offsetTop + row.offsetHeight];
  if (top < list.scrollTop) list.scrollTop = top - 30;
  else if (bottom > list.scrollTop + list.clientHeight) list.scrollTop = bottom - list.clientHeight + 30;
}

function showLine(number) {
  const row = byId("program").children[number - 1];
  keepInSight(byId("program"), row);
  if (row?.classList.contains("can")) row.click();
}

// Effects of one process each, in order.
const processes = [...new Set(data.effects.map((effect) => effect.process))];

// The present effect of every process that does something now, and the one that was chosen by hand or begun last.
function presentEffects() {
  const latest = presentEffect();
  return processes.flatMap((process) => {
    if (data.effects[latest]?.process === process) return [latest];
    const present = data.effects.findLastIndex((one) => one.process === process && one.t0 <= now.t + HAIR);
    return present >= 0 && data.effects[present].t1 >= now.t - HAIR ? [present] : [];
  });
}

// The colour of the arm of an effect, or of the one that its process moved last.
function effectColour(present) {
  const { process } = data.effects[present];
  const of = data.effects.slice(0, present + 1).findLast((effect) => effect.arm && effect.process === process);
  const arm = data.arms.findIndex((one) => one.name === of?.arm);
  return arm < 0 ? "var(--accent)" : `var(--arm${arm % colours.arms.length})`;
}

let shownEffects = null;

function showProgram() {
  const present = presentEffects();
  const key = `${presentEffect()}: ${present}`;
  if (key === shownEffects) return;
  shownEffects = key;
  const latest = presentEffect();
  const done = new Set(data.effects.slice(0, latest + 1).map((effect) => effect.line));
  const lines = byId("program").children;
  [...lines].forEach((row, i) => {
    row.classList.toggle("done", done.has(i + 1));
    // Processes that are at the same line have a stripe each.
    const stripes = present.filter((k) => data.effects[k].line === i + 1).map(effectColour);
    row.classList.toggle("now", stripes.length > 0);
    row.style.boxShadow = stripes.map((colour, k) => `inset ${4 * (k + 1)}px 0 ${colour}`).join(", ");
  });
  [...byId("trace").children].forEach((row, i) => {
    row.firstChild.classList.toggle("now", present.includes(i));
  });
  keepInSight(byId("program"), lines[data.effects[latest]?.line - 1]);
  keepInSight(byId("trace"), byId("trace").children[latest]);
}

// When something was done: its start, and its end where it took time.
function timesOf(effect) {
  const took = effect.t1 - effect.t0 > HAIR;
  return took ? `${number(effect.t0, 2)} – ${number(effect.t1, 2)} s` : `${number(effect.t0, 2)} s`;
}

// Which process a line belongs to, in words and in a colour of its own.
function processTag(process) {
  const tag = make("span", { className: "process", textContent: process });
  tag.style.setProperty("--hue", `var(${hue(processes.indexOf(process))})`);
  return tag;
}

function fillTrace() {
  byId("trace-card").hidden = !data.effects.length;
  byId("trace").classList.toggle("processes", processes.length > 1);
  byId("trace").append(
    ...data.effects.map((effect, i) => {
      const row = make(
        "button",
        { type: "button" },
        make("time", { textContent: timesOf(effect) }),
        ...(processes.length > 1 ? [processTag(effect.process)] : []),
        make("span", { className: "text", textContent: effect.text }),
      );
      row.addEventListener("click", () => seek(effect.t0, i));
      return make("li", {}, row);
    }),
  );
}

const tree = { changes: data.animation?.tree ?? [], applied: -1, places: new Map() };

function treeNode(name, children, fresh, seen) {
  const place = make("span");
  tree.places.set(name, place);
  const node = make(
    "li",
    {},
    make("div", { className: fresh.has(name) ? "node fresh" : "node" }, make("span", { textContent: name }), place),
  );
  const below = (children.get(name) ?? []).filter((child) => !seen.has(child));
  below.forEach((child) => seen.add(child));
  if (below.length) node.append(make("ul", {}, ...below.map((child) => treeNode(child, children, fresh, seen))));
  return node;
}

function showTree() {
  const valid = tree.changes.filter((change) => change.t <= now.t + HAIR);
  if (valid.length !== tree.applied) {
    tree.applied = valid.length;
    tree.places.clear();
    const parents = new Map(valid.map((change) => [change.child, change.parent]));
    const children = new Map();
    for (const [child, parent] of parents) children.set(parent, [...(children.get(parent) ?? []), child]);
    const roots = [...new Set(parents.values())].filter((name) => !parents.has(name));
    const last = valid.at(-1);
    const fresh = new Set(
      last && last.t > 0 ? valid.filter((change) => change.t === last.t).map((change) => change.child) : [],
    );
    byId("tree").replaceChildren(
      make("ul", {}, ...roots.map((root) => treeNode(root, children, fresh, new Set([root])))),
    );
  }
  const at = locate(data.animation.t, now.t);
  for (const frame of data.animation.frames) {
    const place = tree.places.get(frame.name);
    if (place) place.textContent = at[0] < frame.visible_from ? "" : placeText(blend(frame.poses, at).slice(9));
  }
  for (const [name, figure] of Object.entries(data.animation.arms)) {
    const place = tree.places.get(name);
    if (place) place.textContent = placeText(framesAt(figure, positionsOf(name, figure, at)).at(-1).slice(9));
  }
}
