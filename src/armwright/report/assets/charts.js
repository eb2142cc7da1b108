// Charts: four quantities of one arm over time, either all joints in % of their limits or one joint in its units.

const MARGIN = { left: 46, right: 8, top: 8, bottom: 20 };
const hidden = new Set();
let scale = "all"; // or the index of a joint
let charts = [];

const chosenArm = () => data.arms[now.arm];

function largest(rows, j) {
  return rows.reduce((most, row) => Math.max(most, Math.abs(row[j])), 0);
}

// What is drawn of one joint: its curve and its limits in the scale of the chart.
function curveOf(quantity, arm, j) {
  const [joint, rows] = [arm.joints[j], arm[quantity.key]];
  if (scale !== "all") {
    const factor = unitFactor(quantity, joint);
    return {
      j,
      values: rows.map((row) => row[j] * factor),
      limits: limitsOf(quantity, joint)
        .filter((v) => v !== null)
        .map((v) => v * factor),
    };
  }
  if (share(quantity, joint, 0) !== null)
    return { j, values: rows.map((row) => 100 * share(quantity, joint, row[j])), limits: [-100, 100] };
  const most = largest(rows, j) || 1;
  return { j, values: rows.map((row) => (100 * row[j]) / most), limits: [], free: true };
}

function spanOf(curves) {
  const values = curves.flatMap((curve) => curve.values);
  let [low, high] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [0, 0]);
  if (scale === "all") return [Math.min(low, -100) * 1.08, Math.max(high, 100) * 1.22];
  // A limit far away would press the curve flat; it is named above the chart instead.
  const reach = Math.max(-low, high) || 1;
  for (const limit of curves.flatMap((curve) => curve.limits)) {
    if (Math.abs(limit) < 2.5 * reach) [low, high] = [Math.min(low, limit), Math.max(high, limit)];
  }
  const pad = 0.08 * (high - low || 1);
  return [low - pad, high + 2 * pad];
}

function curvesOf(quantity) {
  const arm = chosenArm();
  return arm.joints
    .map((_, j) => j)
    .filter((j) => (scale === "all" ? !hidden.has(j) : j === scale))
    .map((j) => curveOf(quantity, arm, j));
}

function axesOf(chart, width, height) {
  const [low, high] = spanOf(chart.curves);
  const [x0, y0, w, h] = [
    MARGIN.left,
    MARGIN.top,
    width - MARGIN.left - MARGIN.right,
    height - MARGIN.top - MARGIN.bottom,
  ];
  const lasts = data.duration || 1;
  return {
    low,
    high,
    x0,
    y0,
    w,
    h,
    x: (t) => x0 + (t / lasts) * w,
    y: (v) => y0 + ((high - v) / (high - low)) * h,
    t: (x) => ((x - x0) / w) * lasts,
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

function drawScales(ink, axes) {
  const { low, high, x0, y0, w, h } = axes;
  ink.font = "11px system-ui, sans-serif";
  ink.fillStyle = colours.quiet;
  const step = roundStep(high - low, 5);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  ink.textAlign = "right";
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
    const y = Math.round(axes.y(v)) + 0.5;
    rule(ink, x0, y, x0 + w, y, Math.abs(v) < step / 2 ? colours.line : colours.faint);
    ink.fillText(number(v, decimals), x0 - 6, y + 4);
  }
  const lasts = data.duration || 1;
  const second = roundStep(lasts, Math.max(2, w / 55));
  ink.textAlign = "center";
  for (let t = 0; t <= lasts * 1.0001; t += second) {
    const text = number(t, second < 1 ? (second < 0.1 ? 2 : 1) : 0);
    ink.fillText(t ? text : "0 s", Math.min(axes.x(t), x0 + w - 8), y0 + h + 15);
  }
}

function drawBorders(ink, axes) {
  const stages = data.stages.filter((stage) => stage.arm === chosenArm().name);
  for (const t of new Set(stages.flatMap((stage) => [stage.t0, stage.t1]))) {
    const x = Math.round(axes.x(t)) + 0.5;
    rule(ink, x, axes.y0, x, axes.y0 + axes.h, colours.line);
  }
  ink.fillStyle = colours.quiet;
  ink.textAlign = "center";
  data.stages.forEach((stage, i) => {
    const [from, to] = [axes.x(stage.t0), axes.x(stage.t1)];
    if (stage.arm === chosenArm().name && to - from > 16) ink.fillText(String(i + 1), (from + to) / 2, axes.y0 + 10);
  });
}

function drawLimits(ink, axes, curves) {
  for (const limit of new Set(curves.flatMap((curve) => curve.limits))) {
    if (limit < axes.low || limit > axes.high) continue;
    rule(ink, axes.x0, axes.y(limit), axes.x0 + axes.w, axes.y(limit), colours.bad, [5, 4]);
  }
}

function drawCurve(ink, axes, curve) {
  const times = chosenArm().t;
  ink.setLineDash(curve.free ? [2, 3] : []);
  ink.strokeStyle = colours.hues[curve.j % HUES];
  ink.lineWidth = 1.6;
  ink.lineJoin = "round";
  ink.beginPath();
  curve.values.forEach((value, i) => ink.lineTo(axes.x(times[i]), axes.y(value)));
  ink.stroke();
  ink.setLineDash([]);
}

function drawChart(chart) {
  const [ink, width, height] = sharpen(chart.canvas);
  if (!width || !chosenArm()[chart.quantity.key]) return;
  chart.curves = curvesOf(chart.quantity);
  const axes = (chart.axes = axesOf(chart, width, height));
  drawScales(ink, axes);
  drawBorders(ink, axes);
  drawLimits(ink, axes, chart.curves);
  ink.save();
  ink.beginPath();
  ink.rect(axes.x0, axes.y0, axes.w, axes.h);
  ink.clip();
  chart.curves.forEach((curve) => drawCurve(ink, axes, curve));
  ink.restore();
  Object.assign(chart.cursor.style, { top: `${axes.y0}px`, height: `${axes.h}px` });
  Object.assign(chart.ghost.style, { top: `${axes.y0}px`, height: `${axes.h}px` });
  chart.head.textContent = headOf(chart.quantity);
}

function headOf(quantity) {
  if (scale === "all") return "% of limit";
  const joint = chosenArm().joints[scale];
  const limits = limitsOf(quantity, joint).map((limit) =>
    limit === null ? "none" : quantityText(quantity, joint, limit),
  );
  const said = quantity.key === "q" ? `${limits[0]} to ${limits[1]}` : limits[1] === "none" ? "none" : `±${limits[1]}`;
  return `${quantity.units[joint.kind]} · limit ${said}`;
}

function drawCharts() {
  for (const chart of charts) {
    chart.card.hidden = !chosenArm()[chart.quantity.key];
    drawChart(chart);
  }
  moveCursors();
}

function moveCursors() {
  for (const { axes, cursor } of charts) if (axes) cursor.style.left = `${axes.x(now.t)}px`;
}

function tipLine(quantity, j, place) {
  const [arm, joint] = [chosenArm(), chosenArm().joints[j]];
  const value = blend(arm[quantity.key], place)[j];
  const part = share(quantity, joint, value);
  const swatch = make("span", { className: "swatch" });
  swatch.style.setProperty("--hue", `var(${hue(j)})`);
  return make(
    "div",
    {},
    swatch,
    joint.name,
    make("em", { textContent: quantityText(quantity, joint, value) }),
    make("small", { textContent: part === null ? "no limit" : `${number(100 * part, 0)} %` }),
  );
}

function hover(chart, x) {
  for (const other of charts) other.ghost.hidden = chart === null;
  charts.forEach((other) => {
    if (other !== chart) other.tip.hidden = true;
  });
  if (!chart || !chart.axes || !chosenArm().t.length) return;
  const t = Math.min(Math.max(chart.axes.t(x), 0), data.duration);
  const place = locate(chosenArm().t, t);
  for (const other of charts) if (other.axes) other.ghost.style.left = `${other.axes.x(t)}px`;
  chart.tip.replaceChildren(
    make("b", { textContent: `${number(t, 2)} s` }),
    ...chart.curves.map((curve) => tipLine(chart.quantity, curve.j, place)),
  );
  chart.tip.hidden = false;
  const [wide, room] = [chart.tip.offsetWidth, chart.canvas.clientWidth];
  chart.tip.style.left = `${x + 14 + wide > room ? Math.max(0, x - 14 - wide) : x + 14}px`;
}

function makeChart(quantity) {
  const chart = {
    quantity,
    canvas: make("canvas"),
    cursor: make("div", { className: "cursor" }),
    ghost: make("div", { className: "cursor hover", hidden: true }),
    tip: make("div", { className: "tip", hidden: true }),
    head: make("span"),
  };
  const plot = make("div", { className: "plot" }, chart.canvas, chart.cursor, chart.ghost, chart.tip);
  chart.canvas.setAttribute("role", "img");
  chart.canvas.setAttribute("aria-label", `${quantity.title} of the joints over time`);
  chart.card = make("div", { className: "chart" }, make("h3", { textContent: quantity.title }, chart.head), plot);
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

function makeLegend() {
  const buttons = chosenArm().joints.map((joint, j) => {
    const swatch = make("span", { className: "swatch" });
    swatch.style.setProperty("--hue", `var(${hue(j)})`);
    const button = make("button", { type: "button", ariaPressed: String(!hidden.has(j)) }, swatch, joint.name);
    button.addEventListener("click", () => {
      hidden.delete(j) || hidden.add(j);
      button.ariaPressed = String(!hidden.has(j));
      drawCharts();
    });
    return button;
  });
  const legend = document.getElementById("legend");
  legend.replaceChildren(...(scale === "all" ? buttons : []));
}

function chooseArmInCharts() {
  const choice = document.getElementById("scale");
  scale = "all";
  hidden.clear();
  choice.replaceChildren(
    make("option", { value: "all", textContent: "all joints, % of limit" }),
    ...chosenArm().joints.map((joint, j) =>
      make("option", { value: String(j), textContent: `${joint.name}, in its units` }),
    ),
  );
  makeLegend();
  drawCharts();
}

function startCharts() {
  document.getElementById("charts-card").hidden = !data.arms.length;
  if (!data.arms.length) return;
  charts = QUANTITIES.map(makeChart);
  document.getElementById("charts").append(...charts.map((chart) => chart.card));
  document.getElementById("scale").addEventListener("change", (event) => {
    scale = event.target.value === "all" ? "all" : Number(event.target.value);
    makeLegend();
    drawCharts();
  });
  chooseArmInCharts();
  listeners.push(moveCursors);
}
