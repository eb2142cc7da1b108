"""Planes across a commanded path at even distances along it, and where a measured run goes through them.

Runs are compared with the path where they are, not when they are there: a run may be slow, stop, or be sampled
unevenly. A plane is often passed more than once, on another leg of the path or by noise. What counts is a passage from
behind to the front, where no other part of the path is much nearer. Of all choices of passages, one per plane, the one
with the least sum of squares is taken: of the distances from the path, and of the lengths run backwards between planes.
"""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.accuracy.trace import Trace, unwrap_angles
from armwright.arrays import Array
from armwright.errors import InvalidValueError

# Where two legs meet at a larger angle than this [rad], there is a corner, and the planes do not turn gradually.
CORNER = np.radians(20)
# Passages of one plane that are looked at, the nearest ones.
_MAX_CANDIDATES = 100
# A passage belongs to a plane if no other part of the path is nearer by more than this factor, rounding aside.
_MAX_DISTANCE_RATIO, _ROUNDING = 2.0, 1e-9
# Passages whose distances from the path are worked out at once.
_BLOCK = 256
# So much of a path at either end may be left out, where runs begin late or end early.
END_SHARE = 0.05
# Points of a commanded path this much nearer together than its length are one.
_COINCIDENT = 1e-12


@attrs.frozen(kw_only=True, eq=False)
class Planes:
    """Planes across a path.

    Attributes:
        stations: (m,) distance along the path [m].
        points: (m, 2) or (m, 3) where they cut it [m].
        normals: (m, 2) or (m, 3) unit vectors along it.
        angles: (m, k) commanded angles there [rad], free of jumps.
    """

    stations: Array
    points: Array
    normals: Array
    angles: Array


@attrs.frozen(kw_only=True, eq=False)
class Passages:
    """Where and when a run goes through the planes.

    Attributes:
        positions: (m, 2) or (m, 3) [m].
        times: (m,) [s]; None where the run has none.
        angles: (m, k) [rad], free of jumps.
    """

    positions: Array
    times: Array | None
    angles: Array


@attrs.frozen(kw_only=True, eq=False)
class Legs:
    """A commanded path without its repeated points.

    Attributes:
        positions: (c, 2) or (c, 3) its points [m].
        angles: (c, k) [rad], free of jumps.
        stations: (c,) distance along the path [m].
        directions: (c-1, 2) or (c-1, 3) unit vectors from point to point.
        corners: (c,) whether its direction changes sharply there.
    """

    positions: Array
    angles: Array
    stations: Array
    directions: Array
    corners: Array


def legs_of(commanded: Trace) -> Legs:
    """Return the legs of a commanded path.

    Raises:
        InvalidValueError: it has no length.
    """
    steps = np.linalg.norm(np.diff(commanded.positions, axis=0), axis=1)
    if not steps.sum() > 0:
        raise InvalidValueError("commanded path: all of its points coincide")
    distinct = np.append(True, steps > _COINCIDENT * steps.sum())
    positions = commanded.positions[distinct]
    legs = np.diff(positions, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    directions = legs / lengths[:, None]
    cosines = np.sum(directions[:-1] * directions[1:], axis=1)
    return Legs(
        positions=positions,
        angles=unwrap_angles(commanded.angles, len(distinct))[distinct],
        stations=np.append(0.0, np.cumsum(lengths)),
        directions=directions,
        corners=np.concatenate([[False], cosines < np.cos(CORNER), [False]]),
    )


def planes_at(legs: Legs, stations: Array) -> Planes:
    """Return the planes at distances (m,) along a path [m]."""
    s = legs.stations
    leg = np.clip(np.searchsorted(s, stations, side="right") - 1, 0, len(s) - 2)
    part = ((stations - s[leg]) / (s[leg + 1] - s[leg]))[:, None]
    # Along a curve given by points the normal turns gradually from point to point; at a corner it jumps.
    before = np.vstack([legs.directions[:1], legs.directions])
    after = np.vstack([legs.directions, legs.directions[-1:]])
    mean = before + after
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), _COINCIDENT)
    sharp = legs.corners[:, None]
    start, end = np.where(sharp, after, mean)[leg], np.where(sharp, before, mean)[leg + 1]
    normals = (1 - part) * start + part * end
    return Planes(
        stations=stations,
        points=(1 - part) * legs.positions[leg] + part * legs.positions[leg + 1],
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        angles=(1 - part) * legs.angles[leg] + part * legs.angles[leg + 1],
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
    candidates = [_candidates(legs, planes, run) for run in runs]
    passed = np.array([[len(samples) > 0 for samples, _ in by_plane] for by_plane in candidates])
    length = float(legs.stations[-1])
    away = np.minimum(stations, length - stations) > ends * length
    not_passed = np.argwhere(~passed & away)
    if len(not_passed) or not passed.all(axis=0).any():
        run, i = not_passed[0] if len(not_passed) else np.argwhere(~passed)[0]
        raise InvalidValueError(
            f"{what}: run {run + 1} does not go through the plane at {stations[i] * 1e3:.4g} of "
            f"{length * 1e3:.4g} mm of the commanded path: it begins too late, ends too early, "
            f"or cuts a corner{_corner_hint(legs, stations[i])}"
        )
    common = np.flatnonzero(passed.all(axis=0))
    return planes_at(legs, stations[common]), [
        _select_passages(run, [by_plane[i] for i in common]) for by_plane, run in zip(candidates, runs, strict=True)
    ]


def _corner_hint(legs: Legs, station: float) -> str:
    """Say how far the nearest corner is, if there is one."""
    distance = np.abs(legs.stations[legs.corners] - station).min(initial=np.inf) * 1e3
    hint = f"; the nearest corner is {distance:.4g} mm away: exclude the sections near corners"
    return hint if np.isfinite(distance) else ""


def _candidates(legs: Legs, planes: Planes, run: Trace) -> list[tuple[Array, Array]]:
    """Return for every plane the fractional samples at which the run may go through it, and the squared distances."""
    candidates = []
    for point, normal in zip(planes.points, planes.normals, strict=True):
        samples = _crossings(run.positions, point, normal)
        squares = np.sum((_interpolate(run.positions, samples) - point) ** 2, axis=1)
        nearest = np.sort(np.argsort(squares, kind="stable")[:_MAX_CANDIDATES])
        candidates.append((samples[nearest], squares[nearest]))
    all_samples = np.concatenate([samples for samples, _ in candidates])
    distances = np.sqrt(np.concatenate([squares for _, squares in candidates]))
    smallest = _distances_from_path(legs, _interpolate(run.positions, all_samples))
    is_nearest = distances <= _MAX_DISTANCE_RATIO * smallest + _ROUNDING * legs.stations[-1]
    ends = np.cumsum([len(samples) for samples, _ in candidates])[:-1]
    return [
        (samples[i], squares[i]) for (samples, squares), i in zip(candidates, np.split(is_nearest, ends), strict=True)
    ]


def _distances_from_path(legs: Legs, positions: Array) -> Array:
    """Return the distances of positions (k, d) from a path, (k,) [m]."""
    starts, u = legs.positions[:-1], legs.directions
    lengths = np.diff(legs.stations)
    distances = np.empty(len(positions))
    for first in range(0, len(positions), _BLOCK):
        some = positions[first : first + _BLOCK]
        relative = some[:, None, :] - starts
        part = np.clip(np.einsum("ksd,sd->ks", relative, u), 0.0, lengths)
        distances[first : first + _BLOCK] = np.linalg.norm(relative - part[..., None] * u, axis=2).min(axis=1)
    return distances


def _crossings(positions: Array, point: Array, normal: Array) -> Array:
    """Return where a run goes through a plane from behind to the front, as fractional numbers of samples."""
    ahead = (positions - point) @ normal
    before = np.flatnonzero((ahead[:-1] < 0) & (ahead[1:] >= 0))
    crossings = before + ahead[before] / (ahead[before] - ahead[before + 1])
    return np.asarray(np.append(0.0, crossings) if ahead[0] == 0 else crossings)


def _interpolate(values: Array, samples: Array) -> Array:
    """Return values at fractional numbers of samples (m,)."""
    before = np.minimum(samples.astype(np.int64), len(values) - 2)
    part = (samples - before).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1 - part) * values[before] + part * values[before + 1])


def _select_passages(run: Trace, candidates: list[tuple[Array, Array]]) -> Passages:
    """Return one passage per plane, those with the least sum of squares."""
    # The distance covered until every sample.
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(run.positions, axis=0), axis=1)))
    best, last, origins = np.zeros(1), np.zeros(1), []
    for samples, squares in candidates:
        s = _interpolate(along, samples)
        costs = best[:, None] + np.maximum(last[:, None] - s[None, :], 0.0) ** 2
        origins.append(np.argmin(costs, axis=0))
        best, last = costs.min(axis=0) + squares, s
    chosen = np.empty(len(candidates))
    k = int(np.argmin(best))
    for i in range(len(candidates) - 1, -1, -1):
        chosen[i] = candidates[i][0][k]
        k = int(origins[i][k])
    return Passages(
        positions=_interpolate(run.positions, chosen),
        times=None if run.times is None else _interpolate(run.times, chosen),
        angles=_interpolate(unwrap_angles(run.angles, len(run.positions)), chosen),
    )
