"""One branch of one arm: all six angles that bring the tool to a pose, over abstract scalars."""

from __future__ import annotations

import math
from typing import NamedTuple

from armwright.kinematics.inverse_kinematics.geometry import (
    ON_AXIS,
    ClosedFormGeometry,
    Sign,
    Signs,
    reach_error,
    rotated_about_y,
    rotation_about_z_then_y,
    solve_elbow,
    solve_joint_1,
    solve_slide,
)
from armwright.tracing.scalar import Scalar, atan2, cos, select, sin, sqrt
from armwright.tracing.vectors import Matrix, Vector, product, transpose

# Below this sine of joint 5 the axes of joints 4 and 6 fall together and only their sum is determined. The
# entries it is read from carry rounding of about 1e-16, so joint 4 still keeps some six digits here.
SINGULAR_SINE = 1e-10


class BranchAngles(NamedTuple):
    """Angles of the build, and which of the three choices a pose may leave open it does.

    ``turn_free``: the wrist centre is on the axis of joint 1. ``raise_free``: it is, or joint 4 is, on the axis of
    joint 2. ``wrist_free``: joint 5 is straight. ``reach_error``: how far the tool stays from a position out of
    reach [m].
    """

    angles: Vector
    turn_free: Scalar
    raise_free: Scalar
    wrist_free: Scalar
    reach_error: Scalar


def branch_angles(geometry: ClosedFormGeometry, p: Vector, R: Matrix, signs: Signs, near: Vector) -> BranchAngles:
    """Return the angles of one branch; a point out of reach gives the one that stretches, or folds, towards it.

    Args:
        geometry: of the arm.
        p: wrist centre in the shoulder frame [m].
        R: orientation of the last wrist frame (``R_T6`` from the tool), seen from the shoulder frame.
        signs: arm, 1 for the left one as PUMA users say, which reaches out on the side joint 1 faces, -1 for the right;
            which elbow, or the direction of the slide; which wrist.
        near: six angles; a free one takes its value from here.

    Source:
        PUMA: Paul (1981) ch. 3. Stanford: Paul (1981) ch. 3; TR-83-008 appendix 1.
    """
    arm, elbow, flip = signs
    if geometry.family == "parallel":
        return _parallel(geometry, p, R, signs, near)
    theta_1, X = solve_joint_1(geometry, p, arm, near[0])
    if geometry.family == "stanford":
        second, third = solve_slide(geometry, X, p[2], elbow, near[1])
        raised = second
    else:
        second, third = solve_elbow(geometry, X, p[2], elbow, near[1])
        raised = second + third
    R_SW = product(rotation_about_z_then_y(theta_1, raised), geometry.R_3W.tolist())
    last, wrist_free = last_three(product(transpose(R_SW), R), flip, near[3])
    angles = [theta_1, second, third, *last]
    return BranchAngles(angles, _vanish(*p[:2]), _vanish(X, p[2]), wrist_free, reach_error(geometry, p, X, p[2]))


def _parallel(geometry: ClosedFormGeometry, p: Vector, R: Matrix, signs: Signs, near: Vector) -> BranchAngles:
    """Solve three parallel axes: joint 1 by the side, 5, 6 and the sum of 2 to 4 by the orientation, 2 by the position.

    The rotation after joint 1 is about y, z and y: the parallel joints together, joint 5, joint 6. With joint 5
    straight only the sum of the outer two is determined; joint 6 then stays near, or where the arm still reaches.

    Source:
        Hawkins (2013), "Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms", in other frames.
    """
    arm, elbow, flip = signs
    other = -flip
    theta_1, X = solve_joint_1(geometry, p, arm, near[0])
    R_SW = product(rotation_about_z_then_y(theta_1, 0.0), geometry.R_3W.tolist())
    # Read backwards, so that it is joint 6 that is free with joint 5 straight, and not the sum.
    back = transpose(product(transpose(R_SW), R))
    last, wrist_free = last_three(back, other, -near[5])
    lift = _into_reach(geometry, X, p[2], -last[2] - geometry.tilt)
    lift = select(back[2][2] < 0, -lift, lift)
    last, wrist_free = last_three(back, other, -near[5] + lift)
    theta_6, theta_5, raised = -last[0], -last[1], -last[2] - geometry.tilt
    x, z = rotated_about_y(raised, *geometry.wrist_link)
    theta_2, theta_3 = solve_elbow(geometry, X - x, p[2] - z, elbow, near[1])
    angles = [theta_1, theta_2, theta_3, raised - theta_2 - theta_3, theta_5, theta_6]
    error = reach_error(geometry, p, X - x, p[2] - z)
    return BranchAngles(angles, _vanish(*p[:2]), _vanish(X - x, p[2] - z), wrist_free, error)


def last_three(R_36: Matrix, flip: Sign, theta_4_free: Scalar) -> tuple[Vector, Scalar]:
    """Return joint angles 4 to 6 for a rotation ``R_36`` of the tool against the forearm, and whether joint 4 is free.

    Joint 6 is solved with joint 4 put back in, so the three always reproduce the rotation, at and near the
    singularity as elsewhere.

    Args:
        R_36: rotation of frame 6 seen from frame 3.
        flip: 1 for joint 5 positive, -1 for the flipped wrist.
        theta_4_free: the angle that joint 4 takes where it is free.

    Source:
        Paul (1981) ch. 3, Euler angle solution.
    """
    n, o, a = (list(column) for column in zip(*R_36, strict=True))
    sine_squared = a[0] * a[0] + a[1] * a[1]
    singular = sine_squared < SINGULAR_SINE**2
    theta_4 = select(singular, theta_4_free, atan2(flip * a[1], flip * a[0]))
    c4, s4 = cos(theta_4), sin(theta_4)
    theta_5 = atan2(c4 * a[0] + s4 * a[1], a[2])
    theta_6 = atan2(c4 * n[1] - s4 * n[0], c4 * o[1] - s4 * o[0])
    return [theta_4, theta_5, theta_6], singular


def _into_reach(geometry: ClosedFormGeometry, X: Scalar, Z: Scalar, raised: Scalar) -> Scalar:
    """Return the further rotation of the wrist link that lets the two links before it reach its foot; 0 if they do.

    The foot of the wrist link is as far from joint 2 as the cosine rule says; rotated towards (X, Z) it is nearest.
    """
    length = math.hypot(*geometry.wrist_link)
    if not length:
        return 0.0 * X
    distance = sqrt(X * X + Z * Z)
    double = 2 * length * select(distance < ON_AXIS, ON_AXIS, distance)
    least = _arc_cosine((distance * distance + length * length - geometry.inner_radius**2) / double)
    most = _arc_cosine((distance * distance + length * length - geometry.outer_radius**2) / double)
    apart = raised + math.atan2(-geometry.wrist_link[1], geometry.wrist_link[0]) - atan2(-Z, X)
    apart = atan2(sin(apart), cos(apart))
    size = abs(apart)
    size = select(size < least, least, select(most < size, most, size))
    return select(apart < 0, -size, size) - apart


def _arc_cosine(x: Scalar) -> Scalar:
    return atan2(sqrt(1 - x * x), x)


def _vanish(x: Scalar, y: Scalar) -> Scalar:
    """Whether a point at (x, y) from an axis is on it."""
    return x * x + y * y < ON_AXIS**2
