"""A MOVE before it begins, as far as collisions depend on it."""

from __future__ import annotations

from functools import cached_property

import attrs

from armwright.motion.trajectory import Trajectory, join


@attrs.frozen(kw_only=True, eq=False)
class PlannedMove:
    """A MOVE before it begins.

    Attributes:
        arm: the arm.
        stages: its trajectories, one after the other.
        goal_part: the part that it goes to, to be grasped; None where it goes to none.
        after_force: whether the tool may still press on something, because a force ended the MOVE before.
        on_force: whether a force ends this one.
    """

    arm: str
    stages: tuple[Trajectory, ...]
    goal_part: str | None = None
    after_force: bool = False
    on_force: bool = False

    @cached_property
    def trajectory(self) -> Trajectory:
        """All stages as one motion."""
        return join(self.stages)
