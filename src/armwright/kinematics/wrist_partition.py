"""The Jacobian of a PUMA in blocks: seen from its forearm, at the centre of its wrist, six of its entries are 0.

    [v]   [A 0] [q1 q2 q3]'
    [w] = [B C] [q4 q5 q6]'

The first three joints move the wrist centre and the last three do not, so the inverse is that of two blocks of three.
"""

from __future__ import annotations

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import positions
from armwright.arrays import Array, ArrayLike
from armwright.kinematics.differential import check_regular, puma_geometry
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry
from armwright.kinematics.singularity_analysis import determinant_factors


def wrist_partitioned_jacobian(arm: Arm, q: ArrayLike) -> Array:
    """Return the Jacobian of the wrist centre along the axes of the forearm.

    The axes are those of frame 3 of a PUMA: z along the axis of joint 4, y along that of joint 3.

    Args:
        arm: an arm built like the PUMA: its axis of joint 4 in the plane of the arm.
        q: (..., 6) joint positions [rad].

    Returns:
        (..., 6, 6): rows 0-2 velocity of the wrist centre [m/s per joint velocity], rows 3-5 angular velocity of the
        hand. The upper right block is 0.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        UnsupportedArmError: the arm is not built like the PUMA.
        ShapeError: the last axis of ``q`` is not 6 long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        The seed on the differential kinematics of the PUMA, method (b); its J21 has the shoulder's offset added here.
    """
    geometry = puma_geometry(arm, "wrist-partitioned Jacobian", "jacobian")
    return np.asarray(_blocks(geometry, positions(arm, q)) * np.array(geometry.signs))


def wrist_partitioned_inverse(arm: Arm, q: ArrayLike) -> Array:
    """Return the inverse of the wrist-partitioned Jacobian, block by block; no matrix is inverted.

        [  A^-1           0   ]
        [ -C^-1 B A^-1   C^-1 ]

    Args:
        arm: an arm built like the PUMA.
        q: (..., 6) joint positions [rad].

    Returns:
        (..., 6, 6): joint velocities per velocity of the wrist centre and angular velocity of the tool, both along
        the axes of the forearm.

    Raises:
        SingularConfigurationError: a factor of the determinant vanishes; it is named.
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        UnsupportedArmError: the arm is not built like the PUMA.
        ShapeError: the last axis of ``q`` is not 6 long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        The seed on the differential kinematics of the PUMA, method (b); its inverse, partly illegible, is derived anew.
    """
    geometry = puma_geometry(arm, "wrist-partitioned Jacobian", "jacobian")
    q = positions(arm, q)
    factors = np.stack(np.broadcast_arrays(*determinant_factors(geometry, _angles(geometry, q))), axis=-1)
    check_regular(factors)
    J = _blocks(geometry, q)
    out, plane, bend = factors[..., 0], geometry.upper_arm * factors[..., 1], factors[..., 2]
    inverse = np.zeros_like(J)
    # Joint 1 alone moves the wrist centre out of the plane of the arm, joints 2 and 3 move it in the plane.
    inverse[..., 0, 1] = 1 / out
    inverse[..., 1, 0], inverse[..., 1, 2] = J[..., 2, 2] / plane, -J[..., 0, 2] / plane
    inverse[..., 2, 0], inverse[..., 2, 2] = -J[..., 2, 1] / plane, J[..., 0, 1] / plane
    in_plane = inverse[..., 1:3, 0:3:2] @ J[..., 0:3:2, :1]
    inverse[..., 1:3, 1:2] = -in_plane / out[..., None, None]
    # Joint 4 rotates the tool about z, and joints 5 and 6 about the other axes.
    inverse[..., 4, 3], inverse[..., 4, 4] = J[..., 3, 4], J[..., 4, 4]
    inverse[..., 5, 3], inverse[..., 5, 4] = J[..., 4, 4] / bend, -J[..., 3, 4] / bend
    inverse[..., 3, 3:5] = -J[..., 5, 5, None] * inverse[..., 5, 3:5]
    inverse[..., 3, 5] = 1.0
    inverse[..., 3:, :3] = -inverse[..., 3:, 3:] @ J[..., 3:, :3] @ inverse[..., :3, :3]
    return np.asarray(inverse * np.array(geometry.signs)[:, None])


def _angles(geometry: ClosedFormGeometry, q: Array) -> list[Array]:
    return [np.asarray(angle) for angle in geometry.angles(list(np.moveaxis(q, -1, 0)))]


def _blocks(geometry: ClosedFormGeometry, q: Array) -> Array:
    """Return the Jacobian (..., 6, 6) for rates of the angles of the build."""
    a2, (a3, d4) = geometry.upper_arm, geometry.forearm
    _, t2, t3, t4, t5, _ = _angles(geometry, q)
    c23, s23 = np.cos(t2 + t3), np.sin(t2 + t3)
    c4, s4, c5, s5 = np.cos(t4), np.sin(t4), np.cos(t5), np.sin(t5)
    J = np.zeros((*q.shape[:-1], 6, 6))
    J[..., 0, 0], J[..., 0, 1], J[..., 0, 2] = -c23 * geometry.plane_offset, a2 * np.sin(t3) + d4, d4
    J[..., 1, 0] = geometry.shoulder_offset + a2 * np.cos(t2) + a3 * c23 + d4 * s23
    J[..., 2, 0], J[..., 2, 1], J[..., 2, 2] = -s23 * geometry.plane_offset, -a2 * np.cos(t3) - a3, -a3
    J[..., 3, 0], J[..., 3, 4], J[..., 3, 5] = -s23, -s4, c4 * s5
    J[..., 4, 1], J[..., 4, 2], J[..., 4, 4], J[..., 4, 5] = 1.0, 1.0, c4, s4 * s5
    J[..., 5, 0], J[..., 5, 3], J[..., 5, 5] = c23, 1.0, c5
    return J
