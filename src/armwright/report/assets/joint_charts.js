// Charts of joints: four quantities of one arm, either all joints in % of their limits or one joint in its units.

const hidden = new Set();
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
  const chosen = arm.joints.map((_, j) => j).filter((j) => (scale === "all" ? !hidden.has(j) : j === scale));
  return [false, true].flatMap((measured) =>
    rowsOf(quantity, arm, measured).rows ? chosen.map((j) => curveOf(quantity, arm, j, measured)) : [],
  );
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

function worstText(arm, j) {
  const { worst, worst_t } = arm.measured;
  return `${quantityText(TRACKING, arm.joints[j], worst[j])} at ${number(worst_t[j], 2)} s`;
}

function headOf(quantity) {
  if (quantity === TRACKING) {
    const arm = chosenArm();
    const units = [...new Set(arm.joints.map((joint) => TRACKING.units[joint.kind]))].join(", ");
    if (!arm.measured) return "";
    return scale === "all" ? units : `${TRACKING.units[arm.joints[scale].kind]} · largest ${worstText(arm, scale)}`;
  }
  if (scale === "all") return "% of limit";
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
  const head = make("span");
  return {
    quantity,
    label: `${quantity.title} of the joints over time`,
    heading: [quantity.title, head],
    unitOfTime: SECONDS,
    choose: () => {
      curves = curvesOf(quantity);
      head.textContent = headOf(quantity);
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
        colour: colours.hues[j % HUES],
        dash: free && !measured ? [2, 3] : [],
        // Beside a measured curve the planned one is broad and pale, so that both are seen where they are one.
        ...(chosenArm().measured?.[quantity.key] && !measured ? { width: 4.5, alpha: 0.35 } : {}),
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
    const button = make("button", { type: "button", ariaPressed: String(!hidden.has(j)) }, swatch(j), joint.name);
    button.addEventListener("click", () => {
      hidden.delete(j) || hidden.add(j);
      button.ariaPressed = String(!hidden.has(j));
      chooseCurves();
    });
    return button;
  });
  byId("legend").replaceChildren(...(scale === "all" ? buttons : []));
}

function chooseArmInCharts() {
  scale = "all";
  hidden.clear();
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
  chooseArmInCharts();
}
