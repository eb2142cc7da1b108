// The handles at the tool: arrows that shift it, rings that turn it.

const HANDLE = 92; // length of the arrows [px]
const RING = 66; // radius of the rings [px]
const GRASP = 11; // how near a pointer must be [px]
const RING_POINTS = 64;
const gizmo = { hover: null, drag: null, target: null };
const AXIS_NAMES = ["x", "y", "z"];

const columns = (X) => [X.slice(0, 3), X.slice(3, 6), X.slice(6, 9)];
const toolPose = () => live.state?.arms[chosenArm().name]?.tool ?? null;

// The axes of the handles in the world.
function gizmoAxes(X) {
  const frame = byId("jog-frame").value;
  if (frame === "TOOL" || frame === "") return columns(X);
  if (frame === "WORLD") return [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  if (frame === "BASE") return columns(data.animation.arms[chosenArm().name].base);
  const pose = live.state.around.frames[frame];
  return pose ? columns(pose) : columns(X);
}

function handles() {
  const X = toolPose();
  if (!X || !lens) return [];
  const p = X.slice(9);
  const scale = project(p).scale;
  const axes = gizmoAxes(X);
  return axes.flatMap((axis, k) => {
    const [u, v] = [axes[(k + 1) % 3], axes[(k + 2) % 3]];
    const ring = Array.from({ length: RING_POINTS + 1 }, (_, i) => {
      const angle = (2 * Math.PI * i) / RING_POINTS;
      return plus(plus(p, u, (Math.cos(angle) * RING) / scale), v, (Math.sin(angle) * RING) / scale);
    });
    return [
      { kind: "move", k, axis, points: [p, plus(p, axis, HANDLE / scale)] },
      { kind: "turn", k, axis, points: ring },
    ];
  });
}

function distanceToPiece(x, y, a, b) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const s = Math.min(1, Math.max(0, ((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - a.x - s * dx, y - a.y - s * dy);
}

function handleAt(x, y) {
  let [found, least] = [null, GRASP];
  for (const handle of handles()) {
    const points = handle.points.map(project);
    // An arrow begins outside the middle, where all of them meet.
    const first = handle.kind === "move" ? { ...points[0], x: points[0].x + 0.25 * (points[1].x - points[0].x), y: points[0].y + 0.25 * (points[1].y - points[0].y) } : points[0];
    const pieces = [first, ...points.slice(1)];
    for (let i = 0; i + 1 < pieces.length; i++) {
      const distance = distanceToPiece(x, y, pieces[i], pieces[i + 1]) - (handle.kind === "move" ? 2 : 0);
      if (distance < least) [found, least] = [handle, distance];
    }
  }
  return found;
}

// The ray from the eye through a place on the screen.
function rayAt(x, y) {
  const [u, v] = [(x - lens.x) / lens.focal, (lens.y - y) / lens.focal];
  return unit(plus(plus(lens.forward, lens.right, u), lens.up, v));
}

// How far along an axis through p the point nearest to a ray is.
function alongAxis(p, axis, x, y) {
  const d = rayAt(x, y);
  const w = plus(p, lens.eye, -1);
  const b = dot(axis, d);
  const fall = 1 - b * b;
  if (fall < 1e-4) return null;
  return (b * dot(d, w) - dot(axis, w)) / fall;
}

// The angle about an axis through p at which a ray meets its plane.
function aboutAxis(p, axes, k, x, y) {
  const d = rayAt(x, y);
  const along = dot(d, axes[k]);
  if (Math.abs(along) < 0.05) return null;
  const q = plus(plus(lens.eye, d, dot(plus(p, lens.eye, -1), axes[k]) / along), p, -1);
  return Math.atan2(dot(q, axes[(k + 2) % 3]), dot(q, axes[(k + 1) % 3]));
}

function turned(X, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const spin = (v) => {
    const par = dot(v, axis) * (1 - c);
    const w = cross(axis, v);
    return v.map((value, i) => c * value + s * w[i] + par * axis[i]);
  };
  return [...columns(X).flatMap(spin), ...X.slice(9)];
}

function startDrag(handle, x, y) {
  const X = toolPose();
  const axes = gizmoAxes(X);
  const p = X.slice(9);
  const from = handle.kind === "move" ? alongAxis(p, handle.axis, x, y) : aboutAxis(p, axes, handle.k, x, y);
  gizmo.drag = { handle, X, axes, p, from };
}

function drag(x, y) {
  const { handle, X, axes, p, from } = gizmo.drag;
  const to = handle.kind === "move" ? alongAxis(p, handle.axis, x, y) : aboutAxis(p, axes, handle.k, x, y);
  if (to === null || from === null) return;
  gizmo.target =
    handle.kind === "move" ? [...X.slice(0, 9), ...plus(p, handle.axis, to - from)] : turned(X, handle.axis, to - from);
  send({ do: "tool", arm: chosenArm().name, pose: gizmo.target }, "tool");
}

// A program that runs moves the arms by itself.
const canMove = () => mine() && (!live.state.run || live.state.run.ended);

function paintGizmo() {
  const X = toolPose();
  if (!X || !canMove()) return;
  const shades = [colours.red, colours.green, colours.blue];
  pen.lineCap = "round";
  for (const handle of handles()) {
    const lit = [gizmo.hover, gizmo.drag?.handle].some((one) => one && one.kind === handle.kind && one.k === handle.k);
    const points = handle.points.map(project);
    const width = handle.kind === "move" ? (lit ? 6 : 3.5) : lit ? 4.5 : 2;
    strokeLines([points], shades[handle.k], width, lit ? 1 : 0.75);
    if (handle.kind === "move") {
      const tip = points[1];
      pen.beginPath();
      pen.arc(tip.x, tip.y, lit ? 8 : 6, 0, 2 * Math.PI);
      pen.fillStyle = shades[handle.k];
      pen.fill();
      pen.fillStyle = colours.card;
      pen.font = "bold 9px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.fillText(AXIS_NAMES[handle.k], tip.x, tip.y + 3);
      pen.textAlign = "start";
    }
  }
  if (gizmo.drag && gizmo.target && live.state.refusal) {
    const at = project(gizmo.target.slice(9));
    pen.strokeStyle = colours.bad;
    pen.lineWidth = 2;
    pen.setLineDash([4, 4]);
    pen.beginPath();
    pen.arc(at.x, at.y, 12, 0, 2 * Math.PI);
    pen.stroke();
    pen.setLineDash([]);
  }
}

function startGizmo() {
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  // Before the view takes the pointer to turn itself.
  canvas.addEventListener(
    "pointerdown",
    (event) => {
      if (!canMove() || event.button !== 0) return;
      const handle = handleAt(...place(event));
      if (!handle) return;
      event.stopImmediatePropagation();
      canvas.setPointerCapture(event.pointerId);
      startDrag(handle, ...place(event));
      drawSoon();
    },
    true,
  );
  canvas.addEventListener(
    "pointermove",
    (event) => {
      if (gizmo.drag) {
        event.stopImmediatePropagation();
        drag(...place(event));
        drawSoon();
        return;
      }
      if (event.buttons) return;
      const hover = canMove() ? handleAt(...place(event)) : null;
      if (hover?.kind !== gizmo.hover?.kind || hover?.k !== gizmo.hover?.k) {
        gizmo.hover = hover;
        canvas.style.cursor = hover ? "pointer" : "";
        drawSoon();
      }
    },
    true,
  );
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(
      end,
      (event) => {
        if (!gizmo.drag) return;
        event.stopImmediatePropagation();
        Object.assign(gizmo, { drag: null, target: null });
        drawSoon();
      },
      true,
    );
}
