"""Requests about what a program that stands still looks like: stacks, variables, expressions."""

import re
from typing import Any

from armwright.program.debugger.dap_messages import Arguments, RequestError
from armwright.program.debugger.dap_session import EditorSession
from armwright.program.debugger.expressions import visible_names
from armwright.program.debugger.history import ProcessPath
from armwright.program.debugger.variables import ArrayElements, Variable
from armwright.program.diagnostics.render import render
from armwright.program.language.position_codec import UTF_16, PositionCodec
from armwright.program.semantics.builtins import FUNCTIONS

# So many elements are sent to an editor that does not say how many it wants.
_MAX_ELEMENTS = 1000
# What gives a variable or an element a value.
_ASSIGNMENT = re.compile(r"([A-Za-z][\w-]*(?:\s*\[[^\[\]]*\])?)\s*=\s*(.+)", re.DOTALL)
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*$")


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
            location = session.location(frame.span)
            answers.append(
                {"id": len(session.frame_references), "name": frame.title, "source": session.source(), **location}
            )
    return {"stackFrames": answers, "totalFrames": len(frames)}


def scopes(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``scopes``: locals, variables, frames, arms, the run."""
    debugger = session.stopped_debugger
    arguments.get(int, "frameId")  # must be there
    path, level = session.frame(arguments)
    answers = []
    for scope in debugger.scopes(path, level):
        reference = _add_reference(session, scope, path, level)
        answers.append({"name": scope.name, "variablesReference": reference, "expensive": False})
    return {"scopes": answers}


def variables(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``variables``: what is inside of something."""
    session.launched_debugger  # noqa: B018 - there must be a program
    group, path, level = session.variables(arguments)
    if arguments.get(str, "filter", "") == ("named" if isinstance(group, ArrayElements) else "indexed"):
        group = ()
    first, count = arguments.get(int, "start", 0), arguments.get(int, "count", 0) or _MAX_ELEMENTS
    listed = group[first : first + count]
    return {
        "variables": [{"name": variable.name, **_variable_body(session, variable, path, level)} for variable in listed]
    }


def evaluate(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``evaluate``: any expression of the language, or the tree of frames.

    In the console ``hit = 7`` gives a value, as it does in a program; for a comparison one writes ``(hit = 7)``.
    """
    debugger = session.stopped_debugger
    path, level = session.frame(arguments)
    text = arguments.get(str, "expression").strip().rstrip(";")
    assignment = _ASSIGNMENT.fullmatch(text) if arguments.get(str, "context", "") == "repl" else None
    if assignment is None:
        variable = debugger.evaluate(text, path, level)
    else:
        slot = debugger.evaluate(assignment[1], path, level).slot
        if slot is None:
            raise RequestError(f"`{assignment[1]}` cannot be assigned a value; for a comparison write `({text})`")
        variable = debugger.assign(slot, assignment[2], path, level)
    answer = _variable_body(session, variable, path, level)
    return {"result": answer.pop("value"), **answer}


def set_variable(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setVariable``: give what is shown another value."""
    name, debugger = arguments.get(str, "name"), session.stopped_debugger
    group, path, level = session.variables(arguments)
    slot = next((variable.slot for variable in group if variable.name == name), None)
    if slot is None:
        raise RequestError(f"{name} cannot be assigned a value")
    return _variable_body(session, debugger.assign(slot, arguments.get(str, "value"), path, level), path, level)


def set_expression(session: EditorSession, arguments: Arguments) -> dict[str, Any]:
    """Answer ``setExpression``: the same for what an expression names."""
    debugger = session.stopped_debugger
    path, level = session.frame(arguments)
    slot = debugger.evaluate(arguments.get(str, "expression"), path, level).slot
    if slot is None:
        raise RequestError("only variables, frames and elements can be assigned a value")
    return _variable_body(session, debugger.assign(slot, arguments.get(str, "value"), path, level), path, level)


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
    names = [debugger.code.spelled(name) for name in visible_names(debugger.machine, procedure)]
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


def source(session: EditorSession, _: Arguments) -> dict[str, Any]:
    """Answer ``source``: the text as it was when it was loaded."""
    return {"content": session.launched_debugger.code.source.text}


def _add_reference(session: EditorSession, variable: Variable, path: ProcessPath, level: int) -> int:
    """Return the number under which a variable can be opened; 0 where there is nothing in it."""
    if variable.children is None:
        return 0
    session.variable_references.append((variable, path, level))
    return len(session.variable_references)


def _variable_body(session: EditorSession, variable: Variable, path: ProcessPath, level: int) -> dict[str, Any]:
    answer = {"value": variable.value, "type": variable.type}
    optional = {"indexedVariables": variable.element_count, "evaluateName": variable.expression}
    reference = _add_reference(session, variable, path, level)
    return {**answer, "variablesReference": reference, **{key: value for key, value in optional.items() if value}}
