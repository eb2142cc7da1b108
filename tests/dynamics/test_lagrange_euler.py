"""Lagrange-Euler against Newton-Euler, and the skew symmetry behind energy."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.inertia_matrix import composite_rigid_body, mass_matrix
from armwright.dynamics.lagrange_euler import (
    coriolis_matrix,
    coriolis_tensor,
    inertia_coefficients,
    lagrange_euler,
    pose_derivatives,
    pseudo_inertia,
)
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.shares import coriolis_efforts
from armwright.kinematics.forward_kinematics import link_poses
from oracles.arms import random_arm, random_link
from oracles.catalogue import FEW, NAMES

AGREEMENT = 1e-10  # relative to the largest number


def _agree(ours: object, theirs: object) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=AGREEMENT * max(1.0, np.abs(theirs).max()))


def _compare(arm: Arm, rng: np.random.Generator) -> None:
    q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n)).tolist()
    _agree(lagrange_euler(arm, q, qd, qdd), newton_euler(arm, q, qd, qdd))
    _agree(inertia_coefficients(pose_derivatives(arm, q)), composite_rigid_body(arm, q))


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_catalogue_against_newton_euler(name: str, rng: np.random.Generator) -> None:
    """Energies and free bodies lead to the same efforts on every catalogue arm."""
    _compare(load_arm(name), rng)


def test_pose_derivatives_are_derivatives(rng: np.random.Generator) -> None:
    """U_ij and U_ijk are what small steps in the joints make of the pose of link i."""
    arm = random_arm(rng, 4)
    q, step = rng.normal(size=4), 1e-4
    shifts = step * np.eye(4)
    derivatives = pose_derivatives(arm, q.tolist())

    def pose_of_link(i: int, position: np.ndarray) -> np.ndarray:
        return link_poses(arm, position)[i + 1]

    for i in range(4):
        for j in range(i + 1):
            slope = (pose_of_link(i, q + shifts[j]) - pose_of_link(i, q - shifts[j])) / (2 * step)
            np.testing.assert_allclose(derivatives.first[i][j], slope, atol=1e-6)
            for k in range(j, i + 1):
                bend = sum(
                    sign * other * pose_of_link(i, q + sign * shifts[j] + other * shifts[k])
                    for sign in (1, -1)
                    for other in (1, -1)
                ) / (4 * step**2)
                np.testing.assert_allclose(derivatives.second[i][j, k], bend, atol=1e-5)


def test_pseudo_inertia_of_a_point() -> None:
    """A point of 2 kg at (1, 2, 3) has mass times coordinate times coordinate everywhere, and itself in the corner."""
    position = np.array((1.0, 2.0, 3.0, 1.0))

    np.testing.assert_allclose(pseudo_inertia(Link(mass=2.0, com=position[:3])), 2 * np.outer(position, position))


def test_pseudo_inertia_has_the_products(rng: np.random.Generator) -> None:
    """The trace of the pseudo-inertia gives back the whole tensor, products of inertia included."""
    link = random_link(rng)
    J = np.array(pseudo_inertia(link))[:3, :3]

    tensor = np.trace(J) * np.eye(3) - J

    lever = link.com @ link.com * np.eye(3) - np.outer(link.com, link.com)
    np.testing.assert_allclose(tensor, link.inertia + link.mass * lever, atol=1e-14)


def test_skew_symmetry_exactly(rng: np.random.Generator) -> None:
    """h_ijk + h_jik is the slope of D_ij along q_k, by which the skewness holds to the last digits."""
    arm = random_arm(rng, 5)
    q, qd = rng.normal(size=(2, 5))
    h = coriolis_tensor(arm, q)

    change = np.einsum("ijk,k->ij", h + h.swapaxes(0, 1), qd)
    S = change - 2 * coriolis_matrix(arm, q, qd)

    _agree(S, -S.T)
    step = 1e-5
    slope = (mass_matrix(arm, q + step * qd) - mass_matrix(arm, q - step * qd)) / (2 * step)
    np.testing.assert_allclose(change, slope, atol=1e-6 * np.abs(slope).max())


def test_coriolis_matrix_times_speeds(rng: np.random.Generator) -> None:
    """C qd are the efforts of Newton-Euler without acceleration and gravity, on a grid of configurations."""
    arm = random_arm(rng, 6)
    q, qd = rng.normal(size=(2, 2, 3, 6))

    C = coriolis_matrix(arm, q, qd)

    assert C.shape == (2, 3, 6, 6)
    _agree(np.einsum("...ij,...j->...i", C, qd), coriolis_efforts(arm, q, qd))


def test_elbow_by_hand() -> None:
    """The elbow of a two-link arm throws the shoulder with m l1 l2 sin(q2) times twice one speed times the other."""
    arm = Arm(
        name="elbow",
        joints=[Joint(kind="revolute", a=0.5), Joint(kind="revolute", a=0.3)],
        links=[Link(mass=2.0), Link(mass=1.5)],
    )
    throw = 1.5 * 0.5 * 0.3 * np.sin(0.7)

    h = coriolis_tensor(arm, [0.4, 0.7])

    expected = [[[0, -throw], [-throw, -throw]], [[throw, 0], [0, 0]]]
    np.testing.assert_allclose(h, expected, atol=1e-15)
