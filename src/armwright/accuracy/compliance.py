"""Static compliance: how far a pose is displaced by a force."""

import attrs
import numpy as np

from armwright.accuracy.cycles import LOADS, check_cycles, check_parts
from armwright.accuracy.trace import as_position, as_positions, frozen_array
from armwright.arrays import LARGEST, Array, ArrayLike, floats, reduce_by_fields
from armwright.errors import InvalidValueError, ShapeError


@attrs.frozen(kw_only=True, eq=False)
class StaticCompliance:
    """How far a pose is displaced by a force in one direction.

    Attributes:
        along: in the direction of the force [m/N].
        direction: (2,) or (3,) unit vector of the force.
        components: (2,) or (3,) along every axis [m/N].
        loads: (l,) forces, without 0 [N].
        deflections: (l, 2) or (l, 3) mean displacements under each [m].
        cycles: repetitions of the load that was repeated least.
    """

    along: float
    direction: Array = attrs.field(converter=frozen_array)
    components: Array = attrs.field(converter=frozen_array)
    loads: Array = attrs.field(converter=frozen_array)
    deflections: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def static_compliance(
    loads: ArrayLike, positions: ArrayLike, direction: ArrayLike, *, few: bool = False
) -> StaticCompliance:
    """Return the displacement per force, by a straight line of least squares through the unloaded position.

    Args:
        loads: (n,) size of the force at each measurement [N], 0 among them.
        positions: (n, 2) or (n, 3) measured positions [m].
        direction: (2,) or (3,) of the force; its length does not matter.
        few: take fewer than 3 repetitions of each load, or fewer than 10 loads.

    Raises:
        KindError: an argument is not real numbers.
        ShapeError: the shapes are inconsistent.
        InvalidValueError: no measurement is without load, a load is negative, or there are too few.

    Source:
        ISO 9283:1998, 10.
    """
    P = as_positions(positions)
    F = floats(loads, "compliance: loads", LARGEST)
    if F.shape != (len(P),):
        raise ShapeError(f"compliance: loads: expected shape ({len(P)},), one per position, got {F.shape}")
    if (F < 0).any():
        raise InvalidValueError("compliance: loads are magnitudes of forces, 0 or more; reverse the direction instead")
    d = np.array(as_position(direction, P.shape[1], "compliance: direction"))
    if not np.linalg.norm(d) > 0:
        raise InvalidValueError("compliance: the direction is 0")
    d /= np.linalg.norm(d)
    levels, repeats = np.unique(F, return_counts=True)
    if levels[0] != 0:
        raise InvalidValueError("compliance: expected a measurement without load as the reference, got none")
    check_parts("compliance", len(levels) - 1, LOADS, few=few, what="loads besides none")
    count = check_cycles("compliance", repeats.tolist(), few=few, least=1)
    unloaded = P[F == 0].mean(axis=0)
    forces = levels[1:]
    mean_deflections = np.array([P[force == F].mean(axis=0) - unloaded for force in forces])
    slopes = forces @ mean_deflections / (forces @ forces)
    return StaticCompliance(
        along=float(slopes @ d),
        direction=d,
        components=slopes,
        loads=forces,
        deflections=mean_deflections,
        cycles=count,
    )
