"""What acts at a joint beside its link: the drive with its friction, and a spring."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import attrs

from armwright.arrays import LARGEST, LARGEST_ANGLE, number
from armwright.errors import InvalidValueError

# Least and largest stiffness of a gear that is not rigid [N m/rad] or [N/m].
STIFFNESS = (1e-3, 1e12)
# What the numbers of a part must be, in words.
_RANGES: dict[str, Callable[[float], bool]] = {
    "finite": math.isfinite,
    "above 0": lambda x: x > 0,
    "0 or more": lambda x: 0 <= x < math.inf,
}


def check_numbers(part: Any, what: str, names: Iterable[str], must: str = "", largest: float = LARGEST) -> None:
    """Make floats of fields that must be numbers while their part is being built.

    Args:
        part: of an arm.
        what: it is called in messages.
        names: of its fields.
        must: ``finite``, ``above 0`` or ``0 or more``; any number when left out.
        largest: magnitude of a finite number.

    Raises:
        KindError: a field is no number.
        InvalidValueError: it is another number than it must be.
    """
    for name in names:
        value = number(getattr(part, name), f"{what}: {name}")
        if largest < abs(value) < math.inf:
            raise InvalidValueError(f"{what}: {name} must not be larger than {largest:g}, got {value:g}")
        if must and not _RANGES[must](value):
            raise InvalidValueError(f"{what}: {name} must be {must}, got {value:g}")
        object.__setattr__(part, name, value)


@attrs.frozen(kw_only=True)
class Motor:
    """The drive of a joint, as felt at the joint; of an arm with a ``Coupling``, at the drive behind its gear.

    At the velocity v its friction takes, with the sign of v,

        viscous v + Coulomb friction + stribeck exp(-(v / stribeck_speed)²) + cube_root |v|^(1/3)

    and ``offset`` whatever the sign. Below 0.1 mrad/s or mm/s the cube root is replaced by a line, so that its slope is
    finite. At rest friction holds against up to ``stribeck`` more than Coulomb friction.

    Attributes:
        inertia: of the rotor and gear at the load side [kg m²], or [kg] for a prismatic joint.
        viscous: friction per speed [N m s] or [N s/m].
        coulomb_forward: magnitude of Coulomb friction while the joint moves in the direction of q [N m] or [N].
        coulomb_backward: the same, against the direction of q.
        offset: constant effort that the drive needs beside, in the direction of q, at rest too [N m] or [N].
        stribeck: what friction has more when a joint breaks away, and loses as it gets faster [N m] or [N].
        stribeck_speed: speed at which 1/e of that is left [rad/s] or [m/s].
        cube_root: friction that grows with the cube root of the speed, at 1 rad/s or 1 m/s [N m] or [N].
        gear_ratio: turns of the motor per turn of the joint; for information, ``inertia`` has it already.
        stiffness: of the gear between motor and link [N m/rad] or [N/m]; infinite for a rigid one. Only vibration and
            flexible joints know it: everything else moves the link as the motor moves.
        damping: of the gear beside it, by the difference of the velocities at its ends [N m s/rad] or [N s/m].

    Source:
        Armstrong-Hélouvry, Dupont & Canudas de Wit (1994), section 2, for Stribeck's curve.
    """

    inertia: float = 0.0
    viscous: float = 0.0
    coulomb_forward: float = 0.0
    coulomb_backward: float = 0.0
    offset: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 0.0
    cube_root: float = 0.0
    gear_ratio: float = 1.0
    stiffness: float = math.inf
    damping: float = 0.0

    def __attrs_post_init__(self) -> None:
        """Refuse drives that give energy for nothing."""
        magnitudes = ("inertia", "viscous", "coulomb_forward", "coulomb_backward", "stribeck", "cube_root")
        check_numbers(self, "motor", (*magnitudes, "stribeck_speed", "damping"), "0 or more")
        check_numbers(self, "motor", ("stiffness",), "above 0", STIFFNESS[1])
        if self.stiffness < STIFFNESS[0]:
            raise InvalidValueError(f"motor: stiffness must be {STIFFNESS[0]:g} or more, got {self.stiffness:g}")
        check_numbers(self, "motor", ("offset",), "finite")
        check_numbers(self, "motor", ("gear_ratio",))
        if self.stribeck and not self.stribeck_speed:
            raise InvalidValueError(
                f"motor: stribeck of {self.stribeck:g} needs a stribeck_speed above 0, at which 1/e of it is left"
            )

    @property
    def break_away(self) -> tuple[float, float]:
        """The least and the largest effort of a drive that leave a free joint at rest [N m] or [N]."""
        backward, forward = self.coulomb_backward + self.stribeck, self.coulomb_forward + self.stribeck
        return self.offset - backward, self.offset + forward


@attrs.frozen(kw_only=True)
class Spring:
    """A spring at a joint, which takes the effort stiffness (q - rest).

    Attributes:
        stiffness: [N m/rad] or [N/m].
        rest: position of the joint at which it takes nothing [rad] or [m].
    """

    stiffness: float = 0.0
    rest: float = 0.0

    def __attrs_post_init__(self) -> None:
        """Refuse springs that push away."""
        check_numbers(self, "spring", ("stiffness",), "0 or more")
        check_numbers(self, "spring", ("rest",), "finite", LARGEST_ANGLE)
