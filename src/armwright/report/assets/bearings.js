// The bearings: every journal in its hole, the gap so large that one sees it.

// The journal's radius as part of the wall's; the rest is left for the gap. Around the wall is room for ring and arrow
// [pixels], on a drawing of this size; on smaller ones less.
const JOURNAL = 0.45;
const [ROOM, RING, SIZE] = [34, 9, 260];
const most = Math.max(2, ...data.pins.map((pin) => pin.peak_N));
const bearings = [];

const fliesAt = ([i, j, s], pin) => data.flies[s < 0.5 ? i : j][pin] > 0;
const forceAt = ([i, j, s], pin) => data.forces_N[s < 0.5 ? i : j][pin];
// 0 for 1 N and less, 1 for the largest force of the run.
const strength = (force) => Math.min(1, Math.max(0, Math.log(force) / Math.log(most)));

function mixed(one, other, part) {
  const parse = (colour) => [1, 3, 5].map((k) => Number.parseInt(colour.slice(k, k + 2), 16));
  const [a, b] = [parse(one), parse(other)];
  return `rgb(${a.map((value, k) => Math.round(value + part * (b[k] - value))).join(",")})`;
}

function forceColour(force) {
  const part = strength(force) * (colours.forces.length - 1);
  const k = Math.min(Math.floor(part), colours.forces.length - 2);
  return mixed(colours.forces[k], colours.forces[k + 1], part - k);
}

function readForceColours() {
  const style = getComputedStyle(document.documentElement);
  colours.forces = [0, 1, 2, 3].map((k) => style.getPropertyValue(`--f${k}`).trim());
}

function hole(size) {
  const part = Math.min(1, size / SIZE);
  const wall = size / 2 - ROOM * part;
  const journal = JOURNAL * wall;
  return { part, wall, journal, room: wall - journal, middle: [size / 2, size / 2] };
}

function drawWay(pin, i, { room, middle }, last) {
  const at = (row) => [
    middle[0] + (room * row[2 * i]) / pin.reach_um,
    middle[1] - (room * row[2 * i + 1]) / pin.reach_um,
  ];
  const places = data.gaps_um.map(at);
  polyline(places, colours.quiet, 0.8, { alpha: 0.35 });
  polyline(places.slice(0, last + 1), colours.hues[i % HUES], 1.5);
}

// The worn wall as it stands now; there are fewer outlines than rows.
function drawOutline(pin, { room, middle }, [i, , s]) {
  const last = pin.outlines_um.length - 1;
  const at = Math.min(last, ((i + s) / Math.max(1, data.t.length - 1)) * last);
  const low = Math.floor(at);
  const flat = blend(pin.outlines_um, [low, Math.min(low + 1, last), at - low]);
  const points = [];
  for (let k = 0; k < flat.length; k += 2) {
    points.push([middle[0] + (room * flat[k]) / pin.reach_um, middle[1] - (room * flat[k + 1]) / pin.reach_um]);
  }
  polyline(points, colours.ink, 1.2, { close: true });
}

function drawArrow([x, y], [dx, dy], length, colour, part) {
  const tip = [x + dx * length, y + dy * length];
  polyline([[x, y], tip], colour, 3 * part);
  const [back, aside, fore] = [7 * part, 4.5 * part, 3 * part];
  const head = [-1, 1].map((side) => [
    tip[0] - back * dx + aside * side * dy,
    tip[1] - back * dy - aside * side * dx,
  ]);
  pen.fillStyle = colour;
  pen.beginPath();
  for (const [px, py] of [[tip[0] + fore * dx, tip[1] + fore * dy], ...head]) pen.lineTo(px, py);
  pen.fill();
}

function drawBearing({ pin, view }, i, place) {
  const [ink, size] = sharpen(view);
  if (!size) return;
  pen = ink;
  const shape = hole(size);
  const { part, wall, journal, room, middle } = shape;
  const gap = blend(data.gaps_um, place).slice(2 * i, 2 * i + 2);
  const [force, flies] = [forceAt(place, i), fliesAt(place, i)];
  disc(middle, wall + RING * part, colours.metal);
  disc(middle, wall, colours.sky, colours.ink, 1.5);
  const centre = [middle[0] + (room * gap[0]) / pin.reach_um, middle[1] - (room * gap[1]) / pin.reach_um];
  pen.globalAlpha = 0.4;
  disc(centre, journal, flies ? null : forceColour(force));
  pen.globalAlpha = 1;
  disc(centre, journal, null, flies ? colours.quiet : forceColour(force), 1.8);
  pen.setLineDash([3, 3]);
  disc(middle, (room * pin.clearance_um) / pin.reach_um, null, colours.quiet, 1);
  pen.setLineDash([]);
  if (pin.outlines_um.length) drawOutline(pin, shape, place);
  drawWay(pin, i, shape, place[0]);
  disc(centre, 3.5, colours.ink);
  const distance = Math.hypot(...gap);
  if (!flies && force > 0 && distance > 0) {
    const way = [gap[0] / distance, -gap[1] / distance];
    const foot = [middle[0] + wall * way[0], middle[1] + wall * way[1]];
    drawArrow(foot, way, (5 + 19 * strength(force)) * part, forceColour(force), part);
  }
}

function forceText(force) {
  return force >= 1000 ? `${number(force / 1000, 2)} kN` : `${number(force, force < 10 ? 2 : 1)} N`;
}

function drawBearings() {
  const place = locate(data.t, now.t);
  bearings.forEach((bearing, i) => {
    drawBearing(bearing, i, place);
    const flies = fliesAt(place, i);
    bearing.said.textContent = flies ? "flies" : forceText(forceAt(place, i));
    bearing.said.classList.toggle("flies", flies);
  });
}

function startBearings() {
  readForceColours();
  byId("most").textContent = forceText(most);
  byId("bearings").style.setProperty("--count", data.pins.length);
  for (const pin of data.pins) {
    const view = make("canvas");
    view.setAttribute("role", "img");
    view.setAttribute("aria-label", `Journal ${pin.name} in its bearing`);
    const said = make("span", { className: "now" });
    const play = make("span", { className: "quiet", textContent: `play ${number(pin.clearance_um, 0)} µm` });
    const peak = make("span", { className: "quiet", textContent: `largest force ${pin.peak_N === null ? "∞" : forceText(pin.peak_N)}` });
    bearings.push({ pin, view, said });
    byId("bearings").append(
      make(
        "figure",
        { className: "bearing" },
        view,
        make("figcaption", {}, make("b", { textContent: pin.name }), said, play, peak),
      ),
    );
  }
}
