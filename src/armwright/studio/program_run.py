"""A run of a program, shown at the pace of a clock while the program itself runs ahead."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from concurrent.futures import Executor, Future
from typing import Any, Literal, TypeAlias

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.hardware import HardwareFactory
from armwright.cell.model import Cell
from armwright.cell.observations import Picture
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.servo import Measured
from armwright.physics.world import PhysicsCell
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger.debugger import Command, Debugger
from armwright.program.debugger.stop_reason import Stop
from armwright.program.vm.recording import Recording
from armwright.studio.shown_effects import ShownEffects

# A run is computed for so long at a time [s], and so far ahead of what is shown [s].
_SLICE, _AHEAD = 0.008, 1.0
# Lines of the trace that a page gets.
_TRACE = 300
# Variables that it gets.
_MOST_VARIABLES = 100
# Of a path as many of the latest stretches are shown, each by so many points a second [1/s], and at most so many.
_PATH_SEGMENTS, _PATH_RATE, _PATH_POINTS = 40, 25.0, 200

Step: TypeAlias = Literal["continue", "next", "in", "out", "stage", "tick", "back"]


class ProgramRun:
    """A program that runs, or stands, in a cell.

    Attributes:
        debugger: the run itself, which may be ahead of what is shown.
        time: what is shown [s].
        playing: whether the time that is shown goes on.
        rate: how fast, 1 being real time.
    """

    def __init__(
        self,
        code: Code,
        cell: Cell,
        hardware: HardwareFactory,
        lines: Iterable[int],
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
        self.debugger = Debugger(code, cell, hardware=hardware)
        self._executor = executor
        self._computing: Future[Stop | None] | None = None
        self._happened = ShownEffects()
        self._paths: dict[str, tuple[int, list[list[float]]]] = {}
        self._variables: tuple[Stop | None, list[dict[str, str]]] = (None, [])
        self.time, self.playing, self.rate = 0.0, False, 1.0
        self.set_breakpoints(lines)
        self._cell = cell
        self._backwards = False

    def set_breakpoints(self, lines: Iterable[int]) -> None:
        """Stop at these lines, and at no others."""
        self._wait()
        for one in list(self.debugger.execution.breakpoints):
            self.debugger.remove_breakpoint(one.number)
        for line in lines:
            self.debugger.add_breakpoint(line)

    def begin(self, *, stop_on_entry: bool) -> None:
        """Let it begin: to run, or to stand in front of the first statement."""
        self.debugger.begin(stop_on_entry=stop_on_entry)
        self.playing = True

    def go(self, step: Step, process: str = "") -> None:
        """Go on, or a step on or back.

        Args:
            step: which.
            process: the name of the process that steps, as ``lines`` gives it; the one that stands when left out.

        Raises:
            DebuggerError: the program is over.
            UnknownNameError: no process of this name stands.
        """
        debugger = self.debugger
        self._wait()
        if debugger.running or self.time < self.end - 1e-9:
            if step == "continue":
                self.playing = True
                return
            # A step goes on from where the program stands, not from what is shown.
            debugger.pause()
            self.time = self.end
        path = debugger.stop.path if debugger.stop is not None else ()
        if process:
            paths = {self.debugger.stack(it.path)[0].title: it.path for it in self.debugger.processes}
            if process not in paths:
                raise UnknownNameError("process", process, paths)
            path = paths[process]
        command: Command = step
        debugger.resume(command, path)
        self._backwards = step == "back"
        self.playing = True

    def pause(self) -> None:
        """Stop the time that is shown."""
        self.playing = False

    def tick(self, seconds: float) -> bool:
        """Let time go by [s]; return whether anything has changed."""
        debugger = self.debugger
        if debugger.running and (self._backwards or self.end < self.time + _AHEAD):
            self._compute()
        if self._backwards:
            if not debugger.running:
                self._backwards, self.time, self.playing = False, self.end, False
            return True
        if not self.playing:
            return debugger.running
        before = self.time
        self.time = min(self.time + seconds * self.rate, self.end)
        if self.time >= self.end and not debugger.running:
            self.playing = False
            return True
        return self.time != before

    def _compute(self) -> None:
        """Let the program itself go on for a while."""
        if self._executor is None:
            self.debugger.run_slice(_SLICE)
        elif self._computing is None or self._computing.done():
            self._wait()
            self._computing = self._executor.submit(self.debugger.run_slice, _SLICE)

    def _wait(self) -> None:
        """Wait until nothing computes beside, and raise what was raised there."""
        if self._computing is not None:
            computing, self._computing = self._computing, None
            computing.result()

    @property
    def end(self) -> float:
        """How far the program has come [s]."""
        return self.debugger.time

    @property
    def stop(self) -> Stop | None:
        """Why it stands; None while it runs, or is still shown on the way to where it stands."""
        return self.debugger.stop if not self.debugger.running and self.time >= self.end - 1e-9 else None

    # ---- what is shown -------------------------------------------------------------------------------------------

    def motion(self, arm: str) -> tuple[Array, Array, Array]:
        """Return positions, speeds and accelerations (n,) of the joints of an arm at the time shown, as planned."""
        segments = self.debugger.machine.state.segments[arm]
        i = bisect_right(segments, self.time + 1e-9, key=lambda segment: segment.t0) - 1
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
        hardware = self.debugger.machine.hardware
        return hardware.measured(arm, self.time) if isinstance(hardware, PhysicsCell) else None

    def tree(self) -> FrameTree:
        """Return the frame tree at the time that is shown."""
        trees = self.debugger.machine.state.trees
        i = bisect_right(trees, self.time + 1e-9, key=lambda entry: entry[0]) - 1
        return trees[max(i, 0)][1]

    def spelled(self, frame: str) -> str:
        """Return a frame as the program spells it."""
        return self.debugger.code.spelled(frame)

    def parts(self) -> dict[str, tuple[str | None, Array]]:
        """Return for each part the arm that holds it, and its pose on that hand or in the world."""
        hardware, time = self.debugger.machine.hardware, self.time + 1e-9
        if isinstance(hardware, PhysicsCell):
            return {name: (None, hardware.part_pose(name, time)) for name in self._cell.parts}
        return {name: track.at(time) for name, track in hardware.part_poses().tracks.items()}

    def pictures(self) -> tuple[Picture, ...]:
        """Return the pictures that cameras have taken up to the time that is shown."""
        hardware = self.debugger.machine.hardware
        taken = hardware.pictures if isinstance(hardware, PhysicsCell) else ()
        return tuple(picture for picture in taken if picture.time <= self.time + 1e-9)

    @property
    def happened(self) -> ShownEffects:
        """What has happened up to the time that is shown."""
        self._happened.update(self.debugger.machine.state.effects, self.time)
        return self._happened

    def path(self, arm: str) -> list[list[float]]:
        """Return where the tool of an arm goes on the path that is known: rows of time [s], x, y and z [m]."""
        segments = self.debugger.machine.state.segments[arm]
        count = len(segments)
        if self._paths.get(arm, (0, []))[0] != count:
            rows: list[list[float]] = []
            placed = self._cell.arms[arm]
            for segment in segments[max(0, count - _PATH_SEGMENTS) : count]:
                t = np.linspace(0.0, segment.duration, 2 + int(min(segment.duration * _PATH_RATE, _PATH_POINTS)))
                X = placed.base @ forward(placed.arm, np.asarray(segment.trajectory(t)))
                rows += np.column_stack([segment.t0 + t, X[:, :3, 3]]).round(4).tolist()
            self._paths[arm] = count, rows
        return self._paths.get(arm, (0, []))[1]

    @property
    def path_number(self) -> int:
        """Counts the stretches of all paths."""
        return sum(map(len, self.debugger.machine.state.segments.values()))

    def variables(self) -> list[dict[str, str]]:
        """Return the variables where the program stands, as plain data; none while it runs."""
        stop = self.stop
        if stop is None or stop.has_ended:
            return []
        if self._variables[0] is not stop:
            groups = [it for it in self.debugger.scopes(stop.path) if it.name in {"Locals", "Variables"}]
            found = [it for group in groups if group.children for it in group.children()]
            rows = [{"name": it.name, "value": it.value, "type": it.type} for it in found[:_MOST_VARIABLES]]
            self._variables = stop, rows
        return self._variables[1]

    def lines(self) -> list[dict[str, Any]]:
        """Return in which line each process is, as plain data: its name, the arm that it moves, the line."""
        machine = self.debugger.machine
        if self.stop is not None and self.stop.reason == "end":
            return []
        if self.stop is not None:
            stands = [(process, self.debugger.stack(process.path)[0]) for process in self.debugger.processes]
            return [
                {
                    "process": frame.title,
                    "arm": None if process.motion is None else process.motion.arm,
                    "line": machine.code.source.line(frame.span.start),
                }
                for process, frame in stands
            ]
        latest = self.happened.latest
        # A process that waits for others, as for its branches, is in no line.
        busy = [it for it in latest.values() if it.t1 >= self.time - 1e-9]
        shown = busy or [max(latest.values(), key=lambda it: it.order)] if latest else []
        return [{"process": it.process, "arm": it.arm, "line": machine.code.source.line(it.span.start)} for it in shown]

    def state(self) -> dict[str, Any]:
        """Return what a page shows of the run, as plain data."""
        stop = self.stop
        return {
            "time": round(self.time, 4),
            "end": round(self.end, 4),
            "playing": self.playing,
            "running": self.debugger.running,
            "lines": self.lines(),
            "ended": stop is not None and stop.has_ended,
            "reason": "" if stop is None else stop.reason,
            "text": "" if stop is None or stop.diagnostic is None else stop.diagnostic.message,
            "motions": {name: self._motion_state(name) for name in self._cell.arms},
            "variables": self.variables(),
        }

    def trace(self) -> list[dict[str, Any]]:
        """Return the latest of what has happened, as plain data."""
        source = self.debugger.machine.code.source
        return [
            {"t": round(effect.t0, 4), "line": source.line(effect.span.start), "text": effect.text}
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
        """Return all that the program has done so far."""
        self._wait()
        stop = self.debugger.stop
        if stop is not None and stop.recording is not None:
            return stop.recording()
        return self.debugger.machine.recording()
