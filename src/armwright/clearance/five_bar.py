"""The five-bar without clearance in closed form: the angles of its links for a position of its tip.

Two motors drive two cranks; a rod is attached to each, and a pin, the tip, joins the rods. As in the thesis the links
are numbered from left to right, crank 1, rod 2, rod 3, crank 4; their angles are measured from the downward vertical,
counter-clockwise positive: a link points along u = (sin θ, -cos θ).

Source:
    Thesis eq. (3.8)-(3.12), with the corrections of docs/errata.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, of_shape, positive
from armwright.clearance.five_bar_parts import five_bar_links
from armwright.clearance.linkage import Linkage
from armwright.clearance.placement import Vec2
from armwright.errors import InvalidValueError, one_of
from armwright.tracing.scalar import Scalar, atan2, sqrt

# The sides of the elbows, with the tip below the motors: both outside, as in the thesis, or both inside, or both to one
# side. It never changes while no arm is stretched or folded.
Mode: TypeAlias = Literal["out", "left", "right", "in"]

# Signs of sin(θ2 - θ1) and sin(θ3 - θ4).
MODES: Mapping[Mode, tuple[float, float]] = {"out": (1, -1), "left": (1, 1), "right": (-1, -1), "in": (-1, 1)}
SIDES = ("left", "right")
# A position so little out of reach is in reach but for rounding [m].
_ROUNDING = 1e-12


def _lengths(value: ArrayLike) -> Array:
    lengths = exact_shape(value, (2,), "lengths", LARGEST)
    for length in lengths:
        positive(length, "length of a link")
    return lengths


def _motors(value: ArrayLike) -> Array:
    return exact_shape(value, (2, 2), "motors", LARGEST)


@attrs.frozen(kw_only=True, eq=False)
class FiveBar:
    """A five-bar without clearance.

    Attributes:
        motors: (2, 2) positions of the left and the right motor [m].
        cranks: (2,) lengths of links 1 and 4 [m].
        rods: (2,) lengths of links 2 and 3 [m].
    """

    motors: Array = attrs.field(converter=_motors)
    cranks: Array = attrs.field(converter=_lengths)
    rods: Array = attrs.field(converter=_lengths)

    @classmethod
    def of(cls, linkage: Linkage) -> FiveBar:
        """Return the five-bar that a linkage is without its clearances.

        Args:
            linkage: four bodies and the ground in one loop of pins, with or without clearance; the motors drive the
                two bodies on the ground, and the tip is the pin that joins the other two.

        Raises:
            InvalidValueError: it is no five-bar; the text says why.
        """
        motors, links = five_bar_links(linkage)
        lengths = [link.length for link in links]
        return cls(motors=motors, cranks=[lengths[0], lengths[3]], rods=lengths[1:3])

    @property
    def half_width(self) -> float:
        """Half the distance of the motors [m]."""
        return float(np.linalg.norm(self.motors[1] - self.motors[0])) / 2

    @property
    def reaches(self) -> Array:
        """(2, 2) the smallest and the largest distance of the tip from its motor, for the left and right arm [m]."""
        return np.stack([np.abs(self.cranks - self.rods), self.cranks + self.rods], axis=-1)


# ---- over abstract scalars -----------------------------------------------------------------------------------------


class ArmAngles(NamedTuple):
    """Angles of one arm [rad]."""

    crank: Scalar
    rod: Scalar


def arm_angles(reach: Vec2, crank: Scalar, rod: Scalar, sign: Scalar) -> ArmAngles:
    """Return the angles of an arm of two links that reaches from its motor to a point.

    Args:
        reach: from the motor to the point [m].
        crank: length [m].
        rod: length [m].
        sign: of sin(rod - crank), 1 or -1: the side of the elbow.
    """
    square = reach.dot(reach)
    along = 0.5 * ((crank * crank - rod * rod) / square + 1.0)
    across = -sign * sqrt(crank * crank / square - along * along)
    elbow = reach.times(along).plus(reach.perpendicular().times(across))
    rod_vector = reach.minus(elbow)
    return ArmAngles(atan2(elbow.x, -elbow.y), atan2(rod_vector.x, -rod_vector.y))


# ---- for batches ---------------------------------------------------------------------------------------------------


def inverse(bar: FiveBar, tip: ArrayLike, mode: Mode = "out") -> Array:
    """Return the angles of the links for positions of the tip.

    Args:
        bar: the five-bar.
        tip: (..., 2) positions of its tip [m].
        mode: sides of its elbows.

    Returns:
        (..., 4) angles θ1 to θ4 from the downward vertical [rad], in (-π, π].

    Raises:
        InvalidValueError: a position is out of reach; the text names the distance and the arm.
        UnknownNameError: there is no such mode.

    Source:
        Thesis eq. (3.8).
    """
    signs = MODES[one_of("assembly mode", mode, MODES)]  # type: ignore[index]
    points = of_shape(tip, (2,), "tip", LARGEST)
    _check_reach(bar, points)
    return _stack_angles(
        [
            arm_angles(_vector(points - motor), float(crank), float(rod), sign)
            for motor, crank, rod, sign in zip(bar.motors, bar.cranks, bar.rods, signs, strict=True)
        ]
    )


def inverse_all(bar: FiveBar, tip: ArrayLike) -> dict[Mode, Array]:
    """Return the angles for positions of the tip in all four modes; arguments and errors as of ``inverse``."""
    return {mode: inverse(bar, tip, mode) for mode in MODES}


def elbow_positions(bar: FiveBar, cranks: ArrayLike) -> Array:
    """Return (..., 2, 2) positions of the left and the right elbow [m] for angles (..., 2) of the cranks [rad]."""
    theta = of_shape(cranks, (2,), "cranks", LARGEST)
    directions = np.stack([np.sin(theta), -np.cos(theta)], axis=-1)
    return np.asarray(bar.motors + bar.cranks[:, None] * directions, dtype=np.float64)


# ---- inside --------------------------------------------------------------------------------------------------------


def _vector(points: Array) -> Vec2:
    """Return (..., 2) numbers as a vector of arrays, without axes for a single point."""
    return Vec2(np.asarray(points[..., 0]), np.asarray(points[..., 1]))


def _stack_angles(arms: list[ArmAngles]) -> Array:
    """Return (..., 4) the angles or rates of the links of the left and the right arm."""
    left, right = arms
    parts = np.broadcast_arrays(left.crank, left.rod, right.rod, right.crank)
    return np.stack(parts, axis=-1).astype(np.float64)


def _check_reach(bar: FiveBar, points: Array) -> None:
    """Refuse points that an arm does not reach.

    Raises:
        InvalidValueError: there is one; the text names the point, the distance and the arm.
    """
    distances = np.linalg.norm(points[..., None, :] - bar.motors, axis=-1)
    near, far = bar.reaches.T
    out = np.maximum(distances - far, near - distances)
    if np.any(out > _ROUNDING):
        row = np.unravel_index(int(out.max(axis=-1).argmax()), out.shape[:-1])
        words = [
            f"{out[row][i] * 1e3:.4g} mm too {'far from' if distances[row][i] > far[i] else 'near to'} "
            f"the {SIDES[i]} motor, whose arm reaches {near[i] * 1e3:g} to {far[i] * 1e3:g} mm"
            for i in range(2)
            if out[row][i] > _ROUNDING
        ]
        raise InvalidValueError(f"{_point_text(points, row)} is out of reach: {'; and '.join(words)}")
    if np.any(distances < _ROUNDING):
        row = tuple(np.argwhere(distances.min(axis=-1) < _ROUNDING)[0])
        side = SIDES[int(distances[row].argmin())]
        raise InvalidValueError(f"{_point_text(points, row)} is on the {side} motor: its folded arm may have any angle")


def _point_text(points: Array, row: tuple[Any, ...]) -> str:
    x, y = points[row] * 1e3
    return f"tip{_index_text(row)}: ({x:g}, {y:g}) mm"


def _index_text(row: tuple[Any, ...]) -> str:
    return f" {', '.join(str(int(i)) for i in row)}" if row else ""
