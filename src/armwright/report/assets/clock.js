// The clock: play and pause, pace, the slider and the keys.

const slider = byId("time");
let clock = null;

function tick(time) {
  if (!now.playing) return;
  seek(now.t + ((time - (clock ?? time)) / 1000) * now.rate);
  clock = time;
  if (now.t >= data.duration) play(false);
  else requestAnimationFrame(tick);
}

function play(wanted) {
  if (wanted && now.t >= data.duration) seek(0);
  now.playing = wanted && data.duration > 0;
  clock = null;
  byId("play").classList.toggle("playing", now.playing);
  byId("play").ariaLabel = now.playing ? "Pause" : "Play";
  if (now.playing) requestAnimationFrame(tick);
}

// An arrow goes one step on or back, with Shift a leap.
function onKey(event, step, leap) {
  const target = event.target;
  if (
    event.ctrlKey ||
    event.altKey ||
    event.metaKey ||
    target.matches("select, input[type=range]:not(#time)") ||
    (event.key === " " && target.matches("button"))
  )
    return;
  const way = event.shiftKey ? leap : step;
  const actions = {
    " ": () => play(!now.playing),
    ArrowLeft: () => seek(now.t - way),
    ArrowRight: () => seek(now.t + way),
    Home: () => seek(0),
    End: () => seek(data.duration),
  };
  if (!actions[event.key]) return;
  event.preventDefault();
  actions[event.key]();
}

function fillPaces(paces, first) {
  byId("rate").append(...paces.map(([pace, textContent]) => make("option", { value: String(pace), textContent })));
  byId("rate").value = String(first);
  now.rate = first;
}

// `paces` are those to choose from, each with its text, `pace` is the first one. `redraw` is called when the scheme of colours changes, or the size of one of the elements that are watched.
function startClock({ paces, pace, step, leap, redraw, watched }) {
  fillPaces(paces, pace);
  slider.max = data.duration;
  slider.addEventListener("input", () => seek(slider.value));
  byId("play").addEventListener("click", () => play(!now.playing));
  byId("rate").addEventListener("change", (event) => {
    now.rate = Number(event.target.value);
  });
  document.addEventListener("keydown", (event) => onKey(event, step, leap));
  // Paper is white, whatever the screen is.
  for (const medium of ["(prefers-color-scheme: dark)", "print"]) matchMedia(medium).addEventListener("change", redraw);
  const watcher = new ResizeObserver(redraw);
  for (const element of watched) watcher.observe(element);
}
