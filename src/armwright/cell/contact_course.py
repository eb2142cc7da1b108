"""What the tool of an arm presses on along a motion, tick by tick."""

from __future__ import annotations

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
        ticks: what is pressed on, by the tick since then; nothing at all others.
        last_tick: what is pressed on then stays.
        first_contact: when the motion comes down on something [s], on the clock of the cell; None where it does not.
        excess_tick: the first tick at which it is deeper than it may be; None where it never is.
    """

    guarded: bool
    t0: float
    ticks: dict[int, Pressing]
    last_tick: int
    first_contact: float | None
    excess_tick: int | None

    def tick(self, now: float, period: float) -> int:
        """Return the tick of a time [s] on the clock of the cell."""
        return min(max(0, round((now - self.t0) / period)), self.last_tick)

    def at(self, now: float, period: float) -> Pressing:
        """Return what is pressed on at a time [s] on the clock of the cell."""
        return self.ticks.get(self.tick(now, period), NOTHING)

    def deepest(self, now: float, period: float) -> Pressing:
        """Return the deepest contact until a time [s] on the clock of the cell."""
        end = self.tick(now, period)
        return max((it for tick, it in self.ticks.items() if tick <= end), key=lambda it: it.depth, default=NOTHING)


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
