// What stands around the arms: devices and inputs that are switched, cameras that look.

const AGAIN = 300; // a live camera looks again so long after its latest picture [ms]
const looking = { timer: null };

function switchButton(text, press) {
  const button = make("button", { type: "button" }, make("span", { textContent: text }), make("b"));
  button.setAttribute("role", "switch");
  button.addEventListener("click", () => press(button.ariaChecked !== "true"));
  return button;
}

function showSwitch(button, on, disabled) {
  button.ariaChecked = String(on);
  button.lastChild.textContent = on ? "on" : "off";
  button.disabled = disabled;
}

function inputField(input) {
  const field = make("input", { type: "number", step: "any" });
  field.addEventListener("change", () => field.value && send({ do: "input", input, value: Number(field.value) }));
  return make("label", { className: "fields" }, make("span", { textContent: input }), field);
}

// A switch for each digital input, a number for each analogue one; both may be set in a run.
function fillInputs(inputs) {
  const names = Object.keys(inputs);
  const list = byId("inputs");
  byId("inputs-card").hidden = !names.length;
  if (list.dataset.names !== JSON.stringify(names)) {
    list.dataset.names = JSON.stringify(names);
    const one = (input) => (inputs[input].analogue ? inputField(input) : switchButton(input, (on) => send({ do: "input", input, value: Number(on) })));
    list.replaceChildren(...names.map((input) => make("li", {}, one(input))));
  }
  names.forEach((name, i) => {
    const { value, analogue } = inputs[name];
    const control = list.children[i].firstChild;
    if (!analogue) return showSwitch(control, value !== 0, !mine());
    const field = control.lastChild;
    field.disabled = !mine();
    if (document.activeElement !== field) field.value = Number(value.toPrecision(6));
  });
}

function fillDevices(devices) {
  const names = Object.keys(devices);
  const list = byId("devices");
  byId("devices-card").hidden = !names.length;
  if (list.dataset.names !== JSON.stringify(names)) {
    list.dataset.names = JSON.stringify(names);
    list.replaceChildren(
      ...names.map((device) => make("li", {}, switchButton(device, (on) => send({ do: "operate", device, on })))),
    );
  }
  names.forEach((name, i) => {
    showSwitch(list.children[i].firstChild, devices[name], !mine() || Boolean(live.state.run));
  });
}

function askForPicture() {
  clearTimeout(looking.timer);
  if (mine()) send({ do: "look", camera: byId("camera-name").value }, "look");
}

function takePicture(picture, image = byId("camera-picture"), text = byId("camera-text")) {
  image.hidden = !picture;
  if (!picture) return;
  image.src = `data:image/png;base64,${picture.png}`;
  image.alt = `What ${picture.camera} sees. ${picture.text}`;
  text.textContent = picture.text ? `${picture.camera}, ${picture.text}` : picture.camera;
}

function startCellPanel() {
  const cameras = data.cameras;
  byId("cameras-card").hidden = !cameras.length;
  byId("camera-name").append(...cameras.map((name) => make("option", { value: name, textContent: name })));
  byId("look").addEventListener("click", askForPicture);
  byId("camera-name").addEventListener("change", askForPicture);
  byId("camera-live").addEventListener("change", askForPicture);
  answers.picture = (picture) => {
    takePicture(picture);
    if (byId("camera-live").checked && !byId("panel-cell").hidden) looking.timer = setTimeout(askForPicture, AGAIN);
  };
  followers.push((state) => {
    if (!state) return;
    fillDevices(state.devices);
    fillInputs(state.inputs);
    byId("cell-empty").hidden = Boolean(cameras.length || Object.keys({ ...state.devices, ...state.inputs }).length);
    if (state.picture !== undefined) takePicture(state.picture, byId("seen-picture"), byId("seen-text"));
    byId("seen-card").hidden = byId("seen-picture").hidden;
  });
}
