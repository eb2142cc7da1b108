"""What the commands of pages do: to the arms, and to which page commands them."""

from __future__ import annotations

import math
from functools import singledispatchmethod
from pathlib import Path
from typing import Any

import attrs

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.hardware import HardwareFactory
from armwright.cell.simulator import Simulator
from armwright.errors import ArmwrightError, UnknownNameError
from armwright.files.inputs import read_program
from armwright.spatial.poses import to_noap
from armwright.studio import messages
from armwright.studio.cell_file import CellFile
from armwright.studio.live_arm import LiveArm
from armwright.studio.messages import MessageError, read_message
from armwright.studio.program_run import ProgramRun
from armwright.studio.program_text import ProgramText
from armwright.studio.workbench import Workbench

# Jogging stops so long after the latest message that keeps it going [s].
_JOG_TIMEOUT = 0.25
# What has to wait until a run has ended.
_NOT_IN_A_RUN = (
    messages.SetJoint,
    messages.SetJoints,
    messages.MoveTool,
    messages.Jog,
    messages.TakeSolution,
    messages.Grip,
    messages.Undo,
    messages.GoTo,
    messages.SetText,
    messages.InsertMove,
    messages.TouchUp,
    messages.Run,
    messages.Reset,
)
# A page that is asked for control and says nothing for so long hands it over [s].
_REQUEST_TIMEOUT = 10.0
# Speeds of a MOVE, and how fast a run can be shown, 1 being real time.
_LOWEST_SPEED, _HIGHEST_SPEED = 1, 120
_SLOWEST, _FASTEST = 0.05, 8.0
_MOST_BREAKPOINTS = 1000


@attrs.define
class _Request:
    """A page asks another one for control.

    Attributes:
        page: its number.
        until: when it gets control without an answer.
    """

    page: int
    until: float


class Studio:
    """A workbench, and the pages that command it.

    Attributes:
        workbench: what is commanded.
        controlling_page: number of the page that has control; None without pages.
    """

    def __init__(self, workbench: Workbench, cell_file: CellFile | None = None, program: Path | None = None) -> None:
        """Take a workbench that no page commands yet.

        Args:
            workbench: what is commanded.
            cell_file: into which frames are taught; None where there is no file.
            program: file of the program; None where it has none yet.

        Raises:
            FileFormatError: the program cannot be read.
        """
        self.workbench, self.cell_file = workbench, cell_file
        text = read_program(program) if program is not None and program.exists() else ""
        self.program = ProgramText(program, text, workbench.cell)
        self.run: ProgramRun | None = None
        self._breakpoints: set[int] = set()
        # The version of the text that each page has.
        self._versions: dict[int, int] = {}
        self.controlling_page: int | None = None
        self._pages: list[int] = []
        self._request: _Request | None = None
        # Why the latest command of a page was not done.
        self._refusals: dict[int, str] = {}
        # What is being jogged, and until when.
        self._jog: messages.Jog | None = None
        self._jog_until = -math.inf

    # ---- pages ---------------------------------------------------------------------------------------------------

    def page_opened(self, number: int) -> None:
        """Take note of a page; the first has control."""
        self._pages.append(number)
        if self.controlling_page is None:
            self.controlling_page = number

    def page_closed(self, number: int) -> None:
        """Take note that a page is closed or lost: what it jogged stops, and another page gets control."""
        self._pages.remove(number)
        self._refusals.pop(number, None)
        self._versions.pop(number, None)
        if self._request is not None and self._request.page == number:
            self._request = None
        if self.controlling_page == number:
            self._jog = None
            heir = self._request.page if self._request is not None else next(iter(self._pages), None)
            self.controlling_page, self._request = heir, None

    # ---- commands ------------------------------------------------------------------------------------------------

    def receive(self, text: str | bytes, page: int, now: float) -> bool:
        """Do what a page asks for; return whether anything may have changed.

        Args:
            text: its message.
            page: its number.
            now: the time [s].
        """
        try:
            command = read_message(text)
            if isinstance(command, messages.Got):
                return False
            if page != self.controlling_page and not isinstance(command, messages.AskForControl):
                raise MessageError("another page has control; ask for it")  # noqa: TRY301
            if self.run is not None and isinstance(command, _NOT_IN_A_RUN):
                raise MessageError("the program runs; stop it first")  # noqa: TRY301
            if not self.workbench.ready:
                raise MessageError("the equations of the arm are being compiled; a moment, please")  # noqa: TRY301
            self._do(command, page, now)
            self._refusals.pop(page, None)
        except ArmwrightError as error:
            self._refusals[page] = str(error)
        return True

    @singledispatchmethod
    def _do(self, command: Any, page: int, now: float) -> None:
        raise AssertionError(f"no handler of {command!r}")

    @_do.register
    def _(self, command: messages.SetJoint, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.set_joint(command.arm, command.joint, command.value, now)

    @_do.register
    def _(self, command: messages.SetJoints, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.set_joints(command.arm, command.q, now)

    @_do.register
    def _(self, command: messages.MoveTool, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.move_tool(command.arm, command.pose, now, leaping=command.leaping)

    @_do.register
    def _(self, command: messages.Jog, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.arm(command.arm)
        if not 0 < command.share <= 1:
            raise MessageError(f"jog.share: expected above 0 to 1, got {command.share:g}")
        self._jog, self._jog_until = command, now + _JOG_TIMEOUT

    @_do.register
    def _(self, command: messages.Halt, page: int, now: float) -> None:  # noqa: ARG002
        self._jog = None

    @_do.register
    def _(self, command: messages.TakeSolution, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.take_solution(command.arm, command.number, now)

    @_do.register
    def _(self, command: messages.Grip, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.grip(command.arm, open_it=command.open, now=now)

    @_do.register
    def _(self, command: messages.Undo, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.undo()

    @_do.register
    def _(self, command: messages.AskForControl, page: int, now: float) -> None:  # noqa: ARG002
        if page != self.controlling_page:
            self._request = _Request(page, now + _REQUEST_TIMEOUT)

    @_do.register
    def _(self, command: messages.AnswerRequest, page: int, now: float) -> None:  # noqa: ARG002
        if self._request is not None and command.give:
            self._jog, self.controlling_page = None, self._request.page
        self._request = None

    # ---- teaching ------------------------------------------------------------------------------------------------

    def _teachable(self) -> CellFile:
        if self.cell_file is None:
            raise MessageError("there is no cell file; begin one by: armwright studio --new CELL.toml")
        return self.cell_file

    def _taught(self, file: CellFile) -> None:
        """Take the frames of a cell file that has been changed."""
        self.workbench.take_frames(file.cell)
        self.program.set_cell(file.cell)

    @_do.register
    def _(self, command: messages.Teach, page: int, now: float) -> None:  # noqa: ARG002
        file, arm = self._teachable(), self.workbench.arm(command.arm)
        self._teach(file, command.name, arm.tool, command.on)

    def _teach(self, file: CellFile, name: str, X_WF: Array, on: str = WORLD) -> None:
        if on == WORLD:
            file.teach(name, X_WF)
        else:
            poses = self.workbench.frame_poses()
            if on not in poses:
                raise UnknownNameError("frame", on, [WORLD, *poses])
            file.teach(name, X_WF, on, poses[on])
        self._taught(file)

    @_do.register
    def _(self, command: messages.Rename, page: int, now: float) -> None:  # noqa: ARG002
        file = self._teachable()
        file.rename(command.name, command.to)
        self._taught(file)

    @_do.register
    def _(self, command: messages.Forget, page: int, now: float) -> None:  # noqa: ARG002
        file = self._teachable()
        file.forget(command.name)
        self._taught(file)

    @_do.register
    def _(self, command: messages.Unteach, page: int, now: float) -> None:  # noqa: ARG002
        file = self._teachable()
        file.undo()
        self._taught(file)

    @_do.register
    def _(self, command: messages.Save, page: int, now: float) -> None:  # noqa: ARG002
        if command.what == "cell":
            self._teachable().save()
        else:
            self.program.save()

    @_do.register
    def _(self, command: messages.GoTo, page: int, now: float) -> None:  # noqa: ARG002
        poses = self.workbench.frame_poses()
        if command.frame not in poses:
            raise UnknownNameError("frame", command.frame, poses)
        self.workbench.move_tool(command.arm, tuple(to_noap(poses[command.frame])), now, leaping=True)

    # ---- programs ------------------------------------------------------------------------------------------------

    @_do.register
    def _(self, command: messages.SetText, page: int, now: float) -> None:  # noqa: ARG002
        if command.version != self.program.version:
            raise MessageError("the program has been changed meanwhile; the newest text is shown")
        self.program.replace(command.text)
        # The page has it: it is not sent back.
        self._versions[page] = self.program.version

    @_do.register
    def _(self, command: messages.InsertMove, page: int, now: float) -> None:  # noqa: ARG002
        file, arm = self._teachable(), self.workbench.arm(command.arm)
        if not _LOWEST_SPEED <= command.speed <= _HIGHEST_SPEED:
            raise MessageError(f"speed: expected {_LOWEST_SPEED} to {_HIGHEST_SPEED}, got {command.speed:g}")
        self._teach(file, command.frame, arm.tool)
        self.program.insert_move(
            command.line, command.arm, command.frame.upper(), straight=command.straight, speed=command.speed
        )

    @_do.register
    def _(self, command: messages.TouchUp, page: int, now: float) -> None:  # noqa: ARG002
        goal, file = self.program.goal_in(command.line), self._teachable()
        if goal.upper() not in file.cell.frames:
            raise MessageError(f"{goal} is not a frame of the cell file, so there is nothing to touch up")
        arm = next(iter(self.workbench.arms.values())) if len(self.workbench.arms) == 1 else self._moved_in(command.line)
        self._teach(file, goal, arm.tool)

    def _moved_in(self, line: int) -> LiveArm:
        return self.workbench.arm(self.program.moved_in(line))

    @_do.register
    def _(self, command: messages.Break, page: int, now: float) -> None:  # noqa: ARG002
        if command.on and len(self._breakpoints) < _MOST_BREAKPOINTS:
            self._breakpoints.add(command.line)
        else:
            self._breakpoints.discard(command.line)
        if self.run is not None:
            self.run.set_breakpoints(self._breakpoints)

    @_do.register
    def _(self, command: messages.Run, page: int, now: float) -> None:  # noqa: ARG002
        cell = self.workbench.cell
        compiled = self.program.compiled
        if command.line:
            compiled = self.program.part_from(command.line, only=command.only)
            cell = self.workbench.cell_as_shown()
        if compiled.code is None:
            error = next(it for it in compiled.diagnostics if it.is_error)
            raise MessageError(f"line {compiled.source.line(error.span.start)}: {error.code}: {error.message}")
        hardware: HardwareFactory = Simulator
        if command.physics:
            from armwright.physics.world import PhysicsCell  # noqa: PLC0415 - only where it is asked for

            hardware = PhysicsCell
        self.run = ProgramRun(compiled.code, cell, hardware, self._breakpoints)
        self.run.begin(stop_on_entry=command.entry)

    def _running(self) -> ProgramRun:
        if self.run is None:
            raise MessageError("no program runs")
        return self.run

    @_do.register
    def _(self, command: messages.Go, page: int, now: float) -> None:  # noqa: ARG002
        self._running().go(command.way)

    @_do.register
    def _(self, command: messages.Pause, page: int, now: float) -> None:  # noqa: ARG002
        self._running().pause()

    @_do.register
    def _(self, command: messages.Stop, page: int, now: float) -> None:  # noqa: ARG002
        self._running()
        self.run = None

    @_do.register
    def _(self, command: messages.Reset, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.reset()

    @_do.register
    def _(self, command: messages.Pace, page: int, now: float) -> None:  # noqa: ARG002
        if not _SLOWEST <= command.rate <= _FASTEST:
            raise MessageError(f"rate: expected {_SLOWEST} to {_FASTEST}, got {command.rate:g}")
        self._running().rate = command.rate

    # ---- time ----------------------------------------------------------------------------------------------------

    def tick(self, now: float, seconds: float) -> bool:
        """Let what moves by itself go on for a time [s]; return whether anything has changed."""
        changed = False
        if self._request is not None and now > self._request.until:
            self._jog, self.controlling_page, self._request = None, self._request.page, None
            changed = True
        if self.run is not None and self.run.tick(seconds):
            self.workbench.follow(self.run)
            changed = True
        jog = self._jog
        if jog is None:
            return changed
        if now > self._jog_until:
            self._jog = None
            return changed
        try:
            self.workbench.jog(jog.arm, jog.frame, jog.axis, jog.way * jog.share * seconds, now)
        except ArmwrightError as error:
            if self.controlling_page is not None:
                self._refusals[self.controlling_page] = str(error)
        return True

    def state(self, page: int) -> dict[str, Any]:
        """Return what a page shows, as plain data."""
        control = {
            "mine": page == self.controlling_page,
            "pages": len(self._pages),
            "asked": self._request is not None and page == self.controlling_page,
            "asking": self._request is not None and page == self._request.page,
        }
        program = self.program.state()
        program["breakpoints"] = sorted(self._breakpoints)
        if self._versions.get(page) != self.program.version:
            self._versions[page] = self.program.version
            program["source"] = self.program.text
        file = self.cell_file
        taught = None if file is None else {"name": file.path.name, "change": file.difference(), "frames": [*file.cell.frames]}
        return {
            **self.workbench.state(),
            "refusal": self._refusals.get(page, ""),
            "control": control,
            "program": program,
            "run": None if self.run is None else self.run.state(),
            "file": taught,
        }
