// What is drawn over the view: the map of where the tool can be brought, and the ghost of where an arm would be.

const overlay = { map: null, values: null, ghost: null, hover: null };

function takeMap(map) {
  overlay.map = map;
  overlay.values = map && Uint8Array.from(atob(map.values), (c) => c.charCodeAt(0));
  byId("map-text").hidden = !map;
}

function mapColour(value, shades) {
  if (value === 1) return shades.warn;
  return mixed(shades.line, shades.good, (value - 2) / 253);
}

function paintMap() {
  const { map, values } = overlay;
  if (!map) return;
  const style = getComputedStyle(document.documentElement);
  const shades = Object.fromEntries(["warn", "line", "good"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  const cells = map.side - 1;
  const at = (i, j) => project(plus(plus(map.corner, map.u, i / cells), map.v, j / cells));
  pen.globalAlpha = 0.45;
  const points = Array.from({ length: map.side + 1 }, (_, j) => Array.from({ length: map.side + 1 }, (__, i) => at(i - 0.5, j - 0.5)));
  for (let j = 0; j < map.side; j++)
    for (let i = 0; i < map.side; i++) {
      const value = values[j * map.side + i];
      if (value === 0) continue; // out of reach
      const corners = [points[j][i], points[j][i + 1], points[j + 1][i + 1], points[j + 1][i]];
      if (corners.some(({ depth }) => depth < 0.03 * camera.distance)) continue;
      pen.fillStyle = mapColour(value, shades);
      pen.beginPath();
      corners.forEach(({ x, y }, k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      pen.fill();
    }
  pen.globalAlpha = 1;
}

// An arm as lines through its frames, dashed: it is not there.
function paintGhost() {
  const ghost = overlay.hover ?? overlay.ghost;
  if (!ghost) return;
  const figure = data.animation.arms[ghost.arm];
  const frames = framesOf({ ...figure, q: [ghost.q] }, [0, 0, 0]);
  const points = frames.flatMap((X, i) => {
    if (i === 0 || i === frames.length - 1) return [X.slice(9)];
    // Along the axis first, then across: offsets of joints are seen.
    const before = frames[i - 1];
    const along = dot(plus(X.slice(9), before.slice(9), -1), before.slice(6, 9));
    return [plus(before.slice(9), before.slice(6, 9), along), X.slice(9)];
  });
  const places = points.map(project);
  pen.setLineDash([7, 5]);
  pen.lineJoin = "round";
  strokeLines([places], colours.accent, 3, 0.9);
  pen.setLineDash([]);
  const tip = places.at(-1);
  pen.beginPath();
  pen.arc(tip.x, tip.y, 6, 0, 2 * Math.PI);
  pen.strokeStyle = colours.accent;
  pen.lineWidth = 2;
  pen.stroke();
}

// While a control is pointed at or has the focus, `begin` is called, then `end`.
function whilePointedAt(element, begin, end) {
  for (const event of ["pointerenter", "focusin"]) element.addEventListener(event, begin);
  for (const event of ["pointerleave", "focusout"]) element.addEventListener(event, end);
}

function startOverlays() {
  byId("map").addEventListener("change", (event) => send({ do: "map", arm: chosenArm().name, plane: event.target.value }));
  followers.push((state) => {
    if (!state) return;
    if (state.map !== undefined) takeMap(state.map);
    overlay.ghost = state.ghost;
  });
}
