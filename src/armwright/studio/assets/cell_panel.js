// What stands around the arms: devices that are switched, cameras that look.

const AGAIN = 300; // a live camera looks again so long after its latest picture [ms]
const looking = { timer: null };

function fillDevices(devices) {
  const names = Object.keys(devices);
  const list = byId("devices");
  byId("devices-card").hidden = !names.length;
  if (list.dataset.names !== JSON.stringify(names)) {
    list.dataset.names = JSON.stringify(names);
    list.replaceChildren(
      ...names.map((device) => {
        const button = make("button", { type: "button" }, make("span", { textContent: device }), make("b"));
        button.setAttribute("role", "switch");
        button.addEventListener("click", () => send({ do: "operate", device, on: button.ariaChecked !== "true" }));
        return make("li", {}, button);
      }),
    );
  }
  names.forEach((name, i) => {
    const button = list.children[i].firstChild;
    button.ariaChecked = String(devices[name]);
    button.lastChild.textContent = devices[name] ? "on" : "off";
    button.disabled = !mine() || Boolean(live.state.run);
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
    byId("cell-empty").hidden = Boolean(cameras.length || Object.keys(state.devices).length);
    if (state.picture !== undefined) takePicture(state.picture, byId("seen-picture"), byId("seen-text"));
    byId("seen-card").hidden = byId("seen-picture").hidden;
  });
}
