"""Accuracy and repeatability of one pose: AP and RP."""

import attrs
import numpy as np

from armwright.accuracy.angles import angle_deviations, mean_angles, three_sigma, wrap_to_pi
from armwright.accuracy.cycles import Kind, check_cycles
from armwright.accuracy.trace import as_angles, as_commanded_angles, as_position, as_positions, frozen_array
from armwright.arrays import Array, ArrayLike, reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class PoseAccuracy:
    """How far the mean of what was attained is from what was commanded.

    Attributes:
        position: AP_P, distance of the barycentre from the commanded position [m].
        components: (2,) or (3,) AP_x, AP_y, AP_z: barycentre less commanded position [m].
        angles: (k,) AP_a, AP_b, AP_c: mean less commanded angle [rad].
        barycentre: (2,) or (3,) mean of the attained positions [m].
        cycles: n.
    """

    position: float
    components: Array = attrs.field(converter=frozen_array)
    angles: Array = attrs.field(converter=frozen_array)
    barycentre: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True, eq=False)
class PoseRepeatability:
    """How closely attained poses lie together.

    Attributes:
        radius: RP_l = mean distance from the barycentre and three standard deviations of it [m].
        mean_distance: mean distance from the barycentre [m].
        deviation: S_l, standard deviation of the distances [m].
        angles: (k,) RP_a, RP_b, RP_c: three standard deviations, to be read as plus or minus [rad].
        barycentre: (2,) or (3,) [m].
        cycles: n.
    """

    radius: float
    mean_distance: float
    deviation: float
    angles: Array = attrs.field(converter=frozen_array)
    barycentre: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def pose_accuracy(
    positions: ArrayLike,
    commanded: ArrayLike,
    *,
    angles: ArrayLike | None = None,
    commanded_angles: ArrayLike | None = None,
    few: bool = False,
) -> PoseAccuracy:
    """Return AP of one pose.

    Args:
        positions: (n, 2) or (n, 3) attained positions, one per cycle [m].
        commanded: (2,) or (3,) the commanded position [m].
        angles: (n, k) attained angles about a, b, c [rad]; whole revolutions do not matter.
        commanded_angles: (k,) the commanded ones [rad].
        few: take fewer than 30 cycles.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are too few cycles, a number is not finite, or angles scatter by more than 90 deg.

    Source:
        ISO 9283:1998, 7.2.1.
    """
    P, A = _check_cloud(positions, angles)
    count = check_cycles("pose", [len(P)], few=few, least=1)
    goal = as_position(commanded, P.shape[1])
    barycentre = P.mean(axis=0)
    return PoseAccuracy(
        position=float(np.linalg.norm(barycentre - goal)),
        components=barycentre - goal,
        angles=angle_errors(A, commanded_angles),
        barycentre=barycentre,
        cycles=count,
    )


def pose_repeatability(
    positions: ArrayLike, *, angles: ArrayLike | None = None, few: bool = False
) -> PoseRepeatability:
    """Return RP of one pose.

    Args:
        positions: (n, 2) or (n, 3) attained positions, one per cycle [m].
        angles: (n, k) attained angles about a, b, c [rad]; whole revolutions do not matter.
        few: take fewer than 30 cycles.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: there are too few cycles, a number is not finite, or angles scatter by more than 90 deg.

    Source:
        ISO 9283:1998, 7.2.2: the radius is the mean distance *plus* three deviations.
    """
    P, A = _check_cloud(positions, angles)
    return repeatability("pose", P, A, few=few)


def repeatability(kind: Kind, P: Array, A: Array, *, few: bool) -> PoseRepeatability:
    """Return RP of a cloud (n, d) with angles (n, k), as part of a test of any kind."""
    count = check_cycles(kind, [len(P)], few=few, least=2)
    barycentre = P.mean(axis=0)
    distances = np.linalg.norm(P - barycentre, axis=1)
    deviation = float(distances.std(ddof=1))
    return PoseRepeatability(
        radius=float(distances.mean()) + 3 * deviation,
        mean_distance=float(distances.mean()),
        deviation=deviation,
        angles=three_sigma(angle_deviations(A)),
        barycentre=barycentre,
        cycles=count,
    )


def _check_cloud(positions: ArrayLike, angles: ArrayLike | None) -> tuple[Array, Array]:
    P = as_positions(positions)
    return P, as_angles(angles, len(P))


def angle_errors(A: Array, commanded: ArrayLike | None) -> Array:
    """Return the means of angles (n, k) less the commanded ones (k,), on the circle [rad]."""
    return wrap_to_pi(mean_angles(A) - as_commanded_angles(commanded, A.shape[1]))
