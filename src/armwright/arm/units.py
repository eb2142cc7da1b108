"""The units of a revolute and of a prismatic joint, in SI and as people read them."""

from __future__ import annotations

import math
from typing import NamedTuple


class JointUnits(NamedTuple):
    """The units of the quantities of a joint.

    Attributes:
        position: of its position.
        effort: of its effort and of its Coulomb friction.
        inertia: of the inertia of its drive.
        viscous: of its friction per speed.
        stiffness: of its spring.
        display: of a position as people read it.
        scale: the position that one ``display`` unit is [rad] or [m].
    """

    position: str
    effort: str
    inertia: str
    viscous: str
    stiffness: str
    display: str
    scale: float


REVOLUTE = JointUnits("rad", "N m", "kg m²", "N m s", "N m/rad", "deg", math.pi / 180)
PRISMATIC = JointUnits("m", "N", "kg", "N s/m", "N/m", "mm", 1e-3)
