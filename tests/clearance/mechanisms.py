"""Small linkages whose motion one can calculate, and what every simulated motion must obey."""

from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from armwright.arrays import Array
from armwright.clearance.equations import Contact, ContactMemory, FrictionModel, State, rates
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Material, Pin
from armwright.clearance.paths import Path
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation

GRAVITY = 9.81
ORIGIN = Body(name="ground", points={"O": (0.0, 0.0)})


def block(
    *,
    clearance: float = 5e-4,
    gravity: float = 0.0,
    restitution: float = 0.9,
    friction: float = 0.0,
) -> Linkage:
    """A block of 1 kg in a round hole, that moves up and down on a cross of 1 kg, that moves from side to side.

    Up and down 1 kg moves, from side to side 2 kg; nothing rotates.
    """
    return Linkage(
        name="block",
        ground=ORIGIN,
        bodies=[Body(name="cross", mass=1.0, points={"P": (0, 0)}), Body(name="block", mass=1.0, points={"P": (0, 0)})],
        joints=[
            Guide(body="cross", point="P", on=BodyPoint("ground", "O")),
            Guide(body="block", point="P", on=BodyPoint("cross", "P"), direction=np.pi / 2),
        ],
        pins=[
            ClearancePin(
                name="hole",
                bearing=BodyPoint("ground", "O"),
                journal=BodyPoint("block", "P"),
                clearance=clearance,
                journal_radius=0.01,
            )
        ],
        drives=[],
        tip=BodyPoint("block", "P"),
        gravity=(0.0, -gravity),
        material=Material(restitution=restitution, friction=friction),
    )


def pendulum() -> Linkage:
    """1 kg at the end of a rod of 1 m without mass; a drive at its pin, and nothing has play."""
    # Without any inertia of its own a body is refused; this one changes the period by 5e-13.
    bar = Body(name="bar", mass=1.0, inertia=1e-12, centre=(1, 0), points={"O": (0, 0), "P": (1, 0)})
    return Linkage(
        name="pendulum",
        ground=ORIGIN,
        bodies=[bar],
        joints=[Pin(body="bar", point="O", on=BodyPoint("ground", "O"))],
        pins=[],
        drives=[Drive(body="bar")],
        tip=BodyPoint("bar", "P"),
    )


def still(duration: float, *drives: float) -> Path:
    """The drives stay where they are."""
    pieces = np.array(drives, dtype=np.float64).reshape(1, -1, 1)
    return Path(name="still", knots=np.array([0.0, duration]), pieces=pieces, follower="drives")


def thrown(linkage: Linkage, settings: Settings, duration: float, speeds: ArrayLike) -> Scenario:
    """A linkage that starts with given speeds where it stood still."""
    task = prepare_scenario(linkage, still(duration, *([0.0] * len(linkage.drives))), settings)
    qd = np.zeros_like(task.ideal.qd)
    qd[0] = speeds
    return attrs.evolve(task, ideal=attrs.evolve(task.ideal, qd=qd))


def left_alone(task: Scenario) -> Scenario:
    """The same with drives that give nothing."""
    return attrs.evolve(task, table=np.zeros_like(task.table))


def energies(run: Simulation) -> Array:
    """(..., s) kinetic energy, that of gravity and loads, and that of indentations, all together [J]."""
    linkage, settings = run.scenario.linkage, run.scenario.settings
    c = np.broadcast_to(run.clearances[..., None, :], (*run.q.shape[:-1], len(linkage.pins)))
    K = contact_stiffness(linkage, c)
    contacts = [Contact(c[..., i], K[..., i], 0.0, 0.0, settings.threshold) for i in range(len(linkage.pins))]
    memories = [ContactMemory(np.zeros(run.q.shape[:-1]), 1.0) for _ in linkage.pins]
    state = State(axes(run.q), axes(run.qd), memories)
    return np.asarray(sum(rates(linkage, FrictionModel(), state, [0.0] * len(linkage.drives), contacts).energy))


def imbalance(run: Simulation) -> Array:
    """(..., s) energy that has come from nowhere since the start [J]."""
    energy = energies(run)
    works = run.works
    work = works["driven"] - works["impact loss"] - works["friction loss"]
    return np.asarray(energy - energy[..., :1] - work)


def axes(values: Array) -> list[Any]:
    """The numbers of the last axis one by one."""
    return [values[..., i] for i in range(values.shape[-1])]
