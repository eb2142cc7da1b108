"""Steps of one process: how far each kind of step goes."""

from typing import Literal, TypeAlias

import attrs

from armwright.program.debugger.history import ProcessPath
from armwright.program.debugger.snapshot import find_process
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Process

# To the next statement; the next at the same level or further out; further out only; the next stage of a MOVE.
StepKind: TypeAlias = Literal["in", "next", "out", "stage"]
# Deeper than any stack.
_ANY_DEPTH = 1 << 60


@attrs.define(kw_only=True)
class Step:
    """A step running.

    Attributes:
        kind: how far it goes.
        path: the process that makes it; when its branch ends, the process that began the branch.
        depth: of the stack of the process when the step began.
        has_advanced: whether the process has done anything since.
        stage: the stage that the process is in.
    """

    kind: StepKind
    path: ProcessPath
    depth: int
    has_advanced: bool = False
    stage: tuple[int, int] | None = None

    def record_step(self, machine: Machine, path: ProcessPath) -> str | None:
        """Take note of what a process has just done; return in words what ends the step with it, or None."""
        if path == self.path:
            self.has_advanced = True
        process = find_process(machine, self.path)
        while process is None and self.path:
            # The branch is over: the step ends where the process that began it goes on.
            self.path, self.depth, self.has_advanced = self.path[:-1], _ANY_DEPTH, True
            process = find_process(machine, self.path)
        if self.kind != "stage" or process is None:
            return None
        stage, self.stage = self.stage, current_stage(process)
        if self.stage is None or self.stage == stage:
            return None
        record = machine.state.stages[self.stage[1]]
        return f"{record.arm} begins {record.stage.kind} {' '.join(record.goal_names)}"

    def ends_at(self, process: Process) -> bool:
        """Whether the step ends at the statement that a process is about to begin."""
        is_own = process.path == self.path
        # A step into a COBEGIN ends in the first of its branches.
        if not self.has_advanced or not (is_own or (self.kind == "in" and process.path[: len(self.path)] == self.path)):
            return False
        match self.kind:
            case "next":
                return len(process.stack) <= self.depth
            case "out":
                return len(process.stack) < self.depth
            case _:
                return True


def begin_step(machine: Machine, kind: StepKind, path: ProcessPath) -> Step:
    """Return a step of a process that begins now."""
    process = find_process(machine, path)
    depth, stage = (_ANY_DEPTH, None) if process is None else (len(process.stack), current_stage(process))
    return Step(kind=kind, path=path, depth=depth, stage=stage)


def current_stage(process: Process) -> tuple[int, int] | None:
    """Return which stage of which motion a process is in: the tick of its beginning, its number in the record."""
    return None if process.motion is None else (process.motion.start.tick, process.motion.stage_index)
