"""How a run goes from one stop to the next, forwards and back, in slices that leave room for other things."""

import re
from collections.abc import Generator
from typing import TypeAlias

import attrs

from armwright.cell.hardware import HardwareFactory
from armwright.cell.model import Cell
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger.breakpoints import Breakpoint, Watch, matches_hit_count
from armwright.program.debugger.expressions import (
    CheckedExpression,
    ExpressionError,
    evaluate,
    find_field_slots,
    parse_expression,
)
from armwright.program.debugger.history import ProcessPath, Timeline
from armwright.program.debugger.snapshot import call_stack, find_process, moving_process, view_at
from armwright.program.debugger.statements import Statements
from armwright.program.debugger.step_rules import Step
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import record_variable, value_variable
from armwright.program.vm.machine import Limits, Machine, RunError
from armwright.program.vm.process import Process

# A run to the next stop; it can be given up whenever it yields.
RunToStop: TypeAlias = Generator[None, None, Stop]
# A moment of a run: the steps done, and the servo tick.
RunPosition: TypeAlias = tuple[int, int]

_IN_BRACES = re.compile(r"\{([^{}]*)\}")


class Execution:
    """A run between its stops.

    Attributes:
        timeline: the run.
        statements: of the program.
        tick: the servo tick that is shown; the machine itself only knows those at which something is done.
        breakpoints: lines at which it stops.
        watches: frames and variables at whose change it stops.
        exception_filters: what errors it stops at: ``uncaught`` ones, and ``caught`` ones.
        log_messages: of breakpoints that log instead of stopping.
    """

    def __init__(self, code: Code, cell: Cell, limits: Limits | None, hardware: HardwareFactory) -> None:
        """Stand in front of the first statement."""
        self.timeline = Timeline(code, cell, limits, hardware)
        self.statements = Statements(code)
        self.tick = 0
        self.breakpoints: list[Breakpoint] = []
        self.watches: list[Watch] = []
        self.exception_filters = frozenset({"uncaught"})
        self.log_messages: list[tuple[str, Breakpoint]] = []
        # After so many steps it was stopped in front of a statement, or of an error, and now goes past it.
        self._passed_step = self._error_step = -1
        self._silent = False
        self._conditions: dict[tuple[str, str | None], CheckedExpression] = {}

    @property
    def machine(self) -> Machine:
        """The state of the program."""
        return self.timeline.machine

    @property
    def position(self) -> RunPosition:
        """Where the run has come to."""
        return self.timeline.step_count, self.tick

    @property
    def view(self) -> Machine:
        """The machine as it is seen now."""
        return view_at(self.machine, max(self.tick, self.machine.state.ticks))

    def go_to(self, position: RunPosition, *, passed: bool = True, reported: frozenset[int] = frozenset()) -> None:
        """Come to a moment that the run has been at.

        Args:
            position: the moment.
            passed: whether it is in front of a statement at which the run now stands.
            reported: numbers of the watches that have spoken of the motion of this moment.
        """
        step_count, self.tick = position
        self._silent = False
        self.timeline.seek(step_count)
        self._passed_step, self._error_step = step_count if passed else -1, -1
        self._start_watches(reported)

    def _start_watches(self, reported: frozenset[int]) -> None:
        view = self.view if self.watches else self.machine
        for watch in self.watches:
            watch.reset(view, reported=watch.number in reported)

    # ---- forwards --------------------------------------------------------------------------------------------------

    def stop_on_entry(self) -> RunToStop:
        """Stop in front of the first statement."""
        yield
        self._passed_step = 0
        return Stop(reason="entry")

    def run_forward(
        self, step: Step | None = None, *, tick: bool = False, until: RunPosition | None = None
    ) -> RunToStop:
        """Go on to the next stop.

        Args:
            step: that ends the path, if no breakpoint does.
            tick: whether the next servo tick ends it.
            until: no farther than to this moment, which is no stop.
        """
        self._start_watches(frozenset(watch.number for watch in self.watches if watch.reported_motion is not None))
        while until is None or self.position < until:
            yield
            process = self.timeline.next_process
            if process is not None:
                stop = yield from self._advance_clock(process.due_tick or 0, until, tick=tick)
                if stop is not None:
                    return stop
                if until is not None and self.position >= until:
                    break
                if self.timeline.step_count != self._passed_step and self.timeline.begins_statement(process):
                    stop = self._stop_at_statement(process, step)
                    if stop is not None:
                        self._passed_step = self.timeline.step_count
                        return stop
            stop = self._execute_step(process, step)
            if stop is not None:
                return stop
        return Stop(reason="pause")

    def _advance_clock(self, wake: int, until: RunPosition | None, *, tick: bool) -> Generator[None, None, Stop | None]:
        """Let the time go by until a process has something to do."""
        while self.tick < wake and (until is None or self.position < until):
            if tick or any(watch.is_moved(self.machine) for watch in self.watches):
                self.tick += 1
                stop = self._stop_at_change(None)
                if stop is not None or tick:
                    return stop or Stop(reason="step", path=self.next_process)
                yield
            else:
                last = wake if until is None or until[0] > self.timeline.step_count else min(wake, until[1])
                self.tick = max(self.tick, last)
        return None

    @property
    def next_process(self) -> ProcessPath:
        """The process that comes next."""
        process = self.timeline.next_process
        return () if process is None else process.path

    def _stop_at_statement(self, process: Process, step: Step | None) -> Stop | None:
        """Return why the run stops in front of a statement; None where it does not."""
        numbers, text = [], ""
        for breakpoint_ in self.breakpoints:
            if breakpoint_.start is None or breakpoint_.start.index != process.pc:
                continue
            try:
                is_due = self._is_triggered(breakpoint_, self.timeline.progress.visits.get(process.pc, 0) + 1, process)
            except ExpressionError as error:
                is_due, text = True, f"the condition of this breakpoint has no value: {error}"
            if is_due and breakpoint_.log_message and not text:
                self._log(breakpoint_, process)
            elif is_due:
                numbers.append(breakpoint_.number)
        if numbers:
            return Stop(reason="breakpoint", path=process.path, breakpoint_numbers=tuple(numbers), text=text)
        return Stop(reason="step", path=process.path) if step is not None and step.ends_at(process) else None

    def _is_triggered(self, point: Breakpoint | Watch, hits: int, process: Process) -> bool:
        """Whether a breakpoint that is reached for that time, or a watch, has its count and its condition."""
        if point.hit_condition and not matches_hit_count(point.hit_condition, hits):
            return False
        return not point.condition or self._condition_holds(point.condition, process)

    def _condition_holds(self, condition: str, process: Process) -> bool:
        view = self.view
        frame = call_stack(view, process, self.statements)[0]
        key = condition, frame.procedure
        if key not in self._conditions:
            self._conditions[key] = parse_expression(condition, view, frame.procedure)
        return bool(evaluate(view, frame, self._conditions[key]))

    def _log(self, breakpoint_: Breakpoint, process: Process) -> None:
        if self._silent:
            return
        view = self.view
        frame = call_stack(view, process, self.statements)[0]

        def value(match: re.Match[str]) -> str:
            try:
                parsed = parse_expression(match[1], view, frame.procedure)
                if parsed.record:
                    slots = find_field_slots(view, frame, parsed)
                    return record_variable(view, match[1], parsed.record, slots).value
                if parsed.type is None:
                    return match[1]
                return value_variable(view, "", evaluate(view, frame, parsed), "").value
            except ExpressionError as error:
                return f"({error})"

        self.log_messages.append((_IN_BRACES.sub(value, breakpoint_.log_message), breakpoint_))

    def _execute_step(self, process: Process | None, step: Step | None) -> Stop | None:
        """Do one step of the program; return why the run stops with it."""
        timeline, machine = self.timeline, self.machine
        step_count, effects = timeline.step_count, len(machine.state.effects)
        path = () if process is None else process.path
        try:
            timeline.advance()
        except RunError as error:
            stop = Stop(reason="exception", text=str(error), diagnostic=error.diagnostic)
            if self._error_step == step_count or "uncaught" not in self.exception_filters:
                self.tick = max(self.tick, machine.state.ticks)
                return attrs.evolve(stop, reason="failed", path=path, recording=error.recording)
            return self._stop_before_error(step_count, path, stop)
        if "caught" in self.exception_filters and self._error_step != step_count:
            caught = next((effect for effect in machine.state.effects[effects:] if effect.kind == "ERROR"), None)
            if caught is not None:
                stop = Stop(reason="exception", text=caught.text, caught=True)
                return self._stop_before_error(step_count, path, stop)
        self.tick = max(self.tick, machine.state.ticks)
        if machine.state.has_ended:
            return Stop(reason="end", path=path)
        changed = self._stop_at_change(path)
        reason = None if step is None else step.record_step(machine, path)
        if changed is not None or reason is None:
            return changed
        assert step is not None  # noqa: S101 - it has ended
        return Stop(reason="step", path=step.path, text=reason)

    def _stop_before_error(self, step_count: int, path: ProcessPath, stop: Stop) -> Stop:
        """Go back to in front of the step that went wrong, so that everything can be looked at as it was then."""
        self.timeline.seek(step_count)
        self._error_step = step_count
        if self.timeline.next_process is None:
            path = self.machine.state.blocked_processes[0].path
        return attrs.evolve(stop, path=path)

    def _stop_at_change(self, path: ProcessPath | None) -> Stop | None:
        """Return the stop of the frames and variables that have changed; None where none has."""
        if not self.watches:
            return None
        # With all arms at rest the table is what one sees.
        view = self.view if any(moving_process(self.machine, watch.slot) for watch in self.watches) else self.machine
        texts, numbers = [], []
        for watch in self.watches:
            text = watch.check_change(view)
            if text is None or not self._is_stopped_by(watch):
                continue
            moving = moving_process(view, watch.slot)
            path = moving.path if path is None and moving is not None else path
            texts.append(text)
            numbers.append(watch.number)
        if not numbers:
            return None
        process = find_process(self.machine, path) if path is not None else None
        shown_path = self.next_process if process is None or path is None else path
        return Stop(reason="data breakpoint", path=shown_path, text="; ".join(texts), breakpoint_numbers=tuple(numbers))

    def _is_stopped_by(self, watch: Watch) -> bool:
        try:
            return self._is_triggered(watch, watch.changes, self.timeline.next_process or self.machine.state.program)
        except ExpressionError:
            return True

    # ---- back ------------------------------------------------------------------------------------------------------

    def step_back(self, path: ProcessPath) -> RunToStop:
        """Go back to the statement that a process began last, at the same level or further out."""
        current = find_process(self.machine, path)
        depth = 0 if current is None else len(current.stack)
        limit = self.timeline.step_count
        for step_count in self.timeline.snapshots_before(limit):
            self.timeline.seek(step_count)
            nearest: tuple[RunPosition, ProcessPath] | None = None
            while self.timeline.step_count < limit:
                yield
                process = self.timeline.next_process
                if process is not None and self.timeline.begins_statement(process):
                    is_own = process.path == path and (len(process.stack) <= depth or current is None)
                    # A branch comes out of the process that began it.
                    if is_own or (len(process.path) < len(path) and path[: len(process.path)] == process.path):
                        due = max(process.due_tick or 0, self.machine.state.ticks)
                        nearest = (self.timeline.step_count, due), process.path
                self.timeline.advance()
            if nearest is not None:
                return self._stop_at(nearest[0], Stop(reason="step", path=nearest[1]))
            limit = step_count
        return self._stop_at((0, 0), Stop(reason="start"))

    def step_back_tick(self, path: ProcessPath) -> RunToStop:
        """Go back to the servo tick before, as it was when the time had come to it."""
        if self.tick < 1:
            return self._stop_at((0, 0), Stop(reason="start"))
        return (yield from self.go_to_tick(self.tick - 1, Stop(reason="step", path=path)))

    def go_to_tick(self, tick: int, stop: Stop | None = None) -> RunToStop:
        """Go back to a servo tick, as it was when the time had come to it; give the stop there, a pause by default."""
        limit = self.timeline.step_count
        for step_count in self.timeline.snapshots_before(limit + 1):
            self.timeline.seek(step_count)
            if not step_count or self.machine.state.ticks < tick:
                break
        while (
            self.timeline.step_count < limit
            and (process := self.timeline.next_process)
            and (process.due_tick or 0) < tick
        ):
            self.timeline.advance()
            yield
        stop = stop or Stop(reason="pause", path=self.next_process)
        return self._stop_at((self.timeline.step_count, tick), stop, passed=False)

    def reverse_to_breakpoint(self) -> RunToStop:
        """Go back to the last moment at which a breakpoint stops the run, or else to the start."""
        limit = self.position
        for step_count in self.timeline.snapshots_before(max(limit[0], 1)):
            self.go_to((step_count, 0), passed=False)
            self.tick, self._silent = self.machine.state.ticks, True
            start, nearest = self.position, None
            while self.position < limit:
                stop = yield from self.run_forward(until=limit)
                if self.position < limit:
                    nearest = self.position, stop
            if nearest is not None:
                return self._stop_at(nearest[0], nearest[1], passed=nearest[1].reason != "data breakpoint")
            limit = start
        return self._stop_at((0, 0), Stop(reason="start"))

    def _stop_at(self, position: RunPosition, stop: Stop, *, passed: bool = True) -> Stop:
        self.go_to(position, passed=passed, reported=frozenset(stop.breakpoint_numbers))
        self.timeline.discard_later()
        return stop
