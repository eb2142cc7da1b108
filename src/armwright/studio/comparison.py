"""Motions of runs, kept to be compared: their figures, their courses, the paths of their tools."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import CellArm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.limited import limited_efforts, limited_positions
from armwright.program.vm.recording import Recording, Stream

# Rows of a course, and points of a path, that pages get.
_ROWS = 400
_QUANTITIES = ("q", "qd", "qdd", "tau")


@attrs.frozen(kw_only=True, eq=False)
class KeptMotion:
    """What is kept of a run.

    Attributes:
        number: counts what has been kept, from 1.
        name: of the program.
        duration: [s].
        arms: what each arm did, by name, as plain data: figures, rows of its course, points of its path.
    """

    number: int
    name: str
    duration: float
    arms: dict[str, dict[str, Any]]

    def state(self) -> dict[str, Any]:
        """Return it as plain data."""
        return attrs.asdict(self)


def kept_motion(recording: Recording, number: int) -> KeptMotion:
    """Return what is kept of a run."""
    return KeptMotion(
        number=number,
        name=recording.code.source.name,
        duration=round(recording.duration, 4),
        arms={it.arm: _arm_state(it, recording.cell.arms[it.arm]) for it in recording.streams},
    )


def _arm_state(stream: Stream, placed: CellArm) -> dict[str, Any]:
    rows = np.unique(np.linspace(0, len(stream.t) - 1, _ROWS).astype(int))
    path = (placed.base @ forward(placed.arm, stream.q))[:, :3, 3]
    return {
        "figures": _figures(stream, placed, path),
        "t": stream.t[rows].round(4).tolist(),
        **{name: getattr(stream, name)[rows].round(5).tolist() for name in _QUANTITIES},
        "path": path[rows].round(4).tolist(),
    }


def _figures(stream: Stream, placed: CellArm, path: Array) -> dict[str, float | int | None]:
    """Return the figures of a motion.

    Path length of the tool [m] and its highest speed [m/s], work of the drives [J], and the highest speed, acceleration
    and effort of joints, or their drives, as a part of the limit, with the number of the joint. None is
    what is unknown: efforts and work of an arm without masses, too.
    """
    arm, limits = placed.arm, placed.arm.all_limits
    period = float(stream.t[1] - stream.t[0]) if len(stream.t) > 1 else 1.0
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    figures: dict[str, float | int | None] = {
        "path_length": float(steps.sum()),
        "tool_speed": float(steps.max(initial=0.0)) / period,
        "work": None if arm.massless else float(np.abs(stream.tau * stream.qd).sum() * period),
    }
    for name, values, most in (
        ("speed", limited_positions(arm, stream.qd), limits.speed),
        ("acceleration", limited_positions(arm, stream.qdd), limits.acceleration),
        ("effort", limited_efforts(arm, stream.tau), limits.effort),
    ):
        shares = np.abs(values).max(axis=0, initial=0.0) / most
        known = np.isfinite(most) & (name != "effort" or not arm.massless)
        figures[f"{name}_share"] = float(shares[known].max()) if known.any() else None
        figures[f"{name}_joint"] = int(np.where(known, shares, -1.0).argmax()) % arm.n + 1 if known.any() else None
    return figures
