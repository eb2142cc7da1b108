"""Which configuration to take at each of several poses: one branch kept where it can be, else the shortest path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.revolutions import equivalent_configurations, joint_distances
from armwright.kinematics.inverse_kinematics.solution import InverseSolution
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.obstruction import PathError, cause_of


class LabelledConfiguration(NamedTuple):
    """Joint positions (n,) inside the limits, and the branch that they belong to."""

    label: str
    q: Array


def allowed_configurations(solution: InverseSolution) -> list[LabelledConfiguration]:
    """Return the configurations of a solution inside the limits, revolutions included."""
    return [
        LabelledConfiguration(branch.label, q)
        for branch in solution.allowed
        for q in equivalent_configurations(solution.arm, branch.q)
    ]


def nearest_configurations(solution: InverseSolution, near: Array) -> list[Array]:
    """Return the configurations (n,) of a solution inside the limits, revolutions included, nearest first."""
    configurations = [each.q for each in allowed_configurations(solution)]
    return sorted(configurations, key=lambda q: float(joint_distances(solution.arm, near, q)))


def configurations_at(arm: Arm, X: Array, near: Array) -> list[list[LabelledConfiguration]]:
    """Return the configurations inside the limits at every pose, revolutions included.

    Args:
        arm: the arm.
        X: (k, 4, 4) poses.
        near: (n,) joint positions near which the first ones are sought; without a closed form it decides what is found.

    Raises:
        PathError: a pose has none; ``segment`` is the one that leads to it, from 0.
    """
    layers: list[list[LabelledConfiguration]] = []
    for i, pose in enumerate(X):
        solution = inverse(arm, pose, near)
        if not solution.allowed:
            raise PathError(cause_of(solution), max(i - 1, 0), min(i, 1.0), f"pose {i + 1}: {solution.explain()}")
        layers.append(allowed_configurations(solution))
        near = layers[-1][0].q
    return layers


def configurations_through(arm: Arm, X: Array, near: Array) -> list[LabelledConfiguration]:
    """Return a configuration for every pose: of one branch where it is inside the limits throughout, else of any.

    Of all such sequences the shortest is taken, measured by the sum of the times that the joints need for it.

    Args:
        arm: the arm.
        X: (k, 4, 4) poses.
        near: (n,) where the arm comes from.

    Raises:
        PathError: a pose has no configuration inside the limits.
    """
    layers = configurations_at(arm, X, near)
    common = set.intersection(*({configuration.label for configuration in layer} for layer in layers))
    if common:
        by_branch = [[[p for p in layer if p.label == label] for layer in layers] for label in sorted(common)]
        paths = [_shortest(arm, near, same_branch) for same_branch in by_branch]
        return min(paths, key=lambda path: path[0])[1]
    return _shortest(arm, near, layers)[1]


def _shortest(
    arm: Arm, near: Array, layers: Sequence[Sequence[LabelledConfiguration]]
) -> tuple[float, list[LabelledConfiguration]]:
    """Return the shortest path through one configuration of every layer, and its length."""
    previous, lengths, predecessors = near[None], np.zeros(1), []
    for layer in layers:
        q = np.array([configuration.q for configuration in layer])
        sums = lengths[:, None] + joint_distances(arm, previous[:, None], q)
        predecessors.append(sums.argmin(axis=0))
        previous, lengths = q, sums.min(axis=0)
    last = int(lengths.argmin())
    length, chosen = float(lengths[last]), []
    for layer, best in zip(reversed(layers), reversed(predecessors), strict=True):
        chosen.append(layer[last])
        last = int(best[last])
    return length, chosen[::-1]
