"""The life of reducers and bearings under the efforts of a motion that is repeated."""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats, number, positive
from armwright.errors import InvalidValueError, ShapeError

# Exponents of the load in the law of life: balls, as in the wave generator of a strain wave gear, and rollers.
BALLS, ROLLERS = 3.0, 10 / 3
_RADIANS_PER_SECOND = 2 * np.pi / 60


@attrs.frozen(kw_only=True)
class Rating:
    """What the maker of a reducer, or of a bearing, states of it, as felt at the joint.

    Attributes:
        effort: rated effort at the rated speed [N m] or [N].
        speed: rated speed of the joint [rad/s] or [m/s]; that of the input divided by the ratio.
        hours: life at both [h].
        average: effort that the mean effort must not exceed [N m] or [N]; infinite where none is stated.
        peak: effort that must not be exceeded in a cycle [N m] or [N].
        exponent: of the load: 3 for balls, 10/3 for rollers.
        source: document that states it.
    """

    effort: float
    speed: float
    hours: float
    average: float = np.inf
    peak: float = np.inf
    exponent: float = BALLS
    source: str = ""

    def __attrs_post_init__(self) -> None:
        """Refuse what no maker states."""
        for name in ("effort", "speed", "hours", "exponent"):
            positive(getattr(self, name), name)
        for name in ("average", "peak"):
            if not getattr(self, name) > 0:
                raise InvalidValueError(f"{name}: expected more than 0, got {getattr(self, name):g}")


class Load(NamedTuple):
    """What a motion asks of a reducer.

    Attributes:
        mean_effort: cubic mean for balls, weighted by speed [N m] or [N].
        mean_speed: mean of the magnitude over the cycle [rad/s] or [m/s].
        largest_effort: of the cycle [N m] or [N].
        rms_effort: root mean square over the cycle [N m] or [N].
    """

    mean_effort: float
    mean_speed: float
    largest_effort: float
    rms_effort: float


def load_of(
    time: ArrayLike,
    speed: ArrayLike,
    effort: ArrayLike,
    *,
    exponent: float = BALLS,
    dwell: float = 0.0,
    held: float = 0.0,
) -> Load:
    """Return what a motion asks of the reducer of one joint.

    Args:
        time: (m,) of the samples, increasing [s].
        speed: (m,) of the joint [rad/s] or [m/s].
        effort: (m,) of the joint [N m] or [N].
        exponent: of the load in the law of life.
        dwell: pause before the motion is repeated [s].
        held: effort in it [N m] or [N].

    Raises:
        ShapeError: the arrays do not have one length, two samples at least.
        InvalidValueError: times do not increase, or a number is out of its range.

    Source:
        ISO 281:2007, section 8, for the equivalent load; the makers' law of strain wave gears is the same.
    """
    t, v, f = floats(time, "time"), np.abs(floats(speed, "speed")), np.abs(floats(effort, "effort"))
    if not len(t.shape) == len(v.shape) == len(f.shape) == 1 or not len(t) == len(v) == len(f) or len(t) < 2:
        raise ShapeError(f"expected times, speeds and efforts (m,), m from 2, got {t.shape}, {v.shape} and {f.shape}")
    if (np.diff(t) <= 0).any():
        raise InvalidValueError("time: expected times that increase")
    if not 0 <= dwell < np.inf:
        raise InvalidValueError(f"dwell: expected 0 s or more, got {dwell:g}")
    cycle = float(t[-1] - t[0]) + dwell
    way = _integral(v, t)
    mean = (_integral(v * f**exponent, t) / way) ** (1 / exponent) if way else 0.0
    square = (_integral(f**2, t) + number(held, "held") ** 2 * dwell) / cycle
    return Load(mean, way / cycle, float(f.max()), float(np.sqrt(square)))


def life_hours(rating: Rating, load: Load) -> float:
    """Return the hours that a reducer lives under a load, with the probability that its rating has; it may be infinite.

    Source:
        Harmonic Drive SE (2014), Engineering data HFUS-2A, equation 20.2: L = L_n (n_N / n_av) (T_N / T_av)^3.
    """
    if not load.mean_speed or not load.mean_effort:
        return np.inf
    return float(rating.hours * rating.speed / load.mean_speed * (rating.effort / load.mean_effort) ** rating.exponent)


def joint_speed(revolutions_per_minute: float, ratio: float) -> float:
    """Return the speed of a joint [rad/s] of that of a reducer's input [1/min], and its ratio."""
    return positive(revolutions_per_minute, "speed") * _RADIANS_PER_SECOND / positive(ratio, "ratio")


def _integral(values: Array, time: Array) -> float:
    return float(np.trapezoid(values, time))
