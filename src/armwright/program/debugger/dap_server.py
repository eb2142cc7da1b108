"""The debug adapter: what editors ask of a debugger, over the Debug Adapter Protocol.

One thread reads what comes in; another answers it and, while the program runs, lets it run in slices in between. So
a program that never ends can be paused, and nothing else has to be guarded.

Source:
    Debug Adapter Protocol, specification 1.68.
"""

import queue
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from armwright.errors import ArmwrightError
from armwright.files.inputs import regular_file
from armwright.program.debugger import dap_requests
from armwright.program.debugger.dap_messages import (
    Arguments,
    InvalidMessage,
    RequestError,
    frame_message,
    read_messages,
)
from armwright.program.debugger.dap_session import EditorSession, LaunchRequest, Load, Save
from armwright.program.debugger.debugger import Command
from armwright.program.language.words import Standard

# How long the program runs before the next request is looked for [s].
_SLICE = 0.02

_CAPABILITIES = {
    "supportsConfigurationDoneRequest": True,
    "supportsConditionalBreakpoints": True,
    "supportsHitConditionalBreakpoints": True,
    "supportsLogPoints": True,
    "supportsBreakpointLocationsRequest": True,
    "supportsDataBreakpoints": True,
    "supportsEvaluateForHovers": True,
    "supportsStepBack": True,
    "supportsSteppingGranularity": True,
    "supportsSetVariable": True,
    "supportsSetExpression": True,
    "supportsCompletionsRequest": True,
    "supportsExceptionInfoRequest": True,
    "supportsDelayedStackTraceLoading": True,
    "supportsTerminateRequest": True,
    "supportsRestartRequest": True,
    "supportTerminateDebuggee": True,
    "exceptionBreakpointFilters": [
        {"filter": "uncaught", "label": "Errors that end the program", "default": True},
        {"filter": "caught", "label": "Errors with a RECOVER", "default": False},
    ],
}


def serve(incoming: BinaryIO, outgoing: BinaryIO, load: Load, save: Save) -> None:
    """Answer an editor until it disconnects or its stream ends.

    Args:
        incoming: where requests come from; its ``read`` returns what there is.
        outgoing: where answers go.
        load: reads and translates a program.
        save: writes what a run leaves.
    """
    Adapter(outgoing, load, save).run(incoming)


class Adapter:
    """A connection to an editor."""

    def __init__(self, outgoing: BinaryIO, load: Load, save: Save) -> None:
        """Wait for the first request."""
        self._outgoing = outgoing
        self._sent = 0
        self._session = EditorSession(load, save, self._event)
        self._incoming: queue.SimpleQueue[dict[str, Any] | InvalidMessage | None] = queue.SimpleQueue()
        self._connected = True
        self._after_response: list[Callable[[], None]] = []

    def run(self, incoming: BinaryIO) -> None:
        """Answer what comes in, and let the program run in between."""
        threading.Thread(target=self._listen, args=(incoming,), daemon=True).start()
        try:
            while self._connected:
                self._serve_next()
        except BrokenPipeError:
            # The editor has gone.
            return

    def _serve_next(self) -> None:
        debugger = self._session.debugger
        running = debugger is not None and debugger.running
        try:
            message = self._incoming.get(block=not running)
        except queue.Empty:
            self._session.run_slice(_SLICE)
            return
        if message is None:
            self._connected = False
        elif isinstance(message, InvalidMessage):
            self._refuse(0, "", message.text)
        else:
            self._handle(message)

    def _listen(self, incoming: BinaryIO) -> None:
        try:
            for message in read_messages(incoming):
                self._incoming.put(message)
        finally:
            self._incoming.put(None)

    # ---- requests --------------------------------------------------------------------------------------------------

    def _handle(self, message: Mapping[str, Any]) -> None:
        if message.get("type") not in {"request", None}:
            return
        sequence, command = message.get("seq"), message.get("command")
        number = sequence if isinstance(sequence, int) else 0
        if not isinstance(command, str):
            self._refuse(number, "", "a request without a command")
            return
        try:
            body = self._dispatch(command, message.get("arguments"))
        except ArmwrightError as error:
            self._refuse(number, command, str(error))
        except Exception as error:  # noqa: BLE001 - a slip of ours must not take the session with it
            self._refuse(number, command, f"{type(error).__name__} in the debugger: {error}")
        else:
            self._answer(number, command, body)
        after, self._after_response = self._after_response, []
        for event in after:
            event()

    def _dispatch(self, command: str, arguments: object) -> Mapping[str, Any] | None:
        if command in _INSPECTIONS:
            return _INSPECTIONS[command](self._session, Arguments(arguments))
        if command in _STEPS:
            return self._step(command, Arguments(arguments))
        handlers: Mapping[str, Callable[[Arguments], Mapping[str, Any] | None]] = {
            "initialize": self._initialize,
            "launch": self._launch,
            "configurationDone": self._configuration_done,
            "restart": self._restart,
            "pause": self._pause,
            "terminate": self._terminate,
            "disconnect": self._disconnect,
        }
        if command not in handlers:
            raise RequestError(f"this debugger does not support the request `{command}`")
        return handlers[command](Arguments(arguments))

    def _initialize(self, arguments: Arguments) -> Mapping[str, Any]:
        self._session.first_line = int(arguments.get(bool, "linesStartAt1", default=True))
        self._session.first_column = int(arguments.get(bool, "columnsStartAt1", default=True))
        return _CAPABILITIES

    def _launch(self, arguments: Arguments) -> None:
        session = self._session
        if session.debugger is not None:
            raise RequestError("a program has been launched already")
        session.start(_launch_request(arguments))
        # Now that the program is known, breakpoints can be set in it.
        self._after_response += [lambda: self._event("initialized", {}), session.begin]

    def _configuration_done(self, _: Arguments) -> None:
        self._session.configured = True
        self._after_response.append(self._session.begin)

    def _restart(self, arguments: Arguments) -> None:
        session = self._session
        if session.launch is None:
            raise RequestError("no program has been launched")
        launch = _launch_request(arguments.get_object("arguments")) if "arguments" in arguments else session.launch
        session.start(launch)
        self._after_response.append(session.begin)

    def _step(self, command: str, arguments: Arguments) -> Mapping[str, Any]:
        session = self._session
        if command in {"continue", "reverseContinue"}:
            session.resume(_STEPS[command], ())
            return {"allThreadsContinued": True}
        step: Command = _STEPS[command]
        granularity = arguments.get(str, "granularity", "statement")
        if granularity not in {"statement", "line", "instruction"}:
            raise RequestError(f"granularity: expected statement, line or instruction, got {granularity!r}")
        if granularity == "instruction":
            step = "tick back" if command == "stepBack" else "tick"
        session.resume(step, session.process_path(arguments.get(int, "threadId", 1)))
        return {}

    def _pause(self, _: Arguments) -> None:
        debugger = self._session.launched_debugger
        if not debugger.running:
            raise RequestError("the program is not running")
        stop = debugger.pause()
        self._after_response.append(lambda: self._session.report_stop(stop))

    def _terminate(self, _: Arguments) -> None:
        self._after_response.append(self._session.terminate)

    def _disconnect(self, _: Arguments) -> None:
        self._connected = False

    # ---- answers and events ----------------------------------------------------------------------------------------

    def _answer(self, number: int, command: str, body: Mapping[str, Any] | None) -> None:
        answer = {"request_seq": number, "command": command, "success": True}
        self._send("response", answer if body is None else {**answer, "body": body})

    def _refuse(self, number: int, command: str, text: str) -> None:
        answer = {"request_seq": number, "command": command, "success": False, "message": text}
        error = {"id": 1, "format": _escape_braces(text), "showUser": True}
        self._send("response", {**answer, "body": {"error": error}})

    def _event(self, event: str, body: Mapping[str, Any]) -> None:
        self._send("event", {"event": event, "body": body})

    def _send(self, kind: str, message: Mapping[str, Any]) -> None:
        self._sent += 1
        self._outgoing.write(frame_message({"seq": self._sent, "type": kind, **message}))
        self._outgoing.flush()


def _escape_braces(text: str) -> str:
    """Return a text in which braces ask for nothing."""
    return text.replace("{", "(").replace("}", ")")


def _launch_request(arguments: Arguments) -> LaunchRequest:
    standard = str(arguments.get(object, "std", Standard.RLO_2.value))
    if standard not in set(Standard):
        raise RequestError(f"std: expected 2 or 83, got {standard!r}")
    return LaunchRequest(
        program=regular_file(Path(arguments.get(str, "program"))),
        cell=regular_file(Path(arguments.get(str, "cell"))) if arguments.get(str, "cell", "") else None,
        std=Standard(standard),
        output=Path(arguments.get(str, "output")) if arguments.get(str, "output", "") else None,
        stop_on_entry=arguments.get(bool, "stopOnEntry", default=False),
        no_debug=arguments.get(bool, "noDebug", default=False),
        strict=arguments.get(bool, "strict", default=False),
    )


# A servo tick is the instruction of an arm; ``stepStage`` is a request of this adapter alone.
_STEPS: Mapping[str, Command] = {
    "continue": "continue",
    "next": "next",
    "stepIn": "in",
    "stepOut": "out",
    "stepStage": "stage",
    "stepBack": "back",
    "reverseContinue": "reverse",
}
_INSPECTIONS: Mapping[str, Callable[[EditorSession, Arguments], dict[str, Any]]] = {
    "setBreakpoints": dap_requests.set_breakpoints,
    "breakpointLocations": dap_requests.breakpoint_locations,
    "dataBreakpointInfo": dap_requests.data_breakpoint_info,
    "setDataBreakpoints": dap_requests.set_data_breakpoints,
    "setExceptionBreakpoints": dap_requests.set_exception_breakpoints,
    "threads": dap_requests.threads,
    "stackTrace": dap_requests.stack_trace,
    "scopes": dap_requests.scopes,
    "variables": dap_requests.variables,
    "evaluate": dap_requests.evaluate,
    "setVariable": dap_requests.set_variable,
    "setExpression": dap_requests.set_expression,
    "completions": dap_requests.completions,
    "exceptionInfo": dap_requests.exception_info,
    "source": dap_requests.source,
}
