// Poses as twelve numbers, the columns n, o, a, p; where arms, their bodies and the parts are at an instant.

function compose(X, Y) {
  const Z = new Array(12);
  for (let c = 0; c < 12; c += 3)
    for (let r = 0; r < 3; r++)
      Z[c + r] = X[r] * Y[c] + X[3 + r] * Y[c + 1] + X[6 + r] * Y[c + 2] + (c === 9 ? X[9 + r] : 0);
  return Z;
}

function screw(angle, shift) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [c, s, 0, -s, c, 0, 0, 0, 1, 0, 0, shift];
}

// How a body is changed in the frame that carries it: fingers by the opening, a rod by the shift of the next joint.
function change({ frame, slide, stretches }, figure, q, place) {
  const X = screw(0, 0);
  if (slide) X[10] = (slide * gripOf(figure, place) * figure.opening) / 2;
  if (stretches) X[8] = figure.joints[frame].d + q[frame];
  return X;
}

// The frames 0 to n of an arm, and last its tool, in the world, at joint positions.
function framesAt(figure, q) {
  const frames = [figure.base];
  figure.joints.forEach((joint, i) => {
    const [turn, shift] = joint.revolute ? [q[i], 0] : [0, q[i]];
    frames.push(compose(compose(frames[i], screw(joint.theta + turn, joint.d + shift)), joint.behind));
  });
  frames.push(compose(frames.at(-1), figure.tool));
  return frames;
}

// The same at an instant, at measured or planned joint positions.
function framesOf(figure, place, positions = figure.q) {
  return framesAt(figure, blend(positions, place));
}

// Where the joints of an arm are: as they were set by hand, or as they were at the instant.
function positionsOf(name, figure, place) {
  return now.jog?.[name] ?? blend(figure.q, place);
}

function gripOf(figure, [i, j, s]) {
  return figure.grip[i] + s * (figure.grip[j] - figure.grip[i]);
}

// Where a part is in the world, or on the hand that holds it: at its last pose, or on the way to the next one.
function partPose({ times, poses, arms, changes_evenly }, last, t) {
  if (!changes_evenly || last + 1 === times.length || arms[last + 1] !== null) return poses[last];
  return blend(poses, [last, last + 1, Math.max(0, (t - times[last]) / (times[last + 1] - times[last]))]);
}

// All bodies at t: name, pose in the world, number of the shape, and what colours it.
function bodiesAt(t) {
  const { animation } = data;
  const place = locate(animation.t, t);
  const arms = Object.entries(animation.arms).map(([name, figure]) => {
    const q = positionsOf(name, figure, place);
    return [name, figure, framesAt(figure, q), q];
  });
  const tools = Object.fromEntries(arms.map(([name, _, frames]) => [name, frames.at(-1)]));
  const bodies = animation.fixtures.map(({ name, shape, pose }) => ({ name, shape, pose, tint: "fixture", whose: 0 }));
  animation.parts.forEach((part, whose) => {
    const last = Math.max(
      0,
      part.times.findLastIndex((time) => time <= t + HAIR),
    );
    const arm = part.arms[last];
    const pose = arm === null ? partPose(part, last, t) : compose(tools[arm], part.poses[last]);
    bodies.push({ name: part.name, shape: part.shape, pose, tint: "part", whose, arm });
  });
  arms.forEach(([_, figure, frames, q], whose) => {
    for (const body of figure.bodies) {
      const { name, shape, tint } = body;
      const pose = compose(compose(frames[body.frame], change(body, figure, q, place)), body.pose);
      bodies.push({ name, shape, pose, tint, whose });
    }
  });
  return { place, bodies, arms };
}
