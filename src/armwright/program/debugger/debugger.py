"""The debugger: a run that is stopped, looked at, changed, and taken a step further or back."""

import math
import time
from collections.abc import Sequence
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.cell.model import Cell
from armwright.errors import ArmwrightError
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger import variables
from armwright.program.debugger.breakpoints import Breakpoint, CountError, Watch, counts
from armwright.program.debugger.execution import Execution, Position, Way
from armwright.program.debugger.expressions import (
    ExpressionError,
    compute,
    condition,
    kept_name,
    names_at,
    parse,
    value_for,
)
from armwright.program.debugger.history import Path
from armwright.program.debugger.snapshot import Frame, mover, process_of, stack
from armwright.program.debugger.statements import Start
from armwright.program.debugger.step_rules import step_of
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import Shown
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_arm
from armwright.program.vm.interpreter import Limits, RunError
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Element, Process
from armwright.program.vm.recording import Effect, Recording

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
        self._going = Execution(code, cell, limits)
        self._way: Way | None = None
        # Where a run backwards was begun, to return to when it is given up.
        self._origin: Position | None = None
        self._numbers = 0
        self._told = 0

    # ---- going on --------------------------------------------------------------------------------------------------

    def begin(self, *, stop_on_entry: bool = True) -> None:
        """Let the run begin: it stops in front of the first statement, or where a breakpoint stops it."""
        self._way = self._going.entry() if stop_on_entry else self._going.forward()

    @property
    def running(self) -> bool:
        """Whether the run runs to the next stop."""
        return self._way is not None

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
            raise DebuggerError("the program is over")
        execution = self._going
        self._origin = execution.position if command in _BACK else None
        match command:
            case "continue":
                self._way = execution.forward()
            case "tick":
                self._way = execution.forward(tick=True)
            case "next" | "in" | "out" | "stage":
                self._way = execution.forward(step_of(execution.machine, command, path))
            case "back":
                self._way = execution.back(path)
            case "tick back":
                self._way = execution.back_one_tick(path)
            case "reverse":
                self._way = execution.reverse()

    def work(self, seconds: float = math.inf) -> Stop | None:
        """Do what the run has to do up to the next stop.

        Args:
            seconds: give up after about so long [s]; the next call goes on.

        Returns:
            Why it stopped; None where it has not yet.
        """
        end = time.perf_counter() + seconds
        while self._way is not None:
            try:
                next(self._way)
            except StopIteration as done:
                self._arrive(done.value)
            else:
                if time.perf_counter() > end:
                    return None
        return self.stop

    def run(self, command: Command, path: Path = ()) -> Stop:
        """Let the run go on to its next stop.

        Raises:
            DebuggerError: as ``resume`` does.
        """
        self.resume(command, path)
        stop = self.work()
        assert stop is not None  # noqa: S101 - it had all the time it needs
        return stop

    def pause(self) -> Stop:
        """Stop the run where it is; a run backwards is given up."""
        if self._way is not None:
            self._way.close()
            if self._origin is not None:
                self._going.land(self._origin, passed=True)
            process = self._going.timeline.ready
            self._arrive(Stop(reason="pause", path=() if process is None else process.path))
        assert self.stop is not None  # noqa: S101 - it stands still
        return self.stop

    def _arrive(self, stop: Stop) -> None:
        self._way, self.stop = None, stop
        if self._origin is not None:
            # What was done again on a run backwards is no news.
            self._told, self._origin = len(self.machine.state.effects), None
        self._told = min(self._told, len(self.machine.state.effects))

    def news(self) -> list[Effect]:
        """Return what the program has done since this was last asked for."""
        if self._origin is not None:
            return []
        effects = self.machine.state.effects[self._told :]
        self._told += len(effects)
        return effects

    def said(self) -> list[tuple[str, Breakpoint]]:
        """Return what breakpoints have said since this was last asked for."""
        logged, self._going.said = self._going.said, []
        return logged

    def recording(self) -> Recording:
        """Return all that has happened."""
        return self.machine.recording()

    def _standing(self) -> None:
        if self._way is not None or self.stop is None:
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
        start = self._going.statements.find(line, column)
        message = "" if start is not None else "no statement begins here or further down"
        if start is not None:
            try:
                self._check(condition, hits, self._going.statements.procedure(start.index))
            except (ExpressionError, CountError) as error:
                start, message = None, str(error)
        result = Breakpoint(
            number=self._number(), start=start, condition=condition, hits=hits, log=log, message=message
        )
        self._going.breakpoints.append(result)
        return result

    def watch(self, slot: str, *, condition: str = "", hits: str = "") -> Watch:
        """Stop the run when a frame moves or a variable changes.

        Args:
            slot: where it is kept, as ``Shown.kept`` says.
            condition: an expression that must be true then.
            hits: how often it must have changed.

        Raises:
            ExpressionError: nothing is kept there, or the condition makes no sense.
            CountError: the count makes no sense.
        """
        kind = self.machine.type_of(slot)
        known = slot.partition("[")[0] in {*self.machine.state.types, *self.machine.state.tree}
        if kind.sizes or not known:
            raise ExpressionError(f"`{slot}` cannot be watched: it is no frame, variable or element")
        self._check(condition, hits, None)
        result = Watch(number=self._number(), kept=slot, condition=condition, hits=hits)
        self._going.watches.append(result)
        return result

    def clear(self, *, breakpoints: bool = False, watches: bool = False) -> None:
        """Forget breakpoints at lines, or watches, or both."""
        if breakpoints:
            self._going.breakpoints.clear()
        if watches:
            self._going.watches.clear()

    def forget(self, number: int) -> bool:
        """Forget one breakpoint or watch; return whether there was one of that number."""
        execution = self._going
        before = len(execution.breakpoints) + len(execution.watches)
        execution.breakpoints = [breakpoint_ for breakpoint_ in execution.breakpoints if breakpoint_.number != number]
        execution.watches = [watch for watch in execution.watches if watch.number != number]
        return len(execution.breakpoints) + len(execution.watches) < before

    @property
    def breakpoints(self) -> Sequence[Breakpoint]:
        """The breakpoints at lines."""
        return self._going.breakpoints

    @property
    def watches(self) -> Sequence[Watch]:
        """What is watched."""
        return self._going.watches

    def catch(self, *, uncaught: bool, caught: bool) -> None:
        """Stop in front of errors: those that end the program, those after which it goes on in a RECOVER."""
        chosen = (("uncaught", uncaught), ("caught", caught))
        self._going.catches = frozenset(name for name, chosen_ in chosen if chosen_)

    def places(self, first: int, last: int) -> list[Start]:
        """Return the statements that begin in some lines."""
        return list(self._going.statements.between(first, last))

    def _number(self) -> int:
        self._numbers += 1
        return self._numbers

    def _check(self, text: str, hits: str, procedure: str | None) -> None:
        if hits:
            counts(hits, 1)
        if text:
            condition(text, names_at(self.machine, procedure), self.code)

    # ---- looking ---------------------------------------------------------------------------------------------------

    @property
    def machine(self) -> Machine:
        """The state of the program."""
        return self._going.machine

    @property
    def view(self) -> Machine:
        """The machine as it is seen now, with the arms where they are on their path."""
        return self._going.view

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
        return stack(self.machine, self._process(path), self._going.statements)

    def scopes(self, path: Path = (), level: int = 0) -> list[Shown]:
        """Return what there is to see from one level of a stack.

        Raises:
            DebuggerError: there is no such process or level.
        """
        view = self.view
        return variables.scopes(view, self._process(path), self._frame(path, level))

    def evaluate(self, text: str, path: Path = (), level: int = 0) -> Shown:
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
        types = names_at(view, frame.procedure)
        if text.strip().upper() == "FRAMES" and "FRAMES" not in types:
            return Shown(name="frames", value="\n".join(variables.frames_text(view)))
        parsed = parse(text, types, self.code)
        process = self._process(path)
        slot = kept_name(view, process, frame, parsed)
        if slot is not None:
            return attrs.evolve(variables.variable(view, slot, name=text), expression=text)
        kind = "" if parsed.sort is None else parsed.sort.word
        return variables.result(view, text, compute(view, process, frame, parsed), kind)

    def assign(self, slot: str, text: str, path: Path = (), level: int = 0) -> Shown:
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
            raise ExpressionError(f"`{view.spelled(slot)}` cannot be given a value here")
        moving = mover(view, slot) if kind.kind is VariableKind.FRAME else None
        if moving is not None and not is_arm(slot):
            raise ExpressionError(f"`{view.spelled(slot)}` is being moved; it can be placed when the MOVE is over")
        value = value_for(view, self._process(path), frame, text, kind.kind)

        def change(machine: Machine) -> None:
            assert not isinstance(value, Element)  # noqa: S101 - elements have been read
            if isinstance(value, np.ndarray) and kind.kind is VariableKind.FRAME:
                machine.place(process_of(machine, path) or machine.state.program, slot, value, frame.span)
            else:
                machine.state.values[slot] = value

        try:
            self._going.timeline.change(change)
        except RunError as error:
            raise ExpressionError(str(error)) from None
        return variables.variable(self.view, slot)

    def _process(self, path: Path) -> Process:
        process = process_of(self.machine, path)
        if process is None:
            raise DebuggerError("this process has ended")
        return process

    def _frame(self, path: Path, level: int) -> Frame:
        frames = self.stack(path)
        if not 0 <= level < len(frames):
            raise DebuggerError("this procedure has been left")
        return frames[level]
