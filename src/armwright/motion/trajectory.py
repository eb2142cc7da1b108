"""A motion of all joints in time: piecewise polynomials, known exactly between samples too."""

import math
from collections.abc import Sequence
from numbers import Integral

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, by_fields, floats, number
from armwright.errors import InvalidValueError, KindError, ShapeError, shown


def _times(value: ArrayLike) -> Array:
    times = floats(value, "times")
    if times.ndim != 1 or len(times) < 2:
        raise ShapeError(f"times: expected at least two, got shape {times.shape}")
    if times[0] != 0 or (np.diff(times) < 0).any():
        raise InvalidValueError(f"times: expected to begin at 0 and never to fall, got {times.tolist()}")
    times.setflags(write=False)
    return times


def _coefficients(value: ArrayLike) -> Array:
    coefficients = floats(value, "coefficients")
    if coefficients.ndim != 3 or not coefficients.size:
        raise ShapeError(f"coefficients: expected (segments, powers, joints), got shape {coefficients.shape}")
    coefficients.setflags(write=False)
    return coefficients


@attrs.frozen(kw_only=True, eq=False)
class Trajectory:
    """Joint positions as a function of time, a polynomial on each of m segments.

    Attributes:
        times: (m + 1,) where segments begin and the last one ends [s], from 0.
        coefficients: (m, k, n) of the powers 0 to k-1 of the time since the segment began.
    """

    times: Array = attrs.field(converter=_times)
    coefficients: Array = attrs.field(converter=_coefficients)

    __reduce__ = by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse a number of segments that does not fit the times."""
        if len(self.coefficients) != len(self.times) - 1:
            raise ShapeError(f"trajectory: {len(self.times)} times but {len(self.coefficients)} segments")

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self.times[-1])

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return positions, or a derivative of them.

        Args:
            t: (...) times [s]; before the start and after the end the arm stands at the ends.
            order: 0 position, 1 speed, 2 acceleration, 3 jerk.

        Returns:
            (..., n). At a knot where the derivative jumps, the value just after it.

        Raises:
            KindError: a time is no number, or the order no whole number.
            InvalidValueError: a time is NaN or infinite, or the order below 0.
        """
        if isinstance(order, bool) or not isinstance(order, Integral):
            raise KindError(f"order: expected a whole number from 0, got {shown(order)}")
        if order < 0:
            raise InvalidValueError(f"order: expected 0 or more, got {order}")
        t = floats(t, "t")
        inside = np.clip(t, 0.0, self.duration)
        segment = np.clip(np.searchsorted(self.times, inside, side="right") - 1, 0, len(self.coefficients) - 1)
        local = (inside - self.times[segment])[..., None]
        terms = self._derivative(order)[segment]
        value = np.zeros((*t.shape, self.coefficients.shape[2]))
        for power in reversed(range(terms.shape[-2])):
            value = value * local + terms[..., power, :]
        if order > 0:
            value[(t < 0) | (t > self.duration)] = 0.0
        return value

    def extremes(self, order: int = 0) -> tuple[Array, Array]:
        """Return the smallest and largest value of every joint, (n,) each, exactly and not by sampling.

        Args:
            order: 0 position, 1 speed, 2 acceleration.
        """
        lowest, highest = self._segment_extremes(order)
        return lowest.min(axis=0), highest.max(axis=0)

    def segment_peaks(self, order: int) -> Array:
        """Return the largest magnitude of a derivative on every segment for every joint, (m, n), exactly."""
        lowest, highest = self._segment_extremes(order)
        return np.maximum(np.abs(lowest), np.abs(highest))

    def peaks(self, order: int) -> Array:
        """Return the largest magnitude of a derivative for every joint, (n,), exactly and not by sampling."""
        return np.asarray(self.segment_peaks(order).max(axis=0))

    def slowed(self, factor: float) -> "Trajectory":
        """Return the same path run ``factor`` times slower.

        Raises:
            KindError: the factor is no number.
            InvalidValueError: it is not above 0.
        """
        factor = number(factor, "factor")
        if not 0 < factor <= LARGEST:
            raise InvalidValueError(f"factor: expected more than 0, got {factor}")
        powers = factor ** -np.arange(self.coefficients.shape[1], dtype=np.float64)
        return Trajectory(times=self.times * factor, coefficients=self.coefficients * powers[:, None])

    def _segment_extremes(self, order: int) -> tuple[Array, Array]:
        """Return the smallest and largest value on every segment for every joint, (m, n) each."""
        terms, slopes = self._derivative(order), self._derivative(order + 1)
        shape = len(terms), terms.shape[2]
        lengths = np.diff(self.times)
        lowest, highest = np.full(shape, np.inf), np.full(shape, -np.inf)
        for local in (np.zeros(shape), np.broadcast_to(lengths[:, None], shape), *_roots(slopes, lengths)):
            value = np.zeros(shape)
            for power in reversed(range(terms.shape[1])):
                value = value * local + terms[:, power, :]
            lowest, highest = np.minimum(lowest, value), np.maximum(highest, value)
        return lowest, highest

    def _derivative(self, order: int) -> Array:
        terms = self.coefficients
        for _ in range(order):
            powers = np.arange(1, terms.shape[1], dtype=np.float64)
            terms = terms[:, 1:, :] * powers[:, None] if terms.shape[1] > 1 else np.zeros_like(terms[:, :1, :])
        return terms


def _roots(terms: Array, lengths: Array) -> list[Array]:
    """Return times (m, n) inside each segment among which are all roots of the polynomials (m, k, n)."""
    segments, count, joints = terms.shape
    if count == 1:
        return []
    if count == 2:
        c, b = terms[:, 0], terms[:, 1]
        return [np.clip(np.where(b != 0, -c / np.where(b != 0, b, 1.0), 0.0), 0.0, lengths[:, None])]
    found = np.zeros((count - 1, segments, joints))
    for i in range(segments):
        for j in range(joints):
            roots = np.roots(np.trim_zeros(terms[i, ::-1, j], "f"))
            real = roots.real[np.abs(roots.imag) <= 1e-6 * (1 + np.abs(roots))]
            found[: len(real), i, j] = np.clip(real, 0.0, lengths[i])
    return list(found)


def hold(q: ArrayLike, duration: float) -> Trajectory:
    """Return the motion of standing still at q (n,) for a time [s]."""
    return Trajectory(times=(0.0, duration), coefficients=floats(q, "q")[None, None, :])


def join(parts: Sequence[Trajectory]) -> Trajectory:
    """Return trajectories run one after the other."""
    powers = max(part.coefficients.shape[1] for part in parts)
    padded = [np.pad(p.coefficients, ((0, 0), (0, powers - p.coefficients.shape[1]), (0, 0))) for p in parts]
    starts = np.cumsum([0.0, *(part.duration for part in parts)])
    times = np.concatenate([[0.0], *(part.times[1:] + start for part, start in zip(parts, starts[:-1], strict=True))])
    return Trajectory(times=times, coefficients=np.concatenate(padded))


def whole_ticks(trajectory: Trajectory, period: float) -> Trajectory:
    """Return the trajectory slowed by less than one servo period so that it ends on a tick.

    Args:
        trajectory: what to run.
        period: of the servo [s].
    """
    if trajectory.duration == 0:
        return trajectory
    # The hair's breadth keeps a duration that is a whole number of ticks but for rounding from gaining one.
    ticks = max(1, math.ceil(trajectory.duration / period - 1e-9))
    return trajectory.slowed(ticks * period / trajectory.duration)
