"""Where to send an arm so that its tool comes where it should, with all that was found of it."""

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array, ArrayLike, Flags, floats, joint_array
from armwright.calibration.fitting import Calibration
from armwright.calibration.nongeometric import NongeometricCalibration
from armwright.errors import ShapeError
from armwright.spatial.rotations import rotation_vector

_STEPS = 50
# Steps end when every goal is met to this, in metres and radians.
_MET = 1e-10
# No joint moves farther in one step [rad], [m].
_FARTHEST = 0.2
# Directions in which the joints move the tool by a smaller part than in others are left alone.
_WEAK = 1e-6


class CalibratedInverse(NamedTuple):
    """Joint positions for goals.

    Attributes:
        q: (m, n) joint positions to be commanded [rad] or [m].
        missed: (m,) by how much the corrected arm misses there all the same, in metres, and with poses in radians;
            rounding where the goal can be reached.
        inside: (m,) whether they are inside the limits.
    """

    q: Array
    missed: Array
    inside: Flags


def inverse_calibrated(
    found: Calibration | NongeometricCalibration, goals: ArrayLike, near: ArrayLike
) -> CalibratedInverse:
    """Return the joint positions at which a calibrated arm has its tool at goals.

    Turns about y, joints that give and what was learnt are in it; an arm file has no place for these.

    Args:
        found: what is known of the arm.
        goals: (m, 3) places in the frame of the measurements [m], or (m, 4, 4) poses.
        near: (m, n) or (n,) joint positions from which to go, such as those that the arm as said would take.

    Raises:
        ShapeError: goals and joint positions are not as many.
    """
    known, learnt = (found.calibration, found.learnt) if isinstance(found, NongeometricCalibration) else (found, None)
    chain = known.chain
    wanted = floats(goals, "goals")
    wanted = wanted[None] if wanted.shape in {(3,), (4, 4)} else wanted
    if wanted.shape[1:] not in {(3,), (4, 4)}:
        raise ShapeError(f"goals: expected (m, 3) places or (m, 4, 4) poses, got {wanted.shape}")
    start = np.atleast_2d(joint_array(near, chain.arm.n, "near"))
    if len(start) not in {1, len(wanted)}:
        raise ShapeError(f"near: expected {len(wanted)} joint positions for as many goals, or one, got {len(start)}")
    q = np.tile(start, (len(wanted), 1)) if len(start) == 1 else start.copy()
    places = wanted[:, :3, 3] if wanted.ndim == 3 else wanted
    own = [
        chain.names.index(f"joint{i}.{'theta' if one.revolute else 'd'}") for i, one in enumerate(chain.arm.joints, 1)
    ]
    best, least = q, np.full(len(q), np.inf)
    for _ in range(_STEPS + 1):
        reached = chain.reach(q, known.own)
        shift = 0.0 if learnt is None else learnt.shift(q)
        off, J = places - reached.position - shift, reached.by_position[:, :, own]
        if wanted.ndim == 3:
            turned = rotation_vector(wanted[:, :3, :3] @ reached.rotation.swapaxes(1, 2))
            off = np.concatenate([off, turned], axis=1)
            J = np.concatenate([J, reached.by_turn[:, :, own]], axis=1)
        missed = np.linalg.norm(off, axis=1)
        # Near the edge of what can be reached a step may lead away from a goal again.
        best, least = np.where((missed < least)[:, None], q, best), np.fmin(missed, least)
        if np.all(least < _MET):
            break
        q = q + np.clip((np.linalg.pinv(J, rcond=_WEAK) @ off[:, :, None])[:, :, 0], -_FARTHEST, _FARTHEST)
    lower, upper = chain.arm.limits.lower, chain.arm.limits.upper
    return CalibratedInverse(
        best, np.asarray(least, dtype=np.float64), np.all((best >= lower) & (best <= upper), axis=1)
    )
