"""Images of joint configurations by whole turns: bounded, whatever the limits."""

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.revolutions import equivalent_configurations, nearest_equivalent
from armwright.kinematics.inverse_kinematics.solve import inverse

Q = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)


def wide(turns: float, *, offset: float = 0.0) -> Arm:
    arm = load_arm("puma560")
    limits = Limits(lower=2 * np.pi * (offset - turns), upper=2 * np.pi * (offset + turns))
    return attrs.evolve(arm, joints=[attrs.evolve(joint, limits=limits) for joint in arm.joints])


@pytest.mark.parametrize("turns", [20.0, 1e9, 1e90])
def test_room_for_many_turns(turns: float) -> None:
    """Limits of very many turns have very many images: some thousand are listed, the nearest among them."""
    arm = wide(turns)

    rows = equivalent_configurations(arm, Q)

    assert 1000 < len(rows) <= 4096
    assert (np.abs(rows - Q).max(axis=1) < 1e-9).sum() == 1
    near = np.array(Q) + 2 * np.pi * np.array([3, -2, 0, 1, 0, 0])
    np.testing.assert_allclose(nearest_equivalent(arm, Q, near), near, atol=1e-9)
    solution = inverse(arm, forward(arm, Q), near)
    assert len(solution.branches) == 8


def test_all_of_few() -> None:
    """Where there is room for two turns of every joint, all images are listed."""
    rows = equivalent_configurations(wide(1.0), Q)

    assert len(rows) == 64
    np.testing.assert_allclose(np.unique(np.round((rows - Q) / (2 * np.pi), 9)), [-1, 0])


def test_limits_far_from_here() -> None:
    """The image nearest to a start far away is the one at the nearer end of the limits."""
    q = nearest_equivalent(wide(10_000.0, offset=50_000.0), Q, Q)

    np.testing.assert_allclose(q, np.array(Q) + 40_000 * 2 * np.pi, atol=1e-6)
