"""How a run goes from one stop to the next, forwards and back, in slices that leave room for other things."""

import re
from collections.abc import Generator
from typing import TypeAlias

import attrs

from armwright.cell.model import Cell
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger.breakpoints import Breakpoint, Watch, counts
from armwright.program.debugger.expressions import ExpressionError, Parsed, compute, parse
from armwright.program.debugger.history import Path, Timeline
from armwright.program.debugger.snapshot import mover, process_of, sampled, stack
from armwright.program.debugger.statements import Statements
from armwright.program.debugger.step_rules import Step
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import result
from armwright.program.vm.interpreter import Limits, RunError
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Process

# A run to the next stop; it can be given up whenever it yields.
RunToStop: TypeAlias = Generator[None, None, Stop]
# A moment of a run: the steps done, and the servo tick.
Position: TypeAlias = tuple[int, int]

_IN_BRACES = re.compile(r"\{([^{}]*)\}")


class Execution:
    """A run between its stops.

    Attributes:
        timeline: the run.
        statements: of the program.
        ticks: the servo tick that is shown; the machine itself only knows those at which something is done.
        breakpoints: lines at which it stops.
        watches: frames and variables at whose change it stops.
        catches: what errors it stops at: ``uncaught`` ones, and ``caught`` ones.
        messages: of breakpoints that log instead of stopping.
    """

    def __init__(self, code: Code, cell: Cell, limits: Limits | None) -> None:
        """Stand in front of the first statement."""
        self.timeline = Timeline(code, cell, limits)
        self.statements = Statements(code)
        self.ticks = 0
        self.breakpoints: list[Breakpoint] = []
        self.watches: list[Watch] = []
        self.catches = frozenset({"uncaught"})
        self.messages: list[tuple[str, Breakpoint]] = []
        # After so many steps it was stopped in front of a statement, or of an error, and now goes past it.
        self._passed = self._raised = -1
        self._silent = False
        self._conditions: dict[tuple[str, str | None], Parsed] = {}

    @property
    def machine(self) -> Machine:
        """The state of the program."""
        return self.timeline.machine

    @property
    def position(self) -> Position:
        """Where the run has come to."""
        return self.timeline.done, self.ticks

    @property
    def view(self) -> Machine:
        """The machine as it is seen now."""
        return sampled(self.machine, max(self.ticks, self.machine.state.ticks))

    def land(self, position: Position, *, passed: bool = True, reported: frozenset[int] = frozenset()) -> None:
        """Come to a moment that the run has been at.

        Args:
            position: the moment.
            passed: whether it is in front of a statement at which the run now stands.
            reported: numbers of the watches that have spoken of the motion of this moment.
        """
        done, self.ticks = position
        self._silent = False
        self.timeline.seek(done)
        self._passed, self._raised = done if passed else -1, -1
        self._start_watches(reported)

    def _start_watches(self, reported: frozenset[int]) -> None:
        view = self.view if self.watches else self.machine
        for watch in self.watches:
            watch.start(view, reported=watch.number in reported)

    # ---- forwards --------------------------------------------------------------------------------------------------

    def entry(self) -> RunToStop:
        """Stop in front of the first statement."""
        yield
        self._passed = 0
        return Stop(reason="entry")

    def forward(self, step: Step | None = None, *, tick: bool = False, until: Position | None = None) -> RunToStop:
        """Go on to the next stop.

        Args:
            step: that ends the path, if no breakpoint does.
            tick: whether the next servo tick ends it.
            until: no farther than to this moment, which is no stop.
        """
        self._start_watches(frozenset(watch.number for watch in self.watches if watch.reported is not None))
        while until is None or self.position < until:
            yield
            process = self.timeline.ready
            if process is not None:
                stop = yield from self._wait(process.due or 0, until, tick=tick)
                if stop is not None:
                    return stop
                if until is not None and self.position >= until:
                    break
                if self.timeline.done != self._passed and self.timeline.arrives(process):
                    stop = self._arrived(process, step)
                    if stop is not None:
                        self._passed = self.timeline.done
                        return stop
            stop = self._advance(process, step)
            if stop is not None:
                return stop
        return Stop(reason="pause")

    def _wait(self, wake: int, until: Position | None, *, tick: bool) -> Generator[None, None, Stop | None]:
        """Let the time go by until a process has something to do."""
        while self.ticks < wake and (until is None or self.position < until):
            if tick or any(watch.is_moved(self.machine) for watch in self.watches):
                self.ticks += 1
                stop = self._changed(None)
                if stop is not None or tick:
                    return stop or Stop(reason="step", path=self.next_process)
                yield
            else:
                last = wake if until is None or until[0] > self.timeline.done else min(wake, until[1])
                self.ticks = max(self.ticks, last)
        return None

    @property
    def next_process(self) -> Path:
        """The process that comes next."""
        process = self.timeline.ready
        return () if process is None else process.path

    def _arrived(self, process: Process, step: Step | None) -> Stop | None:
        """Return why the run stops in front of a statement; None where it does not."""
        numbers, text = [], ""
        for breakpoint_ in self.breakpoints:
            if breakpoint_.start is None or breakpoint_.start.index != process.at:
                continue
            try:
                is_due = self._applies(breakpoint_, self.timeline.marks.visits.get(process.at, 0) + 1, process)
            except ExpressionError as error:
                is_due, text = True, f"the condition of this breakpoint has no value: {error}"
            if is_due and breakpoint_.log and not text:
                self._log(breakpoint_, process)
            elif is_due:
                numbers.append(breakpoint_.number)
        if numbers:
            return Stop(reason="breakpoint", path=process.path, numbers=tuple(numbers), text=text)
        return Stop(reason="step", path=process.path) if step is not None and step.ends(process) else None

    def _applies(self, point: Breakpoint | Watch, hits: int, process: Process) -> bool:
        """Whether a breakpoint that is reached for that time, or a watch, has its count and its condition."""
        if point.hits and not counts(point.hits, hits):
            return False
        return not point.condition or self._holds(point.condition, process)

    def _holds(self, condition: str, process: Process) -> bool:
        view = self.view
        frame = stack(view, process, self.statements)[0]
        key = condition, frame.procedure
        if key not in self._conditions:
            self._conditions[key] = parse(condition, view, frame.procedure)
        return bool(compute(view, frame, self._conditions[key]))

    def _log(self, breakpoint_: Breakpoint, process: Process) -> None:
        if self._silent:
            return
        view = self.view
        frame = stack(view, process, self.statements)[0]

        def value(match: re.Match[str]) -> str:
            try:
                parsed = parse(match[1], view, frame.procedure)
                return match[1] if parsed.sort is None else result(view, "", compute(view, frame, parsed), "").value
            except ExpressionError as error:
                return f"({error})"

        self.messages.append((_IN_BRACES.sub(value, breakpoint_.log), breakpoint_))

    def _advance(self, process: Process | None, step: Step | None) -> Stop | None:
        """Do one step of the program; return why the run stops with it."""
        timeline, machine = self.timeline, self.machine
        done, effects = timeline.done, len(machine.state.effects)
        path = () if process is None else process.path
        try:
            timeline.advance()
        except RunError as error:
            stop = Stop(reason="exception", text=str(error), diagnostic=error.diagnostic)
            if self._raised == done or "uncaught" not in self.catches:
                self.ticks = max(self.ticks, machine.state.ticks)
                return attrs.evolve(stop, reason="failed", path=path, recording=error.recording)
            return self._before_error(done, path, stop)
        if "caught" in self.catches and self._raised != done:
            caught = next((effect for effect in machine.state.effects[effects:] if effect.kind == "ERROR"), None)
            if caught is not None:
                return self._before_error(done, path, Stop(reason="exception", text=caught.text, caught=True))
        self.ticks = max(self.ticks, machine.state.ticks)
        if machine.state.over:
            return Stop(reason="end", path=path)
        changed = self._changed(path)
        reason = None if step is None else step.took(machine, path)
        if changed is not None or reason is None:
            return changed
        assert step is not None  # noqa: S101 - it has ended
        return Stop(reason="step", path=step.path, text=reason)

    def _before_error(self, done: int, path: Path, stop: Stop) -> Stop:
        """Go back to in front of the step that went wrong, so that everything can be looked at as it was then."""
        self.timeline.seek(done)
        self._raised = done
        if self.timeline.ready is None:
            path = self.machine.state.stuck[0].path
        return attrs.evolve(stop, path=path)

    def _changed(self, path: Path | None) -> Stop | None:
        """Return the stop of the frames and variables that have changed; None where none has."""
        if not self.watches:
            return None
        # With all arms at rest the table is what one sees.
        view = self.view if any(mover(self.machine, watch.slot) for watch in self.watches) else self.machine
        texts, numbers = [], []
        for watch in self.watches:
            text = watch.update(view)
            if text is None or not self._stops_for(watch):
                continue
            moving = mover(view, watch.slot)
            path = moving.path if path is None and moving is not None else path
            texts.append(text)
            numbers.append(watch.number)
        if not numbers:
            return None
        present = process_of(self.machine, path) if path is not None else None
        shown = self.next_process if present is None or path is None else path
        return Stop(reason="data breakpoint", path=shown, text="; ".join(texts), numbers=tuple(numbers))

    def _stops_for(self, watch: Watch) -> bool:
        try:
            return self._applies(watch, watch.changes, self.timeline.ready or self.machine.state.program)
        except ExpressionError:
            return True

    # ---- back ------------------------------------------------------------------------------------------------------

    def back(self, path: Path) -> RunToStop:
        """Go back to the statement that a process began last, at the same level or further out."""
        now = process_of(self.machine, path)
        depth = 0 if now is None else len(now.stack)
        limit = self.timeline.done
        for done in self.timeline.moments_before(limit):
            self.timeline.seek(done)
            nearest: tuple[Position, Path] | None = None
            while self.timeline.done < limit:
                yield
                process = self.timeline.ready
                if process is not None and self.timeline.arrives(process):
                    own = process.path == path and (len(process.stack) <= depth or now is None)
                    # A branch comes out of the process that began it.
                    if own or (len(process.path) < len(path) and path[: len(process.path)] == process.path):
                        due = max(process.due or 0, self.machine.state.ticks)
                        nearest = (self.timeline.done, due), process.path
                self.timeline.advance()
            if nearest is not None:
                return self._landed(nearest[0], Stop(reason="step", path=nearest[1]))
            limit = done
        return self._landed((0, 0), Stop(reason="start"))

    def back_one_tick(self, path: Path) -> RunToStop:
        """Go back to the servo tick before, as it was when the time had come to it."""
        tick = self.ticks - 1
        if tick < 0:
            return self._landed((0, 0), Stop(reason="start"))
        limit = self.timeline.done
        for done in self.timeline.moments_before(limit + 1):
            self.timeline.seek(done)
            if not done or self.machine.state.ticks < tick:
                break
        while self.timeline.done < limit and (process := self.timeline.ready) and (process.due or 0) < tick:
            self.timeline.advance()
            yield
        return self._landed((self.timeline.done, tick), Stop(reason="step", path=path), passed=False)

    def reverse(self) -> RunToStop:
        """Go back to the last moment at which a breakpoint stops the run, or else to the start."""
        limit = self.position
        for done in self.timeline.moments_before(max(limit[0], 1)):
            self.land((done, 0), passed=False)
            self.ticks, self._silent = self.machine.state.ticks, True
            begun, nearest = self.position, None
            while self.position < limit:
                stop = yield from self.forward(until=limit)
                if self.position < limit:
                    nearest = self.position, stop
            if nearest is not None:
                return self._landed(nearest[0], nearest[1], passed=nearest[1].reason != "data breakpoint")
            limit = begun
        return self._landed((0, 0), Stop(reason="start"))

    def _landed(self, position: Position, stop: Stop, *, passed: bool = True) -> Stop:
        self.land(position, passed=passed, reported=frozenset(stop.numbers))
        self.timeline.forget()
        return stop
