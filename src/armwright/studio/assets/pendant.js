// The pendant: joints, jogging, gripper, solutions.

const HELD_AGAIN = 90; // a jog is kept going by a message so often [ms]
const TURN = 2 * Math.PI;
const holding = { timer: null, button: null };

const chosenArm = () => data.arms[now.arm];
const armState = () => live.state?.arms[chosenArm().name];

// A button that moves something as long as it is held, by pointer or by key; `message` is sent while it is.
function holdButton(text, label, message) {
  const button = make("button", { type: "button", className: "hold", textContent: text, ariaLabel: label, title: label });
  const start = (event) => {
    if (!mine() || holding.button) return;
    event.preventDefault();
    button.focus({ preventScroll: true });
    holding.button = button;
    button.classList.add("held");
    const size = Number(byId("jog-step").value);
    if (size) {
      // One step for a press; a key that is held down makes no more.
      send({ do: "jog", arm: chosenArm().name, share: 1, length: size / MILLIMETRES, angle: (size * Math.PI) / 180, ...message() });
      return;
    }
    const go = () => send({ do: "jog", arm: chosenArm().name, share: jogShare(), ...message() }, "jog");
    go();
    holding.timer = setInterval(go, HELD_AGAIN);
  };
  button.addEventListener("pointerdown", (event) => {
    if (event.button === 0) start(event);
  });
  button.addEventListener("keydown", (event) => {
    if ((event.key === " " || event.key === "Enter") && !event.repeat) start(event);
    if (event.key === " " || event.key === "Enter") event.preventDefault();
  });
  for (const end of ["pointerup", "pointercancel", "pointerleave", "keyup", "blur"]) button.addEventListener(end, letGo);
  return button;
}

function letGo() {
  if (!holding.button) return;
  clearInterval(holding.timer);
  holding.button.classList.remove("held");
  Object.assign(holding, { timer: null, button: null });
  live.queue.delete("jog");
  sendNow({ do: "halt" });
}

// Slow speeds have most of the slider.
function jogShare() {
  return Math.max(0.01, (Number(byId("share").value) / 100) ** 2.5);
}

// The number in a text field, in either spelling; null where there is none.
function typedNumber(field) {
  const value = Number(field.value.replace("−", "-").replace(",", "."));
  return field.value.trim() && Number.isFinite(value) ? value : null;
}

function sliderRow(joint, j) {
  const factor = unitFactor(QUANTITIES[0], joint);
  const [low, high] = [joint.lower ?? (joint.kind === "revolute" ? -TURN : -1), joint.upper ?? (joint.kind === "revolute" ? TURN : 1)];
  const id = `joint-${j + 1}`;
  const slider = make("input", { type: "range", id, min: low, max: high, step: (high - low) / 2000 });
  const typed = make("input", { type: "text", inputMode: "decimal", ariaLabel: `Joint ${j + 1} in ${QUANTITIES[0].units[joint.kind]}` });
  const set = (value) => send({ do: "joint", arm: chosenArm().name, joint: j + 1, value }, `joint ${j}`);
  slider.addEventListener("input", () => set(Number(slider.value)));
  typed.addEventListener("change", () => {
    const value = typedNumber(typed);
    typed.blur();
    if (value !== null) set(value / factor);
    else {
      typed.closest(".slider").dataset.q = "";
      showPendant(live.state);
    }
  });
  const along = (sign) => () => ({ frame: "JOINT", axis: j, sign });
  return make(
    "div",
    { className: "slider" },
    make("label", { htmlFor: id, textContent: `J${j + 1}`, title: `${quantityText(QUANTITIES[0], joint, low)} to ${quantityText(QUANTITIES[0], joint, high)}` }),
    holdButton("−", `Joint ${j + 1} down`, along(-1)),
    slider,
    holdButton("+", `Joint ${j + 1} up`, along(1)),
    make("span", { className: "value" }, typed, QUANTITIES[0].units[joint.kind]),
  );
}

// The frames along whose axes the tool can be moved.
function fillFrames() {
  const frames = byId("jog-frame");
  const names = ["TOOL", "BASE", "WORLD", ...data.animation.frames.map(({ name }) => name)];
  const before = names.includes(frames.value) ? frames.value : "TOOL";
  frames.replaceChildren(
    ...names.map((name, i) => make("option", { value: name, textContent: i < 3 ? `${name.toLowerCase()} axes` : name })),
  );
  frames.value = before;
}

function fillPendant() {
  byId("sliders").replaceChildren(...chosenArm().joints.map(sliderRow));
  fillFrames();
  const frames = byId("jog-frame");
  const names = ["x", "y", "z", "about x", "about y", "about z"];
  byId("jog").replaceChildren(
    ...[1, -1].flatMap((sign) =>
      names.map((name, axis) =>
        holdButton(`${sign > 0 ? "+" : "−"}${name.replace("about ", "r")}`, axis < 3 ? `Move along ${sign > 0 ? "+" : "−"}${name}` : `Turn ${sign > 0 ? "+" : "−"} ${name}`, () => ({
          frame: frames.value,
          axis,
          sign,
        })),
      ),
    ),
  );
}

// Numbers and sliders are read: they follow the view so often [ms].
const READ_AGAIN = 60;
let pendantTimer = 0;

function showPendantSoon() {
  pendantTimer ||= setTimeout(() => {
    pendantTimer = 0;
    showPendant(live.state);
  }, READ_AGAIN);
}

function showPendant(state) {
  const it = state?.arms[chosenArm().name];
  if (!it) return;
  const near = new Set((it.warnings ?? []).filter(({ kind }) => kind === "limit").flatMap(({ joints }) => joints));
  [...byId("sliders").children].forEach((row, j) => {
    const [slider, typed] = [row.querySelector("input[type=range]"), row.querySelector("input[type=text]")];
    const joint = chosenArm().joints[j];
    // An older state does not take back what is being moved.
    const moved = slider.matches(":active") || (document.activeElement === slider && (live.awaiting || live.queue.size));
    row.classList.toggle("near", near.has(j + 1));
    if (!moved && row.dataset.q === String(it.q[j])) return;
    row.dataset.q = moved ? "" : it.q[j];
    if (!moved) slider.value = it.q[j];
    slider.setAttribute("aria-valuetext", quantityText(QUANTITIES[0], joint, it.q[j]));
    if (document.activeElement !== typed) typed.value = number(it.q[j] * unitFactor(QUANTITIES[0], joint), 2);
  });
  [...byId("place").querySelectorAll("input")].forEach((field, k) => {
    if (it.tool && document.activeElement !== field) field.value = number(it.tool[9 + k] * MILLIMETRES, 1).replace("−", "-");
  });
  byId("grip-text").textContent = it.holds.length ? `holds ${it.holds.join(", ")}` : gripText(it.grip);
  showSolutions(it.solutions ?? []);
}

function showSolutions(solutions) {
  const list = byId("solutions");
  // Of solutions their names are seen, and not the numbers of each state.
  const key = JSON.stringify(solutions.map(({ label, fault, here }) => [label, fault, here]));
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  const allowed = solutions.filter(({ fault }) => !fault).length;
  byId("solutions-text").textContent = solutions.length ? `${allowed} of ${solutions.length} within the limits` : "";
  while (list.children.length > solutions.length) list.lastChild.remove();
  while (list.children.length < solutions.length) {
    const number = list.children.length;
    const button = make("button", { type: "button" }, make("span"), make("small"));
    button.addEventListener("click", () => send({ do: "solution", arm: chosenArm().name, number }));
    const item = make("li", {}, button);
    whilePointedAt(
      item,
      () => {
        const q = armState()?.solutions?.[number]?.q;
        overlay.hover = q ? { arm: chosenArm().name, q } : null;
        drawSoon();
      },
      () => {
        overlay.hover = null;
        drawSoon();
      },
    );
    list.append(item);
  }
  solutions.forEach(({ label, fault, here }, i) => {
    const button = list.children[i].firstChild;
    button.firstChild.textContent = label;
    button.lastChild.textContent = fault;
    button.disabled = Boolean(fault);
    button.ariaPressed = String(here);
  });
}

// Where the tool is, to be read and to be typed.
function fillPlace() {
  byId("place").replaceChildren(
    ...["x", "y", "z"].map((name, k) => {
      const field = make("input", { type: "text", inputMode: "decimal", ariaLabel: `Tool ${name} in mm` });
      field.addEventListener("change", () => {
        const value = typedNumber(field);
        const pose = [...armState().tool];
        pose[9 + k] = value / MILLIMETRES;
        if (value !== null) send({ do: "tool", arm: chosenArm().name, pose, leaping: true });
        field.blur();
      });
      return make("label", {}, name, " ", field);
    }),
    "mm",
  );
}

function startPendant() {
  fillPlace();
  fillPendant();
  const speed = () => {
    byId("share-text").textContent = `${number(100 * jogShare(), jogShare() < 0.1 ? 1 : 0)} %`;
  };
  byId("share").addEventListener("input", speed);
  speed();
  byId("open").addEventListener("click", () => send({ do: "grip", arm: chosenArm().name, open: true }));
  byId("close").addEventListener("click", () => send({ do: "grip", arm: chosenArm().name, open: false }));
  byId("undo").addEventListener("click", () => send({ do: "undo" }));
  byId("jog-frame").addEventListener("change", drawSoon);
  // What is held stops when the page is no longer looked at.
  window.addEventListener("blur", letGo);
  window.addEventListener("pagehide", letGo);
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) letGo();
  });
}
