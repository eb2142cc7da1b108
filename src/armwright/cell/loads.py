"""Arms with the parts that they hold: what their motors have to move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.part_poses import PartTrack
from armwright.dynamics.payloads import payload
from armwright.spatial.shapes import centroid, inertia


def loaded_arm(cell: Cell, name: str, held: Iterable[tuple[str, Array]]) -> Arm:
    """Return an arm whose last link is one body with the parts that it holds.

    The parts have their masses in the cell file, of one density. An arm whose controller knows nothing of its parts,
    and one whose own masses are unknown, is returned as it is.

    Args:
        cell: the cell.
        name: of the arm.
        held: the parts that it holds, each with its pose (4, 4) on the tool.
    """
    placed = cell.arms[name]
    arm = placed.arm
    if not placed.servo.knows_parts or any(link.unknown for link in arm.links):
        return arm
    for part_name, X_HP in held:
        part, R = cell.parts[part_name], X_HP[:3, :3]
        com = R @ centroid(part.shape) + X_HP[:3, 3]
        arm = payload(arm, part.mass, com, R @ (part.mass * inertia(part.shape)) @ R.T)
    return arm


def loads_over_time(cell: Cell, name: str, tracks: Mapping[str, PartTrack]) -> list[tuple[float, Arm]]:
    """Return an arm with what it held, each with the time from which on that was so [s], the first from 0.

    Args:
        cell: the cell.
        name: of the arm.
        tracks: where the parts were, by name.
    """
    times = sorted({0.0, *(time for track in tracks.values() if name in track.carriers for time in track.times)})
    loads = []
    for time in times:
        held = [(part, pose) for part, track in tracks.items() for arm, pose in [track.at(time)] if arm == name]
        loads.append((time, loaded_arm(cell, name, held)))
    return loads
