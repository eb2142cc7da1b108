"""Straight ways through poses whose corners are rounded as much as is allowed, at the report's speed."""

from itertools import pairwise

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.motion.follow import PathError
from armwright.motion.hand_path import hand_path
from armwright.motion.limit_use import slowing_for_limits
from armwright.motion.moves import Move, along
from armwright.motion.path import NEGLIGIBLE, Path, report_speed

# The start and the stop take this part of the first and of the last way.
_ENDS = 0.25
# A posture this far from where the arm stands is another one [rad] or [m].
_OTHER = 1e-6


def rounded_move(arm: Arm, path: Path, q_start: Array, *, blend: float, deviation: float, speed: float) -> Move:
    """Plan a move straight from pose to pose that rounds its corners and stops only at the end.

    Args:
        arm: the arm; its ``reach`` and ``tool_speed`` scale the speed.
        path: begins where the hand is at ``q_start``; equal poses one after the other count once.
        q_start: (n,) present joint positions.
        blend: how far from a corner its rounding may begin [m]; where a way is short, at its middle.
        deviation: allowed distance of the hand from the rounded path [m].
        speed: 1 to 120, 100 is normal.

    Raises:
        PathError: the arm cannot follow it from where it stands.
        InvalidValueError: a number is out of range.
    """
    if not 0 < blend < np.inf:
        raise InvalidValueError(f"blend: expected more than 0 m, got {blend}")
    moving = path.lengths() > NEGLIGIBLE
    X = path.poses[[True, *moving.tolist()]]
    lengths = Path(poses=X).lengths()
    speeds = np.array([report_speed(arm, A[:3, 3], B[:3, 3], speed) for A, B in pairwise(X)])
    durations = lengths / speeds
    half = 0.5 * np.minimum(durations[:-1], durations[1:])
    corners = np.minimum(blend / np.maximum(speeds[:-1], speeds[1:]), half)
    widths = np.array([_ENDS * durations[0], *corners, _ENDS * durations[-1]])
    times = np.concatenate([[0.0], np.cumsum(durations)])
    move = along(
        arm,
        X,
        hand_path(X, times, widths, ends="rest", orientation="geodesic"),
        times,
        widths,
        near=q_start,
        deviation=deviation,
    )
    if np.abs(move.postures[0] - q_start).max() > _OTHER:
        reason = f"only another posture than the present one ({move.label}) carries through"
        raise PathError("limits", 0, 0.0, reason, reason=reason)
    factor, because = slowing_for_limits(arm, move.trajectory)
    if factor <= 1:
        return move
    slow = move.slowed(factor)
    assert slow.certificate is not None  # noqa: S101 - along gives one
    return attrs.evolve(slow, certificate=attrs.evolve(slow.certificate, because=because))
