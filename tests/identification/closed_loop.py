"""Logs of random arms in the physics cell: driven in closed loop, read by encoders, with currents that are noisy."""

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.model import Arm, Joint, Limits
from armwright.cell.control import Sensors
from armwright.cell.model import Cell, CellArm
from armwright.dynamics.payloads import payload
from armwright.identification import DynamicModel, plan_excitation
from armwright.identification.log import Log
from armwright.motion.trajectory import Trajectory
from armwright.physics import PhysicsCell
from identification.simulated import noise
from oracles.arms import random_link

# Counts of the encoders per turn of the joint, those of 17 bits before a gear of 64: an angle of 7e-7 rad.
COUNTS = 2**23
PERIOD = 2e-3


def random_arm(rng: np.random.Generator, *, plain: bool) -> Arm:
    """An arm of three to six revolute joints at right angles, with friction of the plain law or of another."""
    n = int(rng.integers(3, 7))
    limits = Limits(lower=-2.5, upper=2.5, speed=2.0, acceleration=5.0, effort=1000.0)
    quarter = np.pi / 2
    joints = [
        Joint(
            kind="revolute", d=rng.uniform(0.0, 0.2), a=rng.choice([0.0, 0.3]), alpha=quarter * rng.integers(-1, 2),
            limits=limits,
        )
        for _ in range(n)
    ]  # fmt: skip
    motors = []
    for i in range(n):
        dry = rng.uniform(1, 6) * 0.7**i
        more = {} if plain else {"stribeck": 0.6 * dry, "stribeck_speed": 0.15, "cube_root": 0.7 * dry}
        motors.append(
            Motor(
                inertia=rng.uniform(0.2, 1.0) * 0.7**i, viscous=rng.uniform(1, 5) * 0.7**i,
                coulomb_forward=dry, coulomb_backward=dry, offset=rng.normal() * 0.2, **more,
            )
        )  # fmt: skip
    return Arm(name="random", joints=joints, links=[random_link(rng) for _ in range(n)], motors=motors)


def believed(arm: Arm, rng: np.random.Generator) -> Arm:
    """The arm as drawn: each mass a tenth off, and friction a third."""
    links = [
        attrs.evolve(it, mass=factor * it.mass, inertia=factor * it.inertia)
        for it, factor in zip(arm.links, rng.choice([0.9, 1.1], arm.n), strict=True)
    ]
    motors = [
        attrs.evolve(it, viscous=factor * it.viscous, coulomb_forward=factor * it.coulomb_forward)
        for it, factor in zip(arm.motors, rng.choice([0.7, 1.3], arm.n), strict=True)
    ]
    return attrs.evolve(arm, links=links, motors=motors)


def excitation(arm: Arm, seed: int) -> Trajectory:
    """A motion of twenty seconds that excites the arm."""
    return plan_excitation(DynamicModel(arm=arm, terms=("rotor", "viscous", "coulomb")), seed=seed).trajectory


def logged(
    drawn: Arm, plant: Arm, motion: Trajectory, rng: np.random.Generator, *, delay: int = 1, part: float = 0.01
) -> Log:
    """What is logged of a motion: positions by encoders, late, and efforts with coloured noise."""
    start = motion(0.0)
    placed = CellArm(arm=drawn, plant=plant, start=start, sensors=Sensors(counts=COUNTS, delay=delay))
    world = PhysicsCell(Cell(name="log", arms={"ARM_1": placed}, period=PERIOD))
    world.start_motion("ARM_1", motion, 0.0, np.eye(4))
    assert world.advance(motion.duration) is None
    stream = world.observations().measured[0]
    tau = stream.tau + part * stream.tau.std(axis=0) * noise(rng, stream.tau.shape, 0.9)
    return Log(name="cell", t=stream.t, q=stream.q, effort=tau)


def with_load(arm: Arm, mass: float) -> Arm:
    """The arm with a load at its tool."""
    return payload(arm, mass, (0.02, -0.03, 0.08), np.diag([0.01, 0.012, 0.008]) * mass)
