// The page of a run: messages, the clock and the choice of an arm.

const PACES = [
  [0.25, "¼×"],
  [0.5, "½×"],
  [1, "1×"],
  [2, "2×"],
  [4, "4×"],
];

function messageItem(message) {
  const item = make(
    "li",
    { className: message.severity },
    make("b", { textContent: `${message.severity} ${message.code}`.trim() }),
    message.text,
  );
  if (message.line !== null) {
    const link = make("button", { type: "button", textContent: `line ${message.line}` });
    link.addEventListener("click", () => showLine(message.line));
    item.append(" (", link, ")");
  }
  return item;
}

// Messages that are shown at once; a button after them shows the others.
const FIRST_MESSAGES = 2;

function fillMessages() {
  const items = data.messages.map(messageItem);
  const rest = items.slice(FIRST_MESSAGES);
  byId("messages").append(...items);
  if (!rest.length) return;
  for (const item of rest) item.classList.add("folded");
  const more = make("button", { type: "button", textContent: `${rest.length} more` });
  more.className = "more";
  more.addEventListener("click", () => {
    for (const item of rest) item.classList.remove("folded");
    more.remove();
  });
  items[FIRST_MESSAGES - 1].append(more);
}

function presentRow(arm) {
  return arm.t.length ? locate(arm.t, now.t) : null;
}

function showClock() {
  slider.value = now.t;
  const effect = data.effects[presentEffect()];
  byId("clock").textContent = `${number(now.t, 2)} / ${number(data.duration, 2)} s`;
  slider.setAttribute(
    "aria-valuetext",
    `${now.t.toFixed(2)} seconds of ${data.duration.toFixed(2)}${effect ? `, line ${effect.line}` : ""}`,
  );
  byId("now").replaceChildren(
    ...(effect ? [make("b", { textContent: `line ${effect.line}` }), `  ${effect.text}`] : []),
  );
}

function chooseArm(i) {
  now.arm = i;
  const arm = chosenArm();
  for (const group of document.querySelectorAll(".arms"))
    [...group.children].forEach((button, k) => {
      button.ariaPressed = String(k === i);
    });
  byId("readout-name").textContent = `Joints of ${arm.name}`;
  fillJoints(arm);
  chooseArmInCharts();
  changed();
}

function fillArms() {
  byId("readout").hidden = !data.arms.length;
  if (data.arms.length > 1) {
    for (const group of document.querySelectorAll(".arms")) {
      group.append(
        ...data.arms.map((arm, i) => {
          const button = make("button", { type: "button", textContent: arm.name });
          button.addEventListener("click", () => chooseArm(i));
          return button;
        }),
      );
    }
  }
  if (data.arms.length) chooseArm(0);
}

function startDrawer() {
  byId("drawer").addEventListener("click", () => {
    const open = byId("beside").hidden;
    byId("beside").hidden = !open;
    byId("drawer").ariaPressed = String(open);
    document.querySelector("main").classList.toggle("alone", !open);
  });
}

// The view is as high as the first screen leaves room for.
function fitStage() {
  const top = canvas.getBoundingClientRect().top + window.scrollY;
  document.body.style.setProperty("--room", `${window.innerHeight - top - byId("dock").offsetHeight - 28}px`);
}

function redraw() {
  readColours();
  drawView();
  drawCharts();
}

function start() {
  fillMessages();
  fillProgram();
  fillTrace();
  fillStages();
  fillPictures();
  fitStage();
  byId("tree-card").hidden = !tree.changes.length;
  startView({ scrolls: true });
  startDrawer();
  window.addEventListener("resize", fitStage);
  startJog();
  startJointCharts();
  listeners.push(showClock, showProgram, showStages, showPictures, showReadout, drawView);
  if (tree.changes.length) listeners.push(showTree);
  fillArms();
  startClock({
    paces: PACES,
    pace: 1,
    step: 1 / (data.animation?.fps ?? 25),
    leap: 1,
    redraw,
    watched: [canvas, byId("charts")],
  });
  seek(0);
}

// What a test, or a curious reader at the console, may ask.
window.armwright = {
  seek,
  bodies: () => bodiesAt(now.t).bodies,
  drawnBy: () => (graphics ? "processor" : "painter"),
  labels: () => labelBoxes.map(({ x, y, wide }) => ({ x, y, wide, high: LABEL_HEIGHT })),
  state: () => {
    const arm = chosenArm();
    const place = arm && presentRow(arm);
    return {
      time: now.t,
      playing: now.playing,
      arm: arm?.name ?? null,
      q: place ? (now.jog?.[arm.name] ?? blend(arm.q, place)) : [],
      hand: place ? blend(arm.hand, place) : null,
      tool: place && data.animation ? toolOf(arm, data.animation.arms[arm.name]) : null,
      jog: Boolean(now.jog),
      line: data.effects[presentEffect()]?.line ?? null,
      stage: arm ? stageAt(arm.name, now.t) : -1,
    };
  },
};

start();
