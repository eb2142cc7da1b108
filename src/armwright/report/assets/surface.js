// Triangles with a depth at every pixel: what is nearer hides what is farther. Pixels are finer than those of the screen,
// so that edges come out smooth.

// Pixels at most, and per pixel of the page along either side.
const MOST_PIXELS = 1.6e6;
const FINEST = 2;
const SHADES = 256;
const surface = { canvas: document.createElement("canvas"), wide: 0, high: 0, ratio: 1 };

function clearSurface(width, height) {
  const ratio = Math.min(FINEST * (window.devicePixelRatio || 1), Math.sqrt(MOST_PIXELS / (width * height)));
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
  surface.pixels.fill(0);
  surface.depth.fill(0);
  surface.owner.fill(FLOOR);
}

function showSurface(width, height) {
  surface.canvas.getContext("2d").putImageData(surface.image, 0, 0);
  pen.imageSmoothingEnabled = true;
  pen.imageSmoothingQuality = "high";
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
  for (let i = from; i < to; i++, depth += depthStep, shade += shadeStep) {
    if (ramp) {
      if (depth <= depths[i]) continue;
      depths[i] = depth;
      owners[i] = owner;
      pixels[i] = ramp[shade < 0 ? 0 : shade > SHADES - 1 ? SHADES - 1 : shade | 0];
    } else if (owners[i] === owner) {
      if (owner === FLOOR) pixels[i] = SHADOW;
      else {
        if (Math.abs(depth - depths[i]) > 1e-3 * depth) continue;
        pixels[i] = (0xff000000 | (((pixels[i] >>> 1) & 0x7f7f7f) + ((pixels[i] >>> 2) & 0x3f3f3f))) >>> 0;
      }
      owners[i] = 0;
    }
  }
}

// Corners a, b, c: x and y in pixels, 1 / depth, shade. Towards the eye they go round as a clock's hand does not.
function fill(a, b, c, bothSides) {
  const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
  if (!(bothSides ? area : area < 0)) return;
  const slope = (k) => [
    ((b[k] - a[k]) * (c[1] - a[1]) - (c[k] - a[k]) * (b[1] - a[1])) / area,
    ((c[k] - a[k]) * (b[0] - a[0]) - (b[k] - a[k]) * (c[0] - a[0])) / area,
  ];
  const [[dx, dy], [sx, sy]] = [slope(2), slope(3)];
  const top = Math.max(0, Math.ceil(Math.min(a[1], b[1], c[1]) - 0.5));
  const bottom = Math.min(surface.high, Math.ceil(Math.max(a[1], b[1], c[1]) - 0.5));
  for (let y = top; y < bottom; y++) {
    let [left, right] = [Infinity, -Infinity];
    const cut = (p, q) => {
      if (p[1] === q[1] || (p[1] - y - 0.5) * (q[1] - y - 0.5) > 0) return;
      const x = p[0] + ((y + 0.5 - p[1]) / (q[1] - p[1])) * (q[0] - p[0]);
      if (x < left) left = x;
      if (x > right) right = x;
    };
    cut(a, b);
    cut(b, c);
    cut(c, a);
    const from = Math.max(0, Math.ceil(left - 0.5));
    const to = Math.min(surface.wide, Math.ceil(right - 0.5));
    if (from >= to) continue;
    const [ox, oy] = [from + 0.5 - a[0], y + 0.5 - a[1]];
    const row = y * surface.wide;
    paintRow(row + from, row + to, a[2] + dx * ox + dy * oy, dx, a[3] + sx * ox + sy * oy, sx);
  }
}

// Corners in the axes of the camera; what is nearer than `near` is cut off.
function clip(corners, near) {
  const kept = [];
  corners.forEach((p, i) => {
    const q = corners[(i + 1) % corners.length];
    if (p[2] >= near) kept.push(p);
    if (p[2] >= near !== q[2] >= near) {
      const s = (near - p[2]) / (q[2] - p[2]);
      kept.push(p.map((v, k) => v + s * (q[k] - v)));
    }
  });
  return kept;
}

function toPixel([x, y, depth, shade]) {
  const scale = (lens.focal / depth) * surface.ratio;
  return [lens.x * surface.ratio + scale * x, lens.y * surface.ratio - scale * y, 1 / depth, shade];
}

// `seen` are corners in the axes of the camera, each with its shade.
function paintTriangles(faces, seen, bothSides) {
  const near = 0.02 * camera.distance;
  const shown = seen.map((p) => (p[2] >= near ? toPixel(p) : null));
  for (let f = 0; f < faces.length; f += 3) {
    const [i, j, k] = [faces[f], faces[f + 1], faces[f + 2]];
    if (shown[i] && shown[j] && shown[k]) fill(shown[i], shown[j], shown[k], bothSides);
    else if (shown[i] || shown[j] || shown[k]) {
      const rest = clip([seen[i], seen[j], seen[k]], near).map(toPixel);
      for (let n = 2; n < rest.length; n++) fill(rest[0], rest[n - 1], rest[n], bothSides);
    }
  }
}

function inCamera(p, shade) {
  const d = plus(p, lens.eye, -1);
  return [dot(d, lens.right), dot(d, lens.up), dot(d, lens.forward), shade];
}

const turned = (X, x, y, z) => [0, 1, 2].map((r) => X[r] * x + X[3 + r] * y + X[6 + r] * z);
const cornersOf = (mesh, X) =>
  Array.from({ length: mesh.corners.length / 3 }, (_, i) =>
    plus(turned(X, mesh.corners[3 * i], mesh.corners[3 * i + 1], mesh.corners[3 * i + 2]), X.slice(9)),
  );

// The light comes from above the reader's left shoulder.
function paintMesh(mesh, X, colour, owner) {
  Object.assign(brush, { ramp: rampOf(colour), owner });
  const light = unit(plus(plus(plus([0, 0, 0.5], lens.right, -0.45), lens.up, 0.55), lens.forward, -0.75));
  const own = [0, 3, 6].map((c) => dot(light, X.slice(c, c + 3)));
  const { normals } = mesh;
  const seen = cornersOf(mesh, X).map((p, i) => {
    const bright = normals[3 * i] * own[0] + normals[3 * i + 1] * own[1] + normals[3 * i + 2] * own[2];
    return inCamera(p, (SHADES - 1) * Math.max(0, 0.38 + 0.55 * bright));
  });
  paintTriangles(mesh.faces, seen, false);
}

// The shadow of a body on what lies at a height, as if the sun stood above it.
function paintShadow(mesh, X, height, owner) {
  Object.assign(brush, { ramp: null, owner });
  const corners = cornersOf(mesh, X);
  if (corners.every((p) => p[2] < height + 1e-5)) return;
  paintTriangles(
    mesh.faces,
    corners.map((p) => inCamera([p[0], p[1], height], 0)),
    true,
  );
}
