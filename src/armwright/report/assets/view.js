// The three-dimensional view: floor, bodies with their shadows, frames, paths and names.

let pen = null;

// The way of a hand in pieces that know their stage; standing still leaves no piece.
function coloredPath(arm) {
  const pieces = [];
  const skip = Math.max(1, Math.floor(arm.t.length / 600));
  let last = 0;
  for (let i = 1; i < arm.t.length; i++) {
    const due = i - last >= skip || i === arm.t.length - 1;
    if (!due) continue;
    const [a, b] = [arm.hand[last], arm.hand[i]];
    if (length(plus(b, a, -1)) > scenery.size * 1e-4)
      pieces.push({ a, b, t: arm.t[last], stage: stageAt(arm.name, (arm.t[last] + arm.t[i]) / 2) });
    last = i;
  }
  return pieces;
}

// What can be left out of the view.
const layers = { planned: true, frames: true, paths: true, labels: true };

const paths = data.arms.map(coloredPath);

function armColour(i) {
  return colours.arms[i % colours.arms.length];
}

function tintOf({ name, tint, whose }) {
  if (tint === "part") return mixed(colours.hues[whose % HUES], colours.metal, 0.15);
  if (tint === "fixture") return mixed(colours.fixture, colours.quiet, name === "TABLE" ? 0 : 0.22);
  if (tint === "joint") return armColour(whose);
  if (tint === "base") return mixed(colours.metal, colours.quiet, 0.3);
  return mixed(colours.metal, armColour(whose), data.arms.length > 1 ? 0.18 : 0);
}

// Shadows fall on the floor and on the largest boxes that stand upright.
const MOST_TOPS = 6;

function topsOfBoxes() {
  const { shapes, fixtures } = data.animation;
  const areaOf = ({ shape }) => shapes[shape].size[0] * shapes[shape].size[1];
  const tops = fixtures
    .filter(({ shape, pose }) => shapes[shape].kind === "box" && Math.abs(pose[8]) > 0.9999)
    .sort((a, b) => areaOf(b) - areaOf(a))
    .slice(0, MOST_TOPS)
    .map(({ name, shape, pose }) => ({ name, height: pose[11] + shapes[shape].size[2] / 2 }));
  return [...tops, { name: null, height: scenery.floor }];
}

function paintBodies(bodies, tops) {
  const ownerOf = ({ name, tint }) => (tint === "fixture" ? tops.findIndex((top) => top.name === name) + 1 : 0);
  const corners = bodies.map(({ shape, pose }) => cornersOf(meshes[shape], pose));
  bodies.forEach((body, i) => {
    paintMesh(meshes[body.shape], corners[i], body.pose, tintOf(body), ownerOf(body));
  });
  tops.forEach(({ name, height }, k) => {
    if (lens.eye[2] <= height) return;
    bodies.forEach(({ shape }, i) => {
      paintShadow(meshes[shape], corners[i], height, name === null ? FLOOR : k + 1);
    });
  });
}

function paintSolids(bodies, width, height) {
  const stands = ({ tint }) => tint === "fixture";
  sizeSurface(width, height);
  const key = JSON.stringify([camera, surface.wide, surface.high, colours.fixture, colours.quiet, Boolean(graphics)]);
  // Shadows hide nothing.
  const lit = graphics ? [] : topsOfBoxes();
  paintStanding(key, () => paintBodies(bodies.filter(stands), lit));
  paintBodies(
    bodies.filter((body) => !stands(body)),
    lit,
  );
  if (graphics) drawGraphics(bodies, width, height);
  else showSurface(width, height);
}

// Lines, each from one point of the screen to the next; pieces behind the eye are left out.
function strokeLines(lines, colour, width, alpha = 1) {
  const nearest = 0.03 * camera.distance;
  pen.globalAlpha = alpha;
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  for (const points of lines) {
    let last = null;
    for (const point of points) {
      const seen = point.depth >= nearest;
      if (seen && last) pen.lineTo(point.x, point.y);
      else if (seen) pen.moveTo(point.x, point.y);
      last = seen ? point : null;
    }
  }
  pen.stroke();
  pen.globalAlpha = 1;
}

const stroke = (a, b, colour, width, alpha) => strokeLines([[a, b]], colour, width, alpha);

// A line whose pieces behind a body are faint: it stays visible there.
function strokeBehind(a, b, colour, width, alpha = 1) {
  const [from, to] = [project(a), project(b)];
  const pieces = Math.min(40, Math.max(1, Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / 5)));
  const along = plus(b, a, -1);
  const point = (k) => project(plus(a, along, k / pieces));
  pen.lineCap = pieces > 1 ? "butt" : "round";
  const lines = { true: [], false: [] };
  let [line, was] = [[from], null];
  for (let k = 0; k < pieces; k++) {
    const hidden = isHidden(point(k + 0.5));
    if (hidden !== was) lines[hidden].push((line = [line.at(-1)]));
    was = hidden;
    line.push(point(k + 1));
  }
  if (lines.false.length) strokeLines(lines.false, colour, width, alpha);
  if (lines.true.length) strokeLines(lines.true, colour, width, 0.28 * alpha);
}

function paintFrames(place) {
  const long = scenery.size * 0.055;
  data.animation.frames.forEach((frame) => {
    if (place[0] < frame.visible_from && !(place[2] > 0 && place[1] >= frame.visible_from)) return;
    const at = place[0] < frame.visible_from ? [place[1], place[1], 0] : place;
    const [n, o, a, p] = triples(blend(frame.poses, at));
    for (const [axis, colour] of [
      [n, colours.red],
      [o, colours.green],
      [a, colours.blue],
    ])
      strokeBehind(p, plus(p, axis, long), colour, 2.2);
    labels.push({ p: project(p), text: frame.name });
  });
}

function paintPath(pieces, shown) {
  for (const { a, b, t, stage } of pieces) {
    const colour = stage < 0 ? colours.quiet : colours.hues[stage % HUES];
    const past = t <= now.t;
    strokeBehind(a, b, colour, past ? 2.8 : 1.8, (past ? 0.95 : 0.5) * (shown ? 1 : 0.6));
  }
}

// Where an arm was to be, as lines through the origins of its frames: in front of all bodies where the arm is visibly
// elsewhere, faint inside them otherwise.
const VISIBLE = 2e-3;

function paintPlanned(figure, frames, place) {
  const points = framesOf(figure, place, figure.planned).map((X) => X.slice(9));
  const apart = points.some((point, i) => length(plus(point, frames[i].slice(9), -1)) > VISIBLE);
  points.slice(1).forEach((point, i) => {
    if (apart) stroke(project(points[i]), project(point), colours.accent, 2.6, 0.85);
    else strokeBehind(points[i], point, colours.accent, 2, 0.75);
  });
}

// The plane of contact of the cell, as a pane with its height.
function paintPlane(height) {
  const margin = 0.06 * scenery.size;
  const [[x0, y0], [x1, y1]] = [scenery.low.map((v) => v - margin), scenery.high.map((v) => v + margin)];
  const corners = [
    [x0, y0],
    [x1, y0],
    [x1, y1],
    [x0, y1],
  ].map(([x, y]) => project([x, y, height]));
  if (corners.some(({ depth }) => depth < 0.03 * camera.distance)) return;
  pen.beginPath();
  for (const { x, y } of corners) pen.lineTo(x, y);
  pen.closePath();
  pen.fillStyle = pen.strokeStyle = colours.accent;
  pen.lineWidth = 1.2;
  pen.globalAlpha = 0.1;
  pen.fill();
  pen.globalAlpha = 0.6;
  pen.stroke();
  pen.globalAlpha = 1;
  const inside = corners.find(({ x, y }) => x > 0 && y > 0 && x < 2 * lens.x && y < 2 * lens.y);
  labels.push({ p: inside ?? corners[0], text: `contact at z = ${number(height * MILLIMETRES, 1)} mm`, quiet: true });
}

function paintFloor() {
  const step = roundStep(scenery.size, 9);
  const [low, high] = [
    scenery.low.slice(0, 2).map((v) => Math.floor(v / step) - 1),
    scenery.high.slice(0, 2).map((v) => Math.ceil(v / step) + 1),
  ];
  const count = (k) => high[k] - low[k] + 1;
  const rows = Array.from({ length: count(0) }, (_, i) =>
    Array.from({ length: count(1) }, (__, j) => project([(low[0] + i) * step, (low[1] + j) * step, scenery.floor])),
  );
  const columns = rows[0].map((_, j) => rows.map((row) => row[j]));
  strokeLines([...rows, ...columns], colours.floor, 1);
  const text = `${number(step * MILLIMETRES, 0)} mm`;
  if (canvas.dataset.grid !== text) canvas.dataset.grid = text;
}

function paintWorldAxes() {
  const long = 1.6 * roundStep(scenery.size, 9);
  pen.font = LABEL_FONT;
  [
    ["x", colours.red],
    ["y", colours.green],
    ["z", colours.blue],
  ].forEach(([name, colour], k) => {
    const end = [0, 1, 2].map((i) => (i === k ? long : 0));
    strokeBehind([0, 0, 0], end, colour, 1.6);
    const tip = project(end);
    pen.fillStyle = colour;
    pen.globalAlpha = isHidden(tip) ? 0.4 : 1;
    pen.fillText(name, tip.x + 4, tip.y - 3);
    pen.globalAlpha = 1;
  });
}

function paintHand(p) {
  const at = project(p);
  pen.beginPath();
  pen.arc(at.x, at.y, 4, 0, 2 * Math.PI);
  pen.globalAlpha = isHidden(at) ? 0.4 : 1;
  pen.fillStyle = colours.card;
  pen.fill();
  pen.lineWidth = 2;
  pen.strokeStyle = colours.accent;
  pen.stroke();
  pen.globalAlpha = 1;
}

// Frames, arms, parts and what stands are named, and nothing twice.
function nameBodies(bodies, arms) {
  const named = new Set(labels.map((label) => label.text.toUpperCase()));
  for (const { name, pose, tint } of bodies)
    if ((tint === "part" || (tint === "fixture" && name !== "TABLE")) && !named.has(name.toUpperCase()))
      labels.push({ p: project(pose.slice(9)), text: name, quiet: tint === "fixture" });
  if (arms.length > 1)
    for (const [name, _, frames] of arms) labels.push({ p: project(frames[0].slice(9)), text: name, below: true });
}

// What is painted over the view each time that it is drawn.
const overpaint = [];

function drawView() {
  if (!data.animation || !canvas.clientWidth) return;
  let width, height;
  [pen, width, height] = sharpen(canvas);
  pen.lineCap = "butt";
  lens = aim(width, height);
  labels = [];
  const { place, bodies, arms } = bodiesAt(now.t);
  paintFloor();
  const { contact_plane } = data.animation;
  if (contact_plane !== null && contact_plane !== undefined) paintPlane(contact_plane);
  paintSolids(bodies, width, height);
  paintWorldAxes();
  if (layers.paths)
    paths.forEach((pieces, i) => {
      paintPath(pieces, i === now.arm);
    });
  if (layers.frames) paintFrames(place);
  if (layers.planned && !now.jog)
    for (const [_, figure, frames] of arms) if (figure.planned) paintPlanned(figure, frames, place);
  for (const [_, __, frames] of arms) paintHand(frames.at(-1).slice(9));
  nameBodies(bodies, arms);
  if (!layers.labels) labels = [];
  paintLabels();
  for (const paint of overpaint) paint();
}

// Arms that are moved by hand are elsewhere than at first.
function look(name) {
  Object.assign(camera, LOOKS[name]);
  Object.assign(scenery, surveyed());
  fit();
  drawView();
}

// Buttons for what can be left out; planned arms only where the view draws measured ones.
function startLayers() {
  const measured = Object.values(data.animation?.arms ?? {}).some((figure) => figure.planned);
  for (const button of document.querySelectorAll("[data-layer]")) {
    const { layer } = button.dataset;
    button.hidden = layer === "planned" && !measured;
    button.addEventListener("click", () => {
      layers[layer] = !layers[layer];
      button.ariaPressed = String(layers[layer]);
      drawView();
    });
  }
}

// What moves the view: one finger or the mouse turns it, with Shift it is shifted; two fingers turn and zoom it.
function turnBy(fingers, event) {
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
  };
  const last = fingers.get(event.pointerId);
  const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
  const before = fingers.size === 2 ? spread() : 1;
  fingers.set(event.pointerId, [event.clientX, event.clientY]);
  if (fingers.size === 2) {
    zoom(before / spread());
    orbit(dx / 2, dy / 2);
  } else if (event.shiftKey || event.buttons === 2) shift(dx, dy);
  else orbit(dx, dy);
}

let hintTimer = 0;

function hint(text) {
  const element = byId("view-hint");
  element.textContent = text;
  element.classList.add("shown");
  clearTimeout(hintTimer);
  hintTimer = setTimeout(() => element.classList.remove("shown"), 1200);
}

// On a page that `scrolls` one finger and the wheel scroll the page, two fingers and the wheel with Ctrl change the view.
function startView({ scrolls = false } = {}) {
  const fingers = new Map();
  canvas.classList.toggle("scrolls", scrolls);
  canvas.addEventListener("pointerdown", (event) => {
    if (!scrolls || event.pointerType !== "touch") canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    if (scrolls && event.pointerType === "touch" && fingers.size < 2) return hint("Two fingers turn and zoom the view");
    turnBy(fingers, event);
    drawView();
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => {
      fingers.delete(event.pointerId);
    });
  if (scrolls)
    for (const touch of ["touchstart", "touchmove"])
      canvas.addEventListener(
        touch,
        (event) => {
          if (event.touches.length > 1) event.preventDefault();
        },
        { passive: false },
      );
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (scrolls && !event.ctrlKey && !event.metaKey) return hint("Ctrl and the wheel zoom the view");
      event.preventDefault();
      zoom(Math.exp(event.deltaY * 0.0012));
      drawView();
    },
    { passive: false },
  );
  for (const button of document.querySelectorAll("[data-camera]"))
    button.addEventListener("click", () => look(button.dataset.camera));
  startLayers();
  document.getElementById("view-empty").hidden = Boolean(data.animation);
  if (data.animation) fit();
}
