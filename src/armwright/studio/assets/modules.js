// Modules: the files that the program IMPORTs, to be read here, with breakpoints; they are changed elsewhere.

const shown = { files: null, marks: "" };

function moduleLine(path, pieces, line) {
  const button = make("button", { type: "button", textContent: line, ariaLabel: `Breakpoint in line ${line} of ${path}` });
  button.ariaPressed = "false";
  button.addEventListener("click", () => send({ do: "break", line, file: path, on: button.ariaPressed !== "true" }));
  const text = pieces.map(({ part, name }) => (name ? make("span", { className: name, textContent: part }) : part));
  return make("li", {}, button, make("code", {}, ...text));
}

function moduleFile({ path, text }) {
  const lines = make("ol");
  const file = make("details", {}, make("summary", { textContent: text === null ? `${path} (too long to be shown)` : path }), lines);
  file.dataset.path = path;
  // Of a file that nobody reads no line is made.
  file.addEventListener("toggle", () => {
    if (!file.open || lines.children.length || text === null) return;
    lines.append(...byLine(colouredText(text).map((piece) => ({ ...piece })), text).map((pieces, i) => moduleLine(path, pieces, i + 1)));
    shown.marks = "";
    if (live.state) markModules(live.state);
  });
  return file;
}

function showModules(state) {
  const modules = state.modules ?? [];
  const list = byId("modules");
  if (modules !== shown.files) {
    const open = [...list.querySelectorAll("details[open]")].map(({ dataset }) => dataset.path);
    const same = JSON.stringify(modules) === JSON.stringify(shown.files);
    shown.files = modules;
    if (!same) {
      list.hidden = !modules.length;
      list.replaceChildren(...modules.map(moduleFile));
      for (const file of list.children) file.open = open.includes(file.dataset.path);
    }
  }
  markModules(state);
}

function markModules({ program, run }) {
  const within = (run?.lines ?? []).filter(({ file }) => file);
  const marks = JSON.stringify([program.module_breakpoints, within]);
  if (marks === shown.marks) return;
  shown.marks = marks;
  const breakpoints = new Set(program.module_breakpoints.map(([path, line]) => `${line} ${path}`));
  for (const file of byId("modules").children) {
    const here = within.filter((it) => it.file === file.dataset.path);
    if (here.length && !run.playing) file.open = true;
    [...file.querySelectorAll("li")].forEach(({ firstChild: button }, i) => {
      button.ariaPressed = String(breakpoints.has(`${i + 1} ${file.dataset.path}`));
      button.classList.toggle("now", here.some((it) => it.inner === i + 1));
    });
  }
}
