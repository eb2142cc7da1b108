"""Programs at work: the conformance programs, what their motion looks like, and how they fail."""

from pathlib import Path

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.program import compile as compile_program, known_cell
from armwright.program.language.source import Source
from armwright.program.vm.interpreter import interpret, motion_warnings
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous

EXAMPLES = Path(__file__).parents[2] / "examples"
EXACT = 1e-6  # the corpus gives positions to this
DOWN = np.diag((1.0, -1.0, -1.0))


def run(text: str, cell: Cell | None = None) -> Recording:
    cell = cell or read_cell(EXAMPLES / "stanford_cell.toml")
    compiled = compile_program(Source("test.rlo", text), known_cell(cell))
    assert compiled.code is not None, [d.message for d in compiled.diagnostics]
    return interpret(compiled.code, cell, Simulator(cell))


def run_example(name: str, old: str = "", new: str = "") -> Recording:
    text = (EXAMPLES / f"{name}.rlo").read_text()
    assert old in text
    return run(text.replace(old, new) if old else text)


def down(x: float, y: float, z: float) -> Array:
    return homogeneous(DOWN, (x, y, z))


def expect(recording: Recording, **frames: Array) -> None:
    for name, X in frames.items():
        np.testing.assert_allclose(recording.tree.world(name), X, atol=EXACT, err_msg=name)


def test_stacking() -> None:
    """P01, the report's own program: object 1 ends on object 2, cut loose, and the arm at STOP."""
    recording = run_example("stacking")

    assert recording.trace() == [
        "READ VISIONS OBJ1",
        "READ VISIONS OBJ2",
        "ARM_1 MOVE: PTP OBJ1 @100",
        "ARM_1 OPEN",
        "ARM_1 GRASP",
        "AFFIX OBJ1 -> ARM_1",
        "ARM_1 [OBJ1] MOVE: PTP OBJ2 @100",
        "ARM_1 OPEN",
        "UNFIX OBJ1",
        "ARM_1 MOVE: PTP STOP @100",
    ]
    expect(recording, OBJ1=down(0.4, -0.15, 0.05), OBJ2=down(0.4, -0.15, 0.05), ARM_1=down(0.45, 0, 0.25))
    assert recording.tree.parent("OBJ1") == WORLD


def test_bench() -> None:
    """P02: the grasp implies the AFFIX; the approach point stays 0.10 above the object it hangs on."""
    recording = run_example("bench")

    assert recording.trace() == [
        "AFFIX obj1 -> station",
        "AFFIX apf1 -> obj1",
        "ARM_1 MOVE: PTP apf1; LINE obj1 @100",
        "ARM_1 GRASP",
        "ARM_1 [obj1] MOVE: PTP obj2 @100",
    ]
    goal = down(0.55, -0.1, 0.05)
    expect(recording, OBJ1=goal, OBJ2=goal, ARM_1=goal, APF1=down(0.55, -0.1, 0.15))
    assert recording.tree.parent("OBJ1") == "ARM_1"
    assert recording.tree.parent("APF1") == "OBJ1"


def test_twelve_moves() -> None:
    """P03: the twelve forms have the stages of the report, and f1 keeps its 0.04 below the hand."""
    recording = run_example("twelve_moves")

    moves = [line.split("MOVE: ")[1] for line in recording.trace() if "MOVE" in line]
    stages = [
        ("PTP f2", "PTP f3"),
        ("PTP ap2; LINE f2", "PTP ap3; LINE f3"),
        ("LINE ap3; PTP f2", "LINE ap2; PTP f3"),
        ("SPLINE v2 v1 ap2; LINE f2", "SPLINE v1 v2 ap3; LINE f3"),
        ("LINE ap3; SPLINE v2 v1 f2", "LINE ap2; SPLINE v1 v2 f3"),
        ("LINE f2", "LINE f3"),
    ]
    assert moves == [f"{text} @100" for pair in stages for text in pair]
    hand = [effect for effect in recording.effects if effect.kind == "MOVE"]
    for i, effect in enumerate(hand):
        tree = next(tree for time, tree in recording.trees if time >= effect.t1 - 1e-9)
        place, below = (down(0.45, 0.15, 0.06), 0.02) if i % 2 == 0 else (down(0.45, -0.15, 0.06), 0.02)
        np.testing.assert_allclose(tree.world("ARM_1"), place, atol=EXACT)
        assert tree.world("F1")[2, 3] == pytest.approx(below, abs=EXACT)
    expect(recording, F1=down(0.45, -0.15, 0.02), F3=down(0.45, -0.15, 0.02))


def test_portable_bench() -> None:
    """P04: moving and turning the bench is one line; everything on it goes along."""
    as_written = run_example("portable")
    moved = run_example(
        "portable",
        "station = (1,0,0, 0,1,0, 0,0,1, 0.45, 0, 0) ;",
        "station = (0,1,0, -1,0,0, 0,0,1, 0.50, 0.05, 0) ;",
    )

    place = down(0.45, -0.12, 0.05)
    expect(as_written, OBJ1=place, OBJ2=place, ARM_1=place, APF1=down(0.45, -0.12, 0.13))
    turned = homogeneous(np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]]), (0.62, 0.05, 0.05))
    expect(moved, OBJ1=turned, OBJ2=turned, ARM_1=turned)
    assert as_written.trace() == moved.trace()
    assert "ARM_1 MOVE: PTP apf1; LINE obj1 @100" in moved.trace()


@pytest.fixture(scope="module")
def twelve() -> Recording:
    return run_example("twelve_moves")


def test_positions_have_no_jump(twelve: Recording) -> None:
    """From tick to tick no joint moves farther than its largest speed allows."""
    (s,) = twelve.streams
    arm = twelve.cell.arms["ARM_1"].arm

    assert (np.abs(np.diff(s.q, axis=0)) <= arm.limits.speed * twelve.cell.period * (1 + 1e-9)).all()
    np.testing.assert_allclose(np.diff(s.t), twelve.cell.period, atol=1e-12)


def test_speed_is_the_derivative_of_position() -> None:
    """Central differences of the positions approach the speeds with the square of the servo period.

    Where the acceleration jumps, at the knots of the X-splines, the difference is only of first order; those ticks
    are left out, one in a hundred.
    """
    errors = []
    for period in (8e-3, 4e-3, 2e-3):
        import attrs

        cell = attrs.evolve(read_cell(EXAMPLES / "stanford_cell.toml"), period=period)
        (s,) = run((EXAMPLES / "bench.rlo").read_text(), cell).streams
        difference = (s.q[2:] - s.q[:-2]) / (2 * period)
        error = np.abs(difference - s.qd[1:-1]).max(axis=-1)
        errors.append(np.quantile(error, 0.95))

    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2, atol=0.3)


def test_acceleration_is_the_derivative_of_speed(twelve: Recording) -> None:
    """The same for accelerations: away from the knots, differences of the speeds are the accelerations."""
    (s,) = twelve.streams
    difference = (s.qd[2:] - s.qd[:-2]) / (2 * twelve.cell.period)
    error = np.abs(difference - s.qdd[1:-1]).max(axis=-1)

    assert np.quantile(error, 0.95) < 1e-3 * np.abs(s.qdd).max()


def test_rest_between_stages(twelve: Recording) -> None:
    """Every stage begins and ends at rest, and point to point also without acceleration."""
    for stage in twelve.stages:
        motion = stage.stage.trajectory
        ends = [0.0, motion.duration]
        np.testing.assert_allclose(motion(ends, 1), 0, atol=1e-9)
        if stage.stage.kind == "PTP":
            np.testing.assert_allclose(motion(ends, 2), 0, atol=1e-9)


def test_straight_lines_are_straight(twelve: Recording) -> None:
    """During a LINE every tick has the tool within the asked deviation of the line between its ends."""
    (s,) = twelve.streams
    arm = twelve.cell.arms["ARM_1"].arm
    lines = [stage for stage in twelve.stages if stage.stage.kind == "LINE"]
    assert len(lines) == 10
    for stage in lines:
        rows = (s.t >= stage.t0 - 1e-9) & (s.t <= stage.t1 + 1e-9)
        p = forward(arm, s.q[rows])[:, :3, 3]
        way = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
        assert np.linalg.norm(np.cross(p - p[0], way), axis=-1).max() <= twelve.cell.deviation


def test_no_joint_beyond_its_limits(twelve: Recording) -> None:
    """Positions, speeds and accelerations of every tick are inside the limits of the arm."""
    (s,) = twelve.streams
    arm = twelve.cell.arms["ARM_1"].arm

    assert ((s.q >= arm.limits.lower - 1e-9) & (s.q <= arm.limits.upper + 1e-9)).all()
    assert (np.abs(s.qd) <= arm.limits.speed * (1 + 1e-9)).all()
    assert (np.abs(s.qdd) <= arm.limits.acceleration * (1 + 1e-9)).all()


def test_efforts_are_the_inverse_dynamics_of_the_row(twelve: Recording) -> None:
    """Each row's efforts are those of its position, speed and acceleration."""
    (s,) = twelve.streams
    arm = twelve.cell.arms["ARM_1"].arm

    for k in range(0, len(s.t), 997):
        np.testing.assert_allclose(s.tau[k], inverse_dynamics(arm, s.q[k], s.qd[k], s.qdd[k]), rtol=1e-12, atol=1e-12)


def test_speed_in_proportion() -> None:
    """At speed 20 the hand is a fifth as fast on a straight line as at 100; but for its ramps that takes five times."""
    text = """VAR a, b : FRAME ; BEGIN
      a = (1,0,0, 0,-1,0, 0,0,-1, 0.50,-0.20, 0.10) ; b = (1,0,0, 0,-1,0, 0,0,-1, 0.50, 0.20, 0.10) ;
      MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY, WITH SPEED = 20 ; MOVE ARM_1 TO a STRAIGHTLY ; END."""

    recording = run(text)
    _, slow, fast = (stage.stage.trajectory for stage in recording.stages)

    arm = recording.cell.arms["ARM_1"].arm
    peaks = []
    for motion in (slow, fast):
        t = np.linspace(0.0, motion.duration, 4001)
        peaks.append(np.linalg.norm(np.diff(forward(arm, motion(t))[:, :3, 3], axis=0), axis=-1).max() / t[1])
    assert peaks[1] / peaks[0] == pytest.approx(5, rel=2e-3)
    assert 4.8 < slow.duration / fast.duration < 5


def test_speed_from_a_scalar() -> None:
    """A speed may be the value of a scalar."""
    text = """VAR n : SCALAR ; f : FRAME ; BEGIN
      n = 40 ; f = (1,0,0, 0,-1,0, 0,0,-1, 0.5, 0.1, 0.1) ; MOVE ARM_1 TO f WITH SPEED = n ; END."""

    assert run(text).stages[0].speed == 40


def test_two_runs_are_alike() -> None:
    """The same program in the same cell gives the same bits."""
    first, second = run_example("bench"), run_example("bench")

    np.testing.assert_array_equal(first.streams[0].tau, second.streams[0].tau)
    assert first.trace() == second.trace()


def _fails(text: str, cell: Cell | None = None) -> RunError:
    with pytest.raises(RunError) as caught:
        run(text, cell)
    return caught.value


def test_goal_out_of_limits() -> None:
    """A goal three metres away is refused with the frame, the joint and how far out."""
    error = _fails("VAR far : FRAME ; BEGIN far = (1,0,0,0,-1,0,0,0,-1,3,0,0.2) ; MOVE ARM_1 TO far ; END.")

    assert error.diagnostic.code == "E402"
    assert "`far` cannot be reached by ARM_1" in error.diagnostic.message
    assert "joint 3" in error.diagnostic.notes[0]
    assert "1878.9 mm beyond" in error.diagnostic.notes[0]
    assert error.diagnostic.secondary[0].text == "`far` got its pose here"


def test_goal_out_of_reach() -> None:
    """A goal on the base axis is nearer than the shoulder offset allows: out of reach, with the distance in mm."""
    error = _fails("VAR near : FRAME ; BEGIN near = (1,0,0,0,-1,0,0,0,-1,0,0,0.6) ; MOVE ARM_1 TO near ; END.")

    assert error.diagnostic.code == "E401"
    assert "153.7 mm out of reach" in error.diagnostic.notes[0]


def test_obstacle_on_a_line() -> None:
    """A straight line behind the base meets a limit on its way: the place on the way is told."""
    text = """VAR a, b : FRAME ; BEGIN
      a = (1,0,0, 0,-1,0, 0,0,-1, 0.3, 0.3, 0.1) ; b = (1,0,0, 0,-1,0, 0,0,-1, -0.3, -0.3, 0.1) ;
      MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY ; END."""

    error = _fails(text)

    assert error.diagnostic.code in ("E401", "E402", "E403")
    assert "% of the path" in error.diagnostic.notes[0]


def test_millimetres_for_metres() -> None:
    """A goal typed in millimetres gets the hint that lengths are metres."""
    error = _fails("VAR f : FRAME ; BEGIN f = (1,0,0,0,-1,0,0,0,-1,450,0,250) ; MOVE ARM_1 TO f STRAIGHTLY ; END.")

    assert error.diagnostic.helps == ("`f` is 514.8 m away: lengths in this program are metres",)


def test_moves_to_where_the_hand_is() -> None:
    """Going where one is, straight, by way of it or leaving through it, takes no time and is no error."""
    text = """VAR a, b : FRAME ; BEGIN
      a = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.1, 0.25) ; b = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.1, 0.25) ;
      MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY ; MOVE ARM_1 TO b ; MOVE ARM_1 TO b VIA (a, b) ;
      MOVE ARM_1 TO b WITH APPROACH = b, WITH DEPARTURE = a ; END."""

    recording = run(text)

    assert recording.duration == pytest.approx(recording.stages[0].t1)
    expect(recording, ARM_1=down(0.45, 0.1, 0.25))


def test_a_turn_on_the_spot() -> None:
    """A straight MOVE may only turn the hand."""
    text = """VAR a, b : FRAME ; BEGIN
      a = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.1, 0.25) ; b = (0,1,0, 1,0,0, 0,0,-1, 0.45, 0.1, 0.25) ;
      MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY ; END."""

    assert run(text).stages[1].stage.deviation < 1e-3


def test_blind_camera() -> None:
    """An object that the camera does not find stops the program with what it does find."""
    error = _fails("VAR obj9 : FRAME ; BEGIN READ VISIONS (obj9) ; END.")

    assert error.diagnostic.code == "R601"
    assert "found nothing for OBJ9" in error.diagnostic.message
    assert "OBJ1, OBJ2" in error.diagnostic.message


def test_tools_are_off_after_an_error() -> None:
    """A program that fails with a tool on leaves it off."""
    cell = read_cell(EXAMPLES / "stanford_cell.toml")
    hardware = Simulator(cell)
    text = "VAR far : FRAME ; BEGIN far = (1,0,0,0,-1,0,0,0,-1,3,0,0.2) ; OPERATE torch ; MOVE ARM_1 TO far ; END."
    compiled = compile_program(Source("t.rlo", text), known_cell(cell))
    assert compiled.code is not None

    with pytest.raises(RunError):
        interpret(compiled.code, cell, hardware)

    assert hardware.active_devices() == frozenset()


def test_tools_are_off_at_the_end() -> None:
    """The end of a program switches off what is still on, and says so."""
    recording = run("BEGIN OPERATE torch ; END.")

    assert recording.effects[-1].text == "END; torch OFF"


def test_effort_over_the_limit_is_a_warning() -> None:
    """An arm with a weak shoulder still runs, and the joint, the time and the amount are told."""
    import attrs

    cell = read_cell(EXAMPLES / "stanford_cell.toml")
    place = cell.arms["ARM_1"]
    joints = list(place.arm.joints)
    joints[1] = attrs.evolve(joints[1], limits=attrs.evolve(joints[1].limits, effort=1.0))
    weak = attrs.evolve(cell, arms={"ARM_1": attrs.evolve(place, arm=attrs.evolve(place.arm, joints=joints))})
    compiled = compile_program(Source("t.rlo", (EXAMPLES / "stacking.rlo").read_text()), known_cell(weak))
    assert compiled.code is not None

    found = motion_warnings(interpret(compiled.code, weak, Simulator(weak)).stages, weak)

    assert [one.code for one in found] == ["W401"] * 3  # one for each MOVE: joint 2 alone is weak
    assert "joint 2 of ARM_1 would need" in found[0].message
    assert "more than its 1 N m" in found[0].message
    assert " s, in PTP to OBJ1" in found[0].label


def test_reading_the_joints() -> None:
    """READ SYSTEM gives the hand the pose that the joints say it has."""
    text = "VAR f : FRAME ; BEGIN f = (1,0,0,0,-1,0,0,0,-1,0.5,0.1,0.1) ; MOVE ARM_1 TO f ; READ SYSTEM (ARM_1) ; END."
    recording = run(text)

    expect(recording, ARM_1=down(0.5, 0.1, 0.1))
    assert "READ SYSTEM ARM_1" in recording.trace()


def test_object_in_the_hand_moves_as_the_hand() -> None:
    """MOVE of an object that hangs on another that hangs on the arm reaches its goal through both relations."""
    text = """VAR tool, tip, f : FRAME ; t : TRANS ; BEGIN
      t = (0,1,0, -1,0,0, 0,0,1, 0.02, 0, 0.05) ; f = (1,0,0, 0,-1,0, 0,0,-1, 0.5, 0.1, 0.1) ;
      AFFIX tool TO ARM_1 AT t ; AFFIX tip TO tool AT t ; MOVE tip TO f STRAIGHTLY ; END."""

    expect(run(text), TIP=down(0.5, 0.1, 0.1))
