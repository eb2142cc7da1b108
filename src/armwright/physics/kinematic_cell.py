"""A cell without physics: what a program runs in unless it asks for another."""

from __future__ import annotations

from armwright.cell.model import Cell
from armwright.cell.simulator import Simulator


def kinematic_cell(cell: Cell) -> Simulator:
    """Return the kinematic simulator of a cell; where it has no plane of contact, what stands in it yields to tools."""
    if cell.contact.height is not None or not (cell.fixtures or cell.parts):
        return Simulator(cell)
    from armwright.physics.scene_contacts import YieldingScene  # noqa: PLC0415 - only cells with a scene need it

    return Simulator(cell, YieldingScene(cell))
