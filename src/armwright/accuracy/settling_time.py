"""Coming to rest: stabilisation time, overshoot, minimum posing time."""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.accuracy.cycles import Kind, check_cycles
from armwright.accuracy.trace import Trace, frozen_array, refuse_mixed_dimensions
from armwright.arrays import Array, positive, reduce_by_fields
from armwright.errors import InvalidValueError

# The attained pose is the mean over this last part of a record, in which nothing may happen any more.
REST_SHARE = 0.1
# On the edge of the band by so little is rounding.
_ROUNDING = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class Settling:
    """How a robot comes to rest at a pose.

    Attributes:
        time: stabilisation time, the mean of all cycles [s].
        overshoot: OV, the largest of all cycles [m]; 0 where the band was never left again.
        times: (n,) stabilisation time of each cycle [s].
        overshoots: (n,) of each cycle [m].
        entered: (n,) when the band was first entered [s].
        settled: (n,) when it was entered for good [s].
        band: radius of the band [m].
        cycles: n.
    """

    time: float
    overshoot: float
    times: Array = attrs.field(converter=frozen_array)
    overshoots: Array = attrs.field(converter=frozen_array)
    entered: Array = attrs.field(converter=frozen_array)
    settled: Array = attrs.field(converter=frozen_array)
    band: float
    cycles: int

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class PosingTime:
    """How long it takes from rest at one pose to rest at another.

    Attributes:
        time: the mean of all cycles [s].
        distance: between the two poses, the mean of all cycles [m].
        times: (n,) of each cycle [s].
        band: radius of the band about the attained pose [m].
        cycles: n.
    """

    time: float
    distance: float
    times: Array = attrs.field(converter=frozen_array)
    band: float
    cycles: int

    __reduce__ = reduce_by_fields


def settling(runs: Sequence[Trace], band: float, *, few: bool = False) -> Settling:
    """Return stabilisation time and overshoot at a pose.

    The attained pose is the mean over the last tenth of each record.

    Args:
        runs: records with times, from outside the band until long after rest.
        band: distance from the attained pose that counts as rest, usually RP [m].
        few: take fewer than 3 cycles.

    Raises:
        KindError: the band is not a number.
        ShapeError: the runs have different numbers of columns.
        InvalidValueError: there are too few cycles, a record begins inside the band or ends outside, or has no times.

    Source:
        ISO 9283:1998, 7.4 and 7.5.
    """
    band = _check_runs("settling", runs, band, few=few)
    arrivals = [_find_arrival(run, band, j) for j, run in enumerate(runs)]
    entered, settled, overshoots = (np.array(column) for column in zip(*arrivals, strict=True))
    return Settling(
        time=float((settled - entered).mean()),
        overshoot=float(overshoots.max()),
        times=settled - entered,
        overshoots=overshoots,
        entered=entered,
        settled=settled,
        band=band,
        cycles=len(runs),
    )


def posing_time(runs: Sequence[Trace], band: float, *, few: bool = False) -> PosingTime:
    """Return the time from departure to rest, beside the distance of the two poses.

    Departure is when the position of the first sample is more than the band away.

    Args:
        runs: records with times, from rest at one pose until long after rest at the other.
        band: distance from a pose that counts as rest, usually RP [m].
        few: take fewer than 3 cycles.

    Raises:
        KindError: the band is not a number.
        ShapeError: the runs have different numbers of columns.
        InvalidValueError: there are too few cycles, a record ends outside the band, or has no times.

    Source:
        ISO 9283:1998, 9.
    """
    band = _check_runs("posing", runs, band, few=few)
    times, distances = [], []
    for j, run in enumerate(runs):
        _, settled, _ = _find_arrival(run, band, j)
        times.append(settled - _departure_time(run, band))
        distances.append(float(np.linalg.norm(attained_position(run) - run.positions[0])))
    return PosingTime(
        time=float(np.mean(times)), distance=float(np.mean(distances)), times=times, band=band, cycles=len(runs)
    )


def attained_position(run: Trace) -> Array:
    """Return where a record comes to rest: the mean position of its last tenth (2,) or (3,) [m]."""
    t = run.timed("settling")
    return np.asarray(run.positions[t >= t[-1] - REST_SHARE * (t[-1] - t[0])].mean(axis=0))


def _check_runs(kind: Kind, runs: Sequence[Trace], band: float, *, few: bool) -> float:
    check_cycles(kind, [len(runs)], few=few, least=1)
    refuse_mixed_dimensions([run.positions for run in runs], kind)
    return positive(band, f"{kind}: band", "m")


def _find_arrival(run: Trace, band: float, cycle: int) -> tuple[float, float, float]:
    """Return when a run enters the band, when it does so for good, and how far it swings out between the two."""
    t = run.timed("settling")
    relative = run.positions - attained_position(run)
    distances = np.linalg.norm(relative, axis=1)
    outside = np.flatnonzero(distances > band)
    name, distance = f"settling: run {cycle + 1}", f"{band * 1e3:g} mm"
    if not len(outside) or outside[0] != 0:
        raise InvalidValueError(f"{name} begins within {distance} of its end; start the record before the arrival")
    if t[outside[-1]] >= t[-1] - REST_SHARE * (t[-1] - t[0]):
        remedy = "record longer, or use a wider band"
        raise InvalidValueError(f"{name} is still more than {distance} away in the last tenth of its record; {remedy}")
    entries = _entry_times(t, relative, band)
    entered = float(np.nanmin(entries))
    swings = float(distances[t >= entered].max())
    return entered, float(entries[outside[-1]]), swings if swings > band * (1 + _ROUNDING) else 0.0


def _entry_times(t: Array, relative: Array, band: float) -> Array:
    """Return when a run goes into the ball of the band between each sample and the next (n-1,), NaN where it does not.

    A fast run may be through the ball between two samples, which counts.
    """
    start, step = relative[:-1], np.diff(relative, axis=0)
    # |start + part * step| = band
    a, b, c = np.sum(step**2, axis=1), np.sum(start * step, axis=1), np.sum(start**2, axis=1) - band**2
    root = b**2 - a * c
    enters = (c > 0) & (b < 0) & (root >= 0)
    part = np.where(enters, c, np.nan) / np.where(enters, -b + np.sqrt(np.maximum(root, 0.0)), 1.0)
    return np.asarray(t[:-1] + np.where(part <= 1, part, np.nan) * np.diff(t))


def _departure_time(run: Trace, band: float) -> float:
    """Return when a run leaves the band about its first position."""
    t, distances = run.timed("posing"), np.linalg.norm(run.positions - run.positions[0], axis=1)
    after = int(np.argmax(distances > band))
    part = (band - distances[after - 1]) / (distances[after] - distances[after - 1])
    return float(t[after - 1] + part * (t[after] - t[after - 1]))
