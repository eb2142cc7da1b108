"""A run of a program, shown at the pace of a clock while the program itself runs ahead."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future
from typing import Any, Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.hardware import HardwareFactory, SimulatedHardware
from armwright.cell.model import Cell
from armwright.cell.observations import Picture
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.servo import Measured
from armwright.physics.world import PhysicsCell
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger.debugger import Command, Debugger
from armwright.program.debugger.stop_reason import Stop
from armwright.program.language.source import Source, Span
from armwright.program.vm.machine import Machine
from armwright.program.vm.recording import Recording
from armwright.studio.shown_effects import ShownEffects

# A run is computed for so long at a time [s], and so far ahead of what is shown [s].
_SLICE, _AHEAD = 0.008, 1.0
# Lines of the trace that a page gets.
_TRACE = 300
# Times are the same within this [s].
_SAME = 1e-9
# Variables that it gets.
_MOST_VARIABLES = 100
# Of a path as many of the latest stretches are shown, each by so many points a second [1/s], and at most so many.
_PATH_SEGMENTS, _PATH_RATE, _PATH_POINTS = 40, 25.0, 200

# A line of the program, or the path of a module and a line in it.
Breakpoint: TypeAlias = int | tuple[str, int]
Step: TypeAlias = Literal["continue", "next", "in", "out", "stage", "tick", "back"]


@attrs.frozen(eq=False)
class _Computed:
    """What has been computed of a run: nobody changes it while it is shown, although the run itself goes on.

    Attributes:
        machine: the program; lists of what it has done may grow.
        trees: frame trees, with the times from which they hold [s].
        end: how far the program has come [s].
        running: whether it goes on.
        stop: why it does not.
        stands: in which line each process stands, as plain data; nothing while it runs.
        variables: as plain data; nothing while it runs.
    """

    machine: Machine
    trees: tuple[tuple[float, FrameTree], ...]
    end: float
    running: bool
    stop: Stop | None
    stands: tuple[dict[str, Any], ...] = ()
    variables: tuple[dict[str, str], ...] = ()


class ProgramRun:
    """A program that runs, or stands, in a cell.

    The program runs ahead of what is shown. What a user does refers to what is shown: to pause, to step or to set a
    breakpoint the program goes back there first.

    Attributes:
        time: what is shown [s].
        playing: whether the time that is shown goes on.
        rate: how fast, 1 being real time.
    """

    def __init__(
        self,
        code: Code,
        cell: Cell,
        hardware: HardwareFactory,
        lines: Iterable[Breakpoint],
        executor: Executor | None = None,
    ) -> None:
        """Load a program.

        Args:
            code: translated against the cell.
            cell: it runs in.
            hardware: how the cell is set up.
            lines: of the breakpoints.
            executor: computes the run beside whoever shows it, whom planning a MOVE would hold up; None for none.
        """
        self._debugger = Debugger(code, cell, hardware=hardware)
        self.time, self.playing, self.rate = 0.0, False, 1.0
        self._cell, self._executor = cell, executor
        self._computing: Future[None] | None = None
        # Commands to be carried out as soon as nothing is computed, and whether one of them is being carried out.
        self._commands: deque[Callable[[], None]] = deque()
        self._commanded = False
        # Whether what is shown leaps to where the program stands, and whether anything has become known.
        self._leaps = self._news = False
        self._happened = ShownEffects()
        self._paths: dict[str, tuple[tuple[int, ...], list[list[float]]]] = {}
        self._take_lines(lines)
        self._computed = self._compute_view()

    def begin(self, *, stop_on_entry: bool) -> None:
        """Let it begin: to run, or to stand in front of the first statement."""
        self._debugger.begin(stop_on_entry=stop_on_entry)
        self._computed = self._compute_view()
        self.playing = True

    # ---- commands ------------------------------------------------------------------------------------------------

    def set_breakpoints(self, lines: Iterable[Breakpoint]) -> None:
        """Stop at these lines, and at no others, from what is shown on."""
        kept = frozenset(lines)

        def change() -> None:
            ahead = self._is_ahead()
            if ahead:
                self._rewind()
            self._take_lines(kept)
            if ahead:
                self._debugger.resume("continue")

        self._do(change)

    def set_input(self, name: str, value: float) -> None:
        """Set an input of the cell by hand, from what is shown on; it has been checked."""

        def change() -> None:
            ahead = self._is_ahead()
            if ahead:
                self._rewind()
            self._debugger.set_input(name, value)
            if ahead:
                self._debugger.resume("continue")

        self._do(change)

    def go(self, step: Step, process: str = "") -> None:
        """Go on, or a step on or back.

        Args:
            step: which.
            process: the name of the process that steps, as ``lines`` gives it; the one that stands when left out.

        Raises:
            DebuggerError: the program is over.
            UnknownNameError: no process of this name stands.
        """
        if step == "continue" and self._computed.running:
            self.playing = True
            return
        names = [it["process"] for it in self._computed.stands]
        if process and process not in names:
            raise UnknownNameError("process", process, names)
        # A step back ends before what is shown.
        self.playing = step != "back"
        self._do(lambda: self._resume(step, process))

    def pause(self) -> None:
        """Let the program stand where it is shown."""
        self.playing = False
        self._do(self._rewind)

    def tick(self, seconds: float) -> bool:
        """Let time go by [s]; return whether anything has changed."""
        self._compute()
        changed, self._news = self._news, False
        # Time stands while the program goes to where a command leads it.
        if not self.playing or self._commanded or self._commands:
            return changed
        before = self.time
        self.time = max(before, min(before + seconds * self.rate, self.end))
        if self.time >= self.end and not self._computed.running and self._computing is None:
            self.playing = False
            return True
        return changed or self.time != before

    # ---- computing: all of this is done by one thread at a time --------------------------------------------------

    def _do(self, task: Callable[[], None]) -> None:
        """Do something with the program as soon as nothing is computed."""
        if self._executor is None:
            task()
            self._take()
        else:
            self._commands.append(task)

    def _compute(self) -> None:
        """Take what has been computed, and let the rest be computed."""
        if self._computing is not None:
            if not self._computing.done():
                return
            computing, self._computing, self._commanded = self._computing, None, False
            try:
                computing.result()
            finally:
                self._take()
        if self._commands:
            task, self._commanded = self._commands.popleft(), self._executor is not None
        elif self._debugger.running and self.end < self.time + _AHEAD:
            task = self._run_on
        else:
            return
        if self._executor is None:
            task()
            self._take()
        else:
            self._computing = self._executor.submit(task)

    def _take(self) -> None:
        """Show from now on what has been computed."""
        self._computed, self._news = self._compute_view(), True
        if self._leaps:
            self._leaps, self.time = False, self._computed.end

    def _compute_view(self) -> _Computed:
        debugger = self._debugger
        machine, end = debugger.machine, self._come_to()
        trees = tuple(machine.state.trees)
        if debugger.running or debugger.stop is None:
            return _Computed(machine, trees, end, debugger.running, debugger.stop)
        stop = debugger.stop
        variables = () if stop.has_ended else self._variables(stop)
        return _Computed(machine, trees, end, False, stop, self._stands(), variables)

    def _run_on(self) -> None:
        self._debugger.run_slice(_SLICE)

    def _is_ahead(self) -> bool:
        """Whether the program is ahead of what is shown."""
        return self._debugger.running or self._come_to() > self.time + _SAME

    def _come_to(self) -> float:
        """Return how far the program has come [s], which takes the debugger itself a view of all arms."""
        execution = self._debugger.execution
        return max(execution.tick, execution.machine.state.ticks) * self._cell.period

    def _rewind(self) -> None:
        """Go back to what is shown, if the program is ahead of it."""
        if self._is_ahead():
            self._debugger.pause()
            self._debugger.rewind(self.time)
            self._debugger.run_slice()

    def _resume(self, step: Step, process: str) -> None:
        self._rewind()
        debugger = self._debugger
        path = debugger.stop.path if debugger.stop is not None else ()
        named = [it.path for it in debugger.processes if process and debugger.stack(it.path)[0].title == process]
        command: Command = step
        debugger.resume(command, named[0] if named else path)
        if step == "back":
            debugger.run_slice()
            self._leaps = True

    def _take_lines(self, lines: Iterable[Breakpoint]) -> None:
        debugger = self._debugger
        for known in list(debugger.execution.breakpoints):
            debugger.remove_breakpoint(known.number)
        files = {module.path: number for number, module in enumerate(debugger.machine.code.source.modules, 1)}
        for one in lines:
            path, line = ("", one) if isinstance(one, int) else one
            if not path or path in files:
                debugger.add_breakpoint(line, file=files.get(path, 0))

    def _stands(self) -> tuple[dict[str, Any], ...]:
        debugger = self._debugger
        stop, source = debugger.stop, debugger.machine.code.source
        if stop is not None and stop.reason == "end":
            return ()
        # A process that waits for its branches is in no line.
        waits = [it for it in debugger.processes if it.waiting is None or it.waiting.kind != "branches"]
        stacks = [(process, debugger.stack(process.path)) for process in waits]
        return tuple(
            {
                "process": stack[0].title,
                "arm": None if process.motion is None else process.motion.arm,
                **_place(source, stack[0].span, *(frame.span for frame in stack[1:])),
            }
            for process, stack in stacks
        )

    def _variables(self, stop: Stop) -> tuple[dict[str, str], ...]:
        groups = [it for it in self._debugger.scopes(stop.path) if it.name in {"Locals", "Variables"}]
        found = [it for group in groups if group.children for it in group.children()]
        return tuple({"name": it.name, "value": it.value, "type": it.type} for it in found[:_MOST_VARIABLES])

    # ---- what is shown -------------------------------------------------------------------------------------------

    @property
    def end(self) -> float:
        """How far the program has come [s]."""
        return self._computed.end

    @property
    def stop(self) -> Stop | None:
        """Why it stands; None while it runs, or is still shown before where it stands."""
        computed = self._computed
        return computed.stop if not computed.running and self.time >= computed.end - _SAME else None

    def motion(self, arm: str) -> tuple[Array, Array, Array]:
        """Return positions, speeds and accelerations (n,) of the joints of an arm at the time shown, as planned."""
        segments = self._computed.machine.state.segments[arm]
        i = bisect_right(segments, self.time + _SAME, key=lambda segment: segment.t0) - 1
        start = np.array(self._cell.arms[arm].start)
        if i < 0:
            return start, np.zeros_like(start), np.zeros_like(start)
        segment, t = segments[i], self.time - segments[i].t0
        q, qd, qdd = (np.asarray(segment.trajectory(min(max(t, 0.0), segment.duration), order)) for order in range(3))
        # Then the arm rests.
        moves = float(t < segment.duration)
        return q, moves * qd, moves * qdd

    def measured(self, arm: str) -> Measured | None:
        """Return what was measured of an arm at the time shown; None without physics."""
        hardware = self._computed.machine.hardware
        return hardware.measured(arm, self.time) if isinstance(hardware, PhysicsCell) else None

    def tree(self) -> FrameTree:
        """Return the frame tree at the time that is shown."""
        trees = self._computed.trees
        i = bisect_right(trees, self.time + _SAME, key=lambda entry: entry[0]) - 1
        tree = trees[max(i, 0)][1]
        for name, X in self._cell.moving_poses(self.time).items():
            tree = tree.set_pose(name, X)
        return tree

    def spelled(self, frame: str) -> str:
        """Return a frame as the program spells it."""
        return self._computed.machine.code.spelled(frame)

    def parts(self) -> dict[str, tuple[str | None, Array]]:
        """Return for each part the arm that holds it, and its pose on that hand or in the world."""
        hardware, time = self._computed.machine.hardware, self.time + _SAME
        if isinstance(hardware, PhysicsCell):
            return {name: (None, hardware.part_pose(name, time)) for name in self._cell.parts}
        moving, parts = self._cell.moving_poses(self.time), dict[str, tuple[str | None, Array]]()
        for name, track in hardware.part_poses().tracks.items():
            carrier, X = track.at(time)
            parts[name] = (None, moving[carrier] @ X) if carrier in moving else (carrier, X)
        return parts

    def inputs(self) -> dict[str, float]:
        """Return what the inputs of the cell are at the time that is shown."""
        hardware = self._computed.machine.hardware
        assert isinstance(hardware, SimulatedHardware)  # noqa: S101 - the debugger runs no others
        return {name: hardware.input_at(name, self.time) for name in self._cell.inputs}

    def pictures(self) -> tuple[Picture, ...]:
        """Return the pictures that cameras have taken up to the time that is shown."""
        hardware = self._computed.machine.hardware
        taken = hardware.pictures if isinstance(hardware, PhysicsCell) else ()
        return tuple(picture for picture in taken if picture.time <= self.time + _SAME)

    @property
    def happened(self) -> ShownEffects:
        """What has happened up to the time that is shown."""
        self._happened.update(self._computed.machine.state.effects, self.time)
        return self._happened

    def path(self, arm: str) -> list[list[float]]:
        """Return where the tool of an arm goes on the path that is known: rows of time [s], x, y and z [m]."""
        segments, key = self._computed.machine.state.segments[arm], self.path_key
        count = len(segments)
        if self._paths.get(arm, ((), []))[0] != key:
            rows: list[list[float]] = []
            placed = self._cell.arms[arm]
            for segment in segments[max(0, count - _PATH_SEGMENTS) : count]:
                t = np.linspace(0.0, segment.duration, 2 + int(min(segment.duration * _PATH_RATE, _PATH_POINTS)))
                X = placed.base @ forward(placed.arm, np.asarray(segment.trajectory(t)))
                rows += np.column_stack([segment.t0 + t, X[:, :3, 3]]).round(4).tolist()
            self._paths[arm] = key, rows
        return self._paths[arm][1]

    @property
    def path_key(self) -> tuple[int, ...]:
        """Paths are the same where this is."""
        machine = self._computed.machine
        return id(machine), *map(len, machine.state.segments.values())

    def lines(self) -> list[dict[str, Any]]:
        """Return in which line each process is, as plain data: its name, the arm that it moves, the line."""
        if self.stop is not None:
            return list(self._computed.stands)
        source, latest = self._computed.machine.code.source, self.happened.latest
        # A process that waits for others, as for its branches, is in no line.
        busy = [it for it in latest.values() if it.t1 >= self.time - _SAME]
        shown = busy or [max(latest.values(), key=lambda it: it.order)] if latest else []
        return [{"process": it.process, "arm": it.arm, **_place(source, it.span)} for it in shown]

    def state(self) -> dict[str, Any]:
        """Return what a page shows of the run, as plain data."""
        stop = self.stop
        return {
            "time": round(self.time, 4),
            "end": round(self.end, 4),
            "playing": self.playing,
            "running": self._computed.running,
            "lines": self.lines(),
            "ended": stop is not None and stop.has_ended,
            "reason": "" if stop is None else stop.reason,
            "text": "" if stop is None or stop.diagnostic is None else stop.diagnostic.message,
            "motions": {name: self._motion_state(name) for name in self._cell.arms},
            "variables": [] if stop is None else list(self._computed.variables),
        }

    def trace(self) -> list[dict[str, Any]]:
        """Return the latest of what has happened, as plain data."""
        source = self._computed.machine.code.source
        return [
            {"t": round(effect.t0, 4), "line": source.place(effect.span.start), "text": effect.text}
            for effect in self.happened.begun[-_TRACE:]
        ]

    def _motion_state(self, arm: str) -> dict[str, list[float]]:
        names = ("q", "qd", "qdd")
        state = {name: np.round(values, 6).tolist() for name, values in zip(names, self.motion(arm), strict=True)}
        measured = self.measured(arm)
        if measured is not None:
            state |= {f"{name}_measured": np.round(getattr(measured, name), 6).tolist() for name in ("q", "qd", "tau")}
        return state

    def recording(self) -> Recording:
        """Return all that the program has done so far; whoever waits for it does not show the run."""
        return self._recording() if self._executor is None else self._executor.submit(self._recording).result()

    def _recording(self) -> Recording:
        stop = self._debugger.stop
        if stop is not None and stop.recording is not None:
            return stop.recording()
        return self._debugger.view.recording()


def _place(source: Source, *spans: Span) -> dict[str, Any]:
    """Return where something is, as plain data.

    Args:
        source: the program, of which a page shows the own file.
        spans: of what is done, and of the calls that led to it, the innermost first.

    Returns:
        The line of the own file, 0 where nothing of all that is in it; and of the first the line with its file in
        words, the path of the module that it is in, and the line in that.
    """
    own = next((source.line(span.start) for span in spans if not source.file_number(span.start)), 0)
    start = spans[0].start
    file = source.file_number(start)
    path = source.modules[file - 1].path if file else ""
    return {"line": own, "place": source.place(start), "file": path, "inner": source.line(start)}
