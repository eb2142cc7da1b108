"""MOVEs whose path a sensor corrects: sideways of a line, within a bound, a rate and the limits of the joints."""

from pathlib import Path

import numpy as np
import pytest

from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.export import ExportError, export_run
from armwright.motion.corrected_line import NEAR
from armwright.program import Source, run
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.recording import Recording
from program.running import check_going_back, check_ticks, failure, printed, tool_positions
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
CELL = """
[arms.ARM_1]
model = "{arm}"
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 0.00, 0.25]
[inputs]
SEAM = {{ analogue = true, start = 0, timeline = {timeline} }}
"""
START = "UNITS MM ; VAR f, g : FRAME ; n : SCALAR ; BEGIN f = ARM_1 ; g = f * XYZ(0, -150, 0) ;"
SENSED = "WITH CORRECTION = ANALOG(seam), WITH BOUND = 10, WITH RATE = 25"
# The tool points down and the line leads along y: its side is x.
FROM = np.array([0.40, 0.00, 0.25])


def cell(folder: Path, timeline: str = "[[0.3, 6.0], [1.0, -4.0]]", arm: str = "ur5") -> Cell:
    """A cell with an arm, and a sensor that gives these numbers."""
    path = folder / "cell.toml"
    path.write_text(CELL.format(arm=arm, timeline=timeline), encoding="utf-8")
    return read_cell(path)


def ran(text: str, cell: Cell) -> Recording:
    """The run of statements behind those that note where the arm is, and a goal beside it."""
    return run(Source("seam.rlo", f"{START} {text} END."), cell)


@pytest.mark.share(0.05)
def test_random_sensors(tmp_path: Path, sample: Sample) -> None:
    """Whatever the sensor says, the path is within bound, rate and limits, and comes to what it says."""
    for random in sample.cases(30):
        times = np.cumsum(random.uniform(0.1, 0.9, 4)).round(3)
        values = random.uniform(-10, 10, 4).round(2)
        rate = float(random.uniform(5, 60))
        timeline = [[float(t), float(v)] for t, v in zip(times, values, strict=True)]
        arm = ["ur5", "puma560"][sample.case % 2]
        clauses = f"WITH CORRECTION = ANALOG(seam), WITH BOUND = 10, WITH RATE = {rate:.2f}"
        speed = f"WITH VELOCITY = {random.uniform(30, 90):.1f}"
        recording = ran(f"MOVE ARM_1 TO g STRAIGHTLY, {speed}, {clauses} ;", cell(tmp_path, str(timeline), arm))

        check_ticks(recording)
        x, _, z = (tool_positions(recording) - FROM).T
        period, t = recording.cell.period, recording.streams[0].t
        assert np.abs(z).max() <= NEAR + 1e-5
        assert np.abs(x).max() <= (np.abs(values).max() + 0.01) * 1e-3
        assert np.abs(np.diff(x)).max() / period <= rate * 1e-3 * 1.01 + 1e-4
        # It comes to what the sensor says, as fast as rate, ramps and the average allow.
        for begin, end, value in zip(times, [*times[1:], t[-1]], values, strict=True):
            way = abs(value * 1e-3 - x[min(round(begin / period), len(x) - 1)])
            settled = begin + way / (rate * 1e-3) + {"ur5": 0.5, "puma560": 2.0}[arm]
            assert np.abs(x[(t > settled) & (t < end)] - value * 1e-3).max(initial=0.0) <= 2e-5
    sample.record("sensors", sample.count(30), 0)


def test_where_it_ends(tmp_path: Path) -> None:
    """At the end the tool is at the goal, beside it by the correction; the clock went on as long as it took."""
    recording = ran(f"MOVE ARM_1 TO g STRAIGHTLY, {SENSED} ; PRINT(X(ARM_1) - X(g), DIST(ARM_1, g)) ;", cell(tmp_path))

    assert printed(recording) == ["6 6"] or printed(recording) == ["-4 4"]
    (stage,) = recording.stages
    assert stage.stage.kind == "SENSED"
    assert stage.motion.duration == pytest.approx(recording.duration, abs=1e-9)
    (move,) = (effect for effect in recording.effects if effect.kind == "MOVE")
    assert move.data["largest_correction"] >= 0.004
    check_ticks(recording)


def test_without_a_sensor(tmp_path: Path) -> None:
    """A correction of 0 is the line itself; what is worked out counts, with the units of the program."""
    straight = ran("MOVE ARM_1 TO g STRAIGHTLY, WITH CORRECTION = 0, WITH BOUND = 1, WITH RATE = 1 ;", cell(tmp_path))
    assert np.abs(tool_positions(straight)[:, 0] - 0.40).max() <= 1e-3

    clauses = "WITH CORRECTION = n + 2mm, WITH BOUND = 5.5, WITH RATE = 50"
    moved = ran(f"n = 3 ; MOVE ARM_1 TO g STRAIGHTLY, {clauses} ;", cell(tmp_path))
    assert tool_positions(moved)[-1] == pytest.approx([0.405, 0.15, 0.25], abs=1e-5)
    check_ticks(moved)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        (f"MOVE ARM_1 TO g STRAIGHTLY, WITH SPEED = 10, {SENSED.replace('10', '5')} ;", "E411", "6 mm, outside"),
        (f"MOVE ARM_1 TO g STRAIGHTLY, {SENSED.replace('25', '9000')} ;", "E412", "cannot follow the correction to 6"),
        (f"MOVE ARM_1 TO g STRAIGHTLY, {SENSED.replace('25', '1e-9')} ;", "E412", "would take 6e+09 s"),
        (f"MOVE ARM_1 TO f * XYZ(0, 0, -50) STRAIGHTLY, {SENSED} ;", "E412", "has no side"),
        (f"MOVE ARM_1 TO f STRAIGHTLY, {SENSED} ;", "E412", "has no side"),
        (
            f"WHEN TIME > 0.5 DO BEGIN BRAKE ; RESUME END ; MOVE ARM_1 TO g STRAIGHTLY, WITH VELOCITY = 80, {SENSED} ;",
            "E412",
            "cannot be resumed",
        ),
    ],
)
def test_what_cannot_be_followed(tmp_path: Path, text: str, code: str, says: str) -> None:
    """Each is an error of motion, after which the arm is at rest within its limits."""
    error = failure(f"{START} {text} END.", cell(tmp_path))

    assert error.diagnostic.code == code
    assert says in error.diagnostic.message
    assert error.recording is not None
    recording = error.recording()
    check_ticks(recording)
    assert np.abs(recording.streams[0].qd[-1]).max() <= 1e-6
    for stage in recording.stages:
        assert np.abs(stage.motion(stage.motion.duration, 1)).max() <= 1e-6
    recovered = ran(f"TRY {text} RECOVER (MOTION) n = 1 END ; PRINT(n) ; MOVE ARM_1 TO g ;", cell(tmp_path))
    assert printed(recovered) == ["1"]


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    "text",
    [
        f"MOVE ARM_1 TO g STRAIGHTLY, WITH SPEED = 30, {SENSED}, ON X(ARM_1) > 403 DO HALT ; PRINT(X(ARM_1) < 404) ;",
        f"WHEN TIME > 0.5 DO BRAKE ; MOVE ARM_1 TO g STRAIGHTLY, WITH VELOCITY = 80, {SENSED} ; PRINT(TRUE) ;",
        f"WHEN TIME > 0.5 DO PAUSE 0.2 ; MOVE ARM_1 TO g STRAIGHTLY, WITH VELOCITY = 80, {SENSED} ; PRINT(TRUE) ;",
        f"MOVE ARM_1 TO g STRAIGHTLY, WITH DURATION = 2, {SENSED} ; PRINT(ABS(TIME - 2) < 0.1) ;",
        f"g = f ; AFFIX g TO ARM_1 ; MOVE g TO f * XYZ(0, 100, 0) STRAIGHTLY, {SENSED} ; PRINT(TRUE) ;",
    ],
)
def test_with_other_clauses(tmp_path: Path, text: str) -> None:
    """Guards, interrupts, durations and moved frames go with a correction; limits are kept."""
    recording = ran(text, cell(tmp_path))

    assert printed(recording) == ["true"]
    check_ticks(recording)
    assert np.abs(recording.streams[0].qd[-1]).max() <= 1e-6


def test_a_guard_ends_it(tmp_path: Path) -> None:
    """Behind the HALT of a guard the arm brakes and stands, whatever the sensor says from then on."""
    clauses = "WITH CORRECTION = 8 * TIME, WITH BOUND = 20, WITH RATE = 25, ON X(ARM_1) > 403 DO HALT"
    recording = ran(f"MOVE ARM_1 TO g STRAIGHTLY, WITH SPEED = 10, {clauses} ; PAUSE 1 ;", cell(tmp_path))

    (move,) = (effect for effect in recording.effects if effect.kind == "MOVE")
    x, period = tool_positions(recording)[:, 0], recording.cell.period
    crossed = int((x > 0.403).argmax()) * period
    assert crossed <= move.t1 <= crossed + 0.2
    assert np.ptp(x[round(move.t1 / period) :]) <= 1e-9
    check_ticks(recording)


def test_going_back(tmp_path: Path) -> None:
    """A copy of a machine in the middle of a corrected path goes on as the machine itself does."""
    here = cell(tmp_path)
    check_going_back(f"{START} MOVE ARM_1 TO g STRAIGHTLY, {SENSED} ; END.", here, lambda machine: machine.now >= 0.35)


def test_names_and_variables(tmp_path: Path) -> None:
    """The words are none elsewhere: variables of these names come first."""
    text = """UNITS MM ; VAR correction, bound, rate : SCALAR ;
      BEGIN rate = 3 ; bound = rate ; correction = bound ; PRINT(correction) END."""

    assert printed(run(Source("t.rlo", text), cell(tmp_path))) == ["3"]


def test_exports_refuse_it(tmp_path: Path) -> None:
    """A planned motion does not know what the sensor will say, and says so with the line."""
    recording = ran(f"MOVE ARM_1 TO g STRAIGHTLY, {SENSED} ;", cell(tmp_path))

    with pytest.raises(ExportError, match="the path is corrected by a sensor"):
        export_run("csv", recording, "seam")


def test_tools() -> None:
    """The words are offered where no other way is told, explained, and written in upper case."""
    clauses = "straightly, with correction = 1, with bound = 2, with rate = 3"
    text = f"VAR f : FRAME ; BEGIN f = ARM_1 ; MOVE ARM_1 TO f {clauses} ; END."
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))

    for word, says in (("correction", "beside its line"), ("bound", "at most"), ("rate", "in a second")):
        shown = hover(analysis, text.index(word), markdown=False)
        assert shown is not None
        assert says in str(shown.contents)
    assert "WITH CORRECTION = 1" in formatted(Source("t.rlo", text))
    for written, is_offered in (("MOVE ARM_1 TO f STRAIGHTLY, ", True), ("MOVE ARM_1 TO f VIA (f), ", False)):
        begun = text[: text.index("MOVE")] + written
        labels = [item.label for item in completions(PositionCodec(begun), analysis, len(begun), snippets=False)]
        assert ("WITH CORRECTION" in labels) is is_offered


def test_the_example() -> None:
    """The seam is followed, and lost on the way back."""
    recording = run(EXAMPLES / "seam_tracking.rlo", EXAMPLES / "seam_cell.toml")

    first, second = printed(recording)
    assert first == "welded, at the end -4 beside the line"
    assert "is 30 mm, outside of its bound" in second
    check_ticks(recording)
