// Charts over time: scales, curves, a cursor at the present instant, and a tip under the pointer. What a chart shows is
// the page's own:
//   label, heading: for those who hear the page, and what stands above the chart
//   span(), powers: lowest and highest value, and whether they are on a scale of powers of ten
//   unitOfTime: SECONDS or MILLISECONDS
//   lines(): the curves: times, values, colour and dash of each, and its width and how opaque it is
//   paint(ink, axes), below: what lies under the curves, and the room it takes below them [pixels]
//   tipAt(t): what is said of an instant; nothing where there is nothing to say

const MARGIN = { left: 50, right: 10, top: 8, bottom: 20 };
// Units of the axis of time: how many of it are a second, its name, the room for a number, and whether it has rules.
const SECONDS = { many: 1, name: "s", room: 55, rules: false };
const MILLISECONDS = { many: 1000, name: "ms", room: 70, rules: true };
let charts = [];
// The times that are shown, from and to; null for all of them.
let timeSpan = null;

const shownTimes = () => timeSpan ?? [0, data.duration || 1];

function axesOf({ span, powers = false, below = 0 }, width, height) {
  const [low, high] = span();
  const [x0, y0] = [MARGIN.left, MARGIN.top];
  const [w, h] = [width - x0 - MARGIN.right, height - y0 - MARGIN.bottom - below];
  const [from, to] = shownTimes();
  const lasts = to - from;
  const part = powers ? (v) => Math.log(high / v) / Math.log(high / low) : (v) => (high - v) / (high - low);
  return {
    low,
    high,
    powers,
    x0,
    y0,
    w,
    h,
    foot: y0 + h + below,
    x: (t) => x0 + ((t - from) / lasts) * w,
    y: (v) => y0 + Math.min(1.05, part(v)) * h,
    t: (x) => from + ((x - x0) / w) * lasts,
  };
}

function rule(ink, x0, y0, x1, y1, colour, dash = []) {
  ink.setLineDash(dash);
  ink.strokeStyle = colour;
  ink.lineWidth = 1;
  ink.beginPath();
  ink.moveTo(x0, y0);
  ink.lineTo(x1, y1);
  ink.stroke();
  ink.setLineDash([]);
}

const decimalsOf = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));

// Values to write at an axis: [value, text, whether it is 0].
function marksOf({ low, high, powers }) {
  const marks = [];
  if (powers) {
    for (let k = Math.ceil(Math.log10(low)); k <= Math.log10(high); k++)
      marks.push([10 ** k, String(Number((10 ** k).toPrecision(3))), false]);
    return marks;
  }
  const step = roundStep(high - low, 5);
  for (let v = Math.ceil(low / step) * step; v <= high; v += step)
    marks.push([v, number(v, decimalsOf(step)), Math.abs(v) < step / 2]);
  return marks;
}

function drawScales(ink, axes, unit) {
  const { x0, y0, w, foot } = axes;
  ink.font = "11px system-ui, sans-serif";
  ink.fillStyle = colours.quiet;
  ink.textAlign = "right";
  for (const [v, text, isZero] of marksOf(axes)) {
    const y = Math.round(axes.y(v)) + 0.5;
    rule(ink, x0, y, x0 + w, y, isZero ? colours.line : colours.faint);
    ink.fillText(text, x0 - 6, y + 4);
  }
  const [from, to] = shownTimes().map((t) => t * unit.many);
  const step = roundStep(to - from, Math.max(2, w / unit.room));
  const first = Math.ceil(from / step - 1e-9);
  ink.textAlign = "center";
  for (let k = first; k * step <= to * 1.0001; k++) {
    const x = axes.x((k * step) / unit.many);
    if (unit.rules) rule(ink, x, y0, x, foot, colours.faint);
    const text = k ? number(k * step, decimalsOf(step)) : "0";
    ink.fillText(k === first ? `${text} ${unit.name}` : text, Math.min(x, x0 + w - 8), foot + 15);
  }
}

// A line with gaps where there is nothing.
function drawLine(ink, axes, { times, values, colour, dash = [], width = axes.powers ? 1.2 : 1.5, alpha = 1 }) {
  ink.setLineDash(dash);
  ink.strokeStyle = colour;
  ink.lineWidth = width;
  ink.globalAlpha = alpha;
  ink.lineJoin = "round";
  ink.beginPath();
  let drawn = false;
  values.forEach((value, i) => {
    if (value !== null) ink[drawn ? "lineTo" : "moveTo"](axes.x(times[i]), axes.y(value));
    drawn = value !== null;
  });
  ink.stroke();
  ink.globalAlpha = 1;
  ink.setLineDash([]);
}

function drawChart(chart) {
  const [ink, width, height] = sharpen(chart.canvas);
  if (!width) return;
  const axes = (chart.axes = axesOf(chart, width, height));
  drawScales(ink, axes, chart.unitOfTime);
  chart.paint?.(ink, axes);
  ink.save();
  ink.beginPath();
  ink.rect(axes.x0, axes.y0, axes.w, axes.h);
  ink.clip();
  for (const line of chart.lines()) drawLine(ink, axes, line);
  ink.restore();
  for (const mark of [chart.cursor, chart.ghost])
    Object.assign(mark.style, { top: `${axes.y0}px`, height: `${axes.foot - axes.y0}px` });
}

function drawCharts() {
  charts.forEach(drawChart);
  moveCursors();
}

function moveCursors() {
  const [from, to] = shownTimes();
  for (const { axes, cursor } of charts) {
    if (!axes) continue;
    cursor.style.left = `${axes.x(now.t)}px`;
    cursor.hidden = now.t < from || now.t > to;
  }
}

function swatch(i) {
  const element = make("span", { className: "swatch" });
  element.style.setProperty("--hue", `var(${hue(i)})`);
  return element;
}

function hover(chart, x) {
  for (const other of charts) {
    other.ghost.hidden = chart === null;
    if (other !== chart) other.tip.hidden = true;
  }
  if (!chart?.axes) return;
  const t = Math.min(Math.max(chart.axes.t(x), 0), data.duration);
  const said = chart.tipAt(t);
  if (!said.length) return;
  for (const other of charts) if (other.axes) other.ghost.style.left = `${other.axes.x(t)}px`;
  chart.tip.replaceChildren(...said);
  chart.tip.hidden = false;
  const [wide, room] = [chart.tip.offsetWidth, chart.canvas.clientWidth];
  chart.tip.style.left = `${x + 14 + wide > room ? Math.max(0, x - 14 - wide) : x + 14}px`;
}

function makeChart(own) {
  const chart = {
    ...own,
    canvas: make("canvas"),
    cursor: make("div", { className: "cursor" }),
    ghost: make("div", { className: "cursor hover", hidden: true }),
    tip: make("div", { className: "tip", hidden: true }),
  };
  const plot = make("div", { className: "plot" }, chart.canvas, chart.cursor, chart.ghost, chart.tip);
  chart.canvas.setAttribute("role", "img");
  chart.canvas.setAttribute("aria-label", chart.label);
  chart.card = make("div", { className: "chart" }, make("h3", {}, ...chart.heading), plot);
  const at = (event) => event.clientX - plot.getBoundingClientRect().left;
  plot.addEventListener("pointermove", (event) => {
    hover(chart, at(event));
    if (event.buttons & 1 && chart.axes) seek(chart.axes.t(at(event)));
  });
  plot.addEventListener("pointerleave", () => hover(null));
  plot.addEventListener("pointerdown", (event) => {
    if (chart.axes) seek(chart.axes.t(at(event)));
  });
  return chart;
}

function startCharts(own) {
  charts = own.map(makeChart);
  byId("charts").append(...charts.map((chart) => chart.card));
  listeners.push(moveCursors);
}
