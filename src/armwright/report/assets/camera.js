// A camera that looks at a point from a distance, and what it makes of places in the world.

const canvas = document.getElementById("view");
const FOCAL = 1.9; // focal length in units of the smaller side of the canvas
const HOME = { azimuth: -0.95, elevation: 0.4 };
const LOOKS = {
  reset: HOME,
  top: { azimuth: -Math.PI / 2, elevation: Math.PI / 2 },
  front: { azimuth: -Math.PI / 2, elevation: 0 },
  side: { azimuth: 0, elevation: 0 },
};
const camera = { ...HOME, distance: 1, target: [0, 0, 0] };

const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => a.map((value) => value / (length(a) || 1));
const triples = (row) => Array.from({ length: row.length / 3 }, (_, i) => row.slice(3 * i, 3 * i + 3));

let lens = null;

function aim(width, height) {
  const [sa, ca, se, ce] = [
    Math.sin(camera.azimuth),
    Math.cos(camera.azimuth),
    Math.sin(camera.elevation),
    Math.cos(camera.elevation),
  ];
  const forward = [-ce * ca, -ce * sa, -se];
  const right = [-sa, ca, 0];
  const eye = plus(camera.target, forward, -camera.distance);
  return {
    eye,
    forward,
    right,
    up: cross(right, forward),
    focal: FOCAL * Math.min(width, height),
    x: width / 2,
    y: height / 2,
  };
}

// Screen place, depth, and pixels per metre there.
function project(p) {
  const d = plus(p, lens.eye, -1);
  const depth = dot(d, lens.forward);
  const scale = lens.focal / Math.max(depth, 0.02 * camera.distance);
  return { x: lens.x + scale * dot(d, lens.right), y: lens.y - scale * dot(d, lens.up), depth, scale };
}

function orbit(dx, dy) {
  camera.azimuth -= dx * 0.008;
  camera.elevation = Math.min(Math.max(camera.elevation + dy * 0.008, -0.3), Math.PI / 2);
}

function shift(dx, dy) {
  const step = camera.distance / lens.focal;
  camera.target = plus(plus(camera.target, lens.right, -dx * step), lens.up, dy * step);
}

function zoom(factor) {
  camera.distance = Math.min(Math.max(camera.distance * factor, 0.25 * scenery.size), 12 * scenery.size);
}

function extent(points) {
  const low = [0, 1, 2].map((k) => points.reduce((least, p) => Math.min(least, p[k]), Infinity));
  const high = [0, 1, 2].map((k) => points.reduce((most, p) => Math.max(most, p[k]), -Infinity));
  return { low, high, size: Math.max(length(plus(high, low, -1)), 0.05) };
}

// The box about a shape, along its own axes: its lowest and its highest corner.
function boxAbout({ kind, size, radius, length: long = 0, vertices }) {
  if (kind === "mesh") return extent(triples(vertices));
  const along = kind === "cylinder" ? long / 2 : radius + long / 2;
  const high = kind === "box" ? size.map((v) => v / 2) : [radius, radius, along];
  return { low: high.map((v) => -v), high };
}

// The corners of the box about a body, in the world.
function boundsOf({ low, high }, X) {
  const corners = [];
  for (const x of [low[0], high[0]])
    for (const y of [low[1], high[1]])
      for (const z of [low[2], high[2]])
        corners.push([0, 1, 2].map((k) => X[k] * x + X[3 + k] * y + X[6 + k] * z + X[9 + k]));
  return corners;
}

// The frames of an arm, and the corners of its bodies; a rod is between frames.
function cornersOfArm({ bodies }, frames, boxes) {
  const corners = bodies.flatMap(({ shape, pose, frame, stretches }) =>
    stretches ? [] : boundsOf(boxes[shape], compose(frames[frame], pose)),
  );
  return [...frames.map((X) => X.slice(9)), ...corners];
}

// Everything the arms, the parts and the frames ever touch, in points; and the size of it all. Of what stands, no more
// than is near: a hall would make the arms small.
function surveyed() {
  const points = [[0, 0, 0]];
  const animation = data.animation ?? { arms: {}, frames: [], parts: [], fixtures: [], shapes: [], t: [] };
  const skip = Math.max(1, Math.floor(animation.t.length / 60));
  const boxes = animation.shapes.map(boxAbout);
  for (let i = 0; i < animation.t.length; i += skip)
    for (const figure of Object.values(animation.arms))
      points.push(...cornersOfArm(figure, framesOf(figure, [i, i, 0]), boxes));
  for (const frame of animation.frames) {
    frame.poses.forEach((row, i) => {
      if (i >= frame.visible_from && i % skip === 0) points.push(row.slice(9));
    });
  }
  for (const part of animation.parts)
    part.poses.forEach((X, i) => {
      if (part.arms[i] === null) points.push(...boundsOf(boxes[part.shape], X));
    });
  const near = extent(points);
  const margin = points.length > 1 ? 0.4 * near.size : Infinity;
  const [least, most] = [near.low.map((v) => v - margin), near.high.map((v) => v + margin)];
  let floor = 0;
  for (const { shape, pose } of animation.fixtures)
    for (const p of boundsOf(boxes[shape], pose)) {
      points.push(p.map((v, k) => Math.min(Math.max(v, least[k]), most[k])));
      floor = Math.min(floor, p[2]);
    }
  const all = extent(points);
  return { points, ...all, middle: plus(all.low, plus(all.high, all.low, -1), 0.5), floor };
}

const scenery = surveyed();

// Centre everything and step back until it fits.
function fit() {
  const [width, height] = [canvas.clientWidth || 600, canvas.clientHeight || 400];
  camera.target = [...scenery.middle];
  camera.distance = 3 * scenery.size;
  for (let round = 0; round < 8; round++) {
    lens = aim(width, height);
    const seen = scenery.points.map(project);
    const [left, right, top, bottom] = [
      Math.min(...seen.map((s) => s.x)),
      Math.max(...seen.map((s) => s.x)),
      Math.min(...seen.map((s) => s.y)),
      Math.max(...seen.map((s) => s.y)),
    ];
    shift(width / 2 - (left + right) / 2, height / 2 - (top + bottom) / 2);
    camera.distance *= Math.max((right - left) / (0.84 * width), (bottom - top) / (0.76 * height), 0.2);
  }
}
