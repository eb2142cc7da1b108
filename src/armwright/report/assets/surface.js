// Triangles with a depth at every pixel: what is nearer hides what is farther. Pixels are finer than those of the screen,
// so that edges come out smooth; where the graphics processor draws they are coarse and tell only what is hidden.

// Pixels at most, and per pixel of the page along either side.
const MOST_PIXELS = 1.6e6;
const FINEST = 2;
const COARSE = 0.5;
const SHADES = 256;
const surface = { canvas: document.createElement("canvas"), wide: 0, high: 0, ratio: 1 };

function sizeSurface(width, height) {
  const finest = graphics ? COARSE : FINEST * (window.devicePixelRatio || 1);
  const ratio = Math.min(finest, Math.sqrt(MOST_PIXELS / (width * height)));
  const [wide, high] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (surface.wide !== wide || surface.high !== high) {
    Object.assign(surface.canvas, { width: wide, height: high });
    const image = new ImageData(wide, high);
    const pixels = new Uint32Array(image.data.buffer);
    Object.assign(surface, { wide, high, image, pixels });
    surface.depth = new Float32Array(wide * high); // 1 / depth [1/m], 0 where there is nothing
    surface.owner = new Uint8Array(wide * high); // on which a shadow may still fall, 0 for none
  }
  surface.ratio = ratio;
}

// What never moves is painted once, as long as it is seen from the same place: `paint` paints it on a clear surface.
// What has been painted over it since is in some of the rows.
const standing = { key: "", first: 0, last: 0 };

function paintStanding(key, paint) {
  const layers = ["pixels", "depth", "owner"];
  const from = standing.first * surface.wide;
  const to = standing.last * surface.wide;
  if (standing.key === key) {
    for (const layer of layers) surface[layer].set(standing[layer].subarray(from, to), from);
    // Those that are shown anew, until more are painted over.
    Object.assign(surface, { first: standing.first, last: standing.last });
    Object.assign(standing, { first: surface.high, last: 0 });
    return;
  }
  surface.pixels.fill(0);
  surface.depth.fill(0);
  surface.owner.fill(FLOOR);
  paint();
  for (const layer of layers) standing[layer] = surface[layer].slice();
  Object.assign(standing, { key, first: surface.high, last: 0 });
  Object.assign(surface, { first: 0, last: surface.high });
}

function showSurface(width, height) {
  const first = Math.min(surface.first, standing.first);
  const rows = Math.max(surface.last, standing.last) - first;
  if (rows > 0) surface.canvas.getContext("2d").putImageData(surface.image, 0, 0, 0, first, surface.wide, rows);
  // The mean of two by two pixels is as smooth as what takes three times as long.
  pen.imageSmoothingEnabled = true;
  pen.imageSmoothingQuality = "low";
  pen.drawImage(surface.canvas, 0, 0, width, height);
}

// Whether something is in front of a projected point.
function isHidden({ x, y, depth }) {
  const [i, j] = [Math.floor(x * surface.ratio), Math.floor(y * surface.ratio)];
  if (i < 0 || j < 0 || i >= surface.wide || j >= surface.high) return false;
  return surface.depth[j * surface.wide + i] > 1.01 / depth;
}

const channels = (colour) => [1, 3, 5].map((k) => Number.parseInt(colour.slice(k, k + 2), 16));

function mixed(one, other, share) {
  const [a, b] = [channels(one), channels(other)];
  return `#${a
    .map((v, k) =>
      Math.round(v + share * (b[k] - v))
        .toString(16)
        .padStart(2, "0"),
    )
    .join("")}`;
}

// The shades of a colour as pixels, from the dark side to where the light falls.
const ramps = new Map();

function rampOf(colour) {
  if (!ramps.has(colour)) {
    const shades = new Uint32Array(SHADES);
    for (let i = 0; i < SHADES; i++) {
      const light = i / (SHADES - 1);
      const shade =
        light < 0.62
          ? mixed("#000000", colour, 0.42 + 0.58 * (light / 0.62))
          : mixed(colour, "#ffffff", ((light - 0.62) / 0.38) * 0.34);
      const [r, g, b] = channels(shade);
      shades[i] = (255 << 24) | (b << 16) | (g << 8) | r;
    }
    ramps.set(colour, shades);
  }
  return ramps.get(colour);
}

// What a triangle is painted with: the shades of a colour, or a shadow on what has the same owner and the same depth.
const FLOOR = 255;
const SHADOW = 0x2e000000;
const brush = { ramp: null, owner: 0 };

function paintRow(from, to, depth, depthStep, shade, shadeStep) {
  const { depth: depths, pixels, owner: owners } = surface;
  const { ramp, owner } = brush;
  if (ramp)
    for (let i = from; i < to; i++, depth += depthStep, shade += shadeStep) {
      if (depth <= depths[i]) continue;
      depths[i] = depth;
      owners[i] = owner;
      pixels[i] = ramp[shade < 0 ? 0 : shade > SHADES - 1 ? SHADES - 1 : shade | 0];
    }
  else if (owner === FLOOR)
    for (let i = from; i < to; i++) {
      if (owners[i] !== FLOOR) continue;
      pixels[i] = SHADOW;
      owners[i] = 0;
    }
  else
    for (let i = from; i < to; i++, depth += depthStep) {
      if (owners[i] !== owner || Math.abs(depth - depths[i]) > 1e-3 * depth) continue;
      pixels[i] = (0xff000000 | (((pixels[i] >>> 1) & 0x7f7f7f) + ((pixels[i] >>> 2) & 0x3f3f3f))) >>> 0;
      owners[i] = 0;
    }
}

// The corners of the body that is painted: in the axes of the camera, and on the surface with 1 / depth and shade.
const room = 8 + Math.max(0, ...meshes.map((mesh) => mesh.corners.length / 3));
const [right, up, ahead] = [new Float64Array(room), new Float64Array(room), new Float64Array(room)];
const [xs, ys, nears, shades] = [0, 1, 2, 3].map(() => new Float64Array(room));

function place(i, x, y, z) {
  const [dx, dy, dz] = [x - lens.eye[0], y - lens.eye[1], z - lens.eye[2]];
  right[i] = dx * lens.right[0] + dy * lens.right[1] + dz * lens.right[2];
  up[i] = dx * lens.up[0] + dy * lens.up[1] + dz * lens.up[2];
  ahead[i] = dx * lens.forward[0] + dy * lens.forward[1] + dz * lens.forward[2];
  toPixel(i);
}

function toPixel(i) {
  const scale = (lens.focal / ahead[i]) * surface.ratio;
  xs[i] = lens.x * surface.ratio + scale * right[i];
  ys[i] = lens.y * surface.ratio - scale * up[i];
  nears[i] = 1 / ahead[i];
}

// Where a row crosses the side from one corner to another; null where it does not.
function crossing(px, py, qx, qy, y) {
  return py <= y === qy <= y ? null : px + ((y - py) / (qy - py)) * (qx - px);
}

// Fill the triangle of corners a, b, c; towards the eye they go round against the clock.
function fill(a, b, c, bothSides) {
  const ax = xs[a];
  const ay = ys[a];
  const [bx, by, cx, cy] = [xs[b] - ax, ys[b] - ay, xs[c] - ax, ys[c] - ay];
  const area = bx * cy - cx * by;
  if (!(bothSides ? area : area < 0)) return;
  // 1 / depth and shade are linear on the surface: by how much they grow along x and along y.
  const along = (list) => ((list[b] - list[a]) * cy - (list[c] - list[a]) * by) / area;
  const down = (list) => ((list[c] - list[a]) * bx - (list[b] - list[a]) * cx) / area;
  const nearStep = along(nears);
  const nearDown = down(nears);
  const shadeStep = along(shades);
  const shadeDown = down(shades);
  const top = Math.max(0, Math.ceil(ay + Math.min(0, by, cy) - 0.5));
  const bottom = Math.min(surface.high, Math.ceil(ay + Math.max(0, by, cy) - 0.5));
  if (top < standing.first) standing.first = top;
  if (bottom > standing.last) standing.last = bottom;
  for (let row = top; row < bottom; row++) {
    const y = row + 0.5 - ay;
    // The row crosses two of the sides.
    const u = crossing(0, 0, bx, by, y);
    const v = crossing(bx, by, cx, cy, y);
    const w = crossing(cx, cy, 0, 0, y);
    const p = u === null ? v : u;
    const q = u === null || v === null ? w : v;
    if (p === null || q === null) continue;
    const from = Math.max(0, Math.ceil(ax + Math.min(p, q) - 0.5));
    const to = Math.min(surface.wide, Math.ceil(ax + Math.max(p, q) - 0.5));
    if (from >= to) continue;
    const x = from + 0.5 - ax;
    const first = row * surface.wide;
    const near = nears[a] + nearStep * x + nearDown * y;
    paintRow(first + from, first + to, near, nearStep, shades[a] + shadeStep * x + shadeDown * y, shadeStep);
  }
}

// What is nearer than `near` is cut off; the new corners come behind those of the mesh.
function fillCut(corners, near, bothSides) {
  const kept = [];
  let next = room - 8;
  corners.forEach((p, i) => {
    const q = corners[(i + 1) % 3];
    if (ahead[p] >= near) kept.push(p);
    if (ahead[p] >= near === ahead[q] >= near) return;
    const s = (near - ahead[p]) / (ahead[q] - ahead[p]);
    for (const list of [right, up, ahead, shades]) list[next] = list[p] + s * (list[q] - list[p]);
    toPixel(next);
    kept.push(next++);
  });
  for (let n = 2; n < kept.length; n++) fill(kept[0], kept[n - 1], kept[n], bothSides);
}

function fillAll(faces, bothSides) {
  const near = 0.02 * camera.distance;
  for (let f = 0; f < faces.length; f += 3) {
    const [i, j, k] = [faces[f], faces[f + 1], faces[f + 2]];
    if (ahead[i] >= near && ahead[j] >= near && ahead[k] >= near) fill(i, j, k, bothSides);
    else if (ahead[i] >= near || ahead[j] >= near || ahead[k] >= near) fillCut([i, j, k], near, bothSides);
  }
}

// The corners of a mesh in the world.
function cornersOf({ corners }, X) {
  const placed = new Float64Array(corners.length);
  for (let i = 0; i < corners.length; i += 3)
    for (let r = 0; r < 3; r++)
      placed[i + r] = X[r] * corners[i] + X[3 + r] * corners[i + 1] + X[6 + r] * corners[i + 2] + X[9 + r];
  return placed;
}

// The light comes from above the reader's left shoulder.
function lightOf() {
  return unit(plus(plus(plus([0, 0, 0.5], lens.right, -0.45), lens.up, 0.55), lens.forward, -0.75));
}

// `corners` are those of the mesh in the world.
function paintMesh({ normals, faces }, corners, X, colour, owner) {
  Object.assign(brush, { ramp: rampOf(colour), owner });
  const light = lightOf();
  const [n, o, a] = [0, 3, 6].map((c) => dot(light, X.slice(c, c + 3)));
  for (let i = 0; 3 * i < corners.length; i++) {
    const bright = normals[3 * i] * n + normals[3 * i + 1] * o + normals[3 * i + 2] * a;
    shades[i] = (SHADES - 1) * Math.max(0, 0.38 + 0.55 * bright);
    place(i, corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
  }
  fillAll(faces, false);
}

// The shadow of a body on what lies at a height, as if the sun stood above it.
function paintShadow({ faces }, corners, height, owner) {
  let highest = -Infinity;
  for (let i = 2; i < corners.length; i += 3) highest = Math.max(highest, corners[i]);
  if (highest < height + 1e-5) return;
  Object.assign(brush, { ramp: null, owner });
  for (let i = 0; 3 * i < corners.length; i++) place(i, corners[3 * i], corners[3 * i + 1], height);
  fillAll(faces, true);
}
