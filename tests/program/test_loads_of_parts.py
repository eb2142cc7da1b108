"""Parts in the hand count in the efforts of a plan: against the equation of motion of the part alone."""

from pathlib import Path

import attrs
import numpy as np
from scipy.spatial.transform import Rotation

import armwright.program
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.loads import loaded_arm
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.dynamics import deflection, inverse_dynamics, links_at_rest, with_gears
from armwright.kinematics import forward, jacobian, jacobian_rate
from armwright.motion import ModeShaping, ninth
from armwright.program import Source, run
from armwright.program.vm.interpreter import motion_warnings
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import inertia
from samples import Sample

CELL = Path(armwright.program.__file__).parent / "diagnostics" / "pages" / "cells" / "parts.toml"
TAKE = """UNITS MM ; VAR weight, above, start : FRAME ; BEGIN
 start = ARM_1 ;
 READ VISIONS (weight) ; above = weight * XYZ(0, 0, -100) ;
 OPEN ARM_1 ; MOVE ARM_1 TO weight WITH APPROACH = above ; GRASP ; AFFIX weight TO ARM_1 ;
"""


def cell_of_parts(effort: float | None = None, *, knows: bool = True) -> Cell:
    """A cell with a weight of 5.6 kg; joint 2 of its arm may have another limit of effort."""
    cell = read_cell(CELL)
    placed = cell.arms["ARM_1"]
    placed = attrs.evolve(placed, servo=attrs.evolve(placed.servo, knows_parts=knows))
    if effort is not None:
        joints = [*placed.arm.joints]
        joints[1] = attrs.evolve(joints[1], limits=attrs.evolve(joints[1].limits, effort=effort))
        placed = attrs.evolve(placed, arm=attrs.evolve(placed.arm, joints=joints))
    return attrs.evolve(cell, arms={"ARM_1": placed})


def ran(motion: str, cell: Cell | None = None) -> Recording:
    return run(Source("test.rlo", f"{TAKE} {motion} END."), cell or cell_of_parts())


def load_efforts(arm: Arm, cell: Cell, part: str, X_HP: Array, state: tuple[Array, Array, Array]) -> Array:
    """What a part asks of the joints, by the laws of Newton and Euler for the part alone, and virtual work."""
    q, qd, qdd = state
    J, body = jacobian(arm, q), cell.parts[part]
    v, a = J @ qd, J @ qdd + jacobian_rate(arm, q, qd) @ qd
    R = forward(arm, q)[:3, :3]
    r, w, alpha = R @ X_HP[:3, 3], v[3:], a[3:]
    force = body.mass * (a[:3] + np.cross(alpha, r) + np.cross(w, np.cross(w, r)) - arm.gravity)
    R_P = R @ X_HP[:3, :3]
    tensor = R_P @ (body.mass * inertia(body.shape)) @ R_P.T
    moment = tensor @ alpha + np.cross(w, tensor @ w) + np.cross(r, force)
    return J.T @ np.concatenate([force, moment])


def test_against_the_part_alone(sample: Sample) -> None:
    """The efforts of the loaded arm are those of the arm and of the part, at random states and poses in the hand."""
    cell, worst, failures = cell_of_parts(), 0.0, 0
    arm = cell.arms["ARM_1"].arm
    for rng in sample.cases(500):
        X_HP = homogeneous(Rotation.random(random_state=rng).as_matrix(), rng.uniform(-0.1, 0.1, 3))
        state = rng.uniform(-1, 1, arm.n), rng.uniform(-2, 2, arm.n), rng.uniform(-5, 5, arm.n)
        part = rng.choice(["BLOCK", "WEIGHT", "POST"])
        loaded = inverse_dynamics(loaded_arm(cell, "ARM_1", [(part, X_HP)]), *state)
        expected = inverse_dynamics(arm, *state) + load_efforts(arm, cell, part, X_HP, state)
        error = float(np.abs(loaded - expected).max())
        worst, failures = max(worst, error), failures + (error > 1e-9 * (1 + np.abs(expected).max()))
    sample.record("efforts of an arm with a part", sample.count(500), failures, worst_N_m=worst)

    assert not failures


def test_recorded_efforts() -> None:
    """What is recorded has the part from when it is taken until it is let go, at rest and on the way."""
    recording = ran("MOVE ARM_1 TO above STRAIGHTLY ; PAUSE 0.2 ; MOVE ARM_1 TO weight STRAIGHTLY ; OPEN ARM_1 ;")
    cell, (stream,) = recording.cell, recording.streams
    arm = cell.arms["ARM_1"].arm
    track, held_at_rest = recording.observations.parts["WEIGHT"], 0

    for tick in np.linspace(0, len(stream.t) - 1, 80).astype(int).tolist():
        holder, X_HP = track.at(float(stream.t[tick]))
        state = stream.q[tick], stream.qd[tick], stream.qdd[tick]
        expected = inverse_dynamics(arm, *state)
        if holder is not None:
            expected = expected + load_efforts(arm, cell, "WEIGHT", X_HP, state)
        if not state[1].any():
            np.testing.assert_allclose(stream.tau[tick], expected, rtol=0, atol=1e-6)
            held_at_rest += holder is not None
    assert held_at_rest
    assert not stream.qd[-1].any()
    without = inverse_dynamics(arm, stream.q[-1], stream.qd[-1], stream.qdd[-1])
    np.testing.assert_allclose(stream.tau[-1], without, rtol=0, atol=1e-6)


def test_a_line_is_slowed_for_the_load() -> None:
    """Where the part asks too much of a motor, the line is run so slowly that it does not."""
    lift = "MOVE ARM_1 TO above STRAIGHTLY, WITH SPEED = 120 ;"
    free, weak = ran(lift), ran(lift, cell_of_parts(57.0))
    stage = weak.stages[-1]

    assert free.stages[-1].peak_effort[1] > 57.0
    assert "effort of joint 2" in stage.stage.slowed
    assert stage.motion.duration > free.stages[-1].motion.duration
    X_HP = weak.observations.parts["WEIGHT"].poses[-1]
    loaded = loaded_arm(weak.cell, "ARM_1", [("WEIGHT", X_HP)])
    t = np.random.default_rng(5).uniform(0, stage.motion.duration, 300)
    tau = inverse_dynamics(loaded, *(stage.motion(t, order) for order in range(3)))
    assert np.abs(tau[:, 1]).max() <= 57.0 * (1 + 1e-6)
    assert motion_warnings(weak.stages, weak.cell) == ()


def test_a_motion_of_the_joints_is_warned_of() -> None:
    """The efforts of a point-to-point motion count the part too, and are told where they are too large."""
    cell = cell_of_parts(40.0)
    there = "MOVE ARM_1 TO above STRAIGHTLY ; MOVE ARM_1 TO start WITH SPEED = 120 ;"
    empty = TAKE.replace("GRASP ; AFFIX weight TO ARM_1 ;", "")
    loaded, free = ran(there, cell), run(Source("test.rlo", f"{empty} {there} END."), cell)
    (warning,) = motion_warnings(loaded.stages[-1:], cell)

    assert warning.code == "W401"
    assert motion_warnings(free.stages[-1:], cell) == ()


def test_a_controller_that_knows_nothing_of_parts() -> None:
    """What a controller does not know it does not plan with."""
    lift = "MOVE ARM_1 TO above STRAIGHTLY ;"
    knowing, ignorant = (ran(lift, cell_of_parts(knows=knows)).stages[-1].peak_effort[1] for knows in (True, False))

    assert knowing > ignorant + 20


def test_frequencies_of_a_loaded_arm() -> None:
    """A MOVE SMOOTHLY is shaped for the lower frequencies that the arm has with the part in its hand."""
    slowest = []
    for knows in (True, False):
        cell = cell_of_parts(knows=knows)
        placed = cell.arms["ARM_1"]
        springs = attrs.evolve(placed, arm=with_gears(placed.arm, [2e4, 2e4, *[np.inf] * 4]))
        shaping = (
            ran("MOVE weight TO above SMOOTHLY ;", attrs.evolve(cell, arms={"ARM_1": springs})).stages[-1].stage.shaping
        )
        assert shaping is not None
        slowest.append(shaping.frequencies)

    assert (slowest[0] < 0.95 * slowest[1]).all()


def test_flat_feedforward_of_a_loaded_arm() -> None:
    """A MOVE SMOOTHLY by flat feedforward has the weight and the inertia of the part in the hand."""
    cell = cell_of_parts()
    placed = cell.arms["ARM_1"]
    arm = with_gears(placed.arm, [2e4, 2e4, *[np.inf] * 4])
    springs = attrs.evolve(placed, arm=arm, smooth=ModeShaping(kind="flat"))
    recording = ran("MOVE weight TO above SMOOTHLY ;", attrs.evolve(cell, arms={"ARM_1": springs}))
    motors, X_HP = recording.stages[-1].motion, recording.observations.parts["WEIGHT"].poses[-1]
    loaded = loaded_arm(recording.cell, "ARM_1", [("WEIGHT", X_HP)])
    start, end = (links_at_rest(loaded, motors(t)) for t in (0.0, motors.duration))
    links, t = ninth(start, end, motors.duration), np.linspace(0, motors.duration, 50)
    states = [links(t, order) for order in range(3)]

    np.testing.assert_allclose(motors(t), states[0] - deflection(loaded, *states), atol=1e-9)
    assert np.abs(motors(t) - states[0] + deflection(arm, *states)).max() > 1e-4
