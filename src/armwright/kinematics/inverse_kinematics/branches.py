"""All branches of a closed form for one pose, over abstract scalars: what is compiled for an arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from armwright.arm.model import Arm
from armwright.kinematics.inverse_kinematics.branch_angles import branch_angles
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, Sign, Signs
from armwright.tracing.scalar import Scalar, round_half_even, select
from armwright.tracing.vectors import Matrix, Vector, add, apply, product, subtract, transpose

_SIGNS: tuple[Sign, Sign] = (1, -1)
# The order of the branches: arm, elbow (or slide), wrist.
BRANCHES: tuple[Signs, ...] = tuple((a, e, w) for a in _SIGNS for e in _SIGNS for w in _SIGNS)

# A configuration whose tool is closer than this to the position reaches it; others stretch towards it [m].
REACH_TOLERANCE = 1e-9
_TURN = 2 * math.pi


class Branches(NamedTuple):
    """Eight joint configurations of one pose, in the order of ``BRANCHES``.

    Attributes:
        q: joint positions of each, within 180 deg of where the arm is.
        free: of each, which of three choices the pose leaves open: the side of joint 1, the raising of joint 2, the
            wrist.
        reach_error: distance of the tool of each from a position out of reach [m].
    """

    q: list[Vector]
    free: list[tuple[Scalar, Scalar, Scalar]]
    reach_error: list[Scalar]


def branches(arm: Arm, geometry: ClosedFormGeometry, R_BT: Matrix, p_BT: Vector, near: Sequence[Scalar]) -> Branches:
    """Return the eight joint configurations for one pose, existing or not, over abstract scalars.

    Args:
        arm: the arm.
        geometry: its lengths and offsets.
        R_BT: orientation of the tool, seen from the base.
        p_BT: position of the tool, seen from the base [m].
        near: six joint positions; a free joint takes its value from here, and angles come near it.
    """
    p, R_S6 = _wrist(geometry, R_BT, p_BT)
    angles = geometry.angles(list(near))
    solutions = [branch_angles(geometry, p, R_S6, signs, angles) for signs in BRANCHES]
    return Branches(
        q=[_near(arm, geometry.joints(solution.angles), near) for solution in solutions],
        free=[(solution.turn_free, solution.raise_free, solution.wrist_free) for solution in solutions],
        reach_error=[solution.reach_error for solution in solutions],
    )


def single_branch(
    arm: Arm, geometry: ClosedFormGeometry, R_BT: Matrix, p_BT: Vector, near: Sequence[Scalar], *, branch: int
) -> Vector:
    """Return the joint positions of one branch for one pose, whether it exists or not, over abstract scalars.

    Args:
        arm: the arm.
        geometry: its lengths and offsets.
        R_BT: as for ``branches``.
        p_BT: as for ``branches``.
        near: as for ``branches``.
        branch: its number among ``BRANCHES``.
    """
    p, R_S6 = _wrist(geometry, R_BT, p_BT)
    solution = branch_angles(geometry, p, R_S6, BRANCHES[branch], geometry.angles(list(near)))
    return _near(arm, geometry.joints(solution.angles), near)


def _wrist(geometry: ClosedFormGeometry, R_BT: Matrix, p_BT: Vector) -> tuple[Vector, Matrix]:
    """Return the wrist centre and the orientation of the last wrist frame, seen from the shoulder frame."""
    R_SB = transpose(geometry.X_BS[:3, :3].tolist())
    R_ST = product(R_SB, R_BT)
    p = add(apply(R_SB, subtract(p_BT, geometry.X_BS[:3, 3].tolist())), apply(R_ST, geometry.p_TW.tolist()))
    return p, product(R_ST, geometry.R_T6.tolist())


def merged(solutions: Branches) -> tuple[list[Vector], list[Scalar]]:
    """Return eight joint configurations that exist, if any does, and whether a joint is free, over abstract scalars.

    Those that do not exist repeat the first that does. Out of reach all stretch towards the position.
    """
    least = solutions.reach_error[0]
    for error in solutions.reach_error[1:]:
        least = select(error < least, error, least)
    singular = [select(a, 1.0, select(b, 1.0, select(c, 1.0, 0.0))) for a, b, c in solutions.free]
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
