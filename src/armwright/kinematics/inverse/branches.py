"""All branches of a closed form for one pose, over abstract scalars: what is compiled for an arm."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from armwright.arm.model import Arm
from armwright.kinematics.inverse.posture import posture
from armwright.kinematics.inverse.shoulder import Shoulder, Sign
from armwright.tracing.scalar import Scalar, select, whole
from armwright.tracing.vectors import Matrix, Vector, add, apply, product, subtract, transpose

_SIGNS: tuple[Sign, Sign] = (1, -1)
# The order of the branches: arm, elbow (or slide), wrist.
BRANCHES: tuple[tuple[Sign, Sign, Sign], ...] = tuple((a, e, w) for a in _SIGNS for e in _SIGNS for w in _SIGNS)

# A posture that misses the place by less meets it; by more it is one that stretches towards it [m].
MET = 1e-9
_TURN = 2 * math.pi


class Branches(NamedTuple):
    """Eight postures of one pose, in the order of ``BRANCHES``.

    Attributes:
        q: joint positions of each, within half a turn of where the arm is.
        free: of each, which of three choices the pose leaves open: the turn of joint 1, the raising of joint 2, the
            wrist.
        miss: how far each keeps the hand from a place out of reach [m].
    """

    q: list[Vector]
    free: list[tuple[Scalar, Scalar, Scalar]]
    miss: list[Scalar]


def branches(arm: Arm, shoulder: Shoulder, R_BT: Matrix, p_BT: Vector, near: Sequence[Scalar]) -> Branches:
    """Return the eight postures for one pose, existing or not, over abstract scalars.

    Args:
        arm: the arm.
        shoulder: its build.
        R_BT: turn of the tool, seen from the base.
        p_BT: place of the tool, seen from the base [m].
        near: six joint positions; a free joint takes its value from here, and angles come near it.
    """
    p, R_S6 = _wrist(shoulder, R_BT, p_BT)
    wanted = shoulder.angles(list(near))
    found = [posture(shoulder, p, R_S6, signs, wanted) for signs in BRANCHES]
    return Branches(
        q=[_near(arm, shoulder.joints(one.angles), near) for one in found],
        free=[(one.turn_free, one.raise_free, one.wrist_free) for one in found],
        miss=[one.miss for one in found],
    )


def one_branch(
    arm: Arm, shoulder: Shoulder, R_BT: Matrix, p_BT: Vector, near: Sequence[Scalar], *, branch: int
) -> Vector:
    """Return the joint positions of one branch for one pose, whether it exists or not, over abstract scalars.

    Args:
        arm: the arm.
        shoulder: its build.
        R_BT: as for ``branches``.
        p_BT: as for ``branches``.
        near: as for ``branches``.
        branch: its number among ``BRANCHES``.
    """
    p, R_S6 = _wrist(shoulder, R_BT, p_BT)
    found = posture(shoulder, p, R_S6, BRANCHES[branch], shoulder.angles(list(near)))
    return _near(arm, shoulder.joints(found.angles), near)


def _wrist(shoulder: Shoulder, R_BT: Matrix, p_BT: Vector) -> tuple[Vector, Matrix]:
    """Return the wrist centre and the turn of the last wrist frame, seen from the shoulder frame."""
    R_SB = transpose(shoulder.X_BS[:3, :3].tolist())
    R_ST = product(R_SB, R_BT)
    p = add(apply(R_SB, subtract(p_BT, shoulder.X_BS[:3, 3].tolist())), apply(R_ST, shoulder.p_TW.tolist()))
    return p, product(R_ST, shoulder.R_T6.tolist())


def merged(found: Branches) -> tuple[list[Vector], list[Scalar]]:
    """Return eight postures that all exist, if any does, and whether a joint is free there, over abstract scalars.

    Those that do not exist repeat the first that does. Out of reach all stretch towards the place.
    """
    least = found.miss[0]
    for miss in found.miss[1:]:
        least = select(miss < least, miss, least)
    singular = [select(a, 1.0, select(b, 1.0, select(c, 1.0, 0.0))) for a, b, c in found.free]
    rows = [[*q, is_singular] for q, is_singular in zip(found.q, singular, strict=True)]
    first = rows[-1]
    for row, miss in reversed(list(zip(rows[:-1], found.miss[:-1], strict=True))):
        first = [select(miss <= MET, x, y) for x, y in zip(row, first, strict=True)]
    chosen = [
        [select(select(least <= MET, miss, 0.0) <= MET, x, y) for x, y in zip(row, first, strict=True)]
        for row, miss in zip(rows, found.miss, strict=True)
    ]
    return [row[:-1] for row in chosen], [row[-1] > 0 for row in chosen]


def _near(arm: Arm, q: Vector, near: Sequence[Scalar]) -> Vector:
    """Turn angles by whole turns to within half a turn of ``near``, whatever the limits."""
    return [
        x + _TURN * whole((at - x) * (1 / _TURN)) if joint.revolute else x
        for joint, x, at in zip(arm.joints, q, near, strict=True)
    ]
