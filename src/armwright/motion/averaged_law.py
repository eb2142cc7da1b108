"""A motion of one number whose course may change at any time, and that is run averaged over the last moments.

The acceleration of S(t) is constant between breaks. With w the time of the average,

    s(t) = 1/w ∫ S from t - w to t

has a continuous acceleration whatever S does from now on, and is within what S keeps in the time w before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.motion.knots import segments_at
from armwright.motion.polynomials import shifted
from armwright.motion.trajectory import Trajectory

# The time over which it is averaged [s].
WINDOW = 0.04
# Times nearer than this are the same [s].
SAME_TIME = 1e-9
_HALVINGS = 60


class AveragedLaw(NamedTuple):
    """S(t), such as a way: its acceleration is constant between times (k,), before and after which it rests.

    Attributes:
        t: [s] of the cell's clock.
        s: [m].
        v: [m/s].
    """

    t: Array
    s: Array
    v: Array

    def at(self, t: float) -> tuple[float, float]:
        """Return S and its rate at a time."""
        if t >= self.t[-1]:
            return float(self.s[-1]), 0.0
        k = max(0, int(np.searchsorted(self.t, t, side="right")) - 1)
        length, h = float(self.t[k + 1] - self.t[k]), t - float(self.t[k])
        rate = float(self.v[k + 1] - self.v[k]) / length
        return float(self.s[k] + h * (self.v[k] + h * rate / 2)), float(self.v[k] + h * rate)

    def until(self, t: float, now: float) -> AveragedLaw:
        """Return it up to a time, from where it is needed on to average it from now on."""
        if t >= self.t[-1]:
            times = np.append(self.t, t) if t > self.t[-1] else self.t
            kept = AveragedLaw(times, np.append(self.s, self.s[-1])[: len(times)], np.append(self.v, 0.0)[: len(times)])
        else:
            k = int(np.searchsorted(self.t, t, side="left"))
            s, v = self.at(t)
            kept = AveragedLaw(np.append(self.t[:k], t), np.append(self.s[:k], s), np.append(self.v[:k], v))
        first = max(0, int(np.searchsorted(kept.t, now - WINDOW, side="right")) - 1)
        return AveragedLaw(kept.t[first:], kept.s[first:], kept.v[first:])

    def then(self, lengths: Array, v: Array) -> AveragedLaw:
        """Return it with intervals (m,) [m] behind it, at whose ends, and start, the rates (m + 1,) are these."""
        t = self.t[-1] + np.cumsum(2 * lengths / (v[1:] + v[:-1]))
        s = self.s[-1] + np.cumsum(lengths)
        return AveragedLaw(np.append(self.t, t), np.append(self.s, s), np.append(self.v, v[1:]))

    def rested(self, time: float) -> AveragedLaw:
        """Return it with a rest of a time at its end."""
        return AveragedLaw(np.append(self.t, self.t[-1] + time), np.append(self.s, self.s[-1]), np.append(self.v, 0.0))


def averaged(law: AveragedLaw, now: float) -> Trajectory:
    """Return what is run from now on, as a motion of one number."""
    t = np.concatenate([[min(law.t[0], now) - 2 * WINDOW], law.t])
    origin = float(law.s[0])
    s, v = np.append(0.0, law.s - origin), np.append(0.0, law.v)
    lengths = np.diff(t)
    rates = np.append(np.diff(v) / lengths, 0.0)
    grown = (s[:-1] + (v[:-1] / 2 + rates[:-1] * lengths / 6) * lengths) * lengths
    terms = np.stack([np.append(0.0, np.cumsum(grown)), s, v / 2, rates / 6], axis=1)[:, :, None]
    end = max(float(law.t[-1]) + WINDOW, now)
    breaks = np.concatenate([law.t, law.t + WINDOW])
    breaks = apart(np.concatenate([[now], breaks[(breaks > now) & (breaks < end)], [end]]))
    middles = (breaks[:-1] + breaks[1:]) / 2

    def around(begin: Array, within: Array) -> Array:
        on = segments_at(t, within, len(t))
        return shifted(terms[on], begin - t[on])

    averaged = (around(breaks[:-1], middles) - around(breaks[:-1] - WINDOW, middles - WINDOW)) / WINDOW
    averaged[:, 0] += origin
    return Trajectory(times=breaks - now, coefficients=averaged)


def reached(law: Trajectory, ways: Array) -> Array:
    """Return when a motion of one number that never falls comes to values (k,) between its ends."""
    begins = law.coefficients[:, 0, 0]
    on = segments_at(begins, ways, len(begins))
    low, high = law.times[on], law.times[on + 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        before = law(middle)[:, 0] < ways
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.asarray(high)


def apart(times: Array) -> Array:
    """Return times in order, those left out that follow the one before at no distance; the last one stays."""
    times = np.sort(times)
    is_apart = np.append(np.diff(times) > SAME_TIME, True)
    kept = times[is_apart]
    kept[0] = times[0]
    return np.asarray(kept)
