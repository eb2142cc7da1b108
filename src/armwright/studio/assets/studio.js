// The page of a studio: takes states, draws them, says what is wrong, and which page commands.

const STATS = { drawn: 0, states: 0 };
let drawing = false;

function drawSoon() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    drawView();
    STATS.drawn++;
    if (film.recorder) filmFrame();
  });
}

function applyState(state) {
  for (const [name, arm] of Object.entries(state.arms)) {
    const figure = data.animation.arms[name];
    figure.q = [arm.q];
    figure.grip = [arm.grip];
  }
  for (const part of data.animation.parts) {
    const { arm, pose } = state.around.parts[part.name];
    Object.assign(part, { arms: [arm], poses: [pose] });
  }
  for (const frame of data.animation.frames) if (state.around.frames[frame.name]) frame.poses = [state.around.frames[frame.name]];
}

function warningItem({ level, text }) {
  return make("li", { className: level === "collision" ? "error" : level }, make("b", { textContent: { note: "Note", warning: "Warning", error: "Error", collision: "Collision" }[level] }), text);
}

function showWarnings(state) {
  const found = [];
  if (state.refusal) found.push({ level: "error", text: state.refusal });
  if (state.near) {
    const apart = state.near.distance;
    const both = state.near.bodies.join(" and ");
    if (apart <= 0) found.push({ level: "collision", text: `${both} meet, ${number(-apart * MILLIMETRES, 1)} mm deep` });
    else found.push({ level: apart < 0.01 ? "warning" : "note", text: `${both} are ${number(apart * MILLIMETRES, 1)} mm apart` });
  }
  for (const [name, arm] of Object.entries(state.arms))
    for (const warning of arm.warnings ?? [])
      found.push({ ...warning, text: data.arms.length > 1 ? `${name}: ${warning.text}` : warning.text });
  const key = JSON.stringify(found);
  const list = byId("warnings");
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...found.map(warningItem));
  // Whoever listens hears what stops a motion, and not every tenth of a millimetre.
  const said = found.filter(({ level }) => level === "error" || level === "collision").map(({ text }) => text.replace(/[\d.]+/g, "")).join(". ");
  if (byId("said").textContent !== said) byId("said").textContent = said;
}

function showLink(state) {
  const line = byId("link");
  const text = live.lost
    ? "The connection is lost; trying again."
    : !state
      ? "Connecting."
      : !state.ready
        ? "The equations of the arm are being compiled."
        : state.control.mine
          ? state.control.asked
            ? "Another page asks for control."
            : state.run && !state.run.ended
              ? "A program runs: stop it to move arms by hand or to edit."
              : ""
          : "Another page has control; this one follows.";
  if (line.textContent !== text) line.textContent = text;
  line.classList.toggle("bad", live.lost);
  document.body.classList.toggle("off", !mine());
  byId("undo").disabled = !mine() || !state.undo;
  const button = byId("control");
  button.hidden = !state || live.lost || (state.control.mine && !state.control.asked);
  button.textContent = state?.control.mine ? "Hand over" : state?.control.asking ? "Asked" : "Ask for control";
  button.disabled = Boolean(state?.control.asking);
  for (const control of document.querySelectorAll("#panel-move input, .hold, #open, #close")) control.disabled = !canMove();
  for (const control of document.querySelectorAll("#panel-teach button, #panel-teach input")) control.disabled = !mine();
}

function takeArm(i) {
  now.arm = i;
  [...byId("arms").children].forEach((button, k) => {
    button.ariaPressed = String(k === i);
  });
  fillPendant();
  showPendant(live.state);
  showComparison();
  drawSoon();
}

function onKeyDown(event) {
  if (event.key === "Escape") {
    letGo();
    Object.assign(gizmo, { drag: null, target: null });
    sendNow({ do: "halt" });
    if (live.state?.run?.playing) send({ do: "pause" });
  }
  if ((event.ctrlKey || event.metaKey) && event.key === "s" && mine()) {
    event.preventDefault();
    saveAll();
  }
  if ((event.ctrlKey || event.metaKey) && event.key === "z" && !event.target.matches("textarea, input[type=text], input[type=number]")) {
    event.preventDefault();
    send({ do: "undo" });
  }
}

function start() {
  startGizmo();
  startView();
  overpaint.push(paintMap, paintPaths, paintGhost, paintGizmo);
  startOverlays();
  startStrip();
  startPendant();
  startTeaching();
  startEditor();
  startAssistance();
  startRunning();
  startCellPanel();
  startComparing();
  if (data.arms.length > 1)
    byId("arms").append(
      ...data.arms.map(({ name }, i) => {
        const button = make("button", { type: "button", textContent: name });
        button.addEventListener("click", () => takeArm(i));
        return button;
      }),
    );
  takeArm(0);
  byId("control").addEventListener("click", () => send(live.state.control.mine ? { do: "answer", give: true } : { do: "ask" }));
  document.addEventListener("keydown", onKeyDown);
  followers.push((state) => {
    if (state) {
      STATS.states++;
      applyState(state);
      showWarnings(state);
      showPendantSoon();
      showTeaching(state);
      showEditor(state);
      showModules(state);
      showRun(state);
    }
    showLink(state);
    drawSoon();
  });
  const redraw = () => {
    readColours();
    drawSoon();
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new ResizeObserver(redraw).observe(canvas);
  showLink(null);
  connect();
  window.studio = { live, stats: STATS, send, map: () => overlay.map, gizmo: () => handles().map(({ kind, k, points }) => ({ kind, k, points: points.map(project) })) };
}
start();
