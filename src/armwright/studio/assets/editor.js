// The editor: a text field over its coloured text, with breakpoints, problems, and the lines that run.

const TYPED = 120; // a text is sent so long after the last key [ms]
const editor = { version: 0, timer: null, lines: 0, problems: [], running: "" };
const WORDS = new Map(Object.entries(data.words).flatMap(([kind, words]) => words.map((word) => [word, kind])));
// Words that programs may use as names, where what is around them tells that they are words of the language.
const RESERVED = `(?:${["declaration", "type", "keyword"].flatMap((kind) => data.words[kind]).join("|")})(?!\\w)`;
const CONTEXT = data.context.map(([kind, pattern]) => [kind, new RegExp(`${pattern.replaceAll("RESERVED", RESERVED)}(?!\\w)`, "imy")]);
const TOKEN = /(\{[^}]*\}?|\/\/[^\n]*)|("[^"\n]*"?)|(ARM[-_]\d+)|([A-Za-z_]\w*)|(\d+(?:\.\d+)?(?:E[+-]?\d+)?)/gi;

function kindOfWord(text, at, word) {
  const found = CONTEXT.find(([, pattern]) => {
    pattern.lastIndex = at;
    return pattern.test(text);
  });
  return found?.[0] ?? WORDS.get(word.toUpperCase());
}

function colouredText(text) {
  const pieces = [];
  let last = 0;
  for (const match of text.matchAll(TOKEN)) {
    const [token, comment, string, arm, word] = match;
    const kind = comment ? "comment" : string ? "string" : arm ? "arm" : word ? kindOfWord(text, match.index, word) : "number";
    pieces.push({ from: last, to: match.index, kind: "" }, { from: match.index, to: match.index + token.length, kind: kind ?? "" });
    last = match.index + token.length;
  }
  pieces.push({ from: last, to: text.length, kind: "" });
  return pieces;
}

// The pieces again, cut where a problem begins and ends.
function withProblems(pieces) {
  const problems = editor.problems.filter(({ file }) => !file);
  const cuts = problems.flatMap(({ start, end }) => [start, Math.max(end, start + 1)]);
  return pieces.flatMap((piece) => {
    const inside = [...new Set(cuts.filter((cut) => cut > piece.from && cut < piece.to))].sort((a, b) => a - b);
    const edges = [piece.from, ...inside, piece.to];
    return edges.slice(1).map((to, i) => {
      const problem = problems.find(({ start, end }) => edges[i] >= start && edges[i] < Math.max(end, start + 1));
      return { from: edges[i], to, kind: piece.kind, problem };
    });
  });
}

// The pieces of each line; a comment of several lines has a piece in each.
function byLine(pieces, text) {
  const lines = [[]];
  for (const { from, to, kind, problem } of pieces) {
    text
      .slice(from, to)
      .split("\n")
      .forEach((part, i) => {
        if (i) lines.push([]);
        if (part) lines.at(-1).push({ part, name: kind || problem ? `${kind} ${problem ? `wavy ${problem.severity}` : ""}` : "" });
      });
  }
  return lines;
}

// Of a long program only the lines that have changed are painted again.
function paintText() {
  const text = byId("text").value;
  const lines = byLine(withProblems(colouredText(text)), text);
  const rows = byId("colours").children;
  while (rows.length > lines.length) byId("colours").lastChild.remove();
  lines.forEach((pieces, i) => {
    if (i >= rows.length) byId("colours").append(make("div"));
    const key = JSON.stringify(pieces);
    if (rows[i].dataset.key === key) return;
    rows[i].dataset.key = key;
    rows[i].replaceChildren(...pieces.map(({ part, name }) => (name ? make("span", { className: name, textContent: part }) : part)));
  });
  if (lines.length !== editor.lines) fillGutter(lines.length);
}

function fillGutter(lines) {
  editor.lines = lines;
  const gutter = byId("gutter");
  while (gutter.children.length > lines) gutter.lastChild.remove();
  while (gutter.children.length < lines) {
    const line = gutter.children.length + 1;
    const button = make("button", { type: "button", textContent: line, ariaLabel: `Breakpoint in line ${line}`, tabIndex: -1 });
    button.ariaPressed = "false";
    button.addEventListener("click", () => toggleBreakpoint(line));
    gutter.append(button);
  }
}

function toggleBreakpoint(line) {
  const button = byId("gutter").children[line - 1];
  send({ do: "break", line, on: button?.ariaPressed !== "true" });
}

function sendText() {
  clearTimeout(editor.timer);
  editor.timer = null;
  // A text that still waits is replaced, and was made from what the new one was made from.
  const waiting = live.queue.get("text");
  send({ do: "text", text: byId("text").value, version: waiting ? waiting.version : editor.version++ }, "text");
}

function showEditor(state) {
  const { program, run } = state;
  if (state.source !== undefined && (program.version !== editor.version || !editor.timer)) {
    const field = byId("text");
    if (field.value !== state.source) {
      const at = field.selectionStart;
      field.value = state.source;
      field.setSelectionRange(at, at);
    }
    editor.version = program.version;
  }
  if (program.version === editor.version && !editor.timer) editor.problems = program.diagnostics;
  byId("program-name").textContent = program.name + (program.changed ? " *" : "");
  byId("program-name").title = program.changed ? "not saved" : "saved";
  byId("reload").hidden = !program.named || !program.changed;
  byId("reload").disabled = !mine();
  byId("save-program").disabled = !mine() || !program.changed;
  byId("text").readOnly = Boolean(run && !run.ended) || !mine();
  const breakpoints = new Set(program.breakpoints);
  const key = JSON.stringify([program.version, program.diagnostics, byId("text").value.length]);
  if (key !== editor.key) {
    editor.key = key;
    paintText();
    showProblems(byId("text").value.trim() ? program.diagnostics : []);
  }
  followLine(run?.lines[0]?.line);
  const running = new Map((run?.lines ?? []).map((it) => [it.line, it]));
  const marks = JSON.stringify([program.breakpoints, run?.lines, editor.lines]);
  if (marks === editor.marks) return;
  editor.marks = marks;
  [...byId("gutter").children].forEach((button, i) => {
    button.ariaPressed = String(breakpoints.has(i + 1));
    const it = running.get(i + 1);
    button.classList.toggle("now", Boolean(it));
    button.style.setProperty("--hue", it ? armColour(Math.max(0, data.arms.findIndex(({ name }) => name === it.arm))) : "");
    button.title = it ? `${it.process}, line ${it.place}` : "";
  });
}

// The line that runs stays in sight, unless somebody looks elsewhere.
function followLine(line) {
  const field = byId("text");
  if (line === editor.followed || !line) {
    editor.followed = line;
    return;
  }
  editor.followed = line;
  const [top, high] = [(line - 1) * 20, field.clientHeight];
  if (document.activeElement !== field && (top < field.scrollTop || top > field.scrollTop + high - 40)) field.scrollTop = top - high / 3;
}

function showProblems(diagnostics) {
  byId("problems").replaceChildren(
    ...diagnostics.map((it) => {
      const go = make("button", { type: "button", className: it.severity }, make("b", { textContent: `${it.code} line ${it.line}${it.file ? ` of ${it.file}` : ""}` }), ` ${it.text}`, ...it.helps.map((help) => make("small", { textContent: help })));
      go.addEventListener("click", () => {
        if (!editor.problems.length || it.file) return;
        byId("text").focus();
        byId("text").setSelectionRange(it.start, it.end);
      });
      const item = make("li", {}, go);
      if (it.fixes.length) {
        const fix = make("button", { type: "button", textContent: "Fix" });
        fix.addEventListener("click", () => applyFixes(it.fixes));
        item.append(fix);
      }
      return item;
    }),
  );
}

function applyFixes(fixes) {
  // What has been typed since has moved the places of the fixes.
  if (!editor.problems.length) return;
  let text = byId("text").value;
  for (const fix of [...fixes].sort((a, b) => b.start - a.start)) text = text.slice(0, fix.start) + fix.text + text.slice(fix.end);
  byId("text").value = text;
  sendText();
  paintText();
}

function startEditor() {
  const field = byId("text");
  field.addEventListener("input", () => {
    editor.problems = [];
    paintText();
    clearTimeout(editor.timer);
    editor.timer = setTimeout(sendText, TYPED);
  });
  // Tab leads on to the next control, as elsewhere: a line begins below the one before.
  field.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || event.ctrlKey || event.altKey || field.readOnly) return;
    const line = field.value.slice(0, field.selectionStart).split("\n").at(-1);
    const [indent] = /^ */.exec(line);
    if (!indent) return;
    event.preventDefault();
    document.execCommand("insertText", false, `\n${indent}`);
  });
  const follow = () => {
    byId("colours").scrollTop = byId("gutter").scrollTop = field.scrollTop;
    byId("colours").scrollLeft = field.scrollLeft;
  };
  field.addEventListener("scroll", follow);
  byId("reload").addEventListener("click", () => send({ do: "reload" }));
  byId("save-program").addEventListener("click", () => {
    if (editor.timer) sendText();
    save("program");
  });
  paintText();
}
