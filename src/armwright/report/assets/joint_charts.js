// Charts of joints: four quantities of one arm, either all joints in % of their limits or one joint in its units.

const hidden = new Set();
let scale = "all"; // or the index of a joint

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
  if (!arm[quantity.key]) return [];
  return arm.joints
    .map((_, j) => j)
    .filter((j) => (scale === "all" ? !hidden.has(j) : j === scale))
    .map((j) => curveOf(quantity, arm, j));
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

function headOf(quantity) {
  if (scale === "all") return "% of limit";
  const joint = chosenArm().joints[scale];
  const limits = limitsOf(quantity, joint).map((limit) =>
    limit === null ? "none" : quantityText(quantity, joint, limit),
  );
  const said = quantity.key === "q" ? `${limits[0]} to ${limits[1]}` : limits[1] === "none" ? "none" : `±${limits[1]}`;
  return `${quantity.units[joint.kind]} · limit ${said}`;
}

function tipLine(quantity, j, place) {
  const [arm, joint] = [chosenArm(), chosenArm().joints[j]];
  const value = blend(arm[quantity.key], place)[j];
  const part = share(quantity, joint, value);
  return make(
    "div",
    {},
    swatch(j),
    joint.name,
    make("em", { textContent: quantityText(quantity, joint, value) }),
    make("small", { textContent: part === null ? "no limit" : `${number(100 * part, 0)} %` }),
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
    span: () => spanOf(curves),
    paint: (ink, axes) => {
      drawBorders(ink, axes);
      drawLimits(ink, axes, curves);
    },
    lines: () =>
      curves.map(({ j, values, free }) => ({
        times: chosenArm().t,
        values,
        colour: colours.hues[j % HUES],
        dash: free ? [2, 3] : [],
      })),
    tipAt: (t) => {
      if (!chosenArm().t.length) return [];
      const place = locate(chosenArm().t, t);
      return [make("b", { textContent: `${number(t, 2)} s` }), ...curves.map(({ j }) => tipLine(quantity, j, place))];
    },
  };
}

// To be called when another arm, joint or scale is chosen.
function chooseCurves() {
  for (const chart of charts) {
    chart.choose();
    chart.card.hidden = !chosenArm()[chart.quantity.key];
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
  startCharts(QUANTITIES.map(jointChart));
  byId("scale").addEventListener("change", (event) => {
    scale = event.target.value === "all" ? "all" : Number(event.target.value);
    makeLegend();
    chooseCurves();
  });
  chooseArmInCharts();
}
