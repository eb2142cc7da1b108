"""Requests about breakpoints."""

import os
from pathlib import Path
from typing import Any

from armwright.errors import ArmwrightError
from armwright.program.debugger.dap_messages import Arguments, RequestError
from armwright.program.debugger.dap_session import LISTED, EditorSession


def set_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setBreakpoints``: those of a file, instead of all it had."""
    source = arguments.part("source")
    requests = arguments.parts("breakpoints")
    for request in requests:
        request.whole("line")
    if session.launch is not None and not _is_debugged(session, source):
        message = "this is not the program that is debugged"
        return {"breakpoints": [{"id": session.number(), "verified": False, "message": message} for _ in requests]}
    if session.debugger is not None:
        session.debugger.clear(breakpoints=True)
    session.wanted = [(session.number(), request) for request in requests]
    return {"breakpoints": [session.bound(*request) for request in session.wanted]}


def _is_debugged(session: EditorSession, source: Arguments) -> bool:
    """Whether a text is that of the program, which lies in a file of its own or in a file of code."""
    if session.loaded is not None and session.loaded.is_listed:
        return source.whole("sourceReference", 0) == LISTED
    path = source.text("path", "")
    return bool(path) and session.launch is not None and _same(path, session.launch.program)


def _same(path: str, program: Path) -> bool:
    try:
        return os.path.realpath(path) == os.path.realpath(program)
    except ValueError:  # a zero byte
        return False


def breakpoint_locations(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``breakpointLocations``: where statements begin."""
    first = arguments.whole("line")
    offset = 1 - session.first_line
    starts = session.live.places(first + offset, arguments.whole("endLine", first) + offset)
    return {"breakpoints": [session.place(location.span) for location in starts]}


def data_breakpoint_info(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``dataBreakpointInfo``: what of all that is shown can be watched."""
    name = arguments.text("name")
    debugger = session.standing
    reference = arguments.whole("variablesReference", 0)
    try:
        if reference:
            shown = next((request for request in _inside(session, reference) if request.name == name), None)
            slot = None if shown is None else shown.kept
        else:
            frame = arguments.whole("frameId", 0)
            path, level = session.frames[frame - 1] if 0 < frame <= len(session.frames) else ((), 0)
            slot = debugger.evaluate(name, path, level).kept
    except ArmwrightError as error:
        return {"dataId": None, "description": str(error)}
    if slot is None or debugger.machine.type_of(slot).sizes:
        return {"dataId": None, "description": f"{name} is no frame and no variable"}
    spelled = debugger.code.spelled(slot)
    return {"dataId": slot, "description": spelled, "accessTypes": ["write"], "canPersist": "'" not in slot}


def _inside(session: EditorSession, reference: int) -> Any:
    if not 0 < reference <= len(session.opened):
        raise RequestError(f"there is nothing to open under {reference}")
    inside = session.opened[reference - 1][0].inside
    return () if inside is None else inside()


def set_data_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setDataBreakpoints``: all frames and variables that are watched, instead of those before."""
    debugger = session.live
    requests = [
        (session.number(), part.text("dataId"), part.text("condition", ""), part.text("hitCondition", ""))
        for part in arguments.parts("breakpoints")
    ]
    debugger.clear(watches=True)
    session.watched = requests
    return {"breakpoints": [session.watch(*request) for request in requests]}


def set_exception_breakpoints(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setExceptionBreakpoints``: which errors to stop at."""
    filters = arguments.given.get("filters", [])
    if not isinstance(filters, list):
        raise RequestError("filters: expected a list")
    session.catches = frozenset(str(request) for request in filters)
    session.catch()
    return {}
