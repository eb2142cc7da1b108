"""A run that can be taken back: the machine, how many steps it has done, and moments to start again from.

A run is the same every time, so any moment of it can be come to again: by what was kept of a moment before it, and
the steps from there. Moments are kept now and then, more rarely the longer a program runs.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import attrs

from armwright.cell.hardware import HardwareFactory
from armwright.cell.model import Cell
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.program.bytecode.instructions import Code, Op
from armwright.program.vm.interpreter import advance, next_process, ready_process
from armwright.program.vm.machine import Limits, Machine
from armwright.program.vm.process import Process

# A moment is kept when the path from the last one has taken so long [s], or so many times what keeping one takes.
_MIN_INTERVAL = 0.05
_MIN_INTERVAL_PER_COST = 20.0
# With more moments than this every second one is forgotten.
_MAX_SNAPSHOTS = 100

ProcessPath = tuple[int, ...]
Change = Callable[[Machine], None]


class _Snapshot(NamedTuple):
    """What is kept of a moment: after how many steps, and copies that nobody changes."""

    step_count: int
    machine: Machine
    progress: "Progress"


@attrs.define
class Progress:
    """What a debugger remembers of the path to a moment, beside the state of the program itself.

    Attributes:
        blocked: processes whose statement was begun and found that it has to wait.
        last_instructions: the instruction that each process did last.
        visits: how often each statement has been begun, by its first instruction.
    """

    blocked: set[ProcessPath] = attrs.field(factory=set)
    last_instructions: dict[ProcessPath, int] = attrs.field(factory=dict)
    visits: dict[int, int] = attrs.field(factory=dict)

    def copy(self) -> "Progress":
        """Return the same marks."""
        return Progress(set(self.blocked), dict(self.last_instructions), dict(self.visits))


class Timeline:
    """A run of a program in a simulated cell, from its start to where it has come to.

    Attributes:
        machine: its state now.
        progress: of the path to here.
        step_count: steps done so far.
    """

    def __init__(
        self, code: Code, cell: Cell, limits: Limits | None = None, hardware: HardwareFactory = kinematic_cell
    ) -> None:
        """Stand in front of the first instruction."""
        self.machine = Machine(code, cell, hardware(cell), limits)
        self.progress = Progress()
        self.step_count = 0
        self._changes: list[tuple[int, Change]] = []
        # Whether a step failed half-done, so that the state is not that of a moment.
        self._broken = False
        self._interval, self._cost, self._last_snapshot_time = _MIN_INTERVAL, 0.0, time.perf_counter()
        self._snapshots = [self._take_snapshot()]

    @property
    def next_process(self) -> Process | None:
        """The process that does the next step; None where all wait for one another."""
        return ready_process(self.machine)

    def snapshots_before(self, step_count: int) -> list[int]:
        """Return the numbers of steps, fewer than ``step_count``, after which a moment was kept, the largest first."""
        return [moment.step_count for moment in reversed(self._snapshots) if moment.step_count < step_count]

    def begins_statement(self, process: Process) -> bool:
        """Whether the next step of a process begins a statement, or another pass of a loop."""
        if process.pending_effect is not None or process.followed_motion is not None:
            return False
        judge, work = process.judge_tick, process.work_tick
        if judge is not None and (work is None or judge <= max(work, self.machine.state.ticks)):
            # It is served to judge its WHENs.
            return False
        step = self.machine.code.instructions[process.pc]
        if not step.begins or process.path in self.progress.blocked:
            return False
        # The first pass of a FOR follows its own beginning.
        return step.op is not Op.FOR or self.progress.last_instructions.get(process.path) != process.pc - 1

    def advance(self) -> Process:
        """Do one step.

        Returns:
            The process that did it.

        Raises:
            RunError: something went wrong that no TRY is around; the run is over.
        """
        machine, progress = self.machine, self.progress
        self._broken = True
        process = next_process(machine)
        index = process.pc
        if self.begins_statement(process):
            progress.visits[index] = progress.visits.get(index, 0) + 1
        ticks = max(process.due_tick or 0, machine.state.ticks)
        judges = process.judge_tick is not None and process.judge_tick <= ticks
        instruction = process.pending_effect is None and process.followed_motion is None and not judges
        advance(machine, process)
        if instruction:
            progress.last_instructions[process.path] = index
        if process.waiting is not None and process.waiting.kind != "branches":
            progress.blocked.add(process.path)
        else:
            progress.blocked.discard(process.path)
        self._broken = False
        self.step_count += 1
        self._snapshot_if_due()
        self._reapply_changes()
        return process

    def seek(self, step_count: int) -> None:
        """Come to the moment after so many steps, which were done before without an error."""
        if self._broken or not self._snapshots[-1].step_count <= self.step_count <= step_count:
            self._restore(next(moment for moment in reversed(self._snapshots) if moment.step_count <= step_count))
        while self.step_count < step_count:
            self.advance()

    def apply_change(self, change: Change) -> None:
        """Change the state now; what was known of the time after it is forgotten.

        Raises:
            RunError: it cannot be changed so, and is as it was.
        """
        change(self.machine)
        self._snapshots = [moment for moment in self._snapshots if moment.step_count <= self.step_count]
        self._changes = [change for change in self._changes if change[0] <= self.step_count]
        self._changes.append((self.step_count, change))

    def discard_later(self) -> None:
        """Forget changes that were made later than now, and moments that come after one of them."""
        discarded = [index for index, _ in self._changes if index > self.step_count]
        self._changes = [change for change in self._changes if change[0] <= self.step_count]
        if discarded:
            self._snapshots = [moment for moment in self._snapshots if moment.step_count <= min(discarded)]

    def _reapply_changes(self) -> None:
        for index, change in self._changes:
            if index == self.step_count:
                change(self.machine)

    # ---- moments ---------------------------------------------------------------------------------------------------

    def _snapshot_if_due(self) -> None:
        """Keep this moment, if the last one is long ago."""
        now = time.perf_counter()
        if self.step_count <= self._snapshots[-1].step_count or now - self._last_snapshot_time < max(
            self._interval, _MIN_INTERVAL_PER_COST * self._cost
        ):
            return
        self._snapshots.append(self._take_snapshot())
        if len(self._snapshots) > _MAX_SNAPSHOTS:
            del self._snapshots[1::2]
            self._interval *= 2

    def _take_snapshot(self) -> _Snapshot:
        start = time.perf_counter()
        moment = _Snapshot(self.step_count, self.machine.copy(), self.progress.copy())
        self._last_snapshot_time = time.perf_counter()
        # One that the machine was busy with something else for says little of the next.
        cost = self._last_snapshot_time - start
        self._cost = min(cost, 2 * self._cost) if self._cost else cost
        return moment

    def _restore(self, moment: _Snapshot) -> None:
        self.machine, self.progress = moment.machine.copy(), moment.progress.copy()
        self.step_count, self._broken = moment.step_count, False
        self._last_snapshot_time = time.perf_counter()
        self._reapply_changes()
