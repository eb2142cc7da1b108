"""Frames of a cell that move by themselves, as those on a conveyor do."""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.signals import Changes
from armwright.spatial.poses import homogeneous


@attrs.frozen(kw_only=True, eq=False)
class MovingFrame:
    """A frame that moves along a straight line. Its speed changes with a continuous acceleration.

    Attributes:
        pose: (4, 4) where it is at the start, in the world.
        direction: (3,) of its motion, a unit vector in the world.
        speed: at the start [m/s].
        changes: when it begins to change its speed [s], and to what [m/s].
        ramp: how long each change takes [s]; changes are as far apart at least.
        window: from where to where along its direction arms track what is on it, from where it is at the start [m].
    """

    pose: Array
    direction: Array
    speed: float
    changes: Changes = ()
    ramp: float = 0.5
    window: tuple[float, float]

    @cached_property
    def _pieces(self) -> Array:
        """Rows of when a piece begins [s], the travel there [m], the speeds at its start and after its ramp [m/s]."""
        rows = [np.array([0.0, 0.0, self.speed, self.speed])]
        for time, speed in self.changes:
            start, travel, before, after = rows[-1]
            rows.append(np.array([time, travel + _travelled(time - start, before, after, self.ramp), after, speed]))
        return np.stack(rows)

    def travel(self, t: Array) -> Array:
        """Return how far it has come at times [s], both (k,) [m]."""
        start, travel, before, after = self._pieces[np.searchsorted(self._pieces[1:, 0], t, side="right")].T
        return np.asarray(travel + _travelled(t - start, before, after, self.ramp))

    def pose_at(self, time: float) -> Array:
        """Return its pose (4, 4) in the world at a time [s]."""
        p = self.pose[:3, 3] + self.direction * self.travel(np.array([time]))
        return homogeneous(self.pose[:3, :3], p)

    def place(self, p: Array) -> float:
        """Return how far along its direction a point (3,) in the world is from where it was at the start [m]."""
        return float(self.direction @ (p - self.pose[:3, 3]))

    @property
    def rests_from(self) -> float | None:
        """From when on it stands for ever [s]; None where it does not."""
        if (self.changes[-1][1] if self.changes else self.speed) != 0:
            return None
        return self.changes[-1][0] + self.ramp if self.changes else 0.0

    @property
    def joints(self) -> Array:
        """When its course changes its form [s]."""
        times = self._pieces[1:, 0]
        return np.concatenate([times, times + self.ramp])


def _travelled(t: Array, before: Array, after: Array, ramp: float) -> Array:
    """Return how far a frame comes in times since its speed begins to change, smoothly, from one to another [m]."""
    x = np.clip(t / ramp, 0.0, 1.0)
    changing = ramp * (before * x + (after - before) * (x**3 - x**4 / 2))
    return np.asarray(changing + np.maximum(t - ramp, 0.0) * after)
