"""The table ``[trials]`` of a cell file."""

from __future__ import annotations

import math
from collections.abc import Collection

from armwright.cell.entries import known_name, read_name, read_spread, refuse_too_many
from armwright.cell.frames import FrameTree
from armwright.cell.scene import Spread
from armwright.cell.trials import Goal, Interval, Noise, Trials
from armwright.files.document import Table

# Bounds of what is drawn; those of the keys whose values are replaced.
_MAX_FRICTION, _MAX_PIXELS, _MAX_FORCE, _MAX_PERCENT = 10.0, 255.0, 1e4, 100.0
# A part keeps at least a tenth of its mass [%].
_MAX_MASS_PERCENT = 90.0


def read_trials(
    table: Table,
    parts: Collection[str],
    markers: Collection[str],
    frames: Collection[str],
    standing: FrameTree,
) -> Trials:
    """Read what trials draw and must reach.

    Args:
        table: an empty one where the file has none.
        parts: names of the parts.
        markers: names of the markers of the scene.
        frames: names of the frames of the file.
        standing: those of them that do not move with an arm.

    Raises:
        FileFormatError: a key is unknown or out of range, or a part, marker or frame does not exist.
    """
    trials = Trials(
        friction=_interval(table, "friction", _MAX_FRICTION),
        mass=table.number("mass_pct", default=0.0, lower=0.0, upper=_MAX_MASS_PERCENT) * 1e-2,
        poses=_poses(table.table("pose"), parts, [*markers, *(name for name in frames if name in standing)]),
        goals=_goals(table.table("goal"), parts, [*markers, *frames]),
        noise=_noise(table.table("noise")),
    )
    table.allow("pose", "goal", "noise")
    table.refuse_unknown_keys()
    return trials


def _poses(table: Table, parts: Collection[str], others: Collection[str]) -> dict[str, Spread]:
    poses: dict[str, Spread] = {}
    refuse_too_many(table, "entries")
    for key in table:
        name = known_name(table, key, read_name(table, key, poses), [*parts, *others], "a part, frame or marker")
        entry = table.table(key)
        # A part stands upright; what it stands on may be tilted.
        poses[name] = read_spread(entry, "xy_mm", "yaw_deg", None if name in parts else "tilt_deg")
        entry.refuse_unknown_keys()
    return poses


def _goals(table: Table, parts: Collection[str], frames: Collection[str]) -> dict[str, Goal]:
    goals: dict[str, Goal] = {}
    refuse_too_many(table, "entries")
    for key in table:
        name = known_name(table, key, read_name(table, key, goals), parts, "a part")
        entry = table.table(key)
        others = [*frames, *(other for other in parts if other != name)]
        goals[name] = Goal(
            at=known_name(entry, "at", entry.text("at"), others, "a marker, frame or other part"),
            distance=entry.number("mm", default=2.0, lower=1e-3, upper=1e4) * 1e-3,
            angle=math.radians(entry.number("deg", default=3.0, lower=1e-3, upper=180.0)),
        )
        entry.refuse_unknown_keys()
    return goals


def _noise(table: Table) -> Noise:
    noise = Noise(
        pixels=_interval(table, "pixels", _MAX_PIXELS),
        force=_interval(table, "force_N", _MAX_FORCE),
        effort=_interval(table, "effort_pct", _MAX_PERCENT, 1e-2),
    )
    table.refuse_unknown_keys()
    return noise


def _interval(table: Table, key: str, upper: float, unit: float = 1.0) -> Interval | None:
    """Read two numbers from 0 to a bound, the lower one first; without the key there is none."""
    if key not in table:
        table.allow(key)
        return None
    low, high = table.vector(key, 2).tolist()
    if not 0.0 <= low <= high <= upper:
        raise table.error(
            key, f"expected two numbers from 0 to {upper:g}, the lower one first, got [{low:g}, {high:g}]"
        )
    return low * unit, high * unit
