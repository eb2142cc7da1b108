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

// Everything the hand, the arms and the frames ever touch, in points; and the size of it all.
function surveyed() {
  const points = [[0, 0, 0]];
  const animation = data.animation ?? { arms: {}, frames: [], t: [] };
  const skip = Math.max(1, Math.floor(animation.t.length / 60));
  for (const figure of Object.values(animation.arms)) {
    figure.points.forEach((row, i) => {
      if (i % skip === 0) points.push(...triples(row));
    });
  }
  for (const frame of animation.frames) {
    frame.poses.forEach((row, i) => {
      if (i >= frame.visible_from && i % skip === 0) points.push(row.slice(9));
    });
  }
  const low = [0, 1, 2].map((k) => Math.min(...points.map((p) => p[k])));
  const high = [0, 1, 2].map((k) => Math.max(...points.map((p) => p[k])));
  const size = Math.max(length(plus(high, low, -1)), 0.05);
  return { points, low, high, size, middle: plus(low, plus(high, low, -1), 0.5) };
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
