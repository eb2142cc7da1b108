"""The debugger: a run that is stopped, looked at, changed, and taken a step further or back."""

import math
import time
from itertools import count
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.cell.model import Cell
from armwright.errors import ArmwrightError
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger import expressions, variables
from armwright.program.debugger.breakpoints import Breakpoint, CountError, Watch, counts
from armwright.program.debugger.execution import Execution, Position, RunToStop
from armwright.program.debugger.expressions import ExpressionError, names_at
from armwright.program.debugger.history import Path
from armwright.program.debugger.snapshot import Frame, mover, process_of, stack
from armwright.program.debugger.step_rules import step_of
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import Variable
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_arm
from armwright.program.vm.interpreter import Limits, RunError
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Element, Process
from armwright.program.vm.recording import Effect

# To the next stop; to the next statement, over calls, into them, out of them; to the next stage of a MOVE; to the next
# servo tick; back to the statement before, the tick before, the breakpoint before.
Command: TypeAlias = Literal["continue", "next", "in", "out", "stage", "tick", "back", "tick back", "reverse"]
_BACK = frozenset(("back", "tick back", "reverse"))


class DebuggerError(ArmwrightError, RuntimeError):
    """What was asked for cannot be done where the run stands."""


class Debugger:
    """A program in a simulated cell, step by step.

    Attributes:
        stop: why the run stands still; None while it goes on, and before it has begun.
        execution: the run itself, with its breakpoints, watches and statements.
    """

    def __init__(self, code: Code, cell: Cell, limits: Limits | None = None) -> None:
        """Load a program.

        Args:
            code: translated without errors against this cell.
            cell: arms, frames, servo period and deviation.
            limits: when the program is taken to run for ever.
        """
        self.code = code
        self.stop: Stop | None = None
        self.execution = Execution(code, cell, limits)
        self._active: RunToStop | None = None
        # Where a run backwards was begun, to return to when it is given up.
        self._origin: Position | None = None
        self._numbers = count(1)
        self._reported = 0

    # ---- going on --------------------------------------------------------------------------------------------------

    def begin(self, *, stop_on_entry: bool = True) -> None:
        """Let the run begin: it stops in front of the first statement, or where a breakpoint stops it."""
        self._active = self.execution.entry() if stop_on_entry else self.execution.forward()

    @property
    def running(self) -> bool:
        """Whether the run runs to the next stop."""
        return self._active is not None

    @property
    def over(self) -> bool:
        """Whether the program is over; it can only be taken back then."""
        return self.machine.state.over or (self.stop is not None and self.stop.over)

    def resume(self, command: Command, path: Path = ()) -> None:
        """Let the run go on; ``work`` does it.

        Args:
            command: how far.
            path: of the process that makes a step.

        Raises:
            DebuggerError: the run does not stand still, or the program is over.
        """
        self._standing()
        if self.over and command not in _BACK:
            raise DebuggerError("the program has ended")
        execution = self.execution
        self._origin = execution.position if command in _BACK else None
        match command:
            case "continue":
                self._active = execution.forward()
            case "tick":
                self._active = execution.forward(tick=True)
            case "next" | "in" | "out" | "stage":
                self._active = execution.forward(step_of(execution.machine, command, path))
            case "back":
                self._active = execution.back(path)
            case "tick back":
                self._active = execution.back_one_tick(path)
            case "reverse":
                self._active = execution.reverse()

    def work(self, seconds: float = math.inf) -> Stop | None:
        """Do what the run has to do up to the next stop.

        Args:
            seconds: give up after about so long [s]; the next call goes on.

        Returns:
            Why it stopped; None where it has not yet.
        """
        end = time.perf_counter() + seconds
        while self._active is not None:
            try:
                next(self._active)
            except StopIteration as done:
                self._arrive(done.value)
            else:
                if time.perf_counter() > end:
                    return None
        return self.stop

    def pause(self) -> Stop:
        """Stop the run where it is; a run backwards is given up."""
        if self._active is not None:
            self._active.close()
            if self._origin is not None:
                self.execution.land(self._origin, passed=True)
            self._arrive(Stop(reason="pause", path=self.execution.next_process))
        assert self.stop is not None  # noqa: S101 - it stands still
        return self.stop

    def _arrive(self, stop: Stop) -> None:
        self._active, self.stop = None, stop
        if self._origin is not None:
            # What was done again on a run backwards is no news.
            self._reported, self._origin = len(self.machine.state.effects), None
        self._reported = min(self._reported, len(self.machine.state.effects))

    def new_effects(self) -> list[Effect]:
        """Return what the program has done since this was last asked for."""
        if self._origin is not None:
            return []
        effects = self.machine.state.effects[self._reported :]
        self._reported += len(effects)
        return effects

    def log_messages(self) -> list[tuple[str, Breakpoint]]:
        """Return what breakpoints have logged since this was last asked for."""
        messages, self.execution.messages = self.execution.messages, []
        return messages

    def _standing(self) -> None:
        if self._active is not None or self.stop is None:
            raise DebuggerError("the program is running")

    # ---- breakpoints -----------------------------------------------------------------------------------------------

    def break_at(
        self, line: int, column: int | None = None, *, condition: str = "", hits: str = "", log: str = ""
    ) -> Breakpoint:
        """Stop the run at a line from now on.

        Args:
            line: from 1; where no statement begins in it, the next in which one does.
            column: from 1, to choose among the statements of a line.
            condition: an expression that must be true.
            hits: how often the statement must have been come to: ``3``, ``>= 3``, ``% 3``.
            log: say this instead of stopping; expressions in braces are worked out.

        Returns:
            The breakpoint; one without a ``start`` stops nothing, and its ``message`` says why.
        """
        start, message = self.execution.statements.find(line, column), "no statement begins on this line or below"
        if start is not None:
            try:
                self._check(condition, hits, self.execution.statements.procedure(start.index))
                message = ""
            except (ExpressionError, CountError) as error:
                start, message = None, str(error)
        number = next(self._numbers)
        result = Breakpoint(number=number, start=start, condition=condition, hits=hits, log=log, message=message)
        self.execution.breakpoints.append(result)
        return result

    def watch(self, slot: str, *, condition: str = "", hits: str = "") -> Watch:
        """Stop the run when a frame moves or a variable changes.

        Args:
            slot: where it is kept, as ``Variable.slot`` says.
            condition: an expression that must be true then.
            hits: how often it must have changed.

        Raises:
            ExpressionError: nothing is kept there, or the condition makes no sense.
            CountError: the count makes no sense.
        """
        kind = self.machine.type_of(slot)
        known = slot.partition("[")[0] in {*self.machine.state.types, *self.machine.state.tree}
        if kind.sizes or not known:
            raise ExpressionError(f"`{slot}` cannot be watched: it is not a frame, a variable or an element")
        self._check(condition, hits, None)
        result = Watch(number=next(self._numbers), slot=slot, condition=condition, hits=hits)
        self.execution.watches.append(result)
        return result

    def forget(self, number: int) -> bool:
        """Forget one breakpoint or watch; return whether there was one of that number."""
        execution = self.execution
        before = len(execution.breakpoints) + len(execution.watches)
        execution.breakpoints = [breakpoint_ for breakpoint_ in execution.breakpoints if breakpoint_.number != number]
        execution.watches = [watch for watch in execution.watches if watch.number != number]
        return len(execution.breakpoints) + len(execution.watches) < before

    def _check(self, text: str, hits: str, procedure: str | None) -> None:
        if hits:
            counts(hits, 1)
        if text:
            expressions.condition(text, self.machine, procedure)

    # ---- looking ---------------------------------------------------------------------------------------------------

    @property
    def machine(self) -> Machine:
        """The state of the program."""
        return self.execution.machine

    @property
    def view(self) -> Machine:
        """The machine as it is seen now, with the arms where they are on their path."""
        return self.execution.view

    @property
    def time(self) -> float:
        """The time on the clock of the cell [s]."""
        return self.view.state.ticks * self.view.cell.period

    @property
    def processes(self) -> list[Process]:
        """The processes of the program, in the order of the text."""
        return sorted(self.machine.state.processes, key=lambda process: process.path)

    def stack(self, path: Path = ()) -> list[Frame]:
        """Return where a process is, the innermost first.

        Raises:
            DebuggerError: there is no such process.
        """
        process = process_of(self.machine, path)
        if process is None:
            raise DebuggerError("this process has ended")
        return stack(self.machine, process, self.execution.statements)

    def scopes(self, path: Path = (), level: int = 0) -> list[Variable]:
        """Return what there is to see from one level of a stack.

        Raises:
            DebuggerError: there is no such process or level.
        """
        return variables.scopes(self.view, self._frame(path, level))

    def evaluate(self, text: str, path: Path = (), level: int = 0) -> Variable:
        """Return the value of an expression, as a level of a stack sees it.

        Args:
            text: an expression of the language; or ``frames`` for the tree of frames.
            path: of the process.
            level: of its stack.

        Raises:
            ExpressionError: it makes no sense, or has no value.
            DebuggerError: there is no such process or level.
        """
        frame, view = self._frame(path, level), self.view
        if text.strip().upper() == "FRAMES" and "FRAMES" not in names_at(view, frame.procedure):
            return Variable(name="frames", value="\n".join(variables.frames_text(view)))
        parsed = expressions.parse(text, view, frame.procedure)
        slot = expressions.slot_of(view, frame, parsed)
        if slot is not None:
            return attrs.evolve(variables.variable(view, slot, name=text), expression=text)
        kind = "" if parsed.sort is None else parsed.sort.word
        return variables.result(view, text, expressions.compute(view, frame, parsed), kind)

    def assign(self, slot: str, text: str, path: Path = (), level: int = 0) -> Variable:
        """Give a variable or a frame another value; the run goes on with it.

        Args:
            slot: where it is kept.
            text: an expression.
            path: of the process that sees the names in the expression.
            level: of its stack.

        Raises:
            ExpressionError: the expression has no such value, or nothing can be kept there.
            DebuggerError: the run does not stand still, or there is no such process or level.
        """
        self._standing()
        frame, view = self._frame(path, level), self.view
        kind = view.type_of(slot)
        if kind.sizes or kind.kind is VariableKind.EVENT or self.over:
            raise ExpressionError(f"`{view.spelled(slot)}` cannot be assigned a value here")
        moving = mover(view, slot) if kind.kind is VariableKind.FRAME else None
        if moving is not None and not is_arm(slot):
            raise ExpressionError(f"`{view.spelled(slot)}` is being moved; it can be assigned a pose after the MOVE")
        value = expressions.value_for(view, frame, text, kind.kind)

        def change(machine: Machine) -> None:
            assert not isinstance(value, Element)  # noqa: S101 - elements have been read
            if isinstance(value, np.ndarray) and kind.kind is VariableKind.FRAME:
                machine.place(process_of(machine, path) or machine.state.program, slot, value, frame.span)
            else:
                machine.state.values[slot] = value

        try:
            self.execution.timeline.change(change)
        except RunError as error:
            raise ExpressionError(str(error)) from None
        return variables.variable(self.view, slot)

    def _frame(self, path: Path, level: int) -> Frame:
        frames = self.stack(path)
        if not 0 <= level < len(frames):
            raise DebuggerError("this procedure has been left")
        return frames[level]
