// Teaching: frames of the cell file, and MOVEs to them.

// The line of the cursor, in the text that the server has.
function editorLine() {
  if (editor.timer) sendText();
  return cursorLine();
}

const cursorLine = () => byId("text").value.slice(0, byId("text").selectionStart).split("\n").length;

// Of what is taught, a frame or a joint target, with what can be done with it.
function taughtItem(name, isTarget) {
  const arm = () => (isTarget ? live.state.around.targets[name].arm : chosenArm().name);
  const go = make("button", { type: "button", textContent: "Go", title: isTarget ? `Bring the joints to ${name}` : `Bring the tool to ${name}` });
  go.addEventListener("click", () => send({ do: "go to", arm: arm(), name }));
  whilePointedAt(
    go,
    () => mine() && !live.state.run && send({ do: "preview", arm: arm(), name }, "preview"),
    () => mine() && !live.state.run && send({ do: "preview", arm: arm(), name: "" }, "preview"),
  );
  const update = make("button", { type: "button", textContent: "Teach", title: isTarget ? `Give ${name} the joint positions shown` : `Give ${name} the pose of the tool` });
  update.addEventListener("click", () => send({ do: isTarget ? "teach joints" : "teach", arm: arm(), name }));
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
  const insert = make("button", { type: "button", textContent: "Insert", title: `Insert a MOVE to ${name} behind the cursor` });
  insert.addEventListener("click", () => {
    const form = byId("insert-form").value;
    send({ do: "insert", arm: arm(), frame: name, line: editorLine(), teach: false, straight: form === "straight", speed: Number(byId("insert-speed").value) });
  });
  const forget = make("button", { type: "button", textContent: "Forget", title: `Take ${name} out of the cell file` });
  forget.addEventListener("click", () => send({ do: "forget", name }));
  const item = make("li", {}, make("span", { className: "name" }, name), make("span", { className: "quiet" }), make("span", { className: "group" }, go, ...(isTarget ? [] : [insert]), update, rename, forget));
  item.dataset.name = name;
  return item;
}

function showTeaching(state) {
  const file = state.file;
  byId("file-name").textContent = file ? (file.named ? `into ${file.name}` : "into a new cell file") : "there is no cell file";
  const [frames, targets] = [Object.keys(state.around.frames), Object.keys(state.around.targets)];
  const names = [...frames, ...targets];
  const list = byId("frames");
  const key = JSON.stringify([frames, targets, file?.frames]);
  if (list.dataset.names !== key) {
    list.dataset.names = key;
    list.replaceChildren(...names.map((name, i) => taughtItem(name, i >= frames.length)));
    frames.forEach((name, i) => {
      for (const button of [...list.children[i].querySelectorAll("button")].slice(2)) button.hidden = !file?.frames.includes(name.toUpperCase());
    });
    const on = byId("teach-on");
    const before = on.value || "WORLD";
    on.replaceChildren(...["WORLD", ...frames.filter((name) => file?.frames.includes(name.toUpperCase()) || name === "STATION")].map((name) => make("option", { value: name, textContent: name })));
    on.value = ["WORLD", ...frames].includes(before) ? before : "WORLD";
    followFrames(frames);
  }
  names.forEach((name, i) => {
    const target = state.around.targets[name];
    list.children[i].children[1].textContent = target ? `joints${data.arms.length > 1 ? ` of ${target.arm}` : ""}` : `${placeText(state.around.frames[name].slice(9))} mm`;
  });
  byId("change-card").hidden = !file?.change;
  if (byId("change").textContent !== (file?.change ?? "")) showChange(file?.change ?? "");
  if (teaching.asked && names.some((one) => one.toUpperCase() === teaching.asked)) {
    if (byId("teach-name").value.toUpperCase() === teaching.asked) byId("teach-name").value = "";
    teaching.asked = "";
  }
  showTeachButton(names);
  if (!byId("teach-name").value && document.activeElement !== byId("teach-name")) byId("teach-name").value = freeName(names);
}

const teaching = { asked: "" };

function showTeachButton(names) {
  const name = byId("teach-name").value.toUpperCase();
  const known = names.some((one) => one.toUpperCase() === name);
  byId("teach-pose").textContent = known ? `Teach ${name} again` : "Teach the tool's pose";
}

// Saves, and asks for a name where there is none yet.
function save(what) {
  const it = what === "cell" ? live.state.file : live.state.program;
  if (!it || it.named) {
    send({ do: "save", what });
    return;
  }
  const [dialog, field] = [byId("name-dialog"), byId("file-name-field")];
  field.value = it.name;
  dialog.onclose = () => dialog.returnValue === "save" && send({ do: "save", what, name: field.value.trim() });
  dialog.returnValue = "";
  dialog.showModal();
}

function saveAll() {
  if (editor.timer) sendText();
  if (live.state.program.changed) save("program");
  else if (live.state.file?.change) save("cell");
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
  data.animation.frames = names.map((name) => ({ name, visible_from: 0, poses: [live.state.around.frames[name]] }));
  fillFrames();
}

function startTeaching() {
  const name = byId("teach-name");
  // A name is kept until what has it is there: it may have been refused.
  const taught = () => {
    teaching.asked = name.value.toUpperCase();
  };
  name.addEventListener("input", () => showTeachButton(Object.keys(live.state.around.frames)));
  byId("teach").addEventListener("submit", (event) => {
    event.preventDefault();
    send({ do: "teach", arm: chosenArm().name, name: name.value, on: byId("teach-on").value });
    taught();
  });
  byId("teach-joints").addEventListener("click", () => {
    send({ do: "teach joints", arm: chosenArm().name, name: name.value });
    taught();
  });
  const form = byId("insert-form");
  const value = (id, unit = 1) => (byId(id).closest("label").hidden ? 0 : Number(byId(id).value) / unit);
  // Of the fields only those are shown that the form has.
  const choose = () => {
    for (const label of byId("insert").querySelectorAll("[data-of]")) label.hidden = !label.dataset.of.split(" ").includes(form.value);
  };
  form.addEventListener("change", choose);
  choose();
  byId("insert").addEventListener("submit", (event) => {
    event.preventDefault();
    const common = { arm: chosenArm().name, frame: name.value || freeName([...Object.keys(live.state.around.frames), ...Object.keys(live.state.around.targets)]), line: editorLine() };
    if (form.value === "via") send({ do: "via", ...common, blend: value("insert-blend", MILLIMETRES) });
    else
      send({
        do: "insert",
        ...common,
        straight: form.value === "straight",
        approach: value("insert-approach", MILLIMETRES),
        departure: value("insert-departure", MILLIMETRES),
        speed: value("insert-speed"),
      });
    taught();
  });
  byId("touch-up").addEventListener("click", () => send({ do: "touch up", line: editorLine() }));
  byId("unteach").addEventListener("click", () => send({ do: "unteach" }));
  byId("save-cell").addEventListener("click", () => save("cell"));
  byId("name-dialog").querySelector("form").addEventListener("submit", () => {
    byId("name-dialog").returnValue = "save";
  });
  byId("name-cancel").addEventListener("click", () => byId("name-dialog").close(""));
  addEventListener("beforeunload", (event) => {
    if (mine() && (live.state.program.changed || live.state.file?.change)) event.preventDefault();
  });
}
