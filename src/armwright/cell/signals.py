"""Inputs and outputs of a cell: what a program switches, and what it reads at a time."""

from collections.abc import Mapping
from typing import TypeAlias

import attrs

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
    """

    analogue: bool = False
    start: float = 0.0
    timeline: Changes = ()
    follows: str | None = None
    delay: float = 0.0
    event: str | None = None
    pulse: float | None = None


def value_at(changes: Changes, time: float, start: float = 0.0) -> float:
    """Return the value behind the last change up to a time [s]; the one at the start where there is none."""
    return next((value for when, value in reversed(changes) if when <= time + _SAME_TIME), start)


class Signals:
    """The inputs and outputs of a cell at work. Time is that of the cell [s]."""

    def __init__(self, inputs: Mapping[str, Input]) -> None:
        """Start with all outputs off."""
        self._inputs, self.now = inputs, 0.0
        self._outputs: dict[str, Changes] = {}
        # When events were signalled, and what switches were set to by hand.
        self._events: dict[str, tuple[float, ...]] = {}
        self._switches: dict[str, Changes] = {}

    def copy(self) -> "Signals":
        """Return signals in the same state; later commands to one do not change the other."""
        other = Signals(self._inputs)
        other.now, other._outputs = self.now, dict(self._outputs)
        other._events, other._switches = dict(self._events), dict(self._switches)
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
        return value_at(self._outputs.get(name, ()), self.now)

    def active(self) -> frozenset[str]:
        """Return the outputs that are on."""
        return frozenset(name for name in self._outputs if self.output(name))

    # ---- inputs ----------------------------------------------------------------------------------------------------

    def note_event(self, event: str) -> None:
        """Take note that the program has signalled an event now."""
        self._events[event] = (*self._events.get(event, ()), self.now)

    def set_input(self, name: str, value: float, time: float | None = None) -> None:
        """Set an input by hand: from a time on, or now, it is that, until its timeline, output or event changes it."""
        when = self.now if time is None else time
        before = tuple(change for change in self._switches.get(name, ()) if change[0] < when - _SAME_TIME)
        self._switches[name] = (*before, (when, value))

    def input(self, name: str, time: float | None = None) -> float:
        """Return what an input is now, or at a time: what came last of its timeline, output, event and switch."""
        source, now = self._inputs[name], self.now if time is None else time
        changes = [*source.timeline]
        if source.follows is not None:
            changes += [(when + source.delay, value) for when, value in self._outputs.get(source.follows, ())]
        for when in self._events.get(source.event or "", ()):
            changes.append((when, 1.0))
            if source.pulse is not None:
                changes.append((when + source.pulse, 0.0))
        changes += self._switches.get(name, ())
        # Of changes at one time the last in this list counts.
        return value_at(tuple(sorted(changes, key=lambda change: change[0])), now, source.start)
