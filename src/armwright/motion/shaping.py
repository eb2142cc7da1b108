"""Input shapers: a command is run as a sum of delayed parts, whose vibrations cancel each other.

Source:
    Singer & Seering (1990), "Preshaping command inputs to reduce system vibration": ZV and ZVD; Singhose, Seering &
    Singer (1994), "Residual vibration reduction using vector diagrams to generate shaped inputs": EI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Literal, TypeAlias, get_args

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats, number, positive, read_only
from armwright.errors import InvalidValueError, one_of
from armwright.motion.knots import segments_at
from armwright.motion.polynomials import shifted
from armwright.motion.trajectory import Trajectory

ShaperKind: TypeAlias = Literal["zv", "zvd", "ei"]
# Parts of a shaper for all modes together, at most.
_MOST = 4096
# Knots of a shaped motion that are nearer to each other are one [s].
_INSTANT = 1e-12


@attrs.frozen(kw_only=True, eq=False)
class Shaper:
    """Parts of a command and their delays.

    Attributes:
        parts: (k,) positive, 1 together.
        delays: (k,) of each, rising from 0 [s].
        factors: shapers that have the same effect one after the other; empty for itself alone.
    """

    parts: Array = attrs.field(converter=read_only)
    delays: Array = attrs.field(converter=read_only)
    factors: tuple[Shaper, ...] = ()

    @property
    def duration(self) -> float:
        """How much longer a shaped command takes [s]."""
        return float(self.delays[-1])

    def residual(self, frequency: ArrayLike, damping: float = 0.0) -> Array:
        """Return the part of the vibration of an oscillator that is left after a shaped step.

        Args:
            frequency: (...) of the undamped oscillator [Hz].
            damping: its damping ratio.

        Returns:
            (...) amplitude after the last part, by that of the same oscillator, at the same time, after a plain step.
        """
        omega = 2 * np.pi * floats(frequency, "frequency")[..., None]
        turn = np.exp(omega * self.delays * (damping + 1j * math.sqrt(1 - damping**2)))
        return np.asarray(np.abs((self.parts * turn).sum(axis=-1)))


def shaper(kind: ShaperKind, frequency: float, damping: float = 0.0, *, tolerance: float = 0.05) -> Shaper:
    """Return the shaper of a mode.

    With K = exp(-zeta pi / sqrt(1 - zeta²)) its parts, half a damped period apart, are in the ratio 1 : K (``zv``, no
    vibration at the frequency), 1 : 2K : K² (``zvd``, nor near it), and (1 + v) : 2 (1 - v) K : (1 + v) K² (``ei``,
    which leaves the part ``tolerance`` at the frequency and less on both sides of it; v is that part without damping).

    Args:
        kind: ``zv``, ``zvd`` or ``ei``.
        frequency: of the undamped mode [Hz].
        damping: its damping ratio, 0 or more and below 1.
        tolerance: of ``ei``, below 1.

    Raises:
        KindError: an argument is no number.
        UnknownNameError: the kind is another.
        InvalidValueError: a number is out of its range.
    """
    one_of("kind", kind, get_args(ShaperKind))
    positive(frequency, "frequency", "Hz")
    for name, value in (("damping", damping), ("tolerance", tolerance)):
        if not 0 <= number(value, name) < 1:
            raise InvalidValueError(f"{name}: expected 0 or more and below 1, got {value:g}")
    root = math.sqrt(1 - damping**2)
    K = math.exp(-damping * math.pi / root)
    if kind == "zv":
        ratios = [1.0, K]
    elif kind == "zvd":
        ratios = [1.0, 2 * K, K * K]
    else:
        v = tolerance * (1 + K) ** 2 / (4 - tolerance * (1 - K) ** 2)
        if v >= 1:
            raise InvalidValueError(
                f"tolerance: an EI shaper with a damping ratio of {damping:g} leaves less than {tolerance:g}; "
                "expected a smaller tolerance"
            )
        ratios = [1 + v, 2 * (1 - v) * K, (1 + v) * K * K]
    parts = np.array(ratios)
    return Shaper(parts=parts / parts.sum(), delays=np.arange(len(parts)) / (2 * frequency * root))


def combined(shapers: Sequence[Shaper]) -> Shaper:
    """Return the shaper that has the effect of all together: each shapes what the one before has shaped.

    Raises:
        InvalidValueError: it would have more than 4096 parts.
    """
    parts, delays = np.ones(1), np.zeros(1)
    for each in shapers:
        if len(parts) * len(each.parts) > _MOST:
            raise InvalidValueError(
                f"shapers: {len(shapers)} of them have more than {_MOST} parts; expected fewer modes"
            )
        parts, delays = np.outer(parts, each.parts).ravel(), np.add.outer(delays, each.delays).ravel()
    order = np.argsort(delays, kind="stable")
    return Shaper(parts=parts[order], delays=delays[order], factors=tuple(shapers))


def shaped(trajectory: Trajectory, by: Shaper) -> Trajectory:
    """Return a motion as the sum of its delayed parts, exactly; it takes longer by the duration of the shaper.

    Positions, speeds and accelerations keep every bound that those of the motion keep.
    """
    if by.factors:
        # Each mode has two or three parts, all of them together have hundreds.
        return reduce(shaped, by.factors, trajectory)
    breaks = np.unique(np.add.outer(by.delays, trajectory.times))
    times = breaks[np.append(True, np.diff(breaks) > _INSTANT)]
    times[-1] = breaks[-1]
    middles = (times[1:] + times[:-1]) / 2
    _, powers, n = trajectory.coefficients.shape
    terms = np.zeros((len(middles), powers, n))
    start, end = trajectory(0.0), trajectory(trajectory.duration)
    for part, delay in zip(by.parts, by.delays, strict=True):
        t = middles - delay
        before, after = t < 0, t > trajectory.duration
        terms[before, 0] += part * start
        terms[after, 0] += part * end
        inside = ~(before | after)
        segments = segments_at(trajectory.times, t[inside], len(trajectory.coefficients))
        shift = times[:-1][inside] - delay - trajectory.times[segments]
        terms[inside] += part * shifted(trajectory.coefficients[segments], shift)
    return Trajectory(times=times, coefficients=terms)
