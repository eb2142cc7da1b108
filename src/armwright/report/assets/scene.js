// What happened, ready to be asked: the data of the page, the present instant, look-up in time, words for numbers.

const data = JSON.parse(document.getElementById("data").textContent);
const DEGREES = 180 / Math.PI;
const MILLIMETRES = 1000;

// A row written as 0 equals the row before it.
function expand(rows) {
  let last = null;
  return rows && rows.map((row) => (last = row === 0 ? last : row));
}

function unpack() {
  for (const arm of data.arms) {
    for (const key of ["q", "qd", "qdd", "tau", "hand"]) arm[key] = expand(arm[key]);
  }
  if (!data.animation) return;
  for (const figure of Object.values(data.animation.arms)) {
    for (const key of ["points", "hand_axes", "joint_axes"]) figure[key] = expand(figure[key]);
  }
  for (const frame of data.animation.frames) frame.poses = expand(frame.poses);
}
unpack();

// The only thing on the page that changes. `picked` is an effect chosen by hand: several may begin at one instant.
const now = { t: 0, playing: false, rate: 1, arm: 0, picked: null };
const listeners = [];

function changed() {
  for (const listener of listeners) listener();
}

function seek(t, picked = null) {
  now.t = Math.min(Math.max(Number(t) || 0, 0), data.duration);
  now.picked = picked;
  changed();
}

// Where t falls in instants: the row before it, the row after it, and how far it is between them.
function locate(times, t) {
  let low = 0;
  let high = times.length - 1;
  if (high <= 0 || t <= times[0]) return [0, 0, 0];
  if (t >= times[high]) return [high, high, 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle;
  }
  return [low, high, (t - times[low]) / (times[high] - times[low] || 1)];
}

function blend(rows, [i, j, s]) {
  return i === j ? rows[i] : rows[i].map((value, k) => value + s * (rows[j][k] - value));
}

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

function unitFactor(quantity, joint) {
  if (quantity.key === "tau") return 1;
  return joint.kind === "revolute" ? DEGREES : MILLIMETRES;
}

// Lowest and highest value allowed, null where there is no limit.
function limitsOf(quantity, joint) {
  if (quantity.key === "q") return [joint.lower, joint.upper];
  const most = joint[quantity.limit];
  return [most === null ? null : -most, most];
}

// A value as a share of its limit, ±1 at the limits; null where one of them is missing.
function share(quantity, joint, value) {
  const [low, high] = limitsOf(quantity, joint);
  return low === null || high === null ? null : (2 * value - low - high) / (high - low);
}

function number(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

function quantityText(quantity, joint, value) {
  const shown = value * unitFactor(quantity, joint);
  return `${number(shown, Math.abs(shown) < 10 ? 2 : 1)} ${quantity.units[joint.kind]}`.replace(" °", "°");
}

function placeText(p) {
  return p.map((value) => number(value * MILLIMETRES, 1)).join(", ");
}

function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

const HUES = 8;

function hue(i) {
  return `--c${i % HUES}`;
}

// Colours of the style sheet, for canvases; read anew when the scheme changes.
let colours = {};

function readColours() {
  const style = getComputedStyle(document.documentElement);
  const names = [
    "card",
    "ink",
    "quiet",
    "line",
    "faint",
    "accent",
    "bad",
    "sky",
    "floor",
    "shadow",
    "red",
    "green",
    "blue",
    "metal",
  ];
  colours = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  colours.arms = [0, 1, 2, 3].map((i) => style.getPropertyValue(`--arm${i}`).trim());
  colours.hues = Array.from({ length: HUES }, (_, i) => style.getPropertyValue(hue(i)).trim());
}
readColours();

// A canvas as sharp as the screen; returns its context and its size in CSS pixels.
function sharpen(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return [context, width, height];
}

// The round number (1, 2 or 5 times a power of ten) that cuts a range into some `parts`.
function roundStep(range, parts) {
  const raw = range / parts;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((digit) => digit * power >= raw * 0.999) ?? 10);
}
