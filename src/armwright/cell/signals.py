"""Inputs and outputs of a cell: what a program switches, and what it reads at a time."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from operator import itemgetter
from typing import TypeAlias

import attrs

from armwright.cell.outputs import Output
from armwright.cell.zones import Zone

# A change so little behind the time that is asked for has happened [s].
_SAME_TIME = 1e-9

# Changes in order: when [s], and to what.
Changes: TypeAlias = tuple[tuple[float, float], ...]


@attrs.frozen(kw_only=True)
class Input:
    """An input of a cell, and how it behaves in a simulated one; digital ones are 0 or 1.

    Attributes:
        analogue: whether it is a number, and not only on or off.
        start: its value at the start, and where nothing else gives it one.
        timeline: its changes by the clock.
        follows: the output that it repeats; None for none.
        delay: how much later it does so [s].
        event: the EVENT of the program whose SIGNAL switches it on; None for none.
        pulse: how long it is on then [s]; None for ever.
        zone: where the tool of an arm switches it; None for nowhere.
        address: of the real controller; None where it is not known.
    """

    analogue: bool = False
    start: float = 0.0
    timeline: Changes = ()
    follows: str | None = None
    delay: float = 0.0
    event: str | None = None
    pulse: float | None = None
    zone: Zone | None = None
    address: Output | None = None


def latest_change(changes: Changes, time: float) -> tuple[float, float] | None:
    """Return the last change up to a time [s]; None where there is none."""
    index = bisect_right(changes, time + _SAME_TIME, key=itemgetter(0))
    return changes[index - 1] if index else None


class Signals:
    """The inputs and outputs of a cell at work. Time is that of the cell [s]."""

    def __init__(self, inputs: Mapping[str, Input]) -> None:
        """Start with all outputs off."""
        self._inputs, self.now = inputs, 0.0
        self._outputs: dict[str, Changes] = {}
        # When events were signalled, and what switches were set to by hand.
        self._events: dict[str, Changes] = {}
        self._switches: dict[str, Changes] = {}
        # What zones have told, and will tell as far as motions are known.
        self._zones: dict[str, Changes] = {}

    def copy(self) -> "Signals":
        """Return signals in the same state; later commands to one do not change the other."""
        other = Signals(self._inputs)
        other.now, other._outputs = self.now, dict(self._outputs)
        other._events, other._switches, other._zones = dict(self._events), dict(self._switches), dict(self._zones)
        return other

    # ---- outputs ---------------------------------------------------------------------------------------------------

    def write(self, output: str, value: float) -> None:
        """Set an output from now on; what a pulse would do later is forgotten."""
        before = tuple(change for change in self._outputs.get(output, ()) if change[0] < self.now - _SAME_TIME)
        self._outputs[output] = (*before, (self.now, value))

    def pulse(self, output: str, seconds: float) -> None:
        """Switch an output on for a time."""
        self.write(output, 1.0)
        self._outputs[output] = (*self._outputs[output], (self.now + seconds, 0.0))

    def output(self, name: str) -> float:
        """Return what an output is now."""
        change = latest_change(self._outputs.get(name, ()), self.now)
        return 0.0 if change is None else change[1]

    def active(self) -> frozenset[str]:
        """Return the outputs that are on."""
        return frozenset(name for name in self._outputs if self.output(name))

    # ---- inputs ----------------------------------------------------------------------------------------------------

    def note_event(self, event: str) -> None:
        """Take note that the program has signalled an event now."""
        self._events[event] = (*self._events.get(event, ()), (self.now, 1.0))

    def set_input(self, name: str, value: float, time: float | None = None) -> None:
        """Set an input by hand: from a time on, or now, it is that, until its timeline, output or event changes it."""
        when = self.now if time is None else time
        before = tuple(change for change in self._switches.get(name, ()) if change[0] < when - _SAME_TIME)
        self._switches[name] = (*before, (when, value))

    def note_zone(self, name: str, changes: Changes) -> None:
        """Take note of what a zone tells from the first of some changes on, in place of what was to come then."""
        known, (start, value) = self._zones.get(name, ()), changes[0]
        before = known[: bisect_left(known, start - _SAME_TIME, key=itemgetter(0))]
        goes_on = bool(before) and before[-1][1] == value
        if not goes_on or len(changes) > 1 or len(before) < len(known):
            self._zones[name] = (*before, *changes[goes_on:])

    def input(self, name: str, time: float | None = None) -> float:
        """Return what an input is now, or at a time: what came last of what gives it values, and its switch."""
        source, now = self._inputs[name], self.now if time is None else time
        changes = [latest_change(source.timeline, now), latest_change(self._zones.get(name, ()), now)]
        if source.follows is not None and (
            repeated := latest_change(self._outputs.get(source.follows, ()), now - source.delay)
        ):
            changes.append((repeated[0] + source.delay, repeated[1]))
        if source.event is not None and (signalled := latest_change(self._events.get(source.event, ()), now)):
            over = math.inf if source.pulse is None else signalled[0] + source.pulse
            changes.append((over, 0.0) if over <= now + _SAME_TIME else signalled)
        changes.append(latest_change(self._switches.get(name, ()), now))
        # Of changes at one time the last in this list counts.
        found = [change for change in reversed(changes) if change is not None]
        return max(found, key=itemgetter(0))[1] if found else source.start
