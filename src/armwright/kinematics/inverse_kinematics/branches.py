"""What a closed form is: all branches of a pose, over abstract scalars, so that they can be compiled for an arm."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward, link_frames, per_joint, stack, tool_frame
from armwright.kinematics.inverse_kinematics.geometry import Sign
from armwright.tracing.scalar import Scalar, round_half_even, select, sqrt
from armwright.tracing.vectors import Matrix, Vector, dot, subtract

# A configuration whose tool is closer than this to the pose reaches it; others stretch towards it [m], [rad].
REACH_TOLERANCE = 1e-9
_TURN = 2 * math.pi


class Solved(NamedTuple):
    """One branch of one pose.

    Attributes:
        q: joint positions.
        free: whether joints, by their numbers from 1, may stand anywhere, and so took their value from elsewhere.
        reach_error: distance of the tool from a position out of reach [m]; None where only the tool can tell.
    """

    q: Vector
    free: Mapping[int, Scalar]
    reach_error: Scalar | None = None


class Branches(NamedTuple):
    """The joint configurations of one pose.

    Attributes:
        q: joint positions of each, within 180 deg of where the arm is.
        free: of each, which of the joints that a closed form says are ``choosers`` the pose leaves open.
        reach_error: how far the tool of each stays from a pose out of reach [m], [rad].
    """

    q: list[Vector]
    free: list[tuple[Scalar, ...]]
    reach_error: list[Scalar]


@attrs.frozen(kw_only=True, eq=False)
class ClosedForm(ABC):
    """How all branches of the poses of an arm are found.

    Attributes:
        signs: of each branch, which of the two answers each choice takes.
        choosers: the joints that some pose leaves open, from 1: they stay where the arm is.
    """

    signs: tuple[tuple[Sign, ...], ...]
    choosers: tuple[int, ...]

    @abstractmethod
    def solve(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch, whether it exists or not, over abstract scalars.

        Args:
            R_BT: orientation of the tool, seen from the base.
            p_BT: position of the tool, seen from the base [m].
            near: joint positions; what the pose leaves open takes its value from here.
            signs: those of the branch.
        """

    @abstractmethod
    def label(self, branch: int, q: Array) -> str:
        """Name a branch by how the arm stands at its joint positions (n,)."""

    def labels(self, arm: Arm, q: Array) -> list[str]:
        """Name the branches that configurations (k, n) are in."""
        X = forward(arm, q)
        found = self.branches(arm, [per_joint(X[..., i, :3]) for i in range(3)], per_joint(X[..., :3, 3]), list(q.T))
        apart = [stack(each, q.shape[:-1]) - q for each in found.q]
        return [self.label(int(i), row) for i, row in zip(np.abs(apart).max(axis=-1).argmin(axis=0), q, strict=True)]

    def moving(self, free: Sequence[bool]) -> set[int] | None:
        """Return the joints that move together where choosers are free; None where that is not known beforehand."""
        return None if any(free) else set()

    def branch(self, arm: Arm, R_BT: Matrix, p_BT: Vector, near: Vector, number: int) -> Solved:
        """Return one branch by its number, with angles within 180 deg of where the arm is."""
        solved = self.solve(R_BT, p_BT, near, self.signs[number])
        return solved._replace(q=_near(arm, solved.q, near))

    def branches(self, arm: Arm, R_BT: Matrix, p_BT: Vector, near: Sequence[Scalar]) -> Branches:
        """Return all branches of one pose, existing or not, over abstract scalars.

        Args:
            arm: the arm.
            R_BT: orientation of the tool, seen from the base.
            p_BT: position of the tool, seen from the base [m].
            near: joint positions; a free joint takes its value from here, and angles come near it.
        """
        solved = [self.branch(arm, R_BT, p_BT, list(near), number) for number in range(len(self.signs))]
        return Branches(
            q=[each.q for each in solved],
            free=[tuple(each.free[joint] for joint in self.choosers) for each in solved],
            reach_error=[
                _tool_error(arm, each.q, R_BT, p_BT) if each.reach_error is None else each.reach_error
                for each in solved
            ],
        )


def merged(solutions: Branches) -> tuple[list[Vector], list[Scalar]]:
    """Return joint configurations that exist, if any does, and whether a joint is free, over abstract scalars.

    Those that do not exist repeat the first that does. Out of reach all stretch towards the position.
    """
    least = solutions.reach_error[0]
    for error in solutions.reach_error[1:]:
        least = select(error < least, error, least)
    singular = []
    for flags in solutions.free:
        any_free: Scalar = 0.0
        for flag in flags:
            any_free = select(flag, 1.0, any_free)
        singular.append(any_free)
    rows = [[*q, is_singular] for q, is_singular in zip(solutions.q, singular, strict=True)]
    first = rows[-1]
    for row, error in reversed(list(zip(rows[:-1], solutions.reach_error[:-1], strict=True))):
        first = [select(error <= REACH_TOLERANCE, x, y) for x, y in zip(row, first, strict=True)]
    chosen = [
        [
            select(select(least <= REACH_TOLERANCE, error, 0.0) <= REACH_TOLERANCE, x, y)
            for x, y in zip(row, first, strict=True)
        ]
        for row, error in zip(rows, solutions.reach_error, strict=True)
    ]
    return [row[:-1] for row in chosen], [row[-1] > 0 for row in chosen]


def _near(arm: Arm, q: Vector, near: Sequence[Scalar]) -> Vector:
    """Shift angles by whole revolutions to within 180 deg of ``near``, whatever the limits."""
    return [
        x + _TURN * round_half_even((x_near - x) * (1 / _TURN)) if joint.revolute else x
        for joint, x, x_near in zip(arm.joints, q, near, strict=True)
    ]


def _tool_error(arm: Arm, q: Vector, R_BT: Matrix, p_BT: Vector) -> Scalar:
    """Return how far the tool is from a pose: the root of the squared distance and the squared angle, while small."""
    R, p = tool_frame(arm, link_frames(arm, q)[-1])
    away = subtract(p, p_BT)
    turned = [x - y for row, other in zip(R, R_BT, strict=True) for x, y in zip(row, other, strict=True)]
    return sqrt(dot(away, away) + 0.5 * dot(turned, turned))
