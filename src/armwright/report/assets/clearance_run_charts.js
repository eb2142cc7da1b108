// Charts of a linkage with play: error, forces, energy.

// Height of the band of a pin [pixels].
const BAND = 5;

// A contact shorter than this part of the run is a point at its largest force: so short ones would be a hatching.
const SHORT = 1 / 160;
const POINT = 1.7;

const column = (rows, i, factor = 1) => rows.map((row) => (row[i] === null ? null : row[i] * factor));

function chartsOf() {
  const [x, y] = [0, 1].map((i) => column(data.error_um, i, 1e-3));
  const far = x.map((value, i) => (value === null ? null : Math.hypot(value, y[i])));
  // What flies carries nothing, and has no place on a scale of powers of ten.
  const forces = data.pins.map((pin, i) => contacts(pin.name, column(data.forces_N, i).map((force) => (force > 0 ? force : null))));
  const energy = [0, 1, 2, 3, 4, 5].map((i) => column(data.energy_J, i));
  const from = (values) => values.map((value) => (value === null ? null : value - values[0]));
  return [
    {
      title: "Error of the tip",
      unit: "mm",
      digits: 3,
      curves: [
        { name: "E", values: far },
        { name: "x →", values: x },
        { name: "y ↑", values: y },
      ],
    },
    { title: "Contact forces", unit: "N", digits: 1, curves: forces, powers: true, bands: true },
    {
      title: "Energy given and held",
      unit: "J",
      digits: 4,
      curves: [
        { name: "given by drives", values: energy[0] },
        { name: "of motion", values: from(energy[1]) },
        { name: "of height", values: energy[2] },
      ],
    },
    {
      title: "Energy lost",
      unit: "J",
      digits: 5,
      curves: [
        { name: "impacts", values: energy[3] },
        { name: "friction", values: energy[4] },
        { name: "residual of the balance", values: energy[5] },
      ],
    },
  ];
}

// The forces of a pin: all of them, those of long contacts, and the time and largest force of each short one.
function contacts(name, values) {
  const long = [...values];
  const points = [];
  let from = 0;
  for (let i = 0; i <= values.length; i++) {
    if (i < values.length && values[i] !== null) continue;
    if (i > from && data.t[i - 1] - data.t[from] < SHORT * data.duration) {
      const peak = values.slice(from, i).reduce((best, force, k) => (force > values[best] ? from + k : best), from);
      points.push([data.t[peak], values[peak]]);
      long.fill(null, from, i);
    }
    from = i + 1;
  }
  return { name, values, long, points };
}

function spanOf(curves, powers) {
  let [low, high] = [Infinity, -Infinity];
  for (const { values } of curves)
    for (const value of values) {
      if (value === null) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  if (low > high) return powers ? [1, 10] : [0, 1];
  if (powers) return [Math.max(low, high * 1e-5) / 1.5, high * 1.5];
  [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const pad = 0.07 * (high - low || 1);
  return [low < 0 ? low - pad : 0, high + pad];
}

// Short contacts, and below the forces a band for each pin: full where it touches, empty where it flies.
function drawContacts(ink, axes, curves) {
  curves.forEach(({ points }, i) => {
    ink.fillStyle = colours.hues[i % HUES];
    for (const [t, force] of points) {
      ink.beginPath();
      ink.arc(axes.x(t), axes.y(force), POINT, 0, 2 * Math.PI);
      ink.fill();
    }
  });
  data.pins.forEach((_, i) => {
    const y = axes.y0 + axes.h + 4 + BAND * i;
    ink.fillStyle = colours.hues[i % HUES];
    for (const [from, to] of spells((row) => !row[i]))
      ink.fillRect(axes.x(from), y, Math.max(0.6, axes.x(to) - axes.x(from)), BAND - 1.5);
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

function saidAt(t, { curves, digits, unit }) {
  const [before, after, part] = locate(data.t, t);
  const row = part < 0.5 ? before : after;
  const line = ({ name, values }, i) => {
    const text = values[row] === null ? "flies" : `${number(values[row], digits)} ${unit}`;
    return make("div", {}, swatch(i), name, make("em", { textContent: text }));
  };
  return [make("b", { textContent: `${number(data.t[row] * 1000, 2)} ms` }), ...curves.map(line)];
}

function clearanceChart(said) {
  const { title, unit, curves, powers = false, bands = false } = said;
  const span = spanOf(curves, powers);
  const names = curves.map(({ name }, i) => make("span", {}, swatch(i), name));
  return {
    label: `${title} over time, ${unit}`,
    heading: [`${title}, ${unit}`, make("span", { className: "names" }, ...names)],
    unitOfTime: MILLISECONDS,
    span: () => span,
    powers,
    below: bands ? BAND * curves.length + 4 : 0,
    paint: bands ? (ink, axes) => drawContacts(ink, axes, curves) : null,
    lines: () => curves.map(({ values, long = values }, i) => ({ times: data.t, values: long, colour: colours.hues[i % HUES] })),
    tipAt: (t) => saidAt(t, said),
  };
}
