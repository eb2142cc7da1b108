"""Logs of an arm: positions and efforts of its joints in time, and what may be wrong with them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, Flags, exact_shape, floats, read_only
from armwright.errors import InvalidValueError, ShapeError, counted

# Samples farther apart than so many usual ones are a gap.
_GAP = 5.0
# Sampling times that differ by less than this part of the period are even.
_EVEN = 0.01
# Fewer samples than this are no motion.
LEAST_SAMPLES = 50
# A joint that moves by less does not move [rad], [m].
LEAST_MOTION = 1e-3
# Positions move if they change faster than this part of nearly the fastest.
_MOVES = 0.05
# A spike is farther from the median of so many readings than nearly all others are, by this factor; and by this part of
# the range.
_NEIGHBOURS, _NEARLY_ALL, _SPIKE, _SPIKE_PART = 5, 0.99, 8.0, 1e-2
# So many equal readings in a row at the largest magnitude of a joint are clipped.
_CLIPPED = 4


def _array(value: ArrayLike) -> Array:
    return read_only(floats(value, "log", LARGEST))


@attrs.frozen(kw_only=True, eq=False)
class Log:
    """Readings of the n joints of an arm at k times.

    Attributes:
        name: of the log, for messages.
        t: (k,) times [s], increasing.
        q: (k, n) joint positions [rad] or [m].
        effort: (k, n) efforts at the joints [N m] or [N]; or currents [A], where drive gains are sought.
        qd: (k, n) measured joint velocities; None where they were not measured.
        clipped: (k, n) whether a reading of the effort is at the end of its range.
        spikes: (k, n) whether a reading of the effort stands far out from its neighbours.
        notes: what a reader must know of how it was read.
    """

    name: str
    t: Array = attrs.field(converter=_array)
    q: Array = attrs.field(converter=_array)
    effort: Array = attrs.field(converter=_array)
    qd: Array | None = attrs.field(default=None, converter=attrs.converters.optional(_array))
    clipped: Flags = attrs.field(
        default=attrs.Factory(lambda self: _clipped(self.effort), takes_self=True), converter=read_only
    )
    spikes: Flags = attrs.field(
        default=attrs.Factory(lambda self: np.zeros(self.effort.shape, dtype=np.bool_), takes_self=True),
        converter=read_only,
    )
    notes: tuple[str, ...] = ()

    @classmethod
    def of_readings(cls, name: str, t: Array, q: Array, effort: Array, qd: Array | None = None) -> Log:
        """Return a log without the readings that repeat the time of the one before, and a note of them.

        Raises:
            InvalidValueError: there are too few others, or a time goes back.
        """
        kept = np.concatenate([[True], np.diff(t) != 0]) if len(t) else np.zeros(0, dtype=np.bool_)
        count = int((~kept).sum())
        note = f"{name}: {counted(count, 'reading')} repeat the time of the one before, and are left out"
        return cls(
            name=name,
            t=t[kept],
            q=q[kept],
            effort=effort[kept],
            qd=None if qd is None else qd[kept],
            notes=(note,) if count else (),
        )

    def __attrs_post_init__(self) -> None:
        """Refuse arrays that do not fit together, too few readings, and times that do not increase."""
        if self.t.ndim != 1 or self.q.ndim != 2:
            raise ShapeError(
                f"{self.name}: expected times (k,) and positions (k, n), got {self.t.shape}, {self.q.shape}"
            )
        shape = len(self.t), self.q.shape[1]
        for key in ("q", "effort", "qd"):
            if getattr(self, key) is not None:
                exact_shape(getattr(self, key), shape, f"{self.name}: {key}", LARGEST)
        if len(self.t) < LEAST_SAMPLES:
            raise InvalidValueError(f"{self.name}: expected at least {LEAST_SAMPLES} readings, got {len(self.t)}")
        wrong = np.flatnonzero(np.diff(self.t) <= 0)
        if len(wrong):
            i = int(wrong[0])
            raise InvalidValueError(
                f"{self.name}: expected times that increase, got {self.t[i]:.6g} s and then {self.t[i + 1]:.6g} s"
            )

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def period(self) -> float:
        """The usual time between two readings [s]."""
        return float(np.median(np.diff(self.t)))

    def take(self, rows: slice) -> Log:
        """Return a part of the log."""
        return attrs.evolve(
            self,
            t=self.t[rows],
            q=self.q[rows],
            effort=self.effort[rows],
            qd=None if self.qd is None else self.qd[rows],
            clipped=self.clipped[rows],
            spikes=self.spikes[rows],
        )

    def moving(self) -> Log:
        """Return the log from the first motion to the last, with what is next to it.

        What a joint that stands before and after a program is held by, brakes or drives, nobody knows.
        """
        rates = np.abs(np.diff(self.q, axis=0)).max(axis=1) / np.diff(self.t)
        active = np.flatnonzero(rates > _MOVES * np.quantile(rates, 0.99))
        if not len(active):
            return self
        first, last = max(0, int(active[0]) - LEAST_SAMPLES // 2), int(active[-1]) + LEAST_SAMPLES // 2
        return self.take(slice(first, last)) if last - first >= LEAST_SAMPLES else self

    def without_spikes(self) -> Log:
        """Return the log without single readings that stand far out from their neighbours, and a note of them.

        Positions are interpolated there, and efforts are left out.
        """
        ends = self._gap_ends
        of_q, of_effort = _spikes(self.q, ends), _spikes(self.effort, ends)
        if not of_q.any() and not of_effort.any():
            return self
        q = self.q.copy()
        for joint in np.flatnonzero(of_q.any(axis=0)):
            wrong = of_q[:, joint]
            q[wrong, joint] = np.interp(self.t[wrong], self.t[~wrong], q[~wrong, joint])
        notes = []
        for what, spikes in (("position", of_q), ("effort", of_effort)):
            if spikes.any():
                row, joint = np.argwhere(spikes)[0].tolist()
                notes.append(
                    f"{self.name}: {counted(int(spikes.sum()), 'reading')} of {what}s stand far out from their "
                    f"neighbours, and are left out; the first of joint {joint + 1} at {self.t[row]:.4g} s"
                )
        return attrs.evolve(self, q=q, spikes=of_effort, notes=(*self.notes, *notes))

    @property
    def _gap_ends(self) -> list[int]:
        """The readings with which the log goes on after gaps."""
        return (np.flatnonzero(np.diff(self.t) > _GAP * self.period) + 1).tolist()

    def gaps(self) -> list[tuple[float, float]]:
        """Return beginning and length of the gaps in the log [s]."""
        steps = np.diff(self.t)
        return [(float(self.t[i]), float(steps[i])) for i in np.flatnonzero(steps > _GAP * self.period)]

    def pieces(self) -> Iterator[Log]:
        """Give the parts between gaps that are long enough, each sampled evenly."""
        ends = self._gap_ends
        for first, last in zip([0, *ends], [*ends, len(self.t)], strict=True):
            if last - first >= LEAST_SAMPLES:
                yield self.take(slice(int(first), int(last))).even()

    def even(self) -> Log:
        """Return the log at even times, interpolated where it was not sampled evenly."""
        steps = np.diff(self.t)
        period = (self.t[-1] - self.t[0]) / len(steps)
        if np.abs(steps - period).max() <= _EVEN * period:
            return self
        t = self.t[0] + period * np.arange(len(self.t))

        def at(values: Array) -> Array:
            return np.stack([np.interp(t, self.t, column) for column in values.T], axis=1)

        qd = None if self.qd is None else at(self.qd)
        clipped, spikes = (at(flags.astype(np.float64)) > 0 for flags in (self.clipped, self.spikes))
        return attrs.evolve(self, t=t, q=at(self.q), effort=at(self.effort), qd=qd, clipped=clipped, spikes=spikes)


def with_gains(log: Log, gains: ArrayLike) -> Log:
    """Return a log of currents as one of efforts.

    Args:
        log: its ``effort`` are currents [A].
        gains: (n,) effort at the joint per current [N m/A] or [N/A]; negative where they count the other way.

    Raises:
        ShapeError: there are not n gains.
    """
    return attrs.evolve(log, effort=log.effort * exact_shape(gains, (log.n,), "gains", LARGEST))


def _spikes(values: Array, gap_ends: Sequence[int]) -> Flags:
    """Return which readings (k, n) stand far out from their neighbours on the same side of a gap."""
    from scipy.ndimage import median_filter  # noqa: PLC0415 - takes a tenth of a second to load

    medians = [median_filter(part, size=(_NEIGHBOURS, 1), mode="nearest") for part in np.split(values, gap_ends)]
    apart = np.abs(values - np.concatenate(medians))
    usual = np.quantile(apart, _NEARLY_ALL, axis=0)
    return np.asarray(apart > _SPIKE * usual + _SPIKE_PART * np.ptp(values, axis=0))


def _clipped(effort: Array) -> Flags:
    """Return which readings (k, n) are several equal ones in a row, the largest of their joint."""
    result = np.zeros(effort.shape, dtype=np.bool_)
    for joint, values in enumerate(effort.T):
        for limit in {values.max(), values.min()}:
            at_limit = values == limit
            # Beginnings and ends of runs at the limit.
            edges = np.flatnonzero(np.diff(np.concatenate([[0], at_limit.astype(np.int8), [0]])))
            for first, last in zip(edges[::2], edges[1::2], strict=True):
                # A log that stands still all the time is not clipped.
                result[first:last, joint] |= last - first >= _CLIPPED and last - first < len(values) // 2
    return result
