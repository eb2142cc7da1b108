// Charts over time, with a cursor at the present instant: error, forces, energy.

const MARGIN = { left: 50, right: 10, top: 8, bottom: 20 };
const BAND = 5;
let charts = [];

const column = (rows, i, factor = 1) => rows.map((row) => (row[i] === null ? null : row[i] * factor));

function chartsOf() {
  const [x, y] = [0, 1].map((i) => column(data.error_um, i, 1e-3));
  const far = x.map((value, i) => (value === null ? null : Math.hypot(value, y[i])));
  const forces = data.pins.map((pin, i) => ({
    name: pin.name,
    // What flies carries nothing, and has no place on a scale of powers of ten.
    values: column(data.forces_N, i).map((force) => (force > 0 ? force : null)),
  }));
  const energy = [0, 1, 2, 3, 4, 5].map((i) => column(data.energy_J, i));
  const from = (values) => values.map((value) => (value === null ? null : value - values[0]));
  return [
    {
      title: "Error of the tip",
      unit: "mm",
      digits: 3,
      lines: [
        { name: "E", values: far },
        { name: "x", values: x },
        { name: "y", values: y },
      ],
    },
    { title: "Contact forces", unit: "N", digits: 1, lines: forces, powers: true, bands: true },
    {
      title: "Energy given and held",
      unit: "J",
      digits: 4,
      lines: [
        { name: "given by drives", values: energy[0] },
        { name: "of motion", values: from(energy[1]) },
        { name: "of height", values: energy[2] },
      ],
    },
    {
      title: "Energy lost",
      unit: "J",
      digits: 5,
      lines: [
        { name: "impacts", values: energy[3] },
        { name: "friction", values: energy[4] },
        { name: "not explained", values: energy[5] },
      ],
    },
  ];
}

function spanOf(chart) {
  let [low, high] = [Infinity, -Infinity];
  for (const { values } of chart.lines)
    for (const value of values) {
      if (value === null) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  if (low > high) return chart.powers ? [1, 10] : [0, 1];
  if (chart.powers) return [Math.max(low, high * 1e-5) / 1.5, high * 1.5];
  [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const pad = 0.07 * (high - low || 1);
  return [low < 0 ? low - pad : 0, high + pad];
}

function axesOf(chart, width, height) {
  const [low, high] = chart.span;
  const below = chart.bands ? BAND * chart.lines.length + 4 : 0;
  const [x0, y0] = [MARGIN.left, MARGIN.top];
  const [w, h] = [width - x0 - MARGIN.right, height - y0 - MARGIN.bottom - below];
  const lasts = data.duration || 1;
  const part = chart.powers ? (v) => Math.log(high / v) / Math.log(high / low) : (v) => (high - v) / (high - low);
  return {
    low,
    high,
    x0,
    y0,
    w,
    h,
    foot: y0 + h + below,
    x: (t) => x0 + (t / lasts) * w,
    y: (v) => y0 + Math.min(1.05, part(v)) * h,
    t: (x) => ((x - x0) / w) * lasts,
  };
}

function rule(ink, x0, y0, x1, y1, colour) {
  ink.strokeStyle = colour;
  ink.lineWidth = 1;
  ink.beginPath();
  ink.moveTo(x0, y0);
  ink.lineTo(x1, y1);
  ink.stroke();
}

function marksOf(chart, { low, high }) {
  if (chart.powers) {
    const marks = [];
    for (let k = Math.ceil(Math.log10(low)); k <= Math.log10(high); k++) marks.push([10 ** k, String(Number((10 ** k).toPrecision(3)))]);
    return marks;
  }
  const step = roundStep(high - low, 5);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const marks = [];
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) marks.push([v, number(v, decimals)]);
  return marks;
}

function drawScales(ink, chart, axes) {
  const { x0, y0, w, foot } = axes;
  ink.font = "11px system-ui, sans-serif";
  ink.fillStyle = colours.quiet;
  ink.textAlign = "right";
  for (const [v, text] of marksOf(chart, axes)) {
    const y = Math.round(axes.y(v)) + 0.5;
    rule(ink, x0, y, x0 + w, y, v === 0 ? colours.line : colours.faint);
    ink.fillText(text, x0 - 6, y + 4);
  }
  const milliseconds = data.duration * 1000 || 1;
  const step = roundStep(milliseconds, Math.max(2, w / 70));
  ink.textAlign = "center";
  for (let t = 0; t <= milliseconds * 1.0001; t += step) {
    const x = axes.x(t / 1000);
    rule(ink, x, y0, x, foot, colours.faint);
    ink.fillText(t ? String(Number(t.toPrecision(6))) : "0 ms", Math.min(x, x0 + w - 8), foot + 15);
  }
}

// A line with gaps where there is nothing; on a scale of powers it comes from the foot and goes back there, so that a
// blow of one row is seen.
function drawLine(ink, axes, values, colour, powers) {
  const foot = axes.y0 + axes.h;
  ink.strokeStyle = colour;
  ink.lineWidth = powers ? 1.2 : 1.5;
  ink.lineJoin = "round";
  ink.beginPath();
  let last = null;
  values.forEach((value, i) => {
    if (value === null) {
      if (last !== null && powers) ink.lineTo(last, foot);
      last = null;
      return;
    }
    const [x, y] = [axes.x(data.t[i]), axes.y(value)];
    if (last === null && powers && i) ink.moveTo(x, foot);
    if (last === null && !(powers && i)) ink.moveTo(x, y);
    else ink.lineTo(x, y);
    last = x;
  });
  ink.stroke();
}

// Below the forces a band for each pin: full where it touches, empty where it flies.
function drawBands(ink, chart, axes) {
  chart.lines.forEach((_, i) => {
    const y = axes.y0 + axes.h + 4 + BAND * i;
    ink.fillStyle = colours.hues[i % HUES];
    for (const [from, to] of spells((row) => !row[i])) ink.fillRect(axes.x(from), y, Math.max(0.6, axes.x(to) - axes.x(from)), BAND - 1.5);
  });
}

// When rows of flight are as asked: from and to.
function spells(asked) {
  const found = [];
  let from = null;
  data.flies.forEach((row, i) => {
    const is = asked(row);
    if (is && from === null) from = data.t[i];
    if (!is && from !== null) {
      found.push([from, data.t[i]]);
      from = null;
    }
  });
  if (from !== null) found.push([from, data.duration]);
  return found;
}

function drawChart(chart) {
  const [ink, width, height] = sharpen(chart.canvas);
  if (!width) return;
  const axes = (chart.axes = axesOf(chart, width, height));
  drawScales(ink, chart, axes);
  if (chart.bands) drawBands(ink, chart, axes);
  ink.save();
  ink.beginPath();
  ink.rect(axes.x0, axes.y0, axes.w, axes.h);
  ink.clip();
  chart.lines.forEach(({ values }, i) => drawLine(ink, axes, values, colours.hues[i % HUES], chart.powers));
  ink.restore();
  for (const mark of [chart.cursor, chart.ghost])
    Object.assign(mark.style, { top: `${axes.y0}px`, height: `${axes.foot - axes.y0}px` });
}

function drawCharts() {
  charts.forEach(drawChart);
  moveCursors();
}

function moveCursors() {
  for (const { axes, cursor } of charts) if (axes) cursor.style.left = `${axes.x(now.t)}px`;
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
  const [before, after, part] = locate(data.t, t);
  const row = part < 0.5 ? before : after;
  for (const other of charts) if (other.axes) other.ghost.style.left = `${other.axes.x(t)}px`;
  chart.tip.replaceChildren(
    make("b", { textContent: `${number(data.t[row] * 1000, 2)} ms` }),
    ...chart.lines.map(({ name, values }, i) =>
      make(
        "div",
        {},
        swatch(i),
        name,
        make("em", { textContent: values[row] === null ? "flies" : `${number(values[row], chart.digits)} ${chart.unit}` }),
      ),
    ),
  );
  chart.tip.hidden = false;
  const [wide, room] = [chart.tip.offsetWidth, chart.canvas.clientWidth];
  chart.tip.style.left = `${x + 14 + wide > room ? Math.max(0, x - 14 - wide) : x + 14}px`;
}

function makeChart(said) {
  const chart = {
    ...said,
    span: spanOf(said),
    canvas: make("canvas"),
    cursor: make("div", { className: "cursor" }),
    ghost: make("div", { className: "cursor hover", hidden: true }),
    tip: make("div", { className: "tip", hidden: true }),
  };
  const plot = make("div", { className: "plot" }, chart.canvas, chart.cursor, chart.ghost, chart.tip);
  chart.canvas.setAttribute("role", "img");
  chart.canvas.setAttribute("aria-label", `${chart.title} over time, ${chart.unit}`);
  const names = chart.lines.map(({ name }, i) => make("span", {}, swatch(i), name));
  chart.card = make(
    "div",
    { className: "chart" },
    make("h3", {}, `${chart.title}, ${chart.unit}`, make("span", { className: "names" }, ...names)),
    plot,
  );
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

function startCharts() {
  charts = chartsOf().map(makeChart);
  byId("charts").append(...charts.map((chart) => chart.card));
  listeners.push(moveCursors);
}
