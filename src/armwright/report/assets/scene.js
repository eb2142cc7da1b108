// What happened to arms, ready to be asked: effects, stages, and joint quantities with their limits.

function unpack() {
  for (const arm of data.arms) {
    for (const key of ["q", "qd", "qdd", "tau", "hand"]) arm[key] = expand(arm[key]);
    for (const key of ["q", "qd", "tau", "error"]) if (arm.measured) arm.measured[key] = expand(arm.measured[key]);
  }
  if (!data.animation) return;
  for (const figure of Object.values(data.animation.arms))
    for (const key of ["q", "planned"]) figure[key] = expand(figure[key]);
  for (const frame of data.animation.frames) frame.poses = expand(frame.poses);
}
unpack();

// A hair after an instant still belongs to it: the slider and the data are rounded differently.
const HAIR = 1e-6;

function lastBegun(items, t) {
  let found = -1;
  items.forEach((item, i) => {
    if (item.t0 <= t + HAIR) found = i;
  });
  return found;
}

function presentEffect() {
  return now.picked ?? lastBegun(data.effects, now.t);
}

// The stage of an arm at t, or -1 between stages.
function stageAt(arm, t) {
  let found = -1;
  data.stages.forEach((stage, i) => {
    if (stage.arm === arm && stage.t0 <= t + HAIR && t <= stage.t1 + HAIR) found = i;
  });
  return found;
}

const QUANTITIES = [
  { key: "q", title: "Position", units: { revolute: "°", prismatic: "mm" } },
  { key: "qd", title: "Speed", limit: "speed", units: { revolute: "°/s", prismatic: "mm/s" } },
  { key: "qdd", title: "Acceleration", limit: "acceleration", units: { revolute: "°/s²", prismatic: "mm/s²" } },
  { key: "tau", title: "Effort", limit: "effort", units: { revolute: "N m", prismatic: "N" } },
];
// Measured less planned; it has no limit.
const TRACKING = { key: "error", title: "Tracking error", units: { revolute: "mrad", prismatic: "mm" } };

function unitFactor(quantity, joint) {
  if (quantity === TRACKING) return 1000;
  if (quantity.key === "tau") return 1;
  return joint.kind === "revolute" ? DEGREES : MILLIMETRES;
}

// Lowest and highest value allowed, null where there is no limit.
function limitsOf(quantity, joint) {
  if (quantity === TRACKING) return [null, null];
  if (quantity.key === "q") return [joint.lower, joint.upper];
  const most = joint[quantity.limit];
  return [most === null ? null : -most, most];
}

// A value as a share of its limit, ±1 at the limits; null where one of them is missing.
function share(quantity, joint, value) {
  const [low, high] = limitsOf(quantity, joint);
  return low === null || high === null ? null : (2 * value - low - high) / (high - low);
}

function quantityText(quantity, joint, value) {
  const shown = value * unitFactor(quantity, joint);
  return `${number(shown, Math.abs(shown) < 10 ? 2 : 1)} ${quantity.units[joint.kind]}`.replace(" °", "°");
}

function placeText(p) {
  return p.map((value) => number(value * MILLIMETRES, 1)).join(", ");
}

// Fingers whose opening [m] was measured, or is known to be a share of the largest.
function gripText(grip, opening = 0) {
  if (opening) return `${number(grip * opening * MILLIMETRES, 1)} mm open`;
  return grip > 0.99 ? "open" : grip < 0.01 ? "closed" : `${number(100 * grip, 0)} % open`;
}
