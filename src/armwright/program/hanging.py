"""The frame table of the checker: what hangs on what and since where, what has a value, what each hand is doing."""

from collections.abc import Iterable, Iterator

import attrs

from armwright.program.known import STATION, WORLD, KnownCell
from armwright.program.source import Span


@attrs.frozen
class Link:
    """One affixment: the frame above, and the AFFIX that made it; None where the cell did."""

    parent: str
    span: Span | None


@attrs.frozen
class Assignment:
    """One value given to a frame: by which statement, where, and whether the frame stood somewhere before."""

    order: int
    span: Span
    moved: bool


@attrs.define
class Hand:
    """What is known of one hand.

    Attributes:
        open: whether the fingers are open; None while nothing is known.
        at: the frame at which the hand stands.
        arrival: the MOVE of the arm itself that brought it there.
        arrived_open: whether the fingers were open then.
        opened: the OPEN since then.
        holds: the frame at which the fingers closed.
        grasp: the GRASP that closed them.
    """

    open: bool | None = None
    at: str | None = None
    arrival: Span | None = None
    arrived_open: bool | None = None
    opened: Span | None = None
    holds: str | None = None
    grasp: Span | None = None


class Hanging:
    """Frames and hands, as far as a program without branches lets one know."""

    def __init__(self, cell: KnownCell | None) -> None:
        """Start with what the cell says."""
        frames = dict(cell.frames) if cell else {}
        self.links = {name: Link(parent, None) for name, parent in frames.items() if parent != WORLD}
        self.valued = {WORLD, STATION, *frames}
        self.assigned: dict[str, Assignment] = {}
        self.hands: dict[str, Hand] = {}
        self._children: dict[str, int] = {}
        # Frames of which a part that was passed over may have changed everything.
        self._unknown: set[str] = set()
        for link in self.links.values():
            self._count(link.parent, 1)

    def hand(self, arm: str) -> Hand:
        """Return what is known of a hand."""
        return self.hands.setdefault(arm, Hand())

    def above(self, name: str) -> Iterator[str]:
        """Walk up from the frame that ``name`` hangs on."""
        while (link := self.links.get(name)) is not None:
            name = link.parent
            yield name

    def would_ring(self, child: str, parent: str) -> bool:
        """Whether hanging ``child`` on ``parent`` closes a ring."""
        # What nothing hangs on can be hung anywhere: no long way up for the common case.
        return child == parent or (self._children.get(child, 0) > 0 and child in self.above(parent))

    def carrier(self, name: str) -> str | None:
        """Return the arm that a frame hangs on, directly or through others; None if there is none."""
        return next((above for above in self.above(name) if is_arm(above)), None)

    def unknown(self, name: str) -> bool:
        """Whether one cannot know what a frame hangs on."""
        return bool(self._unknown) and (
            name in self._unknown or any(above in self._unknown for above in self.above(name))
        )

    def hang(self, child: str, parent: str, span: Span) -> None:
        """Hang a frame on another."""
        self.cut(child)
        self.links[child] = Link(parent, span)
        self._count(parent, 1)
        self.valued.add(child)

    def cut(self, child: str) -> None:
        """Cut a frame loose."""
        self._unknown.discard(child)
        if (old := self.links.pop(child, None)) is not None:
            self._count(old.parent, -1)

    def assign(self, name: str, order: int, span: Span) -> None:
        """Give a frame a value, and thereby another place."""
        self.assigned[name] = Assignment(order, span, moved=name in self.valued)
        self.valued.add(name)
        self.displace(name)

    def displace(self, name: str, by: str | None = None) -> None:
        """Put a frame elsewhere; what hangs on it follows, and no hand stands at it or holds it any more.

        Args:
            name: the frame, or the arm that carries what hangs on it.
            by: the arm that did it, if one did: what it carries goes along with its own hand.
        """
        for arm, hand in self.hands.items():
            if arm == by:
                continue
            if hand.at and self._on(hand.at, name):
                hand.at = hand.arrival = None
            if hand.holds and self._on(hand.holds, name):
                hand.holds = None

    def arrive(self, arm: str, at: str | None, by: Span | None) -> None:
        """Move a hand and all that it carries; ``by`` is the MOVE if it moved the arm itself."""
        self.displace(arm, by=arm)
        hand = self.hand(arm)
        if hand.holds and hand.holds != at and not self._on(hand.holds, arm):
            hand.holds = None
        if by and at and self._on(at, arm):
            # The goal has gone along: the hand stands only at what it stood at before and has taken with it.
            at, by = (hand.at if hand.at and self._on(hand.at, arm) else None), None
        hand.at, hand.arrival, hand.arrived_open, hand.opened = at, by, hand.open, None

    def forget(self, names: Iterable[str]) -> None:
        """Give up what is known of these frames and arms."""
        for name in names:
            if is_arm(name):
                self.hands[name] = Hand()
            else:
                self.cut(name)
                self._unknown.add(name)
                self.valued.add(name)

    def _on(self, name: str, above: str) -> bool:
        return name == above or above in self.above(name)

    def _count(self, parent: str, change: int) -> None:
        self._children[parent] = self._children.get(parent, 0) + change


def is_arm(name: str) -> bool:
    """Whether a canonical name is that of an arm; no other name has its form."""
    return name.startswith("ARM_") and name[4:].isdecimal()
