"""Requests of an editor: the session, breakpoints, and what a stopped program looks like: stacks, variables, values."""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from armwright.errors import ArmwrightError
from armwright.files.inputs import regular_file
from armwright.program.debugger.dap_messages import Arguments, RequestError
from armwright.program.debugger.dap_session import (
    CODE_SOURCE_REFERENCE,
    EditorSession,
    FrameReference,
    LaunchRequest,
    SourceKey,
)
from armwright.program.debugger.debugger import Command
from armwright.program.debugger.expressions import names_to_write
from armwright.program.debugger.variables import ArrayElements, Variable
from armwright.program.diagnostics.render import render
from armwright.program.language.position_codec import UTF_16, PositionCodec
from armwright.program.language.words import Standard
from armwright.program.semantics.builtins import FUNCTIONS

# So many elements are sent to an editor that does not say how many it wants.
_MAX_ELEMENTS = 1000
# What gives a variable or an element a value.
_ASSIGNMENT = re.compile(r"([A-Za-z][\w.-]*(?:\s*\[[^\[\]]*\](?:\.\w+)?)?)\s*=\s*(.+)", re.DOTALL)
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_.]*$")
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


# ---- session -------------------------------------------------------------------------------------------------------


def initialize(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``initialize``: what this debugger can do."""
    session.first_line = int(arguments.get(bool, "linesStartAt1", default=True))
    session.first_column = int(arguments.get(bool, "columnsStartAt1", default=True))
    return _CAPABILITIES


def launch(session: EditorSession, arguments: Arguments) -> None:
    """Answer ``launch``: load a program."""
    if session.debugger is not None:
        raise RequestError("a program has been launched already")
    session.start(_launch_request(arguments))
    # Now that the program is known, breakpoints can be set in it.
    session.after_response += [lambda: session.send("initialized", {}), session.begin]


def configuration_done(session: EditorSession, _: Arguments) -> None:
    """Answer ``configurationDone``: the program may begin."""
    session.configured = True
    session.after_response.append(session.begin)


def restart(session: EditorSession, arguments: Arguments) -> None:
    """Answer ``restart``: load the program again."""
    if session.launch is None:
        raise RequestError("no program has been launched")
    again = _launch_request(arguments.get_object("arguments")) if "arguments" in arguments else session.launch
    session.start(again)
    session.after_response.append(session.begin)


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
        physics=arguments.get(bool, "physics", default=False),
        seed=arguments.get(int, "seed", default=0),
        arguments=arguments.get(dict, "arguments", {}),
    )


def _resume(command: Command, session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer a request that lets the program go on, or back; a servo tick is the instruction of an arm."""
    if command in {"continue", "reverse"}:
        session.resume(command, ())
        return {"allThreadsContinued": True}
    granularity = arguments.get(str, "granularity", "statement")
    if granularity not in {"statement", "line", "instruction"}:
        raise RequestError(f"granularity: expected statement, line or instruction, got {granularity!r}")
    if granularity == "instruction":
        command = "tick back" if command == "back" else "tick"
    session.resume(command, session.process_path(arguments.get(int, "threadId", 1)))
    return {}


def pause(session: EditorSession, _: Arguments) -> None:
    """Answer ``pause``: stop the program where it is."""
    debugger = session.launched_debugger
    if not debugger.running:
        raise RequestError("the program is not running")
    stop = debugger.pause()
    session.after_response.append(lambda: session.report_stop(stop))


def terminate(session: EditorSession, _: Arguments) -> None:
    """Answer ``terminate``: end the program."""
    session.after_response.append(session.terminate)


def disconnect(session: EditorSession, _: Arguments) -> None:
    """Answer ``disconnect``: end the session."""
    session.connected = False


# ---- breakpoints -----------------------------------------------------------------------------------------------------


def set_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setBreakpoints``: those of a file, instead of all it had."""
    source = arguments.get_object("source")
    requests = arguments.get_objects("breakpoints")
    for request in requests:
        request.get(int, "line")
    key = _source_key(source)
    if session.debugger is not None:
        bound = {number for number, _ in session.breakpoints.get(key, ())}
        known = session.debugger.execution.breakpoints
        known[:] = [one for one in known if session.breakpoint_ids.get(one.number) not in bound]
    session.breakpoints[key] = [(next(session.ids), request) for request in requests]
    return {"breakpoints": [session.set_breakpoint(key, *request) for request in session.breakpoints[key]]}


def _source_key(source: Arguments) -> SourceKey:
    """Return what an editor calls a source."""
    return source.get(int, "sourceReference", 0) or source.get(str, "path", "")


def breakpoint_locations(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``breakpointLocations``: where statements begin."""
    first = arguments.get(int, "line")
    offset = 1 - session.first_line
    statements = session.launched_debugger.execution.statements
    file = session.file_number(_source_key(arguments.get_object("source"))) if "source" in arguments else 0
    last = arguments.get(int, "endLine", first)
    starts = () if file is None else statements.in_lines(first + offset, last + offset, file)
    return {"breakpoints": [session.location(start.span) for start in starts]}


def data_breakpoint_info(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``dataBreakpointInfo``: what of all that is shown can be watched."""
    name = arguments.get(str, "name")
    debugger = session.stopped_debugger
    try:
        if arguments.get(int, "variablesReference", 0):
            slot = _slot_named(session.variables(arguments)[0], name)
        else:
            slot = debugger.evaluate(name, *session.frame(arguments)).slot
    except ArmwrightError as error:
        return {"dataId": None, "description": str(error)}
    if slot is None or debugger.machine.type_of(slot).sizes:
        return {"dataId": None, "description": f"{name} is neither a frame nor a variable"}
    spelled = debugger.code.spelled(slot)
    return {"dataId": slot, "description": spelled, "accessTypes": ["write"], "canPersist": "'" not in slot}


def set_data_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setDataBreakpoints``: all frames and variables that are watched, instead of those before."""
    debugger = session.launched_debugger
    requests = arguments.get_objects("breakpoints")
    for request in requests:
        request.get(str, "dataId")
    session.data_breakpoints = [(next(session.ids), request) for request in requests]
    debugger.execution.watches.clear()
    return {"breakpoints": [session.set_data_breakpoint(*request) for request in session.data_breakpoints]}


def set_exception_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setExceptionBreakpoints``: which errors to stop at."""
    session.exception_filters = frozenset(map(str, arguments.get(list, "filters", [])))
    if session.debugger is not None:
        session.debugger.execution.exception_filters = session.exception_filters
    return {}


# ---- inspection ------------------------------------------------------------------------------------------------------


def threads(session: EditorSession, _: Arguments) -> dict[str, Any]:
    """Answer ``threads``: the program and the branches of COBEGIN."""
    if session.debugger is None:
        return {"threads": [{"id": 1, "name": "program"}]}
    named = []
    for process in session.debugger.processes:
        arm = process.motion.arm if process.motion else process.last_arm
        name = f"{process.title} ({arm})" if arm else process.title
        named.append({"id": session.thread_id(process.path), "name": name})
    return {"threads": named}


def stack_trace(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``stackTrace``: where a process is, the innermost first."""
    debugger = session.stopped_debugger
    path = session.process_path(arguments.get(int, "threadId"))
    frames = debugger.stack(path)
    first, count = arguments.get(int, "startFrame", 0), arguments.get(int, "levels", 0) or len(frames)
    answers = []
    for level, frame in enumerate(frames):
        if first <= level < first + count:
            session.frame_references.append((path, level))
            number, location = len(session.frame_references), session.location(frame.span)
            answers.append({"id": number, "name": frame.title, "source": session.source(frame.span), **location})
    return {"stackFrames": answers, "totalFrames": len(frames)}


def scopes(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``scopes``: locals, variables, frames, arms, the run."""
    debugger = session.stopped_debugger
    arguments.get(int, "frameId")  # must be there
    frame = session.frame(arguments)
    names = {scope.name: _add_reference(session, scope, frame) for scope in debugger.scopes(*frame)}
    return {"scopes": [{"name": name, "variablesReference": names[name], "expensive": False} for name in names]}


def variables(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``variables``: what is inside of something."""
    session.launched_debugger  # noqa: B018 - there must be a program
    group, frame = session.variables(arguments)
    if arguments.get(str, "filter", "") == ("named" if isinstance(group, ArrayElements) else "indexed"):
        group = ()
    first, count = arguments.get(int, "start", 0), arguments.get(int, "count", 0) or _MAX_ELEMENTS
    listed = group[first : first + count]
    return {"variables": [{"name": line.name, **_variable_body(session, line, frame)} for line in listed]}


def evaluate(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``evaluate``: any expression of the language, or the tree of frames.

    In the console ``hit = 7`` gives a value, as it does in a program; for a comparison one writes ``(hit = 7)``.
    """
    debugger = session.stopped_debugger
    frame = session.frame(arguments)
    text = arguments.get(str, "expression").strip().rstrip(";")
    assignment = _ASSIGNMENT.fullmatch(text) if arguments.get(str, "context", "") == "repl" else None
    if assignment is None:
        answer = _variable_body(session, debugger.evaluate(text, *frame), frame)
    else:
        refusal = f"`{assignment[1]}` cannot be assigned a value; for a comparison write `({text})`"
        slot = debugger.evaluate(assignment[1], *frame).slot
        answer = _assign(session, frame, slot, assignment[2], refusal)
    return {"result": answer.pop("value"), **answer}


def set_variable(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setVariable``: give what is shown another value."""
    session.stopped_debugger  # noqa: B018 - the program must stand still
    name, (group, frame) = arguments.get(str, "name"), session.variables(arguments)
    slot, value = _slot_named(group, name), arguments.get(str, "value")
    return _assign(session, frame, slot, value, f"{name} cannot be assigned a value")


def set_expression(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setExpression``: the same for what an expression names."""
    debugger = session.stopped_debugger
    frame = session.frame(arguments)
    slot, value = debugger.evaluate(arguments.get(str, "expression"), *frame).slot, arguments.get(str, "value")
    return _assign(session, frame, slot, value, "only variables, frames and elements can be assigned a value")


def completions(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``completions``: names that begin with what has been typed."""
    debugger = session.stopped_debugger
    column = arguments.get(int, "column") - session.first_column
    ruler = PositionCodec(arguments.get(str, "text"), UTF_16)
    end = ruler.offset(arguments.get(int, "line", session.first_line) - session.first_line, column)
    match = _WORD.search(ruler.text[:end])
    typed = match[0] if match else ""
    path, level = session.frame(arguments)
    procedure = debugger.stack(path)[level].procedure
    names = names_to_write(debugger.machine, procedure)
    words = sorted({*names, *FUNCTIONS, *debugger.machine.cell.arms, "frames"}, key=str.upper)
    start = column - len(typed) + session.first_column
    return {
        "targets": [
            {"label": word, "start": start, "length": len(typed), "type": "function" if word in FUNCTIONS else "value"}
            for word in words
            if word.upper().startswith(typed.upper())
        ]
    }


def exception_info(session: EditorSession, _: Arguments) -> dict[str, Any]:
    """Answer ``exceptionInfo``: what went wrong, with the lines."""
    stop = session.stopped_debugger.stop
    if stop is None or stop.reason != "exception":
        raise RequestError("no error has stopped the program")
    diagnostic = stop.diagnostic
    mode = "always" if stop.caught else "unhandled"
    if diagnostic is None:
        return {"exceptionId": stop.text.partition(" ")[0], "description": stop.text, "breakMode": mode}
    page = render([diagnostic], session.stopped_debugger.code.source)
    details = {"message": diagnostic.message, "stackTrace": page}
    return {"exceptionId": diagnostic.code, "description": diagnostic.message, "breakMode": mode, "details": details}


def source(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``source``: the text of the program or of a module as it was when it was loaded."""
    text = session.launched_debugger.code.source
    file = session.file_number(arguments.get(int, "sourceReference", CODE_SOURCE_REFERENCE))
    return {"content": text.file_text(file or 0)}


def _slot_named(group: Iterable[Variable], name: str) -> str | None:
    """Return where the variable of a name is kept; None where there is none, or it is kept nowhere."""
    return next((variable.slot for variable in group if variable.name == name), None)


def _assign(session: EditorSession, frame: FrameReference, slot: str | None, text: str, refusal: str) -> dict[str, Any]:
    """Give what is kept somewhere the value of an expression; what is kept nowhere is refused."""
    if slot is None:
        raise RequestError(refusal)
    return _variable_body(session, session.stopped_debugger.assign(slot, text, *frame), frame)


def _add_reference(session: EditorSession, variable: Variable, frame: FrameReference) -> int:
    """Return the number under which a variable can be opened; 0 where there is nothing in it."""
    if variable.children is None:
        return 0
    session.variable_references.append((variable, frame))
    return len(session.variable_references)


def _variable_body(session: EditorSession, variable: Variable, frame: FrameReference) -> dict[str, Any]:
    answer = {"value": variable.value, "type": variable.type}
    optional = {"indexedVariables": variable.element_count, "evaluateName": variable.expression}
    reference = _add_reference(session, variable, frame)
    return {**answer, "variablesReference": reference, **{key: value for key, value in optional.items() if value}}


# What each request lets the program do; ``stepStage`` is a request of this adapter alone.
_STEPS: Mapping[str, Command] = {
    "continue": "continue",
    "next": "next",
    "stepIn": "in",
    "stepOut": "out",
    "stepStage": "stage",
    "stepBack": "back",
    "reverseContinue": "reverse",
}
_SESSION = (initialize, launch, configuration_done, restart, pause, terminate, disconnect, set_exception_breakpoints)
_BREAKPOINTS = (set_breakpoints, breakpoint_locations, data_breakpoint_info, set_data_breakpoints)
_INSPECTION = (threads, stack_trace, scopes, variables, evaluate, set_variable, set_expression, completions)
_TEXTS = (exception_info, source)


def _request_name(function: Callable[..., object]) -> str:
    """Return the name of a request in the protocol: that of its function, in camel case."""
    first, *others = function.__name__.split("_")
    return first + "".join(map(str.capitalize, others))


# What answers each request.
REQUESTS: Mapping[str, Callable[[EditorSession, Arguments], Mapping[str, Any] | None]] = {
    **{_request_name(function): function for function in (*_SESSION, *_BREAKPOINTS, *_INSPECTION, *_TEXTS)},
    **{request: partial(_resume, command) for request, command in _STEPS.items()},
}
