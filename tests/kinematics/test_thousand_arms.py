"""Where a thousand random arms stand and how they move, against Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.kinematics.jacobians import Axes, jacobian, jacobian_rate, tool_twist
from armwright.spatial.rotations import exact_sine
from oracles.thousand import AGREEMENT, Case, deviation, largest_deviation, thousand_arms

pytestmark = pytest.mark.proof

REFERENCE = {"base": pin.LOCAL_WORLD_ALIGNED, "tool": pin.LOCAL}


def test_what_the_arms_are() -> None:
    """There are a thousand of two to nine joints and twenty of one, slides among them, with products of inertia."""
    arms = [case.arm for case in thousand_arms()]
    joints = [joint for arm in arms for joint in arm.joints]

    # `make test` has the first hundred of them, and two of one joint.
    counts = [20, *[125] * 8] if len(arms) > 1000 else [2, 13, 13, 13, 13, 12, 12, 12, 12]
    assert [sum(arm.n == n for arm in arms) for n in range(1, 10)] == counts
    assert 0.5 < np.mean([joint.revolute for joint in joints]) < 0.7
    assert all(np.abs(np.triu(link.inertia, 1)).max() > 0 for arm in arms for link in arm.links)
    assert 0.4 < np.mean([exact_sine(joint.alpha) in (0, 1, -1) for joint in joints]) < 0.6
    assert min(np.abs(arm.tool - np.eye(4)).max() for arm in arms) > 0
    assert min(np.abs(arm.base - np.eye(4)).max() for arm in arms) > 0


def test_poses() -> None:
    """Pinocchio puts the tool in the same place, turned the same way."""

    def theirs(case: Case) -> Array:
        model, data = case.links
        pin.framesForwardKinematics(model, data, case.q)
        return data.oMf[case.tool].homogeneous

    assert largest_deviation(lambda case: forward(case.arm, case.q), theirs) < AGREEMENT


def test_poses_of_the_links() -> None:
    """Every link is where Pinocchio puts it, seen by its centre of mass and the axes of its tensor."""
    worst = 0.0
    for case in thousand_arms():
        model, data = case.links
        pin.forwardKinematics(model, data, case.q)
        for X, link, body, X_joint in zip(
            link_poses(case.arm, case.q)[1:-1], case.arm.links, model.inertias[1:], data.oMi[1:], strict=True
        ):
            R, p = X[:3, :3], X[:3, 3]
            R_joint = X_joint.rotation
            worst = max(
                worst,
                deviation(p + R @ link.com, X_joint.act(body.lever)),
                deviation(R @ link.inertia @ R.T, R_joint @ body.inertia @ R_joint.T),
            )

    assert worst < AGREEMENT


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_jacobian(frame: Axes) -> None:
    """Pinocchio's tool moves and turns the same way when each joint moves."""

    def theirs(case: Case) -> Array:
        return pin.computeFrameJacobian(*case.links, case.q, case.tool, REFERENCE[frame]).reshape(6, case.arm.n)

    assert largest_deviation(lambda case: jacobian(case.arm, case.q, frame), theirs) < AGREEMENT


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_jacobian_rate(frame: Axes) -> None:
    """Pinocchio's Jacobian changes with time as ours does."""

    def theirs(case: Case) -> Array:
        model, data = case.links
        pin.computeJointJacobiansTimeVariation(model, data, case.q, case.qd)
        pin.updateFramePlacements(model, data)
        return pin.getFrameJacobianTimeVariation(model, data, case.tool, REFERENCE[frame]).reshape(6, case.arm.n)

    assert largest_deviation(lambda case: jacobian_rate(case.arm, case.q, case.qd, frame), theirs) < AGREEMENT


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_twist(frame: Axes) -> None:
    """Pinocchio's tool moves and turns as fast."""

    def theirs(case: Case) -> Array:
        model, data = case.links
        pin.forwardKinematics(model, data, case.q, case.qd)
        return pin.getFrameVelocity(model, data, case.tool, REFERENCE[frame]).vector

    assert largest_deviation(lambda case: tool_twist(case.arm, case.q, case.qd, frame), theirs) < AGREEMENT


def test_acceleration_that_speeds_give() -> None:
    """Without acceleration of the joints Pinocchio's tool accelerates by the Jacobian rate times the speeds."""

    def theirs(case: Case) -> Array:
        model, data = case.links
        pin.forwardKinematics(model, data, case.q, case.qd, np.zeros(case.arm.n))
        return pin.getFrameClassicalAcceleration(model, data, case.tool, pin.LOCAL_WORLD_ALIGNED).vector

    assert largest_deviation(lambda case: jacobian_rate(case.arm, case.q, case.qd) @ case.qd, theirs) < AGREEMENT


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_acceleration(frame: Axes) -> None:
    """Pinocchio's tool accelerates by the Jacobian times the accelerations and its rate times the speeds.

    In tool axes that is how the components of the twist change, in base axes how the tool point accelerates.
    """
    acceleration = {"base": pin.getFrameClassicalAcceleration, "tool": pin.getFrameAcceleration}[frame]

    def ours(case: Case) -> Array:
        J, J_rate = jacobian(case.arm, case.q, frame), jacobian_rate(case.arm, case.q, case.qd, frame)
        return J @ case.qdd + J_rate @ case.qd

    def theirs(case: Case) -> Array:
        model, data = case.links
        pin.forwardKinematics(model, data, case.q, case.qd, case.qdd)
        return acceleration(model, data, case.tool, REFERENCE[frame]).vector

    assert largest_deviation(ours, theirs) < AGREEMENT
