"""What the sensor of forces between an arm and its tool reads, against weights, levers and springs."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.model import STANDARD_GRAVITY
from armwright.arrays import Array
from armwright.cell.control import ForceSensor
from armwright.cell.model import Cell, ContactPlane
from armwright.motion.quintic_polynomials import quintic
from armwright.physics.world import PhysicsCell
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.recording import Recording
from oracles.benches import PROGRAM, bench, compiled
from samples import Sample

# A weight at rest is read to this part of it.
PART = 0.01
MASS = 2.0
# The block of the bench is taken 12 mm from its middle.
ASIDE = np.array([0.012, 0.0, 0.0])
HELD = PROGRAM[: PROGRAM.index("  MOVE obj TO goal")]
LIFTED = HELD + "  MOVE ARM_1 TO stop WITH DEPARTURE = apo ;\n"


def carrying(folder: Path, *, known: bool) -> tuple[Cell, PhysicsCell, Recording]:
    """Return a world in which an arm holds a block of 2 kg beside its middle, known to its controller or not."""
    gripper = "gripper = { force_N = 30 }\n"
    cell = bench(
        folder,
        "stanford",
        ("mass_kg = 0.2", f"mass_kg = {MASS:g}"),
        (gripper, "gripper = { force_N = 80 }\n" + f"servo = {{ knows_parts = {str(known).lower()} }}\n"),
    )
    block = cell.parts["BLOCK"]
    grasp = block.grasp.copy()
    grasp[:3, 3] += ASIDE
    sights = {
        name: attrs.evolve(
            sight, camera=None, relation=grasp if (sight.kind, sight.name) == ("part", "BLOCK") else sight.relation
        )
        for name, sight in cell.sights.items()
    }
    cell = attrs.evolve(
        cell, cameras={}, sights=sights, parts={**cell.parts, "BLOCK": attrs.evolve(block, grasp=grasp)}
    )
    world = PhysicsCell(cell)
    recording = interpret(compiled(cell, LIFTED + "END.\n").code, cell, world)
    return cell, world, recording


def lever(world: PhysicsCell, cell: Cell, now: float) -> Array:
    """Return where the middle of the block is from the tool point, along the axes of the world."""
    from armwright.kinematics.forward_kinematics import forward

    arm = cell.arms["ARM_1"]
    X_WT = arm.base @ forward(arm.arm, world.configuration("ARM_1", now))
    return np.asarray(world.true_pose("BLOCK")[:3, 3] - X_WT[:3, 3])


@pytest.mark.parametrize("known", [False, True])
def test_a_weight_at_a_lever(sample: Sample, tmp_path: Path, *, known: bool) -> None:
    """A part in the hand that is not known is read as its weight and the moment of that; a known one is taken off."""
    cell, world, _ = carrying(tmp_path, known=known)
    arm, now = cell.arms["ARM_1"].arm, world.now
    weight, worst = np.array([0.0, 0.0, -MASS * STANDARD_GRAVITY]), 0.0
    home = world.sent_configuration("ARM_1", now)
    for rng in sample.cases(20):
        q = world.sent_configuration("ARM_1", now)
        goal = np.clip(
            home + rng.uniform(-0.15, 0.15, arm.n) * (1, 1, 0.3, 1, 1, 1), arm.limits.lower, arm.limits.upper
        )
        world.start_motion("ARM_1", quintic(q, goal, 1.5), now, np.eye(4))
        now += 2.5
        assert world.advance(now) is None
        truth = np.concatenate([weight, np.cross(lever(world, cell, now), weight)])
        assert np.linalg.norm(truth[3:]) > 0.1
        read = world.contact_wrench("ARM_1", now)
        off = (read if known else read - truth).reshape(2, 3) / (
            MASS * STANDARD_GRAVITY * np.array([[1.0], [np.linalg.norm(ASIDE)]])
        )
        worst = max(worst, float(np.abs(off).max()))
    sample.record(f"a weight at a lever, {'known' if known else 'unknown'}", 1, int(worst > PART), worst=worst)

    # A known part is where it is believed to be, to a fraction of a millimetre.
    assert worst < (5 * PART if known else PART)


def test_a_part_that_is_heavier_than_known(tmp_path: Path) -> None:
    """Of a part whose mass is not that of the file, the difference is read."""
    cell, _, _ = carrying(tmp_path, known=True)
    block = attrs.evolve(cell.parts["BLOCK"], mass=1.2 * MASS)
    world = PhysicsCell(cell, parts={**cell.parts, "BLOCK": block})
    interpret(compiled(cell, LIFTED + "  PAUSE 0.5 ;\nEND.\n").code, cell, world)

    read = world.contact_wrench("ARM_1", world.now)

    np.testing.assert_allclose(read[:3], (0, 0, -0.2 * MASS * STANDARD_GRAVITY), atol=0.05)


def test_errors_of_the_sensor(tmp_path: Path, rng: np.random.Generator) -> None:
    """Forces and moments have noise and constant errors of their own, and one reading in each period of the sensor."""
    gripper = "gripper = { force_N = 30 }\n"
    cell = bench(
        tmp_path,
        "stanford",
        (gripper, gripper + "force = { rate_hz = 100, noise_N = 1, bias_N = 0.5, noise_Nm = 0.1, bias_Nm = -0.2 }\n"),
    )
    world = PhysicsCell(attrs.evolve(cell, cameras={}), seed=int(rng.integers(1000)))
    readings = []
    for tick in range(1, 2001):
        world.advance(tick * cell.period)
        readings.append(world.contact_wrench("ARM_1", tick * cell.period))
    read = np.array(readings)

    changes = np.flatnonzero(np.diff(read[:, 2])) + 2
    assert (np.diff(changes) == 10).all()
    np.testing.assert_array_equal(np.flatnonzero(np.diff(read[:, 4])) + 2, changes)
    # Five standard errors of 600 numbers.
    np.testing.assert_allclose(read[:, :3].mean(), 0.5, atol=5 / np.sqrt(600))
    np.testing.assert_allclose(read[:, 3:].mean(), -0.2, atol=0.5 / np.sqrt(600))
    np.testing.assert_allclose(read[::10, :3].std(), 1.0, rtol=5 / np.sqrt(1200))
    np.testing.assert_allclose(read[::10, 3:].std(), 0.1, rtol=5 / np.sqrt(1200))
    silent = attrs.evolve(cell.arms["ARM_1"], force_sensor=ForceSensor())
    quiet = PhysicsCell(attrs.evolve(cell, cameras={}, arms={"ARM_1": silent}))
    quiet.advance(0.5)
    np.testing.assert_allclose(quiet.contact_wrench("ARM_1", 0.5), np.zeros(6), atol=0.02)


def test_zero_force(tmp_path: Path) -> None:
    """After ZERO FORCE the sensor reads changes: a held part weighs nothing, and upwards once it is let go."""
    program = (
        "  PRINT(FORCE(Z), TORQUE(X)) ;\n  ZERO FORCE ARM_1 ;\n  PRINT(FORCE(Z), TORQUE(X)) ;\n"
        "  OPEN ARM_1 ;\n  PAUSE 0.5 ;\n  PRINT(FORCE(Z), TORQUE(X)) ;\n  ZERO FORCE ARM_1 ;\n  PRINT(FORCE(Z)) ;\n"
    )
    cell, _, _ = carrying(tmp_path, known=False)

    recording = interpret(compiled(cell, LIFTED + "  PAUSE 0.5 ;\n" + program + "END.\n").code, cell, PhysicsCell(cell))

    printed = [[float(it) for it in str(e.data["printed"]).split()] for e in recording.effects if e.kind == "PRINT"]
    held, zeroed, released, again = printed
    assert held[0] == pytest.approx(-MASS * STANDARD_GRAVITY, rel=PART)
    np.testing.assert_allclose(zeroed, 0, atol=1e-9)
    assert released[0] == pytest.approx(MASS * STANDARD_GRAVITY, rel=PART)
    assert released[1] == pytest.approx(-held[1], abs=0.01)
    np.testing.assert_allclose(again, 0, atol=1e-9)
    zero = next(e for e in recording.effects if e.kind == "ZERO")
    assert zero.text == "ZERO FORCE ARM_1"
    assert zero.data["force"][2] == pytest.approx(held[0], abs=1e-4)
    assert zero.data["torque"][0] == pytest.approx(held[1], abs=1e-4)


def test_the_plane_is_a_spring(sample: Sample, tmp_path: Path) -> None:
    """At rest the plane of contact pushes with its stiffness times its depth, which is what the sensor reads."""
    bare = bench(tmp_path, "stanford")
    for rng in sample.cases(10):
        stiffness, aim = rng.uniform(5e3, 4e4), rng.uniform(0.5e-3, 3e-3)
        height = rng.uniform(0.05, 0.15)
        plane = ContactPlane(height=height, stiffness=stiffness, max_depth=0.02)
        cell = attrs.evolve(bare, cameras={}, sights={}, fixtures={}, parts={}, markers={}, contact=plane)
        world = PhysicsCell(cell)
        where = f"1,0,0, 0,-1,0, 0,0,-1, {rng.uniform(0.4, 0.5):.4f},{rng.uniform(-0.1, 0.1):.4f}"
        program = (
            f"VAR low, up : FRAME ; BEGIN up = ({where},{height + 0.02:.6f}) ; low = ({where},{height - aim:.6f}) ;\n"
            "MOVE ARM_1 TO up ;\n"
            "MOVE ARM_1 TO low STRAIGHTLY, WITH SPEED = 10, ON FORCE(Z) > 1000 DO HALT ; PAUSE 2 END."
        )

        interpret(compiled(cell, program).code, cell, world)

        read = world.contact_wrench("ARM_1", world.now)
        depth = world.peak_contact("ARM_1", world.now).depth
        assert depth > 0.2 * aim
        assert read[2] == pytest.approx(stiffness * world._contacts.plate_depth(world._data), rel=0.02)
