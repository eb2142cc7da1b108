"""Shapers for the modes in which an arm vibrates on its flexible gears."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, integer
from armwright.dynamics.flexible_joints import modes
from armwright.errors import InvalidValueError
from armwright.motion.shaping import Shaper, ShaperKind, combined, shaper
from armwright.motion.trajectory import Trajectory

# Input shapers, and flat feedforward, which takes the model of the arm instead of its modes.
Smoothing: TypeAlias = Literal[ShaperKind, "flat"]
# Configurations at which frequencies are computed.
_MEAN = 101
# A mode that is damped more swings past its place by 0.15 % at most, in periods that grow without bound.
_SWINGS = 0.9
# A shaper, or flat feedforward, adds so much at most [s].
LONGEST = 60.0


@attrs.frozen(kw_only=True)
class ModeShaping:
    """How motions of an arm are shaped.

    Attributes:
        kind: ``zv``, ``zvd`` or ``ei``, see ``shaper``; ``flat``, see ``flat_motion``.
        count: how many modes shapers take, the slowest ones.
        tolerance: of ``ei``.
    """

    kind: Smoothing = "zvd"
    count: int = 2
    tolerance: float = 0.05


class ModeShaper(NamedTuple):
    """A shaper and the frequencies (k,) that it shapes, slowest first [Hz]."""

    shaper: Shaper
    frequencies: Array


@attrs.frozen(kw_only=True, eq=False)
class StageShaping:
    """What shaping has made of one stage of a move.

    Attributes:
        kind: how.
        frequencies: (k,) that are shaped [Hz]; none by flat feedforward.
        added: how much longer the stage takes [s]; 0 where its duration was asked for.
        deviation: distance of the tool from the path that it had before [m], on rigid gears: an upper bound on lines, 0
            where shapers keep the path of the joints, and by flat feedforward the largest seen at samples.
    """

    kind: Smoothing
    frequencies: Array
    added: float
    deviation: float

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        return {
            "shaper": self.kind,
            "frequencies_hz": self.frequencies.tolist(),
            "added": self.added,
            "path_deviation": self.deviation,
        }

    @property
    def summary(self) -> str:
        """What it is, in one line."""
        of = ", ".join(f"{f:.2f} Hz" for f in self.frequencies) or "no mode that swings"
        how = "flat feedforward" if self.kind == "flat" else f"{self.kind} for {of}"
        return f"{how}: {self.added:+.3f} s, path deviation {self.deviation * 1e3:.3f} mm"


def mode_shaper(arm: Arm, planned: Trajectory, kind: ShaperKind, *, count: int, tolerance: float) -> ModeShaper:
    """Return the shaper for the mean frequencies and damping of the slowest modes along a motion.

    Args:
        arm: with n joints, of which some have flexible gears.
        planned: the motion.
        kind: ``zv``, ``zvd`` or ``ei``, see ``shaper``.
        count: how many modes, the slowest ones.
        tolerance: of ``ei``.

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
        InvalidValueError: a number is out of its range, or the shaper takes longer than a minute.
    """
    found = modes(arm, planned(np.linspace(0, planned.duration, _MEAN)))
    frequencies, damping = found.frequencies.mean(axis=0), found.damping.mean(axis=0)
    slowest = np.flatnonzero(damping < _SWINGS)[: integer(count, "count", least=1)]
    pairs = zip(frequencies[slowest].tolist(), damping[slowest].tolist(), strict=True)
    by = combined([shaper(kind, f, z, tolerance=tolerance) for f, z in pairs])
    if by.duration > LONGEST:
        raise InvalidValueError(
            f"{kind} would add {by.duration:.3g} s to the move, for gears that vibrate at "
            f"{frequencies[0]:.3g} Hz; expected {LONGEST:g} s at most: check the stiffness of the gears"
        )
    return ModeShaper(by, frequencies[slowest])
