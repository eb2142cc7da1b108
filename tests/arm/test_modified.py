"""The kinematics and dynamics of modified Denavit-Hartenberg tables."""

import math

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.dh import from_modified
from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from oracles.arms import random_arm

# Products of a dozen transforms with lengths of some metres.
ROUNDING = 1e-12
# Relative to the largest effort, as for standard arms.
AGREEMENT = 1e-10


def in_front(joint: Joint) -> pin.SE3:
    """What stands in front of joint i in Craig's convention: Rx(alpha) Tx(a) Rz(theta) Tz(d)."""
    x, z = np.array((1.0, 0, 0)), np.array((0, 0, 1.0))
    turn = pin.SE3(pin.AngleAxis(joint.alpha, x).matrix(), joint.a * x)
    return turn * pin.SE3(pin.AngleAxis(joint.theta, z).matrix(), joint.d * z)


def in_pinocchio(table: Arm) -> pin.Model:
    """A modified table in Pinocchio: joint i turns or slides on the z axis of frame i, and link i is seen from it."""
    model, parent, base = pin.Model(), 0, pin.SE3(table.base)
    for i, (joint, link) in enumerate(zip(table.joints, table.links, strict=True)):
        kind = pin.JointModelRZ() if joint.revolute else pin.JointModelPZ()
        parent = model.addJoint(parent, kind, base * in_front(joint), f"joint {i + 1}")
        model.appendBodyToJoint(parent, pin.Inertia(link.mass, link.com, link.inertia), pin.SE3.Identity())
        base = pin.SE3.Identity()
    model.gravity.linear = table.gravity.copy()
    return model


@pytest.mark.parametrize("joints", range(1, 8))
def test_against_pinocchio(joints: int, rng: np.random.Generator) -> None:
    """Pinocchio, given the modified frames themselves, has the hand there and asks those efforts."""
    for _ in range(3):
        table = random_arm(rng, joints)
        before, rows, links = from_modified(table.joints, table.links)
        arm = attrs.evolve(table, joints=rows, links=links, base=table.base @ before)
        model = in_pinocchio(table)
        data = model.createData()
        for q, qd, qdd in rng.uniform(-2, 2, size=(5, 3, joints)):
            expected = pin.rnea(model, data, q, qd, qdd)
            pin.forwardKinematics(model, data, q)
            hand = data.oMi[joints].homogeneous @ table.tool

            tau = inverse_dynamics(arm, q, qd, qdd, drives=False)

            np.testing.assert_allclose(forward(arm, q), hand, atol=100 * ROUNDING)
            np.testing.assert_allclose(tau, expected, atol=AGREEMENT * max(1.0, np.abs(expected).max()))


def test_right_angles_stay_exact() -> None:
    """Twists of right angles leave the base and the centres of mass free of rounding."""
    rows = [Joint(kind="revolute", alpha=math.pi / 2, a=0.1), Joint(kind="revolute", alpha=-math.pi / 2, a=0.2)]

    before, joints, links = from_modified(rows, [Link(mass=1, com=[0, 0, 0.3]), Link()])

    np.testing.assert_array_equal(before, [[1, 0, 0, 0.1], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    assert [(joint.a, joint.alpha) for joint in joints] == [(0.2, -math.pi / 2), (0.0, 0.0)]
    # Frame 1 moves by 0.2 along x and turns by -90 degrees about it: what was z is minus y there.
    np.testing.assert_array_equal(links[0].com, (-0.2, -0.3, 0))
