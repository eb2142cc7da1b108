"""The frame table of the checker: what hangs on what and since where, what has a value, what each hand is doing."""

from collections.abc import Iterator
from operator import or_

import attrs

from armwright.program.flow_analysis.facts import (
    ANY_GRIP,
    ANY_HAND,
    ANY_LINK,
    GRIPS,
    HANDS,
    UNKNOWN,
    Assignment,
    Divergence,
    Grip,
    GripperState,
    Link,
    joined_grips,
    joined_hands,
    joined_links,
)
from armwright.program.flow_analysis.lattice import Facts, FactTable, same
from armwright.program.flow_analysis.poses import HERE, Pose, after, inverse
from armwright.program.language.diagnostic import Label, labels
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.source import Span
from armwright.program.semantics.cell_symbols import STATION, WORLD, KnownCell

# Frames that hang on one another, up to which a pose is worked out.
_MAX_CHAIN_LENGTH = 50


class FrameState:
    """Frames and hands, as far as one can know."""

    def __init__(self, cell: KnownCell | None, facts: Facts, *, rigid: bool = False) -> None:
        """Start with what the cell says.

        Args:
            cell: frames that have a value from the start; None when any may have.
            facts: where to keep what is known.
            rigid: whether any frame of the program may hang rigidly.
        """
        self._facts, self._rigid = facts, rigid
        self._children: dict[str, int] = {}
        self._count = self._carried = self._doubts = self._assignments = self._order = 0
        self.links: FactTable[Link | None] = FactTable(
            facts, default=None, unknown=ANY_LINK, joined=joined_links, watch=self._watch
        )
        self.valued = FactTable(facts, default=False, unknown=True, joined=or_)
        # Of what may have a value, whether it has one on every path here, or where the paths have parted.
        self.sure: FactTable[Divergence | bool] = FactTable(
            facts, default=False, unknown=True, joined=self._joined_sure
        )
        self.parting: Divergence | None = None
        # Where frames stand, seen from what they hang on.
        self._steps: FactTable[Pose | None] = FactTable(facts, default=None, unknown=None, joined=same)
        self.assigned: FactTable[Assignment | None] = FactTable(facts, default=None, unknown=None, joined=same)
        self.hands = FactTable(facts, default=GripperState(), unknown=ANY_HAND, joined=joined_hands, group=HANDS)
        self.grips: FactTable[Grip | None] = FactTable(
            facts, default=None, unknown=ANY_GRIP, joined=joined_grips, group=GRIPS
        )
        frames = dict(cell.frames) if cell else {}
        for name in (WORLD, STATION, *frames):
            self.has(name)
        for name, parent in frames.items():
            if parent != WORLD:
                self.links.put(name, Link(parent))

    # ---- looking ---------------------------------------------------------------------------------------------------

    @property
    def is_empty(self) -> bool:
        """Whether no frame has been given a value and none hangs on another."""
        return not self._assignments and not self._count

    def above(self, name: str) -> Iterator[str]:
        """Walk up from the frame that ``name`` hangs on, as far as one can know."""
        while (link := self.links[name]) is not None and link.parent is not None:
            name = link.parent
            yield name

    def would_ring(self, child: str, parent: str) -> bool:
        """Whether hanging ``child`` on ``parent`` certainly closes a ring."""
        if is_any_element(child):
            return False
        # What nothing hangs on can be hung anywhere: no long path up for the common case.
        return child == parent or (self._children.get(child, 0) > 0 and child in self.above(parent))

    def carrier(self, name: str) -> str | None:
        """Return the arm that a frame hangs on, directly or through others; None if there is none."""
        # The path up may be long: it is not gone where it leads nowhere.
        return next((above for above in self.above(name) if is_arm(above)), None) if self._carried else None

    def unknown(self, name: str) -> bool:
        """Whether one cannot know what a frame hangs on."""
        if not self._doubts and not self._facts.wipes:
            return is_any_element(name)
        while not is_any_element(name):
            link = self.links[name]
            if link is None:
                return False
            if link.parent is None:
                return True
            name = link.parent
        return True

    def leader(self, name: str) -> str | None:
        """Return the frame that is given another pose when ``name`` is; None when one cannot know."""
        while self._rigid:
            link = self.links[name]
            if link is None or not (link.rigid or link.parent is None):
                break
            if link.parent is None:
                return None
            name = link.parent
        return name

    def holder(self, name: str) -> str | None:
        """Return the arm whose hand closed on a frame; UNKNOWN when one may have, None when none has."""
        grips = {arm: grip.frame for arm, grip in self.grips.items() if grip is not None}
        if UNKNOWN in grips.values() or self.grips[""] is not None:
            return UNKNOWN
        return next((arm for arm, frame in grips.items() if frame == name), None)

    def where(self, name: str) -> Pose | None:
        """Return where a frame stands in WORLD; None where that is not certain, or up a long path."""
        pose: Pose | None = HERE
        for _ in range(_MAX_CHAIN_LENGTH):
            if name == WORLD or pose is None:
                return pose
            if is_any_element(name) or is_arm(name) or (step := self._steps[name]) is None:
                return None
            pose, link = after(step, pose), self.links[name]
            if link is None:
                return pose
            if link.parent is None:
                return None
            name = link.parent
        return None

    def step(self, child: str, parent: str) -> Pose | None:
        """Return the step from one frame to another; None where that is not certain."""
        there, here = self.where(child), self.where(parent)
        return None if there is None or here is None else after(inverse(here), there)

    def affixed(self, name: str, text: str) -> tuple[Label, ...]:
        """Return a label on the AFFIX that hung a frame where it hangs; none where there is no such statement."""
        link = self.links[name]
        return labels(link.span if link else None, text)

    # ---- changing --------------------------------------------------------------------------------------------------

    def has(self, name: str) -> None:
        """Take note that a variable has a value, or that nobody knows."""
        self.valued.put(name, True)
        self.sure.put(name, True)

    def lacks(self, name: str) -> None:
        """Take note that a variable has no value yet."""
        self.valued.put(name, False)
        self.sure.put(name, False)

    def hang(
        self, child: str, parent: str, span: Span | None, *, rigid: bool = False, step: Pose | None = None
    ) -> None:
        """Hang a frame on another, at a step from it where that is certain."""
        if is_any_element(child):
            self.forget(child)
            return
        self.links.put(child, ANY_LINK if is_any_element(parent) else Link(parent, span, rigid))
        self._steps.put(child, step)
        self.has(child)
        if self._facts.shaky and not self._steady(child):
            self.lose()

    def cut(self, child: str) -> None:
        """Cut a frame loose."""
        if is_any_element(child):
            self.forget(child)
        elif self.links[child] is not None:
            stands = self.where(child)
            self.links.put(child, None)
            self._steps.put(child, stands)

    def stand(self, name: str, pose: Pose | None) -> None:
        """Take note of where a frame has been put, in WORLD; not where putting one may move others."""
        link = None if is_any_element(name) else self.links[name]
        if is_any_element(name) or pose is None or self._rigid or (link is not None and link.parent is None):
            return
        above = HERE if link is None or link.parent is None else self.where(link.parent)
        self._steps.put(name, None if above is None else after(inverse(above), pose))

    def assign(self, name: str, span: Span) -> None:
        """Give a frame a value, and thereby another pose."""
        self._assignments += 1
        self._order += 1
        if is_any_element(name):
            self.forget(name)
            return
        self.assigned.put(name, Assignment(self._order, span, moved=self.valued[name]))
        self._steps.put(name, None)
        self.has(name)
        leader = self.leader(name)
        if leader is None:
            self.lose()
        else:
            self.displace(leader)

    def displace(self, name: str, mover: str | None = None) -> None:
        """Put a frame elsewhere; what hangs on it follows, and no hand stands at it or holds it any more.

        Args:
            name: the frame, or the arm that carries what hangs on it.
            mover: the arm that did it, if one did: what it carries goes along with its own hand.
        """
        for arm, hand in self.hands.items():
            if arm != mover and (frame := self._left(hand.at, name)) != hand.at:
                self.hands.put(arm, attrs.evolve(hand, at=frame, arrival=None))
        for arm, grip in self.grips.items():
            if arm != mover and grip is not None:
                self._hold(arm, grip, self._left(grip.frame, name))

    def arrive(self, arm: str, frame: str | None, mover: Span | None) -> None:
        """Move a gripper and all that it carries.

        Args:
            arm: the arm.
            frame: the frame to which it has come, or that it has taken there; UNKNOWN when one cannot know.
            mover: the MOVE if it moved the arm itself.
        """
        self.displace(arm, mover=arm)
        hand, grip = self.hands[arm], self.grips[arm]
        if grip is not None and grip.frame not in (UNKNOWN, frame):
            gone = UNKNOWN if frame == UNKNOWN else None
            self._hold(arm, grip, {True: grip.frame, False: gone, None: UNKNOWN}[self._on(grip.frame, arm)])
        if mover and frame not in (None, UNKNOWN) and (along := self._on(frame, arm)) is not False:
            # The goal has gone along: the gripper stands only at what it stood at before and has taken with it.
            frame, mover = (self._taken(hand.at, arm) if along else UNKNOWN), None
        elif frame not in (None, UNKNOWN) and not self._steady(frame):
            frame = UNKNOWN
        arrival = None if hand.doubtful or frame == UNKNOWN else mover
        self.hands.put(arm, attrs.evolve(hand, at=frame, arrival=arrival, arrived_open=hand.open, opened=None))

    def open(self, arm: str, span: Span) -> None:
        """Open the fingers."""
        grip = self.grips[arm]
        grasped = None if grip is None or grip.frame == UNKNOWN else grip.frame
        released = (
            None if grasped is None or (link := self.links[grasped]) is None or link.parent != arm else (grasped, span)
        )
        self.hands.put(arm, attrs.evolve(self.hands[arm], open=True, doubtful=False, opened=span, left=released))
        self.grips.put(arm, None)

    def close(self, arm: str, span: Span) -> None:
        """Close the fingers."""
        hand = self.hands[arm]
        self.hands.put(arm, attrs.evolve(hand, open=False, doubtful=False, left=None))
        self.grips.put(arm, Grip(hand.at, span) if hand.at else None)

    # ---- forgetting ------------------------------------------------------------------------------------------------

    def forget(self, name: str) -> None:
        """Give up what is known of a frame, and of hands that may have had to do with it."""
        if is_any_element(name):
            self._facts.wipe(name)
        else:
            self.links.put(name, self.links.unknown)
            self.has(name)
            self.assigned.put(name, None)
            self._steps.put(name, None)
        self.lose()

    def forget_hand(self, arm: str | None, *, grasps: bool) -> None:
        """Give up what is known of a gripper.

        Args:
            arm: the arm; None when it may be any.
            grasps: whether it may have closed its fingers on something.
        """
        if arm is not None:
            self.hands.put(arm, self.hands.unknown)
            self.grips.put(arm, self.grips.unknown if grasps else self.grips[arm])
        else:
            for name in (HANDS, GRIPS) if grasps else (HANDS,):
                self._facts.wipe(name)
        self.lose()

    def shift(self, name: str) -> None:
        """Take note that a frame may have been given another pose; what it hangs on stays known."""
        if is_any_element(name):
            self._facts.wipe(name)
        else:
            self.has(name)
            self.assigned.put(name, None)
            self._steps.put(name, None)

    def lose(self) -> None:
        """Take note that any frame may have been moved: where hands stand and what they hold is unknown."""
        for arm, hand in self.hands.items():
            if hand.at not in (None, UNKNOWN):
                self.hands.put(arm, attrs.evolve(hand, at=UNKNOWN, arrival=None))
        for arm, grip in self.grips.items():
            if grip is not None:
                self._hold(arm, grip, UNKNOWN)

    def drop(self, name: str, *, array: bool = False) -> None:
        """Take a frame, or an array of them, away: what hung on it keeps its pose."""
        if array or self._children.get(name, 0):
            for child, link in self.links.items():
                parent = link.parent if link else None
                if parent == name or (array and parent is not None and parent.startswith(f"{name}[")):
                    self.cut(child)

    # ---- inside ----------------------------------------------------------------------------------------------------

    def _joined_sure(self, first: Divergence | bool, other: Divergence | bool) -> Divergence | bool:  # noqa: FBT001 - two values
        if first == other:
            return first
        return next((each for each in (first, other) if isinstance(each, Divergence)), self.parting or True)

    def _hold(self, arm: str, grip: Grip, frame: str | None) -> None:
        """Let a gripper hold something else than before, or nothing, or nobody knows what."""
        if frame != grip.frame:
            self.grips.put(arm, attrs.evolve(grip, frame=frame) if frame is not None else None)

    def _taken(self, frame: str | None, arm: str) -> str | None:
        """Return where a gripper stands that stood at ``at`` and has taken along what hangs on it."""
        if frame is None or frame == UNKNOWN:
            return frame
        return {True: frame, False: None, None: UNKNOWN}[self._on(frame, arm)]

    def _left(self, grasped: str | None, moved: str) -> str | None:
        """Return where a gripper stands, or what it holds, after ``moved`` was put elsewhere."""
        if grasped is None or grasped == UNKNOWN:
            return grasped
        return {True: None, False: grasped, None: UNKNOWN}[self._on(grasped, moved)]

    def _on(self, name: str, above: str) -> bool | None:
        """Whether a frame is another or hangs on it; None when one cannot know."""
        if name == above or (self._children.get(above, 0) > 0 and above in self.above(name)):
            return True
        return None if self.unknown(name) or is_any_element(above) else False

    def _steady(self, name: str) -> bool:
        """Whether nobody else moves a frame."""
        facts = self._facts
        if not facts.shaky:
            return True
        if any(first.places for first in facts.shaky) or self.unknown(name):
            return False
        return not any(facts.is_shaky(first) for first in (name, *self.above(name)))

    def _watch(self, link: Link | None, change: int) -> None:
        if link is not None and link.parent is None:
            self._doubts += change
        elif link is not None and link.parent is not None:
            self._count += change
            self._carried += change * is_arm(link.parent)
            self._children[link.parent] = self._children.get(link.parent, 0) + change
