"""The solids of the bodies of an arm in collisions, and which pairs of them are checked: as tables and as data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

import attrs
import numpy as np

from armwright.arm.collision_pairs import Pair, body_names
from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.files.result_table import ResultTable
from armwright.physics.cell_bodies import arm_bodies
from armwright.physics.self_collision import LeftOut, self_pairs
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere


@attrs.frozen(kw_only=True)
class CollisionBodies:
    """The bodies of an arm for collisions.

    Attributes:
        arm: the arm.
        solids: number of a body, and a solid of it in the frame of its link; 0 is the base, in frame 0.
        checked: pairs of bodies that may not meet.
        left_out: pairs that are not checked, each with the reason.
    """

    arm: Arm
    solids: tuple[tuple[int, Solid], ...]
    checked: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...]

    @property
    def notes(self) -> Sequence[str]:
        """Say that shapes are guesses, if any are."""
        guesses = sum(solid.guessed for _, solid in self.solids)
        if not guesses:
            return ()
        share = "All" if guesses == len(self.solids) else f"{guesses} of the {len(self.solids)}"
        return (f"{share} solids are guesses; the keys base_solids and solids of an arm file state better ones.",)

    def as_data(self) -> dict[str, Any]:
        """Return the solids and pairs as plain data in SI units."""
        names = body_names(self.arm.n)
        bodies = [
            {
                "body": names[number],
                "name": self.arm.links[number - 1].name if number else self.arm.base_link,
                "solids": [_solid_data(solid) for _, solid in solids],
            }
            for number, solids in groupby(self.solids, key=lambda entry: entry[0])
        ]
        return {
            "arm": self.arm.name,
            "bodies": bodies,
            "checked": [[names[a], names[b]] for a, b in self.checked],
            "left_out": [{"bodies": [names[a], names[b]], "reason": reason} for (a, b), reason in self.left_out],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables of solids, of pairs that are checked, and of those that are not [mm]."""
        names = [self._label(number) for number in range(self.arm.n + 1)]
        rows = [
            (names[number], _kind(solid.shape), _size_text(solid.shape), "guess" if solid.guessed else "arm file")
            for number, solid in self.solids
        ]
        yield ResultTable(title="Solids", heads=("body", "shape", "size", "source"), rows=rows)
        groups = groupby(self.checked, key=lambda pair: pair[0])
        checked = [(names[a], ", ".join(names[b] for _, b in pairs)) for a, pairs in groups]
        yield ResultTable(title="Pairs checked", heads=("body", "against"), rows=checked)
        left_out = [(names[a], names[b], reason) for (a, b), reason in self.left_out]
        yield ResultTable(title="Pairs left out", heads=("body", "body", "reason"), rows=left_out)

    def _label(self, number: int) -> str:
        own = self.arm.links[number - 1].name if number else self.arm.base_link
        name = body_names(self.arm.n)[number]
        return f"{name} ('{own}')" if own else name


def collision_bodies(arm: Arm) -> CollisionBodies:
    """Return the solids of an arm, its own or guessed ones, and which pairs of its bodies are checked.

    Raises:
        KindError: it is no arm.
    """
    bodies = arm_bodies(known_arm(arm).name, arm)
    pairs = self_pairs(arm, bodies)
    solids = tuple((body.link, body.solid) for body in bodies)
    return CollisionBodies(arm=arm, solids=solids, checked=pairs.checked, left_out=pairs.left_out)


def _kind(shape: Shape) -> str:
    return type(shape).__name__.lower()


def _size_text(shape: Shape) -> str:
    """Return the lengths of a solid in words."""
    match shape:
        case Box(size=size):
            return f"{' x '.join(f'{x * 1e3:.5g}' for x in size)} mm"
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length):
            return f"radius {radius * 1e3:.5g} mm, length {length * 1e3:.5g} mm"
        case Sphere(radius=radius):
            return f"radius {radius * 1e3:.5g} mm"
        case Mesh(faces=faces, name=name):
            return f"{len(faces)} triangles{f' of {name}' if name else ''}"


def _solid_data(solid: Solid) -> dict[str, Any]:
    """Return a solid as plain data: its kind, its lengths [m], its pose and whether it is a guess."""
    shape = solid.shape
    if isinstance(shape, Mesh):
        lengths = {"triangles": len(shape.faces), "file": shape.name}
    else:
        lengths = {name: np.asarray(x).tolist() for name, x in attrs.asdict(shape, recurse=False).items()}
    return {"kind": _kind(shape), **lengths, "pose": solid.pose.tolist(), "guessed": solid.guessed}
