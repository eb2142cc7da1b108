// What the painter paints with: lines, balls, pieces of cylinders, drums, a gripper.

let pen = null;
let items = [];

function stroke(a, b, colour, width, alpha = 1) {
  if (Math.min(a.depth, b.depth) < 0.03 * camera.distance) return;
  pen.globalAlpha = alpha;
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  pen.moveTo(a.x, a.y);
  pen.lineTo(b.x, b.y);
  pen.stroke();
  pen.globalAlpha = 1;
}

function item(depth, paint) {
  items.push({ depth, paint });
}

function mix(colour, other, s) {
  return `color-mix(in srgb, ${colour} ${Math.round(100 * (1 - s))}%, ${other})`;
}

// Light from the upper left: bright there, dark at both edges.
function sheen(gradient, colour) {
  gradient.addColorStop(0, mix(colour, "#000", 0.3));
  gradient.addColorStop(0.3, mix(colour, "#fff", 0.45));
  gradient.addColorStop(0.6, colour);
  gradient.addColorStop(1, mix(colour, "#000", 0.42));
  return gradient;
}

function ball(p, radius, colour) {
  const r = Math.max(radius * p.scale, 1.5);
  const gradient = pen.createRadialGradient(p.x - r / 3, p.y - r / 3, r / 8, p.x, p.y, r);
  gradient.addColorStop(0, mix(colour, "#fff", 0.5));
  gradient.addColorStop(0.6, colour);
  gradient.addColorStop(1, mix(colour, "#000", 0.4));
  pen.fillStyle = gradient;
  pen.beginPath();
  pen.arc(p.x, p.y, r, 0, 2 * Math.PI);
  pen.fill();
}

// A piece of a cylinder: a thick line whose shading runs across it.
function tube(a, b, radius, colour, cap) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const run = Math.hypot(dx, dy);
  const half = Math.max((radius * (a.scale + b.scale)) / 2, 0.8);
  if (run < 0.05) return ball(a, radius, colour);
  const side = -dy * -0.5 + dx * -0.85 > 0 ? 1 : -1;
  const [nx, ny] = [(side * -dy * half) / run, (side * dx * half) / run];
  const [x, y] = [(a.x + b.x) / 2, (a.y + b.y) / 2];
  pen.lineCap = cap;
  stroke(a, b, sheen(pen.createLinearGradient(x + nx, y + ny, x - nx, y - ny), colour), 2 * half);
}

// Long pieces are cut, so that the painter can sort them against each other.
function cylinder(a, b, radius, colour) {
  const pieces = Math.min(10, Math.max(1, Math.ceil(length(plus(b, a, -1)) / (2.5 * radius))));
  for (let i = 0; i < pieces; i++) {
    const from = project(plus(a, plus(b, a, -1), i / pieces));
    const to = project(plus(a, plus(b, a, -1), (i + 1) / pieces));
    item((from.depth + to.depth) / 2, () => tube(from, to, radius, colour, "round"));
  }
}

function disc(centre, u, v, radius, colour) {
  pen.beginPath();
  for (let k = 0; k < 28; k++) {
    const angle = (k * Math.PI) / 14;
    const p = project(plus(plus(centre, u, radius * Math.cos(angle)), v, radius * Math.sin(angle)));
    pen.lineTo(p.x, p.y);
  }
  pen.closePath();
  pen.fillStyle = colour;
  pen.fill();
  pen.lineWidth = 1;
  pen.strokeStyle = mix(colour, "#000", 0.35);
  pen.stroke();
}

// A joint: a short drum about its axis, its lid towards the eye.
function drum(centre, axis, radius, colour) {
  const d = unit(axis);
  const u = unit(cross(d, Math.abs(d[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const v = cross(d, u);
  const facing = dot(plus(lens.eye, centre, -1), d) > 0 ? 1 : -1;
  const [near, far] = [plus(centre, d, 0.95 * facing * radius), plus(centre, d, -0.95 * facing * radius)];
  item(project(centre).depth - radius, () => {
    disc(far, u, v, radius, mix(colour, "#000", 0.2));
    tube(project(far), project(near), radius, colour, "butt");
    disc(near, u, v, radius, mix(colour, "#fff", 0.18));
  });
}

// Two fingers that open along o and point along a; the hand point is between their tips.
function gripper(p, axes, grip, radius, colour) {
  const [, o, a] = triples(axes);
  const long = 4 * radius;
  const half = (0.14 + 0.5 * grip) * long;
  const palm = plus(p, a, -long);
  cylinder(plus(palm, o, -0.72 * long), plus(palm, o, 0.72 * long), 0.55 * radius, colours.metal);
  for (const side of [-half, half]) {
    const root = plus(palm, o, side);
    cylinder(root, plus(root, a, 1.12 * long), 0.36 * radius, colour);
  }
  return palm;
}
