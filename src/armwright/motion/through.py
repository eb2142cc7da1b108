"""Through frames without a stop, as the report moves: knots on the straight ways, and an X-spline of the joints."""

from __future__ import annotations

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import one_posture
from armwright.arrays import ArrayLike
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.follow import Followed, follow
from armwright.motion.moves import exact_poses
from armwright.motion.path import Path


def through_frames(
    arm: Arm, q_start: ArrayLike, frames: ArrayLike, *, deviation: float = 1e-3, speed: float = 100.0
) -> Followed:
    """Return the joint motion of the tool through frames, from rest to rest, without a stop at those between.

    Knots lie on the straight ways from frame to frame, as densely as the report's rule asks and the bound needs, and
    one X-spline joins their joint positions. At each frame between it passes exactly, and swings about the straight
    ways beside it: a MOVE with VIA of RLO-2 keeps to closer bounds.

    Args:
        arm: the arm, with n joints.
        q_start: (n,) joint positions at the start [rad] or [m].
        frames: (k, 4, 4) tool poses in the base frame, two or more; a rotation typed with two digits is made exact.
        deviation: allowed distance of the tool from a single straight way [m]; twenty times as much about corners.
        speed: 1 to 120, 100 is normal.

    Returns:
        The motion, and bounds on how far it strays from the straight ways.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: a shape does not fit, or there are fewer than two frames.
        PathError: a frame is out of reach, a joint passes a limit, or a singularity is in the way.
        InvalidValueError: a frame is no pose; deviation or speed are out of range.

    Source:
        TR-83-008, "continuous motion".
    """
    q = one_posture(arm, q_start, "q_start")
    goals = exact_poses(frames)
    return follow(arm, Path(poses=np.concatenate([forward(arm, q)[None], goals])), q, deviation=deviation, speed=speed)
