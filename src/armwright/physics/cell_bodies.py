"""The bodies of a cell, and those of an arm."""

from __future__ import annotations

from typing import NamedTuple

from armwright.arm.guessed_solids import guessed_solids
from armwright.arm.model import Arm
from armwright.cell.scene import Gripper
from armwright.physics.hand_solids import before_hand, gripper_length
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Solid, convex_solids


class Body(NamedTuple):
    """A solid of a cell.

    Attributes:
        name: in messages.
        solid: in the frame of the link that carries it; in the world where none does.
        arm: the arm that carries it; None where it stands.
        link: of the arm, from 1; 0 is its base.
    """

    name: str
    solid: Solid
    arm: str | None = None
    link: int = 0


def has_solids(arm: Arm) -> bool:
    """Whether the file of an arm states solids of its links; otherwise they are guessed."""
    return any(link.solids for link in arm.links)


def arm_bodies(name: str, arm: Arm, gripper: Gripper | None = None) -> list[Body]:
    """Return the bodies of an arm: its own solids, or guessed ones where it has none.

    Args:
        name: of the arm.
        arm: the arm.
        gripper: what it holds parts with; guessed solids end behind it. It is not among the bodies.
    """
    links = [link.solids for link in arm.links]
    if not has_solids(arm):
        links = list(guessed_solids(arm))
        ends = (before_hand(solid, arm, gripper_length(gripper)) for solid in links[-1])
        links[-1] = tuple(solid for solid in ends if solid is not None)
    # Frame 0 of the table may be elsewhere than the base frame.
    X_0B = inverse(arm.base)
    bodies = [Body(f"{name} base", solid.moved(X_0B), name) for solid in convex_solids(arm.base_solids)]
    for number, (link, solids) in enumerate(zip(arm.links, links, strict=True), 1):
        label = f"{name} {link.name or f'link {number}'}"
        bodies += [Body(label, solid, name, number) for solid in convex_solids(solids)]
    return bodies
