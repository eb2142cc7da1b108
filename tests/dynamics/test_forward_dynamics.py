"""Accelerations from efforts, by the articulated bodies and by the report's TOACC."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.accelerations import forward_dynamics, toacc, unit_accelerations
from armwright.dynamics.articulated_body import articulated_body
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import UnsupportedArmError
from oracles.arms import random_arm
from oracles.catalogue import FEW_WITH_MASSES, WITH_MASSES
from oracles.with_pinocchio import pinocchio_model

AGREEMENT = 1e-9  # relative to the largest acceleration


def _agree(ours: np.ndarray, theirs: np.ndarray) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=AGREEMENT * max(1.0, np.abs(theirs).max()))


def _compare(arm: Arm, rng: np.random.Generator) -> None:
    smooth = attrs.evolve(arm, motors=[Motor(inertia=motor.inertia) for motor in arm.motors])
    model, data, _ = pinocchio_model(arm)
    model.armature = np.array([motor.inertia for motor in arm.motors])
    for q, qd, tau in rng.uniform(-2, 2, size=(5, 3, arm.n)):
        expected = pin.aba(model, data, q, qd, 10 * tau)

        _agree(forward_dynamics(smooth, q, qd, 10 * tau), expected)
        _agree(toacc(smooth, q, qd, 10 * tau), expected)


@pytest.mark.drawn(FEW_WITH_MASSES)
@pytest.mark.parametrize("name", WITH_MASSES)
def test_catalogue_against_pinocchio(name: str, rng: np.random.Generator) -> None:
    """Pinocchio gives the joints of every catalogue arm with masses the same accelerations, rotors included."""
    _compare(load_arm(name), rng)


def test_there_and_back(rng: np.random.Generator) -> None:
    """The efforts of a motion give its accelerations back: friction, rotors and a push on the tool included."""
    arm = load_arm("puma560")
    q, qd, qdd = rng.normal(size=(3, 2, 5, 6))
    wrench = rng.normal(size=(5, 6))
    tau = inverse_dynamics(arm, q, qd, qdd, wrench=wrench)

    _agree(forward_dynamics(arm, q, qd, tau, wrench=wrench), qdd)
    _agree(toacc(arm, q, qd, tau, wrench=wrench), qdd)


def test_links_alone(rng: np.random.Generator) -> None:
    """Without drives neither rotors nor friction count, there and back."""
    arm = load_arm("stanford-jpl")
    q, qd, qdd = rng.normal(size=(3, 6))
    tau = inverse_dynamics(arm, q, qd, qdd, drives=False)

    _agree(forward_dynamics(arm, q, qd, tau, drives=False), qdd)
    _agree(toacc(arm, q, qd, tau, drives=False), qdd)


def test_falling_by_hand() -> None:
    """A mass on a slide with a rotor that counts as much as itself falls with half of gravity."""
    lift = Arm(name="lift", joints=[Joint(kind="prismatic")], links=[Link(mass=3.0)], motors=[Motor(inertia=3.0)])

    assert forward_dynamics(lift, [0.0], [0.0], [0.0])[0] == pytest.approx(-STANDARD_GRAVITY / 2)
    assert toacc(lift, [0.0], [0.0], [6.0])[0] == pytest.approx(1 - STANDARD_GRAVITY / 2)


def test_unit_accelerations_are_the_mass_matrix(rng: np.random.Generator) -> None:
    """The report's n calls and the composite bodies give one mass matrix."""
    arm = random_arm(rng, 6)
    q = rng.normal(size=6)

    np.testing.assert_allclose(unit_accelerations(arm, q.tolist()), mass_matrix(arm, q), rtol=1e-10, atol=1e-10)


def test_floats_and_arrays_are_one_equation(rng: np.random.Generator) -> None:
    """The articulated bodies over plain floats and over arrays give the same accelerations."""
    arm = random_arm(rng, 5)
    q, qd, tau = rng.normal(size=(3, 4, 5))
    many = forward_dynamics(arm, q, qd, tau)

    for k in range(4):
        scalars, _ = articulated_body(arm, q[k].tolist(), qd[k].tolist(), tau[k].tolist())
        np.testing.assert_allclose(scalars, many[k], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("solve", [forward_dynamics, toacc])
def test_massless_hand_without_motor(solve: object) -> None:
    """A last link without mass on a joint without rotor answers any effort with no finite acceleration."""
    arm = load_arm("puma560")
    bare = attrs.evolve(arm, links=(*arm.links[:-1], Link()), motors=(*arm.motors[:-1], Motor()))

    with pytest.raises(UnsupportedArmError, match=r"joint 6 is undefined: what it moves has no inertia about its axis"):
        solve(bare, np.full(6, 0.3), np.zeros(6), np.zeros(6))
    assert np.isfinite(solve(attrs.evolve(bare, motors=arm.motors), np.full(6, 0.3), np.zeros(6), np.zeros(6))).all()


@pytest.mark.parametrize("solve", [forward_dynamics, toacc])
def test_two_joints_about_one_axis(solve: object) -> None:
    """Of two joints about one axis with nothing between them, the first feels nothing while the second is free."""
    body = Link(mass=1.0, com=(0.3, 0.0, 0.0), inertia=np.diag((0.1, 0.2, 0.3)))
    arm = Arm(name="twin", joints=[Joint(kind="revolute"), Joint(kind="revolute")], links=[Link(), body])

    with pytest.raises(
        UnsupportedArmError, match=r"joint 1 is undefined: .* Give its link a moment of inertia or its motor"
    ):
        solve(arm, [0.1, 0.2], [0.0, 0.0], [0.0, 0.0])


def test_slide_without_mass() -> None:
    """For a slide that carries nothing the message asks for a mass."""
    arm = Arm(name="rail", joints=[Joint(kind="prismatic")])

    with pytest.raises(
        UnsupportedArmError, match=r"joint 1 is undefined: .* along its axis .* Give its link a mass or"
    ):
        forward_dynamics(arm, [0.1], [0.0], [0.0])


def test_point_on_its_own_axis() -> None:
    """A point mass on the axis of a joint far from the base resists nothing, whatever rounding leaves of its lever."""
    arm = Arm(
        name="needle",
        joints=[Joint(kind="revolute", a=0.3, alpha=0.7), Joint(kind="revolute", d=0.1, alpha=0.3)],
        links=[Link(mass=1.0, com=(0.1, 0.2, 0.3)), Link(mass=1.0, com=(0.0, np.sin(0.3), np.cos(0.3)))],
    )

    with pytest.raises(UnsupportedArmError, match="joint 2"):
        forward_dynamics(arm, [0.4, 1.1], [0.0, 0.0], [0.0, 0.0])
