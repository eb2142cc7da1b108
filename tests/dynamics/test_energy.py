"""Energy of a moving arm, and a load in its hand."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.bodies import body_of
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.payloads import payload
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.forward_kinematics import forward
from oracles.arms import random_arm

LOAD = 1.8  # kg
SIDE = 422e-6 ** (1 / 3)  # of a cube of 422 cm³ [m]


def test_kinetic_energy_is_half_the_mass_matrix_between_speeds(rng: np.random.Generator) -> None:
    """Summed link by link or taken from the mass matrix, rotors included, the energy of motion is one."""
    arm = random_arm(rng, 6)
    q, qd = rng.normal(size=(2, 4, 6))

    np.testing.assert_allclose(
        kinetic_energy(arm, q, qd), np.einsum("ki,kij,kj->k", qd, mass_matrix(arm, q), qd) / 2, rtol=1e-12
    )


def test_energies_by_hand() -> None:
    """A mass of 3 kg, 2 m up, with a rotor that counts 1 kg, at 4 m/s."""
    lift = Arm(name="lift", joints=[Joint(kind="prismatic")], links=[Link(mass=3.0)], motors=[Motor(inertia=1.0)])

    assert potential_energy(lift, [2.0]) == pytest.approx(3 * STANDARD_GRAVITY * 2)
    assert kinetic_energy(lift, [2.0], [4.0]) == pytest.approx((3 + 1) * 4**2 / 2)
    assert kinetic_energy(lift, [2.0], [4.0], drives=False) == pytest.approx(3 * 4**2 / 2)


def test_gravity_is_the_slope_of_the_potential(rng: np.random.Generator) -> None:
    """Gravity pulls every joint down the slope of the potential energy."""
    arm = random_arm(rng, 5)
    q, step = rng.normal(size=5), 1e-6
    shifts = step * np.eye(5)

    slope = (potential_energy(arm, q + shifts) - potential_energy(arm, q - shifts)) / (2 * step)

    np.testing.assert_allclose(gravity_efforts(arm, q), slope, atol=1e-7)


def test_report_load() -> None:
    """A cube of 1.8 kg at the tool of the arm at JPL makes link 6 what the report's appendix II prints.

    The report cuts some digits where others round, so one unit of the last printed digit is allowed. It keeps the
    0.0014 m of the bare link for y of the centre of mass; 0.51 kg of 2.31 kg leave 0.0003 m of it.
    """
    cube = LOAD * SIDE**2 / 6 * np.eye(3)

    link = payload(load_arm("stanford-jpl"), LOAD, inertia=cube).links[-1]

    assert link.mass == pytest.approx(2.31)
    np.testing.assert_allclose(link.com, (0.0, 0.51 * 0.0014 / 2.31, 0.51 * -0.0922 / 2.31), atol=1e-15)
    np.testing.assert_allclose(link.com[2], -0.0203, atol=1e-4)
    np.testing.assert_allclose(np.diag(body_of(link).tensor), (0.006, 0.006, 0.002), atol=1e-3)
    np.testing.assert_allclose(np.diag(body_of(link).tensor), np.array((0.005, 0.005, 0.0003)) + cube[0, 0])


def test_weight_of_a_load_by_virtual_work(rng: np.random.Generator) -> None:
    """A point mass at the tool adds its weight times the height of the tool to the potential energy."""
    arm = load_arm("puma560")
    q = rng.normal(size=(5, 6))

    more = potential_energy(payload(arm, 2.0), q) - potential_energy(arm, q)

    np.testing.assert_allclose(more, 2.0 * STANDARD_GRAVITY * forward(arm, q)[:, 2, 3], atol=1e-12)


def test_load_on_a_massless_hand() -> None:
    """A hand without mass that holds nothing heavy stays without mass."""
    arm = Arm(name="rod", joints=[Joint(kind="revolute", a=1.0)])

    assert payload(arm, 0.0).links[-1] == Link()


def test_impossible_loads() -> None:
    """A load lighter than nothing and a centre of mass with two coordinates are refused."""
    arm = load_arm("stanford")
    with pytest.raises(InvalidValueError, match="mass must be 0 or more, got -1"):
        payload(arm, -1.0)
    with pytest.raises(ShapeError, match=r"com: expected a shape ending in \(3,\), got \(2,\)"):
        payload(arm, 1.0, com=(0.0, 1.0))
