"""Accuracy and repeatability of the distance between two poses: AD and RD."""

import attrs
import numpy as np

from armwright.accuracy.angles import mean_angles, wrap_to_pi
from armwright.accuracy.cycles import check_cycles
from armwright.accuracy.trace import as_angles, as_commanded_angles, as_position, as_positions, frozen_array
from armwright.arrays import Array, ArrayLike, reduce_by_fields
from armwright.errors import ShapeError


@attrs.frozen(kw_only=True, eq=False)
class DistanceAccuracy:
    """How far the mean attained distance is from the commanded one.

    Attributes:
        distance: AD, mean attained less commanded distance [m]; negative where attained poses are too near.
        components: (2,) or (3,) AD_x, AD_y, AD_z, the same of the distances along each axis [m].
        angles: (k,) AD_a, AD_b, AD_c, the same of the angles between the two poses [rad].
        commanded: the commanded distance [m].
        cycles: n.
    """

    distance: float
    components: Array = attrs.field(converter=frozen_array)
    angles: Array = attrs.field(converter=frozen_array)
    commanded: float
    cycles: int

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class DistanceRepeatability:
    """How closely attained distances agree.

    Attributes:
        distance: RD, three standard deviations, to be read as plus or minus [m].
        components: (2,) or (3,) RD_x, RD_y, RD_z, the same along each axis [m].
        angles: (k,) RD_a, RD_b, RD_c, the same of the angles between the two poses [rad].
        cycles: n.
    """

    distance: float
    components: Array = attrs.field(converter=frozen_array)
    angles: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def distance_accuracy(
    first: ArrayLike,
    second: ArrayLike,
    commanded_first: ArrayLike,
    commanded_second: ArrayLike,
    *,
    angles: tuple[ArrayLike, ArrayLike] | None = None,
    commanded_angles: tuple[ArrayLike | None, ArrayLike | None] | None = None,
    few: bool = False,
) -> DistanceAccuracy:
    """Return AD between two poses.

    Args:
        first: (n, 2) or (n, 3) attained positions of the first pose, one per cycle [m].
        second: likewise of the second, of the same cycles [m].
        commanded_first: (2,) or (3,) [m].
        commanded_second: (2,) or (3,) [m].
        angles: (n, k) attained angles about a, b, c of both poses [rad].
        commanded_angles: (k,) the commanded ones of both [rad].
        few: take fewer than 30 cycles.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are too few cycles, or a number is not finite.

    Source:
        ISO 9283:1998, 7.3.2.
    """
    differences = _position_differences(first, second)
    count = check_cycles("distance", [len(differences)], few=few, least=1)
    start, end = (as_position(pose, differences.shape[1]) for pose in (commanded_first, commanded_second))
    commanded = float(np.linalg.norm(end - start))
    A, B = _angles_of_both_poses(angles, len(differences))
    goals = [as_commanded_angles(goal, A.shape[1]) for goal in commanded_angles or (None, None)]
    rotation = wrap_to_pi(goals[1] - goals[0])
    return DistanceAccuracy(
        distance=float(np.linalg.norm(differences, axis=1).mean()) - commanded,
        components=np.abs(differences).mean(axis=0) - np.abs(end - start),
        angles=np.abs(_rotation_angles(A, B, rotation)).mean(axis=0) - np.abs(rotation),
        commanded=commanded,
        cycles=count,
    )


def distance_repeatability(
    first: ArrayLike, second: ArrayLike, *, angles: tuple[ArrayLike, ArrayLike] | None = None, few: bool = False
) -> DistanceRepeatability:
    """Return RD between two poses.

    Args:
        first: (n, 2) or (n, 3) attained positions of the first pose, one per cycle [m].
        second: likewise of the second, of the same cycles [m].
        angles: (n, k) attained angles about a, b, c of both poses [rad].
        few: take fewer than 30 cycles.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are too few cycles, or a number is not finite.

    Source:
        ISO 9283:1998, 7.3.3.
    """
    differences = _position_differences(first, second)
    count = check_cycles("distance", [len(differences)], few=few, least=2)
    A, B = _angles_of_both_poses(angles, len(differences))
    rotations = _rotation_angles(A, B, mean_angles(B - A, "angles between the two poses"))
    return DistanceRepeatability(
        distance=3 * float(np.linalg.norm(differences, axis=1).std(ddof=1)),
        components=3 * np.abs(differences).std(axis=0, ddof=1),
        angles=3 * np.abs(rotations).std(axis=0, ddof=1),
        cycles=count,
    )


def _position_differences(first: ArrayLike, second: ArrayLike) -> Array:
    P, Q = as_positions(first, "first pose"), as_positions(second, "second pose")
    if P.shape != Q.shape:
        raise ShapeError(f"distance: the two poses need the same cycles, got shapes {P.shape} and {Q.shape}")
    return np.asarray(Q - P)


def _angles_of_both_poses(angles: tuple[ArrayLike, ArrayLike] | None, rows: int) -> tuple[Array, Array]:
    """Return the angles (n, k) of both poses; none where none were measured."""
    first, second = (None, None) if angles is None else angles
    A, B = as_angles(first, rows, "angles of the first pose"), as_angles(second, rows, "angles of the second pose")
    if A.shape != B.shape:
        raise ShapeError(f"distance: both poses need the same angles, got shapes {A.shape} and {B.shape}")
    return A, B


def _rotation_angles(A: Array, B: Array, near: Array) -> Array:
    """Return the rotation angles from the first pose to the second (n, k), the equivalents nearest to (k,) [rad].

    So rotations of about 180 deg have one sign.
    """
    return np.asarray(near + wrap_to_pi(B - A - near))
