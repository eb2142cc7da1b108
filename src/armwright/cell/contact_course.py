"""What the tool of an arm presses on along a motion, tick by tick."""

from __future__ import annotations

from bisect import bisect_right
from typing import Protocol, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.part_poses import PartPoses
from armwright.motion.trajectory import Trajectory

# Numbers of two bodies that press on each other: that of the arm first.
Pair: TypeAlias = tuple[int, int]


@attrs.frozen(kw_only=True, eq=False)
class Pressing:
    """What a tool presses on at one servo tick.

    Attributes:
        depth: of the deepest contact [m].
        wrench: (6,) on the tool: force [N] and moment about the tool point [N m], along the axes of the world.
        body: the name of what it presses on.
        pairs: the bodies that press on each other.
    """

    depth: float
    wrench: Array
    body: str
    pairs: frozenset[Pair]


NOTHING = Pressing(depth=0.0, wrench=np.zeros(6), body="", pairs=frozenset())


@attrs.frozen(kw_only=True, eq=False)
class ContactCourse:
    """The contacts of a tool along a motion.

    Attributes:
        guarded: whether all contacts count; otherwise only those at the start.
        t0: when the motion began, on the clock of the cell [s].
        ticks: since then, in order, from each of which on another thing is pressed on, or otherwise.
        pressings: what is pressed on from each of these ticks on; before the first it is nothing.
        last_tick: what is pressed on then stays.
        first_contact: when the motion comes down on something [s], on the clock of the cell; None where it does not.
        excess_tick: the first tick at which it is deeper than it may be; None where it never is.
    """

    guarded: bool
    t0: float
    ticks: tuple[int, ...]
    pressings: tuple[Pressing, ...]
    last_tick: int
    first_contact: float | None
    excess_tick: int | None

    def tick(self, now: float, period: float) -> int:
        """Return the tick of a time [s] on the clock of the cell."""
        return min(max(0, round((now - self.t0) / period)), self.last_tick)

    def at(self, now: float, period: float) -> Pressing:
        """Return what is pressed on at a time [s] on the clock of the cell."""
        count = bisect_right(self.ticks, self.tick(now, period))
        return self.pressings[count - 1] if count else NOTHING

    def deepest(self, now: float, period: float) -> Pressing:
        """Return the deepest contact until a time [s] on the clock of the cell."""
        count = bisect_right(self.ticks, self.tick(now, period))
        return max(self.pressings[:count], key=lambda it: it.depth, default=NOTHING)

    def wrenches(self, now: float, period: float) -> Array:
        """Return the wrenches (k, 6) at the tick of a time [s] and the following ones; the last one remains."""
        start = self.tick(now, period)
        known = np.array([NOTHING.wrench, *(pressing.wrench for pressing in self.pressings)])
        numbers = np.arange(start, max((start, *self.ticks[-1:])) + 1)
        return np.asarray(known[np.searchsorted(self.ticks, numbers, side="right")])


class SceneContacts(Protocol):
    """What stands in a cell, as it yields to the tools of arms."""

    def along(
        self,
        arm: str,
        trajectory: Trajectory,
        now: float,
        parts: PartPoses,
        *,
        guarded: bool,
        pressed: frozenset[Pair],
    ) -> ContactCourse:
        """Return the contacts of the tool of an arm, and of what it holds, along a motion.

        Args:
            arm: its name.
            trajectory: from now on.
            now: the time [s].
            parts: where the parts are.
            guarded: whether all contacts count; otherwise only those of ``pressed``.
            pressed: what presses on each other already.
        """
