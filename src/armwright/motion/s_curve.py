"""The fraction of a path over time: speed up and down by ramps whose acceleration is a trapezoid, even between."""

from __future__ import annotations

import numpy as np

from armwright.motion.trajectory import Trajectory

# The acceleration rises during this part of a ramp, and falls during as much of it.
_RISE = 0.2


def s_curve(duration: float, ramp: float) -> Trajectory:
    """Return the fraction of a line over time, from rest to rest, with continuous acceleration.

    Args:
        duration: [s].
        ramp: which part of it gathers speed, and which part again loses it: 0.5 at most.
    """
    rising = ramp * duration
    rise = _RISE * rising
    v = 1 / (duration - rising)
    a = v / (rising - rise)
    lengths = np.array([rise, rising - 2 * rise, rise, duration - 2 * rising, rise, rising - 2 * rise, rise])
    jerks = np.array([1, 0, -1, 0, -1, 0, 1]) * a / rise
    accelerations, speeds = np.array([0, a, a, 0, 0, -a, -a]), np.zeros(7)
    speeds[1:] = np.cumsum((accelerations + jerks * lengths / 2) * lengths)[:-1]
    ways = ((jerks * lengths / 6 + accelerations / 2) * lengths + speeds) * lengths
    starts = np.concatenate([[0.0], np.cumsum(ways)[:-1]])
    there = lengths > 1e-9 * duration  # a line of two ramps has nothing between them
    times = np.concatenate([[0.0], np.cumsum(lengths[there])])
    times[-1] = duration
    terms = np.stack([starts, speeds, accelerations / 2, jerks / 6], axis=1)
    return Trajectory(times=times, coefficients=terms[there][..., None])
