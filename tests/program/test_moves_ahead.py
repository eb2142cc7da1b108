"""MOVEs that go over into the next one: their path, what may come between them, and what ends them."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.kinematics import forward
from armwright.program.debugger.debugger import Command, Debugger
from armwright.program.vm.recording import Recording
from program.running import cell_of, code_of, failure, printed, run
from samples import Sample

FRAMES = """VAR f, g, h, part : FRAME ; n : SCALAR ; ready : EVENT ;
PROCEDURE go_on (place : FRAME) ; BEGIN MOVE ARM_1 TO place STRAIGHTLY, WITH BLEND = 0.03 END ;
BEGIN
 f = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.15,0.20) ;
 g = (1,0,0, 0,-1,0, 0,0,-1, 0.50, 0.00,0.20) ;
 h = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
 n = 0 ;
 MOVE ARM_1 TO f ;
"""
G, H = np.array([0.5, 0.0, 0.2]), np.array([0.4, 0.15, 0.2])


def ran(motion: str) -> Recording:
    return run(f"{FRAMES} {motion} END.")


def kinds(recording: Recording) -> list[str]:
    return [stage.stage.kind for stage in recording.stages[1:]]


def tool(recording: Recording, number: int = -1) -> Array:
    """Positions of the tool on a stage."""
    stage, placed = recording.stages[number], recording.cell.arms["ARM_1"]
    return (placed.base @ forward(placed.arm, stage.motion(np.linspace(0, stage.motion.duration, 2000))))[:, :3, 3]


def test_path_is_that_of_a_via() -> None:
    """Two MOVEs are the same motion as one with VIA and the same BLEND, to the last bit."""
    two = ran("MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.03 ; MOVE ARM_1 TO h STRAIGHTLY ;")
    one = ran("MOVE ARM_1 TO h VIA (g), WITH BLEND = 0.03 ;")

    assert kinds(two) == kinds(one) == ["BLEND"]
    np.testing.assert_array_equal(two.stages[-1].motion.coefficients, one.stages[-1].motion.coefficients)
    np.testing.assert_array_equal(two.stages[-1].motion.times, one.stages[-1].motion.times)
    assert "BLEND g h @100" in two.trace()[-1]


def test_each_corner_has_its_distance() -> None:
    """A wider corner is passed farther off; the tool does not stop, and is on the legs elsewhere."""
    text = """MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.01 ; MOVE ARM_1 TO h STRAIGHTLY, WITH BLEND = 0.05 ;
    MOVE ARM_1 TO h * XYZ(0.1, 0, 0) STRAIGHTLY ;"""
    recording = ran(text)
    p = tool(recording)
    at_g, at_h = (np.linalg.norm(p - corner, axis=1).min() for corner in (G, H))

    assert 0 < at_g < 0.01
    assert 3 * at_g < at_h < 0.05
    speeds = np.linalg.norm(np.diff(p, axis=0), axis=1)
    assert speeds[200:-200].min() > 0.05 * speeds.max()
    leg = G - p[0]
    along = (p - p[0]) @ leg / (leg @ leg)
    on_first = along < 1 - 0.012 / np.linalg.norm(leg)
    first = p[: int(np.argmin(on_first))]
    assert np.linalg.norm(np.cross(first - p[0], leg / np.linalg.norm(leg)), axis=1).max() < 1e-3


@pytest.mark.parametrize(
    "between",
    [
        "",
        "n = X(g) * 2 ; IF n > 0.5 THEN g = f ;",
        "WHILE n < 3 DO n = n + 1 ;",
        "FOR n = 1 TO 3 DO part = h * XYZ(0, 0, n) ;",
    ],
)
def test_what_is_done_at_once(between: str) -> None:
    """Values are worked out between two MOVEs without a stop."""
    motion = f"MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ; {between} MOVE ARM_1 TO h STRAIGHTLY ;"

    assert kinds(ran(motion)) == ["BLEND"]


def test_across_calls_and_loops() -> None:
    """The next MOVE may be in a procedure, or in the next pass of a loop."""
    recording = ran("go_on(g) ; FOR n = 1 TO 2 DO BEGIN go_on(h) ; go_on(f) END ; MOVE ARM_1 TO g STRAIGHTLY ;")

    assert kinds(recording) == ["BLEND"]
    assert len(recording.stages[-1].goal_names) == 6
    np.testing.assert_allclose(recording.tree.world("ARM_1")[:3, 3], G, atol=1e-6)


@pytest.mark.parametrize(
    "between",
    [
        "PAUSE 0.1 ;",
        'PRINT("here", X(ARM_1)) ;',
        "n = TIME ;",
        "OPEN ARM_1 ;",
        "AFFIX part TO ARM_1 AT XYZ(0, 0, 0.1) ;",
        "SIGNAL ready ;",
        "TRY n = 1 RECOVER n = 2 END ;",
        "READ SYSTEM (ARM_1) ;",
        "IF FORCE(Z) < 5 THEN n = 1 ;",
        "COBEGIN BEGIN n = 1 END ; BEGIN f = g END COEND ;",
    ],
)
def test_what_stops_the_arm(between: str) -> None:
    """Before all else the arm stops exactly at the goal."""
    recording = ran(f"MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ; {between} MOVE ARM_1 TO h STRAIGHTLY ;")

    assert kinds(recording) == ["LINE", "LINE"]
    assert np.linalg.norm(tool(recording, 1)[-1] - G) < 1e-6


@pytest.mark.parametrize(
    "following",
    [
        "MOVE ARM_1 TO h ;",
        "MOVE ARM_1 TO h STRAIGHTLY, WITH SPEED = 50 ;",
        "MOVE ARM_1 TO h STRAIGHTLY, WITH VELOCITY = 0.1 ;",
        "MOVE ARM_1 TO h STRAIGHTLY, WITH DURATION = 3 ;",
        "MOVE ARM_1 TO h STRAIGHTLY, ON n > 3 DO HALT ;",
        "MOVE ARM_1 TO h VIA (f) ;",
        "",
    ],
)
def test_another_kind_of_move(following: str) -> None:
    """Where the next MOVE is of another kind, or there is none, the arm stops exactly at the goal."""
    recording = ran(f"MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ; {following}")

    assert kinds(recording)[0] == "LINE"
    assert np.linalg.norm(tool(recording, 1)[-1] - G) < 1e-6


def test_the_arm_counts_as_being_there() -> None:
    """A relative MOVE goes on from the goal; what is printed afterwards is where the arm is."""
    recording = ran("""MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ; n = X(ARM_1) ;
    MOVE ARM_1 TO ARM_1 * XYZ(-0.1, 0, 0) STRAIGHTLY ; PRINT(n, X(ARM_1)) ;""")

    assert kinds(recording) == ["BLEND"]
    assert printed(recording) == ["0.5 0.4"]


def test_many_moves() -> None:
    """After fifty MOVEs the arm stops, so that an endless loop of them is run too."""
    text = "FOR n = 1 TO 60 DO MOVE ARM_1 TO f * XYZ(0, -0.002 * n, 0) STRAIGHTLY, WITH BLEND = 0.001 ;"
    recording = ran(text)

    assert [len(stage.goal_names) for stage in recording.stages[1:]] == [50, 10]


def test_one_that_is_infeasible() -> None:
    """None is begun where one of them is out of reach; a TRY around all of them goes on from where the arm is."""
    text = "MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ; MOVE ARM_1 TO h * XYZ(3, 0, 0) STRAIGHTLY ;"
    error = failure(f"{FRAMES} {text} END.")
    assert error.diagnostic.code in ("E401", "E402")
    assert "h * XYZ(3, 0, 0)" in error.diagnostic.message

    recording = ran(f"TRY {text} RECOVER PRINT(X(ARM_1), Y(ARM_1)) END ;")
    assert printed(recording) == ["0.4 -0.15"]


def test_another_branch_fails() -> None:
    """Where an error ends the branch before the MOVE has begun, the frame table has the arm where it is."""
    text = """TRY COBEGIN BEGIN MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ; n = 1 / n END ;
    BEGIN PAUSE 5 END COEND RECOVER PRINT(X(ARM_1)) END ;"""

    assert printed(ran(text)) == ["0.4"]


def test_limits(sample: Sample) -> None:
    """Random polygons: the joints keep their limits at random times, and the arm ends at the last goal."""
    failures = 0
    for rng in sample.cases(30):
        offsets = rng.uniform(-0.06, 0.06, (4, 3))
        moves = " ; ".join(
            f"MOVE ARM_1 TO f * XYZ({x:.4f}, {y:.4f}, {z:.4f}) STRAIGHTLY, WITH BLEND = {rng.uniform(0.002, 0.05):.4f}"
            for x, y, z in offsets.tolist()
        )
        recording = ran(f"{moves} ;")
        stage, limits = recording.stages[-1], recording.cell.arms["ARM_1"].arm.limits
        t = rng.uniform(0, stage.motion.duration, 300)
        q, qd, qdd = (stage.motion(t, order) for order in range(3))
        failures += not (
            (q >= limits.lower).all()
            and (q <= limits.upper).all()
            and (np.abs(qd) <= limits.speed * (1 + 1e-9)).all()
            and (np.abs(qdd) <= limits.acceleration * (1 + 1e-9)).all()
            and len(recording.stages) == 2
        )
    sample.record("MOVEs that go over into one another, limits at 300 random times", sample.count(30), failures)

    assert not failures


def test_in_the_debugger() -> None:
    """A step over a MOVE that waits takes no time; it is shown; and a step back takes it back."""
    cell = cell_of("cell1")
    text = """MOVE ARM_1 TO g STRAIGHTLY, WITH BLEND = 0.02 ;
    n = 7 ;
    MOVE ARM_1 TO h STRAIGHTLY ;
    PRINT(n) ;"""
    debugger = Debugger(code_of(f"{FRAMES}{text} END.", cell), cell)
    debugger.begin()
    debugger.run_slice()
    place = FRAMES.count("\n") + 1

    def step(command: Command) -> int:
        debugger.resume(command)
        debugger.run_slice()
        return debugger.code.source.line(debugger.stack()[0].span.start)

    while step("next") != place:
        pass
    begun = debugger.time
    assert step("next") == place + 1
    assert debugger.time == begun
    assert "g" in [one.value for scope in debugger.scopes((), 0) for one in scope.children() if "wait" in one.name]
    assert step("next") == place + 2
    assert debugger.time == begun
    assert step("next") == place + 3
    assert debugger.time > begun + 0.5
    assert [step("back") for _ in range(3)] == [place + 2, place + 1, place]
    assert debugger.time == begun
    assert debugger.machine.state.program.ahead is None


# ---- of the joints -------------------------------------------------------------------------------------------------


def test_joints_go_over() -> None:
    """MOVEs of the joints go over into one another: straight from configuration to configuration, off only near f."""
    two = ran("MOVE ARM_1 TO g WITH BLEND = 0.03 ; n = 2 ; MOVE ARM_1 TO h ;")
    there = ran("MOVE ARM_1 TO g ; MOVE ARM_1 TO h ;")
    (stage,) = two.stages[1:]
    q = stage.motion(np.linspace(0, stage.motion.duration, 4000))
    corner = there.stages[1].motion(there.stages[1].motion.duration)
    start, end = q[0], there.stages[2].motion(there.stages[2].motion.duration)

    assert stage.stage.kind == "PTP"
    assert stage.goal_names == ("g", "h")
    np.testing.assert_allclose(q[-1], end, atol=1e-9)
    off = [np.linalg.norm(line_offsets(q, a, b), axis=1) for a, b in ((start, corner), (corner, end))]
    away = np.linalg.norm(tool(two) - G, axis=1)
    q_of_tool = stage.motion(np.linspace(0, stage.motion.duration, 2000))
    near = np.minimum(
        *(np.linalg.norm(line_offsets(q_of_tool, a, b), axis=1) for a, b in ((start, corner), (corner, end)))
    )
    assert near[away > 0.0301].max() < 1e-9
    assert 1e-4 < away.min() < 0.03
    assert min(each.min() for each in off) < 1e-9
    assert np.linalg.norm(stage.motion(stage.motion.duration / 2, 1)) > 0.1
    assert stage.motion.duration < sum(each.motion.duration for each in there.stages[1:])


def line_offsets(q: Array, a: Array, b: Array) -> Array:
    """How far configurations are from the straight leg between two others."""
    part = np.clip((q - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return q - (a + part[:, None] * (b - a))


def test_joint_positions_go_over() -> None:
    """JOINTS may be passed too, and the configuration that they ask for is kept."""
    recording = ran("""MOVE ARM_1 TO JOINTS(20, -70, 0.45, 0, 50, 0) WITH BLEND = 0.02 ;
    MOVE ARM_1 TO g DIRECTLY, WITH BLEND = 0.02 ; MOVE ARM_1 TO JOINTS(-20, -60, 0.4, 0, 60, 10) ;""")
    (stage,) = recording.stages[1:]

    assert len(stage.goal_names) == 3
    expected = np.array([*np.radians([-20, -60]), 0.4, *np.radians([0, 60, 10])])
    np.testing.assert_allclose(recording.configurations["ARM_1"], expected, atol=1e-9)


@pytest.mark.parametrize("following", ["PAUSE 1 ; MOVE ARM_1 TO h ;", "MOVE ARM_1 TO h STRAIGHTLY ;", ""])
def test_joints_stop(following: str) -> None:
    """Before anything else the arm stops at the goal."""
    recording = ran(f"MOVE ARM_1 TO g WITH BLEND = 0.02 ; {following}")

    assert kinds(recording)[0] == "PTP"
    assert recording.stages[1].goal_names == ("g",)
    assert np.linalg.norm(tool(recording, 1)[-1] - G) < 1e-9


def test_joints_beyond_their_limits() -> None:
    """A configuration on the way that passes a limit is told, by the MOVE that asks for it."""
    text = "MOVE ARM_1 TO JOINTS(0, -60, 30, 0, 60, 0) WITH BLEND = 0.02 ; MOVE ARM_1 TO h ;"
    error = failure(f"{FRAMES} {text} END.")

    assert error.diagnostic.code == "E402"
    assert "JOINTS(0, -60, 30, 0, 60, 0)" in error.diagnostic.message


def test_limits_of_joints(sample: Sample) -> None:
    """Random MOVEs of the joints that go over into one another keep the limits at random times."""
    failures = 0
    for rng in sample.cases(30):
        offsets = rng.uniform(-0.08, 0.08, (4, 3))
        moves = " ; ".join(
            f"MOVE ARM_1 TO g * XYZ({x:.4f}, {y:.4f}, {z:.4f}) WITH SPEED = 120, WITH BLEND = {rng.uniform(0.002, 0.1)}"
            for x, y, z in offsets.tolist()
        )
        recording = ran(f"{moves} ;")
        stage, limits = recording.stages[-1], recording.cell.arms["ARM_1"].arm.limits
        t = rng.uniform(0, stage.motion.duration, 300)
        q, qd, qdd = (stage.motion(t, order) for order in range(3))
        failures += not (
            (q >= limits.lower).all()
            and (q <= limits.upper).all()
            and (np.abs(qd) <= limits.speed * (1 + 1e-9)).all()
            and (np.abs(qdd) <= limits.acceleration * (1 + 1e-9)).all()
            and len(stage.goal_names) == 4
        )
    sample.record("MOVEs of the joints that go over, limits at 300 random times", sample.count(30), failures)

    assert not failures
