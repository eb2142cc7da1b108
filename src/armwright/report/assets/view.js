// The three-dimensional view: floor, frames, paths and arms, painted from the farthest to the nearest.

let labels = [];

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

const paths = data.arms.map(coloredPath);

function armColour(i) {
  return colours.arms[i % colours.arms.length];
}

function shadow(points, radius) {
  if (lens.eye[2] <= 0) return;
  pen.lineCap = pen.lineJoin = "round";
  pen.strokeStyle = colours.shadow;
  pen.lineWidth = 2 * radius * project(points[0]).scale;
  pen.beginPath();
  for (const point of points) {
    const p = project([point[0], point[1], 0]);
    pen.lineTo(p.x, p.y);
  }
  pen.stroke();
}

// The pieces of a skeleton that have a length, each with its radius.
function bones(points, radii) {
  const thick = scenery.size * 0.022;
  const chosen = (k) => thick * (1 - (0.5 * k) / Math.max(points.length - 2, 1));
  return points
    .slice(1)
    .map((to, k) => ({ from: points[k], to, radius: radii ? radii[k] : chosen(k) }))
    .filter(({ from, to }) => length(plus(to, from, -1)) > 1e-6);
}

// The last bone ends at the palm, and a short one has a small gripper.
function paintGripper(hand, axes, grip, last, colour) {
  const room = last ? length(plus(last.to, last.from, -1)) : 0;
  const slim = last?.radius ?? 0;
  const wanted = Math.max(slim, 0.014 * scenery.size);
  const radius = room > 4 * slim ? Math.min(wanted, 0.23 * room) : wanted;
  const palm = gripper(hand, axes, grip, radius, colour);
  if (room > 4 * radius) last.to = palm;
}

function paintArm(name, figure, i, place) {
  const points = triples(blend(figure.points, place));
  const skeleton = bones(points, figure.radii);
  const [before, after, part] = place;
  const grip = figure.grip[before] + part * (figure.grip[after] - figure.grip[before]);
  const colour = armColour(i);
  const hand = points.at(-1);
  shadow(points, (skeleton.at(-1)?.radius ?? 0.01) * 1.3);
  paintGripper(hand, blend(figure.hand_axes, place), grip, skeleton.at(-1), colour);
  for (const { from, to, radius } of skeleton) cylinder(from, to, radius, colours.metal);
  const radii = skeleton.map(({ radius }) => radius);
  if (figure.joint_axes) paintDrums(blend(figure.joint_axes, place), radii, colour);
  else
    for (const { from, radius } of skeleton)
      item(project(from).depth - radius, () => ball(project(from), 1.35 * radius, colour));
  if (Object.keys(data.animation.arms).length > 1) labels.push({ p: project(points[0]), text: name, below: true });
  return hand;
}

// Where wrist axes meet in one point the later drum is the smaller one.
function paintDrums(rows, radii, colour) {
  const count = rows.length / 6;
  for (let k = 0; k < count; k++) {
    const radius = radii[Math.floor((k * radii.length) / count)] ?? 0.02 * scenery.size;
    drum(rows.slice(6 * k, 6 * k + 3), rows.slice(6 * k + 3, 6 * k + 6), (1.38 - 0.05 * k) * radius, colour);
  }
}

function paintFrames(place) {
  const arm = scenery.size * 0.055;
  data.animation.frames.forEach((frame) => {
    if (place[0] < frame.visible_from && !(place[2] > 0 && place[1] >= frame.visible_from)) return;
    const at = place[0] < frame.visible_from ? [place[1], place[1], 0] : place;
    const [n, o, a, p] = triples(blend(frame.poses, at));
    const root = project(p);
    [
      [n, colours.red],
      [o, colours.green],
      [a, colours.blue],
    ].forEach(([axis, colour]) => {
      const tip = project(plus(p, axis, arm));
      item((root.depth + tip.depth) / 2 - arm / 2, () => {
        pen.lineCap = "round";
        stroke(root, tip, colour, 2.2);
      });
    });
    labels.push({ p: root, text: frame.name });
  });
}

function paintPath(pieces, shown) {
  for (const piece of pieces) {
    const [a, b] = [project(piece.a), project(piece.b)];
    const colour = piece.stage < 0 ? colours.quiet : colours.hues[piece.stage % HUES];
    const past = piece.t <= now.t;
    const alpha = (past ? 0.95 : 0.5) * (shown ? 1 : 0.6);
    item((a.depth + b.depth) / 2, () => {
      pen.lineCap = "round";
      stroke(a, b, colour, past ? 2.8 : 1.8, alpha);
    });
    // Once more above everything, faintly: the way stays visible behind an arm.
    item(-1, () => stroke(a, b, colour, 1.4, 0.3 * alpha));
  }
}

function paintFloor() {
  const step = roundStep(scenery.size, 9);
  const [x0, y0, x1, y1] = [
    ...scenery.low.slice(0, 2).map((v) => Math.floor(v / step) - 1),
    ...scenery.high.slice(0, 2).map((v) => Math.ceil(v / step) + 1),
  ];
  for (let x = x0; x <= x1; x++)
    for (let y = y0; y < y1; y++)
      stroke(project([x * step, y * step, 0]), project([x * step, (y + 1) * step, 0]), colours.floor, 1);
  for (let y = y0; y <= y1; y++)
    for (let x = x0; x < x1; x++)
      stroke(project([x * step, y * step, 0]), project([(x + 1) * step, y * step, 0]), colours.floor, 1);
  const origin = project([0, 0, 0]);
  pen.font = "12px system-ui, sans-serif";
  [
    ["x", colours.red],
    ["y", colours.green],
    ["z", colours.blue],
  ].forEach(([name, colour], k) => {
    const tip = project([0, 1, 2].map((i) => (i === k ? 1.6 * step : 0)));
    stroke(origin, tip, colour, 1.6);
    pen.fillStyle = colour;
    pen.fillText(name, tip.x + 4, tip.y - 3);
  });
  document.getElementById("view").dataset.grid = `${number(step * MILLIMETRES, 0)} mm`;
}

// Names that would lie on each other are joined.
function paintLabels() {
  const joined = [];
  for (const label of labels) {
    const near = joined.find(
      (other) => other.below === label.below && Math.hypot(other.p.x - label.p.x, other.p.y - label.p.y) < 9,
    );
    if (near) near.text += `, ${label.text}`;
    else joined.push({ ...label });
  }
  pen.font = "12px system-ui, sans-serif";
  pen.lineJoin = "round";
  pen.lineWidth = 3.5;
  pen.strokeStyle = colours.sky;
  for (const { p, text, below } of joined) {
    const x = Math.min(Math.max(p.x + (below ? -18 : 7), 4), canvas.clientWidth - pen.measureText(text).width - 4);
    const y = p.y + (below ? 24 : -5);
    pen.strokeText(text, x, y);
    pen.fillStyle = colours.ink;
    pen.fillText(text, x, y);
  }
  pen.fillStyle = colours.quiet;
  pen.fillText(`grid ${canvas.dataset.grid}`, 10, canvas.clientHeight - 10);
}

function paintHand(p) {
  const at = project(p);
  item(at.depth - scenery.size, () => {
    pen.beginPath();
    pen.arc(at.x, at.y, 4, 0, 2 * Math.PI);
    pen.fillStyle = colours.card;
    pen.fill();
    pen.lineWidth = 2;
    pen.strokeStyle = colours.accent;
    pen.stroke();
  });
}

function drawView() {
  if (!data.animation || !canvas.clientWidth) return;
  let width, height;
  [pen, width, height] = sharpen(canvas);
  lens = aim(width, height);
  [items, labels] = [[], []];
  const place = locate(data.animation.t, now.t);
  paintFloor();
  paintFrames(place);
  paths.forEach((pieces, i) => paintPath(pieces, i === now.arm));
  Object.entries(data.animation.arms).forEach(([name, figure], i) => paintHand(paintArm(name, figure, i, place)));
  items.sort((a, b) => b.depth - a.depth).forEach(({ paint }) => paint());
  paintLabels();
}

function look(name) {
  Object.assign(camera, LOOKS[name]);
  fit();
  drawView();
}

function startView() {
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    const before = fingers.size === 2 ? spread() : 1;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size === 2) zoom(before / spread());
    else if (event.shiftKey || event.buttons === 2) shift(dx, dy);
    else orbit(dx, dy);
    drawView();
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      zoom(Math.exp(event.deltaY * 0.0012));
      drawView();
    },
    { passive: false },
  );
  for (const button of document.querySelectorAll("[data-camera]"))
    button.addEventListener("click", () => look(button.dataset.camera));
  document.getElementById("view-empty").hidden = Boolean(data.animation);
  if (data.animation) fit();
}
