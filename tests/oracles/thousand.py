"""A thousand random arms, each in one random motion, set up in Pinocchio as well; a tenth of them in `make test`."""

import functools
from collections.abc import Callable

import attrs
import numpy as np
import pinocchio as pin

from armwright.arm.model import Arm, Link, Motor
from armwright.arrays import Array
from oracles.arms import random_arm, random_link, squared
from oracles.with_pinocchio import pinocchio_model, pushed, with_load, with_rotors
from samples import WHOLE

# Largest deviation from Pinocchio, in parts of the largest number of the quantity.
AGREEMENT = 1e-11
# Quantities smaller than this are compared as if they were this large: what is left where everything cancels is
# rounding of terms a thousand times its size.
_SMALL = 1e-3


@attrs.frozen(kw_only=True, eq=False)
class Case:
    """One arm, how it stands, moves and is pushed, and its models in Pinocchio.

    Attributes:
        arm: two to nine joints, every second arm with the right angles and missing lengths of built ones.
        q: positions, (n,).
        qd: speeds, (n,).
        qdd: accelerations, (n,).
        tau: efforts, (n,).
        wrench: on the tool, (6,).
        carrying: acceleration of the base, (3,).
        load: a body at the tool.
        links: model of the links alone.
        driven: the same with the rotors.
        loaded: the same as ``links``, with the load.
        carried: the same as ``links``, on a base with three joints of its own.
        tool: number of the tool frame of ``links``, ``driven`` and ``loaded``.
        push: the wrench, as Pinocchio wants it.
    """

    arm: Arm
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    wrench: Array
    carrying: Array
    load: Link
    links: tuple[pin.Model, pin.Data]
    driven: tuple[pin.Model, pin.Data]
    loaded: tuple[pin.Model, pin.Data]
    carried: tuple[pin.Model, pin.Data]
    tool: int
    push: list[pin.Force]

    @property
    def friction(self) -> Array:
        """Viscous friction, which Pinocchio's algorithms leave to the caller (n,)."""
        return np.array([motor.viscous for motor in self.arm.motors]) * self.qd


@functools.cache
def thousand_arms() -> tuple[Case, ...]:
    """A thousand arms of two to nine joints and twenty of one in `make proof`, else a tenth of each."""
    rng = np.random.default_rng(1000)
    share = 1 if WHOLE else 10
    counts = [2 + k % 8 for k in range(1000 // share)] + [1] * (20 // share)
    return tuple(_case(rng, joints, built=k // 8 % 2 == 1) for k, joints in enumerate(counts))


def largest_deviation(ours: Callable[[Case], Array], theirs: Callable[[Case], Array]) -> float:
    """Return the largest deviation of ours from theirs over all arms, in parts of the largest number of each."""
    return max(deviation(ours(case), theirs(case)) for case in thousand_arms())


def deviation(ours: Array, theirs: Array) -> float:
    """Return the largest difference of two arrays of one shape, in parts of the largest number of the second."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    assert ours.shape == theirs.shape
    assert np.isfinite(ours).all()
    return float(np.abs(ours - theirs).max() / max(_SMALL, np.abs(theirs).max()))


def _case(rng: np.random.Generator, joints: int, *, built: bool) -> Case:
    arm = random_arm(rng, joints)
    arm = attrs.evolve(
        squared(arm, rng) if built else arm,
        motors=[Motor(inertia=motor.inertia, viscous=rng.uniform(0, 3)) for motor in arm.motors],
    )
    q, qd, qdd, tau = rng.uniform(-2, 2, size=(4, joints))
    wrench, load = rng.normal(scale=10, size=6), random_link(rng)
    model, data, tool = pinocchio_model(arm)
    return Case(
        arm=arm,
        q=q,
        qd=qd,
        qdd=qdd,
        tau=10 * tau,
        wrench=wrench,
        carrying=rng.normal(scale=5, size=3),
        load=load,
        links=(model, data),
        driven=with_rotors(model, arm),
        loaded=with_load(model, tool, load),
        carried=pinocchio_model(arm, carried=True)[:2],
        tool=tool,
        push=pushed(model, data, tool, q, wrench),
    )
