"""Where a run shall be stopped: lines with conditions and counts, and frames or variables that change."""

import operator
import re
from collections.abc import Callable, Mapping

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.program.debugger.history import ProcessPath
from armwright.program.debugger.snapshot import moving_process
from armwright.program.debugger.statements import StatementStart
from armwright.program.language.kinds import VariableKind
from armwright.program.vm.machine import Machine

# A frame that is farther from where it was than this has moved [m], and entries of rotations.
_MOVE_TOLERANCE = 1e-9
_COUNT = re.compile(r"\s*(==|>=|<=|=|>|<|%)?\s*([0-9]{1,9})\s*")
_COMPARISONS: Mapping[str, Callable[[int, int], bool]] = {
    "==": operator.eq,
    "=": operator.eq,
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
    "%": lambda hits, number: number > 0 and hits % number == 0,
}


class HitConditionError(ArmwrightError, ValueError):
    """A condition on how often a location is reached makes no sense."""


def matches_hit_count(condition: str, hits: int) -> bool:
    """Whether to stop at a location when it is reached for that time.

    Args:
        condition: ``3`` for the third time, ``>= 3`` from then on, ``% 3`` for every third.
        hits: how often it has been come to, this time included.

    Raises:
        HitConditionError: the condition is none of those.
    """
    match = _COUNT.fullmatch(condition)
    if match is None:
        raise HitConditionError(f"expected a count such as `3`, `>= 3` or `% 3`, got `{condition}`")
    return _COMPARISONS[match[1] or "=="](hits, int(match[2]))


@attrs.frozen(kw_only=True)
class Breakpoint:
    """A line at which a run shall be stopped.

    Attributes:
        number: its own, from 1.
        start: the statement; None where there is none, or its condition makes no sense.
        condition: that must be true; empty for none.
        hit_condition: a condition on how often it has been come to; empty for none.
        log_message: what to say instead of stopping, with expressions in braces; empty to stop.
        message: why it is not as it was asked for; empty where it is.
    """

    number: int
    start: StatementStart | None
    condition: str = ""
    hit_condition: str = ""
    log_message: str = ""
    message: str = ""


@attrs.define(kw_only=True, eq=False)
class Watch:
    """A frame or a variable at whose change a run shall be stopped.

    Of a motion that moves a frame only the first tick stops the run: it would be stopped a thousand times a second.

    Attributes:
        number: its own, among the breakpoints.
        slot: where the frame or variable is kept.
        condition: that must be true; empty for none.
        hit_condition: a condition on how often it has changed; empty for none.
        changes: how often it has changed since it is watched.
        last_value: its value when it was last checked.
        reported_motion: the motion for which the run has stopped: process, beginning.
    """

    number: int
    slot: str
    condition: str = ""
    hit_condition: str = ""
    changes: int = 0
    last_value: "Array | float | str | None" = None
    reported_motion: tuple[ProcessPath, int] | None = None

    def check_change(self, view: Machine) -> str | None:
        """Return what has changed since the last check, in words; None where nothing has."""
        value = _value(view, self.slot)
        last_value, self.last_value = self.last_value, value
        motion = _motion_id(view, self.slot)
        if self.reported_motion is not None:
            # The motion goes on, or has just come to its end.
            self.reported_motion = motion if motion == self.reported_motion else None
            return None
        if _are_equal(last_value, value):
            return None
        self.reported_motion = motion
        self.changes += 1
        name = view.spelling(self.slot)
        if isinstance(value, float | int):
            return f"{name} = {value:g}" + ("" if last_value is None else f", was {last_value:g}")
        if value is None:
            return f"{name} has no value any more"
        if motion is not None:
            return f"{name} begins to move with {view.carrier(self.slot)}"
        return f"{name} has moved" if last_value is not None else f"{name} has a value"

    def reset(self, view: Machine, *, reported: bool) -> None:
        """Take the present value as the last.

        Args:
            view: the machine as it is seen now.
            reported: whether the run has stopped for the motion that moves it now.
        """
        self.last_value = _value(view, self.slot)
        self.reported_motion = _motion_id(view, self.slot) if reported else None

    def is_moved(self, view: Machine) -> bool:
        """Whether an arm moves it, so that every tick has to be checked."""
        motion = _motion_id(view, self.slot)
        return motion is not None and motion != self.reported_motion


def _motion_id(view: Machine, slot: str) -> tuple[ProcessPath, int] | None:
    """Return which motion of an arm moves a frame now: process, beginning; None where it is at rest."""
    process = moving_process(view, slot)
    return None if process is None or process.motion is None else (process.path, process.motion.start.tick)


def _value(view: Machine, slot: str) -> "Array | float | str | None":
    kind = view.type_of(slot).kind
    if kind is VariableKind.FRAME:
        return view.state.tree.world(slot) if view.has_pose(slot) else None
    if kind is VariableKind.EVENT:
        return float(view.state.events.get(slot, 0))
    return view.state.values.get(slot)


def _are_equal(value: "Array | float | str | None", other: "Array | float | str | None") -> bool:
    if value is None or other is None:
        return value is other
    if isinstance(value, str) or isinstance(other, str):
        return bool(value == other)
    return bool(np.allclose(value, other, rtol=0, atol=_MOVE_TOLERANCE if isinstance(value, np.ndarray) else 0))
