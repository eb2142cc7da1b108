"""QUEUE and PUT: frames that extend the path of an arm while it moves."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.export import ExportError, export_run
from armwright.motion.frame_queue import NEAR
from armwright.physics.world import PhysicsCell
from armwright.program import Limits, Source, compile as translate, known_cell, run
from armwright.program.debugger.snapshot import StackFrame
from armwright.program.debugger.variables import scopes
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.interpreter import advance, next_process
from armwright.program.vm.machine import Machine
from armwright.program.vm.recording import Recording
from program.running import check_going_back, check_ticks, code_of, failure, printed, tool_positions
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
CELL = """
[arms.ARM_1]
model = "ur5"
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 0.00, 0.25]
"""
WALL = """
[scene]
boxes = [{ name = "WALL", size_mm = [400, 20, 600], at = [1,0,0, 0,1,0, 0,0,1, 0.4,-0.2,0.3] }]
"""
START = """UNITS MM ; VAR f, g : FRAME ; n, m : SCALAR ; fed : EVENT ;
PROCEDURE feed(way : SCALAR) ; BEGIN PUT f * XYZ(0, way, 0) TO ARM_1 END ;
BEGIN f = ARM_1 ; """


def cell(folder: Path, more: str = "") -> Cell:
    """A cell with one arm, and what else there is."""
    path = folder / "cell.toml"
    path.write_text(CELL + more, encoding="utf-8")
    return read_cell(path)


@pytest.fixture
def ur5(tmp_path: Path) -> Cell:
    """A cell with a UR5."""
    return cell(tmp_path)


def ran(text: str, cell: Cell) -> Recording:
    """The run of statements behind those that note where the arm is."""
    return run(Source("queue.rlo", f"{START} {text} END."), cell)


def off_the_legs(recording: Recording, corners: Array) -> Array:
    """How far the tool is from straight legs between positions (k, 3), at every tick [m]."""
    p, off = tool_positions(recording), []
    for A, B in pairwise(corners):
        along = (B - A) / max(float((B - A) @ (B - A)), 1e-30)
        s = np.clip((p - A) @ along, 0.0, 1.0)
        off.append(np.linalg.norm(p - A - s[:, None] * (B - A), axis=1))
    return np.asarray(np.min(off, axis=0))


@pytest.mark.share(0.05)
def test_random_programs(ur5: Cell, sample: Sample) -> None:
    """Frames put at random times, into queues of any capacity: limits and path are kept, the end is the last frame."""
    for random in sample.cases(30):
        blend, capacity = float(random.uniform(3, 20)), int(random.integers(1, 6))
        steps, way = "", [np.zeros(3)]
        for _ in range(7):
            shift = random.uniform(-90, 90, 3).round(1)
            way.append(shift)
            pause = float(random.choice([0, 0.02, 0.3, 1.5]))
            place = f"f * XYZ({shift[0]}, {shift[1]}, {shift[2]})"
            steps += f"PUT {place} TO ARM_1 ; PAUSE {pause} ; PRINT(QUEUED(ARM_1) <= {capacity}) ;"
        clauses = f"WITH CAPACITY = {capacity}, WITH BLEND = {blend:.2f}, WITH SPEED = {random.uniform(20, 120):.1f}"
        recording = ran(f"QUEUE ARM_1 {clauses} DO BEGIN {steps} END ;", ur5)

        assert set(printed(recording)) == {"true"}
        check_ticks(recording)
        # The tool of the cell points down, so its y and z are reversed.
        corners = np.array([0.40, 0.00, 0.25]) + np.array(way) * (1e-3, -1e-3, -1e-3)
        assert off_the_legs(recording, corners).max() <= 3 / 8 * blend * 1e-3 + NEAR
        assert np.linalg.norm(tool_positions(recording)[-1] - corners[-1]) <= NEAR
        assert np.abs(recording.streams[0].qd[-1]).max() <= 1e-6
    sample.record("programs with queues", sample.count(30), 0)


def test_it_never_stops_while_it_is_fed(ur5: Cell) -> None:
    """A loop that fills the queue as fast as it empties lets the arm run without a stop."""
    loop = "FOR n = 1 TO 12 DO PUT f * XYZ(0, 90 * SIN(n * 40), 90 * COS(n * 40) - 90) TO ARM_1 ;"
    recording = ran(f"QUEUE ARM_1 WITH CAPACITY = 3, WITH BLEND = 15 DO {loop}", ur5)

    speed = np.linalg.norm(np.diff(tool_positions(recording), axis=0), axis=1) / recording.cell.period
    assert (speed[100:-100] > 0.05).all()
    (queue,) = (effect for effect in recording.effects if effect.kind == "QUEUE")
    assert queue.data["run_dry"] == 0
    assert queue.text == "ARM_1 QUEUE: 12 frames"
    check_ticks(recording)


def test_running_dry(ur5: Cell) -> None:
    """A queue run dry stands at its last frame, exactly, and goes on when another one comes."""
    recording = ran(
        """QUEUE ARM_1 DO BEGIN PUT f * XYZ(0, 60, 0) TO ARM_1 ; PAUSE 2 ; PRINT(QUEUED(ARM_1), DIST(ARM_1, f)) ;
        PUT f * XYZ(60, 60, 0) TO ARM_1 END ; PRINT(DIST(ARM_1, f * XYZ(60, 60, 0)) < 0.01) ;""",
        ur5,
    )

    assert printed(recording) == ["0 60", "true"]
    speed = np.abs(recording.streams[0].qd).max(axis=1)
    assert speed[round(1.9 / recording.cell.period)] == 0
    check_ticks(recording)


def test_a_full_queue_waits_or_refuses(ur5: Cell) -> None:
    """What is put waits until a frame is passed, and is where it was when the PUT began; ELSE refuses it at once."""
    recording = ran(
        """QUEUE ARM_1 WITH CAPACITY = 2 DO
        BEGIN
          FOR n = 1 TO 2 DO PUT f * XYZ(0, 40 * n, 0) TO ARM_1 ELSE PRINT("never") ;
          PUT f TO ARM_1 ELSE BEGIN PRINT("full", TIME) END ;
          PRINT(QUEUED(ARM_1), CAPACITY(ARM_1), Y(AWAITED(ARM_1, 1)), Y(AWAITED(ARM_1, 2))) ;
          g = f * XYZ(0, 120, 0) ;
          PUT g TO ARM_1 ;
          PRINT(TIME > 0.1, QUEUED(ARM_1), Y(AWAITED(ARM_1, 1)), Y(AWAITED(ARM_1, 2))) ;
        END ;
        PRINT(DIST(ARM_1, g) < 0.01) ;""",
        ur5,
    )

    assert printed(recording) == ["full 0", "2 2 -40 -80", "true 2 -80 -120", "true"]
    check_ticks(recording)


def test_the_order_of_processes(tmp_path: Path) -> None:
    """Branches that signal and put give the same motion in whatever order they stand."""
    feeder = "BEGIN FOR n = 1 TO 5 DO BEGIN WAIT fed ; feed(30 * n) END END"
    other = "BEGIN FOR m = 1 TO 5 DO BEGIN PAUSE 0.13 * m ; SIGNAL fed END END"
    idle = "BEGIN PAUSE 0.5 END"
    streams = [
        ran(f"QUEUE ARM_1 DO COBEGIN {' ; '.join(order)} COEND ;", cell(tmp_path)).streams[0].q
        for order in ((feeder, other, idle), (idle, other, feeder), (other, idle, feeder))
    ]

    assert np.array_equal(streams[0], streams[1])
    assert np.array_equal(streams[0], streams[2])


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("feed(3) ;", "E410", "has no open queue"),
        ("QUEUE ARM_1 DO BEGIN feed(30) ; feed(5000) END ;", "E401", "out of the reach"),
        ("n = 0 ; QUEUE ARM_1 WITH CAPACITY = n DO feed(3) ;", "E231", "CAPACITY 0 of a queue is not possible"),
        ("n = 2.5 ; QUEUE ARM_1 WITH CAPACITY = n DO feed(3) ;", "E231", "CAPACITY 2.5"),
        ("n = -1 ; QUEUE ARM_1 WITH BLEND = n DO feed(3) ;", "E231", "BLEND -1"),
        ("n = 130 + TIME ; QUEUE ARM_1 WITH SPEED = n DO feed(3) ;", "E207", "130"),
        ("QUEUE ARM_1 DO BEGIN feed(3) ; g = AWAITED(ARM_1, 2) END ;", "E222", "frame 2 of the queue of ARM_1"),
        ("g = f ; AFFIX g TO ARM_1 ; QUEUE ARM_1 DO BEGIN feed(60) ; MOVE g TO f END ;", "E410", "cannot make a MOVE"),
        ("QUEUE ARM_1 DO BEGIN feed(80) ; PAUSE 0.1 ; RAISE lost END ;", "E508", "lost"),
        (
            """QUEUE ARM_1 WITH CAPACITY = 1 DO
            BEGIN WHEN TIME > 0.1 DO BEGIN BRAKE ; feed(3) END ; feed(80) ; PAUSE 1 END ;""",
            "E410",
            "full, and braked",
        ),
    ],
)
def test_what_goes_wrong(ur5: Cell, text: str, code: str, says: str) -> None:
    """Each is an error, after which the arm is at rest within its limits, and the queue closed behind a RECOVER."""
    error = failure(f"{START} {text} END.", ur5)

    assert error.diagnostic.code == code
    assert says in error.diagnostic.message
    assert error.recording is not None
    recording = error.recording()
    check_ticks(recording)
    assert np.abs(recording.streams[0].qd[-1]).max() <= 1e-6
    recovered = ran(f"TRY {text} RECOVER n = 1 END ; MOVE ARM_1 TO f ; QUEUE ARM_1 DO feed(20) ;", ur5)
    check_ticks(recovered)
    assert recovered.failure is None


def test_an_error_inside_of_the_queue(ur5: Cell) -> None:
    """A RECOVER in the statement of QUEUE goes on with the queue, empty, from where the arm was stopped."""
    recording = ran(
        """QUEUE ARM_1 DO
        BEGIN
          feed(150) ; feed(160) ; PAUSE 0.2 ;
          TRY feed(5000) RECOVER (MOTION) PRINT(QUEUED(ARM_1)) END ;
          feed(0) ; PRINT(QUEUED(ARM_1)) ;
        END ;
        PRINT(DIST(ARM_1, f) < 0.01) ;""",
        ur5,
    )

    assert printed(recording) == ["0", "1", "true"]
    assert tool_positions(recording)[:, 1].min() > -0.15
    check_ticks(recording)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    "text",
    [
        "QUEUE ARM_1 DO BEGIN feed(100) ; PAUSE 0.1 ; HALT END ;",
        "QUEUE ARM_1 DO COBEGIN BEGIN feed(100) END ; BEGIN PAUSE 0.2 END COEND ;",
        "WHEN TIME > 0.2 DO feed(0) ; QUEUE ARM_1 DO BEGIN feed(100) ; feed(120) ; PAUSE 1 END ;",
        "QUEUE ARM_1 DO n = 1 ; QUEUE ARM_1 DO BEGIN feed(10) ; OPEN ARM_1 ; feed(20) END ; MOVE ARM_1 TO f ;",
        "QUEUE ARM_1 WITH VELOCITY = 50 DO BEGIN feed(30) ; feed(30) ; feed(30) END ;",
        "QUEUE ARM_1 DO WHILE QUEUED(ARM_1) < 3 DO BEGIN n = QUEUED(ARM_1) ; feed(20 * n + 20) END ;",
    ],
)
def test_what_ends_it(ur5: Cell, text: str) -> None:
    """Whatever ends a queue, the arm comes to rest within its limits."""
    recording = ran(text, ur5)

    assert recording.failure is None
    assert np.abs(recording.streams[0].qd[-1]).max() <= 1e-6
    check_ticks(recording)


LOOP = "FOR n = 1 TO 6 DO PUT f * XYZ(0, 60 * SIN(n * 60), 60 * COS(n * 60) - 60) TO ARM_1"


@pytest.mark.share(0.05)
def test_an_interrupt_brakes_and_resumes(ur5: Cell, sample: Sample) -> None:
    """BRAKE in the action of a WHEN stops the arm on its path at any tick, and RESUME lets it go on to the end."""
    free = ran(f"QUEUE ARM_1 WITH CAPACITY = 3, WITH BLEND = 10 DO {LOOP} ;", ur5)
    for random in sample.cases(20):
        time = float(random.uniform(0.0, free.duration))
        action = "BEGIN BRAKE ; PRINT(TIME) ; PAUSE 0.5 ; PRINT(TIME) ; RESUME END"
        body = f"BEGIN WHEN TIME > {time:.4f} DO {action} ; {LOOP} END"
        recording = ran(f"QUEUE ARM_1 WITH CAPACITY = 3, WITH BLEND = 10 DO {body} ;", ur5)
        stood, period = [float(line) for line in printed(recording)], recording.cell.period
        if stood:
            ticks = slice(round(stood[0] / period) + 1, round(stood[1] / period))
            assert np.abs(recording.streams[0].qd[ticks]).max() <= 1e-9
        check_ticks(recording)
        angles = np.radians(60 * np.arange(7))
        way = np.stack([0 * angles, 0.06 * np.sin(angles), 0.06 * np.cos(angles) - 0.06], axis=1)
        corners = np.array([0.40, 0.00, 0.25]) + way * (1, -1, -1)
        assert off_the_legs(recording, corners).max() <= 3 / 8 * 0.01 + NEAR
        assert np.linalg.norm(tool_positions(recording)[-1] - corners[-1]) <= NEAR
    sample.record("queues braked by interrupts", sample.count(20), 0)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("action", "line"),
    [
        ("BRAKE", "0 true"),
        ("BEGIN BRAKE ; feed(90) ; PRINT(QUEUED(ARM_1)) ; RESUME END", "3 0 true"),
        ("BEGIN BRAKE ; BRAKE ; RESUME ; RESUME END", "0 true"),
        ("BEGIN BRAKE ; TRY RAISE lost RECOVER RESUME END END", "0 true"),
    ],
)
def test_what_an_interrupt_leaves(ur5: Cell, action: str, line: str) -> None:
    """Without RESUME the queue is empty behind the action; frames may be put in between."""
    body = f"WHEN TIME > 0.1 DO {action} ; feed(60) ; feed(80) ; PAUSE 2 ; PRINT(QUEUED(ARM_1))"
    recording = ran(f"QUEUE ARM_1 DO BEGIN {body} END ; MOVE ARM_1 TO f ; PRINT(DIST(ARM_1, f) < 0.01) ;", ur5)

    assert " ".join(printed(recording)) == line
    check_ticks(recording)


def test_velocity(ur5: Cell) -> None:
    """VELOCITY is the speed of the tool on the legs."""
    recording = ran("QUEUE ARM_1 WITH VELOCITY = 80 DO BEGIN feed(100) ; feed(200) END ;", ur5)

    speed = np.linalg.norm(np.diff(tool_positions(recording), axis=0), axis=1) / recording.cell.period
    assert speed.max() == pytest.approx(0.08, rel=1e-3)


def test_bodies_in_the_way(tmp_path: Path) -> None:
    """A frame behind a body is refused, and what was put in before is run."""
    walled = cell(tmp_path, WALL)
    error = failure(f"{START} QUEUE ARM_1 DO BEGIN feed(50) ; feed(350) END ; END.", walled)

    assert error.diagnostic.code == "E406"
    assert "`f * XYZ(0, way, 0)`" in error.diagnostic.message
    assert ran("QUEUE ARM_1 DO BEGIN feed(50) ; feed(100) END ;", walled).failure is None


def test_with_physics(tmp_path: Path) -> None:
    """The servos of a simulated world follow a queue as closely as other motions."""
    text = f"{START} QUEUE ARM_1 WITH CAPACITY = 2 DO FOR n = 1 TO 4 DO feed(20 * n) ; END."
    recording = run(Source("queue.rlo", text), cell(tmp_path), hardware=PhysicsCell)

    (measured,) = recording.observations.measured
    q = recording.streams[0].q[: len(measured.t)]
    assert np.abs(measured.actual[: len(q)] - q).max() <= 5e-3


def test_going_back(ur5: Cell) -> None:
    """A copy of a machine in the middle of a queue goes on as the machine itself does."""
    text = f"{START} QUEUE ARM_1 WITH CAPACITY = 2 DO FOR n = 1 TO 5 DO feed(20 * n) ; END."
    check_going_back(text, ur5, lambda machine: machine.now >= 0.2)


def test_names_and_variables(ur5: Cell) -> None:
    """The words are none elsewhere: variables and procedures of these names come first."""
    text = """UNITS MM ; VAR queue, put, capacity : SCALAR ; PROCEDURE queued(n : SCALAR) ; BEGIN PRINT(n + 1) END ;
      BEGIN put = 3 ; queue = put ; capacity = queue ; queued(capacity) END."""

    assert printed(run(Source("t.rlo", text), ur5)) == ["4"]


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("COBEGIN BEGIN QUEUE ARM_1 DO feed(3) END ; BEGIN MOVE ARM_1 TO f END COEND ;", "E503"),
        ("QUEUE ARM_1 DO COBEGIN BEGIN PUT f TO ARM_1 END ; BEGIN PUT f TO ARM_1 END COEND ;", "E503"),
        ("QUEUE ARM_1 DO PUT g TO ARM_1 ;", "E304"),
        ("QUEUE ARM_1 WITH CAPACITY = n DO feed(3) ;", "E303"),
        ("QUEUE ARM_1 DO BEGIN WAIT fed ; SIGNAL fed END ;", "E501"),
    ],
)
def test_checks_before_the_run(ur5: Cell, text: str, code: str) -> None:
    """Ownership of arms, values and waits are checked through QUEUE and PUT."""
    compiled = translate(Source("t.rlo", f"{START} {text} END."), known_cell(ur5))

    assert code in {one.code for one in compiled.diagnostics}


def test_exports_refuse_it(ur5: Cell) -> None:
    """A planned motion knows its frames before, and says so with the line."""
    recording = ran("QUEUE ARM_1 DO feed(30) ;", ur5)

    with pytest.raises(ExportError, match="frames are put into the queue of an arm while it moves"):
        export_run("csv", recording, "queue")


def test_tools() -> None:
    """The words are offered, explained, and written in upper case."""
    before = "VAR f : FRAME ; BEGIN f = ARM_1 ; queue arm_1 with capacity = 3 do put f to arm_1"
    text = f"{before} ; END."
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))

    for word, says in (("queue", "without a stop"), ("capacity", "ahead of its arm"), ("put", "where that is full")):
        shown = hover(analysis, text.index(word), markdown=False)
        assert shown is not None
        assert says in str(shown.contents)
    assert "QUEUE ARM_1 WITH CAPACITY = 3 DO\n    PUT f TO ARM_1" in formatted(Source("t.rlo", text))
    begun = text[: text.index("with")]
    for written, label in (
        (begun, "WITH CAPACITY"),
        (f"{begun} WITH ", "CAPACITY"),
        (text[: text.index("queue")], "PUT"),
    ):
        labels = [item.label for item in completions(PositionCodec(written), analysis, len(written), snippets=False)]
        assert label in labels, (written, labels)


def test_the_debugger_shows_it(ur5: Cell) -> None:
    """Which frames are ahead is a line below the arm."""
    text = f"{START} QUEUE ARM_1 DO BEGIN feed(20) ; feed(40) ; PAUSE 0.06 ; PAUSE 1 END ; END."
    machine = Machine(code_of(text, ur5), ur5, Simulator(ur5))
    while machine.now < 0.05:
        advance(machine, next_process(machine))
    process = machine.state.program
    frame = StackFrame(process=process, title="program", span=Span(0, 0), activation=process.activation, procedure=None)
    arms = next(scope for scope in scopes(machine, frame) if scope.name == "Arms")
    assert arms.children is not None
    (arm,) = arms.children()
    assert arm.children is not None
    lines = {line.name: line.value for line in arm.children()}
    assert lines["queue"] == "2 of 8: f * XYZ(0, way, 0), f * XYZ(0, way, 0)"


def test_the_example() -> None:
    """The seam of the example is gone along, dry in between, and points are refused at its end."""
    recording = run(EXAMPLES / "seam.rlo", EXAMPLES / "ur5_cell.toml")

    lines = printed(recording)
    assert lines[12].endswith("s, true")
    assert lines[-1].endswith("2 points refused")
    check_ticks(recording)


def test_what_is_grasped_on_the_way(tmp_path: Path) -> None:
    """A part that fingers close on while their arm runs along a queue is looked at on the rest of the way."""
    held = """
tool = [1, 0, 0,  0, 1, 0,  0, 0, 1,   0.00, 0.00, 0.12]
[scene]
boxes = [{ name = "POST", size_mm = [20, 20, 600], at = [1,0,0, 0,1,0, 0,0,1, 0.49,-0.1,0.3] }]
[parts.BEAM]
size_mm = [200, 20, 20]
mass_kg = 0.5
at = [1, 0, 0,  0, 1, 0,  0, 0, 1,   0.40, 0.00, 0.25]
grasp = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0, 0, 0]
"""
    posted, way = cell(tmp_path, held), "PUT f * XYZ(0, 0, -40) TO ARM_1 ; PUT f * XYZ(0, 100, -40) TO ARM_1"
    error = failure(f"{START} QUEUE ARM_1 DO BEGIN {way} ; GRASP ARM_1 END ; END.", posted)

    assert error.diagnostic.code == "E406"
    assert "BEAM would hit POST" in error.diagnostic.message
    assert ran(f"QUEUE ARM_1 DO BEGIN {way} END ;", posted).failure is None


def test_a_queue_that_never_ends(ur5: Cell) -> None:
    """A queue that takes years is cut at the time limit of the run, and no more of it is computed."""
    error = failure(f"{START} QUEUE ARM_1 WITH VELOCITY = 1e-9 DO feed(3) ; END.", ur5, Limits(time=0.5))

    assert error.diagnostic.code == "E506"
