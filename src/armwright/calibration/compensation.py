"""The inverse kinematics of a calibrated arm: where to send it so that its tool comes where it should."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array, ArrayLike, Flags, floats, joint_array
from armwright.calibration.fitting import Calibration
from armwright.calibration.nongeometric import NongeometricCalibration
from armwright.errors import ShapeError
from armwright.spatial.rotations import rotation_vector

_MAX_ITERATIONS = 50
# Iterations end when every goal is reached to this, in metres and radians.
_TOLERANCE = 1e-10
# No joint moves farther in one iteration [rad], [m].
_MAX_STEP = 0.2
# Singular values below this part of the largest are taken for zero.
_RCOND = 1e-6


class CalibratedInverse(NamedTuple):
    """Joint positions for goals.

    Attributes:
        q: (m, n) joint positions to be commanded [rad] or [m].
        residual: (m,) distance of the corrected arm's tool from each goal, in metres, and with poses in radians;
            rounding where the goal can be reached.
        within_limits: (m,) whether they are within the limits.
    """

    q: Array
    residual: Array
    within_limits: Flags


def inverse_calibrated(
    calibration: Calibration | NongeometricCalibration,
    goals: ArrayLike,
    near: ArrayLike,
    *,
    payload: ArrayLike | None = None,
) -> CalibratedInverse:
    """Return the joint positions at which a calibrated arm has its tool at goals, by Newton's method.

    It counts in what an arm file has no number for: rotations about y, errors of joints, the residual model.

    Args:
        calibration: of the arm.
        goals: (m, 3) positions in the frame of the measurements [m], or (m, 4, 4) poses.
        near: (m, n) or (n,) joint positions from which to start, such as those of the nominal arm.
        payload: (4,) or (m, 4) what the tool holds, under which joints yield: see ``readings``.

    Raises:
        ShapeError: goals and joint positions are not as many.
    """
    fit, residual_model = (
        (calibration.calibration, calibration.residual_model)
        if isinstance(calibration, NongeometricCalibration)
        else (calibration, None)
    )
    chain = fit.chain
    targets = floats(goals, "goals")
    targets = targets[None] if targets.shape in {(3,), (4, 4)} else targets
    if targets.shape[1:] not in {(3,), (4, 4)}:
        raise ShapeError(f"goals: expected (m, 3) positions or (m, 4, 4) poses, got {targets.shape}")
    start = np.atleast_2d(joint_array(near, chain.arm.n, "near"))
    if len(start) not in {1, len(targets)}:
        raise ShapeError(f"near: expected {len(targets)} joint positions for as many goals, or one, got {len(start)}")
    q = np.tile(start, (len(targets), 1)) if len(start) == 1 else start.copy()
    positions = targets[:, :3, 3] if targets.ndim == 3 else targets
    # The derivative by a joint's position is that by the error of it.
    columns = [
        chain.names.index(f"joint{i}.{'theta' if joint.revolute else 'd'}")
        for i, joint in enumerate(chain.arm.joints, 1)
    ]
    best, least = q, np.full(len(q), np.inf)
    for _ in range(_MAX_ITERATIONS + 1):
        tool = chain.forward(q, fit.arm_errors, payload=payload)
        shift = 0.0 if residual_model is None else residual_model.shift(q)
        error, J = positions - tool.position - shift, tool.position_jacobian[:, :, columns]
        if targets.ndim == 3:
            rotation_error = rotation_vector(targets[:, :3, :3] @ tool.rotation.swapaxes(1, 2))
            error = np.concatenate([error, rotation_error], axis=1)
            J = np.concatenate([J, tool.rotation_jacobian[:, :, columns]], axis=1)
        residual = np.linalg.norm(error, axis=1)
        # Near the boundary of the workspace an iteration may lead away from a goal again.
        best, least = np.where((residual < least)[:, None], q, best), np.fmin(residual, least)
        if np.all(least < _TOLERANCE):
            break
        q = q + np.clip((np.linalg.pinv(J, rcond=_RCOND) @ error[:, :, None])[:, :, 0], -_MAX_STEP, _MAX_STEP)
    lower, upper = chain.arm.limits.lower, chain.arm.limits.upper
    within = np.all((best >= lower) & (best <= upper), axis=1)
    return CalibratedInverse(best, np.asarray(least, dtype=np.float64), within)
