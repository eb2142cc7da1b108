"""The parts of both laws: U_ij and h_ijk, the Coriolis matrix, forces and moments between links."""

import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.lagrange_euler import coriolis_matrix, coriolis_tensor, pose_derivative_matrices
from armwright.dynamics.newton_euler import inverse_dynamics, link_forces
from armwright.kinematics.forward_kinematics import link_poses
from oracles.arms import random_arm
from oracles.with_pinocchio import pinocchio_model

ARMS = ("puma560", "stanford-jpl", "ur5")
STEP = 1e-6


@pytest.mark.parametrize("name", ARMS)
def test_derivatives_of_poses(name: str, rng: np.random.Generator) -> None:
    """U_ij is what a small step of joint j changes of the pose of link i, and 0 for joints beyond the link."""
    arm = load_arm(name)
    q = rng.uniform(-2, 2, size=(3, arm.n))

    U = pose_derivative_matrices(arm, q)

    assert U.shape == (3, arm.n, arm.n, 4, 4)
    for j, step in enumerate(np.eye(arm.n) * STEP):
        slope = (link_poses(arm, q + step) - link_poses(arm, q - step))[:, 1:-1] / (2 * STEP)
        np.testing.assert_allclose(U[:, :, j], slope, atol=1e-8)
        assert not U[:, :j, j].any()


@pytest.mark.parametrize("name", ARMS)
def test_christoffel_symbols(name: str, rng: np.random.Generator) -> None:
    """h_ijk are the Christoffel symbols of the mass matrix, here of its differences."""
    arm = load_arm(name)
    q = rng.uniform(-2, 2, size=arm.n)
    M = lambda x: mass_matrix(arm, x, drives=False)  # noqa: E731
    dM = np.stack([(M(q + h) - M(q - h)) / (2 * STEP) for h in np.eye(arm.n) * STEP], axis=-1)  # i, j by k
    expected = (dM + dM.swapaxes(1, 2) - np.moveaxis(dM, 2, 0)) / 2

    np.testing.assert_allclose(coriolis_tensor(arm, q), expected, atol=1e-7)


def test_coriolis_matrix_is_the_one_of_pinocchio(rng: np.random.Generator) -> None:
    """C qd is what Pinocchio's C does, and dM/dt - 2 C is skew."""
    for arm in (*map(load_arm, ARMS), random_arm(rng, 5)):
        q, qd = rng.uniform(-2, 2, size=(2, arm.n))
        C = coriolis_matrix(arm, q, qd)
        model, data, _ = pinocchio_model(arm)
        np.testing.assert_allclose(C @ qd, pin.computeCoriolisMatrix(model, data, q, qd) @ qd, atol=1e-9)
        ahead, behind = (mass_matrix(arm, q + s * STEP * qd, drives=False) for s in (1, -1))
        N = (ahead - behind) / (2 * STEP) - 2 * C
        np.testing.assert_allclose(N, -N.T, atol=1e-6)


def check_forces(arm: Arm, rng: np.random.Generator) -> None:
    q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))
    model, data, _ = pinocchio_model(arm)
    pin.rnea(model, data, q, qd, qdd)
    pin.framesForwardKinematics(model, data, q)
    frames = link_poses(arm, q)

    force, moment = link_forces(arm, q, qd, qdd)

    # Pinocchio's joint frames stand on frame i-1 of the table and move with the joint; its forces are seen from there.
    for i in range(arm.n):
        R = frames[i + 1, :3, :3].T @ data.oMi[i + 1].rotation
        theirs = data.f[i + 1]
        lever = frames[i + 1, :3, :3].T @ (data.oMi[i + 1].translation - frames[i, :3, 3])
        np.testing.assert_allclose(force[i], R @ theirs.linear, atol=1e-9)
        np.testing.assert_allclose(moment[i], R @ theirs.angular + np.cross(lever, force[i]), atol=1e-9)


def test_forces_between_links(rng: np.random.Generator) -> None:
    """Forces and moments in the joints are Pinocchio's, and their part along the axis is the effort."""
    for arm in (*map(load_arm, ARMS), random_arm(rng, 7)):
        check_forces(arm, rng)
        q, qd, qdd = rng.uniform(-2, 2, size=(3, 4, arm.n))
        force, moment = link_forces(arm, q, qd, qdd)
        frames = link_poses(arm, q)
        for i, joint in enumerate(arm.joints):
            axis = np.einsum("kba,kb->ka", frames[:, i + 1, :3, :3], frames[:, i, :3, 2])
            effort = np.einsum("ka,ka->k", moment[:, i] if joint.revolute else force[:, i], axis)
            np.testing.assert_allclose(effort, inverse_dynamics(arm, q, qd, qdd, drives=False)[:, i], atol=1e-9)


def test_a_hanging_weight() -> None:
    """At rest the first joint of a PUMA bears the weight of all links, upwards."""
    arm = load_arm("puma560")
    still = np.zeros(6)
    weight = sum(link.mass for link in arm.links) * 9.80665
    R = link_poses(arm, still)[1, :3, :3]
    np.testing.assert_allclose(R @ link_forces(arm, still, still, still).force[0], (0, 0, weight), atol=1e-9)
