"""The efforts by their cause."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.equation_of_motion import Terms, terms
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.payloads import payload
from armwright.dynamics.shares import coriolis_efforts, gravity_efforts
from armwright.errors import ShapeError
from oracles.arms import random_arm, random_link

AGREEMENT = 1e-10  # relative to the largest effort


def _agree(ours: np.ndarray, theirs: np.ndarray) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=AGREEMENT * max(1.0, np.abs(theirs).max()))


def _with_friction(arm: Arm, rng: np.random.Generator) -> Arm:
    numbers = rng.uniform(0.1, 1.0, size=(arm.n, 4))
    motors = [Motor(inertia=a, viscous=b, coulomb_forward=c, coulomb_backward=d) for a, b, c, d in numbers.tolist()]
    return attrs.evolve(arm, motors=motors)


def test_terms_add_up(rng: np.random.Generator) -> None:
    """All causes together are the efforts of inverse dynamics, load, wrench and friction included."""
    for joints in (1, 3, 6):
        arm, load = _with_friction(random_arm(rng, joints), rng), random_link(rng)
        q, qd, qdd = rng.normal(size=(3, 2, 4, joints))
        wrench = rng.normal(size=6)

        efforts = terms(arm, q, qd, qdd, load=load, wrench=wrench)

        loaded = payload(arm, load.mass, load.com, load.inertia)
        _agree(efforts.total, inverse_dynamics(loaded, q, qd, qdd, wrench=wrench))


def test_terms_are_the_shares(rng: np.random.Generator) -> None:
    """Each sum of causes is the effort that the other formulas give for it alone."""
    arm = _with_friction(random_arm(rng, 5), rng)
    q, qd, qdd = rng.normal(size=(3, 5))

    efforts = terms(arm, q, qd, qdd)

    _agree(efforts.by_acceleration, mass_matrix(arm, q) @ qdd)
    _agree(efforts.by_speed, coriolis_efforts(arm, q, qd))
    _agree(efforts.gravity, gravity_efforts(arm, q))
    drives = inverse_dynamics(arm, q, qd, qdd) - inverse_dynamics(arm, q, qd, qdd, drives=False)
    _agree(efforts.motor + efforts.friction, drives)


def test_total_is_the_sum_of_the_table(rng: np.random.Generator) -> None:
    """Nothing hides between the fields: their plain sum is the total."""
    arm = _with_friction(random_arm(rng, 4), rng)
    efforts = terms(arm, *rng.normal(size=(3, 4)), load=random_link(rng), wrench=rng.normal(size=6))

    sums = [getattr(efforts, field.name).reshape(4, -1).sum(axis=1) for field in attrs.fields(Terms)]

    np.testing.assert_allclose(np.sum(sums, axis=0), efforts.total, rtol=1e-13, atol=1e-13)


def test_elbow_by_hand() -> None:
    """Two point masses on two rods, term by term from the textbook."""
    arm = Arm(
        name="elbow",
        joints=[Joint(kind="revolute", a=0.5), Joint(kind="revolute", a=0.3)],
        links=[Link(mass=2.0), Link(mass=1.5)],
        motors=[Motor(inertia=0.2, viscous=0.5, coulomb_forward=0.7, coulomb_backward=0.9), Motor()],
        gravity=(0.0, -STANDARD_GRAVITY, 0.0),
    )
    q1, q2, w1, w2, a1, a2 = 0.4, 0.7, -1.1, 2.0, 3.0, -4.0
    far, near, side = 1.5 * 0.3**2, 3.5 * 0.5**2, 1.5 * 0.5 * 0.3
    c2, throw = np.cos(q2), side * np.sin(q2)

    efforts = terms(arm, [q1, q2], [w1, w2], [a1, a2])

    np.testing.assert_allclose(efforts.own, [(near + far + 2 * side * c2) * a1, far * a2])
    coupling = far + side * c2
    np.testing.assert_allclose(efforts.coupling, [[0, coupling * a2], [coupling * a1, 0]])
    np.testing.assert_allclose(efforts.motor, [0.2 * a1, 0])
    np.testing.assert_allclose(efforts.centrifugal, [[0, -throw * w2**2], [throw * w1**2, 0]], atol=1e-14)
    np.testing.assert_allclose(efforts.coriolis, [[[0, -2 * throw * w1 * w2], [0, 0]], [[0, 0], [0, 0]]], atol=1e-14)
    outer = 1.5 * STANDARD_GRAVITY * 0.3 * np.cos(q1 + q2)
    np.testing.assert_allclose(efforts.gravity, [3.5 * STANDARD_GRAVITY * 0.5 * np.cos(q1) + outer, outer])
    np.testing.assert_allclose(efforts.viscous, [0.5 * w1, 0])
    np.testing.assert_allclose(efforts.dry, [-0.9, 0])
    assert not efforts.load.any()
    assert not efforts.outside.any()


def test_load_and_wrench_by_hand() -> None:
    """A load of 2 kg on a slide weighs 2 g and resists with 2 kg; a push of 5 N from below carries 5 N of it."""
    lift = Arm(name="lift", joints=[Joint(kind="prismatic")], links=[Link(mass=3.0)])

    efforts = terms(lift, [0.0], [0.0], [1.5], load=Link(mass=2.0), wrench=[0, 0, 5, 0, 0, 0])

    assert efforts.load[0] == pytest.approx(2 * (STANDARD_GRAVITY + 1.5))
    assert efforts.outside[0] == pytest.approx(-5)
    assert efforts.own[0] == pytest.approx(3 * 1.5)


def test_joint_does_not_swing_itself(rng: np.random.Generator) -> None:
    """The own speed of a joint asks no effort of that joint: its inertia does not depend on its own position."""
    efforts = terms(load_arm("stanford-jpl"), *rng.normal(size=(3, 20, 6)))

    np.testing.assert_allclose(np.diagonal(efforts.centrifugal, axis1=-2, axis2=-1), 0.0, atol=1e-12)


def test_axes_that_do_not_fit() -> None:
    """A motion of ten moments needs ten wrenches or one."""
    arm = load_arm("stanford")
    motion = np.zeros((10, 6))
    with pytest.raises(ShapeError, match=r"q, qd, qdd, wrench: leading axes must broadcast together, .* \(9, 6\)"):
        terms(arm, motion, motion, motion, wrench=np.zeros((9, 6)))
