"""What a planned path is certified to keep: its deviation, and the limits of the joints."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.limited import by_joint, limited_motion
from armwright.motion.trajectory import Trajectory
from armwright.notebook import html_lines
from armwright.spatial.poses import position_text

LimitName: TypeAlias = Literal["speed", "acceleration", "effort"]
# A limit and the joint, from 0, that is at it.
BindingLimit: TypeAlias = tuple[LimitName, int]
LIMITS: tuple[LimitName, ...] = ("speed", "acceleration", "effort")


@attrs.frozen(kw_only=True, eq=False)
class Certificate:
    """What holds of a motion along a path.

    Attributes:
        arm: the arm.
        deviation_tolerance: bound of the distance of the tool from the path [m].
        deviation: upper bound of that distance, between samples as well [m].
        deviation_sampled: the largest distance at the samples [m].
        rotation_tolerance: bound of the angle from the orientation that belongs to the progress on the path, and on a
            straight line to the position of the tool on it as well [rad].
        rotation: upper bound of that angle, between samples as well [rad].
        rotation_sampled: the largest angle at the samples [rad]; None where only the bound is known.
        backward: upper bound of how far the tool runs backwards along a straight line [m]; None for other paths.
        worst_time: when the largest distance was sampled [s].
        worst_position: (3,) where the tool was then, seen from the base [m].
        knots: number of poses that were solved.
        samples: how often the tool was sampled in between.
        peaks: of each limit the largest value of all that has limits, (n,) for most arms, see ``Arm.all_limits``:
            speeds and accelerations exactly, efforts at samples.
        factor: how many times slower the motion is than the speed of the tool has it, 1 for not at all.
        because: which limit, and which joint, from 0, that is for; None where no limit binds.
    """

    arm: Arm
    deviation_tolerance: float
    deviation: float
    deviation_sampled: float
    rotation_tolerance: float
    rotation: float
    rotation_sampled: float | None
    worst_time: float
    worst_position: Array
    knots: int
    samples: int
    peaks: dict[LimitName, Array]
    factor: float = 1.0
    because: BindingLimit | None = None
    backward: float | None = None

    def run_slower(self, factor: float, peaks: dict[LimitName, Array], because: BindingLimit | None) -> Certificate:
        """Return that of the same motion run ``factor`` times slower for a limit, with the peaks that it has then."""
        time, total = self.worst_time * factor, self.factor * factor
        return attrs.evolve(self, worst_time=time, peaks=peaks, factor=total, because=because)

    def retimed(self, stretch: float) -> Certificate:
        """Return that of the same motion, all of it run so many times slower; efforts are those of the faster one."""
        peaks = stretched_peaks(**self.peaks, stretch=stretch)
        return attrs.evolve(self, peaks=peaks, worst_time=self.worst_time * stretch)

    @property
    def summary(self) -> str:
        """What it says, in one line."""
        uses = "".join(
            f", {part:.0%} of the {name} of {self.arm.joint_label(joint)}" for name, joint, part in self._uses
        )
        return (
            f"certificate {self._verdict}: within {self.deviation * 1e3:.3f} of "
            f"{self.deviation_tolerance * 1e3:g} mm, {self.rotation * 1e3:.3f} of "
            f"{self.rotation_tolerance * 1e3:g} mrad{uses}"
        )

    @property
    def slowed(self) -> str:
        """How many times slower the motion is, and for which limit, in words; empty where no limit binds."""
        return "" if self.because is None else slower(self.arm, self.factor, self.because)

    @property
    def holds(self) -> bool:
        """Whether the path is kept within what was asked, and all limits are."""
        return (
            self.deviation <= self.deviation_tolerance
            and self.rotation <= self.rotation_tolerance
            and (self.backward is None or self.backward <= self.deviation_tolerance)
            and all(self.use(name)[1] <= 1 + 1e-9 for name in LIMITS)
        )

    @property
    def _verdict(self) -> str:
        return "holds" if self.holds else "DOES NOT HOLD"

    @property
    def _uses(self) -> list[tuple[LimitName, int, float]]:
        """Of each limit that some joint has: its name, the joint nearest to it, and which part of it that uses."""
        return [(name, *self.use(name)) for name in LIMITS if np.isfinite(getattr(self.arm.all_limits, name)).any()]

    def use(self, name: LimitName) -> tuple[int, float]:
        """Return the joint, from 0, that comes nearest to a limit, itself or its drive, and which part that uses."""
        parts = by_joint(self.arm, self.peaks[name] / getattr(self.arm.all_limits, name))
        joint = int(parts.argmax())
        return joint, float(parts[joint])

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units, as JSON can carry it."""
        derived = attrs.filters.exclude("arm", "peaks", "factor", "because", "backward")
        return {
            "holds": self.holds,
            **attrs.asdict(self, recurse=False, filter=derived),
            "worst_position": self.worst_position.tolist(),
            "of_limits": {name: {"joint": joint + 1, "part": part} for name, joint, part in self._uses},
            "slower": self.factor,
            "because": None if self.because is None else {"limit": self.because[0], "joint": self.because[1] + 1},
        }

    def __str__(self) -> str:
        """Say it in a few lines."""
        within = (
            f"{self._verdict}: tool within {self.deviation * 1e3:.4f} mm of the path (asked "
            f"{self.deviation_tolerance * 1e3:g} mm), within {self.rotation * 1e3:.3f} mrad of its orientation (asked "
            f"{self.rotation_tolerance * 1e3:g} mrad)"
        )
        sampled = (
            f"largest distance sampled {self.deviation_sampled * 1e3:.4f} mm, at {self.worst_time:.3f} s, "
            f"{position_text(self.worst_position)}; {self.knots} knots, {self.samples} samples"
        )
        lines = [within, sampled]
        if uses := [f"{self.arm.joint_label(joint)} uses {part:.0%} of its {name}" for name, joint, part in self._uses]:
            lines.append("; ".join(uses))
        if self.because is not None:
            lines.append(slower(self.arm, self.factor, self.because, " than the tool speed requires"))
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Show what is kept, and how closely."""
        return html_lines(str(self))


def stretched_peaks(speed: Array, acceleration: Array, effort: Array, stretch: float) -> dict[LimitName, Array]:
    """Return the peaks (n,) of a motion run so many times slower, whose efforts are given as they are then."""
    return {"speed": speed / stretch, "acceleration": acceleration / stretch**2, "effort": effort}


def slower(arm: Arm, factor: float, because: BindingLimit, than: str = "") -> str:
    """Say how many times slower a motion is, and for which limit of which joint, from 0."""
    limit, joint = because
    return f"{factor:.2f} times slower{than}, limited by the {limit} of {arm.joint_label(joint)}"


def slowing(arm: Arm, trajectory: Trajectory) -> tuple[float, BindingLimit | None]:
    """Return by which factor a motion must be slowed to keep speeds and accelerations, at least 1, and for what."""
    motion, limits = limited_motion(arm, trajectory), arm.all_limits
    needs: dict[LimitName, Array] = {
        "speed": by_joint(arm, motion.peaks(1) / limits.speed),
        "acceleration": by_joint(arm, np.sqrt(motion.peaks(2) / limits.acceleration)),
    }
    factor, because = 1.0, None
    for name, need in needs.items():
        if need.max() > factor * (1 + 1e-12):
            factor, because = float(need.max()), (name, int(need.argmax()))
    return factor, because
