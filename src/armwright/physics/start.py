"""What a world with physics must be at its start: made of known arguments, with no arm's base inside what stands."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

from armwright.arrays import integer
from armwright.cell.frames import WORLD
from armwright.cell.model import Cell
from armwright.errors import InvalidValueError, KindError, closest, shown
from armwright.physics.cell_bodies import Body, arm_bodies
from armwright.physics.contacts import OVERLAP, Overlap
from armwright.physics.distances import Distances
from armwright.spatial.shapes import Solid, convex_solids


def check_arguments(cell: Cell, seed: int, laws: object, parts: object) -> None:
    """Refuse arguments of a world of which nothing can be made.

    Args:
        cell: the cell.
        seed: an integer of 0 or more.
        laws: functions by name of an arm; None for none.
        parts: as they are in the world, the same ones as those of the cell; None where they are to be drawn.

    Raises:
        KindError: one of them is of another kind.
        InvalidValueError: the seed is below 0, a law is for no arm of the cell, the parts are not those of the cell, or
            one of them lies on a frame that moves by itself.
    """
    if not isinstance(cell, Cell):
        raise KindError(f"cell: expected a Cell, such as read_cell returns, got {shown(cell)}")
    integer(seed, "seed", least=0)
    if laws is not None and not isinstance(laws, Mapping):
        raise KindError(f"laws: expected functions by the name of an arm, got {shown(laws)}")
    for name, law in (laws or {}).items():
        if not isinstance(name, str) or not callable(law):
            raise KindError(f"laws: expected a function of t, q, qd and reference for {shown(name)}, got {shown(law)}")
        if name not in cell.arms:
            near = closest(name, cell.arms)
            hint = f"; did you mean {near}?" if near else ""
            raise InvalidValueError(f"laws: {name} is no arm of cell '{cell.name}'{hint}")
    riding = next((part for part in cell.parts.values() if part.on != WORLD), None)
    if riding is not None:
        raise InvalidValueError(
            f"cell '{cell.name}': part {riding.name} lies on {riding.on}, which moves by itself; worlds with physics "
            "have no such frames: leave out its key `on`, or run without physics"
        )
    if parts is not None and (not isinstance(parts, Mapping) or parts.keys() != cell.parts.keys()):
        known = ", ".join(cell.parts) or "none"
        raise InvalidValueError(f"parts: expected those of cell '{cell.name}' by name ({known}), got {shown(parts)}")


def buried_bases(cell: Cell) -> list[Overlap]:
    """Return which bases of arms stand inside fixtures: neither can move, so MuJoCo has no contacts between them.

    Args:
        cell: the cell, its fixtures where they stand in the world.
    """
    bases = [
        Body(body.name, body.solid.moved(placed.base @ placed.arm.base))
        for name, placed in cell.arms.items()
        for body in arm_bodies(name, placed.arm)
        if body.link == 0
    ]
    fixtures = [
        Body(name, piece)
        for name, it in cell.fixtures.items()
        for piece in convex_solids([Solid(shape=it.shape, pose=it.pose)])
    ]
    if not bases or not fixtures:
        return []
    distances = Distances([body.solid.shape for body in (*bases, *fixtures)])
    for number, body in enumerate((*bases, *fixtures)):
        distances.set_pose(number, body.solid.pose)
    found = []
    for (i, base), (j, fixture) in product(enumerate(bases), enumerate(fixtures, len(bases))):
        depth = -distances.between(i, j, 0.0)
        if depth > OVERLAP:
            found.append(Overlap(base.name, fixture.name, depth))
    return found
