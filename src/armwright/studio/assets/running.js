// Running: the buttons of a run, its time, its trace.

function runMessage(extra = {}) {
  if (editor.timer) sendText();
  return { do: "run", physics: byId("physics").checked, rate: Number(byId("pace").value), ...extra };
}

function startRun() {
  send(live.state.run && !live.state.run.ended ? { do: "go", step: "continue" } : runMessage());
}

function goOn(way) {
  const process = byId("process").hidden || way === "back" ? "" : byId("process").value;
  send(live.state.run ? { do: "go", step: way, process } : runMessage({ entry: true }));
}

function showRun(state) {
  const { run, program } = state;
  const off = !mine();
  const under = run && !run.ended;
  byId("run").textContent = under ? "Go on" : "Run";
  byId("run").disabled = off || (under ? run.playing : !program.runs);
  byId("pause").disabled = off || !run?.playing;
  byId("step").disabled = off || Boolean(run?.ended) || (!run && !program.runs);
  byId("back").disabled = off || !run;
  byId("stop").disabled = off || !run;
  byId("physics").disabled = off || Boolean(under);
  for (const id of ["run-here", "run-line"]) byId(id).disabled = off || Boolean(under) || !program.runs;
  byId("reset").disabled = off || Boolean(under);
  for (const button of document.querySelectorAll("[data-keep]")) button.disabled = off || !run;
  const texts = { end: "ended", failed: "failed", breakpoint: "stands at a breakpoint", entry: "stands at its beginning", step: "stands", start: "stands at its beginning", exception: "stands at an error", pause: "stands" };
  const what = run && (run.playing ? "runs" : (texts[run.reason] ?? "stands"));
  byId("run-time").textContent = run ? `${number(run.time, 2)} s` : "";
  const within = run && !run.playing && !run.ended ? run.lines.find(({ place }) => / of /.test(place)) : null;
  const said = run ? `${what}${within ? ` in line ${within.place}` : ""}${run.text ? `: ${run.text}` : ""}` : "";
  if (byId("run-text").textContent !== said) byId("run-text").textContent = said;
  byId("run-text").classList.toggle("bad", Boolean(run?.text));
  showProcesses(run);
  // What happened in a run stays to be read when it has made way for something else.
  if (state.trace !== undefined && run) showTrace(state.trace);
  if (state.refusal) byId("export-text").textContent = "";
  showVariables(run?.variables ?? []);
}

function showTrace(trace) {
  const list = byId("trace");
  list.replaceChildren(
    ...trace.map(({ t, line, text }) => make("li", {}, make("time", { textContent: `${number(t, 2)} s` }), make("span", { className: "quiet", textContent: `line ${line}` }), make("span", { textContent: text }))),
  );
  list.scrollTop = list.scrollHeight;
}

function saveBlob(blob, name) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

function keepFile({ name, type, data: content }) {
  byId("export-text").textContent = "";
  saveBlob(new Blob([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], { type }), name);
}

// The view as a video, from one click to the next.
const film = { recorder: null, canvas: null };

// All layers of the view, on the ground of the page.
function filmFrame() {
  const { canvas: whole } = film;
  const pen = whole.getContext("2d");
  pen.fillStyle = getComputedStyle(canvas.parentElement).backgroundColor;
  pen.fillRect(0, 0, whole.width, whole.height);
  for (const layer of canvas.parentElement.querySelectorAll("canvas")) pen.drawImage(layer, 0, 0, whole.width, whole.height);
}

function toggleVideo() {
  const button = byId("video");
  if (film.recorder) {
    film.recorder.stop();
    film.recorder = null;
    button.textContent = "Video";
    return;
  }
  const type = ["video/mp4;codecs=avc1", "video/webm;codecs=vp9", "video/webm"].find((one) => window.MediaRecorder?.isTypeSupported(one));
  if (!type) {
    byId("run-text").textContent = "this browser records no video";
    return;
  }
  const pieces = [];
  film.canvas = make("canvas", { width: canvas.width, height: canvas.height });
  filmFrame();
  film.recorder = new MediaRecorder(film.canvas.captureStream(30), { mimeType: type });
  film.recorder.ondataavailable = ({ data: piece }) => pieces.push(piece);
  film.recorder.onstop = () => saveBlob(new Blob(pieces, { type }), `view.${type.includes("mp4") ? "mp4" : "webm"}`);
  film.recorder.start();
  button.textContent = "End the video";
}

// Of several processes that stand one is chosen to step; that which stopped the run at first.
function showProcesses(run) {
  const names = run && !run.playing && !run.running ? run.lines.map(({ process }) => process) : [];
  const field = byId("process");
  field.hidden = names.length < 2;
  const key = JSON.stringify(names);
  if (field.dataset.key === key) return;
  field.dataset.key = key;
  field.replaceChildren(make("option", { value: "", textContent: "the process that stands" }), ...names.map((name) => make("option", { value: name, textContent: name })));
}

function showVariables(variables) {
  byId("variables-card").hidden = !variables.length;
  const key = JSON.stringify(variables);
  const list = byId("variables");
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...variables.map(({ name, value, type }) => make("li", { title: type }, make("b", { textContent: name }), make("span", { textContent: value }))));
}

function startRunning() {
  answers.download = keepFile;
  byId("video").addEventListener("click", toggleVideo);
  for (const button of document.querySelectorAll("[data-keep]"))
    button.addEventListener("click", () => {
      byId("export-text").textContent = "being made";
      send({ do: "keep", what: button.dataset.keep });
    });
  byId("run").addEventListener("click", startRun);
  byId("pause").addEventListener("click", () => send({ do: "pause" }));
  byId("step").addEventListener("click", () => goOn(byId("step-way").value));
  byId("back").addEventListener("click", () => send({ do: "go", step: "back" }));
  byId("stop").addEventListener("click", () => send({ do: "stop" }));
  byId("run-here").addEventListener("click", () => send(runMessage({ line: editorLine() })));
  byId("run-line").addEventListener("click", () => send(runMessage({ line: editorLine(), only: true })));
  byId("reset").addEventListener("click", () => send({ do: "reset" }));
  byId("pace").addEventListener("change", (event) => {
    if (live.state.run) send({ do: "pace", rate: Number(event.target.value) });
  });
  document.addEventListener("keydown", (event) => {
    const typing = event.target.matches("textarea, input[type=text], input[type=number]");
    const keys = { F5: () => (event.shiftKey ? send({ do: "stop" }) : startRun()), F10: () => (event.shiftKey ? send({ do: "go", step: "back" }) : goOn(byId("step-way").value)) };
    if (event.key === "F9") keys.F9 = () => toggleBreakpoint(editorLine());
    if (event.key === " " && !typing && !event.target.matches("button, select, input") && live.state?.run?.playing) keys[" "] = () => send({ do: "pause" });
    if (!keys[event.key] || !mine()) return;
    event.preventDefault();
    keys[event.key]();
  });
  const tabs = [...document.querySelectorAll("[role=tab]")];
  const choose = (tab) => {
    for (const one of tabs) {
      one.ariaSelected = String(one === tab);
      one.tabIndex = one === tab ? 0 : -1;
      byId(one.getAttribute("aria-controls")).hidden = one !== tab;
    }
    // Compared motions are in the view while the tab of runs is open, whose charts are not drawn before.
    drawSoon();
    paintStrip();
    paintComparison();
  };
  tabs.forEach((tab, i) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!by) return;
      const next = tabs[(i + by + tabs.length) % tabs.length];
      choose(next);
      next.focus();
    });
  });
}
