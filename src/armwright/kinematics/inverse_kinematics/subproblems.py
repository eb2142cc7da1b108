"""The subproblems into which a closed form is decomposed: one rotation each, over abstract scalars.

Whatever the arm, what is left to solve after its axes have been paired is always one of two questions: which rotation
about an axis brings a vector onto another, and which brings it to a height along a third direction. The first has one
answer, the second two.

Source:
    Paden (1986), subproblem 1; Elias & Wen (2022), "IK-Geo: Unified robot inverse kinematics using subproblem
    decomposition", subproblems 1 to 4, of which 2 and 3 are the ones here in another guise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armwright.kinematics.inverse_kinematics.geometry import Sign, root
from armwright.tracing.scalar import Scalar, atan2, cos, select, sin
from armwright.tracing.vectors import Vector, add, cross, dot, scale, subtract


class Turn(NamedTuple):
    """An angle, and whether any other would do as well.

    Attributes:
        angle: about the axis [rad].
        free: whether the vector lies along the axis, so that the angle was taken from elsewhere.
    """

    angle: Scalar
    free: Scalar


def rotated(axis: Sequence[Scalar], angle: Scalar, v: Sequence[Scalar]) -> Vector:
    """Return a vector rotated about a unit vector."""
    c, s = cos(angle), sin(angle)
    along = scale(dot(axis, v), axis)
    return add(along, scale(c, subtract(v, along)), scale(s, cross(axis, v)))


def turn_onto(
    axis: Sequence[Scalar], v: Sequence[Scalar], goal: Sequence[Scalar], *, otherwise: Scalar, tolerance: float
) -> Turn:
    """Return the rotation that brings ``v`` as near to ``goal`` as can be.

    Args:
        axis: unit vector to rotate about.
        v: the vector before.
        goal: where it should point.
        otherwise: the angle to take where one of both lies along the axis.
        tolerance: distance from the axis below which they do, in units of either.
    """
    across = subtract(goal, scale(dot(axis, goal), axis))
    aside = subtract(v, scale(dot(axis, v), axis))
    free = smaller_square(across, aside) < tolerance**2
    return Turn(select(free, otherwise, atan2(dot(axis, cross(v, goal)), dot(aside, across))), free)


def turn_to_height(
    axis: Sequence[Scalar],
    v: Sequence[Scalar],
    direction: Sequence[Scalar],
    height: Scalar,
    *,
    side: Sign,
    otherwise: Scalar,
    tolerance: float,
) -> Turn:
    """Return one of the two rotations that bring ``v`` to a height along a direction.

    Where neither does, both are the one that comes nearest.

    Args:
        axis: unit vector to rotate about.
        v: the vector before.
        direction: along which the height is measured; of any length, which the height is multiplied by.
        height: the product of the direction and the rotated vector.
        side: which of the two.
        otherwise: the angle to take where no rotation changes the height.
        tolerance: change of the height below which none does.
    """
    along = dot(axis, v)
    ahead = dot(direction, subtract(v, scale(along, axis)))
    aside = dot(direction, cross(axis, v))
    rest = height - dot(direction, axis) * along
    square = ahead * ahead + aside * aside
    free = square < tolerance**2
    angle = atan2(aside, ahead) + side * atan2(root(square - rest * rest, square), rest)
    return Turn(select(free, otherwise, angle), free)


def smaller_square(u: Sequence[Scalar], v: Sequence[Scalar]) -> Scalar:
    """Return the square of the length of the shorter vector."""
    one, other = dot(u, u), dot(v, v)
    return select(other < one, other, one)
