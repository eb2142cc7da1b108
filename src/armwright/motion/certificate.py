"""What a planned path is certified to keep: its deviation, and the limits of the joints."""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, number
from armwright.errors import InvalidValueError
from armwright.notebook import html_lines

LimitName: TypeAlias = Literal["speed", "acceleration", "effort"]
# No bound closer than this can be certified: rounding and the solution of poses take up what is left [m].
CLOSEST = 1e-9
LIMITS: tuple[LimitName, ...] = ("speed", "acceleration", "effort")


@attrs.frozen(kw_only=True, eq=False)
class Certificate:
    """What holds of a motion along a path.

    Attributes:
        arm: the arm.
        deviation_asked: bound of the distance of the hand from the path [m].
        deviation: upper bound of what that distance is, between samples as well [m].
        deviation_seen: the largest distance that was seen [m].
        turn_asked: bound of the angle from the orientation that belongs to the progress on the path, and on a straight
            line to the position of the hand on it as well [rad].
        turn: upper bound of what that angle is [rad].
        turn_seen: the largest angle that was seen [rad].
        backward: upper bound of how far the hand runs backwards along a straight line [m]; None for other paths.
        worst_time: when the largest distance was seen [s].
        worst_place: (3,) where the hand was then, seen from the base [m].
        knots: number of poses that were solved.
        looks: how often the hand was looked at in between.
        peaks: of each limit the largest value of every joint, (n,): speeds and accelerations exactly, efforts at the
            looks.
        factor: how many times slower the motion is than the speed of the tool has it, 1 for not at all.
        because: which limit, and which joint, from 0, that is for; None where nothing had to give way.
    """

    arm: Arm
    deviation_asked: float
    deviation: float
    deviation_seen: float
    turn_asked: float
    turn: float
    turn_seen: float
    worst_time: float
    worst_place: Array
    knots: int
    looks: int
    peaks: dict[LimitName, Array]
    factor: float
    because: tuple[LimitName, int] | None
    backward: float | None = None

    @property
    def holds(self) -> bool:
        """Whether the path is kept within what was asked, and all limits are."""
        return (
            self.deviation <= self.deviation_asked
            and self.turn <= self.turn_asked
            and (self.backward is None or self.backward <= self.deviation_asked)
            and all(self.use(name)[1] <= 1 + 1e-9 for name in LIMITS)
        )

    def use(self, name: LimitName) -> tuple[int, float]:
        """Return the joint, from 0, that comes nearest to a limit, and which part of the limit it uses."""
        parts = self.peaks[name] / self.arm.limit(name)
        joint = int(parts.argmax())
        return joint, float(parts[joint])

    def __str__(self) -> str:
        """Say it in a few lines."""
        x, y, z = self.worst_place * 1e3
        verdict = "holds" if self.holds else "DOES NOT HOLD"
        within = (
            f"{verdict}: hand within {self.deviation * 1e3:.4f} mm of the path (asked "
            f"{self.deviation_asked * 1e3:g} mm), within {self.turn * 1e3:.3f} mrad of its orientation (asked "
            f"{self.turn_asked * 1e3:g} mrad)"
        )
        seen = (
            f"largest distance seen {self.deviation_seen * 1e3:.4f} mm, at {self.worst_time:.3f} s, "
            f"({x:.1f}, {y:.1f}, {z:.1f}) mm from the base; {self.knots} knots, {self.looks} looks"
        )
        lines = [within, seen]
        uses = [(name, *self.use(name)) for name in LIMITS if np.isfinite(self.arm.limit(name)).any()]
        if uses:
            lines.append("; ".join(f"{self.arm.called(j)} uses {part:.0%} of its {name}" for name, j, part in uses))
        if self.because is not None:
            lines.append(slower(self.arm, self.factor, self.because, " than the tool speed has it"))
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Show what is kept, and how closely."""
        return html_lines(str(self))


def slower(arm: Arm, factor: float, because: tuple[LimitName, int], than: str = "") -> str:
    """Say how many times slower a motion is, and for which limit of which joint, from 0."""
    limit, joint = because
    return f"{factor:.2f} times slower{than}, for the {limit} of {arm.called(joint)}"


def checked_deviation(deviation: float) -> float:
    """Return an allowed distance of the hand from its path [m].

    Raises:
        InvalidValueError: it is none, or closer than can be certified.
    """
    if not CLOSEST <= number(deviation, "deviation") < math.inf:
        raise InvalidValueError(
            f"deviation: expected {CLOSEST:g} m or more, the closest that can be certified, got {deviation:g}"
        )
    return deviation


def slowing(arm: Arm, peaks: dict[LimitName, Array]) -> tuple[float, tuple[LimitName, int] | None]:
    """Return by which factor a motion must be slowed to keep speeds and accelerations, at least 1, and for what.

    Args:
        arm: the arm, with n joints.
        peaks: largest speeds and accelerations, (n,) each.
    """
    needs: dict[LimitName, Array] = {
        "speed": peaks["speed"] / arm.limit("speed"),
        "acceleration": np.sqrt(peaks["acceleration"] / arm.limit("acceleration")),
    }
    factor, because = 1.0, None
    for name, need in needs.items():
        if need.max() > factor * (1 + 1e-12):
            factor, because = float(need.max()), (name, int(need.argmax()))
    return factor, because
