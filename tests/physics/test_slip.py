"""Parts that are carried on a curve slip in the hand, by a law that follows from how contacts are computed.

MuJoCo leaves the centripetal acceleration c of what touches out of the equation of a contact, whose friction asks for
the relative acceleration -b u at the relative velocity u. So u settles at c / b; within a step h of straight flight the
part loses h² c / 2 of that. It slips by the integral of c (1 / b - h / 2), outwards.
"""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.hardware import Mishap
from armwright.cell.scene import Gripper
from armwright.compiled import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.geoms import add_geom
from armwright.physics.gripper import GripperDrive, add_gripper, grip
from armwright.physics.plant import new_world
from armwright.physics.world import PhysicsCell
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Box, Solid
from oracles.benches import ARMS, PROGRAM, bench, compiled, drawn_bench, without_pictures
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

STEP = 1e-3
# What the law leaves out: the first touch of the pads, and creep.
LAW, CREEP = 0.05, 1e-6
# By how much parts may slip at normal speed [m].
LARGEST = 3e-4
SIDE = 0.04
# The block is carried to above its goal.
CARRY = PROGRAM[: PROGRAM.index("  MOVE obj TO goal")] + "  MOVE obj TO apg WITH DEPARTURE = apo ;\nEND.\n"


def damp(model: Any, damping: float) -> None:
    """Let the friction of all pads be damped by ``damping`` / step."""
    model.pair_solreffriction[:] = (-1.0, -damping * model.pair_solimp[0, 1] / STEP)


def turntable(radius: float) -> Any:
    """A gripper without weight that hangs from a heavy disc, at a radius, open along the way that it goes."""
    spec = new_world(np.zeros(3), STEP)
    disc = spec.worldbody.add_body(name="disc", pos=(0, 0, 0.5))
    disc.add_joint(name="disc", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 0, 1), armature=1e6)
    disc.explicitinertial, disc.mass, disc.inertia, disc.ipos = True, 1.0, (1.0,) * 3, np.zeros(3)
    tool = disc.add_body(name="A/tool", pos=(radius, 0, 0), quat=(0, 1, 0, 0))
    add_gripper(spec, "A", tool, Gripper(), contype=4, conaffinity=3)
    block = spec.worldbody.add_body(name="BLOCK", pos=(radius, 0, 0.5))
    block.add_freejoint()
    block.explicitinertial, block.mass, block.inertia, block.ipos = True, 0.2, (1e-4,) * 3, np.zeros(3)
    bits = {"contype": 2, "conaffinity": 7, "condim": 4}
    add_geom(spec, block, "BLOCK", Solid(shape=Box(size=(SIDE,) * 3)), mass=0.0, **bits)
    grip(spec, "A", Gripper(), "BLOCK")
    return spec.compile()


@pytest.mark.parametrize("damping", [0.25, 0.5, 1.0, 1.5, None])
def test_slip_on_a_turntable(damping: float | None) -> None:
    """On a disc that turns steadily a part slips outwards by w² r T (1 / b - h / 2), by hand.

    Without another damping, by that of the grippers of cells.
    """
    radius, speed, ticks = 0.25, 3.0, 1000
    model = turntable(radius)
    if damping is not None:
        damp(model, damping)
    used = -float(model.pair_solreffriction[0, 1]) / float(model.pair_solimp[0, 1])
    assert damping is None or used == pytest.approx(damping / STEP)
    data = mujoco.MjData(model)
    drive = GripperDrive(model, "A", Gripper())
    drive.start(data)
    drive.send(data, closed=True, width=None, ticks=200)
    for tick in range(500 + ticks):
        if tick == 500:
            # All of it turns from now on.
            data.joint("disc").qvel = speed
            part = data.body("BLOCK").xpos
            data.qvel[-6:] = (*np.cross((0, 0, speed), part), 0, 0, speed)
            start = np.hypot(*part[:2])
        drive.step(data)
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)

    slip = np.hypot(*data.body("BLOCK").xpos[:2]) - start

    law = speed**2 * radius * ticks * STEP * (1 / used - STEP / 2)
    assert slip == pytest.approx(law, rel=LAW)


class Watched(PhysicsCell):
    """A world that keeps the pose of the block at every tick, after the first."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.poses: list[Array] = []

    def advance(self, now: float) -> Mishap | None:
        """Go tick by tick."""
        while len(self.poses) < round(now / STEP):
            if (mishap := super().advance((len(self.poses) + 1) * STEP)) is not None:
                return mishap
            # As it was at the beginning of the step, of which positions and speeds are measured too.
            self.poses.append(self.true_pose("BLOCK"))
        return None


def slip_and_law(world: Watched, recording: Recording, factor: float) -> tuple[Array, Array]:
    """How a block has moved in the plane of the pads at every tick, as it did, and as the law has it (k, 2) [m]."""
    arm, stream = recording.cell.arms["ARM_1"], recording.measured[0]
    gripped = round(next(effect.t1 for effect in recording.effects if effect.kind == "GRASP") / STEP)
    q, qd = stream.q[gripped:], stream.qd[gripped:]
    jacobian, small, law = compile_arm(arm.arm).jacobian, 1e-6, []
    tools = forward(arm.arm, q)
    for X, at, speed in zip(tools, q, qd, strict=True):
        ahead, behind = (jacobian(at + sign * small * speed)[:3] for sign in (1, -1))
        centripetal = (ahead - behind) / (2 * small) @ speed
        law.append(-factor * STEP * X[:3, :3].T @ centripetal)
    there = (inverse(arm.base @ tools) @ np.array(world.poses[gripped : gripped + len(q)]))[:, :3, 3]
    # The pads close along o.
    return (there - there[0])[:, ::2], np.cumsum(law, axis=0)[:, ::2]


@pytest.mark.drawn(0.34)
@pytest.mark.share(0.05)
@pytest.mark.parametrize("arm", ARMS)
def test_slip_of_arms(arm: str, sample: Sample, tmp_path: Path) -> None:
    """At SPEED 100 a block slips as the law says, in both directions of the pads, and by less than 0.3 mm.

    So it does where friction is damped by less, in proportion.
    """
    plain = bench(tmp_path, arm)
    code, slips, worst = compiled(plain, CARRY).code, [], 0.0
    for rng in sample.cases(20):
        drawn, parts, _, _ = drawn_bench(plain, arm, rng)
        cell = without_pictures(drawn)
        for damping in (None, 1.0):
            world = Watched(cell, parts=parts)
            model = world._world.model
            if damping is not None:
                damp(model, damping)
            used = -float(model.pair_solreffriction[0, 1]) / float(model.pair_solimp[0, 1])
            recording = interpret(code, cell, world)
            slip, law = slip_and_law(world, recording, 1 / used - STEP / 2)
            largest = np.linalg.norm(law, axis=1).max()
            off = np.linalg.norm(slip - law, axis=1).max()
            worst = max(worst, (off - CREEP) / largest)
            assert off < LAW * largest + CREEP
            if damping is None:
                slips.append(np.linalg.norm(slip, axis=1).max())
    sample.record(f"slip in the hand of {arm}", len(slips), 0, largest=max(slips), off_law=worst)
    assert max(slips) < LARGEST
