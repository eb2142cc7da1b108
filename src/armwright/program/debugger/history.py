"""A run that can be taken back: the machine, how many steps it has done, and moments to start again from.

A run is the same every time, so any moment of it can be come to again: by what was kept of a moment before it, and
the steps from there. Moments are kept now and then, more rarely the longer a program runs.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import attrs

from armwright.cell.model import Cell
from armwright.cell.simulator import Simulator
from armwright.program.bytecode.instructions import Code, Op
from armwright.program.vm.interpreter import Limits, Machine, advance, due, ready
from armwright.program.vm.process import Process

# A moment is kept when the path from the last one has taken so long [s], or so many times what keeping one takes.
_OFTEN = 0.05
_SHARE = 20.0
# With more moments than this every second one is forgotten.
_MAX_SNAPSHOTS = 100

Path = tuple[int, ...]
Change = Callable[[Machine], None]


class _Moment(NamedTuple):
    """What is kept of a moment: after how many steps, and copies that nobody changes."""

    done: int
    machine: Machine
    marks: "Marks"


@attrs.define
class Marks:
    """What a debugger remembers of the path to a moment, beside the state of the program itself.

    Attributes:
        blocked: processes whose statement was begun and found that it has to wait.
        came: the instruction that each process did last.
        visits: how often each statement has been begun, by its first instruction.
    """

    blocked: set[Path] = attrs.field(factory=set)
    came: dict[Path, int] = attrs.field(factory=dict)
    visits: dict[int, int] = attrs.field(factory=dict)

    def copy(self) -> "Marks":
        """Return the same marks."""
        return Marks(set(self.blocked), dict(self.came), dict(self.visits))


class Timeline:
    """A run of a program in a simulated cell, from its start to where it has come to.

    Attributes:
        machine: its state now.
        marks: of the path to here.
        done: steps done so far.
    """

    def __init__(self, code: Code, cell: Cell, limits: Limits | None = None) -> None:
        """Stand in front of the first instruction."""
        self.machine = Machine(code, cell, Simulator(cell), limits)
        self.marks = Marks()
        self.done = 0
        self._changes: list[tuple[int, Change]] = []
        # Whether a step failed half-done, so that the state is not that of a moment.
        self._broken = False
        self._often, self._cost, self._begun = _OFTEN, 0.0, time.perf_counter()
        self._moments = [self._moment()]

    @property
    def ready(self) -> Process | None:
        """The process that does the next step; None where all wait for one another."""
        return ready(self.machine)

    def moments_before(self, done: int) -> list[int]:
        """Return the numbers of steps, fewer than ``done``, after which a moment was kept, the largest first."""
        return [moment.done for moment in reversed(self._moments) if moment.done < done]

    def arrives(self, process: Process) -> bool:
        """Whether the next step of a process begins a statement, or another pass of a loop."""
        if process.pending is not None or process.follows is not None:
            return False
        step = self.machine.code.instructions[process.at]
        if not step.begins or process.path in self.marks.blocked:
            return False
        # The first pass of a FOR follows its own beginning.
        return step.op is not Op.FOR or self.marks.came.get(process.path) != process.at - 1

    def advance(self) -> Process:
        """Do one step.

        Returns:
            The process that did it.

        Raises:
            RunError: something went wrong that no TRY is around; the run is over.
        """
        machine, marks = self.machine, self.marks
        self._broken = True
        process = due(machine)
        index = process.at
        if self.arrives(process):
            marks.visits[index] = marks.visits.get(index, 0) + 1
        instruction = process.pending is None and process.follows is None
        advance(machine, process)
        if instruction:
            marks.came[process.path] = index
        if process.waiting is not None and process.waiting.what != "branches":
            marks.blocked.add(process.path)
        else:
            marks.blocked.discard(process.path)
        self._broken = False
        self.done += 1
        self._keep()
        self._change()
        return process

    def seek(self, done: int) -> None:
        """Come to the moment after so many steps, which were done before without an error."""
        if self._broken or not self._moments[-1].done <= self.done <= done:
            self._restore(next(moment for moment in reversed(self._moments) if moment.done <= done))
        while self.done < done:
            self.advance()

    def change(self, change: Change) -> None:
        """Change the state now; what was known of the time after it is forgotten.

        Raises:
            RunError: it cannot be changed so, and is as it was.
        """
        change(self.machine)
        self._moments = [moment for moment in self._moments if moment.done <= self.done]
        self._changes = [change for change in self._changes if change[0] <= self.done]
        self._changes.append((self.done, change))

    def forget(self) -> None:
        """Forget changes that were made later than now, and moments that come after one of them."""
        later = [index for index, _ in self._changes if index > self.done]
        self._changes = [change for change in self._changes if change[0] <= self.done]
        if later:
            self._moments = [moment for moment in self._moments if moment.done <= min(later)]

    def _change(self) -> None:
        for index, change in self._changes:
            if index == self.done:
                change(self.machine)

    # ---- moments ---------------------------------------------------------------------------------------------------

    def _keep(self) -> None:
        """Keep this moment, if the last one is long ago."""
        now = time.perf_counter()
        if self.done <= self._moments[-1].done or now - self._begun < max(self._often, _SHARE * self._cost):
            return
        self._moments.append(self._moment())
        if len(self._moments) > _MAX_SNAPSHOTS:
            del self._moments[1::2]
            self._often *= 2

    def _moment(self) -> _Moment:
        began = time.perf_counter()
        moment = _Moment(self.done, self.machine.copy(), self.marks.copy())
        self._begun = time.perf_counter()
        # One that the machine was busy with something else for says little of the next.
        cost = self._begun - began
        self._cost = min(cost, 2 * self._cost) if self._cost else cost
        return moment

    def _restore(self, moment: _Moment) -> None:
        self.machine, self.marks = moment.machine.copy(), moment.marks.copy()
        self.done, self._broken = moment.done, False
        self._begun = time.perf_counter()
        self._change()
