"""One debugging session of an editor: the program, the debugger, and what the editor has been told so far."""

import itertools
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import attrs

from armwright.errors import ArmwrightError, ExitStatus
from armwright.program.api import LoadedProgram, ProgramError
from armwright.program.debugger.dap_messages import Arguments, RequestError
from armwright.program.debugger.debugger import Command, Debugger
from armwright.program.debugger.history import ProcessPath
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import Variable
from armwright.program.diagnostics.render import render
from armwright.program.language.diagnostic import summary_line
from armwright.program.language.position_codec import UTF_16, PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.words import Standard
from armwright.program.semantics.arguments import Arguments as ConstantValues
from armwright.program.vm.excerpt import MAX_TERMINAL_LINES, excerpt, omission_text, shorten_line
from armwright.program.vm.recording import Effect, Recording

_DESCRIPTIONS = {"start": "back at the start", "data breakpoint": "something has changed"}
# The number of the text of a program that was read from a file of code.
CODE_SOURCE_REFERENCE = 1
_EVENT_LOG_HINT = "with `output` in the launch configuration all are in events.jsonl"
# What the protocol has a word for.
_REASONS = {"start": "entry"}


@attrs.frozen(kw_only=True)
class LaunchRequest:
    """What a session is asked to run.

    Attributes:
        program: path of the program.
        cell: path of the cell; None where the program imports it, or the only cell file beside it is meant.
        std: the language.
        strict: whether an AFFIX that is only implied is an error.
        physics: whether the cell is simulated with physics.
        seed: of what is random there.
        arguments: values for constants of the program, in place of their own.
        output: a folder for what a run leaves; None for none.
        stop_on_entry: whether to stop in front of the first statement.
        no_debug: whether to run without stops.
    """

    program: Path
    cell: Path | None
    std: Standard
    output: Path | None
    stop_on_entry: bool
    no_debug: bool
    strict: bool = False
    physics: bool = False
    seed: int = 0
    arguments: ConstantValues = attrs.field(factory=dict)


class MissingCellError(ArmwrightError, ValueError):
    """A program has no cell to run in."""

    exit_status = ExitStatus.USAGE


# A source as an editor names it: the path of a file, or the number of a text of a file of code.
SourceKey: TypeAlias = str | int
# A stack frame: the process, and the level of its stack.
FrameReference: TypeAlias = tuple[ProcessPath, int]
Load = Callable[[LaunchRequest], LoadedProgram]
# Writes what a run leaves; returns a line that says so.
Save = Callable[[LaunchRequest, LoadedProgram, Recording], str]
Send = Callable[[str, Mapping[str, Any]], None]


class EditorSession:
    """The state of a session.

    Attributes:
        send: sends an event.
        debugger: None until a program is launched.
        launch: what was asked for.
        loaded: what became of it.
        connected: whether the editor has not left yet.
        after_response: what is to be done once the present request is answered.
        codecs: count the columns of each of its files as editors do, in UTF-16 as JavaScript.
        configured: whether breakpoints have been set, so that the program may begin.
        has_begun: whether it has.
        has_ended: whether its end has been reported.
        breakpoints: the breakpoints that were requested, by the source that they are in, with their numbers.
        data_breakpoints: the data breakpoints that were requested, with their numbers.
        exception_filters: the errors to stop at, ``uncaught`` and ``caught``.
        frame_references: of the stacks that the editor has seen, process and level.
        variable_references: what the editor can open, with process and level.
        ids: new numbers for breakpoints.
        breakpoint_ids: of the breakpoints as the editor knows them, by those of the debugger.
    """

    def __init__(self, load: Load, save: Save, send: Send) -> None:
        """Start without a program."""
        self._load, self._save, self.send = load, save, send
        self.debugger: Debugger | None = None
        self.launch: LaunchRequest | None = None
        self.loaded: LoadedProgram | None = None
        self.codecs: list[PositionCodec] = []
        self.connected, self.after_response = True, list[Callable[[], None]]()
        self.configured = self.has_begun = self.has_ended = False
        self.first_line = self.first_column = 1
        self.breakpoints: dict[SourceKey, list[tuple[int, Arguments]]] = {}
        self.data_breakpoints: list[tuple[int, Arguments]] = []
        self.breakpoint_ids: dict[int, int] = {}
        self.exception_filters = frozenset({"uncaught"})
        self.ids = itertools.count(1)
        self._thread_ids: dict[ProcessPath, int] = {(): 1}
        self._running_threads: set[int] = set()
        self.frame_references: list[FrameReference] = []
        self.variable_references: list[tuple[Variable, FrameReference]] = []

    # ---- the program -----------------------------------------------------------------------------------------------

    def start(self, launch: LaunchRequest) -> None:
        """Load a program.

        Raises:
            RequestError: it has errors.
            ArmwrightError: a file cannot be read, or the program has no cell.
        """
        try:
            loaded = self._load(launch)
        except ProgramError as error:
            compiled = error.compilation
            self.write(render(compiled.diagnostics, compiled.source), "stderr")
            raise RequestError(summary_line(compiled.diagnostics, compiled.source)) from None
        except MissingCellError as error:
            self.write(f"{error}\n", "stderr")
            raise
        assert loaded.cell is not None  # noqa: S101 - a program without a cell is not loaded
        self.launch, self.loaded = launch, loaded
        text = loaded.code.source
        self.codecs = [PositionCodec(text.file_text(file), UTF_16) for file in range(len(text.modules) + 1)]
        self.debugger = Debugger(loaded.code, loaded.cell, hardware=loaded.hardware)
        self.has_begun = self.has_ended = False
        self.forget_references()
        self.debugger.execution.exception_filters = self.exception_filters
        if loaded.diagnostics:
            self.write(render(loaded.diagnostics, loaded.code.source), "console")
        self.rebind_breakpoints()

    def begin(self) -> None:
        """Let the program run, once it is loaded and the breakpoints are known."""
        if self.debugger is None or self.launch is None or not self.configured or self.has_begun:
            return
        self.has_begun = True
        if self.launch.no_debug:
            execution = self.debugger.execution
            execution.breakpoints, execution.watches, execution.exception_filters = [], [], frozenset()
        self.debugger.begin(stop_on_entry=self.launch.stop_on_entry and not self.launch.no_debug)
        self.send("thread", {"reason": "started", "threadId": 1})
        self._running_threads = {1}

    @property
    def launched_debugger(self) -> Debugger:
        """The debugger of the program.

        Raises:
            RequestError: no program has been launched.
        """
        if self.debugger is None:
            raise RequestError("no program has been launched")
        return self.debugger

    @property
    def stopped_debugger(self) -> Debugger:
        """The debugger of a program that stands still.

        Raises:
            RequestError: it does not, or there is none.
        """
        debugger = self.launched_debugger
        if debugger.running or not self.has_begun:
            raise RequestError("the program is running" if self.has_begun else "the program has not begun")
        return debugger

    def resume(self, command: Command, path: ProcessPath) -> None:
        """Let the program go on.

        Raises:
            RequestError: it does not stand still, or is over.
        """
        self.stopped_debugger.resume(command, path)
        self.forget_references()

    def run_slice(self, seconds: float) -> None:
        """Do a slice of what the program has to do; state what came of it."""
        debugger = self.launched_debugger
        stop = debugger.run_slice(seconds)
        self._report_effects(debugger)
        if stop is not None and not debugger.running:
            self.report_stop(stop)

    def report_stop(self, stop: Stop) -> None:
        """State why the program stands still."""
        debugger = self.launched_debugger
        if stop.has_ended:
            self._report_end(stop)
            return
        self._report_threads(debugger)
        body = {"reason": _REASONS.get(stop.reason, stop.reason), "threadId": self.thread_id(stop.path)}
        body |= {"description": stop.text or _DESCRIPTIONS.get(stop.reason, stop.reason), "allThreadsStopped": True}
        hits = [self.breakpoint_ids[number] for number in stop.breakpoint_numbers]
        body |= ({"text": stop.text} if stop.text else {}) | ({"hitBreakpointIds": hits} if hits else {})
        self.send("stopped", body)

    def _report_end(self, stop: Stop) -> None:
        """The program is over: its output is written, and the editor told."""
        if self.has_ended:
            return
        self.has_ended = True
        assert self.loaded is not None  # noqa: S101 - it has run
        status = stop.status
        if stop.diagnostic is not None:
            self.write(render([stop.diagnostic], self.loaded.code.source), "stderr")
        if self.launch is not None and self.launch.output is not None:
            recording = stop.recording or self.launched_debugger.machine.recording
            try:
                self.write(self._save(self.launch, self.loaded, recording()) + "\n", "console")
            except ArmwrightError as error:
                self.write(f"{error}\n", "stderr")
                status = error.exit_status
        self.send("exited", {"exitCode": int(status)})
        self.send("terminated", {})

    def terminate(self) -> None:
        """End the program where it is."""
        if not self.has_ended and self.debugger is not None:
            if self.debugger.running:
                self.debugger.pause()
            self.has_ended = True
            self.send("exited", {"exitCode": int(ExitStatus.INTERRUPTED)})
            self.send("terminated", {})

    # ---- events ----------------------------------------------------------------------------------------------------

    def write(self, text: str, category: str, span: Span | None = None) -> None:
        """Show a text to the user, with the location in the program that it comes from."""
        position = {} if span is None else {"source": self.source(span), **self.location(span, full=False)}
        self.send("output", {"category": category, "output": text, **position})

    def _report_effects(self, debugger: Debugger) -> None:
        effects = [effect for effect in debugger.take_effects() if effect.kind in {"PRINT", "ERROR"}]
        shown = excerpt(effects, MAX_TERMINAL_LINES).map(_output_event)
        for text, category, span in shown.join((f"{omission_text(shown.omitted, _EVENT_LOG_HINT)}\n", "console", None)):
            self.write(text, category, span)
        for text, breakpoint_ in debugger.take_log_messages():
            self.write(f"{text}\n", "console", breakpoint_.start.span if breakpoint_.start else None)

    def _report_threads(self, debugger: Debugger) -> None:
        alive = {self.thread_id(process.path) for process in debugger.processes}
        for number in sorted(alive - self._running_threads):
            self.send("thread", {"reason": "started", "threadId": number})
        for number in sorted(self._running_threads - alive):
            self.send("thread", {"reason": "exited", "threadId": number})
        self._running_threads = alive

    # ---- threads, locations and breakpoints ------------------------------------------------------------------------

    def thread_id(self, path: ProcessPath) -> int:
        """Return the number of a process."""
        return self._thread_ids.setdefault(path, len(self._thread_ids) + 1)

    def process_path(self, number: int) -> ProcessPath:
        """Return the process of a number.

        Raises:
            RequestError: there is none.
        """
        for path, known in self._thread_ids.items():
            if known == number and any(process.path == path for process in self.launched_debugger.processes):
                return path
        raise RequestError(f"there is no thread {number}")

    def forget_references(self) -> None:
        """Frames and variables have other numbers after the next stop."""
        self.frame_references.clear()
        self.variable_references.clear()

    def source(self, span: Span) -> dict[str, Any]:
        """Return what the editor has to know of the file that a stretch of the text is in."""
        assert self.launch is not None and self.loaded is not None  # noqa: S101, PT018 - asked for only with a program
        text = self.loaded.code.source
        file = text.file_number(span.start)
        if self.loaded.is_code_file:
            return {"name": text.file_path(file), "sourceReference": CODE_SOURCE_REFERENCE + file}
        path = self._file_path(file)
        return {"name": path.name, "path": str(path)}

    def file_number(self, source: SourceKey) -> int | None:
        """Return which file of the program a source of the editor is; None where it is another one."""
        assert self.launch is not None and self.loaded is not None  # noqa: S101, PT018 - asked for only with a program
        files = range(len(self.codecs))
        if isinstance(source, int) or self.loaded.is_code_file:
            number = source - CODE_SOURCE_REFERENCE if isinstance(source, int) else -1
            return number if self.loaded.is_code_file and number in files else None
        return next((file for file in files if source and _is_same_file(source, self._file_path(file))), None)

    def _file_path(self, file: int) -> Path:
        """Return the path of the program or of one of its modules."""
        assert self.launch is not None and self.loaded is not None  # noqa: S101, PT018 - asked for only with a program
        program = self.launch.program
        return program.parent / self.loaded.code.source.modules[file - 1].path if file else program

    def location(self, span: Span, *, full: bool = True) -> dict[str, int]:
        """Return where a stretch of the text is in its file, in the numbers of the editor."""
        text = self.launched_debugger.code.source
        codec, first = self.codecs[text.file_number(span.start)], text.file_start(span.start)
        (line, column), (end_line, end_column) = map(codec.line_and_column, span.moved(-first))
        start = {"line": line + self.first_line, "column": column + self.first_column}
        end = {"endLine": end_line + self.first_line, "endColumn": end_column + self.first_column}
        return start | end if full else start

    def frame(self, arguments: Arguments) -> FrameReference:
        """Return the process and the level of the stack frame of a request; without one those of the program.

        Raises:
            RequestError: there is no such stack frame.
        """
        if "frameId" not in arguments:
            return (), 0
        number = arguments.get(int, "frameId")
        if not 0 < number <= len(self.frame_references):
            raise RequestError(f"there is no stack frame {number}")
        return self.frame_references[number - 1]

    def variables(self, arguments: Arguments) -> tuple[Sequence[Variable], FrameReference]:
        """Return the variables inside of the one that a request names, with its stack frame.

        Raises:
            RequestError: there is no such variable.
        """
        reference = arguments.get(int, "variablesReference")
        if not 0 < reference <= len(self.variable_references):
            raise RequestError(f"there is nothing to open under {reference}")
        group, frame = self.variable_references[reference - 1]
        return () if group.children is None else group.children(), frame

    def rebind_breakpoints(self) -> None:
        """Set the breakpoints that were asked for before there was a program."""
        if self.debugger is None:
            return
        self.debugger.execution.breakpoints.clear()
        for source, requests in self.breakpoints.items():
            for number, request in requests:
                bound = self.set_breakpoint(source, number, request)
                self.send("breakpoint", {"reason": "changed", "breakpoint": bound})
        for number, request in self.data_breakpoints:
            self.set_data_breakpoint(number, request)

    def set_data_breakpoint(self, number: int, request: Arguments) -> dict[str, Any]:
        """Watch a frame or a variable; return what the editor has to know of it."""
        conditions = _breakpoint_conditions(request)
        try:
            watch = self.launched_debugger.add_watch(request.get(str, "dataId"), **conditions)
        except ArmwrightError as error:
            return {"id": number, "verified": False, "message": str(error)}
        self.breakpoint_ids[watch.number] = number
        return {"id": number, "verified": True}

    def set_breakpoint(self, source: SourceKey, number: int, request: Arguments) -> dict[str, Any]:
        """Set a breakpoint in a source of the editor; return what the editor has to know of it."""
        if self.debugger is None:
            return {"id": number, "verified": False, "message": "no program has been launched"}
        file = self.file_number(source)
        if file is None:
            return {"id": number, "verified": False, "message": "this is not the program that is debugged"}
        line, column = request.get(int, "line") - self.first_line + 1, None
        if "column" in request:
            offset = self.codecs[file].offset(line - 1, request.get(int, "column") - self.first_column)
            text = self.debugger.code.source
            column = text.column(offset + (text.modules[file - 1].start if file else 0))
        conditions, log_message = _breakpoint_conditions(request), request.get(str, "logMessage", "")
        breakpoint_ = self.debugger.add_breakpoint(line, column, file=file, **conditions, log_message=log_message)
        self.breakpoint_ids[breakpoint_.number] = number
        if breakpoint_.start is None:
            return {"id": number, "verified": False, "message": breakpoint_.message}
        span = breakpoint_.start.span
        return {"id": number, "verified": True, "source": self.source(span), **self.location(span)}


def _is_same_file(path: str, other: Path) -> bool:
    try:
        return os.path.realpath(path) == os.path.realpath(other)
    except ValueError:  # a zero byte
        return False


def _breakpoint_conditions(request: Arguments) -> dict[str, str]:
    """Return the conditions of a breakpoint that is requested: on values, and on how often it has been reached."""
    keys = {"condition": "condition", "hit_condition": "hitCondition"}
    return {name: request.get(str, key, "").strip() for name, key in keys.items()}


def _output_event(effect: Effect) -> tuple[str, str, Span | None]:
    """Return what an editor shows of a PRINT or an error, its category, and where it comes from."""
    if effect.kind == "PRINT":
        return f"{shorten_line(effect.data['printed'], _EVENT_LOG_HINT)}\n", "stdout", effect.span
    return f"recovered: {effect.text}\n", "stderr", effect.span
