"""How a pose moves when something else changes: direction of approach (vAP), robot (E), time (dAP, dRP)."""

from collections.abc import Sequence
from itertools import combinations

import attrs
import numpy as np

from armwright.accuracy.angles import mean_angles, wrap_to_pi
from armwright.accuracy.cycles import DIRECTIONS, ROBOTS, Kind, check_cycles, check_parts
from armwright.accuracy.pose import angle_errors, repeatability
from armwright.accuracy.trace import as_angles, as_position, as_positions, frozen_array, refuse_mixed_dimensions
from armwright.arrays import LARGEST, Array, ArrayLike, floats, reduce_by_fields
from armwright.errors import InvalidValueError, ShapeError


@attrs.frozen(kw_only=True, eq=False)
class Variation:
    """How far apart the barycentres of several clouds are.

    Attributes:
        position: the largest distance between two of them [m].
        pair: which two, from 0.
        angles: (k,) the largest difference of mean angles about a, b, c [rad].
        barycentres: (h, 2) or (h, 3) [m].
        cycles: of the smallest cloud.
    """

    position: float
    pair: tuple[int, int]
    angles: Array = attrs.field(converter=frozen_array)
    barycentres: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class PoseDrift:
    """How accuracy and repeatability of a pose change while a robot warms up.

    Attributes:
        accuracy_change: dAP_P, between the first measurement and the last [m].
        repeatability_change: dRP, likewise [m].
        accuracy_change_angles: (k,) dAP_a, dAP_b, dAP_c, likewise [rad].
        repeatability_change_angles: (k,) dRP_a, dRP_b, dRP_c, likewise [rad].
        times: (m,) of the measurements [s].
        accuracy: (m,) AP_P at each [m].
        repeatability: (m,) RP_l at each [m].
        cycles: of the smallest measurement.
    """

    accuracy_change: float
    repeatability_change: float
    accuracy_change_angles: Array = attrs.field(converter=frozen_array)
    repeatability_change_angles: Array = attrs.field(converter=frozen_array)
    times: Array = attrs.field(converter=frozen_array)
    accuracy: Array = attrs.field(converter=frozen_array)
    repeatability: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def multidirectional_variation(
    positions: Sequence[ArrayLike], *, angles: Sequence[ArrayLike] | None = None, few: bool = False
) -> Variation:
    """Return vAP: how far apart a pose is attained when it is approached from different directions.

    Args:
        positions: (n, 2) or (n, 3) attained positions for each of 3 directions of approach [m].
        angles: (n, k) attained angles about a, b, c for each [rad].
        few: take fewer than 3 directions, or fewer than 30 cycles of each.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are too few directions or cycles, or a number is not finite.

    Source:
        ISO 9283:1998, 7.2.3.
    """
    check_parts("multidirectional", len(positions), DIRECTIONS, few=few, what="directions of approach")
    return _variation("multidirectional", positions, angles, few=few)


def exchangeability(
    positions: Sequence[ArrayLike], *, angles: Sequence[ArrayLike] | None = None, few: bool = False
) -> Variation:
    """Return E: how far apart robots of one type attain the same commanded pose.

    Args:
        positions: (n, 2) or (n, 3) attained positions of each of 5 robots, in the same base frame [m].
        angles: (n, k) attained angles about a, b, c of each [rad].
        few: take fewer than 5 robots, or fewer than 30 cycles of each.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are too few robots or cycles, or a number is not finite.

    Source:
        ISO 9283:1998, 7.7.
    """
    check_parts("exchangeability", len(positions), ROBOTS, few=few, what="robots")
    return _variation("exchangeability", positions, angles, few=few)


def pose_drift(
    times: ArrayLike,
    positions: Sequence[ArrayLike],
    commanded: ArrayLike,
    *,
    angles: Sequence[ArrayLike] | None = None,
    commanded_angles: ArrayLike | None = None,
    few: bool = False,
) -> PoseDrift:
    """Return dAP and dRP: how accuracy and repeatability change from cold to warm.

    Args:
        times: (m,) when each measurement was made, rising [s].
        positions: (n, 2) or (n, 3) attained positions of each measurement [m].
        commanded: (2,) or (3,) the commanded position [m].
        angles: (n, k) attained angles of each measurement [rad].
        commanded_angles: (k,) the commanded ones [rad].
        few: take fewer than 10 cycles per measurement.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are fewer than two measurements, too few cycles, or times that do not rise.

    Source:
        ISO 9283:1998, 7.6.
    """
    t = floats(times, "times", LARGEST)
    clouds = [as_positions(cloud) for cloud in positions]
    if t.shape != (len(clouds),):
        raise ShapeError(f"times: expected one per measurement, {len(clouds)}, got shape {t.shape}")
    if len(t) < 2 or not (np.diff(t) > 0).all():
        raise InvalidValueError("drift: expected at least two measurements, each later than the one before")
    refuse_mixed_dimensions(clouds, "drift")
    goal = as_position(commanded, clouds[0].shape[1])
    angle_clouds = _check_angle_clouds("drift", clouds, angles)
    results = [repeatability("drift", P, A, few=few) for P, A in zip(clouds, angle_clouds, strict=True)]
    accuracy = np.array([np.linalg.norm(result.barycentre - goal) for result in results])
    radius = np.array([result.radius for result in results])
    deviations = [angle_errors(A, commanded_angles) for A in (angle_clouds[0], angle_clouds[-1])]
    return PoseDrift(
        accuracy_change=float(abs(accuracy[-1] - accuracy[0])),
        repeatability_change=float(abs(radius[-1] - radius[0])),
        accuracy_change_angles=np.abs(wrap_to_pi(deviations[1] - deviations[0])),
        repeatability_change_angles=np.abs(results[-1].angles - results[0].angles),
        times=t,
        accuracy=accuracy,
        repeatability=radius,
        cycles=min(result.cycles for result in results),
    )


def _variation(
    kind: Kind, positions: Sequence[ArrayLike], angles: Sequence[ArrayLike] | None, *, few: bool
) -> Variation:
    clouds = [as_positions(cloud) for cloud in positions]
    angle_clouds = _check_angle_clouds(kind, clouds, angles)
    refuse_mixed_dimensions(clouds, kind)
    count = check_cycles(kind, [len(P) for P in clouds], few=few, least=1)
    centres = np.array([P.mean(axis=0) for P in clouds])
    means = np.array([mean_angles(A) for A in angle_clouds])
    pairs = list(combinations(range(len(clouds)), 2))
    distances = [float(np.linalg.norm(centres[h] - centres[k])) for h, k in pairs]
    most = int(np.argmax(distances))
    return Variation(
        position=distances[most],
        pair=pairs[most],
        angles=np.max([np.abs(wrap_to_pi(means[h] - means[k])) for h, k in pairs], axis=0),
        barycentres=centres,
        cycles=count,
    )


def _check_angle_clouds(kind: Kind, clouds: Sequence[Array], angles: Sequence[ArrayLike] | None) -> list[Array]:
    """Return the angles (n, k) of each cloud of positions; none where none were measured."""
    if angles is not None and len(angles) != len(clouds):
        raise ShapeError(f"{kind}: {len(clouds)} clouds of positions but {len(angles)} of angles")
    angle_clouds = [as_angles(None if angles is None else angles[h], len(P)) for h, P in enumerate(clouds)]
    refuse_mixed_dimensions(angle_clouds, f"{kind}, angles")
    return angle_clouds
