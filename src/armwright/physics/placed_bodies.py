"""The bodies of a cell where its parts are, and which pairs of them may not meet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import attrs

from armwright.cell.model import Cell, CellArm
from armwright.cell.part_poses import PartPoses
from armwright.physics.cell_bodies import Body, arm_bodies, has_solids
from armwright.physics.frame_slides import part_on_slide
from armwright.physics.hand_solids import gripper_solids
from armwright.physics.self_collision import self_pairs
from armwright.spatial.shapes import Solid, convex_solids


@attrs.frozen(kw_only=True)
class Role:
    """What a body of a cell is.

    Attributes:
        arm: whose link or gripper it is; None for fixtures and parts.
        part: the part that it is; None where it is none.
        in_gripper: whether it is of the gripper.
        in_hand: whether it is of the gripper, or of the last link of an arm without one.
        grips: whether it touches the parts that a gripper holds.
        guessed: whether its shape is a guess.
    """

    arm: str | None = None
    part: str | None = None
    in_gripper: bool = False
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
            name: [
                Role(arm=name, in_gripper=True, in_hand=True, grips=it.grips) for it in gripper_solids(arm.gripper, 0.0)
            ]
            for name, arm in cell.arms.items()
            if arm.gripper is not None
        }
        for roles in self._hands.values():
            self.roles += roles
        self._fixtures = [
            Body(name, piece)
            for name, it in cell.fixtures.items()
            for piece in convex_solids([Solid(shape=it.shape, pose=it.pose)])
        ]
        self.roles += [Role() for _ in self._fixtures]
        self._pieces = [
            (name, piece) for name, it in cell.parts.items() for piece in convex_solids([Solid(shape=it.shape)])
        ]
        self.roles += [Role(part=name) for name, _ in self._pieces]
        self._number_in_hand = {name: it.arm.n + (name in self._hands) for name, it in cell.arms.items()}
        self._self_pairs = {name: frozenset(self._rule(name)) for name in cell.arms}

    def _rule(self, name: str) -> Iterable[tuple[int, int]]:
        """Return which bodies of an arm may not meet one another, the gripper being one of them."""
        arm = self.cell.arms[name].arm
        own = [body for body in self._fixed if body.arm == name]
        return self_pairs(arm, own, self._gripper_bodies(name, PartPoses(self.cell).opening(name))).checked

    def _add_arm(self, name: str, placed: CellArm) -> None:
        arm = placed.arm
        bodies, guessed = arm_bodies(name, arm, placed.gripper), not has_solids(arm)
        for body in bodies:
            in_hand = placed.gripper is None and body.link == arm.n
            is_guess = body.solid.guessed or (guessed and body.link > 0)
            self.roles.append(Role(arm=name, in_hand=in_hand, grips=in_hand, guessed=is_guess))
        self._fixed += bodies

    def _gripper_bodies(self, name: str, opening: float) -> list[Body]:
        """Return the bodies of the gripper of an arm, which its last link carries; none where it has none."""
        gripper, arm = self.cell.arms[name].gripper, self.cell.arms[name].arm
        solids = [] if gripper is None else gripper_solids(gripper, opening)
        return [Body(f"{name} {it.name}", Solid(shape=it.shape, pose=arm.tool @ it.pose), name, arm.n) for it in solids]

    def arranged(self, parts: PartPoses) -> list[Body]:
        """Return the bodies with the parts where they are, the grippers as far open as they are."""
        bodies = list(self._fixed)
        for name in self._hands:
            bodies += self._gripper_bodies(name, parts.opening(name))
        bodies += self._fixtures
        for name, piece in self._pieces:
            carrier, X = parts.carrier(name), parts.pose(name)
            if carrier is None:
                bodies.append(Body(name, piece.moved(X)))
            elif carrier in self.cell.arms:
                arm = self.cell.arms[carrier].arm
                bodies.append(Body(name, piece.moved(arm.tool @ X), carrier, arm.n))
            else:
                bodies.append(Body(name, piece.moved(part_on_slide(self.cell.moving_frames[carrier], X)), carrier, 1))
        return bodies

    def pairs(self, bodies: Sequence[Body]) -> list[tuple[int, int]]:
        """Return the pairs of bodies that may not meet: of two arms, of an arm and what stands, of one arm by its rule.

        Args:
            bodies: as they are arranged.
        """
        # What the tool holds is the body after the last link.
        numbers = [
            self._number_in_hand.get(body.arm or "", body.link) if role.part or role.in_gripper else body.link
            for body, role in zip(bodies, self.roles, strict=True)
        ]
        pairs = []
        for (i, a), (j, b) in combinations(enumerate(bodies), 2):
            if a.arm is None or a.arm != b.arm:
                # A base stands, as fixtures do.
                counts = a.link > 0 or b.link > 0
            elif a.arm not in self.cell.arms:
                counts = False
            else:
                counts = (min(numbers[i], numbers[j]), max(numbers[i], numbers[j])) in self._self_pairs[a.arm]
            if counts:
                pairs.append((i, j))
        return pairs
