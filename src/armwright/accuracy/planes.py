"""Planes across a commanded path at even distances along it, and where a measured run goes through them.

Runs are compared with the path where they are, not when they are there: a run may be slow, stop, or be sampled
unevenly. A plane is often passed more than once, on another leg of the path or by noise. What counts is a passage from
behind to the front, where no other part of the path is much nearer. Of all choices of passages, one per plane, the one
with the least sum of squares of the distances from the path, and of the ways back from plane to plane, is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.accuracy.trace import Trace, frozen_array, turned
from armwright.arrays import Array, reduce_by_fields
from armwright.errors import InvalidValueError

# Where two legs meet at a larger turn than this [rad], there is a corner, and the planes do not turn gradually.
CORNER = np.radians(20)
# Passages of one plane that are looked at, the nearest ones.
_NEAREST = 100
# A passage belongs to a plane if no other part of the path is nearer by more than this factor, rounding aside.
_NEARER, _ROUNDING = 2.0, 1e-9
# Passages whose distances from the path are worked out at once.
_AT_ONCE = 256
# So much of a path at either end may be left out, where runs begin late or end early.
ENDS = 0.05
# Points of a commanded path this much nearer together than its length are one.
_SAME = 1e-12


@attrs.frozen(kw_only=True, eq=False)
class Planes:
    """Planes across a path.

    Attributes:
        stations: (m,) distance along the path [m].
        points: (m, 2) or (m, 3) where they cut it [m].
        normals: (m, 2) or (m, 3) unit vectors along it.
        angles: (m, k) commanded angles there [rad], free of jumps.
        length: of the whole path [m].
    """

    stations: Array = attrs.field(converter=frozen_array)
    points: Array = attrs.field(converter=frozen_array)
    normals: Array = attrs.field(converter=frozen_array)
    angles: Array = attrs.field(converter=frozen_array)
    length: float

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class Passages:
    """Where and when a run goes through the planes.

    Attributes:
        places: (m, 2) or (m, 3) [m].
        times: (m,) [s]; None where the run has none.
        angles: (m, k) [rad], free of jumps.
    """

    places: Array = attrs.field(converter=frozen_array)
    times: Array | None
    angles: Array = attrs.field(converter=frozen_array)


@attrs.frozen(kw_only=True, eq=False)
class Legs:
    """A commanded path without its repeated points.

    Attributes:
        places: (c, 2) or (c, 3) its points [m].
        angles: (c, k) [rad], free of jumps.
        stations: (c,) distance along the path [m].
        directions: (c-1, 2) or (c-1, 3) unit vectors from point to point.
        corners: (c,) whether it turns sharply there.
    """

    places: Array
    angles: Array
    stations: Array
    directions: Array
    corners: Array


def legs_of(commanded: Trace) -> Legs:
    """Return the legs of a commanded path.

    Raises:
        InvalidValueError: it has no length.
    """
    steps = np.linalg.norm(np.diff(commanded.places, axis=0), axis=1)
    if not steps.sum() > 0:
        raise InvalidValueError("commanded path: all of its points are the same")
    kept = np.append(True, steps > _SAME * steps.sum())
    places = commanded.places[kept]
    ways = np.diff(places, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    directions = ways / lengths[:, None]
    cosines = np.sum(directions[:-1] * directions[1:], axis=1)
    return Legs(
        places=places,
        angles=turned(commanded.angles, len(kept))[kept],
        stations=np.append(0.0, np.cumsum(lengths)),
        directions=directions,
        corners=np.concatenate([[False], cosines < np.cos(CORNER), [False]]),
    )


def middles(length: float, count: int, part: tuple[float, float] = (0.0, 1.0)) -> Array:
    """Return the middles of ``count`` equal pieces of a part of a path, (count,) [m]."""
    start, end = part
    return np.asarray(length * (start + (end - start) * (np.arange(count) + 0.5) / count))


def planes_at(legs: Legs, stations: Array) -> Planes:
    """Return the planes at distances (m,) along a path [m]."""
    s = legs.stations
    leg = np.clip(np.searchsorted(s, stations, side="right") - 1, 0, len(s) - 2)
    part = ((stations - s[leg]) / (s[leg + 1] - s[leg]))[:, None]
    # Along a curve given by points the normal turns gradually from point to point; at a corner it jumps.
    before = np.vstack([legs.directions[:1], legs.directions])
    after = np.vstack([legs.directions, legs.directions[-1:]])
    mean = before + after
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), _SAME)
    sharp = legs.corners[:, None]
    start, end = np.where(sharp, after, mean)[leg], np.where(sharp, before, mean)[leg + 1]
    normals = (1 - part) * start + part * end
    return Planes(
        stations=stations,
        points=(1 - part) * legs.places[leg] + part * legs.places[leg + 1],
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        angles=(1 - part) * legs.angles[leg] + part * legs.angles[leg + 1],
        length=float(s[-1]),
    )


def passages(
    legs: Legs, stations: Array, runs: Sequence[Trace], *, what: str, ends: float = 0.0
) -> tuple[Planes, list[Passages]]:
    """Return where runs go through the planes of a path.

    Args:
        legs: of the path.
        stations: (m,) of the planes along it, rising [m].
        runs: with samples in order of time.
        what: how the measure is called in a message.
        ends: the part of the path at either end in which planes are left out that a run does not go through.

    Returns:
        The planes, without those left out, and the passages of every run.

    Raises:
        InvalidValueError: a run does not go through one of the planes.
    """
    planes = planes_at(legs, stations)
    found = [_candidates(legs, planes, run) for run in runs]
    passed = np.array([[len(at) > 0 for at, _ in one] for one in found])
    away = np.minimum(stations, planes.length - stations) > ends * planes.length
    missed = np.argwhere(~passed & away)
    if len(missed) or not passed.all(axis=0).any():
        run, i = missed[0] if len(missed) else np.argwhere(~passed)[0]
        raise InvalidValueError(
            f"{what}: run {run + 1} does not go through the plane at {stations[i] * 1e3:.4g} of "
            f"{planes.length * 1e3:.4g} mm of the commanded path: it begins too late, ends too early, "
            f"or cuts a corner{_corner_hint(legs, stations[i])}"
        )
    kept = np.flatnonzero(passed.all(axis=0))
    chosen = [_in_order([one[i] for i in kept], _along(run)) for one, run in zip(found, runs, strict=True)]
    return planes_at(legs, stations[kept]), [_passages(run, at) for run, at in zip(runs, chosen, strict=True)]


def _corner_hint(legs: Legs, station: float) -> str:
    """Say how far the nearest corner is, if there is one."""
    sharp = legs.stations[legs.corners]
    if not len(sharp):
        return ""
    return f"; the nearest corner is {np.abs(sharp - station).min() * 1e3:.4g} mm off: leave out what is near corners"


def _passages(run: Trace, at: Array) -> Passages:
    return Passages(
        places=_at(run.places, at),
        times=None if run.times is None else _at(run.times, at),
        angles=_at(turned(run.angles, len(run.places)), at),
    )


def _along(run: Trace) -> Array:
    """Return the way gone at every sample (n,) [m]."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(run.places, axis=0), axis=1)))


def _candidates(legs: Legs, planes: Planes, run: Trace) -> list[tuple[Array, Array]]:
    """Return for every plane where the run may go through it, as fractional numbers of samples, and how far off²."""
    found = []
    for point, normal in zip(planes.points, planes.normals, strict=True):
        at = _crossings(run.places, point, normal)
        off = np.sum((_at(run.places, at) - point) ** 2, axis=1)
        nearest = np.sort(np.argsort(off, kind="stable")[:_NEAREST])
        found.append((at[nearest], off[nearest]))
    every = np.concatenate([at for at, _ in found])
    clear = _clearances(legs, _at(run.places, every))
    own = np.sqrt(np.concatenate([off for _, off in found])) <= _NEARER * clear + _ROUNDING * planes.length
    pieces = np.split(own, np.cumsum([len(at) for at, _ in found])[:-1])
    return [(at[mine], off[mine]) for (at, off), mine in zip(found, pieces, strict=True)]


def _clearances(legs: Legs, places: Array) -> Array:
    """Return the distances of places (k, d) from a path, (k,) [m]."""
    starts, u = legs.places[:-1], legs.directions
    lengths = np.diff(legs.stations)
    found = np.empty(len(places))
    for first in range(0, len(places), _AT_ONCE):
        some = places[first : first + _AT_ONCE]
        relative = some[:, None, :] - starts
        part = np.clip(np.einsum("ksd,sd->ks", relative, u), 0.0, lengths)
        found[first : first + _AT_ONCE] = np.linalg.norm(relative - part[..., None] * u, axis=2).min(axis=1)
    return found


def _crossings(places: Array, point: Array, normal: Array) -> Array:
    """Return where a run goes through a plane from behind to the front, as fractional numbers of samples."""
    ahead = (places - point) @ normal
    at = np.flatnonzero((ahead[:-1] < 0) & (ahead[1:] >= 0))
    crossings = at + ahead[at] / (ahead[at] - ahead[at + 1])
    return np.asarray(np.append(0.0, crossings) if ahead[0] == 0 else crossings)


def _at(values: Array, at: Array) -> Array:
    """Return values at fractional numbers of samples (m,)."""
    before = np.minimum(at.astype(np.int64), len(values) - 2)
    part = (at - before).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1 - part) * values[before] + part * values[before + 1])


def _in_order(found: list[tuple[Array, Array]], along: Array) -> Array:
    """Choose one passage per plane, the sum of squares being the least."""
    best, last, origins = np.zeros(1), np.zeros(1), []
    for at, off in found:
        way = _at(along, at)
        costs = best[:, None] + np.maximum(last[:, None] - way[None, :], 0.0) ** 2
        origins.append(np.argmin(costs, axis=0))
        best, last = costs.min(axis=0) + off, way
    chosen = np.empty(len(found))
    k = int(np.argmin(best))
    for i in range(len(found) - 1, -1, -1):
        chosen[i] = found[i][0][k]
        k = int(origins[i][k])
    return chosen
