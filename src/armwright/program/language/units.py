"""Units of numbers: what a program counts in, and what a number with a unit is worth there."""

import math
from collections.abc import Mapping
from typing import Literal, TypeAlias

import attrs

Dimension: TypeAlias = Literal["length", "angle", "time", "force"]

# Each unit by its dimension, and what it is worth in m, rad, s or N.
UNITS: Mapping[str, tuple[Dimension, float]] = {
    "MM": ("length", 1e-3),
    "CM": ("length", 1e-2),
    "M": ("length", 1.0),
    "IN": ("length", 0.0254),
    "DEG": ("angle", math.pi / 180),
    "RAD": ("angle", 1.0),
    "S": ("time", 1.0),
    "MS": ("time", 1e-3),
    "N": ("force", 1.0),
}
# Those of lengths in words.
LENGTHS = {"MM": "millimetres", "CM": "centimetres", "M": "metres", "IN": "inches"}
# What a UNITS line may name: times are always seconds and forces newtons.
DECLARABLE = tuple(unit for unit, (dimension, _) in UNITS.items() if dimension in ("length", "angle"))
# Numbers beyond this are a slip, and squares of them would overflow.
MAX_NUMBER = 1e100
# Speeds of a MOVE, in per cent of the normal one.
NORMAL_SPEED = 100.0
LOWEST_SPEED, HIGHEST_SPEED = 1.0, 120.0
# Frames that the queue of an arm may hold.
MOST_FRAMES = 1000


@attrs.frozen(kw_only=True)
class UnitSystem:
    """What bare numbers of a program count.

    Attributes:
        length: unit of lengths, ``M`` unless a UNITS line says otherwise.
        angle: unit of angles.
    """

    length: str = "M"
    angle: str = "DEG"

    @property
    def metres(self) -> float:
        """The unit of length in [m]."""
        return UNITS[self.length][1]

    @property
    def radians(self) -> float:
        """The unit of angle in [rad]."""
        return UNITS[self.angle][1]


def dimension(unit: str) -> Dimension:
    """Return what a unit measures."""
    return UNITS[unit][0]


def convert(value: float, unit: str | None, system: UnitSystem) -> float:
    """Return what a number is worth in the units of the program: ``2cm`` is 20 after ``UNITS MM``."""
    if unit is None:
        return value
    kind, worth = UNITS[unit]
    own = {"length": system.length, "angle": system.angle}.get(kind)
    if own == unit or own is None:
        # Nothing to convert, so nothing to round.
        return value * (worth if own is None else 1.0)
    return value * worth / UNITS[own][1]
