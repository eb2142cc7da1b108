// Stages of motion: the table, and a track of each arm below the clock.

// The share of a limit that each joint of an arm reaches at its peak, null without a limit; and the largest.
function peakShares(arm, peaks, quantity) {
  const shares = (peaks ?? []).map((peak, j) =>
    arm.joints[j][quantity.limit] === null || peak === null ? null : peak / arm.joints[j][quantity.limit],
  );
  return { shares, worst: Math.max(-1, ...shares.map((part) => part ?? -1)) };
}

// The largest share of a limit over the joints: bar, percentage, and the rest on hovering.
function peakCell(stages, key, quantity) {
  const arm = data.arms.find((one) => one.name === stages[0].arm);
  const found = stages.map((stage) => ({ peaks: stage[key], ...peakShares(arm, stage[key], quantity) }));
  const { peaks, shares, worst } = found.reduce((most, one) => (one.worst > most.worst ? one : most));
  if (worst < 0) return cell("–", quantity.title, "quiet");
  const fill = make("i");
  fill.style.width = `${Math.min(100, 100 * worst)}%`;
  const each = shares.map(
    (part, j) =>
      `${arm.joints[j].name}: ${part === null ? "no limit" : `${number(100 * part, 1)} %`} (${quantityText(quantity, arm.joints[j], peaks[j])})`,
  );
  const it = cell("", quantity.title, worst > 1 + HAIR ? "over" : "");
  it.title = each.join("\n");
  it.append(make("span", { className: "bar" }, fill), `${number(100 * worst, 0)} %`);
  return it;
}

// A cell of the table; on a phone its name stands in it.
function cell(textContent, name, className = "") {
  const it = make("td", { textContent, className });
  it.dataset.name = name.toLowerCase();
  return it;
}

// How near other bodies came: the distance, both names, and when; a click goes there.
function clearanceCell(stages) {
  const known = stages.map((stage) => stage.clearance).filter(Boolean);
  if (!known.length) return cell("–", "distance", "quiet");
  const measured = known.filter(({ distance }) => distance !== null);
  if (!measured.length) {
    const bound = Math.min(...known.map((one) => one.bound));
    return cell(`above ${number(bound * MILLIMETRES, 0)} mm`, "distance");
  }
  const { distance, bodies, t } = measured.reduce((least, one) => (one.distance < least.distance ? one : least));
  const link = make("button", { type: "button", textContent: `${number(distance * MILLIMETRES, 1)} mm` });
  link.addEventListener("click", (event) => {
    event.stopPropagation();
    seek(t);
  });
  const it = cell("", "distance", distance < data.clearance || distance <= 0 ? "over near" : "near");
  it.append(link, make("span", { className: "quiet", textContent: `${bodies.join(" – ")}, ${number(t, 2)}\u00a0s` }));
  return it;
}

function badgesCell(stages) {
  // Of what differs only in its factor the largest counts.
  const badges = new Map();
  for (const badge of stages.flatMap((stage) => stage.badges))
    if (!badges.has(badge.text) || badge.factor > badges.get(badge.text).factor) badges.set(badge.text, badge);
  const it = cell("", "", "badges");
  it.append(
    ...[...badges.values()].map(({ text, factor, title, mark }) => {
      const textContent = factor === null ? text : `${text} ×${number(factor, 2)}`;
      return make("span", { className: `badge ${mark || "plain"}`, textContent, title });
    }),
  );
  return it;
}

// The goals of all stages of a row, or the first and the last.
function goalCell(stages) {
  const goals = [...new Set(stages.map(({ to }) => to.join(", ")))];
  const it = cell(goals.length > 2 ? `${goals[0]} … ${goals.at(-1)}` : goals.join(", "), "", "head goal");
  it.title = goals.join("\n");
  return it;
}

// A number of all stages of a row, or the least and the largest where they differ.
function rangeText(stages, valueOf, textOf) {
  const values = stages.map(valueOf).filter((value) => value !== null);
  if (!values.length) return "–";
  const ends = [textOf(Math.min(...values)), textOf(Math.max(...values))];
  return ends[0] === ends[1] ? ends[0] : ends.join(" – ");
}

const millimetresText = (value) => number(value * MILLIMETRES, value * MILLIMETRES < 10 ? 2 : 1);

function chooseStage(i) {
  const stage = data.stages[i];
  if (chosenArm().name !== stage.arm) chooseArm(data.arms.findIndex((arm) => arm.name === stage.arm));
  const margin = 0.15 * (stage.t1 - stage.t0);
  zoomTime([Math.max(0, stage.t0 - margin), Math.min(data.duration, stage.t1 + margin)]);
  seek(stage.t0);
}

// A row of one stage, or of all passes of a loop through it; `more` unfolds the passes.
function stageRow(numbers, more = null) {
  const stages = numbers.map((i) => data.stages[i]);
  const [i, stage] = [numbers[0], stages[0]];
  const swatch = make("span", { className: "swatch" });
  swatch.style.setProperty("--hue", `var(${hue(i)})`);
  const button = make("button", { type: "button" }, swatch, `${i + 1} ${stage.kind}`);
  const numeric = (name, text, className = "") => cell(text, name, `number ${className}`.trim());
  const first = cell("", "", "head");
  first.append(button, ...(more ? [more] : []));
  const lasts = (one) => one.t1 - one.t0;
  const row = make(
    "tr",
    {},
    first,
    goalCell(stages),
    cell(stage.arm, "", "arm"),
    numeric("line", stage.line, "extra"),
    numeric("start", number(stage.t0, 2), "extra"),
    numeric("", rangeText(stages, lasts, (t) => number(t, 2)), "head lasts"),
    numeric("path", rangeText(stages, (one) => one.hand_length, millimetresText), "extra"),
    numeric("off line", rangeText(stages, (one) => one.deviation, millimetresText), stage.deviation === null ? "extra" : ""),
    peakCell(stages, "peak_speed", QUANTITIES[1]),
    peakCell(stages, "peak_effort", QUANTITIES[3]),
    ...(hasClearances ? [clearanceCell(stages)] : []),
    badgesCell(stages),
  );
  row.dataset.stages = numbers.join(" ");
  row.addEventListener("click", () => chooseStage(i));
  return row;
}

// Which stage of its MOVE a stage is; its goals where the MOVE is not on the page.
function placeInMove({ arm, line, t0, to }, i) {
  const during = (effect) => effect.t0 <= t0 + HAIR && t0 + HAIR < effect.t1;
  const move = data.effects.find((effect) => effect.arm === arm && effect.line === line && during(effect));
  if (!move) return to;
  return data.stages.slice(0, i).filter((one) => one.arm === arm && one.t0 >= move.t0 - HAIR).length;
}

// The same stage of the same MOVE, run again and again.
function passes() {
  const groups = new Map();
  data.stages.forEach((stage, i) => {
    const key = JSON.stringify([stage.arm, stage.line, stage.kind, placeInMove(stage, i)]);
    groups.set(key, [...(groups.get(key) ?? []), i]);
  });
  return [...groups.values()];
}

function stageRows(numbers) {
  if (numbers.length === 1) return [stageRow(numbers)];
  const each = numbers.map((i) => stageRow([i]));
  for (const row of each) Object.assign(row, { hidden: true, className: "pass" });
  const more = make("button", {
    type: "button",
    className: "times",
    textContent: `×${numbers.length}`,
    title: "Show every pass",
    ariaExpanded: "false",
  });
  more.addEventListener("click", (event) => {
    event.stopPropagation();
    const open = more.ariaExpanded !== "true";
    more.ariaExpanded = String(open);
    for (const row of each) row.hidden = !open;
  });
  return [stageRow(numbers, more), ...each];
}

const hasClearances = data.stages.some((stage) => stage.clearance);

// A mark of a track, from one time to another.
function trackMark(tag, { t0, t1 }) {
  const mark = make(tag);
  mark.style.left = `${(100 * t0) / data.duration}%`;
  mark.style.width = `${(100 * (t1 - t0)) / data.duration}%`;
  return mark;
}

function limitText({ joint, limit, share: part, t0, t1 }, arm) {
  return `${arm.joints[joint].name}: ${number(100 * part, 0)} % of its ${limit}, ${number(t0, 2)} to ${number(t1, 2)} s`;
}

// What an arm does: its stages, and above them in red when one of its joints is at a limit.
function trackOf(arm, i) {
  const name = make("button", { type: "button", textContent: arm.name, title: `Show the joints of ${arm.name}` });
  name.style.setProperty("--hue", `var(--arm${i % colours.arms.length})`);
  name.addEventListener("click", () => chooseArm(i));
  const track = make("div", { className: "track" });
  data.stages.forEach((stage, k) => {
    if (stage.arm !== arm.name) return;
    const mark = trackMark("i", stage);
    mark.style.setProperty("--hue", `var(${hue(k)})`);
    mark.title = `${stage.kind} to ${stage.to.join(", ")}`;
    track.append(mark);
  });
  track.append(...arm.at_limits.map((span) => Object.assign(trackMark("b", span), { title: limitText(span, arm) })));
  return make("div", { className: "track-row" }, name, track);
}

function fillStages() {
  byId("clearance-head").hidden = !hasClearances;
  byId("stages-card").hidden = !data.stages.length;
  byId("stages").append(...passes().flatMap(stageRows));
  byId("stages-card").classList.toggle("one-arm", data.arms.length === 1);
  if (!(data.duration > 0)) return;
  byId("strip").classList.add("tracks");
  byId("strip").append(...data.arms.map(trackOf));
  const longest = Math.max(...data.arms.map((arm) => arm.name.length));
  byId("strip").parentElement.style.setProperty("--names", `min(30%, ${longest + 5}ch)`);
}

function showStages() {
  const present = new Set(data.arms.map((arm) => String(stageAt(arm.name, now.t))));
  for (const row of byId("stages").children)
    row.classList.toggle("now", row.dataset.stages.split(" ").some((i) => present.has(i)));
}
