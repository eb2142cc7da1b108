"""Which configuration is taken at each of several poses: against all that could be."""

from itertools import product

import attrs
import numpy as np

from armwright.arm.load import load_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import allowed_configurations, configurations_through

PUMA = load_arm("puma560-seed")


def test_the_shortest_of_all(rng: np.random.Generator) -> None:
    """Of all sequences, of one branch where there are such, the shortest by the speeds of the joints is taken."""
    once_round = {"lower": -np.pi, "upper": np.pi}
    joints = [attrs.evolve(joint, limits=attrs.evolve(joint.limits, **once_round)) for joint in PUMA.joints]
    arm, speed = attrs.evolve(PUMA, joints=joints), PUMA.limits.speed
    for _ in range(8):
        near, *Q = rng.uniform(-np.pi, np.pi, (3, 6))
        X = forward(arm, np.array(Q))
        layers = [allowed_configurations(inverse(arm, pose, near)) for pose in X]

        found = configurations_through(arm, X, near)

        def length(way: tuple[np.ndarray, ...], near: np.ndarray = near) -> float:
            return sum(float(np.linalg.norm((b - a) / speed)) for a, b in zip((near, *way), way, strict=False))

        ways = list(product(*layers))
        of_one = [way for way in ways if len({each.label for each in way}) == 1]
        shortest = min(length(tuple(each.q for each in way)) for way in of_one or ways)
        assert abs(length(tuple(each.q for each in found)) - shortest) < 1e-9


def test_a_joint_that_turns_on_and_on() -> None:
    """A joint without limits is followed on, not sought near where it began."""
    joints = list(PUMA.joints)
    joints[0] = attrs.evolve(joints[0], limits=attrs.evolve(joints[0].limits, lower=-np.inf, upper=np.inf))
    endless = attrs.evolve(PUMA, joints=joints)
    Q = np.tile([0.0, 0.2, 0.6, 0.3, 0.9, 0.1], (3, 1))
    Q[:, 0] = np.arange(3) * 2.5

    found = configurations_through(endless, forward(endless, Q), Q[0])

    np.testing.assert_allclose([each.q for each in found], Q, atol=1e-8)
