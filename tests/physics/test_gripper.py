"""Grippers that hold by friction, against Coulomb's law by hand."""

from typing import Any

import mujoco
import numpy as np
import pytest

from armwright.arm.model import STANDARD_GRAVITY
from armwright.cell.scene import Gripper
from armwright.physics.geoms import add_geom
from armwright.physics.gripper import GripperDrive, add_gripper, grip
from armwright.physics.plant import new_world
from armwright.spatial.shapes import Box, Shape, Solid, Sphere

DOWN = (0.0, 1.0, 0.0, 0.0)
SIDE = 0.04


def holding(
    gripper: Gripper, mass: float, shape: Shape | None = None, height: float = 0.5
) -> tuple[Any, Any, GripperDrive]:
    """A fixed gripper that points down and has closed on a block without weight."""
    spec = new_world(np.zeros(3), 1e-3)
    tool = spec.worldbody.add_body(name="A/tool", pos=(0, 0, 0.5), quat=DOWN)
    add_gripper(spec, "A", tool, gripper, contype=4, conaffinity=3)
    block = spec.worldbody.add_body(name="BLOCK", pos=(0, 0, height))
    block.add_freejoint()
    block.explicitinertial, block.mass, block.inertia = True, mass, (mass * SIDE**2 / 6,) * 3
    block.ipos = np.zeros(3)
    solid = Solid(shape=shape or Box(size=(SIDE,) * 3))
    options = {"contype": 2, "conaffinity": 7, "condim": 4, "friction": (0.8, 0.005, 1e-4)}
    add_geom(spec, block, "BLOCK", solid, mass=0.0, **options)
    grip(spec, "A", gripper, "BLOCK")
    model = spec.compile()
    data = mujoco.MjData(model)
    drive = GripperDrive(model, "A", gripper)
    drive.start(data)
    drive.send(data, closed=True, width=None, ticks=200)
    for _ in range(500):
        drive.step(data)
        mujoco.mj_step(model, data)
    return model, data, drive


def drop(model: Any, data: Any, drive: GripperDrive, pull: tuple[float, float, float], seconds: float = 1.0) -> float:
    """How far the block goes while it is pulled as gravity would [m]."""
    start = data.body("BLOCK").xpos.copy()
    model.opt.gravity[:] = pull
    for _ in range(round(seconds * 1000)):
        drive.step(data)
        mujoco.mj_step(model, data)
    return float(np.linalg.norm(data.body("BLOCK").xpos - start))


@pytest.mark.parametrize(("force", "friction"), [(30.0, 1.0), (30.0, 0.5), (15.0, 1.0)])
def test_the_largest_mass_held(force: float, friction: float) -> None:
    """Two fingers hold 2 mu F / g, within 2 %: a little less stays, a little more falls."""
    gripper, largest = Gripper(force=force, friction=friction), 2 * friction * force / STANDARD_GRAVITY

    assert drop(*holding(gripper, 0.98 * largest), (0, 0, -STANDARD_GRAVITY)) < 1e-3
    assert drop(*holding(gripper, 1.02 * largest), (0, 0, -STANDARD_GRAVITY)) > 0.01


def test_creep() -> None:
    """A block that is held does not creep by a micrometre in a second."""
    held = holding(Gripper(), 0.2)
    drop(*held, (0, 0, -STANDARD_GRAVITY), 1.0)

    assert drop(*held, (0, 0, -STANDARD_GRAVITY), 2.0) < 2e-6


def test_suction() -> None:
    """A cup holds up to its force in pull, and up to friction times its force in shear; a ball it does not hold."""
    gripper = Gripper(kind="suction", force=20.0, friction=0.6)
    # A plate so thin that it does not tip off the cup.
    plate = Box(size=(SIDE, SIDE, 0.004))
    below = 0.5 - 0.002 - 1e-4
    for mass, pull, stays in (
        (0.98 * 20 / STANDARD_GRAVITY, (0, 0, -STANDARD_GRAVITY), True),
        (1.02 * 20 / STANDARD_GRAVITY, (0, 0, -STANDARD_GRAVITY), False),
        (0.95 * 12 / STANDARD_GRAVITY, (0, STANDARD_GRAVITY, 0), True),
        (1.05 * 12 / STANDARD_GRAVITY, (0, STANDARD_GRAVITY, 0), False),
    ):
        far = drop(*holding(gripper, mass, plate, below), pull)
        assert (far < 2e-3) is stays, (mass, pull, far)
    assert drop(*holding(gripper, 0.5, Sphere(radius=0.002), below), (0, 0, -STANDARD_GRAVITY)) > 0.01
