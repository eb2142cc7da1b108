// Teaching: frames of the cell file, and MOVEs to them.

const editorLine = () => byId("text").value.slice(0, byId("text").selectionStart).split("\n").length;

function frameItem(name) {
  const arm = () => chosenArm().name;
  const go = make("button", { type: "button", textContent: "Go", title: `Bring the tool to ${name}` });
  go.addEventListener("click", () => send({ do: "go to", arm: arm(), name }));
  whilePointedAt(
    go,
    () => mine() && !live.state.run && send({ do: "preview", arm: arm(), name }, "preview"),
    () => mine() && !live.state.run && send({ do: "preview", arm: arm(), name: "" }, "preview"),
  );
  const update = make("button", { type: "button", textContent: "Teach", title: `Give ${name} the pose of the tool` });
  update.addEventListener("click", () => send({ do: "teach", arm: arm(), name }));
  const rename = make("button", { type: "button", textContent: "Rename" });
  rename.addEventListener("click", () => {
    const to = make("input", { type: "text", value: name, ariaLabel: `New name of ${name}` });
    item.firstChild.replaceChildren(to);
    to.focus();
    to.select();
    to.addEventListener("keydown", (event) => {
      if (event.key === "Enter") send({ do: "rename", name, to: to.value });
      if (event.key === "Enter" || event.key === "Escape") to.blur();
    });
    to.addEventListener("blur", () => item.firstChild.replaceChildren(name));
  });
  const forget = make("button", { type: "button", textContent: "Forget", title: `Take ${name} out of the cell file` });
  forget.addEventListener("click", () => send({ do: "forget", name }));
  const item = make("li", {}, make("span", { className: "name" }, name), make("span", { className: "quiet" }), make("span", { className: "group" }, go, update, rename, forget));
  item.dataset.name = name;
  return item;
}

function showTeaching(state) {
  const file = state.file;
  byId("file-name").textContent = file ? `into ${file.name}` : "there is no cell file: begin one with --new";
  const names = Object.keys(state.frames);
  const list = byId("frames");
  if (list.dataset.names !== JSON.stringify([names, file?.frames])) {
    list.dataset.names = JSON.stringify([names, file?.frames]);
    list.replaceChildren(...names.map(frameItem));
    for (const item of list.children)
      for (const button of [...item.querySelectorAll("button")].slice(1))
        button.hidden = !file?.frames.includes(item.dataset.name);
    const on = byId("teach-on");
    const before = on.value || "WORLD";
    on.replaceChildren(...["WORLD", ...names].map((name) => make("option", { value: name, textContent: name })));
    on.value = ["WORLD", ...names].includes(before) ? before : "WORLD";
    followFrames(names);
  }
  for (const item of list.children) item.children[1].textContent = `${placeText(state.frames[item.dataset.name].slice(9))} mm`;
  byId("change-card").hidden = !file?.change;
  if (byId("change").textContent !== (file?.change ?? "")) showChange(file?.change ?? "");
  if (!byId("teach-name").value && document.activeElement !== byId("teach-name")) byId("teach-name").value = freeName(names);
}

function showChange(text) {
  byId("change").replaceChildren(
    ...text.split("\n").map((line) => make("span", { className: line.startsWith("+") ? "added" : line.startsWith("-") ? "removed" : "", textContent: `${line}\n` })),
  );
}

function freeName(names) {
  let number = 1;
  while (names.includes(`P${number}`)) number++;
  return `P${number}`;
}

// The view draws the frames that there are now.
function followFrames(names) {
  data.animation.frames = names.map((name) => ({ name, visible_from: 0, poses: [live.state.frames[name]] }));
  fillFrames();
}

function startTeaching() {
  const name = byId("teach-name");
  const taught = () => {
    name.value = "";
  };
  byId("teach").addEventListener("submit", (event) => {
    event.preventDefault();
    send({ do: "teach", arm: chosenArm().name, name: name.value, on: byId("teach-on").value });
    taught();
  });
  byId("insert").addEventListener("submit", (event) => {
    event.preventDefault();
    send({
      do: "insert",
      arm: chosenArm().name,
      frame: name.value || freeName(Object.keys(live.state.frames)),
      line: editorLine(),
      straight: byId("insert-way").value === "straight",
      speed: Number(byId("insert-speed").value),
    });
    taught();
  });
  byId("touch-up").addEventListener("click", () => send({ do: "touch up", line: editorLine() }));
  byId("unteach").addEventListener("click", () => send({ do: "unteach" }));
  byId("save-cell").addEventListener("click", () => send({ do: "save", what: "cell" }));
}
