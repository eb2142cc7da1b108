"""A studio: carries out the commands of pages, and gives them the state to show."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from functools import partial
from typing import Any

from armwright.cell.observations import Picture
from armwright.errors import ArmwrightError
from armwright.program.debugger.debugger import DebuggerError
from armwright.studio import messages as m
from armwright.studio.control import Control
from armwright.studio.downloads import download
from armwright.studio.messages import MessageError, read_message
from armwright.studio.program_text import MoveForm
from armwright.studio.project import Project
from armwright.studio.workbench import SLIDING, TURNING

# Jogging stops so long after the latest message that keeps it going [s].
_JOG_TIMEOUT = 0.25
# How fast a run can be shown, 1 being real time.
_RATES = (0.05, 8.0)
# A map is sent again when so many points more are known.
_MAP_POINTS = 200
# Messages that wait to be made at most.
_MOST_JOBS = 8
# What has to wait until a run has ended.
_NOT_IN_A_RUN = (
    m.SetJoint,
    m.MoveTool,
    m.Jog,
    m.TakeSolution,
    m.Grip,
    m.Operate,
    m.Undo,
    m.GoTo,
    m.SetText,
    m.InsertMove,
    m.InsertVia,
    m.TouchUp,
    m.Run,
    m.Reset,
)


class Studio:
    """A workbench and a project, commanded by pages.

    Attributes:
        workbench: the arms.
        project: the files.
        control: which page commands.
        has_ended: whether no page waits for anything any more.
    """

    def __init__(self, project: Project) -> None:
        """Take a project that no page commands yet."""
        self.project, self.workbench, self.control = project, project.workbench, Control()
        self.has_ended = False
        self._jobs: list[tuple[int, Callable[[], dict[str, Any]]]] = []
        # Of them so many have not been made yet, those included that somebody makes.
        self._unmade = 0
        # Why the latest command of each page was not done.
        self._refusals: dict[int, str] = {}
        # What each page has of what is sent only when it changes, by its key in the state.
        self._sent: dict[int, dict[str, object]] = {}
        # What is being jogged, and until when.
        self._jog: m.Jog | None = None
        self._jog_until = -math.inf

    def page_opened(self, page: int) -> None:
        """Take note of a page."""
        self.control.open(page)

    def page_closed(self, page: int) -> None:
        """Take note that a page is closed or lost: what it jogged stops."""
        if page == self.control.page:
            self._jog = None
        self.control.close(page)
        self._refusals.pop(page, None)
        self._sent.pop(page, None)

    def receive(self, text: str | bytes, page: int, now: float) -> bool:
        """Do what a page asks for; return whether anything may have changed.

        Args:
            text: its message.
            page: its number.
            now: the time [s].
        """
        try:
            command = read_message(text)
            if isinstance(command, m.Got):
                return False
            self._check(command, page)
            self._do_moving(command, page, now)
            self._do_teaching(command)
            self._do_saving(command)
            self._do_running(command, page)
            self._answer(command, page)
            self._refusals.pop(page, None)
        except ArmwrightError as error:
            self._refusals[page] = str(error)
        except Exception as error:  # noqa: BLE001 - a mistake of ours does not cut off the page that it happens to
            self._refusals[page] = mistake_text(error)
        return True

    def _check(self, command: m.Command, page: int) -> None:
        if page != self.control.page and not isinstance(command, m.AskForControl):
            raise MessageError("another page has control; ask for it")
        run = self.project.run
        if run is not None and isinstance(command, _NOT_IN_A_RUN):
            if run.stop is None or not run.stop.has_ended:
                raise MessageError("the program runs; stop it first")
            # What has ended makes way for what comes next.
            self.project.run = None
        if not self.workbench.ready:
            raise MessageError("the equations of the arm are being compiled; a moment, please")

    def _do_moving(self, command: m.Command, page: int, now: float) -> None:  # noqa: C901, PLR0912 - a line for each
        bench = self.workbench
        match command:
            case m.SetJoint():
                bench.set_joint(command.arm, command.joint, command.value, now)
            case m.MoveTool():
                bench.move_tool(command.arm, command.pose, now, leaping=command.leaping)
            case m.GoTo():
                bench.go_to(command.arm, command.name, now)
            case m.TakeSolution():
                bench.take_solution(command.arm, command.number, now)
            case m.Jog():
                bench.arm(command.arm)
                if not 0 < command.share <= 1:
                    raise MessageError(f"jog.share: expected above 0 to 1, got {command.share:g}")
                if command.length or command.angle:
                    length, angle = (command.sign * value for value in (command.length, command.angle))
                    bench.jog(command.arm, command.frame, command.axis, length, angle, now)
                else:
                    self._jog, self._jog_until = command, now + _JOG_TIMEOUT
            case m.Halt():
                self._jog = None
            case m.Operate():
                self.project.operate(command.device, on=command.on)
            case m.SetInput():
                self.project.set_input(command.input, command.value)
            case m.Grip():
                bench.grip(command.arm, open_it=command.open, now=now)
            case m.Undo():
                bench.undo()
            case m.Reset():
                bench.reset()
            case m.Map():
                bench.show_map(command.arm, None if command.plane == "none" else command.plane)
            case m.Preview():
                bench.preview(command.arm, command.name)
            case m.AskForControl():
                self.control.ask(page, now)
            case m.AnswerRequest():
                self._jog = None
                self.control.answer(give=command.give)

    def _do_teaching(self, command: m.Command) -> None:
        project = self.project
        match command:
            case m.Teach():
                project.teach(command.arm, command.name, command.on)
            case m.TeachJoints():
                project.teach_joints(command.arm, command.name)
            case m.Rename():
                project.rename(command.name, command.to)
            case m.Forget():
                project.forget(command.name)
            case m.Unteach():
                project.take_back()
            case m.InsertMove():
                form = MoveForm(command.straight, command.approach, command.departure, command.speed)
                project.insert_move(command.arm, command.frame, command.line, form, teach=command.teach)
            case m.InsertVia():
                project.insert_via(command.arm, command.frame, command.line, command.blend)
            case m.TouchUp():
                project.touch_up(command.line)

    def _do_saving(self, command: m.Command) -> None:
        match command:
            case m.Save():
                self.project.save(command.what, command.name)
            case m.Reload():
                self.project.program.reload()

    def _answer(self, command: m.Command, page: int) -> None:
        """Answer what a page asks for that changes nothing."""
        project, program = self.project, self.project.program
        match command:
            case m.Keep():
                run, what = project.running(), command.what
                self._add_job(page, lambda: download(run.recording(), what, lambda: self.has_ended).message())
            case m.Look():
                take, camera = project.camera_picture(command.camera), command.camera
                self._add_job(page, lambda: _picture_message(camera, take()))
            case m.Complete():
                items = program.completions(command.text, command.offset)
                self._add_job(page, lambda: {"completions": items})
            case m.Describe():
                text = program.description(command.offset)
                self._add_job(page, lambda: {"description": text})

    def _add_job(self, page: int, job: Callable[[], dict[str, Any]]) -> None:
        if self._unmade >= _MOST_JOBS:
            raise MessageError("too much is being made already; wait a moment")
        self._jobs.append((page, job))
        self._unmade += 1

    def take_jobs(self) -> list[tuple[int, Callable[[], dict[str, Any] | None]]]:
        """Return what is to be made for pages, by their numbers: each a message, or None where the page is refused."""
        jobs, self._jobs = self._jobs, []
        return [(page, partial(self._make, page, job)) for page, job in jobs]

    def _make(self, page: int, job: Callable[[], dict[str, Any]]) -> dict[str, Any] | None:
        try:
            return job()
        except ArmwrightError as error:
            self.refuse(page, error)
        except Exception as error:  # noqa: BLE001 - a mistake of ours does not cut off the page that it happens to
            self.refuse(page, ArmwrightError(mistake_text(error)))
        finally:
            self._unmade -= 1
        return None

    def _do_running(self, command: m.Command, page: int) -> None:
        project = self.project
        match command:
            case m.SetText():
                # A page whose text is not taken gets the one that there is.
                self._sent.setdefault(page, {}).pop("source", None)
                project.set_text(command.text, command.version)
                self._sent[page]["source"] = project.program.version
            case m.Break():
                project.set_breakpoint(command.line, on=command.on, file=command.file)
            case m.Run():
                rate = _checked_rate(command.rate)
                project.start(command.line, only=command.only, physics=command.physics, entry=command.entry)
                project.running().rate = rate
            case m.Go():
                project.running().go(command.step, command.process)
            case m.Pause():
                project.running().pause()
            case m.Stop():
                project.stop()
            case m.KeepMotion():
                project.keep_motion()
            case m.Pace():
                project.running().rate = _checked_rate(command.rate)

    @property
    def moves(self) -> bool:
        """Whether anything goes on by itself."""
        bench = self.workbench
        mapping = bench.map is not None and not bench.map.done
        return self._jog is not None or self.project.run is not None or mapping

    def tick(self, now: float, seconds: float) -> bool:
        """Let what moves by itself go on for a time [s]; return whether anything has changed."""
        handed_over = self.control.tick(now)
        if handed_over or now > self._jog_until:
            self._jog = None
        # A map is worked out while nothing moves: jogging does not wait for it.
        mapped = self._jog is None and self.workbench.map_on()
        changed = self._tick_run(seconds) or handed_over or mapped
        if self._jog is None:
            return changed
        jog = self._jog
        try:
            full = jog.sign * jog.share * seconds
            self.workbench.jog(jog.arm, jog.frame, jog.axis, full * SLIDING, full * TURNING, now)
        except ArmwrightError as error:
            self.refuse(self.control.page, error)
        return True

    def _tick_run(self, seconds: float) -> bool:
        try:
            return self.project.tick(seconds)
        except DebuggerError as error:
            self.refuse(self.control.page, error)
        except Exception as error:  # noqa: BLE001 - whatever ends a run, what has been taught is not lost with it
            self.project.run = None
            text = str(error) if isinstance(error, ArmwrightError) else mistake_text(error)
            self.refuse(self.control.page, ArmwrightError(text))
        return True

    def refuse(self, page: int | None, error: ArmwrightError) -> None:
        """Tell a page why what it began does not go on."""
        if page is not None:
            self._refusals[page] = str(error)

    def state(self, page: int) -> dict[str, Any]:
        """Return what a page shows, as plain data, without what it has already of what changes seldom."""
        state = {
            **self.workbench.state(),
            **self.project.state(),
            "refusal": self._refusals.get(page, ""),
            "control": self.control.state(page),
        }
        sent = self._sent.setdefault(page, {})
        for name, (key, value) in self._seldom_changed().items():
            if sent.get(name) != key:
                sent[name] = key
                state[name] = value()
        return state

    def _seldom_changed(self) -> dict[str, tuple[object, Callable[[], Any]]]:
        """Return what is sent only when it changes, by its key in the state: what it depends on, and what makes it."""
        project, bench, run = self.project, self.workbench, self.project.run
        pictures = () if run is None else run.pictures()
        # What a run shows depends on which it is, and on how far its paths are known.
        moved = () if run is None else (project.run_number, run.path_key)
        program, file = project.program, project.file
        breakpoints, in_modules = sorted(project.breakpoints), sorted(project.module_breakpoints)
        return {
            "around": (bench.around_key, bench.around_state),
            "file": (None if file is None else (file.text, file.changed, file.named), project.file_state),
            "program": (
                (program.compilations, program.changed, tuple(breakpoints), tuple(in_modules)),
                lambda: {**program.state(), "breakpoints": breakpoints, "module_breakpoints": in_modules},
            ),
            "source": (program.version, lambda: program.text),
            "modules": (program.module_texts, program.modules),
            "map": (
                (bench.map_number, bench.map is not None and (bench.map.done, bench.map.known // _MAP_POINTS)),
                lambda: None if bench.map is None else bench.map.state(),
            ),
            "paths": (
                moved,
                lambda: {} if run is None else {name: run.path(name) for name in bench.arms},
            ),
            "trace": (
                (moved, 0 if run is None else len(run.happened.begun)),
                lambda: [] if run is None else run.trace(),
            ),
            "compared": (
                tuple(motion.number for motion in project.compared),
                lambda: [motion.state() for motion in project.compared],
            ),
            "picture": (
                (project.run_number if pictures else 0, len(pictures), pictures[-1].time if pictures else None),
                lambda: _picture_state(pictures[-1]) if pictures else None,
            ),
        }


def mistake_text(error: Exception) -> str:
    """Return what a page says of an error that is a mistake of armwright."""
    return f"a mistake of armwright, please report it: {type(error).__name__}: {error}"


def _checked_rate(rate: float) -> float:
    least, most = _RATES
    if not least <= rate <= most:
        raise MessageError(f"rate: expected {least} to {most}, got {rate:g}")
    return rate


def _picture_message(camera: str, content: bytes) -> dict[str, Any]:
    return {"picture": {"camera": camera, "png": base64.b64encode(content).decode(), "text": "", "found": None}}


def _picture_state(picture: Picture) -> dict[str, Any]:
    """Return a picture that a camera has taken in a run, as plain data."""
    text = f"{picture.time:.2f} s, {picture.text}"
    png = base64.b64encode(picture.png).decode()
    return {"camera": picture.camera, "png": png, "text": text, "found": picture.found}
