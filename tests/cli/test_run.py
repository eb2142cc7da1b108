"""The command ``armwright run``, as a user calls it."""

import csv
import hashlib
import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.files.output import stray_files
from cli_calls import armwright, armwright_process

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
STACKING = EXAMPLES / "stacking.rlo"
STANFORD = EXAMPLES / "stanford_cell.toml"
PUMA = EXAMPLES / "puma_cell.toml"
FILES = {"motion.csv", "events.jsonl", "frames.json", "run.json", "report.html"}


def fails(*arguments: str | Path, status: int, **keywords: object) -> str:
    """Call it with a mistake: that exit status, no traceback; return what it says."""
    done = armwright(*arguments, **keywords)  # type: ignore[arg-type]
    assert done.returncode == status, done
    assert "Traceback" not in done.stderr + done.stdout
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def stacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run of the report's program."""
    folder = tmp_path_factory.mktemp("run") / "out"
    done = armwright("run", STACKING, "--cell", STANFORD, "-o", folder)
    assert done.returncode == 0, done
    assert done.stdout.rstrip().endswith(f"report: {folder / 'report.html'}")
    return folder


def test_the_five_files(stacked: Path) -> None:
    """A run leaves its five files and nothing else, beside it neither."""
    assert {path.name for path in stacked.iterdir()} == FILES
    assert list(stacked.parent.iterdir()) == [stacked]


def test_motion_file(stacked: Path) -> None:
    """One row per millisecond, and in every row the efforts are the inverse dynamics of its motion."""
    with (stacked / "motion.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["t", "arm", *(f"{name}{i}" for name in ("q", "qd", "qdd", "tau") for i in range(1, 7))]
    assert {row[1] for row in rows} == {"ARM_1"}
    table = np.array([[row[0], *row[2:]] for row in rows], dtype=float)
    t, q, qd, qdd, tau = table[:, 0], table[:, 1:7], table[:, 7:13], table[:, 13:19], table[:, 19:]

    np.testing.assert_allclose(np.diff(t), 1e-3, atol=1e-12)
    np.testing.assert_allclose(tau, inverse_dynamics(load_arm("stanford"), q, qd, qdd), rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(np.diff(q, axis=0) / 1e-3, (qd[1:] + qd[:-1]) / 2, atol=1e-4)
    np.testing.assert_allclose(qd[[0, -1]], 0, atol=1e-12)


def test_events_file(stacked: Path) -> None:
    """Every effect has its time and its line; the MOVE in line 9 carries OBJ1."""
    events = [json.loads(line) for line in (stacked / "events.jsonl").read_text().splitlines()]

    assert [event["line"] for event in events] == list(range(3, 14))
    assert events[6]["text"] == "ARM_1 [OBJ1] MOVE: PTP OBJ2 @100"
    assert events[6]["source"] == "MOVE OBJ1 TO OBJ2"
    assert all(a["t1"] <= b["t0"] + 1e-9 for a, b in pairwise(events))
    assert {event["process"] for event in events} == {"program"}
    assert all(len(f"{event[key]!r}") <= 12 for event in events for key in ("t0", "t1"))


def test_events_of_two_arms(tmp_path: Path) -> None:
    """Events of two branches stand in the order in which they began, each with its process; so does the trace."""
    done = armwright("run", EXAMPLES / "hand_over.rlo", "--cell", EXAMPLES / "two_arms.toml", "-o", tmp_path / "out")

    events = [json.loads(line) for line in (tmp_path / "out/events.jsonl").read_text().splitlines()]
    assert [event["t0"] for event in events] == sorted(event["t0"] for event in events)
    arms = {(event["process"], event["arm"]) for event in events if event["arm"] is not None}
    assert arms == {("branch 1", "ARM_1"), ("branch 2", "ARM_2")}
    words = done.stdout.split("\n \n")[0].splitlines()
    rows = [line.split() for line in words if " branch " in line]
    assert len(rows) > 10
    starts = [float(row[1]) for row in rows]
    assert starts == sorted(starts)
    moved = next(row for row in rows if "MOVE:" in row)
    assert (moved[3:5], float(moved[2])) == (["branch", "1"], next(e["t1"] for e in events if e["kind"] == "MOVE"))
    page = (tmp_path / "out/report.html").read_text()
    assert '"process":"branch 2"' in page.replace('": "', '":"')


def test_events_say_what_they_did(tmp_path: Path) -> None:
    """An assignment shows the place that a frame got, in the units of the program, and in SI as data."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text(
        "UNITS MM ;\nVAR near : FRAME ; n : SCALAR ;\n"
        "BEGIN n = 0 ; near = (1,0,0, 0,-1,0, 0,0,-1, 450, 100, 250) ;\n"
        'MOVE ARM_1 TO near, ON n < 1 DO PRINT ("on the way") ;\nEND.'
    )
    done = armwright("run", program, "--cell", STANFORD, "-o", out)

    assert done.returncode == 0, done
    events = [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]
    assert [event["kind"] for event in events] == ["PLACE", "MOVE", "PRINT", "END"]
    assert events[0]["text"] == "near = (1,0,0, 0,-1,0, 0,0,-1, 450,100,250)"
    assert events[0]["pose"] == [1, 0, 0, 0, -1, 0, 0, 0, -1, 0.45, 0.1, 0.25]
    assert (events[1]["t0"], events[2]["t0"]) == (0, 0)
    run = json.loads((out / "run.json").read_text())
    assert all(len(repr(one["duration"])) <= 14 for one in (run, *run["stages"]))


@pytest.mark.parametrize("ends", ["halted", "braked"])
def test_a_stopped_move_shows_what_it_did(ends: str, tmp_path: Path) -> None:
    """A MOVE that was halted, or braked by the end of the program, has the duration and length that it came to."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    branch = f"BEGIN PAUSE 0.3 ; {'HALT' if ends == 'braked' else 'near = 1'} END"
    guard = ", ON near > 0.3 DO HALT" if ends == "halted" else ""
    program.write_text(
        "VAR goal : FRAME ; near : SCALAR ;\n"
        "BEGIN near = 0 ; goal = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.1, 0.25) ;\nCOBEGIN\n"
        f"BEGIN MOVE ARM_1 TO goal{guard} END ;\n"
        f"{branch} ;\nCOEND ;\nEND."
    )
    done = armwright("run", program, "--cell", STANFORD, "-o", out, columns=200)

    assert done.returncode == 0, done
    events = [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]
    (move,) = (event for event in events if event["kind"] == "MOVE")
    assert move["text"].endswith(f"; {ends}")
    assert move[ends] is True
    run = json.loads((out / "run.json").read_text())
    (stage,) = run["stages"]
    assert stage["stopped"] is True
    assert move["t1"] - move["t0"] == pytest.approx(stage["duration"], abs=1e-3)
    note = f"stopped on its path, after {stage['duration']:.3f} s and {stage['length'] * 1e3:.1f} mm of "
    assert note in (out / "report.html").read_text()
    row = next(line for line in done.stdout.splitlines() if "PTP goal, stopped" in line)
    assert f"{stage['duration']:.3f}" in row


def test_frames_file(stacked: Path) -> None:
    """At the end both objects are in the place where the second was seen, and hang on nothing."""
    frames = json.loads((stacked / "frames.json").read_text())["frames"]

    for name in ("OBJ1", "OBJ2"):
        assert frames[name]["parent"] == "WORLD"
        np.testing.assert_allclose(frames[name]["world"], [1, 0, 0, 0, -1, 0, 0, 0, -1, 0.4, -0.15, 0.05], atol=1e-9)
    assert frames["ARM_1"]["parent"] == "ARM_1.BASE"


def test_run_file(stacked: Path) -> None:
    """What made the run can be found again: inputs by hash, versions, options, command."""
    run = json.loads((stacked / "run.json").read_text())

    assert run["inputs"]["program"]["sha256"] == hashlib.sha256(STACKING.read_bytes()).hexdigest()
    assert run["inputs"]["cell"]["sha256"] == hashlib.sha256(STANFORD.read_bytes()).hexdigest()
    options = {
        "servo_ms": 1.0,
        "deviation_mm": 1.0,
        "corner_mm": 20.0,
        "around": "none",
        "plan": False,
        "std": "2",
        "strict": False,
    }
    assert run["options"] == options
    assert (run["ended"], run["exit_status"], run["left_out"]) == ("finished", 0, [])
    assert run["command"].startswith("armwright run ")
    assert [stage["kind"] for stage in run["stages"]] == ["PTP"] * 3
    assert run["diagnostics"][0]["code"] == "L301"


def test_same_input_same_files(stacked: Path, tmp_path: Path) -> None:
    """A second run writes the same bytes, but for the command and the folder in it."""
    armwright("run", STACKING, "--cell", STANFORD, "-o", tmp_path / "again")

    for name in ("motion.csv", "events.jsonl", "frames.json"):
        assert (tmp_path / "again" / name).read_bytes() == (stacked / name).read_bytes()


@pytest.mark.parametrize("name", ["bench", "twelve_moves", "portable", "gearbox", "around"])
def test_examples(name: str, tmp_path: Path) -> None:
    """Every example runs to its end."""
    cell = PUMA if name in ("gearbox", "around") else STANFORD
    more = ("--around", "via") if name == "around" else ()

    done = armwright("run", EXAMPLES / f"{name}.rlo", "--cell", cell, "-o", tmp_path / name, "--servo-ms", "4", *more)

    assert done.returncode == 0, done
    assert {path.name for path in (tmp_path / name).iterdir()} == FILES


def test_collisions_are_not_looked_for(stacked: Path, tmp_path: Path) -> None:
    """Whoever reads the summary, the page, run.json or --json is told that nobody has looked for collisions."""
    program = ("run", EXAMPLES / "bench.rlo", "--cell", STANFORD)
    (tmp_path / "far.rlo").write_text("BEGIN\n  MOVE ARM_1 TO WORLD * XYZ(9, 0, 0) ;\nEND.\n")
    failed = armwright("run", "far.rlo", "--cell", STANFORD, "-o", "out", "--json", cwd=tmp_path)

    assert armwright(*program).stdout.rstrip().endswith("Collisions are not checked.")
    assert json.loads(armwright(*program, "--json").stdout)["collisions"] == "not checked"
    assert (failed.returncode, json.loads(failed.stdout)["collisions"]) == (3, "not checked")
    for folder in (stacked, tmp_path / "out"):
        assert json.loads((folder / "run.json").read_text())["collisions"] == "not checked"
        assert "<dt>Collisions</dt><dd>not checked</dd>" in (folder / "report.html").read_text()


def test_json_summary() -> None:
    """--json prints the summary and nothing else, in SI units."""
    done = armwright("run", EXAMPLES / "bench.rlo", "--cell", STANFORD, "--json")

    summary = json.loads(done.stdout)
    assert [stage["kind"] for stage in summary["stages"]] == ["PTP", "LINE", "PTP"]
    assert summary["stages"][1]["length"] == pytest.approx(0.1)
    assert {one["code"] for one in summary["diagnostics"]} == {"W201", "W203"}


def test_quiet() -> None:
    """With -q a program without warnings prints nothing."""
    done = armwright("run", EXAMPLES / "twelve_moves.rlo", "--cell", STANFORD, "-q", "--servo-ms", "8")

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_servo_period_and_deviation(tmp_path: Path) -> None:
    """A finer deviation takes more knots; a longer period fewer rows."""

    def knots(*options: str) -> list[int]:
        done = armwright("run", EXAMPLES / "bench.rlo", "--cell", STANFORD, "--json", *options)
        return [(stage["certificate"] or {"knots": 2})["knots"] for stage in json.loads(done.stdout)["stages"]]

    assert knots("--deviation-mm", "0.01")[1] > knots()[1]
    armwright("run", EXAMPLES / "bench.rlo", "--cell", STANFORD, "--servo-ms", "10", "-o", tmp_path / "slow")
    times = [line.split(",")[0] for line in (tmp_path / "slow" / "motion.csv").read_text().splitlines()[1:4]]
    assert times == ["0", "0.01", "0.02"]


def test_a_way_round(tmp_path: Path) -> None:
    """--around is recorded; warning, run.json and page tell what stopped the line, how it is left, and the price."""
    done = armwright("run", EXAMPLES / "around.rlo", "--cell", PUMA, "--around", "damped", "-o", tmp_path / "out")

    assert done.returncode == 0, done
    assert "warning[W402]: ARM_1 leaves the straight line to `bottom`, by damped least squares: " in done.stdout
    assert "around.rlo:12:3" in done.stdout
    run = json.loads((tmp_path / "out" / "run.json").read_text())
    assert run["options"]["around"] == "damped"
    ptp, line, _ = run["stages"]
    assert ptp["detour"] is None
    detour = line["detour"]
    assert (detour["method"], detour["cause"], detour["joint"], detour["via"]) == ("damped", "singular", 6, None)
    assert detour["along"] == pytest.approx(detour["fraction"] * detour["line"])
    assert 0 < detour["position_deviation"] < 0.01
    assert line["deviation"] == detour["position_deviation"]
    assert f"{detour['position_deviation'] * 1e3:.1f} mm off the line" in done.stdout
    page = (tmp_path / "out" / "report.html").read_text()
    assert "the straight line is infeasible at 50 % of the path" in page


def test_a_cell_that_goes_round(tmp_path: Path) -> None:
    """The cell file can ask for ways round, and the option overrules it; a misspelt way gets the nearest."""
    cell = tmp_path / "cell.toml"
    cell.write_text(PUMA.read_text() + 'around = "via"\n')
    call = ("run", EXAMPLES / "around.rlo", "--cell", cell, "--servo-ms", "8")

    assert "W402" in armwright(*call).stdout
    assert "error[E403]" in fails(*call, "--around", "none", status=3)
    cell.write_text(PUMA.read_text() + 'around = "dampd"\n')
    assert "did you mean 'damped'?" in fails(*call, status=4)
    assert armwright(*call, "--around", "over").returncode == 2


def test_option_out_of_range() -> None:
    """A servo period of nothing is a usage error: exit status 2."""
    done = armwright("run", STACKING, "--cell", STANFORD, "--servo-ms", "0")

    assert done.returncode == 2
    assert "expected 0.1 to 100, got 0" in done.stderr


def test_missing_files(tmp_path: Path) -> None:
    """A missing program or cell is one line that names it, and the file that was probably meant."""
    assert "nope.rlo: no such file" in fails("run", tmp_path / "nope.rlo", "--cell", STANFORD, status=4)
    said = fails("run", STACKING, "--cell", EXAMPLES / "stanfrd_cell.toml", status=4)
    assert "no such file; did you mean" in said
    assert "stanford_cell.toml" in said
    assert said.count("\n") == 1


def test_broken_cell(tmp_path: Path) -> None:
    """Broken TOML and an unknown arm are told with file and line."""
    cell = tmp_path / "cell.toml"
    cell.write_text("[arms.ARM_1\nmodel = 3\n")
    assert f"{cell}:1: not valid TOML" in fails("run", STACKING, "--cell", cell, status=4)
    cell.write_text('# a cell\n[arms.ARM_1]\nmodel = "stanfort"\nhand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]\n')
    said = fails("run", STACKING, "--cell", cell, status=4)
    assert f"{cell}:3: arms, ARM_1, model: no arm 'stanfort'. Did you mean 'stanford'?" in said


def test_wrong_program(tmp_path: Path) -> None:
    """A program with errors is not run: diagnostics, status 1, no folder."""
    program = tmp_path / "p.rlo"
    program.write_text("VAR f : FRAME ; BEGIN MOVE ARM_1 TO f ; MOVE ARM_7 TO f ; END.")

    said = fails("run", program, "--cell", STANFORD, "-o", tmp_path / "out", status=1)

    assert "E304" in said
    assert "ARM_7" in said
    assert not (tmp_path / "out").exists()


def test_unreachable_goal(tmp_path: Path) -> None:
    """A goal too far away: which frame, how far out in mm, where the frames were, and the page up to there."""
    program = tmp_path / "far.rlo"
    lines = ["VAR far : FRAME ;", "BEGIN", "  far = (1,0,0,0,-1,0,0,0,-1,3,0,0.2) ;", "  MOVE ARM_1 TO far ;", "END."]
    program.write_text("\n".join(lines))

    said = fails("run", program, "--cell", STANFORD, "-o", tmp_path / "out", status=3)

    assert "error[E402]: `far` cannot be reached by ARM_1" in said
    assert "--> far.rlo:4:" in said
    assert "joint 3 would be at 2996.5 mm, 1878.9 mm beyond its limit 1117.6 mm" in said
    assert "frames at 0.000 s" in said
    assert f"report up to the failure: {tmp_path / 'out' / 'report.html'}\n" in said
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES


def test_effort_over_the_limit(tmp_path: Path) -> None:
    """An arm that is too weak still runs; the warning names joint, amount and time."""
    arm = (ROOT / "src/armwright/arm/catalogue/stanford.toml").read_text().replace("effort_Nm = 303", "effort_Nm = 5")
    (tmp_path / "weak.toml").write_text(arm)
    cell = STANFORD.read_text().replace('model = "stanford"', f'model = "{tmp_path / "weak.toml"}"')
    (tmp_path / "cell.toml").write_text(cell)

    done = armwright("run", STACKING, "--cell", tmp_path / "cell.toml")

    assert done.returncode == 0
    assert "warning[W401]: joint 2 of ARM_1 would need" in done.stdout
    assert "more than its 5 N m" in done.stdout


def test_full_disk(tmp_path: Path) -> None:
    """When the disk takes no more, the run says so and leaves no file: here files may not grow past 100 kB."""

    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    done = armwright_process("run", STACKING, "--cell", STANFORD, "-o", tmp_path / "deep" / "out", before=small_files)

    assert done.returncode == 4
    assert "Traceback" not in done.stderr
    assert "File too large; nothing was written" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_full_output() -> None:
    """When the output itself can take no more, one message says so."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "armwright", "run", str(STACKING), "--cell", str(STANFORD)],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=300,
        )

    assert done.returncode == 4
    assert done.stderr == "armwright: cannot write the output: No space left on device\n"


def test_interruption(tmp_path: Path) -> None:
    """Ctrl-C ends a long run with a word, and nothing is left behind."""
    moves = "MOVE ARM_1 TO a STRAIGHTLY ; MOVE ARM_1 TO b STRAIGHTLY ;\n" * 400
    places = "a = (1,0,0,0,-1,0,0,0,-1,0.45,0.1,0.25) ; b = (1,0,0,0,-1,0,0,0,-1,0.45,-0.1,0.25) ;\n"
    (tmp_path / "long.rlo").write_text(f"VAR a, b : FRAME ; BEGIN {places} {moves} END.")
    command = [sys.executable, "-m", "armwright", "run", "long.rlo", "--cell", str(STANFORD), "-o", "out"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        time.sleep(2.0)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=300)

    assert running.returncode == 130
    assert said == "armwright: interrupted; nothing was written\n"
    assert [path.name for path in tmp_path.iterdir()] == ["long.rlo"]


def test_names_that_look_like_markup(tmp_path: Path) -> None:
    """Brackets in the names of cell and program are printed as they are."""
    (tmp_path / "[red]x.rlo").write_text(STACKING.read_text())
    (tmp_path / "cell.toml").write_text(STANFORD.read_text().replace("Stanford arm at a bench", "[/foo] cell"))

    done = armwright("run", tmp_path / "[red]x.rlo", "--cell", tmp_path / "cell.toml")

    assert done.returncode == 0
    assert "[red]x.rlo: 3.977 s in [/foo] cell" in done.stdout


def test_a_name_that_is_no_text(tmp_path: Path) -> None:
    """A program whose file name is not UTF-8 runs, and its results say the name as well as they can."""
    name = os.fsdecode(b"a\xff.rlo")
    (tmp_path / name).write_text(STACKING.read_text())

    done = armwright("run", tmp_path / name, "--cell", STANFORD, "-o", tmp_path / "out", "-q")

    assert (done.returncode, done.stderr) == (0, "")
    assert "udcff.rlo" in (tmp_path / "out" / "run.json").read_text()


def test_json_of_a_failure(tmp_path: Path) -> None:
    """With --json a program that cannot be translated, or cannot go on, is told in JSON too."""
    (tmp_path / "p.rlo").write_text("BEGIN MOVE ARM_1 TO f ; END.")
    data = json.loads(fails("run", tmp_path / "p.rlo", "--cell", STANFORD, "--json", status=1))
    assert data["diagnostics"][0]["code"] == "E202"
    (tmp_path / "q.rlo").write_text("VAR f : FRAME ; BEGIN f = (1,0,0,0,-1,0,0,0,-1,3,0,0) ; MOVE ARM_1 TO f ; END.")
    data = json.loads(fails("run", tmp_path / "q.rlo", "--cell", STANFORD, "--json", status=3))
    assert data["diagnostics"][0]["code"] == "E402"
    assert data["frames"]["F"] == [3.0, 0.0, 0.0]


def test_narrow_terminal() -> None:
    """On a narrow terminal the tables fold, and no number is cut."""
    done = armwright("run", EXAMPLES / "bench.rlo", "--cell", STANFORD, columns=40)

    assert done.returncode == 0
    assert "…" not in done.stdout


def test_output_in_the_way(tmp_path: Path) -> None:
    """An output folder that is a file is refused, and the file stays."""
    (tmp_path / "out").write_text("mine")

    said = fails("run", STACKING, "--cell", STANFORD, "-o", tmp_path / "out", status=4)

    assert "cannot write to" in said
    assert (tmp_path / "out").read_text() == "mine"


def test_help_has_an_example() -> None:
    """The help of the command and of every subcommand shows how it is called."""
    assert "Example" in armwright("--help").stdout
    for command in ("run", "check", "arms", "show"):
        assert "Example" in armwright(command, "--help").stdout


def test_nothing_heavy_before_it_is_needed() -> None:
    """The help comes up without loading NumPy, and importing the package loads none of its parts."""
    code = "import sys, armwright; print(sorted(m for m in sys.modules if m.startswith(('armwright.', 'numpy'))))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['armwright.errors', 'armwright.lazy_namespace']"
    code = "import sys; from armwright.cli import app; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.browser
def test_report_in_a_browser(stacked: Path, browser: Any) -> None:
    """The page of a real run opens from the disk: no error, no request, and the slider moves the arm."""
    complaints: list[str] = []
    requests: list[str] = []
    address = (stacked / "report.html").as_uri()
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(address)
    before, start = page.screenshot(), page.evaluate("armwright.state()")
    page.locator("#time").fill("2.2")
    page.wait_for_timeout(200)
    after, later = page.screenshot(), page.evaluate("armwright.state()")
    page.close()

    assert complaints == []
    assert requests == [address]
    assert later["time"] == pytest.approx(2.2, abs=0.01)
    assert before != after
    assert np.linalg.norm(np.subtract(later["hand"], start["hand"])) > 0.05
    with (stacked / "motion.csv").open(newline="") as file:
        rows = list(csv.reader(file))[1:]
    np.testing.assert_allclose(later["q"], [float(x) for x in rows[2200][2:8]], atol=0.02)


ENDS = {
    "E402": ("MOVE ARM_1 TO far", "MOVE ARM_1 TO far", ()),
    "E506": ("PAUSE 100", "PAUSE 100", ("--max-time", "3")),
    "E504": ("WHILE n > 0 DO n = 1", "n > 0", ("--max-steps", "1000")),
    "E501": ("IF n < 0 THEN SIGNAL never ; WAIT never", "WAIT never", ()),
}


@pytest.mark.parametrize("code", ENDS)
def test_a_failed_run_shows_itself(code: str, tmp_path: Path) -> None:
    """A run that fails leaves all up to the failure in place of older results: page, events, motion, and why."""
    statement, at, options = ENDS[code]
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    places = "near = (1,0,0,0,-1,0,0,0,-1,0.45,0.1,0.25) ; far = (1,0,0,0,-1,0,0,0,-1,3,0,0.2) ;"
    names = "VAR near, far : FRAME ; n : SCALAR ; never : EVENT ;"
    call = ("run", program, "--cell", STANFORD, "-o", out)
    program.write_text(f"{names} BEGIN {places} n = 1 ; MOVE ARM_1 TO near ; PAUSE 3 ; END.")
    assert armwright(*call).returncode == 0
    (out / "mine.txt").write_text("mine")
    old = (out / "motion.csv").read_text()

    program.write_text(f"{names}\nBEGIN {places} n = 1 ;\nMOVE ARM_1 TO near ;\n{statement} ;\nEND.")
    said = fails(*call, *options, status=3)

    run = json.loads((out / "run.json").read_text())
    assert (run["ended"], run["exit_status"], run["error"]["code"], run["error"]["line"]) == ("failed", 3, code, 4)
    assert run["error"]["statement"] == at
    assert run["error"]["arm"] == (None if code == "E501" else "ARM_1")
    last = json.loads((out / "events.jsonl").read_text().splitlines()[-1])
    assert (last["kind"], last["code"], last["line"]) == ("ERROR", code, 4)
    rows = (out / "motion.csv").read_text().splitlines()
    assert rows[:300] == old.splitlines()[:300]
    assert float(rows[-1].split(",")[0]) == pytest.approx(run["duration"])
    page = (out / "report.html").read_text()
    assert ": failed</title>" in page
    assert f"failed: {code} at " in page
    assert f"report up to the failure: {out / 'report.html'}\n" in said
    assert (out / "mine.txt").exists()
    assert not stray_files(out)


def test_a_program_with_errors_leaves_old_results(tmp_path: Path) -> None:
    """A program that is not translated does not run, and the results of the last one stay."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text("BEGIN PAUSE 0.1 ; END.")
    assert armwright("run", program, "--cell", STANFORD, "-o", out).returncode == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    program.write_text("BEGIN PAUSE")
    fails("run", program, "--cell", STANFORD, "-o", out, status=1)

    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_hashes_are_those_of_what_was_read(tmp_path: Path) -> None:
    """The record holds the hash of a program that comes by a pipe, which nobody can read a second time."""
    program, out, pipe = b"BEGIN PAUSE 0.1 END.\r\n", tmp_path / "out", tmp_path / "pipe.rlo"
    os.mkfifo(pipe)
    writing = threading.Thread(target=pipe.write_bytes, args=(program,), daemon=True)
    writing.start()

    assert armwright("run", pipe, "--cell", STANFORD, "-o", out, "-q").returncode == 0

    writing.join()
    inputs = json.loads((out / "run.json").read_text())["inputs"]
    assert inputs["program"] == {"path": str(pipe), "sha256": hashlib.sha256(program).hexdigest()}
    assert inputs["cell"]["sha256"] == hashlib.sha256(STANFORD.read_bytes()).hexdigest()


def test_a_long_stream(tmp_path: Path) -> None:
    """A stream that is too long is cut, and terminal, page and record say where and what keeps it all."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text("BEGIN PAUSE 2 ; END.")

    done = armwright("run", program, "--cell", STANFORD, "-o", out, "--motion-rows", "500", "-q")

    said = "motion.csv holds the first 0.500 s of 2.000 s: 500 of 2001 rows; `--motion-rows 2001` writes all"
    assert done.returncode == 0
    assert done.stderr == f"armwright: {said}\n"
    assert json.loads((out / "run.json").read_text())["left_out"] == [said]
    assert said in (out / "report.html").read_text()
    assert len((out / "motion.csv").read_text().splitlines()) == 501
    armwright("run", program, "--cell", STANFORD, "-o", out, "--motion-rows", "2001")
    assert len((out / "motion.csv").read_text().splitlines()) == 2002


def test_few_rows_of_many_arms(tmp_path: Path) -> None:
    """Where there are fewer rows than arms, none are kept of a run that failed, and not all."""
    base, configuration = "base = [1,0,0, 0,1,0, 0,0,1, {0},0,0]\n", "joint_positions = [0,0,0.3,0,1,0]\n"
    arms = (f"[arms.ARM_{i}]\n{base.format(i)}{configuration}" for i in range(3))
    (tmp_path / "cell.toml").write_text("".join(arms))
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text("VAR n : SCALAR ; BEGIN n = 0 ; PAUSE 0.01 ; n = 1 / n END.")

    fails("run", program, "--cell", tmp_path / "cell.toml", "-o", out, "--motion-rows", "2", status=3)

    assert len((out / "motion.csv").read_text().splitlines()) == 1


def test_a_long_stream_of_a_failure(tmp_path: Path) -> None:
    """Of a run that failed the stream is kept up to the failure."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text(
        "VAR never : EVENT ; n : SCALAR ; BEGIN n = 1 ; PAUSE 2 ; IF n < 0 THEN SIGNAL never ; WAIT never ; END."
    )

    fails("run", program, "--cell", STANFORD, "-o", out, "--motion-rows", "500", status=3)

    rows = (out / "motion.csv").read_text().splitlines()
    assert (len(rows), float(rows[1].split(",")[0]), float(rows[-1].split(",")[0])) == (501, 1.501, 2.0)


def test_a_page_of_many_lines(tmp_path: Path) -> None:
    """A page shows the first and the last of very many lines, and says so; the events are all there."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text('VAR i : SCALAR ; BEGIN FOR i = 1 TO 6000 DO PRINT ("again") ; END.')

    done = armwright("run", program, "--cell", STANFORD, "-o", out, "-q")

    assert done.returncode == 0, done
    assert len((out / "events.jsonl").read_text().splitlines()) > 6000
    page = (out / "report.html").read_text()
    assert "... and 2,001 more; all in events.jsonl" in page
    assert len(page) < 1_500_000
    trace = json.loads((out / "run.json").read_text())["trace"]
    assert (len(trace), trace[2000]) == (4001, "... and 2,000 more; all in events.jsonl")


def test_a_terminal_of_many_lines(tmp_path: Path) -> None:
    """A terminal shows the first and the last of very many lines, and where all of them are."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text("VAR i : SCALAR ; BEGIN FOR i = 1 TO 6000 DO PRINT (i) ; END.")
    call = ("run", program, "--cell", STANFORD)

    kept, shown = armwright(*call, "-o", out, columns=200), armwright(*call, columns=200)
    told = json.loads(armwright(*call, "--json").stdout)

    assert "... and 5,001 more; all in events.jsonl\n" in kept.stdout.replace(" \n", "\n")
    assert "... and 5,001 more; `-o FOLDER` keeps all in events.jsonl" in shown.stdout
    assert 'PRINT "500"' in shown.stdout
    assert 'PRINT "501"' not in shown.stdout
    assert len(shown.stdout.splitlines()) < 1020
    assert told["trace"][2000] == "... and 2,000 more; `-o FOLDER` keeps all in events.jsonl"


def test_a_page_of_many_frames_and_changes(tmp_path: Path) -> None:
    """A page draws some hundred frames and lists some thousand changes of their tree; what is left out is said."""
    cell, program, out = tmp_path / "cell.toml", tmp_path / "p.rlo", tmp_path / "out"
    frames = "".join(f"F{i} = [1,0,0, 0,1,0, 0,0,1, 0.{i:04},0,0]\n" for i in range(5000))
    cell.write_text(Path(STANFORD).read_text().replace("[frames]\n", f"[frames]\n{frames}"))
    cycle = "BEGIN AFFIX F1 TO F2 ; PAUSE 0.001 ; UNFIX F1 ; PAUSE 0.001 ; END"
    program.write_text(f"VAR i : SCALAR ; F1, F2 : FRAME ; BEGIN FOR i = 1 TO 2000 DO {cycle} END.")

    done = armwright("run", program, "--cell", cell, "-o", out, "-q")

    assert done.returncode == 0, done
    page = (out / "report.html").read_text()
    assert "this page shows the first and the last 200 of 5,002 frames; all in frames.json" in page
    assert "this page shows the first and the last 2,000 of " in page
    assert len(page) < 3_000_000
    assert len(json.loads((out / "frames.json").read_text())["frames"]) > 5000


def test_a_line_of_many_letters(tmp_path: Path) -> None:
    """Of a text of many thousand letters a page, a record and a terminal show the two ends."""
    program, out = tmp_path / "p.rlo", tmp_path / "out"
    program.write_text(f'BEGIN PRINT ("{"x" * 200_000}") ; END.')

    done = armwright("run", program, "--cell", STANFORD, "-o", out)

    rest = f"... and {200_008 - 1000:,} more; all in events.jsonl"
    assert rest in " ".join(done.stdout.split())
    assert rest in json.loads((out / "run.json").read_text())["trace"][0]
    assert "x" * 200_000 in (out / "events.jsonl").read_text()
    # The text of the program is there whole, and no line of what happened.
    assert (out / "report.html").read_text().count("x" * 200_000) == 1


def test_what_a_failed_run_has_printed(tmp_path: Path) -> None:
    """The terminal shows what happened up to a failure, lines for people too, and the devices that it switched off."""
    program, cell = tmp_path / "p.rlo", tmp_path / "cell.toml"
    cell.write_text(STANFORD.read_text() + "\n[devices]\nPUMP = {}\n")
    program.write_text(
        'VAR f : FRAME ; BEGIN f = (1,0,0,0,-1,0,0,0,-1,3,0,0) ;\nPRINT("gripped at", 42) ;\n'
        "OPERATE PUMP ; MOVE ARM_1 TO f ; END."
    )

    done = armwright("run", program, "--cell", cell, "-o", tmp_path / "out", columns=200)
    quiet = armwright("run", program, "--cell", cell, "-q", columns=200)

    assert "gripped at 42" in done.stdout
    assert "; PUMP OFF" in done.stdout
    assert "gripped" not in quiet.stdout
    last = json.loads((tmp_path / "out" / "events.jsonl").read_text().splitlines()[-1])
    assert (last["kind"], last["switched_off"]) == ("ERROR", ["PUMP"])
    assert last["text"].endswith("; PUMP OFF")


def test_a_duration_is_no_slowness(tmp_path: Path) -> None:
    """A stage that lasts as long as was asked for is not told to be slow for a joint; without DURATION it is."""
    text = (EXAMPLES / "gearbox.rlo").read_text()
    said = {}
    for name, with_ in (("short", text), ("long", text.replace("VIA (v1, v2)", "WITH DURATION = 30s, VIA (v1, v2)"))):
        (tmp_path / f"{name}.rlo").write_text(with_)
        said[name] = armwright("run", tmp_path / f"{name}.rlo", "--cell", PUMA, columns=200).stdout

    assert "line 25: SPLINE to aphole runs" in said["short"]
    assert "line 25: SPLINE to aphole" not in said["long"]
    assert "line 31: LINE to aphole runs" in said["long"]
