"""From readings to motions: smooth positions, velocities and accelerations without lag, and the times of efforts.

Source:
    Gautier & Khalil (1992) and Janot, Vandanjon & Gautier (2014) for filtering positions without phase and decimating;
    Challis (1999), A procedure for the automatic determination of filter cutoff frequency, for whiteness.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Flags, read_only
from armwright.errors import InvalidValueError, TooFewError
from armwright.identification.log import LEAST_MOTION, LEAST_SAMPLES, Log

# Order of the filter, which is run forward and backward.
_ORDER = 4
# Above this part of half the sampling rate nothing is filtered.
_ALL_PASS = 0.8
# Cut-off frequencies that are tried, by the sampling rate, and the lags at which what is taken off must be white.
_TRIED = np.geomspace(0.01, 0.3, 12)
_LAGS = 25
# The filter knows nothing beyond the ends of a log: so many periods of its cut-off are cut off there.
BORDER = 1.0
# A joint slower than this part of its greatest speed may stick, and tells nothing of its friction; so may one whose
# speed is no more than so many standard deviations of its noise.
_DEAD_BAND, _NOISE = 0.005, 3.0
# Below a frequency lies this part of the power of velocities; reversals of friction reach so many times as far. What is
# above tells nothing of an arm, and noise there makes columns too large, so that parameters come out too small.
_POWER, _REVERSALS = 0.999, 40.0
# Readings of a log that a cut-off is chosen by.
_SHOWN = 4096


@attrs.frozen(kw_only=True)
class Preparation:
    """How motions are made of readings.

    Attributes:
        cutoff: of the filter of positions or velocities [Hz].
        decimation: readings that are averaged to one equation.
        delay: by which positions are read later than efforts [s].
        border: what is cut off at both ends of a log, of which the filter knows too little [s].
        slow: (n,) speeds below which a joint may stick: it has no equation there [rad/s] or [m/s]; infinite for a joint
            that never moves.
    """

    cutoff: float
    decimation: int
    delay: float = 0.0
    border: float
    slow: Array = attrs.field(converter=read_only)

    def __attrs_post_init__(self) -> None:
        """Refuse a cut-off or a decimation of nothing."""
        if not self.cutoff > 0 or self.decimation < 1:
            raise InvalidValueError(
                f"preparation: expected a cut-off above 0 and a decimation of 1 or more, got {self.cutoff:g} Hz and "
                f"{self.decimation}"
            )


def preparation_of(logs: Sequence[Log], *, cutoff: float | None = None, decimation: int | None = None) -> Preparation:
    """Return how to make motions of logs: what is left out follows from the readings.

    Args:
        logs: of one arm, sampled alike.
        cutoff: of the filter [Hz]; when left out by ``white_cutoff``, but not far above the motion.
        decimation: readings that are averaged to one equation; when left out, as many as half a period of the cut-off
            frequency has.
    """
    if cutoff is None:
        cutoff = min(white_cutoff(logs), _REVERSALS * _motion_frequency(logs))
    if decimation is None:
        decimation = max(1, int(1 / (2 * cutoff * logs[0].period)))
    slow = np.zeros(logs[0].n)
    for log in logs:
        for piece in log.pieces():
            slow = np.maximum(slow, _slow(piece, cutoff))
    # What is read of a joint that never moves is noise or rounding, and no speed.
    slow[np.max([np.ptp(log.q, axis=0) for log in logs], axis=0) < LEAST_MOTION] = np.inf
    return Preparation(cutoff=cutoff, decimation=decimation, border=BORDER / cutoff, slow=slow)


def _slow(log: Log, cutoff: float) -> Array:
    """Return the speeds (n,) below which the joints of a log may be at rest."""
    rate = 1 / log.period
    readings = log.q if log.qd is None else log.qd
    smooth = low_pass(readings, cutoff, rate)
    # What the filter takes off is noise; as much of it by frequency is left below the cut-off.
    density = (readings - smooth).var(axis=0) / max(rate / 2 - cutoff, cutoff)
    if log.qd is None:
        density = density * (2 * np.pi * cutoff) ** 2 / 3
        smooth = np.gradient(smooth, log.period, axis=0)
    return np.asarray(np.maximum(_DEAD_BAND * np.abs(smooth).max(axis=0), _NOISE * np.sqrt(density * cutoff)))


class Motion(NamedTuple):
    """A motion at even times, with the efforts that it took.

    Attributes:
        name: of the log.
        t: (k,) times [s].
        q: (k, n) joint positions [rad] or [m].
        qd: (k, n) joint velocities.
        qdd: (k, n) joint accelerations.
        tau: (k, n) efforts [N m] or [N].
        usable: (k, n) whether the effort of a joint tells anything: it moves, and the reading is not clipped.
    """

    name: str
    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    usable: Flags


def motions(logs: Sequence[Log], preparation: Preparation) -> Iterator[Motion]:
    """Give the motions of logs, one for each part between gaps that is long enough."""
    for log in logs:
        for piece in log.pieces():
            motion = _motion(piece, preparation)
            if motion is not None:
                yield motion


def _motion(log: Log, preparation: Preparation) -> Motion | None:
    """Return the motion of a log that is sampled evenly; None where too little of it is left without its borders."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - takes a tenth of a second to load

    rate = 1 / log.period
    border = max(2, int(np.ceil(preparation.border * rate)))
    # Positions are known as long as they were read, and no spline goes on beyond.
    first = border + max(0, int(np.ceil(-preparation.delay * rate)))
    last = len(log.t) - border - max(0, int(np.ceil(preparation.delay * rate)))
    if last - first < LEAST_SAMPLES:
        return None
    # A quintic spline has all derivatives between readings, too, as a delay requires.
    t = log.t - preparation.delay
    q = make_interp_spline(t, low_pass(log.q, preparation.cutoff, rate), k=5)
    qd = q.derivative() if log.qd is None else make_interp_spline(t, low_pass(log.qd, preparation.cutoff, rate), k=5)
    inside = slice(first, last)
    now = log.t[inside]
    velocity = qd(now)
    return Motion(
        name=log.name,
        t=now,
        q=q(now),
        qd=velocity,
        qdd=qd.derivative()(now),
        tau=log.effort[inside],
        usable=(np.abs(velocity) > preparation.slow) & ~(log.clipped | log.spikes)[inside],
    )


def low_pass(values: Array, cutoff: float, rate: float) -> Array:
    """Return signals (k, n) without what is above a cut-off frequency, without lag.

    Args:
        values: the signals.
        cutoff: frequency at which a quarter of the power is left [Hz].
        rate: of sampling [Hz].
    """
    from scipy.signal import sosfiltfilt  # noqa: PLC0415 - takes a tenth of a second to load

    if cutoff >= _ALL_PASS * rate / 2:
        return values
    return np.asarray(sosfiltfilt(_sections(cutoff / rate), values, axis=0))


@lru_cache(maxsize=64)
def _sections(part: float) -> Array:
    """Return the filter with a cut-off frequency that is a part of the sampling rate."""
    from scipy.signal import butter  # noqa: PLC0415 - takes a tenth of a second to load

    return np.asarray(butter(_ORDER, part, fs=1.0, output="sos"))


def white_cutoff(logs: Sequence[Log]) -> float:
    """Return the cut-off frequency above which the readings of joints are noise [Hz].

    That of several is chosen for which what the filter takes off is most nearly white: a lower one takes off motion as
    well, a higher one leaves noise.

    Raises:
        TooFewError: there is no part without gaps that is long enough.
    """
    pieces = [piece.take(slice(_SHOWN)) for log in logs for piece in log.pieces()]
    if not pieces:
        raise TooFewError(f"no log has {LEAST_SAMPLES} readings in a row without a gap")
    rate = 1 / pieces[0].period
    scores = []
    for part in _TRIED:
        score, count = 0.0, 0
        for piece in pieces:
            readings = piece.q if piece.qd is None else piece.qd
            taken = readings - low_pass(readings, part * rate, rate)
            taken = taken[:, taken.std(axis=0) > 0]
            correlations = _autocorrelations(taken, min(_LAGS, len(taken) - 1))
            score, count = score + float((correlations**2).sum()), count + taken.shape[1]
        scores.append(score / max(count, 1))
    return float(_TRIED[int(np.argmin(scores))] * rate)


def _motion_frequency(logs: Sequence[Log]) -> float:
    """Return the frequency below which nearly all power of the velocities lies [Hz]."""
    highest = 0.0
    for log in logs:
        for piece in log.pieces():
            rate = 1 / piece.period
            power = np.abs(np.fft.rfft(np.gradient(piece.q, piece.period, axis=0), axis=0)) ** 2
            # Each joint by its own power, or the fastest alone would count.
            part = np.cumsum((power / np.maximum(power.sum(axis=0), np.finfo(float).tiny)).mean(axis=1))
            index = int(np.searchsorted(part, _POWER * part[-1])) + 1
            highest = max(highest, index * rate / len(piece.t))
    return highest


def _autocorrelations(values: Array, lags: int) -> Array:
    """Return the autocorrelations (lags, n) of signals (k, n) at lags from 1."""
    power = (values**2).sum(axis=0)
    products = [(values[lag:] * values[:-lag]).sum(axis=0) for lag in range(1, lags + 1)]
    return np.asarray(np.array(products) / power)


def cut(log: Log, seconds: float) -> list[Log]:
    """Return a log in blocks of a length, the last one perhaps longer, which are filtered each by itself.

    Held-out blocks and those that are trained on share no reading: a filter that ran over their border would carry
    over what it learnt.
    """
    size = max(LEAST_SAMPLES, round(seconds / log.period))
    count = max(1, len(log.t) // size)
    ends = [*(size * np.arange(count)).tolist(), len(log.t)]
    return [log.take(slice(*rows)) for rows in pairwise(ends)]
