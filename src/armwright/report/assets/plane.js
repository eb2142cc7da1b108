// The plane: the linkage where it is, with what play shifts magnified, beside where it would be without.

for (const key of ["points_m", "shifts_um", "path_m", "error_um", "gaps_um", "forces_N", "flies", "energy_J"])
  data[key] = expand(data[key]);

const canvas = byId("view");
const MICROMETRES = 1e6;
const MAGNIFICATIONS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const EDGE = 42;
// Below the picture, for the rulers.
const FOOT = 44;
let pen = null;
let magnified = data.magnification;

const pairOf = (row, i) => [row[2 * i], row[2 * i + 1]];

// The part of the plane that is ever touched, ground and all.
const bounds = (() => {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const hold = ([x, y]) => {
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  };
  data.ground_m.forEach(hold);
  for (const row of data.points_m) for (let i = 0; 2 * i < row.length; i++) hold(pairOf(row, i));
  data.path_m.forEach(hold);
  return box;
})();

// How metres become pixels on a canvas of that size: y points up, nothing is stretched.
function lensOf(width, height) {
  const [x0, y0, x1, y1] = bounds;
  const scale = Math.min((width - 2 * EDGE) / (x1 - x0 || 1), (height - 2 * EDGE) / (y1 - y0 || 1));
  const [cx, cy] = [(x0 + x1) / 2, (y0 + y1) / 2];
  return { scale, at: ([x, y]) => [width / 2 + (x - cx) * scale, height / 2 - (y - cy) * scale] };
}

// A point with its shift magnified; a place on the ground does not shift.
function shifted(rows, i) {
  if (Array.isArray(i)) return i;
  const [x, y] = pairOf(rows.points, i);
  const [dx, dy] = pairOf(rows.shifts, i);
  return [x + (magnified * dx) / MICROMETRES, y + (magnified * dy) / MICROMETRES];
}

function rowsAt(t) {
  const place = locate(data.t, t);
  return {
    place,
    points: blend(data.points_m, place),
    shifts: blend(data.shifts_um, place),
    path: blend(data.path_m, place),
    error: blend(data.error_um, place),
  };
}

function polyline(points, colour, width, { dash = [], alpha = 1, close = false } = {}) {
  pen.globalAlpha = alpha;
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.lineCap = pen.lineJoin = "round";
  pen.setLineDash(dash);
  pen.beginPath();
  for (const [x, y] of points) pen.lineTo(x, y);
  if (close) pen.closePath();
  pen.stroke();
  pen.setLineDash([]);
  pen.globalAlpha = 1;
}

function disc([x, y], radius, fill, edge = null, width = 1.5) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) {
    pen.fillStyle = fill;
    pen.fill();
  }
  if (!edge) return;
  pen.strokeStyle = edge;
  pen.lineWidth = width;
  pen.stroke();
}

function drawGround(lens, width) {
  for (const [x, y, direction] of data.rails) {
    const [cx, cy] = lens.at([x, y]);
    const [dx, dy] = [Math.cos(direction) * 2 * width, Math.sin(direction) * 2 * width];
    polyline([[cx - dx, cy + dy], [cx + dx, cy - dy]], colours.floor, 9);
    polyline([[cx - dx, cy + dy], [cx + dx, cy - dy]], colours.sky, 1);
  }
  for (const point of data.ground_m) {
    const [x, y] = lens.at(point);
    polyline([[x - 13, y + 15], [x, y], [x + 13, y + 15]], colours.quiet, 1.5, { close: true });
    for (let k = -2; k <= 2; k++) polyline([[x + 5 * k + 1, y + 15], [x + 5 * k - 4, y + 21]], colours.quiet, 1);
  }
}

function taken(i) {
  const [x, y] = data.path_m[i];
  const [dx, dy] = data.error_um[i];
  return [x + (magnified * dx) / MICROMETRES, y + (magnified * dy) / MICROMETRES];
}

function drawPath(lens, rows) {
  polyline(data.path_m.map(lens.at), colours.quiet, 1.2, { dash: [5, 4] });
  const places = data.t.map((_, i) => lens.at(taken(i)));
  polyline(places, colours.hues[0], 1, { alpha: 0.3 });
  polyline(places.slice(0, rows.place[0] + 1), colours.hues[0], 2);
}

// A link is a bar, a body of one point a block, one of many points their outline.
function drawBody(body, rows, lens, i) {
  const points = body.points.map((k) => lens.at(shifted(rows, k)));
  const colour = colours.arms[i % colours.arms.length];
  if (points.length === 1) {
    const [x, y] = points[0];
    const half = Math.max(0, ...data.pins.map((pin) => ringOf(pin, lens))) + 9;
    pen.fillStyle = colour;
    pen.globalAlpha = 0.8;
    pen.fillRect(x - 1.5 * half, y - half, 3 * half, 2 * half);
    pen.globalAlpha = 1;
    return;
  }
  polyline(points, colour, 9, { alpha: 0.8, close: points.length > 2 });
}

function drawGhost(rows, lens) {
  for (const body of data.bodies) {
    const points = body.points.map((k) => lens.at(pairOf(rows.points, k)));
    polyline(points, colours.quiet, 1, { alpha: 0.75, close: points.length > 2 });
  }
}

// How large the hole of a pin is drawn, its play magnified [pixels].
function ringOf(pin, lens) {
  return Math.max((magnified * pin.clearance_um * lens.scale) / MICROMETRES, 1) + 5;
}

function drawPins(rows, lens) {
  data.pins.forEach((pin, i) => {
    const [bearing, journal] = [pin.bearing, pin.journal].map((k) => lens.at(shifted(rows, k)));
    const ring = ringOf(pin, lens);
    pen.globalAlpha = 0.62;
    disc(bearing, ring, colours.card);
    pen.globalAlpha = 1;
    disc(bearing, ring, null, colours.ink, 1.6);
    disc(journal, 5, fliesAt(rows.place, i) ? colours.card : forceColour(forceAt(rows.place, i)), colours.ink, 1.4);
    pen.fillStyle = colours.ink;
    pen.font = "600 12px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.fillText(pin.name, bearing[0] + ring + 4, bearing[1] - 7);
  });
}

function drawView() {
  const [ink, width, height] = sharpen(canvas);
  if (!width) return;
  pen = ink;
  const [lens, rows] = [lensOf(width, height - FOOT), rowsAt(now.t)];
  drawGround(lens, width);
  drawGhost(rows, lens);
  data.bodies.forEach((body, i) => drawBody(body, rows, lens, i));
  for (const motor of data.motors) disc(lens.at(shifted(rows, motor)), 8, colours.card, colours.ink, 2);
  drawPath(lens, rows);
  drawPins(rows, lens);
  const tip = [0, 1].map((k) => rows.path[k] + (magnified * rows.error[k]) / MICROMETRES);
  disc(lens.at(rows.path), 3, colours.quiet);
  disc(lens.at(tip), 3.5, colours.hues[0], colours.card, 1);
  drawRuler(lens, height);
}

// Two rulers: of the linkage, and of what is magnified.
function drawRuler(lens, height) {
  pen.font = "11px system-ui, sans-serif";
  pen.textAlign = "left";
  const rulers = [
    [1, colours.quiet, "linkage"],
    [magnified, colours.hues[0], "play and error"],
  ];
  rulers.slice(magnified === 1 ? 1 : 0).forEach(([times, colour, what], i) => {
    const pixels = (lens.scale * times) / MILLIMETRES;
    const length = roundStep(90 / pixels, 1) / (roundStep(90 / pixels, 1) * pixels > 130 ? 2 : 1);
    const y = height - 30 + 18 * i;
    polyline([[14, y - 3], [14, y], [14 + length * pixels, y], [14 + length * pixels, y - 3]], colour, 1.5);
    pen.fillStyle = colour;
    pen.fillText(`${Number(length.toPrecision(3))} mm, ${what}`, 20 + length * pixels, y + 2);
  });
}

function startView() {
  const choice = byId("magnify");
  choice.append(
    ...MAGNIFICATIONS.map((times) =>
      make("option", { value: String(times), textContent: times === 1 ? "not" : `${times} ×` }),
    ),
  );
  choice.value = String(magnified);
  choice.addEventListener("change", () => {
    magnified = Number(choice.value);
    drawView();
  });
}
