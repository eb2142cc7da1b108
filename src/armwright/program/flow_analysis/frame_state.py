"""The frame tree of the analysis: parents, assigned values, and the state of each gripper."""

from collections.abc import Iterator
from operator import or_

import attrs

from armwright.program.flow_analysis.facts import (
    ANY_GRIP,
    ANY_GRIPPER,
    ANY_LINK,
    GRIPPERS,
    GRIPS,
    UNKNOWN,
    Assignment,
    Divergence,
    Grip,
    GripperState,
    Link,
    join_grippers,
    join_grips,
    join_links,
)
from armwright.program.flow_analysis.lattice import Facts, FactTable, agreed_value
from armwright.program.flow_analysis.poses import IDENTITY, Pose, compose, inverse
from armwright.program.language.diagnostic import Label, labels
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.source import Span
from armwright.program.semantics.cell_symbols import STATION, WORLD, KnownCell

# Longest chain of parents along which a pose is computed.
_MAX_CHAIN_LENGTH = 50


class FrameState:
    """Frames and grippers, as far as they are known."""

    def __init__(self, cell: KnownCell | None, facts: Facts, *, rigid: bool = False) -> None:
        """Start with the frames of the cell.

        Args:
            cell: frames that have a value from the start; None when any may have.
            facts: the store of the facts.
            rigid: whether the program affixes any frame rigidly.
        """
        self._facts, self._rigid = facts, rigid
        self._children: dict[str, int] = {}
        self._count = self._carried = self._unknown_parents = self._assignments = 0
        self.links: FactTable[Link | None] = FactTable(facts, None, ANY_LINK, join_links, watch=self._watch)
        self.may_be_assigned = FactTable(facts, False, True, or_)
        # Of what may have a value, whether it is definitely assigned, or where the paths diverge.
        self.definitely_assigned: FactTable[Divergence | bool] = FactTable(facts, False, True, self._join_assigned)
        self.divergence: Divergence | None = None
        # Poses of frames relative to their parents.
        self._steps: FactTable[Pose | None] = FactTable(facts, None, None, agreed_value)
        self.assigned: FactTable[Assignment | None] = FactTable(facts, None, None, agreed_value)
        self.grippers = FactTable(facts, GripperState(), ANY_GRIPPER, join_grippers, GRIPPERS)
        self.grips: FactTable[Grip | None] = FactTable(facts, None, ANY_GRIP, join_grips, GRIPS)
        frames = dict(cell.frames) if cell else {}
        for name in (WORLD, STATION, *frames):
            self.mark_assigned(name)
        for name, parent in frames.items():
            if parent != WORLD:
                self.links.set(name, Link(parent))

    # ---- queries -----------------------------------------------------------------------------------------------------

    @property
    def is_empty(self) -> bool:
        """Whether no frame has been assigned or affixed."""
        return not self._assignments and not self._count

    def ancestors(self, name: str) -> Iterator[str]:
        """Yield the known ancestors of a frame, its parent first."""
        while (link := self.links[name]) is not None and link.parent is not None:
            name = link.parent
            yield name

    def would_close_cycle(self, child: str, parent: str) -> bool:
        """Whether affixing ``child`` to ``parent`` certainly closes a cycle."""
        if is_any_element(child):
            return False
        # A frame without children can be affixed anywhere: the common case needs no walk to the root.
        return child == parent or (self._children.get(child, 0) > 0 and child in self.ancestors(parent))

    def carrying_arm(self, name: str) -> str | None:
        """Return the arm among the ancestors of a frame; None if there is none."""
        # The walk may be long, and is not made where no arm carries anything.
        return next((above for above in self.ancestors(name) if is_arm(above)), None) if self._carried else None

    def is_parent_unknown(self, name: str) -> bool:
        """Whether the parent of a frame, or of an ancestor, is unknown."""
        if not self._unknown_parents and not self._facts.invalidated:
            return is_any_element(name)
        while not is_any_element(name):
            link = self.links[name]
            if link is None:
                return False
            if link.parent is None:
                return True
            name = link.parent
        return True

    def rigid_root(self, name: str) -> str | None:
        """Return the topmost frame that moves when ``name`` is assigned a pose; None where it is unknown."""
        while self._rigid:
            link = self.links[name]
            if link is None or not (link.rigid or link.parent is None):
                break
            if link.parent is None:
                return None
            name = link.parent
        return name

    def holding_arm(self, name: str) -> str | None:
        """Return the arm whose gripper closed on a frame; UNKNOWN where one may have, None where none has."""
        grips = {arm: grip.frame for arm, grip in self.grips.items() if grip is not None}
        if UNKNOWN in grips.values() or self.grips[""] is not None:
            return UNKNOWN
        return next((arm for arm, frame in grips.items() if frame == name), None)

    def world_pose(self, name: str) -> Pose | None:
        """Return the pose of a frame in WORLD; None where it is not constant, or the chain is long."""
        pose: Pose | None = IDENTITY
        for _ in range(_MAX_CHAIN_LENGTH):
            if name == WORLD or pose is None:
                return pose
            if is_any_element(name) or is_arm(name) or (step := self._steps[name]) is None:
                return None
            pose, link = compose(step, pose), self.links[name]
            if link is None:
                return pose
            if link.parent is None:
                return None
            name = link.parent
        return None

    def relative_pose(self, child: str, parent: str) -> Pose | None:
        """Return the pose of one frame relative to another; None where it is not constant."""
        there, here = self.world_pose(child), self.world_pose(parent)
        return None if there is None or here is None else compose(inverse(here), there)

    def affix_labels(self, name: str, text: str) -> tuple[Label, ...]:
        """Return a label on the AFFIX that gave a frame its parent; none where there is no such statement."""
        link = self.links[name]
        return labels(link.span if link else None, text)

    # ---- transfer functions ------------------------------------------------------------------------------------------

    def mark_assigned(self, name: str) -> None:
        """Record that a variable has a value, or that it is unknown whether it has."""
        self.may_be_assigned.set(name, True)
        self.definitely_assigned.set(name, True)

    def mark_unassigned(self, name: str) -> None:
        """Record that a variable has no value yet."""
        self.may_be_assigned.set(name, False)
        self.definitely_assigned.set(name, False)

    def affix(
        self, child: str, parent: str, span: Span | None, *, rigid: bool = False, step: Pose | None = None
    ) -> None:
        """Affix a frame to another, at a relative pose where that is constant."""
        if is_any_element(child):
            self.forget(child)
            return
        self.links.set(child, ANY_LINK if is_any_element(parent) else Link(parent, span, rigid))
        self._steps.set(child, step)
        self.mark_assigned(child)
        if self._facts.uncertainties and not self._is_fixed(child):
            self.forget_grippers()

    def unfix(self, child: str) -> None:
        """Remove the parent of a frame; it keeps its pose."""
        if is_any_element(child):
            self.forget(child)
        elif self.links[child] is not None:
            pose = self.world_pose(child)
            self.links.set(child, None)
            self._steps.set(child, pose)

    def set_world_pose(self, name: str, pose: Pose | None) -> None:
        """Record the pose of a frame in WORLD, unless assigning one may move others."""
        if is_any_element(name) or pose is None or self._rigid:
            return
        link = self.links[name] or Link(WORLD)
        if link.parent is not None:
            parent_pose = self.world_pose(link.parent)
            self._steps.set(name, None if parent_pose is None else compose(inverse(parent_pose), pose))

    def assign(self, name: str, span: Span) -> None:
        """Record the assignment of a pose to a frame."""
        self._assignments += 1
        if is_any_element(name):
            self.forget(name)
            return
        self.assigned.set(name, Assignment(self._assignments, span, moved=self.may_be_assigned[name]))
        self._steps.set(name, None)
        self.mark_assigned(name)
        if (root := self.rigid_root(name)) is None:
            self.forget_grippers()
        else:
            self.displace(root)

    def displace(self, name: str, mover: str | None = None) -> None:
        """Move a frame with its descendants: no gripper is at them or holds them any more.

        Args:
            name: the frame, or the arm that carries it.
            mover: the arm that moved it, if one did: what it carries moves with its gripper.
        """
        for arm, gripper in self.grippers.items():
            if arm != mover and (frame := self._frame_after_displacement(gripper.at, name)) != gripper.at:
                self.grippers.set(arm, attrs.evolve(gripper, at=frame, arrival=None))
        for arm, grip in self.grips.items():
            if arm != mover and grip is not None:
                self._set_grip(arm, grip, self._frame_after_displacement(grip.frame, name))

    def arrive(self, arm: str, frame: str | None, mover: Span | None) -> None:
        """Record that a gripper has moved, with all that its arm carries.

        Args:
            arm: the arm.
            frame: the frame at which it arrives, or which it has carried there; UNKNOWN where it is unknown.
            mover: the MOVE if it moved the arm itself.
        """
        self.displace(arm, mover=arm)
        gripper, grip = self.grippers[arm], self.grips[arm]
        if grip is not None and grip.frame not in (UNKNOWN, frame):
            gone = UNKNOWN if frame == UNKNOWN else None
            self._set_grip(arm, grip, {True: grip.frame, False: gone, None: UNKNOWN}[self._is_on(grip.frame, arm)])
        if mover and frame not in (None, UNKNOWN) and (along := self._is_on(frame, arm)) is not False:
            # The goal has moved with the arm: the gripper is only at what it was at before and carries.
            frame, mover = (self._frame_after_carrying(gripper.at, arm) if along else UNKNOWN), None
        elif frame not in (None, UNKNOWN) and not self._is_fixed(frame):
            frame = UNKNOWN
        arrival = None if gripper.doubtful or frame == UNKNOWN else mover
        self.grippers.set(arm, attrs.evolve(gripper, at=frame, arrival=arrival, arrived_open=gripper.open, opened=None))

    def open(self, arm: str, span: Span) -> None:
        """Open the fingers."""
        grip = self.grips[arm]
        link = None if grip is None or grip.frame == UNKNOWN else self.links[grip.frame]
        released = (grip.frame, span) if grip and link and link.parent == arm else None
        self.grippers.set(arm, attrs.evolve(self.grippers[arm], open=True, doubtful=False, opened=span, left=released))
        self.grips.set(arm, None)

    def close(self, arm: str, span: Span) -> None:
        """Close the fingers."""
        gripper = self.grippers[arm]
        self.grippers.set(arm, attrs.evolve(gripper, open=False, doubtful=False, left=None))
        self.grips.set(arm, Grip(gripper.at, span) if gripper.at else None)

    # ---- invalidation ------------------------------------------------------------------------------------------------

    def forget(self, name: str) -> None:
        """Invalidate the facts about a frame, and about grippers that may be at it."""
        if not is_any_element(name):
            self.links.set(name, ANY_LINK)
        self.forget_pose(name)
        self.forget_grippers()

    def forget_gripper(self, arm: str | None, *, grasps: bool) -> None:
        """Invalidate the facts about a gripper.

        Args:
            arm: the arm; None when it may be any.
            grasps: whether it may have closed its fingers on something.
        """
        if arm is not None:
            self.grippers.set(arm, ANY_GRIPPER)
            self.grips.set(arm, ANY_GRIP if grasps else self.grips[arm])
        else:
            for name in (GRIPPERS, GRIPS) if grasps else (GRIPPERS,):
                self._facts.invalidate(name)
        self.forget_grippers()

    def forget_pose(self, name: str) -> None:
        """Invalidate the pose of a frame; its parent stays known."""
        if is_any_element(name):
            self._facts.invalidate(name)
        else:
            self.mark_assigned(name)
            self.assigned.set(name, None)
            self._steps.set(name, None)

    def forget_grippers(self) -> None:
        """Invalidate what every gripper is at and holds: any frame may have moved."""
        for arm, gripper in self.grippers.items():
            if gripper.at not in (None, UNKNOWN):
                self.grippers.set(arm, attrs.evolve(gripper, at=UNKNOWN, arrival=None))
        for arm, grip in self.grips.items():
            if grip is not None:
                self._set_grip(arm, grip, UNKNOWN)

    def remove(self, name: str, *, array: bool = False) -> None:
        """Remove a frame, or an array of them; its children keep their poses."""
        if array or self._children.get(name, 0):
            for child, link in self.links.items():
                parent = link.parent if link else None
                if parent == name or (array and parent is not None and parent.startswith(f"{name}[")):
                    self.unfix(child)

    # ---- inside ------------------------------------------------------------------------------------------------------

    def _join_assigned(self, first: Divergence | bool, other: Divergence | bool) -> Divergence | bool:  # noqa: FBT001 - two values
        if first == other:
            return first
        return next((each for each in (first, other) if isinstance(each, Divergence)), self.divergence or True)

    def _set_grip(self, arm: str, grip: Grip, frame: str | None) -> None:
        """Set what a gripper holds: a frame, nothing, or an unknown one."""
        if frame != grip.frame:
            self.grips.set(arm, attrs.evolve(grip, frame=frame) if frame is not None else None)

    def _frame_after_carrying(self, frame: str | None, arm: str) -> str | None:
        """Return the frame at a gripper after its arm has carried its descendants away."""
        if frame is None or frame == UNKNOWN:
            return frame
        return {True: frame, False: None, None: UNKNOWN}[self._is_on(frame, arm)]

    def _frame_after_displacement(self, grasped: str | None, moved: str) -> str | None:
        """Return the frame at a gripper, or in it, after ``moved`` was displaced."""
        if grasped is None or grasped == UNKNOWN:
            return grasped
        return {True: None, False: grasped, None: UNKNOWN}[self._is_on(grasped, moved)]

    def _is_on(self, name: str, above: str) -> bool | None:
        """Whether a frame is another or its descendant; None where it is unknown."""
        if name == above or (self._children.get(above, 0) > 0 and above in self.ancestors(name)):
            return True
        return None if self.is_parent_unknown(name) or is_any_element(above) else False

    def _is_fixed(self, name: str) -> bool:
        """Whether no other process moves a frame."""
        facts = self._facts
        if not facts.uncertainties:
            return True
        if any(first.moves_frames for first in facts.uncertainties) or self.is_parent_unknown(name):
            return False
        return not any(facts.is_uncertain(first) for first in (name, *self.ancestors(name)))

    def _watch(self, link: Link | None, change: int) -> None:
        if link is not None and link.parent is None:
            self._unknown_parents += change
        elif link is not None and link.parent is not None:
            self._count += change
            self._carried += change * is_arm(link.parent)
            self._children[link.parent] = self._children.get(link.parent, 0) + change
