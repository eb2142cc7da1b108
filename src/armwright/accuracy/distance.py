"""Accuracy and repeatability of the distance between two poses: AD and RD."""

import attrs
import numpy as np

from armwright.accuracy.cycles import checked_cycles
from armwright.accuracy.measured import frozen_array, place_of, places_of
from armwright.arrays import Array, ArrayLike, by_fields
from armwright.errors import ShapeError


@attrs.frozen(kw_only=True, eq=False)
class DistanceAccuracy:
    """How far the mean attained distance is from the commanded one.

    Attributes:
        distance: AD, mean attained less commanded distance [m]; negative where attained poses are too near.
        components: (2,) or (3,) AD_x, AD_y, AD_z, the same of the distances along each axis [m].
        commanded: the commanded distance [m].
        cycles: n.
    """

    distance: float
    components: Array = attrs.field(converter=frozen_array)
    commanded: float
    cycles: int

    __reduce__ = by_fields


@attrs.frozen(kw_only=True, eq=False)
class DistanceRepeatability:
    """How closely attained distances agree.

    Attributes:
        distance: RD, three standard deviations, to be read as plus or minus [m].
        components: (2,) or (3,) RD_x, RD_y, RD_z, the same along each axis [m].
        cycles: n.
    """

    distance: float
    components: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = by_fields


def distance_accuracy(
    first: ArrayLike, second: ArrayLike, commanded_first: ArrayLike, commanded_second: ArrayLike, *, few: bool = False
) -> DistanceAccuracy:
    """Return AD between two poses.

    Args:
        first: (n, 2) or (n, 3) attained places of the first pose, one per cycle [m].
        second: likewise of the second, of the same cycles [m].
        commanded_first: (2,) or (3,) [m].
        commanded_second: (2,) or (3,) [m].
        few: take fewer than 30 cycles.

    Raises:
        KindError: something is no real number.
        ShapeError: the shapes do not belong together.
        InvalidValueError: there are too few cycles, or a number is not finite.

    Source:
        ISO 9283:1998, 7.3.2.
    """
    ways = _ways(first, second)
    count = checked_cycles("distance", [len(ways)], few=few, least=1)
    start, end = (place_of(one, ways.shape[1]) for one in (commanded_first, commanded_second))
    asked = float(np.linalg.norm(end - start))
    return DistanceAccuracy(
        distance=float(np.linalg.norm(ways, axis=1).mean()) - asked,
        components=np.abs(ways).mean(axis=0) - np.abs(end - start),
        commanded=asked,
        cycles=count,
    )


def distance_repeatability(first: ArrayLike, second: ArrayLike, *, few: bool = False) -> DistanceRepeatability:
    """Return RD between two poses.

    Args:
        first: (n, 2) or (n, 3) attained places of the first pose, one per cycle [m].
        second: likewise of the second, of the same cycles [m].
        few: take fewer than 30 cycles.

    Raises:
        KindError: something is no real number.
        ShapeError: the shapes do not belong together.
        InvalidValueError: there are too few cycles, or a number is not finite.

    Source:
        ISO 9283:1998, 7.3.3.
    """
    ways = _ways(first, second)
    count = checked_cycles("distance", [len(ways)], few=few, least=2)
    return DistanceRepeatability(
        distance=3 * float(np.linalg.norm(ways, axis=1).std(ddof=1)),
        components=3 * np.abs(ways).std(axis=0, ddof=1),
        cycles=count,
    )


def _ways(first: ArrayLike, second: ArrayLike) -> Array:
    P, Q = places_of(first, "first pose"), places_of(second, "second pose")
    if P.shape != Q.shape:
        raise ShapeError(f"distance: the two poses need the same cycles, got shapes {P.shape} and {Q.shape}")
    return np.asarray(Q - P)
