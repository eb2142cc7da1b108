// Names in the view, none on another.

let labels = [];
let labelBoxes = [];
const LABEL_FONT = "12px system-ui, sans-serif";
const LABEL_HEIGHT = 15;
const FAINT = 0.5;
// Where a name may stand about its point: to the right, to the left, below, above, then farther away.
const LABEL_PLACES = [0, 1, 2, 3].flatMap((far) => [
  [1, -1 - far],
  [1, 1 + far],
  [-1, -1 - far],
  [-1, 1 + far],
]);

// So many names of one point are told, and others counted.
const MOST_NAMES = 3;

// Widths of what is written again and again.
const MOST_WIDTHS = 500;
const widths = new Map();

function widthOf(text) {
  if (widths.size > MOST_WIDTHS) widths.clear();
  if (!widths.has(text)) widths.set(text, pen.measureText(text).width);
  return widths.get(text);
}

// Names of one point are joined.
function joinedLabels() {
  const joined = [];
  for (const label of labels) {
    const near = joined.find(
      (other) =>
        other.below === label.below &&
        other.quiet === label.quiet &&
        other.hidden === label.hidden &&
        Math.hypot(other.p.x - label.p.x, other.p.y - label.p.y) < 9,
    );
    if (near) near.names.push(label.text);
    else joined.push({ ...label, names: [label.text] });
  }
  for (const label of joined) {
    const more = label.names.length - MOST_NAMES;
    label.text = label.names.slice(0, MOST_NAMES).join(", ") + (more > 0 ? ` +${more}` : "");
  }
  return joined;
}

function boxesOf({ p, below }, wide) {
  const places = below ? [[0, 3], ...LABEL_PLACES] : LABEL_PLACES;
  return places.map(([side, line]) => {
    const x = side === 0 ? p.x - wide / 2 : side > 0 ? p.x + 7 : p.x - 7 - wide;
    const middle = p.y + line * (LABEL_HEIGHT / 2 + 2);
    return {
      x: Math.min(Math.max(x, 4), 2 * lens.x - wide - 4),
      y: Math.min(Math.max(middle - LABEL_HEIGHT / 2, 2), 2 * lens.y - LABEL_HEIGHT - 2),
      wide,
      far: Math.abs(line) > 2 && !below,
    };
  });
}

const overlap = (a, b) =>
  a.x < b.x + b.wide + 3 && b.x < a.x + a.wide + 3 && a.y < b.y + LABEL_HEIGHT && b.y < a.y + LABEL_HEIGHT;

// A name for which there is no room is left out; the list of frames has it. Names of what is hidden are faint.
function paintLabels() {
  pen.font = LABEL_FONT;
  pen.textBaseline = "middle";
  pen.lineJoin = "round";
  const scale = `grid ${canvas.dataset.grid}`;
  const taken = [{ x: 10, y: 2 * lens.y - 18, wide: widthOf(scale) }];
  pen.fillStyle = colours.quiet;
  pen.fillText(scale, taken[0].x, taken[0].y + 8);
  for (const label of labels) label.hidden = isHidden(label.p);
  // What is in sight has the first choice of places.
  for (const label of joinedLabels().sort((a, b) => a.hidden - b.hidden)) {
    const box = boxesOf(label, widthOf(label.text)).find(
      (one) => !taken.some((other) => overlap(one, other)),
    );
    if (!box) continue;
    taken.push(box);
    const [x, y] = [box.x, box.y + LABEL_HEIGHT / 2];
    const alpha = label.hidden ? FAINT : 1;
    if (box.far)
      stroke(label.p, { ...label.p, x: label.p.x < x ? x - 2 : x + box.wide + 2, y }, colours.quiet, 0.8, 0.7 * alpha);
    pen.globalAlpha = alpha;
    pen.lineWidth = 3.5;
    pen.strokeStyle = colours.sky;
    pen.strokeText(label.text, x, y);
    pen.fillStyle = label.quiet ? colours.quiet : colours.ink;
    pen.fillText(label.text, x, y);
    pen.globalAlpha = 1;
  }
  pen.textBaseline = "alphabetic";
  labelBoxes = taken;
}
