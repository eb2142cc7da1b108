// Points in space with arrows, and an arm among them: seen along parallel lines, and turned by hand.

const data = JSON.parse(document.getElementById("data").textContent);
const view = document.getElementById("points");
// Half the height of the view in its own units, and how much of it the points may take.
const [HALF, FILLED] = [32, 0.9];
// How far the view is turned about the vertical and tipped [rad], by how much a key turns it, and a pixel.
const eye = { turn: -0.9, tip: 0.42 };
const [KEY, PIXEL] = [0.12, 0.008];

const marked = new Set(data.marked);
const ends = data.points.map((point, i) => point.map((x, k) => x - (data.arrows[i]?.[k] ?? 0)));
const all = [...data.points, ...ends, ...data.arm];
const [low, high] = [Math.min, Math.max].map((least) => [0, 1, 2].map((k) => all.reduce((x, point) => least(x, point[k]), all[0][k])));
const middle = low.map((x, k) => (x + high[k]) / 2);
const scale = (FILLED * HALF) / Math.max(1e-9, ...all.map((point) => Math.hypot(...point.map((x, k) => x - middle[k]))));

// Where a point is seen: right, down, and how near it is.
function seen(point) {
  const [x, y, z] = point.map((value, k) => (value - middle[k]) * scale);
  const [c, s] = [Math.cos(eye.turn), Math.sin(eye.turn)];
  const [right, away] = [c * x - s * y, s * x + c * y];
  return [right, -(Math.cos(eye.tip) * z + Math.sin(eye.tip) * away), Math.sin(eye.tip) * z - Math.cos(eye.tip) * away];
}

function shape(kind, properties, text) {
  const element = document.createElementNS(view.namespaceURI, kind);
  for (const [name, value] of Object.entries(properties)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

const line = (points, name) =>
  shape("path", { class: name, d: `M${points.map((point) => seen(point).slice(0, 2).map((x) => x.toFixed(2))).join("L")}` });

// A square on the floor below everything, and the axes from the foot of the arm.
function ground() {
  const floor = Math.min(low[2], 0);
  const corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]];
  const size = Math.max(high[0] - low[0], high[1] - low[1]) / 3;
  const square = line(corners.map(([i, j]) => [i ? high[0] : low[0], j ? high[1] : low[1], floor]), "floor");
  const axes = ["x", "y", "z"].flatMap((name, k) => {
    const end = [0, 0, 0].map((_, i) => (i === k ? size : 0));
    const [x, y] = seen(end);
    return [line([[0, 0, 0], end], `axis ${name}`), shape("text", { x, y, dx: 0.6, dy: -0.4, class: `axis ${name}` }, name)];
  });
  return [square, ...axes];
}

function reading(i) {
  const [x, y] = seen(data.points[i]);
  const group = shape("g", { class: marked.has(i) ? "reading marked" : "reading" });
  if (data.arrows[i]) {
    const [x0, y0] = seen(ends[i]);
    group.append(line([ends[i], data.points[i]], "arrow"));
    const length = Math.hypot(x - x0, y - y0);
    if (length > 0.6) group.append(head(x, y, (x - x0) / length, (y - y0) / length));
    group.append(shape("circle", { cx: x0, cy: y0, r: 0.45 }));
  } else group.append(shape("circle", { cx: x, cy: y, r: 0.45 }));
  if (marked.has(i)) group.append(shape("text", { x: x + 1, y: y - 0.8 }, data.said[i]));
  group.append(shape("title", {}, data.said[i]));
  return group;
}

function head(x, y, dx, dy) {
  const corners = [[0, 0], [-1.1, 0.5], [-1.1, -0.5]].map(([along, aside]) => [
    (x + along * dx - aside * dy).toFixed(2),
    (y + along * dy + aside * dx).toFixed(2),
  ]);
  return shape("path", { class: "head", d: `M${corners.join("L")}Z` });
}

function draw() {
  const nearest = data.points.map((point, i) => [seen(point)[2], i]).sort(([a], [b]) => a - b);
  view.replaceChildren(...ground(), line(data.arm, "arm"), ...nearest.map(([, i]) => reading(i)));
}

function turn(right, down) {
  eye.turn += right;
  eye.tip = Math.min(Math.PI / 2, Math.max(-0.2, eye.tip + down));
  draw();
}

view.addEventListener("pointerdown", (event) => view.setPointerCapture(event.pointerId));
view.addEventListener("pointermove", (event) => {
  if (event.buttons & 1) turn(event.movementX * PIXEL, event.movementY * PIXEL);
});
view.addEventListener("keydown", (event) => {
  const by = { ArrowLeft: [-KEY, 0], ArrowRight: [KEY, 0], ArrowUp: [0, -KEY], ArrowDown: [0, KEY] }[event.key];
  if (!by) return;
  event.preventDefault();
  turn(...by);
});
draw();
