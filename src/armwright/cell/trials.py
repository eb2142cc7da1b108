"""What is drawn for each trial of a cell with physics, and what a trial must reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeAlias

import attrs

from armwright.cell.scene import Spread

# Ends of an interval that is drawn from evenly.
Interval: TypeAlias = tuple[float, float]


@attrs.frozen(kw_only=True)
class Goal:
    """Where a part is to stand at the end.

    Attributes:
        at: the frame or marker of the cell, z out of the surface, on whose origin the part stands upright.
        distance: how far from there it may be [m].
        angle: how far it may be rotated from there, or from an equal orientation of its symmetry [rad].
    """

    at: str
    distance: float = 2e-3
    angle: float = math.radians(3.0)


@attrs.frozen(kw_only=True)
class Noise:
    """What the noise of sensors is drawn from; None for that of the cell.

    Attributes:
        pixels: standard deviation of pixels, of 255.
        force: standard deviation of forces [N].
        effort: standard deviation of efforts, by the largest effort of each joint.
    """

    pixels: Interval | None = None
    force: Interval | None = None
    effort: Interval | None = None


@attrs.frozen(kw_only=True)
class Trials:
    """What each trial draws, and what it must reach.

    Attributes:
        friction: coefficient of every part; None for that of the cell.
        mass: by how much of its mass a part may be lighter or heavier, as a ratio.
        poses: by name, how far parts, frames and markers of the scene may be from their places, instead of their own
            spread.
        goals: by part.
        noise: of sensors.
    """

    friction: Interval | None = None
    mass: float = 0.0
    poses: Mapping[str, Spread] = attrs.field(factory=dict)
    goals: Mapping[str, Goal] = attrs.field(factory=dict)
    noise: Noise = attrs.field(factory=Noise)
