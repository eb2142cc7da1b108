// Joints of the chosen arm: sliders with what the run has them do, and by which they are moved by hand.

// From where to where a slider goes: the limits, or some way beyond what the run needs.
function sliderEnds(arm, joint, j) {
  if (joint.lower !== null && joint.upper !== null) return [joint.lower, joint.upper];
  const least = joint.kind === "revolute" ? Math.PI : 0.5;
  const most = Math.max(least, 1.2 * largest(arm.q, j));
  return [joint.lower ?? -most, joint.upper ?? most];
}

// The position of every joint of an arm as it is shown.
function shownPositions(arm) {
  const place = presentRow(arm);
  if (!place) return null;
  // What is measured is drawn, and so it is what is told.
  const measured = arm.measured && blend(arm.measured.q, locate(arm.measured.t, now.t));
  return now.jog?.[arm.name] ?? measured ?? blend(arm.q, place);
}

function jogTo(arm, j, value) {
  play(false);
  const q = [...shownPositions(arm)];
  q[j] = value;
  now.jog = { ...now.jog, [arm.name]: q };
  changed();
}

function jointRow(arm, joint, j) {
  const [low, high] = sliderEnds(arm, joint, j);
  const input = make("input", { type: "range", min: low, max: high, step: "any" });
  input.ariaLabel = `${joint.name} of ${arm.name}`;
  input.title = `${quantityText(QUANTITIES[0], joint, low)} to ${quantityText(QUANTITIES[0], joint, high)}`;
  input.disabled = !data.animation?.arms[arm.name] || !arm.t.length;
  input.addEventListener("input", () => jogTo(arm, j, Number(input.value)));
  const name = make("span", { className: "name", textContent: joint.name, title: joint.name });
  return make("div", { className: "joint" }, name, input, make("span", { className: "value" }));
}

function fillJoints(arm) {
  byId("joints").replaceChildren(...arm.joints.map((joint, j) => jointRow(arm, joint, j)));
}

function showReadout() {
  byId("by-hand").hidden = !now.jog;
  const arm = chosenArm();
  const q = arm && shownPositions(arm);
  if (!q) return;
  const jogged = Boolean(now.jog?.[arm.name]);
  byId("readout-name").textContent = `Joints of ${arm.name}${arm.measured && !jogged ? ", measured" : ""}`;
  [...byId("joints").children].forEach((row, j) => {
    const [_, input, value] = row.children;
    if (Number(input.value) !== q[j]) input.value = q[j];
    value.textContent = quantityText(QUANTITIES[0], arm.joints[j], q[j]);
  });
  const figure = data.animation?.arms[arm.name];
  const instant = figure && locate(data.animation.t, now.t);
  const drawn = figure && (arm.measured || jogged);
  const hand = drawn ? toolOf(arm, figure).slice(9) : blend(arm.hand, presentRow(arm));
  const parts = [["hand", `${placeText(hand)} mm`]];
  if (figure?.grip) parts.push(["gripper", gripText(gripOf(figure, instant), arm.measured && figure.opening)]);
  byId("hand").replaceChildren(
    ...parts.map(([name, text]) => make("div", {}, make("span", { textContent: name }), text)),
  );
}

// The pose of the tool of an arm in the world as it is drawn.
function toolOf(arm, figure) {
  return framesAt(figure, positionsOf(arm.name, figure, locate(data.animation.t, now.t))).at(-1);
}

function startJog() {
  byId("by-hand-end").addEventListener("click", () => seek(now.t));
}
