// What every page of a run is made of: its data, the present instant, look-up in time, words for numbers, canvases.

const data = JSON.parse(document.getElementById("data").textContent);
const DEGREES = 180 / Math.PI;
const MILLIMETRES = 1000;

// A row written as 0 equals the row before it.
function expand(rows) {
  let last = null;
  return rows && rows.map((row) => (last = row === 0 ? last : row));
}

// The only thing on the page that changes. `picked` is an effect chosen by hand: several may begin at one instant; `jog`
// are the joint positions of arms that were moved by hand, by name, null where the run is shown.
const now = { t: 0, playing: false, rate: 1, arm: 0, picked: null, jog: null };
const listeners = [];

function changed() {
  for (const listener of listeners) listener();
}

function seek(t, picked = null) {
  now.t = Math.min(Math.max(Number(t) || 0, 0), data.duration);
  now.picked = picked;
  now.jog = null;
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

function number(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

const byId = (id) => document.getElementById(id);

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
    "fixture",
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
