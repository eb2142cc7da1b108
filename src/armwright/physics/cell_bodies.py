"""The bodies of a cell, and which pairs of them may not meet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations

from armwright.arm.guessed_solids import guessed_solids
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.physics.clearance import Body
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Solid, convex_solids


def arm_bodies(name: str, arm: Arm) -> list[Body]:
    """Return the bodies of an arm: its own solids, or guessed ones where it has none."""
    known = any(link.solids for link in arm.links)
    links = [link.solids for link in arm.links] if known else guessed_solids(arm)
    # Frame 0 of the table may be elsewhere than the base frame.
    X_0B = inverse(arm.base)
    bodies = [Body(f"{name} base", solid.moved(X_0B), name) for solid in convex_solids(arm.base_solids)]
    for number, (link, solids) in enumerate(zip(arm.links, links, strict=True), 1):
        label = f"{name} {link.name or f'link {number}'}"
        bodies += [Body(label, solid, name, number) for solid in convex_solids(solids)]
    return bodies


def cell_bodies(cell: Cell, parts: Mapping[str, Array]) -> list[Body]:
    """Return the bodies of a cell.

    Args:
        cell: the cell.
        parts: (4, 4) poses in the world of the parts that no arm holds, by name.
    """
    bodies = [body for name, arm in cell.arms.items() for body in arm_bodies(name, arm.arm)]
    standing = [(name, Solid(shape=it.shape, pose=it.pose)) for name, it in cell.fixtures.items()]
    standing += [(name, Solid(shape=cell.parts[name].shape, pose=X)) for name, X in parts.items()]
    return bodies + [Body(name, piece) for name, solid in standing for piece in convex_solids([solid])]


def pairs_apart(bodies: Iterable[Body]) -> list[tuple[int, int]]:
    """Return the pairs of bodies that may not meet: of two arms, or of an arm and what stands.

    Bodies of one arm are no such pairs here.
    """
    numbered = list(enumerate(bodies))
    return [(i, j) for (i, a), (j, b) in combinations(numbered, 2) if a.arm != b.arm]
