"""The first three joints: where they must stand to put the wrist centre at a point, over abstract scalars.

The builds solved here all rotate about a first axis and carry the arm in a plane at a fixed distance beside it. So all
begin with the same question, which angle of joint 1 puts the point at that distance from the axis, and go on in the
plane of the arm, with an elbow or with a slide.

Angles are those of the build, not the joints' own: see ``ClosedFormGeometry``.
"""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

import attrs

from armwright.arrays import Array
from armwright.tracing.scalar import Scalar, atan2, cos, select, sin, sqrt
from armwright.tracing.vectors import Matrix, Vector

Family: TypeAlias = Literal["puma", "stanford", "parallel"]
Sign: TypeAlias = Literal[1, -1]
# Of arm, elbow or slide, and wrist.
Signs: TypeAlias = tuple[Sign, Sign, Sign]

# Roots of less than this part of their terms are 0: the two branches fall together there, and what rounding leaves
# of the radicand would be drawn out to a thousand times its size.
_VANISHING = 1e-14
# A wrist centre this close to an axis is on it [m].
ON_AXIS = 1e-12


@attrs.frozen(kw_only=True, eq=False)
class ClosedFormGeometry:
    """What a closed form needs of an arm: the lengths of its build, and how its joints count.

    In the shoulder frame z is the axis of joint 1 and the origin is at the height of joint 2; y is the axis of
    joint 2 while joint 1 stands at 0, pointing to the side where the wrist is. The angle of joint i is sign_i · q_i +
    offset_i, about z for joint 1 and about y for joints 2 and 3 (and 4 of a ``parallel`` arm); with all three at 0
    the arm lies along x, and the axis of joint 4 (``puma``) or the slide (``stanford``) points along z.

    Attributes:
        family: which closed form: an elbow and a spherical wrist (``puma``), a slide and a spherical wrist
            (``stanford``), three parallel axes (``parallel``).
        X_BS: (4, 4) the shoulder frame, seen from the base.
        signs: whether the joints count as the angles of the build do, 1 or -1.
        offsets: angles of the build where the joints stand at 0 [rad]; of a slide its length [m].
        shoulder_offset: distance of joint 2 from the axis of joint 1, along x [m].
        plane_offset: distance of the plane of the arm from the axis of joint 1 [m].
        upper_arm: length of the upper arm [m]; 0 with a slide.
        forearm: (along, across) of the forearm, from joint 3 to the wrist centre or to joint 4: the a3 and d4 of the
            PUMA; with a slide, how far the wrist centre lies beside the line through joint 2 [m].
        wrist_link: (x, z) from joint 4 to the point where the axes 5 and 6 meet, all joints at 0 (``parallel``) [m].
        tilt: rotation about y of the axis of joint 5 from z, all joints at 0 (``parallel``) [rad].
        R_3W: (3, 3) the fixed rotation from the forearm to the frame in which joints 4 to 6 are z, y, z angles.
        R_T6: (3, 3) the fixed rotation from the tool to the last of those.
        p_TW: (3,) the wrist centre seen from the tool [m].
    """

    family: Family
    X_BS: Array
    signs: tuple[float, ...]
    offsets: tuple[float, ...]
    shoulder_offset: float
    plane_offset: float
    upper_arm: float = 0.0
    forearm: tuple[float, float]
    wrist_link: tuple[float, float] = (0.0, 0.0)
    tilt: float = 0.0
    R_3W: Array
    R_T6: Array
    p_TW: Array

    @property
    def inner_radius(self) -> float:
        """Smallest distance of the wrist centre, or of joint 4, from joint 2 [m]."""
        return abs(self.upper_arm - math.hypot(*self.forearm)) if self.upper_arm else abs(self.forearm[0])

    @property
    def outer_radius(self) -> float:
        """Largest distance of the wrist centre, or of joint 4, from joint 2 [m]; a slide has none but its limit."""
        return self.upper_arm + math.hypot(*self.forearm) if self.upper_arm else math.inf

    @property
    def max_reach(self) -> float:
        """Largest distance of the wrist centre from the shoulder [m]; infinite for a slide."""
        in_plane = abs(self.shoulder_offset) + self.outer_radius + math.hypot(*self.wrist_link)
        return math.hypot(in_plane, self.plane_offset)

    def angles(self, q: Vector) -> Vector:
        """Return the angles of the build for joint positions, over abstract scalars."""
        return [s * x + o for s, x, o in zip(self.signs, q, self.offsets, strict=True)]

    def joints(self, angles: Vector) -> Vector:
        """Return the joint positions for angles of the build, over abstract scalars."""
        return [s * (x - o) for s, x, o in zip(self.signs, angles, self.offsets, strict=True)]


def rotated_about_y(angle: Scalar, x: Scalar, z: Scalar) -> tuple[Scalar, Scalar]:
    """Rotate the point (x, z) about y, over abstract scalars: from x towards -z."""
    c, s = cos(angle), sin(angle)
    return c * x + s * z, c * z - s * x


def rotation_about_z_then_y(first: Scalar, second: Scalar) -> Matrix:
    """Return the rotation by one angle about z and then by another about the y axis that was rotated."""
    c1, s1, c2, s2 = cos(first), sin(first), cos(second), sin(second)
    return [[c1 * c2, -s1, c1 * s2], [s1 * c2, c1, s1 * s2], [-s2, 0.0, c2]]


def solve_joint_1(geometry: ClosedFormGeometry, p: Vector, arm: Sign, free: Scalar) -> tuple[Scalar, Scalar]:
    """Return angle 1 and how far ahead of joint 2 the wrist centre is then, in the plane of the arm.

    With the wrist centre on the axis, and the plane through the axis, any angle will do: ``free`` is taken.
    """
    x, y, _ = p
    square = x * x + y * y
    across = root(square - geometry.plane_offset**2, square)
    theta = atan2(y, x) - atan2(geometry.plane_offset, arm * across)
    return select(square < ON_AXIS**2, free, theta), arm * across - geometry.shoulder_offset


def solve_elbow(geometry: ClosedFormGeometry, X: Scalar, Z: Scalar, elbow: Sign, free: Scalar) -> Vector:
    """Return angles 2 and 3 that put the end of the forearm at (X, Z) from joint 2; ``free`` where that is 0, 0."""
    a2, (a3, d4) = geometry.upper_arm, geometry.forearm
    fore = a3 * a3 + d4 * d4
    K = (X * X + Z * Z - a2 * a2 - fore) / (2 * a2)
    theta_3 = math.atan2(d4, a3) + elbow * atan2(root(fore - K * K, fore), K)
    u = a2 + a3 * cos(theta_3) + d4 * sin(theta_3)
    v = a3 * sin(theta_3) - d4 * cos(theta_3)
    theta_2 = atan2(-Z, X) - atan2(v, u)
    return [select(X * X + Z * Z < ON_AXIS**2, free, theta_2), theta_3]


def solve_slide(geometry: ClosedFormGeometry, X: Scalar, Z: Scalar, forwards: Sign, free: Scalar) -> Vector:
    """Return angle 2 and the length of the slide that reach (X, Z) from joint 2; ``free`` where that is 0, 0."""
    square, f = X * X + Z * Z, geometry.forearm[0]
    length = forwards * root(square - f * f, square)
    theta_2 = atan2(X * length - Z * f, X * f + Z * length)
    return [select(square < ON_AXIS**2, free, theta_2), length]


def reach_error(geometry: ClosedFormGeometry, p: Vector, X: Scalar, Z: Scalar) -> Scalar:
    """Return how far the configuration that stretches towards ``p`` stays from it [m]; 0 in reach.

    Args:
        geometry: the build.
        p: wrist centre in the shoulder frame [m].
        X: how far ahead of joint 2 the end of the forearm, or of the slide, should be, in the plane of the arm [m].
        Z: how far above it.
    """
    from_axis, distance = sqrt(p[0] * p[0] + p[1] * p[1]), sqrt(X * X + Z * Z)
    beside = _positive(abs(geometry.plane_offset) - from_axis)
    short = _positive(geometry.inner_radius - distance)
    if math.isfinite(geometry.outer_radius):
        short = short + _positive(distance - geometry.outer_radius)
    return sqrt(beside * beside + short * short)


def _positive(x: Scalar) -> Scalar:
    return select(x > 0, x, 0.0)


def root(radicand: Scalar, terms: Scalar) -> Scalar:
    """Return the root of a difference of such ``terms``; 0 where it is so small that rounding has made it."""
    return sqrt(select(radicand < _VANISHING * terms, 0.0, radicand))
