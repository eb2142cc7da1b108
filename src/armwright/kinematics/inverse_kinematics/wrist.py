"""The last three joints: a spherical wrist orients the tool as the ZYZ Euler angles do, over abstract scalars."""

from __future__ import annotations

from armwright.kinematics.inverse_kinematics.geometry import Sign
from armwright.tracing.scalar import Scalar, atan2, cos, select, sin
from armwright.tracing.vectors import Matrix, Vector

# Below this sine of joint 5 the axes of joints 4 and 6 fall together and only their sum is determined. The
# entries it is read from carry rounding of about 1e-16, so joint 4 still keeps some six digits here.
SINGULAR_SINE = 1e-10


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
