// Two motions beside one another: their figures, what their joints do on one scale, the paths of the tool in the view.

const comparing = { motions: [] };
const FIGURES = [
  ["duration", "takes", (value) => `${number(value, 2)} s`],
  ["path_length", "path of the tool", (value) => `${number(value * MILLIMETRES, 0)} mm`],
  ["tool_speed", "fastest", (value) => `${number(value * MILLIMETRES, 0)} mm/s`],
  ["speed_share", "speed of joints", (value, it) => `${number(100 * value, 0)} %, J${it.speed_joint}`],
  ["acceleration_share", "acceleration", (value, it) => `${number(100 * value, 0)} %, J${it.acceleration_joint}`],
  ["effort_share", "effort", (value, it) => `${number(100 * value, 0)} %, J${it.effort_joint}`],
  ["work", "work of the drives", (value) => `${number(value, 0)} J`],
];

const motionsOfArm = () => comparing.motions.map((motion) => ({ ...motion, ...motion.arms[chosenArm().name] })).filter(({ t }) => t);

function showComparison() {
  const motions = motionsOfArm();
  byId("compare-empty").hidden = motions.length > 0;
  byId("compare").hidden = !motions.length;
  if (!motions.length) return;
  const head = make("tr", {}, make("th"), ...motions.map((motion, k) => make("th", { scope: "col", className: `motion-${k}` }, make("span", { title: motion.name, textContent: `${k ? "B" : "A"}: ${motion.name}` }))), motions.length > 1 ? make("th", { scope: "col", textContent: "B to A" }) : "");
  const rows = FIGURES.map(([key, title, text]) => {
    const values = motions.map((motion) => (key === "duration" ? motion.duration : motion.figures[key]));
    const percent = values.length > 1 && values[0] ? 100 * (values[1] / values[0] - 1) : null;
    const change = percent === null ? "" : `${percent > 0 ? "+" : ""}${number(percent, 1)} %`;
    return make("tr", {}, make("th", { scope: "row", textContent: title }), ...values.map((value, k) => make("td", { textContent: value === null ? "" : text(value, motions[k].figures) })), motions.length > 1 ? make("td", { textContent: change }) : "");
  });
  byId("compare-figures").replaceChildren(make("thead", {}, head), make("tbody", {}, ...rows));
  paintComparison();
}

// A chart of all joints of each motion, both on one scale: as parts of the limits, or of the largest values of both.
function paintComparison() {
  const motions = motionsOfArm();
  const quantity = QUANTITIES.find(({ key }) => key === byId("strip-quantity").value);
  const joints = chosenArm().joints;
  const most = scalesOf(quantity, motions.flatMap((motion) => motion[quantity.key]));
  const end = Math.max(...motions.map(({ duration }) => duration), 1e-3);
  motions.forEach((motion, k) => {
    const field = byId(`compare-chart-${k}`);
    if (!field.clientWidth) return;
    const [pen, width, height] = sharpen(field);
    pen.strokeStyle = colours.line;
    pen.strokeRect(0.5, 0.5, width - 1, height - 1);
    pen.beginPath();
    pen.moveTo(0, height / 2);
    pen.lineTo(width, height / 2);
    pen.stroke();
    joints.forEach((_, j) => {
      pen.strokeStyle = colours.hues[j % HUES];
      pen.lineWidth = 1.4;
      pen.beginPath();
      motion.t.forEach((t, i) => {
        const [x, y] = [(t / end) * width, height / 2 - (motion[quantity.key][i][j] / most[j]) * (height / 2 - 4)];
        if (i) pen.lineTo(x, y);
        else pen.moveTo(x, y);
      });
      pen.stroke();
    });
    pen.fillStyle = colours.quiet;
    pen.font = "11px system-ui, sans-serif";
    pen.fillText(`${k ? "B" : "A"}: ${quantity.title.toLowerCase()}, ${number(end, 1)} s wide`, 5, 13);
  });
}

// Paths in the view: of the run, what has been gone and what is to come; of compared motions, each in its shade.
function paintPaths() {
  const run = live.state?.run;
  data.arms.forEach(({ name }, i) => {
    const rows = overlay.paths?.[name] ?? [];
    const gone = run?.time ?? 0;
    for (const [part, width, alpha] of [[rows.filter(([t]) => t <= gone), 2.5, 0.9], [rows.filter(([t]) => t >= gone), 1.5, 0.45]])
      paintLine(part.map((row) => row.slice(1)), armColour(i), width, alpha);
  });
  if (!byId("panel-trace").hidden)
    motionsOfArm().forEach(({ path }, k) => paintLine(path, k ? colours.hues[1] : colours.hues[0], 2, 0.9, k ? [6, 4] : []));
}

function paintLine(points, shade, width, alpha, dashes = []) {
  pen.setLineDash(dashes);
  strokeLines([points.map(project)], shade, width, alpha);
  pen.setLineDash([]);
}

function startComparing() {
  byId("keep-motion").addEventListener("click", () => send({ do: "keep motion" }));
  byId("strip-quantity").addEventListener("change", showComparison);
  followers.push((state) => {
    if (!state) return;
    if (state.paths !== undefined) overlay.paths = state.paths;
    byId("keep-motion").disabled = !mine() || !state.run || state.run.running;
    if (state.compared === undefined) return;
    comparing.motions = state.compared;
    showComparison();
    drawSoon();
  });
}
