// Charts of a run as it goes: what each joint does, planned, and measured beside it where there is physics.

const KEPT = 12; // seconds that are shown
const strip = { rows: [], arm: null };

function takeMotion(run) {
  const motion = run?.motions[chosenArm().name];
  if (!motion) return;
  const last = strip.rows.at(-1);
  if (strip.arm !== now.arm) strip.rows = [];
  if (last && run.time < last.t) strip.rows = strip.rows.filter(({ t }) => t < run.time);
  strip.arm = now.arm;
  if (strip.rows.at(-1)?.t !== run.time) strip.rows.push({ t: run.time, ...motion });
  while (strip.rows.length && strip.rows[0].t < run.time - KEPT) strip.rows.shift();
}

function valuesOf(key) {
  return strip.rows.filter((row) => row[key]);
}

// The largest value that a chart has of each joint: its limit or, without one, the largest in rows.
function scalesOf(quantity, rows) {
  return chosenArm().joints.map((joint, j) => {
    const [low, high] = limitsOf(quantity, joint);
    if (high !== null && low !== null) return Math.max(Math.abs(low), Math.abs(high));
    return Math.max(1e-9, ...rows.map((row) => Math.abs(row?.[j] ?? 0)));
  });
}

function paintStrip() {
  const field = byId("strip-chart");
  // Asking for its width would lay out the page for each state, also where nothing is seen of it.
  if (!strip.rows.length || byId("panel-trace").hidden || !field.clientWidth) return;
  const [pen, width, height] = sharpen(field);
  const quantity = QUANTITIES.find(({ key }) => key === byId("strip-quantity").value);
  const measured = quantity.key === "tau" ? "tau_measured" : `${quantity.key}_measured`;
  const joints = chosenArm().joints;
  const rows = strip.rows;
  const [from, to] = [Math.max(0, rows.at(-1).t - KEPT), Math.max(KEPT, rows.at(-1).t)];
  const x = (t) => 40 + ((t - from) / (to - from)) * (width - 48);
  // Each joint as a part of its limit, or of its largest value.
  const most = scalesOf(quantity, rows.flatMap((row) => [row[quantity.key], row[measured]]));
  const y = (value, j) => height / 2 - (value / most[j]) * (height / 2 - 8);
  pen.font = "10px system-ui, sans-serif";
  pen.fillStyle = colours.quiet;
  for (const [part, text] of [[1, "limit"], [0, "0"], [-1, "−limit"]]) {
    const line = height / 2 - part * (height / 2 - 8);
    pen.fillText(text, 2, line + 3);
    pen.strokeStyle = colours.line;
    pen.setLineDash(part ? [4, 4] : []);
    pen.beginPath();
    pen.moveTo(40, line);
    pen.lineTo(width - 8, line);
    pen.stroke();
  }
  pen.setLineDash([]);
  const both = valuesOf(measured).length > 0 && valuesOf(quantity.key).length > 0;
  for (const [key, alpha, wide] of [[quantity.key, both ? 0.45 : 1, both ? 3 : 1.6], [measured, 1, 1.3]]) {
    const known = valuesOf(key);
    joints.forEach((_, j) => {
      pen.strokeStyle = colours.hues[j % HUES];
      pen.globalAlpha = alpha;
      pen.lineWidth = wide;
      pen.beginPath();
      known.forEach((row, i) => (i ? pen.lineTo(x(row.t), y(row[key][j], j)) : pen.moveTo(x(row.t), y(row[key][j], j))));
      pen.stroke();
    });
  }
  pen.globalAlpha = 1;
  pen.fillStyle = colours.quiet;
  pen.textAlign = "end";
  pen.fillText(`${number(to, 1)} s`, width - 8, height - 2);
  pen.textAlign = "start";
  pen.fillText(`${number(from, 1)} s, ${chosenArm().name}`, 42, height - 2);
  byId("strip-legend").replaceChildren(
    ...joints.map((joint, j) => {
      const swatch = make("i", { className: "swatch" });
      swatch.style.setProperty("--hue", `var(${hue(j)})`);
      const value = rows.at(-1)[quantity.key]?.[j] ?? rows.at(-1)[measured]?.[j];
      return make("span", {}, swatch, `J${j + 1} ${value === undefined ? "" : quantityText(quantity, joint, value)}`);
    }),
  );
}

function startStrip() {
  byId("strip-quantity").append(...QUANTITIES.map(({ key, title }) => make("option", { value: key, textContent: title.toLowerCase() })));
  byId("strip-quantity").addEventListener("change", paintStrip);
  followers.push((state) => {
    if (!state) return;
    takeMotion(state.run);
    paintStrip();
  });
}
