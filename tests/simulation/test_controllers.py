"""Controllers, on arms that are simulated and by hand."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link, Motor
from armwright.dynamics.payloads import payload
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import InvalidValueError, ShapeError
from armwright.simulation.controllers import (
    computed_torque,
    gravity_compensation,
    no_effort,
    pd,
    pd_with_gravity,
    standing,
)
from armwright.simulation.integrators import Adaptive, Gill
from armwright.simulation.simulator import simulate
from oracles.arms import random_arm


def _wave(t: float, order: int) -> np.ndarray:
    """A reference that every joint can follow: 0.2 sin(3 t), and its derivatives."""
    return np.full(6, 0.3 * (order == 0)) + 0.2 * 3.0**order * np.sin(3.0 * t + order * np.pi / 2)


def test_efforts_by_hand(rng: np.random.Generator) -> None:
    """Off is nothing, carrying is the weight, PD is a spring with a damper, and one can have both."""
    arm = random_arm(rng, 3)
    q, qd = np.array((0.1, 0.2, 0.3)), np.array((1.0, 2.0, 3.0))
    goal = standing([0.0, 0.0, 1.0])
    spring = 10 * (np.array((0.0, 0.0, 1.0)) - q) - np.array((1.0, 2.0, 4.0)) * qd

    assert not np.any(no_effort(arm)(0.0, q, qd))
    np.testing.assert_allclose(gravity_compensation(arm)(0.0, q, qd), gravity_efforts(arm, q))
    np.testing.assert_allclose(pd(arm, goal, 10.0, (1.0, 2.0, 4.0))(0.0, q, qd), spring)
    both = pd_with_gravity(arm, goal, 10.0, (1.0, 2.0, 4.0))(0.0, q, qd)
    np.testing.assert_allclose(both, spring + gravity_efforts(arm, q))


def test_standing_stands() -> None:
    """The reference of an arm that stays has no speed and no acceleration."""
    goal = standing([1.0, 2.0])

    assert goal(3.0, 0).tolist() == [1.0, 2.0]
    assert goal(3.0, 1).tolist() == goal(3.0, 2).tolist() == [0.0, 0.0]


def test_computed_torque_follows() -> None:
    """A controller that knows the arm, its friction included, keeps it on the reference it starts on."""
    arm = load_arm("stanford-jpl")
    rough = attrs.evolve(
        arm,
        motors=[attrs.evolve(motor, viscous=0.4, coulomb_forward=0.5, coulomb_backward=0.3) for motor in arm.motors],
    )
    controller = computed_torque(rough, _wave, kp=100.0, kd=20.0)

    found = simulate(
        rough, _wave(0.0, 0), _wave(0.0, 1), duration=0.7, controller=controller, integrator=Gill(length=5e-3),
        period=0.05,
    )  # fmt: skip

    expected = np.array([_wave(t, 0) for t in found.t])
    np.testing.assert_allclose(found.q, expected, atol=1e-5)


def test_computed_torque_forgets_an_error() -> None:
    """Set off beside its reference, every joint comes back like one double integrator: e (1 + w t) exp(-w t)."""
    arm = load_arm("stanford-jpl")
    w = 8.0
    controller = computed_torque(arm, _wave, kp=w**2, kd=2 * w)
    error = np.array((0.1, -0.1, 0.05, 0.2, -0.2, 0.1))

    found = simulate(
        arm, _wave(0.0, 0) + error, _wave(0.0, 1), duration=0.5, controller=controller, saturation=False,
        integrator=Gill(length=5e-3), period=0.05,
    )  # fmt: skip

    left = np.array([_wave(t, 0) for t in found.t]) - found.q
    expected = -error * ((1 + w * found.t) * np.exp(-w * found.t))[:, None]
    np.testing.assert_allclose(left, expected, atol=1e-6)


def test_pd_with_gravity_arrives() -> None:
    """A spring that need not carry the weight pulls the arm to its goal and leaves it there; without, it sags."""
    arm = load_arm("stanford-jpl")
    goal = np.array((0.3, 0.4, 0.5, 0.1, 0.2, 0.3))
    start = goal + 0.1
    gains = {"kp": np.array((200.0, 200.0, 300.0, 8.0, 8.0, 2.0)), "kd": np.array((60.0, 60.0, 60.0, 2.0, 2.0, 0.4))}
    how = {"duration": 4.0, "integrator": Adaptive(rtol=1e-6, atol=1e-8, longest=0.1), "period": 1.0}

    carried = simulate(arm, start, controller=pd_with_gravity(arm, standing(goal), **gains), **how)
    sags = simulate(arm, start, controller=pd(arm, standing(goal), **gains), **how)

    np.testing.assert_allclose(carried.q[-1], goal, atol=2e-3)
    assert np.abs(sags.q[-1] - goal).max() > 0.05


def test_controller_that_knows_no_load() -> None:
    """Computed torque for the bare arm leaves an error when the hand holds a load: the weight over the stiffness."""
    lift = Arm(name="lift", joints=[Joint(kind="prismatic")], links=[Link(mass=3.0)], motors=[Motor(inertia=1.0)])
    controller = computed_torque(lift, standing([0.0]), kp=400.0, kd=40.0)

    found = simulate(
        payload(lift, 2.0), [0.0], duration=2.0, controller=controller, integrator=Gill(length=1e-2), period=0.5
    )

    assert found.q[-1, 0] == pytest.approx(-2.0 * 9.80665 / (4.0 * 400.0), rel=1e-4)


def test_gains_that_make_no_sense() -> None:
    """Stiffness is one number or one per joint, and never below 0."""
    arm = load_arm("stanford")
    with pytest.raises(ShapeError, match="kp: expected one number, or 6, one per joint"):
        pd(arm, _wave, (1.0, 2.0), 1.0)
    with pytest.raises(InvalidValueError, match="kd: expected 0 or more for every joint"):
        computed_torque(arm, _wave, 1.0, -1.0)
