// The page of a linkage with play: its clock, and what is said of the present instant.

// Parts of the real pace to choose from, and how long the whole is to take at first [s].
const PACES = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const WATCHED = 12;

function showClock() {
  slider.value = now.t;
  const digits = data.duration < 10 ? 1 : 0;
  byId("clock").textContent = `${number(now.t * 1000, digits)} / ${number(data.duration * 1000, digits)} ms`;
  slider.setAttribute("aria-valuetext", `${(now.t * 1000).toFixed(1)} of ${(data.duration * 1000).toFixed(1)} milliseconds`);
  const place = locate(data.t, now.t);
  const [x, y] = blend(data.error_um, place);
  const pins = data.pins.map(
    (pin, i) => `${pin.name} ${fliesAt(place, i) ? "flies" : forceText(forceAt(place, i))}`,
  );
  byId("now").replaceChildren(
    make("b", { textContent: `error ${number(Math.hypot(x, y) / 1000, 3)} mm` }),
    `  ${pins.join("  ·  ")}`,
  );
}

// As slow as it must be to last so long.
function slowEnough() {
  const slow = data.duration / WATCHED;
  return 1 / (PACES.find((pace) => 1 / pace <= slow) ?? PACES.at(-1));
}

// Above the slider: where a journal flies.
function fillStrip() {
  const strip = byId("strip");
  for (const [from, to] of spells((row) => row.some((flies) => flies > 0))) {
    const mark = make("i");
    mark.style.left = `${(100 * from) / (data.duration || 1)}%`;
    mark.style.width = `${(100 * (to - from)) / (data.duration || 1)}%`;
    mark.style.setProperty("--hue", "var(--warn)");
    strip.append(mark);
  }
}

function redraw() {
  readColours();
  readForceColours();
  drawView();
  drawBearings();
  drawCharts();
}

function start() {
  fillStrip();
  startView();
  startBearings();
  startCharts(chartsOf().map(clearanceChart));
  listeners.push(showClock, drawView, drawBearings);
  const step = data.duration / Math.max(1, data.t.length - 1);
  startClock({
    paces: PACES.map((pace) => [1 / pace, pace === 1 ? "1×" : `1/${pace}×`]),
    pace: slowEnough(),
    step,
    leap: 25 * step,
    redraw,
    watched: [canvas, byId("bearings"), byId("charts")],
  });
  seek(0);
}

// What a test, or a curious reader at the console, may ask.
window.armwright = {
  seek,
  state: () => {
    const place = locate(data.t, now.t);
    return {
      time: now.t,
      playing: now.playing,
      rate: now.rate,
      magnification: magnified,
      error: blend(data.error_um, place).map((value) => value * 1e-6),
      gaps: blend(data.gaps_um, place).map((value) => value * 1e-6),
      forces: data.pins.map((_, i) => forceAt(place, i)),
      flies: data.pins.map((_, i) => fliesAt(place, i)),
    };
  },
};

start();
