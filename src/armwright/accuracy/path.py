"""Accuracy and repeatability of a path, AT and RT, and the speed along it, AV, RV and FV."""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.accuracy.angles import angle_deviations, mean_angles, three_sigma, wrap_to_pi
from armwright.accuracy.cycles import Kind, check_cycles
from armwright.accuracy.planes import END_SHARE, Legs, legs_of, passages
from armwright.accuracy.trace import Trace, frozen_array, refuse_mixed_dimensions
from armwright.arrays import Array, number, positive, reduce_by_fields
from armwright.errors import InvalidValueError, ShapeError

# Planes across a path, and sections over which speeds are taken.
PLANES, SECTIONS = 200, 20
# The part of a path on which the speed is steady, unless told otherwise.
STEADY = (0.25, 0.75)


@attrs.frozen(kw_only=True, eq=False)
class PathDeviation:
    """How far runs along a path are from it, and from one another.

    Attributes:
        accuracy: AT_P, the largest distance of the mean run from the path [m].
        accuracy_at: how far along the path [m].
        accuracy_angles: (k,) AT_a, AT_b, AT_c, the largest of mean less commanded angle, without sign [rad].
        repeatability: RT_P, the largest of mean distance from the mean run and three deviations of it [m].
        repeatability_at: how far along the path [m].
        repeatability_angles: (k,) RT_a, RT_b, RT_c, the largest three standard deviations [rad].
        stations: (m,) how far along the path the planes are [m].
        offsets: (m,) distance of the mean run from the path [m].
        radii: (m,) mean distance from the mean run and three deviations [m].
        mean_positions: (m, 2) or (m, 3) the mean run [m].
        cycles: n.
    """

    accuracy: float
    accuracy_at: float
    accuracy_angles: Array = attrs.field(converter=frozen_array)
    repeatability: float
    repeatability_at: float
    repeatability_angles: Array = attrs.field(converter=frozen_array)
    stations: Array = attrs.field(converter=frozen_array)
    offsets: Array = attrs.field(converter=frozen_array)
    radii: Array = attrs.field(converter=frozen_array)
    mean_positions: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class PathVelocity:
    """How well runs keep the commanded speed.

    Attributes:
        accuracy: AV, mean less commanded speed, in parts of the commanded one.
        repeatability: RV, three deviations of the mean speeds of the runs, in parts of the commanded speed.
        fluctuation: FV, the largest difference of speeds within one run [m/s].
        stations: (m,) midpoints of the sections along the path [m].
        speeds: (n, m) of every run on every stretch [m/s].
        cycles: n.
    """

    accuracy: float
    repeatability: float
    fluctuation: float
    stations: Array = attrs.field(converter=frozen_array)
    speeds: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def path_deviation(
    commanded: Trace,
    runs: Sequence[Trace],
    *,
    planes: int = PLANES,
    corners: float = 0.0,
    kind: Kind = "path",
    few: bool = False,
) -> PathDeviation:
    """Return AT and RT of a path.

    Args:
        commanded: its points, from start to end.
        runs: what was measured, each from start to end in the direction of the path.
        planes: across the path, at even distances, the first half a distance from its start. In the first and the
            last 5 % of the path those are left out that a run does not go through.
        corners: planes nearer than this to a corner of the path are left out [m].
        kind: ``path``, or ``reorientation`` where the orientation changes to and fro along a straight line.
        few: take fewer than 10 cycles.

    Raises:
        ShapeError: path and runs have different numbers of columns.
        InvalidValueError: there are too few cycles or planes, the path has no length, or a run misses a plane.

    Source:
        ISO 9283:1998, 8.2 to 8.4.
    """
    count = _check_runs(kind, commanded, runs, few=few)
    legs = legs_of(commanded)
    if planes < 1:
        raise InvalidValueError(f"{kind}: expected at least one plane, got {planes}")
    stations = _exclude_corners(legs, legs.stations[-1] * ((np.arange(planes) + 0.5) / planes), corners)
    across, passed = passages(legs, stations, runs, what=kind, ends=END_SHARE)
    P, A = np.array([run.positions for run in passed]), np.array([run.angles for run in passed])
    mean = P.mean(axis=0)
    distances = np.linalg.norm(P - mean, axis=2)
    offsets = np.linalg.norm(mean - across.points, axis=1)
    radii = distances.mean(axis=0) + 3 * distances.std(axis=0, ddof=1)
    rotations = [wrap_to_pi(mean_angles(A[:, i]) - across.angles[i]) for i in range(len(mean))]
    scatter = [three_sigma(angle_deviations(A[:, i])) for i in range(len(mean))]
    return PathDeviation(
        accuracy=float(offsets.max()),
        accuracy_at=float(across.stations[offsets.argmax()]),
        accuracy_angles=np.abs(rotations).max(axis=0),
        repeatability=float(radii.max()),
        repeatability_at=float(across.stations[radii.argmax()]),
        repeatability_angles=np.max(scatter, axis=0),
        stations=across.stations,
        offsets=offsets,
        radii=radii,
        mean_positions=mean,
        cycles=count,
    )


def path_velocity(
    commanded: Trace,
    runs: Sequence[Trace],
    speed: float,
    *,
    sections: int = SECTIONS,
    part: tuple[float, float] = STEADY,
    few: bool = False,
) -> PathVelocity:
    """Return AV, RV and FV along a path.

    A speed is the length of a stretch of the commanded path over the time between the planes at its ends, so that
    noise across the path adds nothing to it.

    Args:
        commanded: the points of the path, from start to end.
        runs: what was measured, with times.
        speed: the commanded one [m/s].
        sections: pieces of the path, all of one length, over each of which a speed is taken.
        part: of the path on which the speed should be steady.
        few: take fewer than 10 cycles.

    Raises:
        KindError: the speed is not a number.
        ShapeError: path and runs have different numbers of columns.
        InvalidValueError: there are too few cycles, the speed is not above 0, a run misses a plane or has no times.

    Source:
        ISO 9283:1998, 8.6.
    """
    count = _check_runs("velocity", commanded, runs, few=few)
    speed = positive(speed, "velocity: the commanded speed", "m/s")
    start, end = part
    if not (0 <= start < end <= 1 and sections >= 1):
        raise InvalidValueError(f"velocity: expected a part within 0 to 1 and a stretch at least, got {part}")
    legs = legs_of(commanded)
    edges = legs.stations[-1] * np.linspace(start, end, sections + 1)
    for run in runs:
        run.timed("velocity")
    _, passed = passages(legs, edges, runs, what="velocity")
    durations = np.diff([run.times for run in passed], axis=1)
    if not (durations > 0).all():
        wrong = int(np.argwhere(durations <= 0)[0, 0]) + 1
        raise InvalidValueError(f"velocity: run {wrong} moves backwards along the path; use fewer, longer sections")
    V = np.diff(edges) / durations
    return PathVelocity(
        accuracy=float(V.mean() / speed - 1),
        repeatability=float(3 * V.mean(axis=1).std(ddof=1) / speed),
        fluctuation=float(np.ptp(V, axis=1).max()),
        stations=(edges[:-1] + edges[1:]) / 2,
        speeds=V,
        cycles=count,
    )


def _check_runs(kind: Kind, commanded: Trace, runs: Sequence[Trace], *, few: bool) -> int:
    count = check_cycles(kind, [len(runs)], few=few, least=2)
    refuse_mixed_dimensions([commanded.positions, *(run.positions for run in runs)], kind)
    columns = sorted({0 if trace.angles is None else trace.angles.shape[1] for trace in (commanded, *runs)})
    if len(columns) > 1 and kind != "velocity":
        raise ShapeError(f"{kind}: path and runs need the same angles, got {' and '.join(map(str, columns))} of them")
    return count


def _exclude_corners(legs: Legs, stations: Array, corners: float) -> Array:
    """Return the stations that are not near a corner.

    Raises:
        InvalidValueError: all are.
    """
    corners = number(corners, "corners")
    sharp = legs.stations[legs.corners]
    near = np.abs(stations[:, None] - sharp[None, :]).min(axis=1, initial=np.inf) < corners
    if near.all():
        raise InvalidValueError(f"the whole path is within {corners * 1e3:g} mm of a corner")
    return np.asarray(stations[~near])
