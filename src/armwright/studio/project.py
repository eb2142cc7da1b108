"""The files of a studio: a cell into which frames are taught, a program that is written and run in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.hardware import HardwareFactory
from armwright.cell.simulator import Simulator
from armwright.errors import UnknownNameError
from armwright.files.inputs import read_program
from armwright.physics.world import PhysicsCell
from armwright.studio.cell_file import CellFile, TeachingError
from armwright.studio.program_run import ProgramRun
from armwright.studio.program_text import ProgramText, ProgramTextError
from armwright.studio.workbench import Workbench

# Speeds of a MOVE.
_SPEEDS = (1, 120)
_MOST_BREAKPOINTS = 1000


class Project:
    """A cell file and a program, beside the workbench that shows both.

    Attributes:
        workbench: with the arms.
        file: into which frames are taught; None where there is none.
        program: its text.
        run: of the program; None where none runs.
        breakpoints: lines of the program.
    """

    def __init__(self, workbench: Workbench, file: CellFile | None = None, program: Path | None = None) -> None:
        """Open the files.

        Args:
            workbench: shows the cell.
            file: into which frames are taught; None where there is none.
            program: file of the program, which need not exist; None where it has none yet.

        Raises:
            FileFormatError: the program cannot be read.
        """
        self.workbench, self.file = workbench, file
        text = read_program(program) if program is not None and program.exists() else ""
        self.program = ProgramText(program, text, workbench.cell)
        self.run: ProgramRun | None = None
        self.breakpoints: set[int] = set()

    # ---- teaching ------------------------------------------------------------------------------------------------

    def _teachable(self) -> CellFile:
        if self.file is None:
            raise TeachingError("there is no cell file; begin one by: armwright studio --new CELL.toml")
        return self.file

    def _taught(self, file: CellFile) -> None:
        """Take the frames of a cell file that has been changed."""
        self.workbench.take_frames(file.cell)
        self.program.set_cell(file.cell)

    def teach(self, arm: str, name: str, on: str = WORLD) -> None:
        """Give a frame the pose of the tool of an arm; it is added where there is none.

        Args:
            arm: name of the arm.
            name: of the frame.
            on: the frame that it hangs on.
        """
        self._teach(name, self.workbench.arm(arm).tool, on)

    def _teach(self, name: str, X_WF: Array, on: str) -> None:
        file, poses = self._teachable(), self.workbench.frame_poses()
        if on != WORLD and on not in poses:
            raise UnknownNameError("frame", on, [WORLD, *poses])
        file.teach(name, X_WF, on, None if on == WORLD else poses[on])
        self._taught(file)

    def rename(self, name: str, new: str) -> None:
        """Give a frame of the cell file another name."""
        file = self._teachable()
        file.rename(name, new)
        self._taught(file)

    def forget(self, name: str) -> None:
        """Take a frame out of the cell file."""
        file = self._teachable()
        file.forget(name)
        self._taught(file)

    def take_back(self) -> None:
        """Take back the latest change of the cell file."""
        file = self._teachable()
        file.undo()
        self._taught(file)

    def save(self, what: str) -> None:
        """Write the ``cell`` file or the ``program``."""
        if what == "cell":
            self._teachable().save()
        else:
            self.program.save()

    def insert_move(self, arm: str, frame: str, line: int, *, straight: bool, speed: float) -> None:
        """Teach a frame where the tool is, and insert a MOVE to it behind a line; both or neither."""
        least, most = _SPEEDS
        if not least <= speed <= most:
            raise ProgramTextError(f"speed: expected {least} to {most}, got {speed:g}")
        self.program.require_statements()
        self.teach(arm, frame)
        self.program.insert_move(line, arm, frame.upper(), straight=straight, speed=speed)

    def touch_up(self, line: int) -> None:
        """Give the goal of the MOVE in a line the pose of the tool."""
        goal, file = self.program.goal_in(line), self._teachable()
        key = goal.upper()
        if key not in file.cell.frames:
            raise TeachingError(f"{goal} is not a frame of {file.path.name}, so its pose cannot be touched up there")
        arms = list(self.workbench.arms)
        arm = arms[0] if len(arms) == 1 else self.program.moved_in(line)
        parent = file.cell.frames[key].parent
        self._teach(key, self.workbench.arm(arm).tool, parent)

    # ---- running -------------------------------------------------------------------------------------------------

    def set_text(self, text: str, version: int) -> None:
        """Take another text of the program.

        Args:
            text: the text.
            version: of the text that it was made from.
        """
        if version != self.program.version:
            raise ProgramTextError("the program has been changed meanwhile; the newest text is shown")
        self.program.replace(text)

    def set_breakpoint(self, line: int, *, on: bool) -> None:
        """Set or remove a breakpoint."""
        if on and len(self.breakpoints) < _MOST_BREAKPOINTS:
            self.breakpoints.add(line)
        else:
            self.breakpoints.discard(line)
        if self.run is not None:
            self.run.set_breakpoints(self.breakpoints)

    def start(self, line: int, *, only: bool, physics: bool, entry: bool) -> None:
        """Run the program.

        Args:
            line: only from the statement in this line on, from where the arms are; 0 for all, from the cell's start.
            only: whether only that statement is run.
            physics: whether in a world with physics.
            entry: whether it stands in front of the first statement.

        Raises:
            ProgramTextError: it has errors.
        """
        compiled, cell = self.program.compiled, self.workbench.cell
        if line:
            compiled, cell = self.program.part_from(line, only=only), self.workbench.cell_as_shown()
        if compiled.code is None:
            error = next(it for it in compiled.diagnostics if it.is_error)
            where = compiled.source.line(error.span.start)
            raise ProgramTextError(f"line {where}: {error.code}: {error.message}")
        hardware: HardwareFactory = PhysicsCell if physics else Simulator
        self.run = ProgramRun(compiled.code, cell, hardware, self.breakpoints)
        self.run.begin(stop_on_entry=entry)

    def running(self) -> ProgramRun:
        """Return the run.

        Raises:
            ProgramTextError: there is none.
        """
        if self.run is None:
            raise ProgramTextError("no program runs")
        return self.run

    def stop(self) -> None:
        """End the run; the arms stay where they are shown."""
        self.running()
        self.run = None

    def tick(self, seconds: float) -> bool:
        """Let the run go on for a time [s]; return whether anything has changed."""
        if self.run is None or not self.run.tick(seconds):
            return False
        self.workbench.follow(self.run)
        return True

    def state(self) -> dict[str, Any]:
        """Return what a page shows of it beside the text of the program, as plain data."""
        taught = None
        if self.file is not None:
            frames = list(self.file.cell.frames)
            taught = {"name": self.file.path.name, "change": self.file.difference(), "frames": frames}
        return {
            "program": {**self.program.state(), "breakpoints": sorted(self.breakpoints)},
            "run": None if self.run is None else self.run.state(),
            "file": taught,
        }
