"""The bodies of a cell, and which pairs of them may not meet."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import attrs

from armwright.arm.guessed_solids import guessed_solids
from armwright.arm.model import Arm
from armwright.cell.model import Cell, CellArm
from armwright.cell.part_poses import PartPoses
from armwright.cell.scene import Gripper
from armwright.physics.clearance import Body
from armwright.physics.hand_solids import before_hand, gripper_length, gripper_solids
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Solid


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
    bodies = [Body(f"{name} base", solid.moved(X_0B), name) for solid in arm.base_solids]
    for number, (link, solids) in enumerate(zip(arm.links, links, strict=True), 1):
        label = f"{name} {link.name or f'link {number}'}"
        bodies += [Body(label, solid, name, number) for solid in solids]
    return bodies


@attrs.frozen(kw_only=True)
class Role:
    """What a body of a cell is.

    Attributes:
        arm: whose link or gripper it is; None for fixtures and parts.
        part: the part that it is; None where it is none.
        in_hand: whether it is of the gripper, or of the last link of an arm without one.
        grips: whether it touches the parts that a gripper holds.
        guessed: whether it is a guess what it looks like.
    """

    arm: str | None = None
    part: str | None = None
    in_hand: bool = False
    grips: bool = False
    guessed: bool = False


class CellBodies:
    """The bodies of a cell: of arms and grippers, fixtures, parts. Their numbers are the same all the time.

    Attributes:
        cell: the cell.
        roles: what each body is.
    """

    def __init__(self, cell: Cell) -> None:
        """Collect the bodies."""
        self.cell = cell
        self.roles: list[Role] = []
        # Those that do not change, by their numbers.
        self._fixed: list[Body] = []
        for name, arm in cell.arms.items():
            self._add_arm(name, arm)
        self._hands = {
            name: [Role(arm=name, in_hand=True, grips=it.grips) for it in gripper_solids(arm.gripper, 0.0)]
            for name, arm in cell.arms.items()
            if arm.gripper is not None
        }
        for roles in self._hands.values():
            self.roles += roles
        self._fixtures = [Body(name, Solid(shape=it.shape, pose=it.pose)) for name, it in cell.fixtures.items()]
        self.roles += [Role() for _ in self._fixtures]
        self.roles += [Role(part=name) for name in cell.parts]

    def _add_arm(self, name: str, placed: CellArm) -> None:
        arm = placed.arm
        bodies, guessed = arm_bodies(name, arm, placed.gripper), not has_solids(arm)
        for body in bodies:
            in_hand = placed.gripper is None and body.link == arm.n
            self.roles.append(Role(arm=name, in_hand=in_hand, grips=in_hand, guessed=guessed and body.link > 0))
        self._fixed += bodies

    def arranged(self, parts: PartPoses) -> list[Body]:
        """Return the bodies with the parts where they are, the grippers as far open as they are."""
        bodies = list(self._fixed)
        for name in self._hands:
            placed = self.cell.arms[name]
            assert placed.gripper is not None  # noqa: S101 - only then it has a hand
            for it in gripper_solids(placed.gripper, parts.opening(name)):
                solid = Solid(shape=it.shape, pose=placed.arm.tool @ it.pose)
                bodies.append(Body(f"{name} {it.name}", solid, name, placed.arm.n))
        bodies += self._fixtures
        for name, part in self.cell.parts.items():
            carrier, X = parts.carrier(name), parts.pose(name)
            if carrier is None:
                bodies.append(Body(name, Solid(shape=part.shape, pose=X)))
            else:
                arm = self.cell.arms[carrier].arm
                bodies.append(Body(name, Solid(shape=part.shape, pose=arm.tool @ X), carrier, arm.n))
        return bodies


def pairs_of(bodies: Iterable[Body]) -> list[tuple[int, int]]:
    """Return the pairs of bodies that may not meet: of two arms, of an arm and what stands, of links of an arm.

    Links next to each other are always in touch, and so is what one link carries.
    """
    numbered = list(enumerate(bodies))
    return [(i, j) for (i, a), (j, b) in combinations(numbered, 2) if _may_not_meet(a, b)]


def _may_not_meet(a: Body, b: Body) -> bool:
    if a.arm == b.arm:
        return a.arm is not None and abs(a.link - b.link) > 1
    # A base stands, as fixtures do.
    return a.link > 0 or b.link > 0
