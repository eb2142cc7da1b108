"""The debugger: a run that is stopped, looked at, changed, and taken a step further or back."""

import math
import time
from itertools import count
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.cell.hardware import DeviceError, HardwareFactory, SimulatedHardware
from armwright.cell.model import Cell
from armwright.errors import ArmwrightError
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger import expressions, variables
from armwright.program.debugger.breakpoints import Breakpoint, HitConditionError, Watch, matches_hit_count
from armwright.program.debugger.execution import Execution, RunPosition, RunToStop
from armwright.program.debugger.expressions import ExpressionError, visible_names
from armwright.program.debugger.history import ProcessPath
from armwright.program.debugger.snapshot import StackFrame, call_stack, find_process, moving_process
from armwright.program.debugger.step_rules import begin_step
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import Variable
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_arm
from armwright.program.language.units import MAX_NUMBER
from armwright.program.vm.machine import Limits, Machine, RunError
from armwright.program.vm.process import ElementReference, Process
from armwright.program.vm.recording import Effect

# To the next stop; to the next statement, over calls, into them, out of them; to the next stage of a MOVE; to the next
# servo tick; back to the statement before, the tick before, the breakpoint before.
Command: TypeAlias = Literal["continue", "next", "in", "out", "stage", "tick", "back", "tick back", "reverse"]
# A time this part of a tick before one is on it.
_ON_A_TICK = 1e-6
_BACKWARD_COMMANDS = frozenset(("back", "tick back", "reverse"))


class DebuggerError(ArmwrightError, RuntimeError):
    """What was asked for cannot be done where the run stands."""


class Debugger:
    """A program in a simulated cell, step by step.

    Attributes:
        stop: why the run is paused; None while it runs, and before it has begun.
        execution: the run itself, with its breakpoints, watches and statements.
    """

    def __init__(
        self, code: Code, cell: Cell, limits: Limits | None = None, hardware: HardwareFactory = kinematic_cell
    ) -> None:
        """Load a program.

        Args:
            code: translated without errors against this cell.
            cell: arms, frames, servo period and deviation.
            limits: when the program is taken to run for ever.
            hardware: how the cell is set up.
        """
        self.code = code
        self.stop: Stop | None = None
        self.execution = Execution(code, cell, limits, hardware)
        self._active: RunToStop | None = None
        # Where a run backwards was begun, to return to when it is given up.
        self._origin: RunPosition | None = None
        self._numbers = count(1)
        self._reported_count = 0

    # ---- going on --------------------------------------------------------------------------------------------------

    def begin(self, *, stop_on_entry: bool = True) -> None:
        """Let the run begin: it stops in front of the first statement, or where a breakpoint stops it."""
        self._active = self.execution.stop_on_entry() if stop_on_entry else self.execution.run_forward()

    @property
    def running(self) -> bool:
        """Whether the run runs to the next stop."""
        return self._active is not None

    @property
    def has_ended(self) -> bool:
        """Whether the program is over; it can only be taken back then."""
        return self.machine.state.has_ended or (self.stop is not None and self.stop.has_ended)

    def resume(self, command: Command, path: ProcessPath = ()) -> None:
        """Let the run go on; ``work`` does it.

        Args:
            command: how far.
            path: of the process that makes a step.

        Raises:
            DebuggerError: the run does not stand still, or the program is over.
        """
        self._require_stopped()
        if self.has_ended and command not in _BACKWARD_COMMANDS:
            raise DebuggerError("the program has ended")
        execution = self.execution
        self._origin = execution.position if command in _BACKWARD_COMMANDS else None
        match command:
            case "continue":
                self._active = execution.run_forward()
            case "tick":
                self._active = execution.run_forward(tick=True)
            case "next" | "in" | "out" | "stage":
                self._active = execution.run_forward(begin_step(execution.machine, command, path))
            case "back":
                self._active = execution.step_back(path)
            case "tick back":
                self._active = execution.step_back_tick(path)
            case "reverse":
                self._active = execution.reverse_to_breakpoint()

    def rewind(self, time: float) -> None:
        """Let the run go back to a time [s] that it has been at, or a tick before; ``run_slice`` does it.

        Raises:
            DebuggerError: the run does not stand still.
        """
        self._require_stopped()
        self._origin = self.execution.position
        tick = math.floor(time / self.machine.cell.period + _ON_A_TICK)
        self._active = self.execution.go_to_tick(tick)

    def run_slice(self, seconds: float = math.inf) -> Stop | None:
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
                self._record_stop(done.value)
            else:
                if time.perf_counter() > end:
                    return None
        return self.stop

    def pause(self) -> Stop:
        """Stop the run where it is; a run backwards is given up."""
        if self._active is not None:
            self._active.close()
            if self._origin is not None:
                self.execution.go_to(self._origin, passed=True)
            self._record_stop(Stop(reason="pause", path=self.execution.next_process))
        assert self.stop is not None  # noqa: S101 - it stands still
        return self.stop

    def _record_stop(self, stop: Stop) -> None:
        self._active, self.stop = None, stop
        if self._origin is not None:
            # What was done again on a run backwards is no news.
            self._reported_count, self._origin = len(self.machine.state.effects), None
        self._reported_count = min(self._reported_count, len(self.machine.state.effects))

    def take_effects(self) -> list[Effect]:
        """Return what the program has done since this was last asked for."""
        if self._origin is not None:
            return []
        effects = self.machine.state.effects[self._reported_count :]
        self._reported_count += len(effects)
        return effects

    def take_log_messages(self) -> list[tuple[str, Breakpoint]]:
        """Return what breakpoints have logged since this was last asked for."""
        messages, self.execution.log_messages = self.execution.log_messages, []
        return messages

    def _require_stopped(self) -> None:
        if self._active is not None or self.stop is None:
            raise DebuggerError("the program is running")

    # ---- breakpoints -----------------------------------------------------------------------------------------------

    def add_breakpoint(
        self,
        line: int,
        column: int | None = None,
        *,
        file: int = 0,
        condition: str = "",
        hit_condition: str = "",
        log_message: str = "",
    ) -> Breakpoint:
        """Stop the run at a line from now on.

        Args:
            line: from 1; where no statement begins in it, the next in which one does.
            column: from 1, to choose among the statements of a line.
            file: of the line: 0 for the program itself, 1 for its first module.
            condition: an expression that must be true.
            hit_condition: how often the statement must have been come to: ``3``, ``>= 3``, ``% 3``.
            log_message: say this instead of stopping; expressions in braces are worked out.

        Returns:
            The breakpoint; one without a ``start`` stops nothing, and its ``message`` says why.
        """
        start = self.execution.statements.find(line, column, file) if line >= 1 else None
        message = "no statement begins on this line or below" if line >= 1 else f"lines are numbered from 1, got {line}"
        if start is not None:
            try:
                self._check(condition, hit_condition, self.execution.statements.procedure_at(start.index))
                message = ""
            except (ExpressionError, HitConditionError) as error:
                start, message = None, str(error)
        number, conditions = next(self._numbers), {"condition": condition, "hit_condition": hit_condition}
        result = Breakpoint(number=number, start=start, **conditions, log_message=log_message, message=message)
        self.execution.breakpoints.append(result)
        return result

    def add_watch(self, slot: str, *, condition: str = "", hit_condition: str = "") -> Watch:
        """Stop the run when a frame moves or a variable changes.

        Args:
            slot: where it is kept, as ``Variable.slot`` says.
            condition: an expression that must be true then.
            hit_condition: how often it must have changed.

        Raises:
            ExpressionError: nothing is kept there, or the condition makes no sense.
            HitConditionError: the count makes no sense.
        """
        kind = self.machine.type_of(slot)
        known = slot.partition("[")[0] in {*self.machine.state.types, *self.machine.state.tree}
        if kind.sizes or not known:
            raise ExpressionError(f"`{slot}` cannot be watched: it is not a frame, a variable or an element")
        self._check(condition, hit_condition, None)
        result = Watch(number=next(self._numbers), slot=slot, condition=condition, hit_condition=hit_condition)
        self.execution.watches.append(result)
        return result

    def remove_breakpoint(self, number: int) -> bool:
        """Forget one breakpoint or watch; return whether there was one of that number."""
        execution = self.execution
        before = len(execution.breakpoints) + len(execution.watches)
        execution.breakpoints = [breakpoint_ for breakpoint_ in execution.breakpoints if breakpoint_.number != number]
        execution.watches = [watch for watch in execution.watches if watch.number != number]
        return len(execution.breakpoints) + len(execution.watches) < before

    def _check(self, text: str, hits: str, procedure: str | None) -> None:
        if hits:
            matches_hit_count(hits, 1)
        if text:
            expressions.parse_condition(text, self.machine, procedure)

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
        return self.view.now

    @property
    def processes(self) -> list[Process]:
        """The processes of the program, in the order of the text."""
        return sorted(self.machine.state.processes, key=lambda process: process.path)

    def stack(self, path: ProcessPath = ()) -> list[StackFrame]:
        """Return where a process is, the innermost first.

        Raises:
            DebuggerError: there is no such process.
        """
        process = find_process(self.machine, path)
        if process is None:
            raise DebuggerError("this process has ended")
        return call_stack(self.machine, process, self.execution.statements)

    def scopes(self, path: ProcessPath = (), level: int = 0) -> list[Variable]:
        """Return what there is to see from one level of a stack.

        Raises:
            DebuggerError: there is no such process or level.
        """
        return variables.scopes(self.view, self._frame(path, level))

    def evaluate(self, text: str, path: ProcessPath = (), level: int = 0) -> Variable:
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
        if text.strip().upper() == "FRAMES" and "FRAMES" not in visible_names(view, frame.procedure):
            return Variable(name="frames", value="\n".join(variables.frame_tree_lines(view)))
        parsed = expressions.parse_expression(text, view, frame.procedure)
        if parsed.record:
            slots = expressions.find_field_slots(view, frame, parsed)
            return variables.record_variable(view, text, parsed.record, slots)
        slot = expressions.find_slot(view, frame, parsed)
        if slot is not None:
            return attrs.evolve(variables.make_variable(view, slot, name=text), expression=text)
        kind = "" if parsed.type is None else parsed.type.value.split(" ", 1)[1]
        return variables.value_variable(view, text, expressions.evaluate(view, frame, parsed), kind)

    def assign(self, slot: str, text: str, path: ProcessPath = (), level: int = 0) -> Variable:
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
        self._require_stopped()
        frame, view = self._frame(path, level), self.view
        kind = view.type_of(slot)
        if kind.sizes or kind.kind is VariableKind.EVENT or self.has_ended:
            raise ExpressionError(f"`{view.spelling(slot)}` cannot be assigned a value here")
        moving = moving_process(view, slot) if kind.kind is VariableKind.FRAME else None
        if moving is not None and not is_arm(slot):
            raise ExpressionError(f"`{view.spelling(slot)}` is being moved; it can be assigned a pose after the MOVE")
        value = expressions.evaluate_as(view, frame, text, kind.kind)
        if isinstance(value, float) and abs(value) > MAX_NUMBER:
            raise ExpressionError(f"`{text}` exceeds {MAX_NUMBER:g}, the largest number")

        def change(machine: Machine) -> None:
            assert not isinstance(value, ElementReference)  # noqa: S101 - elements have been read
            if isinstance(value, np.ndarray) and kind.kind is VariableKind.FRAME:
                machine.set_pose(find_process(machine, path) or machine.state.program, slot, value, frame.span)
            else:
                machine.state.values[slot] = value

        try:
            self.execution.timeline.apply_change(change)
        except RunError as error:
            raise ExpressionError(str(error)) from None
        return variables.make_variable(self.view, slot)

    def set_input(self, name: str, value: float) -> None:
        """Set an input of the cell by hand, from now on; a run that is gone back in remembers it.

        Args:
            name: of the input, in any case.
            value: 0 or 1, or the number of an analogue input.

        Raises:
            DebuggerError: the run does not stand still, the cell has no such input, or it cannot be set so.
        """
        self._require_stopped()
        # The program may have done its latest step before the time that is shown.
        now = self.time

        def change(machine: Machine) -> None:
            assert isinstance(machine.hardware, SimulatedHardware)  # noqa: S101 - the debugger runs no others
            machine.hardware.set_input(name.upper(), value, now)

        try:
            self.execution.timeline.apply_change(change)
        except DeviceError as error:
            raise DebuggerError(str(error)) from None

    def _frame(self, path: ProcessPath, level: int) -> StackFrame:
        frames = self.stack(path)
        if not 0 <= level < len(frames):
            raise DebuggerError("this procedure has been left")
        return frames[level]
