"""How far the tool may leave its path: in position and in orientation."""

from __future__ import annotations

import math
from typing import NamedTuple

from armwright.arrays import number
from armwright.errors import InvalidValueError

# No bound closer than this can be certified: rounding and the solution of poses take up what is left [m], [rad].
CLOSEST = 1e-9
# Where the position may deviate by a millimetre the orientation may deviate by 5 mrad [rad/m].
ROTATION_PER_METRE = 5.0


class Tolerance(NamedTuple):
    """How far the tool may be from its path: its position [m], and its orientation [rad]."""

    position: float
    orientation: float


def tolerance(deviation: float, orientation: float | None = None) -> Tolerance:
    """Return the tolerance for an allowed path deviation [m]; of the orientation 5 mrad for each mm when left out.

    Raises:
        KindError: an argument is no number.
        InvalidValueError: it is closer than can be certified.
    """
    if not CLOSEST <= number(deviation, "deviation") < math.inf:
        raise InvalidValueError(
            f"deviation: expected {CLOSEST:g} m or more, the closest that can be certified, got {deviation:g}"
        )
    if orientation is None:
        return Tolerance(deviation, ROTATION_PER_METRE * deviation)
    if not number(orientation, "rotation") >= CLOSEST:
        raise InvalidValueError(
            f"rotation: expected {CLOSEST:g} rad or more, the closest that can be certified, got {orientation:g}"
        )
    return Tolerance(deviation, orientation)
