// The page of a run: messages, readouts and the choice of an arm.

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

function jointRow(joint) {
  const [low, high] = [joint.lower, joint.upper];
  const range = make(
    "span",
    { className: low === null || high === null ? "range none" : "range", title: "" },
    make("i"),
  );
  if (low !== null && high !== null)
    range.title = `${quantityText(QUANTITIES[0], joint, low)} to ${quantityText(QUANTITIES[0], joint, high)}`;
  else range.firstChild.hidden = true;
  return make(
    "div",
    { className: "joint" },
    make("span", { className: "name", textContent: joint.name, title: joint.name }),
    make("span", { className: "value" }),
    range,
  );
}

function presentRow(arm) {
  return arm.t.length ? locate(arm.t, now.t) : null;
}

function showReadout() {
  const arm = chosenArm();
  const place = arm && presentRow(arm);
  if (!place) return;
  // What is measured is drawn, and so it is what is told.
  const q = arm.measured ? blend(arm.measured.q, locate(arm.measured.t, now.t)) : blend(arm.q, place);
  [...byId("joints").children].forEach((row, j) => {
    row.children[1].textContent = quantityText(QUANTITIES[0], arm.joints[j], q[j]);
    const part = share(QUANTITIES[0], arm.joints[j], q[j]);
    if (part !== null) row.children[2].firstChild.style.left = `${Math.min(100, Math.max(0, 50 + 50 * part))}%`;
  });
  const figure = data.animation?.arms[arm.name];
  const instant = figure && locate(data.animation.t, now.t);
  const hand = arm.measured && figure ? framesOf(figure, instant).at(-1).slice(9) : blend(arm.hand, place);
  const parts = [["hand", `${placeText(hand)} mm`]];
  if (figure) parts.push(["gripper", gripText(gripOf(figure, instant), arm.measured && figure.opening)]);
  byId("hand").replaceChildren(
    ...parts.map(([name, text]) => make("div", {}, make("span", { textContent: name }), text)),
  );
}

// Fingers whose opening [m] was measured, or is known to be a share of the largest.
function gripText(grip, opening) {
  if (opening) return `${number(grip * opening * MILLIMETRES, 1)} mm open`;
  return grip > 0.99 ? "open" : grip < 0.01 ? "closed" : `${number(100 * grip, 0)} % open`;
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
  byId("joints").replaceChildren(...arm.joints.map(jointRow));
  byId("readout-name").textContent = `Joints of ${arm.name}${arm.measured ? ", measured" : ""}`;
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

function redraw() {
  readColours();
  drawView();
  drawCharts();
}

function start() {
  byId("messages").append(...data.messages.map(messageItem));
  fillProgram();
  fillTrace();
  fillStages();
  fillPictures();
  byId("tree-card").hidden = !tree.changes.length;
  startView();
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
  labels: () => labelBoxes.map(({ x, y, wide }) => ({ x, y, wide, high: LABEL_HEIGHT })),
  state: () => {
    const arm = chosenArm();
    const place = arm && presentRow(arm);
    return {
      time: now.t,
      playing: now.playing,
      arm: arm?.name ?? null,
      q: place ? blend(arm.q, place) : [],
      hand: place ? blend(arm.hand, place) : null,
      line: data.effects[presentEffect()]?.line ?? null,
      stage: arm ? stageAt(arm.name, now.t) : -1,
    };
  },
};

start();
