"""The files of a studio: a cell into which frames are taught, a program that is written and run in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from armwright.cell.frames import WORLD
from armwright.cell.hardware import HardwareFactory, SimulatedHardware
from armwright.cell.model import Cell
from armwright.errors import ArmwrightError, InvalidValueError, UnknownNameError, shown
from armwright.files.inputs import read_program
from armwright.physics.camera_view import CameraView
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.physics.world import PhysicsCell
from armwright.program.api import add_imported_frames
from armwright.studio.cell_file import CellFile, TeachingError
from armwright.studio.comparison import KeptMotion, kept_motion
from armwright.studio.program_run import ProgramRun
from armwright.studio.program_text import MoveForm, ProgramText, ProgramTextError, first_error, moved_lines
from armwright.studio.workbench import Workbench

_MOST_BREAKPOINTS = 1000
# Names of files that pages may ask for: none leads out of the working folder.
_FILE = re.compile(r"\w[\w-]{0,80}(\.\w{1,5})?", re.ASCII)


class Project:
    """A cell file and a program, beside the workbench that shows both.

    Attributes:
        workbench: with the arms.
        file: into which frames are taught; None where there is none.
        program: its text.
        run: of the program; None where none runs.
        run_number: counts the runs.
        breakpoints: lines of the program.
        module_breakpoints: paths of modules and lines in them.
        devices: that are on, while no program runs.
        inputs: that were set by hand while no program ran, with which the next run begins.
        compared: motions of earlier runs that are shown beside one another, at most two.
        executor: computes runs beside whoever shows them; None for not beside.
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
        self.module_breakpoints: set[tuple[str, int]] = set()
        self.devices: set[str] = set()
        self.inputs: dict[str, float] = {}
        self.compared: list[KeptMotion] = []
        self.run_number = self._kept = 0
        self.executor: Executor | None = None
        self._camera_view: tuple[Cell, CameraView] | None = None

    # ---- teaching ------------------------------------------------------------------------------------------------

    def _teachable(self) -> CellFile:
        if self.file is None:
            raise TeachingError("there is no cell file; begin one by: armwright studio --new CELL.toml")
        return self.file

    def _taught(self, file: CellFile) -> None:
        """Take the frames of a cell file that has been changed."""
        self.workbench.take_frames(file.cell)
        self.program.set_cell(file.cell)

    def teach(self, arm: str, name: str, on: str = "") -> None:
        """Give a frame the pose of the tool of an arm; it is added where there is none.

        Args:
            arm: name of the arm.
            name: of the frame.
            on: the frame that it hangs on; as before, or WORLD, when left out.
        """
        file, X_WF = self._teachable(), self.workbench.arm(arm).tool
        known = file.cell.frames.get(name.upper())
        on = on.upper() or (WORLD if known is None else known.parent)
        # A program that has run may have moved the frame that is shown; the file has it where it is at the start.
        tree = self.workbench.with_tools(file.cell.tree())
        if on != WORLD and (on not in tree or on in self.workbench.arms):
            raise UnknownNameError("frame", on, [it for it in tree if it not in self.workbench.arms])
        file.teach(name, X_WF, on, None if on == WORLD else tree.world(on))
        self._taught(file)

    def rename(self, name: str, new: str) -> None:
        """Give a frame or a joint target of the cell file another name."""
        file = self._teachable()
        file.rename(name, new)
        self._taught(file)

    def forget(self, name: str) -> None:
        """Take a frame or a joint target out of the cell file."""
        file = self._teachable()
        file.forget(name)
        self._taught(file)

    def take_back(self) -> None:
        """Take back the latest change of the cell file."""
        file = self._teachable()
        file.undo()
        self._taught(file)

    def save(self, what: str, name: str = "") -> None:
        """Write the ``cell`` file or the ``program``.

        Args:
            what: which.
            name: of the file, in the working folder, where it has none yet.

        Raises:
            TeachingError: it has no name, or a file of this name is there already.
            OutputError: it cannot be written, or somebody else has changed it meanwhile.
        """
        if what == "program":
            self.program.save(self.program.path or _new_path(name, ".rlo"))
            return
        file = self._teachable()
        file.save(file.path if file.named else _new_path(name, ".toml"))

    def unsaved(self) -> list[str]:
        """Return the names of the files whose changes have not been written."""
        texts = [(self.program.name, self.program.changed and bool(self.program.text.strip()))]
        if self.file is not None:
            texts.append((self.file.path.name, self.file.changed))
        return [name for name, changed in texts if changed]

    def insert_move(self, arm: str, frame: str, line: int, form: MoveForm, *, teach: bool) -> None:
        """Insert a MOVE to a frame behind a line, and teach the frame where the tool is; both or neither.

        Args:
            arm: name of the arm.
            frame: name of the frame.
            line: from 1; see ``ProgramText.insert_move``.
            form: of the MOVE.
            teach: whether the frame is taught; otherwise it is one that there is.
        """
        if teach:
            self.teach(arm, frame)
        elif frame.upper() not in self.workbench.cell.tree():
            raise UnknownNameError("frame", frame, self.workbench.cell.frames)
        self._change_program(lambda: self.program.insert_move(line, arm, frame.upper(), form), taught=teach)

    def insert_via(self, arm: str, frame: str, line: int, blend: float) -> None:
        """Teach a frame where the tool is, and let the MOVE in a line go past it; both or neither."""
        self.teach(arm, frame)
        self._change_program(lambda: self.program.insert_via(line, frame.upper(), blend), taught=True)

    def _change_program(self, change: Callable[[], None], *, taught: bool) -> None:
        """Change the program after something has been taught for it; if that cannot be, neither is done."""
        before = self.program.text
        try:
            change()
        except ArmwrightError:
            if taught:
                self.take_back()
            raise
        self.breakpoints = moved_lines(self.breakpoints, before, self.program.text)

    def teach_joints(self, arm: str, name: str) -> None:
        """Give a joint target the configuration of an arm; it is added where there is none."""
        file = self._teachable()
        file.teach_joints(name, arm, self.workbench.arm(arm).q)
        self._taught(file)

    def touch_up(self, line: int) -> None:
        """Give the goal of the MOVE in a line the pose of the tool."""
        goal, file = self.program.goal_in(line), self._teachable()
        key = goal.upper()
        if key not in file.cell.frames:
            raise TeachingError(f"{goal} is not a frame of {file.path.name}, so its pose cannot be touched up there")
        arms = list(self.workbench.arms)
        arm = arms[0] if len(arms) == 1 else self.program.moved_in(line)
        self.teach(arm, key)

    # ---- running -------------------------------------------------------------------------------------------------

    def set_text(self, text: str, version: int) -> None:
        """Take another text of the program.

        Args:
            text: the text.
            version: of the text that it was made from.
        """
        if version != self.program.version:
            raise ProgramTextError("the program has been changed meanwhile; the newest text is shown")
        before = self.program.text
        self.program.replace(text)
        self.breakpoints = moved_lines(self.breakpoints, before, text)

    def set_breakpoint(self, line: int, *, on: bool, file: str = "") -> None:
        """Set or remove a breakpoint.

        Args:
            line: from 1.
            on: whether it is set.
            file: path of the module that it is in; empty for the program itself.

        Raises:
            ProgramTextError: there is no such line, or there are too many breakpoints.
            UnknownNameError: the program has no such module.
        """
        if on:
            if not 1 <= line <= self.program.line_count(file):
                raise ProgramTextError(f"there is no line {line}")
            if len(self.breakpoints) + len(self.module_breakpoints) >= _MOST_BREAKPOINTS:
                raise ProgramTextError(f"there are {_MOST_BREAKPOINTS} breakpoints already")
        if file:
            (self.module_breakpoints.add if on else self.module_breakpoints.discard)((file, line))
        else:
            (self.breakpoints.add if on else self.breakpoints.discard)(line)
        if self.run is not None:
            self.run.set_breakpoints(self._all_breakpoints())

    def _all_breakpoints(self) -> list[int | tuple[str, int]]:
        return [*self.breakpoints, *self.module_breakpoints]

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
        self.program.read_modules()
        compiled, cell = self.program.compiled, self.workbench.cell
        if line:
            compiled, cell = self.program.part_from(line, only=only), self.workbench.cell_as_shown()
        cell = add_imported_frames(cell, compiled.imports) or cell
        if compiled.code is None:
            error = first_error(compiled)
            where = compiled.source.place(error.span.start)
            raise ProgramTextError(f"line {where}: {error.code}: {error.message}")
        kind: HardwareFactory = PhysicsCell if physics else kinematic_cell

        def hardware(cell: Cell) -> SimulatedHardware:
            made = kind(cell)
            for name, value in self.inputs.items():
                made.set_input(name, value)
            return made

        self.run_number += 1
        self.run = ProgramRun(compiled.code, cell, hardware, self._all_breakpoints(), self.executor)
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

    def operate(self, device: str, *, on: bool) -> None:
        """Switch a device of the cell.

        Raises:
            UnknownNameError: there is none of this name.
        """
        known = self._known_devices()
        if device not in known:
            raise UnknownNameError("device", device, known)
        (self.devices.add if on else self.devices.discard)(device)

    def set_input(self, name: str, value: float) -> None:
        """Set an input of the cell by hand, in the run from what is shown on, or for the next run.

        Raises:
            UnknownNameError: there is none of this name.
            InvalidValueError: a digital one would be neither 0 nor 1.
        """
        inputs = self.workbench.cell.inputs
        if name not in inputs:
            raise UnknownNameError("input", name, inputs)
        if not inputs[name].analogue and value not in (0.0, 1.0):
            raise InvalidValueError(f"input {name} is digital: expected 0 or 1, got {value:g}")
        if self.run is None:
            self.inputs[name] = value
        else:
            self.run.set_input(name, value)

    def _input_states(self) -> dict[str, dict[str, Any]]:
        inputs = self.workbench.cell.inputs
        values = {name: source.start for name, source in inputs.items()} | self.inputs
        if self.run is not None:
            values = self.run.inputs()
        return {name: {"value": values[name], "analogue": source.analogue} for name, source in inputs.items()}

    def _known_devices(self) -> list[str]:
        """Return the devices of the cell, and those that a run has switched."""
        switched = {} if self.run is None else self.run.happened.devices
        return sorted({*(self.workbench.cell.devices or ()), *switched})

    def _device_states(self) -> dict[str, bool]:
        switched = dict.fromkeys(self.devices, True) if self.run is None else self.run.happened.devices
        return {name: switched.get(name, False) for name in self._known_devices()}

    def camera_picture(self, camera: str) -> Callable[[], bytes]:
        """Return what takes a picture of the cell as it is shown, in whatever thread takes all of them.

        Raises:
            UnknownNameError: there is no camera of this name.
        """
        cell = self.workbench.cell
        if camera not in cell.cameras:
            raise UnknownNameError("camera", camera, cell.cameras)
        configurations, parts = self.workbench.configurations(), self.workbench.part_poses()

        def take() -> bytes:
            if self._camera_view is None or self._camera_view[0] is not cell:
                if self._camera_view is not None:
                    self._camera_view[1].close()
                self._camera_view = cell, CameraView(cell)
            return self._camera_view[1].picture(camera, configurations, parts)

        return take

    def keep_motion(self) -> None:
        """Keep the motion of the run, to be compared with another one; of three the first is forgotten."""
        if self.running().end <= 0:
            raise ProgramTextError("nothing has moved yet that could be compared")
        self._kept += 1
        self.compared = [*self.compared, kept_motion(self.running().recording(), self._kept)][-2:]

    def tick(self, seconds: float) -> bool:
        """Let the run go on for a time [s]; return whether anything has changed."""
        if self.run is None or not self.run.tick(seconds):
            return False
        self.workbench.follow(self.run)
        return True

    def file_state(self) -> dict[str, Any] | None:
        """Return what a page shows of the cell file, as plain data; None where there is none."""
        if self.file is None:
            return None
        frames = list(self.file.cell.frames)
        name, named = self.file.path.name, self.file.named
        return {"name": name, "named": named, "change": self.file.difference(), "frames": frames}

    def state(self) -> dict[str, Any]:
        """Return what a page shows of it beside its files, as plain data."""
        run = None if self.run is None else self.run.state()
        return {"run": run, "devices": self._device_states(), "inputs": self._input_states()}


def _new_path(name: str, suffix: str) -> Path:
    """Return the path of a file in the working folder that is to be made.

    Raises:
        TeachingError: the name is none, or a file of this name is there already.
    """
    if not _FILE.fullmatch(name):
        raise TeachingError(f"a file name has letters, digits, - and _, got {shown(name)}")
    path = Path(name if name.lower().endswith(suffix) else f"{name}{suffix}")
    if path.exists():
        raise TeachingError(f"{path} exists already; give another name")
    return path
