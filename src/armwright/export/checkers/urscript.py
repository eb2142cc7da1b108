"""Reading URScript as far as it is written in plan mode."""

from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.export.checkers.actions import (
    Action,
    CheckError,
    JointAction,
    LineAction,
    OutputAction,
    ReadProgram,
    TextAction,
    WaitAction,
)
from armwright.export.checkers.grammar import number, parse, vector
from armwright.export.checkers.orientations import from_rotation_vector

_JOINTS = 6


def read(text: str) -> ReadProgram:
    """Return what a program in URScript does.

    Raises:
        CheckError: it has a statement that the checker does not know.
    """
    tree = parse("urscript", text)
    functions = [node for node in tree.children if node.data == "function"]
    calls = [node for node in tree.children if node.data == "call"]
    if len(functions) != 1 or len(calls) != 1 or len(tree.children) != 2:
        raise CheckError("line 1: expected one function and its call")
    name, parameters, *statements = functions[0].children
    if parameters is not None or str(calls[0].children[0].children[0]) != name:
        raise CheckError(f"line {calls[0].meta.line}: expected a call of {name}")
    tool, actions = np.eye(4), list[Action]()
    for node in statements:
        line = node.meta.line
        if node.data != "call":
            raise CheckError(f"line {line}: the checker does not know this statement ({node.data})")
        called, positional, named = _call(node)
        if called == "set_tcp":
            tool = _pose(positional[0], line)
        elif called != "stopj":  # a stream has come to rest before
            actions.append(_action(called, positional, named, line))
    return ReadProgram(name=str(name), X_CT=tool, actions=tuple(actions))


def _action(called: str, positional: list[Any], named: dict[str, float], line: int) -> Action:
    """Return what one call does."""
    match called:
        case "movej" | "servoj":
            q, streamed = vector(_numbers(positional[0], line), _JOINTS, line), called == "servoj"
            return JointAction(line=line, q=q, duration=named.get("t"), passes="r" in named, streamed=streamed)
        case "movel":
            X, zone = _pose(positional[0], line), named.get("r", 0.0)
            return LineAction(line=line, X=X, duration=named.get("t"), speed=named.get("v"), zone=zone)
        case "set_standard_digital_out":
            output = int(number(positional[0], line))
            return OutputAction(line=line, output=output, on=positional[1].data == "true")
        case "sleep":
            return WaitAction(line=line, seconds=number(positional[0], line))
        case "textmsg":
            return TextAction(line=line, text=str(positional[0].children[0])[1:-1])
    raise CheckError(f"line {line}: the checker does not know {called}")


def _call(node: Any) -> tuple[str, list[Any], dict[str, float]]:
    """Return the name of what is called, its arguments by position, and the numbers by name."""
    target, *arguments = node.children
    positional, named = [], {}
    for argument in arguments:
        if argument is None:
            continue
        name, value = argument.children
        if name is None:
            positional.append(value)
        else:
            named[str(name)] = number(value, node.meta.line)
    return str(target.children[0]), positional, named


def _numbers(node: Any, line: int) -> str:
    if node.data != "numbers":
        raise CheckError(f"line {line}: expected plain numbers in brackets")
    return str(node.children[0])


def _pose(node: Any, line: int) -> Array:
    text = _numbers(node, line)
    if not text.startswith("p"):
        raise CheckError(f"line {line}: expected a pose")
    numbers = vector(text, 6, line)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = from_rotation_vector(numbers[3:]), numbers[:3]
    return X
