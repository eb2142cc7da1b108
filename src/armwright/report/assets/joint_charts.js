// Charts of joints: four quantities of one arm, either all joints in % of their limits or one joint in its units.

// Joints that are drawn in colour; empty for the one that comes nearest to its limit.
const emphasised = new Set();
let scale = "all"; // or the index of a joint

const chosenArm = () => data.arms[now.arm];

function largest(rows, j) {
  return rows.reduce((most, row) => Math.max(most, Math.abs(row[j])), 0);
}

// Rows over time: planned ones, or measured ones where they are asked for or nothing else is known.
function rowsOf(quantity, arm, measured = quantity === TRACKING) {
  const source = measured ? arm.measured : arm;
  return { times: source?.t, rows: source?.[quantity.key] };
}

// What is drawn of one joint: its curve and its limits in the scale of the chart, measured values in that of planned.
function curveOf(quantity, arm, j, measured) {
  const joint = arm.joints[j];
  const { times, rows } = rowsOf(quantity, arm, measured);
  return { j, times, measured, ...scaledValues(quantity, arm, joint, j, rows) };
}

function scaledValues(quantity, arm, joint, j, rows) {
  if (scale !== "all" || quantity === TRACKING) {
    const factor = unitFactor(quantity, joint);
    return {
      values: rows.map((row) => row[j] * factor),
      limits: limitsOf(quantity, joint)
        .filter((v) => v !== null)
        .map((v) => v * factor),
    };
  }
  if (share(quantity, joint, 0) !== null)
    return { values: rows.map((row) => 100 * share(quantity, joint, row[j])), limits: [-100, 100] };
  const most = largest(rowsOf(quantity, arm).rows, j) || 1;
  return { values: rows.map((row) => (100 * row[j]) / most), limits: [], free: true };
}

function spanOf(quantity, curves) {
  const values = curves.flatMap((curve) => curve.values);
  let [low, high] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [0, 0]);
  if (scale === "all" && quantity !== TRACKING) return [Math.min(low, -100) * 1.08, Math.max(high, 100) * 1.22];
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
  const chosen = arm.joints.map((_, j) => j).filter((j) => scale === "all" || j === scale);
  return [false, true].flatMap((measured) =>
    rowsOf(quantity, arm, measured).rows ? chosen.map((j) => curveOf(quantity, arm, j, measured)) : [],
  );
}

// The joint that comes nearest to its limit in the times that are shown, and how near; null where none has a limit. Of
// errors it is the largest.
function nearestToLimit(quantity) {
  const arm = chosenArm();
  const [from, to] = shownTimes();
  const { times, rows } = rowsOf(quantity, arm);
  let most = null;
  rows?.forEach((row, i) => {
    if (times[i] < from || times[i] > to) return;
    row.forEach((value, j) => {
      const part = quantity === TRACKING ? value : share(quantity, arm.joints[j], value);
      if (part !== null && Math.abs(part) > (most?.part ?? -1)) most = { j, part: Math.abs(part) };
    });
  });
  return most;
}

// Whether a joint is drawn in colour.
function inColour(j, nearest) {
  if (scale !== "all" || (!emphasised.size && !nearest)) return true;
  return emphasised.size ? emphasised.has(j) : j === nearest.j;
}

function drawBorders(ink, axes) {
  const stages = data.stages.filter((stage) => stage.arm === chosenArm().name);
  const inside = (x) => x >= axes.x0 && x <= axes.x0 + axes.w;
  let last = -Infinity;
  for (const t of [...new Set(stages.flatMap((stage) => [stage.t0, stage.t1]))].sort((a, b) => a - b)) {
    const x = Math.round(axes.x(t)) + 0.5;
    if (!inside(x) || x - last < 3) continue;
    last = x;
    rule(ink, x, axes.y0, x, axes.y0 + axes.h, colours.line);
  }
  ink.fillStyle = colours.quiet;
  ink.textAlign = "center";
  // A number that would touch the one before it, or has no room in its stage, is left out.
  let end = axes.x0;
  data.stages.forEach((stage, i) => {
    if (stage.arm !== chosenArm().name) return;
    const from = Math.max(axes.x0, axes.x(stage.t0));
    const to = Math.min(axes.x0 + axes.w, axes.x(stage.t1));
    const wide = ink.measureText(String(i + 1)).width;
    const middle = (from + to) / 2;
    if (to - from < wide + 4 || middle - wide / 2 < end + 3) return;
    ink.fillText(String(i + 1), middle, axes.y0 + 10);
    end = middle + wide / 2;
  });
}

function drawLimits(ink, axes, curves) {
  for (const limit of new Set(curves.flatMap((curve) => curve.limits))) {
    if (limit < axes.low || limit > axes.high) continue;
    rule(ink, axes.x0, axes.y(limit), axes.x0 + axes.w, axes.y(limit), colours.bad, [5, 4]);
  }
}

function worstText(arm, j) {
  const { worst, worst_t } = arm.measured;
  return `${quantityText(TRACKING, arm.joints[j], worst[j])} at ${number(worst_t[j], 2)} s`;
}

function headOf(quantity, nearest) {
  if (quantity === TRACKING) {
    const arm = chosenArm();
    const units = [...new Set(arm.joints.map((joint) => TRACKING.units[joint.kind]))].join(", ");
    if (!arm.measured) return "";
    return scale === "all" ? units : `${TRACKING.units[arm.joints[scale].kind]} · largest ${worstText(arm, scale)}`;
  }
  if (scale === "all" && !nearest) return "% of limit";
  if (scale === "all") return `% of limit · ${chosenArm().joints[nearest.j].name} ${number(100 * nearest.part, 0)} %`;
  const joint = chosenArm().joints[scale];
  const limits = limitsOf(quantity, joint).map((limit) =>
    limit === null ? "none" : quantityText(quantity, joint, limit),
  );
  const said = quantity.key === "q" ? `${limits[0]} to ${limits[1]}` : limits[1] === "none" ? "none" : `±${limits[1]}`;
  return `${quantity.units[joint.kind]} · limit ${said}`;
}

function tipLine(quantity, j, t) {
  const [arm, joint] = [chosenArm(), chosenArm().joints[j]];
  const valueAt = ({ times, rows }) => (rows ? blend(rows, locate(times, t))[j] : null);
  const [value, measured] = [valueAt(rowsOf(quantity, arm)), valueAt(rowsOf(quantity, arm, true))];
  const part = share(quantity, joint, value);
  const texts = [value, ...(measured === null || quantity === TRACKING ? [] : [measured])];
  const said = quantity === TRACKING ? "" : part === null ? "no limit" : `${number(100 * part, 0)} %`;
  return make(
    "div",
    {},
    swatch(j),
    joint.name,
    make("em", { textContent: texts.map((one) => quantityText(quantity, joint, one)).join(" · ") }),
    make("small", { textContent: said }),
  );
}

function jointChart(quantity) {
  let curves = [];
  let nearest = null;
  const head = make("span");
  return {
    quantity,
    label: `${quantity.title} of the joints over time`,
    heading: [quantity.title, head],
    unitOfTime: SECONDS,
    choose: () => {
      nearest = nearestToLimit(quantity);
      // What is grey lies below.
      curves = curvesOf(quantity).sort((a, b) => inColour(a.j, nearest) - inColour(b.j, nearest));
      head.textContent = headOf(quantity, nearest);
    },
    span: () => spanOf(quantity, curves),
    paint: (ink, axes) => {
      drawBorders(ink, axes);
      drawLimits(ink, axes, curves);
    },
    lines: () =>
      curves.map(({ j, times, values, free, measured }) => ({
        times,
        values,
        dash: free && !measured ? [2, 3] : [],
        ...(inColour(j, nearest)
          ? { colour: colours.hues[j % HUES], width: scale === "all" ? 2 : 1.5 }
          : { colour: colours.quiet, width: 1, alpha: 0.4 }),
        // Beside a measured curve the planned one is broad and pale, so that both are seen where they are one.
        ...(chosenArm().measured?.[quantity.key] && !measured && inColour(j, nearest) ? { width: 4.5, alpha: 0.35 } : {}),
      })),
    tipAt: (t) => {
      if (!chosenArm().t.length) return [];
      const both = quantity !== TRACKING && rowsOf(quantity, chosenArm(), true).rows;
      const drawn = [...new Set(curves.map(({ j }) => j))];
      return [
        make("b", { textContent: `${number(t, 2)} s${both ? ", planned · measured" : ""}` }),
        ...drawn.map((j) => tipLine(quantity, j, t)),
      ];
    },
  };
}

// To be called when another arm, joint or scale is chosen.
function chooseCurves() {
  for (const chart of charts) {
    chart.choose();
    chart.card.hidden = !rowsOf(chart.quantity, chosenArm()).rows;
  }
  drawCharts();
}

function makeLegend() {
  const buttons = chosenArm().joints.map((joint, j) => {
    const button = make("button", { type: "button", ariaPressed: String(emphasised.has(j)) }, swatch(j), joint.name);
    button.addEventListener("click", () => {
      emphasised.delete(j) || emphasised.add(j);
      button.ariaPressed = String(emphasised.has(j));
      chooseCurves();
    });
    return button;
  });
  byId("legend").replaceChildren(...(scale === "all" ? buttons : []));
}

// Show a span of time in all charts, or all of it.
function zoomTime(span) {
  timeSpan = span && span[1] > span[0] ? span : null;
  byId("whole").hidden = !timeSpan;
  chooseCurves();
}

function chooseArmInCharts() {
  scale = "all";
  emphasised.clear();
  byId("scale").replaceChildren(
    make("option", { value: "all", textContent: "all joints, % of limit" }),
    ...chosenArm().joints.map((joint, j) =>
      make("option", { value: String(j), textContent: `${joint.name}, in its units` }),
    ),
  );
  makeLegend();
  chooseCurves();
}

function startJointCharts() {
  byId("charts-card").hidden = !data.arms.length;
  if (!data.arms.length) return;
  const measured = data.arms.some((arm) => arm.measured);
  byId("planned-and-measured").hidden = !measured;
  startCharts([...QUANTITIES, ...(measured ? [TRACKING] : [])].map(jointChart));
  byId("scale").addEventListener("change", (event) => {
    scale = event.target.value === "all" ? "all" : Number(event.target.value);
    makeLegend();
    chooseCurves();
  });
  byId("whole").addEventListener("click", () => zoomTime(null));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && timeSpan) zoomTime(null);
  });
  chooseArmInCharts();
}
