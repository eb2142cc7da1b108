"""Limits of the tool that a program asks for: its speed, its turning, and how fast its speed changes."""

from __future__ import annotations

import math

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.kinematics.jacobians import jacobian, jacobian_rate
from armwright.motion.trajectory import Trajectory

# Samples of a motion, and so many more on each of its segments.
_SAMPLES, _PER_SEGMENT = 400, 8
# Part of a limit that is used up at most, so that it holds between samples too, and the part that is aimed at.
_USED, _AIMED = 0.9995, 0.998
# Below this part of its largest speed the tool begins or ends to move, in no direction yet.
_BEGINS = 1e-3


@attrs.frozen(kw_only=True)
class ToolLimits:
    """Limits of the tool on one motion.

    Attributes:
        speed: of the tool point [m/s].
        rotation: angular speed of the tool [rad/s].
        acceleration: how fast the speed of the tool point may change along its path [m/s²].
    """

    speed: float = math.inf
    rotation: float = math.inf
    acceleration: float = math.inf

    @property
    def aimed(self) -> ToolLimits:
        """What a planner aims at, so that small deviations of the joints do not pass the limits."""
        return ToolLimits(
            speed=self.speed * _AIMED, rotation=self.rotation * _AIMED, acceleration=self.acceleration * _AIMED
        )

    def even_time(self, shift: float, angle: float) -> float:
        """Return how long a straight line takes at least at these speeds [s].

        Args:
            shift: length of the line [m].
            angle: by which the tool turns on it [rad].
        """
        return max(shift / self.speed, angle / self.rotation)

    def slowing(self, arm: Arm, trajectory: Trajectory) -> float:
        """Return how many times slower a motion has to be run to keep the limits; 1 where it keeps them."""
        peaks = tool_peaks(arm, trajectory)
        return max(
            1.0,
            peaks.speed / self.speed / _USED,
            peaks.rotation / self.rotation / _USED,
            math.sqrt(peaks.acceleration / self.acceleration) / _USED,
        )


def tool_peaks(arm: Arm, trajectory: Trajectory) -> ToolLimits:
    """Return the largest speed and turning of the tool on a motion, and the largest change of its speed, sampled."""
    times = trajectory.times
    parts = np.linspace(0.0, 1.0, _PER_SEGMENT, endpoint=False)
    inside = (times[:-1, None] + np.diff(times)[:, None] * parts).ravel()
    t = np.union1d(np.linspace(0.0, trajectory.duration, _SAMPLES), inside)
    q, qd, qdd = (trajectory(t, order) for order in range(3))
    J = jacobian(arm, q)
    v = (J @ qd[..., None])[..., 0]
    a = (J @ qdd[..., None] + jacobian_rate(arm, q, qd) @ qd[..., None])[..., 0]
    speed, turning = np.linalg.norm(v[:, :3], axis=1), np.linalg.norm(v[:, 3:], axis=1)
    moves = speed > _BEGINS * max(float(speed.max()), 1e-9)
    change = np.abs((v[moves, :3] * a[moves, :3]).sum(axis=1)) / speed[moves]
    return ToolLimits(
        speed=float(speed.max()), rotation=float(turning.max()), acceleration=float(change.max(initial=0.0))
    )
