// Lists that follow the time: program, what happened, stages, the tree of frames.

// Comments of a program are { ... } over any number of lines, and // to the end of one; those of a file of poses # to
// the end of a line.
const COMMENTS = { Program: /(\{[^}]*\}?|\/\/[^\r\n]*)/, Poses: /(#[^\r\n]*)/ };

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

let shownEffect = null;

function showProgram() {
  const present = presentEffect();
  if (present === shownEffect) return;
  shownEffect = present;
  const line = data.effects[present]?.line;
  const done = new Set(data.effects.slice(0, present + 1).map((effect) => effect.line));
  [...byId("program").children].forEach((row, i) => {
    row.classList.toggle("done", done.has(i + 1));
    row.classList.toggle("now", i + 1 === line);
  });
  [...byId("trace").children].forEach((row, i) => row.firstChild.classList.toggle("now", i === present));
  keepInSight(byId("program"), byId("program").children[line - 1]);
  keepInSight(byId("trace"), byId("trace").children[present]);
}

// When something was done: its start, and its end where it took time.
function timesOf(effect) {
  const took = effect.t1 - effect.t0 > HAIR;
  return took ? `${number(effect.t0, 2)} – ${number(effect.t1, 2)} s` : `${number(effect.t0, 2)} s`;
}

// Which process a line belongs to, in words and in a colour of its own.
function processTag(process, processes) {
  const tag = make("span", { className: "process", textContent: process });
  tag.style.setProperty("--hue", `var(${hue(processes.indexOf(process))})`);
  return tag;
}

function fillTrace() {
  byId("trace-card").hidden = !data.effects.length;
  const processes = [...new Set(data.effects.map((effect) => effect.process))];
  byId("trace").classList.toggle("processes", processes.length > 1);
  byId("trace").append(
    ...data.effects.map((effect, i) => {
      const row = make(
        "button",
        { type: "button" },
        make("time", { textContent: timesOf(effect) }),
        ...(processes.length > 1 ? [processTag(effect.process, processes)] : []),
        make("span", { className: "text", textContent: effect.text }),
      );
      row.addEventListener("click", () => seek(effect.t0, i));
      return make("li", {}, row);
    }),
  );
}

// The largest share of a limit over the joints: bar, percentage, and the rest on hovering.
function peakCell(stage, peaks, quantity) {
  const arm = data.arms.find((one) => one.name === stage.arm);
  const shares = (peaks ?? []).map((peak, j) =>
    arm.joints[j][quantity.limit] === null || peak === null ? null : peak / arm.joints[j][quantity.limit],
  );
  const worst = Math.max(...shares.map((part) => part ?? -1));
  if (!shares.length || worst < 0) return make("td", { textContent: "–", className: "quiet" });
  const fill = make("i");
  fill.style.width = `${Math.min(100, 100 * worst)}%`;
  const each = shares.map(
    (part, j) =>
      `${arm.joints[j].name}: ${part === null ? "no limit" : `${number(100 * part, 1)} %`} (${quantityText(quantity, arm.joints[j], peaks[j])})`,
  );
  return make(
    "td",
    { className: worst > 1 + HAIR ? "over" : "", title: each.join("\n") },
    make("span", { className: "bar" }, fill),
    `${number(100 * worst, 0)} %`,
  );
}

// How near other bodies came: the distance, both names, and when; a click goes there.
function clearanceCell({ clearance }) {
  if (!clearance) return make("td", { textContent: "–", className: "quiet" });
  const { distance, bound, bodies, t } = clearance;
  if (distance === null) return make("td", { textContent: `above ${number(bound * MILLIMETRES, 0)} mm` });
  const link = make("button", { type: "button", textContent: `${number(distance * MILLIMETRES, 1)} mm` });
  link.addEventListener("click", (event) => {
    event.stopPropagation();
    seek(t);
  });
  const said = make("span", { className: "quiet", textContent: `${bodies.join(" – ")}, ${number(t, 2)}\u00a0s` });
  return make("td", { className: distance < data.clearance || distance <= 0 ? "over near" : "near" }, link, said);
}

function stageRow(stage, i) {
  const swatch = make("span", { className: "swatch" });
  swatch.style.setProperty("--hue", `var(${hue(i)})`);
  const button = make("button", { type: "button" }, swatch, `${i + 1} ${stage.kind}`);
  const numeric = (text) => make("td", { className: "number", textContent: text });
  const millimetres = (value) => (value === null ? "–" : number(value * MILLIMETRES, value * MILLIMETRES < 10 ? 2 : 1));
  const row = make(
    "tr",
    {},
    make("td", {}, button),
    make("td", { textContent: stage.to.join(", ") }),
    make("td", { textContent: stage.arm }),
    numeric(stage.line),
    numeric(number(stage.t0, 2)),
    numeric(number(stage.t1 - stage.t0, 2)),
    numeric(millimetres(stage.hand_length)),
    numeric(millimetres(stage.deviation)),
    peakCell(stage, stage.peak_speed, QUANTITIES[1]),
    peakCell(stage, stage.peak_effort, QUANTITIES[3]),
    ...(hasClearances ? [clearanceCell(stage)] : []),
    make("td", { textContent: stage.note }),
  );
  row.addEventListener("click", () => {
    if (chosenArm().name !== stage.arm) chooseArm(data.arms.findIndex((arm) => arm.name === stage.arm));
    seek(stage.t0);
  });
  return row;
}

function stripMark(stage, i) {
  const mark = make("i");
  const arm = data.arms.findIndex((one) => one.name === stage.arm);
  const part = 100 / Math.max(data.arms.length, 1);
  Object.assign(mark.style, {
    left: `${(100 * stage.t0) / data.duration}%`,
    width: `${(100 * (stage.t1 - stage.t0)) / data.duration}%`,
    top: `${arm * part}%`,
    height: `${part}%`,
  });
  mark.style.setProperty("--hue", `var(${hue(i)})`);
  return mark;
}

const hasClearances = data.stages.some((stage) => stage.clearance);

function fillStages() {
  byId("clearance-head").hidden = !hasClearances;
  byId("stages-card").hidden = !data.stages.length;
  byId("stages").append(...data.stages.map(stageRow));
  if (data.duration > 0) byId("strip").append(...data.stages.map(stripMark));
}

function showStages() {
  const present = new Set(data.arms.map((arm) => stageAt(arm.name, now.t)));
  [...byId("stages").children].forEach((row, i) => row.classList.toggle("now", present.has(i)));
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
    if (place) place.textContent = placeText(framesOf(figure, at).at(-1).slice(9));
  }
}
