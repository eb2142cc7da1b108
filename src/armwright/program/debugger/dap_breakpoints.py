"""Requests about breakpoints."""

import os
from pathlib import Path
from typing import Any

from armwright.errors import ArmwrightError
from armwright.program.debugger.dap_messages import Arguments
from armwright.program.debugger.dap_session import CODE_SOURCE_REFERENCE, EditorSession


def set_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setBreakpoints``: those of a file, instead of all it had."""
    source = arguments.get_object("source")
    requests = arguments.get_objects("breakpoints")
    for request in requests:
        request.get(int, "line")
    if session.launch is not None and not _is_debugged(session, source):
        message = "this is not the program that is debugged"
        return {"breakpoints": [{"id": next(session.ids), "verified": False, "message": message} for _ in requests]}
    if session.debugger is not None:
        session.debugger.execution.breakpoints.clear()
    session.breakpoints = [(next(session.ids), request) for request in requests]
    return {"breakpoints": [session.set_breakpoint(*request) for request in session.breakpoints]}


def _is_debugged(session: EditorSession, source: Arguments) -> bool:
    """Whether a text is that of the program, which lies in a file of its own or in a file of code."""
    if session.loaded is not None and session.loaded.is_code_file:
        return source.get(int, "sourceReference", 0) == CODE_SOURCE_REFERENCE
    path = source.get(str, "path", "")
    return bool(path) and session.launch is not None and _is_same_file(path, session.launch.program)


def _is_same_file(path: str, program: Path) -> bool:
    try:
        return os.path.realpath(path) == os.path.realpath(program)
    except ValueError:  # a zero byte
        return False


def breakpoint_locations(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``breakpointLocations``: where statements begin."""
    first = arguments.get(int, "line")
    offset = 1 - session.first_line
    statements = session.launched_debugger.execution.statements
    starts = statements.in_lines(first + offset, arguments.get(int, "endLine", first) + offset)
    return {"breakpoints": [session.location(start.span) for start in starts]}


def data_breakpoint_info(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``dataBreakpointInfo``: what of all that is shown can be watched."""
    name = arguments.get(str, "name")
    debugger = session.stopped_debugger
    try:
        if arguments.get(int, "variablesReference", 0):
            variables, _, _ = session.variables(arguments)
            slot = next((variable.slot for variable in variables if variable.name == name), None)
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
    session.data_breakpoints = [
        (next(session.ids), part.get(str, "dataId"), part.get(str, "condition", ""), part.get(str, "hitCondition", ""))
        for part in arguments.get_objects("breakpoints")
    ]
    debugger.execution.watches.clear()
    return {"breakpoints": [session.watch(*request) for request in session.data_breakpoints]}


def set_exception_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setExceptionBreakpoints``: which errors to stop at."""
    session.exception_filters = frozenset(map(str, arguments.get(list, "filters", [])))
    if session.debugger is not None:
        session.debugger.execution.exception_filters = session.exception_filters
    return {}
