"""What a joint, or a drive, may do."""

from __future__ import annotations

import math

import attrs

from armwright.arm.drive import check_numbers
from armwright.arrays import Array, read_only, reduce_by_fields
from armwright.errors import InvalidValueError


@attrs.frozen(kw_only=True)
class Limits:
    """What a joint may do. Positions [rad] or [m]; the others are magnitudes; infinite where nothing is known.

    Attributes:
        lower: smallest position.
        upper: largest position.
        speed: largest speed [rad/s] or [m/s].
        acceleration: largest acceleration [rad/s²] or [m/s²].
        effort: largest torque [N m] or force [N], at the joint.
    """

    lower: float = -math.inf
    upper: float = math.inf
    speed: float = math.inf
    acceleration: float = math.inf
    effort: float = math.inf

    def __attrs_post_init__(self) -> None:
        """Refuse limits that nothing can satisfy."""
        check_numbers(self, "limits", ("lower", "upper"))
        check_numbers(self, "limits", ("speed", "acceleration", "effort"), "above 0")
        if not self.lower < self.upper:
            raise InvalidValueError(f"limits: lower {self.lower:g} must be below upper {self.upper:g}")


@attrs.frozen(kw_only=True, eq=False)
class JointLimits:
    """The ``Limits`` of n joints, one array of each.

    Attributes:
        lower: (n,) smallest positions [rad] or [m].
        upper: (n,) largest positions.
        speed: (n,) largest speeds [rad/s] or [m/s].
        acceleration: (n,) largest accelerations [rad/s²] or [m/s²].
        effort: (n,) largest torques [N m] or forces [N], at the joints.
    """

    lower: Array = attrs.field(converter=read_only)
    upper: Array = attrs.field(converter=read_only)
    speed: Array = attrs.field(converter=read_only)
    acceleration: Array = attrs.field(converter=read_only)
    effort: Array = attrs.field(converter=read_only)

    __reduce__ = reduce_by_fields
