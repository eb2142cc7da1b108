"""A motion of all joints in time: piecewise polynomials, known exactly between samples too."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats, integer, not_negative, positive, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, KindError, ShapeError, shown
from armwright.motion.knots import joint_vector, segments_at
from armwright.motion.polynomials import derivative, extremes, peaks, shifted
from armwright.notebook import html_table

# Nobody reads more samples than this; a shorter period is a slip of the unit.
_MAX_SAMPLES = 100_000_000
# A part of a period: a duration that is a whole number of periods but for rounding gains no further one.
_TICK_TOLERANCE = 1e-9


def _times(value: ArrayLike) -> Array:
    times = floats(value, "times")
    if times.ndim != 1 or len(times) < 2:
        raise ShapeError(f"times: expected at least two, got shape {times.shape}")
    if times[0] != 0 or (times[1:] < times[:-1]).any():
        raise InvalidValueError(f"times: expected non-decreasing times that begin at 0, got {times.tolist()}")
    times.setflags(write=False)
    return times


def _coefficients(value: ArrayLike) -> Array:
    coefficients = floats(value, "coefficients")
    if coefficients.ndim != 3 or not coefficients.size:
        raise ShapeError(f"coefficients: expected (segments, powers, joints), got shape {coefficients.shape}")
    coefficients.setflags(write=False)
    return coefficients


@attrs.frozen(kw_only=True, eq=False)
class Samples:
    """A motion at k times.

    Attributes:
        times: (k,) [s].
        q: (k, n) joint positions [rad] or [m].
        qd: (k, n) joint velocities.
        qdd: (k, n) joint accelerations.
        jerk: (k, n) rates of the accelerations.
    """

    times: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    qd: Array = attrs.field(converter=read_only)
    qdd: Array = attrs.field(converter=read_only)
    jerk: Array = attrs.field(converter=read_only)

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class Trajectory:
    """Joint positions as a function of time, a polynomial on each of m segments.

    Attributes:
        times: (m + 1,) where segments begin and the last one ends [s], from 0.
        coefficients: (m, k, n) of the powers 0 to k-1 of the time since the segment began.
    """

    times: Array = attrs.field(converter=_times)
    coefficients: Array = attrs.field(converter=_coefficients)

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse a number of segments that does not fit the times."""
        if len(self.coefficients) != len(self.times) - 1:
            raise ShapeError(f"trajectory: {len(self.times)} times but {len(self.coefficients)} segments")

    @classmethod
    def of_planner(cls, times: Array, coefficients: Array) -> Trajectory:
        """Return a trajectory whose attributes are arrays of a planner that nobody else has, and need no check."""
        trajectory = cls.__new__(cls)
        for name, array in (("times", times), ("coefficients", coefficients)):
            array.setflags(write=False)
            object.__setattr__(trajectory, name, array)
        return trajectory

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self.times[-1])

    @property
    def lengths(self) -> Array:
        """Times that the segments take, (m,) [s]."""
        return np.asarray(self.times[1:] - self.times[:-1])

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return positions, or a derivative of them.

        Args:
            t: (...) times [s]; before the start and after the end the arm stands at the ends.
            order: 0 position, 1 velocity, 2 acceleration, 3 jerk, and so on.

        Returns:
            (..., n). At a knot where the derivative jumps, the value just after it.

        Raises:
            KindError: a time is no number, or the order no whole number.
            InvalidValueError: a time is NaN or infinite, or the order below 0.
        """
        integer(order, "order", least=0)
        t = floats(t, "t")
        inside = np.minimum(np.maximum(t, 0.0), self.duration)
        segment = segments_at(self.times, inside, len(self.coefficients))
        local = (inside - self.times[segment])[..., None]
        terms = derivative(self.coefficients, order)[segment]
        value = np.zeros((*t.shape, self.coefficients.shape[2]))
        for power in reversed(range(terms.shape[-2])):
            value = value * local + terms[..., power, :]
        if order > 0:
            value[(t < 0) | (t > self.duration)] = 0.0
        return value

    def extremes(self, order: int = 0) -> tuple[Array, Array]:
        """Return the smallest and largest value of every joint, (n,) each, exactly and not by sampling.

        Args:
            order: 0 position, 1 velocity, 2 acceleration, 3 jerk, and so on.

        Raises:
            KindError: the order is no whole number.
            InvalidValueError: it is below 0.
        """
        lowest, highest = self._segment_extremes(order)
        return lowest.min(axis=0), highest.max(axis=0)

    def segment_peaks(self, order: int) -> Array:
        """Return the largest magnitude of a derivative on every segment for every joint, (m, n), exactly.

        Raises:
            KindError: the order is no whole number.
            InvalidValueError: it is below 0.
        """
        lowest, highest = self._segment_extremes(order)
        return np.maximum(np.abs(lowest), np.abs(highest))

    def _segment_extremes(self, order: int) -> tuple[Array, Array]:
        integer(order, "order", least=0)
        return extremes(derivative(self.coefficients, order), self.lengths)

    def peaks(self, order: int) -> Array:
        """Return the largest magnitude of a derivative for every joint, (n,), exactly and not by sampling.

        Raises:
            KindError: the order is no whole number.
            InvalidValueError: it is below 0.
        """
        integer(order, "order", least=0)
        return peaks(derivative(self.coefficients, order), self.lengths)

    def slowed(self, factor: float) -> Trajectory:
        """Return the same path run ``factor`` times slower; faster below 1.

        Raises:
            KindError: the factor is no number.
            InvalidValueError: it is not above 0.
        """
        return run_slower(self.times, self.coefficients, positive(factor, "factor"))

    def retimed(self, duration: float) -> Trajectory:
        """Return the same path run in another time, which is met to the last bit.

        Args:
            duration: [s].

        Raises:
            KindError: the duration is no number.
            InvalidValueError: it is not above 0, or the motion has no duration that could change.
        """
        duration = positive(duration, "duration", "s")
        if self.duration == 0:
            raise InvalidValueError(f"a motion of 0 s cannot be stretched to {duration:g} s; use hold(q, {duration:g})")
        slow = self.slowed(duration / self.duration)
        times = np.append(np.minimum(slow.times[:-1], duration), duration)
        return Trajectory(times=times, coefficients=slow.coefficients)

    def reversed(self) -> Trajectory:
        """Return the reversed motion: at time t where this motion is at the time t before its end."""
        signs = (-1.0) ** np.arange(self.coefficients.shape[1])
        back = shifted(self.coefficients, self.lengths)[::-1] * signs[:, None]
        return Trajectory(times=self.duration - self.times[::-1], coefficients=back)

    def until(self, t: float) -> Trajectory:
        """Return the first ``t`` seconds of the motion, all of it where it is not longer.

        Raises:
            KindError: the time is no number.
            InvalidValueError: it is below 0.
        """
        t = not_negative(t, "t", "s")
        if t >= self.duration:
            return self
        segments = int(np.searchsorted(self.times, t, side="right"))
        return Trajectory(times=np.append(self.times[:segments], t), coefficients=self.coefficients[:segments])

    def after(self, t: float) -> Trajectory:
        """Return the rest of the motion from a time [s] on; of one that is over, that it stands at its end.

        Raises:
            KindError: the time is no number.
            InvalidValueError: it is below 0.
        """
        t = not_negative(t, "t", "s")
        if t >= self.duration:
            return hold(self(self.duration), 0.0)
        first = int(np.searchsorted(self.times, t, side="right")) - 1
        begun = shifted(self.coefficients[first : first + 1], np.array([t - self.times[first]]))
        coefficients = np.concatenate([begun, self.coefficients[first + 1 :]])
        return Trajectory(times=np.append(0.0, self.times[first + 1 :] - t), coefficients=coefficients)

    def sampled(self, period: float) -> Samples:
        """Return the motion at every tick of a servo, from the start on, and at its very end.

        Args:
            period: of the servo [s]. The last step is shorter where the duration is no whole number of periods:
                ``whole_ticks`` makes it one.

        Raises:
            KindError: the period is no number.
            InvalidValueError: it is not above 0, or so short that there would be more than 1e8 samples.
        """
        period = positive(period, "period", "s")
        if self.duration / period > _MAX_SAMPLES:
            raise InvalidValueError(
                f"period: {period:g} s divides {self.duration:g} s into {self.duration / period:.3g} samples; "
                f"at most {_MAX_SAMPLES:.0e} are allowed"
            )
        before = max(math.ceil(self.duration / period - _TICK_TOLERANCE), int(self.duration > 0))
        times = np.append(period * np.arange(before), self.duration)
        q, qd, qdd, jerk = (self(times, order) for order in range(4))
        return Samples(times=times, q=q, qd=qd, qdd=qdd, jerk=jerk)

    def _repr_html_(self) -> str:
        """Show start, end, range and peaks of every joint as a table."""
        columns = ("joint", "start", "end", "lowest", "highest", "peak speed", "peak acceleration")
        values = (self(0.0), self(self.duration), *self.extremes(), self.peaks(1), self.peaks(2))
        rows = [(str(number), *row) for number, row in enumerate(np.stack(values, axis=-1).tolist(), 1)]
        return html_table(f"{self.duration:.6g} s in {len(self.coefficients)} segments (SI units)", columns, rows)


def run_slower(times: Array, coefficients: Array, factor: float) -> Trajectory:
    """Return a trajectory, given by its attributes, that is run ``factor`` times slower."""
    with np.errstate(over="ignore", invalid="ignore"):  # what is no number then is refused
        powers = factor ** -np.arange(coefficients.shape[1], dtype=np.float64)
        slower = coefficients * powers[:, None]
    return Trajectory(times=times * factor, coefficients=slower)


def hold(q: ArrayLike, duration: float) -> Trajectory:
    """Return the motion of standing still at q (n,) for a time [s].

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: q is not (n,).
        InvalidValueError: a number is NaN or infinite, or the duration below 0.
    """
    duration = not_negative(duration, "duration", "s")
    return Trajectory(times=(0.0, duration), coefficients=joint_vector(q, "q")[None, None, :])


def join(parts: Sequence[Trajectory], *, gap: float = 1e-6) -> Trajectory:
    """Return trajectories run one after the other.

    Args:
        parts: one at least, of the same joints, each beginning where the one before ends.
        gap: how far the end of a part and the start of the next may be apart [rad] or [m]. Velocities may jump: see
            ``continuity``.

    Raises:
        KindError: a part is no trajectory, or the gap no number.
        ShapeError: there is none, or their joints differ in number.
        InvalidValueError: a part begins elsewhere than the one before it ends.
    """
    if not isinstance(parts, Sequence):
        raise KindError(f"join: expected a list of trajectories, got {shown(parts)}")
    for part in parts:
        if not isinstance(part, Trajectory):
            raise KindError(f"join: expected trajectories, got {shown(part)}")
    gap = not_negative(gap, "gap")
    if not parts:
        raise ShapeError("join: expected at least one trajectory, got none")
    for i, (last, part) in enumerate(pairwise(parts), 1):
        _check_meeting(last, part, i, gap)
    powers = max(part.coefficients.shape[1] for part in parts)
    padded = [np.pad(p.coefficients, ((0, 0), (0, powers - p.coefficients.shape[1]), (0, 0))) for p in parts]
    starts = np.cumsum([0.0, *(part.duration for part in parts)])
    times = np.concatenate([[0.0], *(part.times[1:] + start for part, start in zip(parts, starts[:-1], strict=True))])
    return Trajectory(times=times, coefficients=np.concatenate(padded))


def _check_meeting(last: Trajectory, part: Trajectory, number_of_last: int, gap: float) -> None:
    """Refuse two parts of which the second does not begin where the first ends."""
    where = f"join: part {number_of_last + 1}"
    joints, before = part.coefficients.shape[2], last.coefficients.shape[2]
    if joints != before:
        raise ShapeError(f"{where} moves {joints} joints, part {number_of_last} before it {before}")
    apart = np.abs(part(0.0) - last(last.duration))
    if not apart.max() <= gap:
        j = int(apart.argmax())
        raise InvalidValueError(
            f"{where} begins with joint {j + 1} at {part(0.0)[j]:.6g}, part {number_of_last} ends with it at "
            f"{last(last.duration)[j]:.6g}: {apart[j]:.3g} apart, {gap:g} is allowed"
        )


def whole_ticks(trajectory: Trajectory, period: float) -> Trajectory:
    """Return the trajectory slowed by less than one servo period so that it ends on a tick.

    Args:
        trajectory: what to run.
        period: of the servo [s].

    Raises:
        KindError: the period is no number.
        InvalidValueError: it is not above 0, or so short that the ticks cannot be counted.
    """
    period = positive(period, "period", "s")
    if trajectory.duration == 0:
        return trajectory
    return trajectory.retimed(_ticks(trajectory.duration, period) * period)


def slowed_together(trajectories: Sequence[Trajectory], duration: float, period: float) -> list[Trajectory]:
    """Return trajectories slowed alike, so that they take a duration together, rounded up to a tick.

    Each ends on a tick, and so is slowed by a tick more or less than the others; none is run faster.

    Args:
        trajectories: one after the other, each a whole number of servo periods long.
        duration: that all should take [s]; they take as long as they do where that is longer.
        period: of the servo [s].

    Raises:
        KindError: the period or the duration is no number.
        InvalidValueError: the period is not above 0, or the duration below 0.
    """
    period, duration = positive(period, "period", "s"), not_negative(duration, "duration", "s")
    ends = [0, *accumulate(round(trajectory.duration / period) for trajectory in trajectories)]
    least = ends[-1]
    if least == 0:
        return list(trajectories)
    ticks = max(least, _ticks(duration, period))
    # In whole numbers, so that none gets fewer ticks than it has.
    slow_ends = [(2 * end * ticks + least) // (2 * least) for end in ends]
    counts = (end - start for start, end in pairwise(slow_ends))
    pairs = zip(trajectories, counts, strict=True)
    return [trajectory.retimed(count * period) if count else trajectory for trajectory, count in pairs]


def _ticks(duration: float, period: float) -> int:
    """Return how many servo periods a motion takes that is not shorter, one at least.

    Raises:
        InvalidValueError: there are more than a float64 can count.
    """
    periods = duration / period
    if math.isinf(periods):
        raise InvalidValueError(f"period: {period:g} s divides {duration:g} s into more ticks than can be counted")
    return max(1, math.ceil(periods - _TICK_TOLERANCE))
