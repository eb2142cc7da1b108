"""Guarded MOVEs without physics: what stands in a cell without a plane of contact yields like a spring."""

from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq

from armwright.arrays import Array
from armwright.cell.model import Cell, ContactPlane
from armwright.cell.scene import Fixture
from armwright.cell.simulator import Simulator
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import jacobian
from armwright.physics.hand_solids import gripper_solids
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.spatial.shapes import Box
from oracles.benches import ARMS, HOLD, STOPPING_SPEEDS, TABLE, bench, compiled, without_pictures
from oracles.solids import coal_distance, coal_shape, random_shape
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

STIFFNESS = 2e4
# A pin under the hand: half its height, and the half size of its top [m].
PIN = (0.02, 0.002)


def bare(folder: Path, arm: str = "stanford", *changes: tuple[str, str]) -> Cell:
    """A bench whose camera answers with what is true."""
    return without_pictures(bench(folder, arm, *changes))


def pressing(cell: Cell, x: float, y: float, z: float, then: str = "", **move: Any) -> tuple[Recording, Simulator]:
    """Run a program that moves the tool straight down to a height, until the table pushes with a force."""
    speed, force, before = move.get("speed", 10), move.get("force", 8), move.get("before", "")
    where = f"1,0,0, 0,-1,0, 0,0,-1, {x:.6f},{y:.6f}"
    condition = f"{move.get('on', 'FORCE(Z)')} > {force:.3f}"
    program = (
        "VAR obj, apo, low, up : FRAME ;\nBEGIN\n"
        f"{before}  up = ({where},{z + 0.03:.6f}) ; low = ({where},{z - 0.03:.6f}) ;\n"
        f"  MOVE ARM_1 TO up ;\n"
        f"  MOVE ARM_1 TO low STRAIGHTLY, WITH SPEED = {speed:.3f}, ON {condition} DO HALT ;\n"
        f"  PRINT(FORCE(X), FORCE(Y), FORCE(Z), TORQUE(X), TORQUE(Y), TORQUE(Z)) ;\n{then}END.\n"
    )
    hardware = kinematic_cell(cell)
    return interpret(compiled(cell, program).code, cell, hardware), hardware


def printed(recording: Recording) -> list[list[float]]:
    return [[float(it) for it in str(e.data["printed"]).split()] for e in recording.effects if e.kind == "PRINT"]


def tool_at_end(cell: Cell, recording: Recording) -> Array:
    """The pose of the tool where its arm comes to rest."""
    arm = cell.arms["ARM_1"]
    return np.asarray(arm.base @ forward(arm.arm, recording.streams[0].q[-1]))


def test_search_that_begins_beside_a_part(tmp_path: Path) -> None:
    """A guarded MOVE may meet the part at which the MOVE before it ended, also where its own end is far from it."""
    cell = bare(tmp_path, "puma560", ("force_N = 30", 'kind = "suction", force_N = 30'))
    x, y, z = cell.parts["BLOCK"].pose[:3, 3]
    recording = interpret(
        compiled(
            cell,
            "VAR up, low : FRAME ;\nBEGIN\n"
            f"  up = (1,0,0, 0,-1,0, 0,0,-1, {x:.6f},{y:.6f},{z + 0.03:.6f}) ; low = up * XYZ(0, 0, 0.073) ;\n"
            "  MOVE ARM_1 TO up ;\n"
            "  MOVE ARM_1 TO low STRAIGHTLY, WITH SPEED = 10, ON FORCE(Z) > 8 DO HALT ;\nEND.\n",
        ).code,
        cell,
        kinematic_cell(cell),
    )

    # Half a block above its centre.
    assert 0 < z + 0.02 - tool_at_end(cell, recording)[2, 3] < 2e-3


@pytest.mark.parametrize("arm", ["stanford", "puma560"])
def test_down_on_the_table(arm: str, sample: Sample, tmp_path: Path) -> None:
    """Fingers that come down on a table are pushed up with stiffness times depth; the guard acts at the first tick."""
    cell = bare(tmp_path, arm)
    low, high = ARMS[arm][2]
    for rng in sample.cases(30):
        x, y = rng.uniform(low, high)
        # Not on the block.
        y = min(y, cell.parts["BLOCK"].pose[1, 3] - 0.08)
        force = rng.uniform(2, 30)
        recording, hardware = pressing(cell, x, y, TABLE, speed=rng.uniform(*STOPPING_SPEEDS[arm]), force=force)

        placed, q = cell.arms["ARM_1"], recording.streams[0].q
        depths = TABLE - (placed.base @ forward(placed.arm, q))[:, 2, 3]
        halt = int(np.argmax(depths * STIFFNESS > force))
        read = printed(recording)[0]
        assert read[2] == pytest.approx(STIFFNESS * depths[-1], rel=1e-5)
        np.testing.assert_allclose([*read[:2], *read[3:]], 0, atol=1e-5)
        (move,) = [e for e in recording.effects if e.kind == "MOVE" and "halted" in e.text]
        assert move.data["contact"]["force"] == pytest.approx(STIFFNESS * depths.max(), rel=1e-5)
        # The braking begins at that tick, and ends within the limits of the arm.
        rest = recording.stages[-1]
        cut = round((rest.t0 + rest.motion.duration) / cell.period)
        assert halt < cut <= len(depths)
        assert hardware.contact_wrench("ARM_1", recording.duration)[2] == pytest.approx(read[2], rel=1e-5)


def test_the_time_of_contact(sample: Sample, tmp_path: Path) -> None:
    """The first contact of a motion is found to less than a nanosecond, at any speed."""
    cell = bare(tmp_path)
    placed = cell.arms["ARM_1"]
    for rng in sample.cases(30):
        recording, _ = pressing(cell, 0.45, rng.uniform(-0.2, -0.1), TABLE, speed=rng.uniform(2, 40), force=1)
        stage = recording.stages[-1]
        planned = stage.stage.trajectory

        def above(t: float, planned: Any = planned) -> float:
            return float((placed.base @ forward(placed.arm, planned(t)))[2, 3]) - TABLE

        hardware = kinematic_cell(cell)
        hardware._motions["ARM_1"] = attrs.evolve(hardware._motions["ARM_1"], trajectory=planned.until(0.0))
        hardware.start_motion("ARM_1", planned, 5.0, np.eye(4), guarded=True)
        touch = hardware.contact_time("ARM_1")

        assert touch is not None
        assert touch - 5.0 == pytest.approx(brentq(above, 0.0, planned.duration, xtol=1e-13), abs=1e-9)


def test_a_lever(tmp_path: Path, rng: np.random.Generator) -> None:
    """A held block that comes down on a pin beside its middle is turned by it: the moment is lever times force."""
    half, side = PIN
    for _ in range(3):
        dx, dy = rng.uniform(-0.015, 0.015, 2)
        x, y = 0.5, -0.1
        cell = bare(tmp_path)
        pin = Fixture(
            name="PIN",
            shape=Box(size=(2 * side, 2 * side, 2 * half)),
            pose=homogeneous(np.eye(3), (x + dx, y + dy, TABLE + half)),
            friction=0.5,
        )
        cell = attrs.evolve(cell, fixtures={**cell.fixtures, "PIN": pin})

        recording, _ = pressing(cell, x, y, TABLE + 2 * half + 0.02, before=HOLD, force=5)

        read = printed(recording)[0]
        depth = TABLE + 2 * half - (tool_at_end(cell, recording)[2, 3] - 0.02)
        assert read[2] == pytest.approx(STIFFNESS * depth, rel=1e-4)
        np.testing.assert_allclose(read[:2], 0, atol=1e-5)
        np.testing.assert_allclose(read[3:], np.cross((dx, dy, 0), (0, 0, read[2])), atol=1e-4)


def test_against_coal(sample: Sample, tmp_path: Path) -> None:
    """On tilted solids of any kind depth and normal are those that coal finds for the same fingers."""
    cell, seen = bare(tmp_path), 0
    placed = cell.arms["ARM_1"]
    assert placed.gripper is not None
    hand = [(coal_shape(it.shape), it.pose) for it in gripper_solids(placed.gripper, placed.gripper.opening)]
    for rng in sample.cases(40):
        shape = random_shape(rng)
        X = homogeneous(rotation_from_vector(rng.uniform(-1, 1, 3)), (0.5, -0.1, 0.12))
        solid = Fixture(name="ROCK", shape=shape, pose=X, friction=0.5)
        drawn = attrs.evolve(cell, fixtures={**cell.fixtures, "ROCK": solid}, parts={}, sights={}, markers={})
        other = coal_shape(shape)
        try:
            recording, _ = pressing(
                drawn, 0.5, -0.1, 0.28, speed=30, force=10, on="FORCE(X)*FORCE(X)+FORCE(Z)*FORCE(Z)"
            )
        except RunError:
            continue
        read = printed(recording)[0]
        T = tool_at_end(drawn, recording)

        def distance(T: Array, other: Any = other, X: Array = X) -> float:
            return min(coal_distance(own, T @ pose, other, X) for own, pose in hand)

        if not np.any(read):
            assert distance(T) > -1e-5
            continue
        depth, step = -distance(T), 1e-6
        force = np.array(read[:3])
        assert np.linalg.norm(force) == pytest.approx(STIFFNESS * depth, rel=1e-3, abs=0.1)
        gradient = [(distance(homogeneous(np.eye(3), step * axis) @ T) + depth) / step for axis in np.eye(3)]
        # At an edge of the solids the gradient has jumps.
        if abs(np.linalg.norm(gradient) - 1) < 1e-3:
            np.testing.assert_allclose(force / np.linalg.norm(force), gradient, atol=0.02)
            seen += 1
    sample.record("contacts with random solids, against coal", seen, 0)
    assert seen or not sample.whole


def test_efforts_of_pressing(tmp_path: Path) -> None:
    """The recorded efforts hold what the table pushes with, as the Jacobian of the tool has it."""
    cell = bare(tmp_path)
    recording, _ = pressing(cell, 0.45, -0.15, TABLE, "  PAUSE 0.2 ;\n", speed=20)
    arm, stream = cell.arms["ARM_1"].arm, recording.streams[0]
    force = np.array(printed(recording)[0])

    free = inverse_dynamics(arm, stream.q[-1], np.zeros(arm.n), np.zeros(arm.n))

    pushed = jacobian(arm, stream.q[-1]).T @ force
    assert np.abs(pushed).max() > 1
    np.testing.assert_allclose(stream.tau[-1], free - pushed, atol=1e-3)


def test_too_deep(tmp_path: Path) -> None:
    """A guard that does not end the motion in time is an error with the name of what is pressed on."""
    with pytest.raises(RunError) as caught:
        pressing(bare(tmp_path), 0.45, -0.15, TABLE, force=1e4)

    assert caught.value.diagnostic.code == "E404"
    assert caught.value.diagnostic.message == "`ARM_1` presses into TABLE deeper than 5 mm"


def test_without_a_guard(tmp_path: Path) -> None:
    """A MOVE into the table that no force ends is refused before it begins, as ever."""
    with pytest.raises(RunError) as caught:
        pressing(bare(tmp_path), 0.45, -0.15, TABLE, on="DIST(ARM_1, low) + 1000 * 0")

    assert caught.value.diagnostic.code == "E406"
    assert "TABLE" in caught.value.diagnostic.message


def test_away_again(tmp_path: Path) -> None:
    """The table pushes until the fingers have left it; ZERO FORCE counts from there; what is let go is not felt."""
    then = "  ZERO FORCE ARM_1 ;\n  PRINT(FORCE(Z)) ;\n  MOVE ARM_1 TO up STRAIGHTLY ;\n  PRINT(FORCE(Z)) ;\n"
    recording, _ = pressing(bare(tmp_path), 0.45, -0.15, TABLE, then)

    first, zeroed, away = printed(recording)
    assert first[2] > 8
    assert zeroed == [0]
    assert away == pytest.approx([-first[2]], rel=1e-5)

    held, released = printed(
        pressing(bare(tmp_path), 0.5, -0.1, TABLE + 0.02, "  OPEN ARM_1 ;\n  PRINT(FORCE(Z)) ;\n", before=HOLD)[0]
    )
    assert held[2] > 8
    assert released == [0]


def test_copies(tmp_path: Path) -> None:
    """A copy of a cell whose tool presses goes on alone: what becomes of one does not change the other."""
    cell = bare(tmp_path)
    recording, hardware = pressing(cell, 0.45, -0.15, TABLE)
    now, force = recording.duration, printed(recording)[0][2]
    other = hardware.copy()

    other.zero_force("ARM_1", now)

    assert hardware.contact_wrench("ARM_1", now)[2] == pytest.approx(force, rel=1e-5)
    assert other.contact_wrench("ARM_1", now)[2] == 0


def test_a_plane_comes_first(tmp_path: Path) -> None:
    """In a cell with a plane of contact that alone pushes, as it always did: same joint positions, same trace."""
    cell = attrs.evolve(bare(tmp_path), contact=ContactPlane(height=TABLE + 0.01))
    recording, _ = pressing(cell, 0.45, -0.15, TABLE)
    text = recording.code.source.text

    plain = interpret(compiled(cell, text).code, cell, Simulator(cell))

    np.testing.assert_array_equal(plain.streams[0].q, recording.streams[0].q)
    assert [(e.t0, e.t1, e.text) for e in plain.effects] == [(e.t0, e.t1, e.text) for e in recording.effects]
