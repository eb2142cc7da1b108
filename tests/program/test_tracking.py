"""MOVEs to frames that move by themselves, as on a belt: the tool goes there, and on with them."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.export import ExportError, export_run
from armwright.kinematics import forward
from armwright.motion.limited import limited_positions
from armwright.physics.world import PhysicsCell
from armwright.program import Source, compile as translate, known_cell, run
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.recording import Recording
from program.running import check_going_back, failure, printed
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
BELT = """
[arms.ARM_1]
model = "{arm}"
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 0.00, 0.25]

[frames]
CLAMP = {{ at = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.02, 0.03, 0.00], on = "BELT" }}

[frames.BELT]
at = [0, 1, 0,  -1, 0, 0,  0, 0, 1,   0.45,-0.40, 0.10]
moves = {{ {moves} }}
"""
# A goal whose z is that of a tool from above.
DOWN = np.diag((1.0, -1.0, -1.0, 1.0))
COURSES = {
    "constant": "speed_mm_per_s = 90, window_mm = [100, 600]",
    "ramped": "speed_mm_per_s = 0, timeline = [[0.3, 60], [2.0, 150]], window_mm = [0, 550], ramp_s = 0.8",
    "stopping": "speed_mm_per_s = 160, timeline = [[2.2, 0], [3.4, 100]], window_mm = [0, 600], ramp_s = 0.3",
    "backwards": "speed_mm_per_s = -80, timeline = [[1.0, 120]], window_mm = [-200, 600]",
    "aslant": "speed_mm_per_s = 70, along = [1, 0.3, 0.2], window_mm = [0, 400]",
}
START = "UNITS MM ; VAR belt, part, far : FRAME ; n : SCALAR ; BEGIN part = belt * ROTX(180) ; AFFIX part TO belt ;"


def belt_cell(folder: Path, moves: str = COURSES["constant"], arm: str = "stanford") -> Cell:
    """A cell with a belt that moves so."""
    path = folder / "belt.toml"
    path.write_text(BELT.format(arm=arm, moves=moves), encoding="utf-8")
    return read_cell(path)


def ran(text: str, cell: Cell) -> Recording:
    """The run of statements behind those that put a part on the belt."""
    return run(Source("belt.rlo", f"{START} {text} END."), cell)


def off_the_goal(recording: Recording, q: Array, t: Array, X_FT: Array) -> Array:
    """How far the tool is, with joints at times, from a pose on the belt, (k,) [m], and its rotation, (k,)."""
    frame, placed = recording.cell.moving_frames["BELT"], recording.cell.arms["ARM_1"]
    X = placed.base @ forward(placed.arm, q)
    goals = np.array([frame.pose_at(float(time)) @ X_FT for time in t])
    return np.stack([np.linalg.norm((X - goals)[:, :3, 3], axis=1), np.abs(X - goals)[:, :3, :3].max(axis=(1, 2))])


def check_limits(recording: Recording) -> None:
    """Speeds and accelerations of all joints, and between ticks, keep the limits; speeds do not jump."""
    arm = recording.cell.arms["ARM_1"].arm
    for stage in recording.stages:
        t = np.linspace(0.0, stage.motion.duration, 5000)
        for order, limit in ((1, arm.all_limits.speed), (2, arm.all_limits.acceleration)):
            assert (np.abs(limited_positions(arm, stage.motion(t, order))) <= limit * (1 + 1e-6)).all(), order
        assert ((stage.motion(t) >= arm.limits.lower - 1e-9) & (stage.motion(t) <= arm.limits.upper + 1e-9)).all()
    (stream,) = recording.streams
    jumps = np.abs(np.diff(stream.qd, axis=0)) / recording.cell.period
    assert (jumps <= arm.limits.acceleration * (1 + 1e-2) + 1e-6).all()


@pytest.mark.parametrize("arm", ["stanford", "ur5"])
@pytest.mark.parametrize("course", COURSES)
def test_the_tool_is_at_the_frame(tmp_path: Path, course: str, arm: str) -> None:
    """From the end of the MOVE until the next one the tool is at its goal, within 1e-6 m, whatever the belt does."""
    cell = belt_cell(tmp_path, COURSES[course], arm)
    program = """MOVE ARM_1 TO part * XYZ(0, 0, -40) WITH TRACKING = belt ; PAUSE 0.2 ;
      MOVE ARM_1 TO part * ROTZ(30) WITH TRACKING = belt ; PAUSE 0.4 ;"""
    recording = ran(program, cell)

    (stream,) = recording.streams
    moves = [effect for effect in recording.effects if effect.kind == "MOVE"]
    pauses = [effect for effect in recording.effects if effect.kind == "PAUSE"]
    turned = DOWN @ np.block([[_turn(30), np.zeros((3, 1))], [np.zeros((1, 3)), 1.0]])
    raised = DOWN.copy()
    raised[2, 3] = 0.04
    for move, pause, goal in zip(moves, pauses, (raised, turned), strict=True):
        ticks = np.flatnonzero((stream.t >= move.t1 - 1e-9) & (stream.t <= pause.t1 - 1e-9))
        position, rotation = off_the_goal(recording, stream.q[ticks], stream.t[ticks], goal)
        assert len(ticks) > 100
        assert position.max() <= 1e-6
        assert rotation.max() <= 1e-5
    check_limits(recording)


def _turn(degrees: float) -> Array:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_random_belts(tmp_path: Path, sample: Sample) -> None:
    """Belts of any speed and timeline are tracked, or refused for a reason; limits are kept."""
    tracked = 0
    for random in sample.cases(40):
        speeds, times = random.uniform(-50, 220, 4), 0.2 + np.cumsum(random.uniform(0.7, 1.5, 3))
        changes = [[round(float(t), 3), round(float(v), 1)] for t, v in zip(times, speeds[1:], strict=True)]
        ramp = random.uniform(0.2, 0.6)
        moves = f"speed_mm_per_s = {speeds[0]:.1f}, timeline = {changes}, ramp_s = {ramp:.3f}, window_mm = [-100, 600]"
        cell = belt_cell(tmp_path, moves, ["stanford", "ur5"][sample.case % 2])
        text = "TRY MOVE ARM_1 TO part WITH TRACKING = belt ; PAUSE 0.3 ; RECOVER (MOTION) PRINT(MESSAGE) END ;"
        recording = ran(text, cell)
        if printed(recording):
            check_limits(recording)
            continue
        (stream,), end = recording.streams, recording.effects[-1].t1
        reached = next(effect.t1 for effect in recording.effects if effect.kind == "MOVE")
        ticks = np.flatnonzero((stream.t >= reached - 1e-9) & (stream.t <= reached + 0.3 - 1e-9))
        off = off_the_goal(recording, stream.q[ticks], stream.t[ticks], DOWN)[0]
        assert off.max() <= 1e-6
        assert end >= reached + 0.3
        check_limits(recording)
        tracked += 1
    sample.record("belts tracked", sample.count(40), 0, tracked=tracked)


@pytest.mark.parametrize("course", ["constant", "ramped", "stopping"])
def test_with_physics(tmp_path: Path, course: str) -> None:
    """The arm of a simulated world is within 0.5 mm of the frame while it follows it."""
    cell = belt_cell(tmp_path, COURSES[course], "ur5")
    text = f"{START} MOVE ARM_1 TO part WITH TRACKING = belt ; PAUSE 0.6 ; END."
    recording = run(Source("belt.rlo", text), cell, hardware=PhysicsCell)

    (measured,) = recording.observations.measured
    reached = next(effect.t1 for effect in recording.effects if effect.kind == "MOVE")
    ticks = np.flatnonzero((measured.t >= reached) & (measured.t <= reached + 0.6))
    off = off_the_goal(recording, measured.actual[ticks], measured.t[ticks], DOWN)[0]
    assert len(ticks) > 100
    assert off.max() <= 5e-4


def test_frames_go_with_the_belt(tmp_path: Path) -> None:
    """A frame on the belt is where the belt has come to: 90 mm/s along y, for frames of the cell too."""
    text = START.replace("n : SCALAR", "clamp : FRAME ; n : SCALAR")
    steps = "PAUSE 1.5 ; PRINT(X(part), Y(part), Z(part)) ; PAUSE 0.5 ; PRINT(X(clamp), Y(clamp)) ;"
    recording = run(Source("belt.rlo", f"{text} {steps} END."), belt_cell(tmp_path))

    assert printed(recording) == ["450 -265 100", "420 -200"]


def test_what_is_grasped_comes_along(tmp_path: Path) -> None:
    """A part that was grasped on the belt is held as it was there, and the frame of the belt is left behind."""
    recording = ran(
        """MOVE ARM_1 TO part WITH TRACKING = belt ; GRASP ARM_1 ; UNFIX part FROM belt ; AFFIX part TO ARM_1 ;
        MOVE part TO part * XYZ(0, 0, -50) WITH TRACKING = belt ; far = WORLD * XYZ(400, 100, 250) * ROTX(180) ;
        MOVE part TO far ; PRINT(DIST(ARM_1, part) < 0.001, DIST(part, far) < 0.001) ;""",
        belt_cell(tmp_path),
    )

    assert printed(recording) == ["true true"]
    kinds = [effect.kind for effect in recording.effects if effect.kind in ("MOVE", "STOP")]
    assert kinds == ["MOVE", "MOVE", "STOP", "MOVE"]
    check_limits(recording)


def test_implied_affix(tmp_path: Path) -> None:
    """A part that was grasped on the belt and not affixed hangs on the arm from its first MOVE on, as one at rest."""
    cell = belt_cell(tmp_path)
    text = f"""{START} MOVE ARM_1 TO part WITH TRACKING = belt ; GRASP ARM_1 ; UNFIX part FROM belt ;
      MOVE part TO part * XYZ(0, 0, -30) WITH TRACKING = belt ; PAUSE 0.2 ; PRINT(DIST(ARM_1, part)) ; END."""

    assert printed(run(Source("t.rlo", text), cell)) == ["0"]


def test_a_contact_on_the_way_is_refused(tmp_path: Path) -> None:
    """An arm that follows goes on when its next MOVE is refused, and stops within its limits."""
    cell = belt_cell(tmp_path)
    cell = attrs.evolve(cell, contact=attrs.evolve(cell.contact, height=0.08))
    recording = ran(
        """TRY MOVE ARM_1 TO part WITH TRACKING = belt ; MOVE ARM_1 TO part * XYZ(0, 0, 50) WITH TRACKING = belt ;
        RECOVER (MOTION) PRINT(MESSAGE) END ;""",
        cell,
    )

    assert "would enter the plane" in printed(recording)[0]
    check_limits(recording)


def test_the_end_of_the_window(tmp_path: Path) -> None:
    """An arm that follows to the end of the window stops within its limits, and RECOVER goes on from there."""
    cell = belt_cell(tmp_path)
    recording = ran(
        """TRY MOVE ARM_1 TO part WITH TRACKING = belt ; PAUSE 30 ; RECOVER (MOTION) PRINT(TIME, MESSAGE) END ;
        MOVE ARM_1 TO WORLD * XYZ(400, 0, 250) * ROTX(180) ;""",
        cell,
    )

    (line,) = printed(recording)
    stop = next(effect for effect in recording.effects if effect.kind == "STOP")
    # 600 mm at 90 mm/s.
    assert stop.t0 == pytest.approx(600 / 90, abs=cell.period)
    assert "`part` has left the window of `belt`" in line
    check_limits(recording)


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("MOVE ARM_1 TO part WITH TRACKING = belt ; WAIT UNTIL FALSE ;", "E408", "has left the window"),
        ("PAUSE 8 ; MOVE ARM_1 TO part WITH TRACKING = belt ;", "E408", "does not come into the window"),
        ("MOVE ARM_1 TO part * XYZ(0, 2000, 0) WITH TRACKING = belt ;", "E409", "cannot track"),
        ("MOVE ARM_1 TO part WITH TRACKING = belt, WITH DURATION = 0.2 ;", "E409", "cannot track"),
        ("PAUSE 6 ; MOVE ARM_1 TO part WITH TRACKING = belt, WITH SPEED = 10 ;", "E409", "cannot track"),
        (
            """WHEN TIME > 0.9 DO BEGIN BRAKE ; RESUME END ; MOVE ARM_1 TO part WITH TRACKING = belt ;""",
            "E409",
            "cannot be resumed",
        ),
    ],
)
def test_what_cannot_be_tracked(tmp_path: Path, text: str, code: str, says: str) -> None:
    """Each is an error of motion, after which all arms are at rest within their limits."""
    cell = belt_cell(tmp_path)
    error = failure(f"{START} {text} END.", cell)

    assert error.diagnostic.code == code
    assert says in error.diagnostic.message
    assert error.recording is not None
    check_limits(error.recording())
    assert ran(f"TRY {text} RECOVER (MOTION) n = 1 END ; PRINT(n) ;", cell).failure is None


def test_duration_and_waiting(tmp_path: Path) -> None:
    """A MOVE waits for the window, and takes the DURATION from there."""
    recording = ran("MOVE ARM_1 TO part WITH TRACKING = belt, WITH DURATION = 2 ;", belt_cell(tmp_path))

    reached = next(effect.t1 for effect in recording.effects if effect.kind == "MOVE")
    # The window begins at 100 mm, at 90 mm/s.
    assert reached == pytest.approx(100 / 90 + 2, abs=2e-3)
    still = recording.streams[0].qd[: round(1.0 / recording.cell.period)]
    assert np.abs(still).max() <= 1e-6


@pytest.mark.parametrize(
    "text",
    [
        "MOVE ARM_1 TO part WITH TRACKING = belt, ON Y(ARM_1) > -200 DO HALT ; PRINT(Y(ARM_1) < -100) ;",
        "COBEGIN BEGIN MOVE ARM_1 TO part WITH TRACKING = belt END COEND ; MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -20) ;",
        "WHEN TIME > 2.5 DO MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -30) ; MOVE ARM_1 TO part WITH TRACKING = belt ; PAUSE 2 ;",
        "MOVE ARM_1 TO part WITH TRACKING = belt ; MOVE ARM_1 TO part * XYZ(0, 0, -30) STRAIGHTLY, WITH BLEND = 5 ;",
        "MOVE ARM_1 TO part WITH TRACKING = belt ; TRY RAISE lost RECOVER PAUSE 0.1 END ; MOVE ARM_1 TO ARM_1 ;",
        "MOVE ARM_1 TO part WITH TRACKING = belt ; HALT ;",
    ],
)
def test_what_ends_following(tmp_path: Path, text: str) -> None:
    """A HALT, the end of a branch, an interrupt, another MOVE, an error and the end stop the arm within its limits."""
    recording = ran(text, belt_cell(tmp_path))

    assert recording.failure is None
    assert np.abs(recording.streams[0].qd[-1]).max() <= 1e-6
    check_limits(recording)


def test_going_back(tmp_path: Path) -> None:
    """A copy of a machine in the middle of following goes on as the machine itself does."""
    cell = belt_cell(tmp_path)
    text = f"{START} MOVE ARM_1 TO part WITH TRACKING = belt ; PAUSE 1 ; MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -20) ; END."
    check_going_back(text, cell, lambda machine: bool(machine.state.following))


def test_names_and_variables(tmp_path: Path) -> None:
    """The word is none elsewhere, and a local variable may be named as the belt."""
    text = """UNITS MM ; VAR tracking : SCALAR ; PROCEDURE p(belt : SCALAR) ; BEGIN PRINT(belt + 1) END ;
      BEGIN tracking = 3 ; p(tracking) ; END."""

    assert printed(run(Source("t.rlo", text), belt_cell(tmp_path))) == ["4"]


@pytest.mark.parametrize("statement", ["belt = WORLD ;", "AFFIX belt TO ARM_1 ;", "UNFIX belt ;"])
def test_the_belt_is_not_placed(tmp_path: Path, statement: str) -> None:
    """Who moves the belt is the cell: said before the run, and at run time where the cell was not known before."""
    cell = belt_cell(tmp_path)
    text = f"{START} TRY {statement} RECOVER (VALUE) PRINT(MESSAGE) END ; END."
    compiled = translate(Source("t.rlo", text), known_cell(cell))
    unknown = translate(Source("t.rlo", text), attrs.evolve(known_cell(cell), moving=None))

    assert "E249" in {one.code for one in compiled.diagnostics}
    assert unknown.code is not None
    assert "is moved by the cell" in printed(interpret(unknown.code, cell, Simulator(cell)))[0]


def test_exports_refuse_it(tmp_path: Path) -> None:
    """A planned motion cannot track, and says so with the line."""
    recording = ran("MOVE ARM_1 TO part WITH TRACKING = belt ;", belt_cell(tmp_path, arm="ur5"))

    with pytest.raises(ExportError, match="a frame that moves is tracked"):
        export_run("csv", recording, "belt")


def test_tools() -> None:
    """The word is offered where no other way is told, explained where it stands, and written in upper case."""
    before = "VAR f, g : FRAME ; BEGIN f = ARM_1 ; g = f ; MOVE ARM_1 TO f with tracking=g"
    text = f"{before} ; END."
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))

    shown = hover(analysis, text.index("tracking"), markdown=False)
    assert shown is not None
    assert "goes with a frame of the cell that moves" in str(shown.contents)
    assert "MOVE ARM_1 TO f WITH TRACKING = g" in formatted(Source("t.rlo", text))
    for written, is_offered in (("MOVE ARM_1 TO f ", True), ("MOVE ARM_1 TO f DIRECTLY, ", False)):
        begun = text[: text.index("MOVE")] + written
        labels = [item.label for item in completions(PositionCodec(begun), analysis, len(begun), snippets=False)]
        assert ("WITH TRACKING" in labels) is is_offered


def test_the_example() -> None:
    """Both cans of the example come from the belt onto the stand."""
    recording = run(EXAMPLES / "belt.rlo", EXAMPLES / "belt_cell.toml")

    assert [line.split(" is")[0] for line in printed(recording)] == ["can 1", "can 2"]
    assert all("on the stand" in line for line in printed(recording))
    for name, side in (("CAN_1", 0.62), ("CAN_2", 0.54)):
        track = recording.parts[name]
        assert track.carriers == ("BELT", "ARM_1", None)
        np.testing.assert_allclose(track.poses[-1][:3, 3], (0.10, side, 0.20), atol=1e-3)
    check_limits(recording)
