"""Reading RAPID as far as it is written in plan mode."""

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
from armwright.export.checkers.orientations import from_quaternion

_WORDS = ("cf1", "cf4", "cf6", "cfx")
# How far the square of the length of a quaternion may be off one.
_NORM = 1e-6
# Of zone data: the part for the tool point.
_PATH_ZONE = 1


def read(text: str) -> ReadProgram:
    """Return what a module of RAPID does.

    Raises:
        CheckError: it has a statement that the checker does not know.
    """
    modules = parse("rapid", text).children
    if len(modules) != 1:
        raise CheckError("line 1: expected one module")
    name, *items = (item for item in modules[0].children if item is not None)
    tools: dict[str, Array] = {}
    actions: list[Action] = []
    for item in items:
        line = item.meta.line
        if item.data == "declare":
            _, kind, declared, _, value = item.children
            if kind != "tooldata":
                raise CheckError(f"line {line}: the checker knows data of tools alone")
            tools[str(declared)] = _frame(value.children[1], line)
        elif item.data == "procedure" and str(item.children[0]).lower() == "main":
            for statement in item.children[2:]:
                actions += _statement(statement, tools)
        else:
            raise CheckError(f"line {line}: expected data of a tool, or the procedure main")
    if len(tools) != 1:
        raise CheckError("line 1: expected one tool")
    return ReadProgram(name=str(name), X_CT=next(iter(tools.values())), actions=tuple(actions))


def _statement(node: Any, tools: dict[str, Array]) -> list[Action]:
    """Return what one statement does."""
    line = node.meta.line
    if node.data != "call":
        raise CheckError(f"line {line}: the checker does not know this statement ({node.data})")
    called = str(node.children[0])
    arguments = node.children[1].children if node.children[1] is not None else []
    values = [argument.children[0] for argument in arguments]
    match called:
        case "ConfL":
            return []
        case "MoveAbsJ":
            q = np.deg2rad(vector(_numbers(values[0].children[0], line), 6, line))
            _known_tool(values[3], tools, line)
            return [JointAction(line=line, q=q, duration=_time(arguments[1]), passes=_zone(values[2], line) > 0)]
        case "MoveL":
            return [_straight(arguments, values, tools, line)]
        case "SetDO":
            return [OutputAction(line=line, output=_name(values[0], line), on=number(values[1], line) == 1)]
        case "WaitTime":
            return [WaitAction(line=line, seconds=number(values[0], line))]
        case "TPWrite":
            shown = str(values[0].children[0])[1:-1].replace('""', '"').replace("\\\\", "\\")
            return [TextAction(line=line, text=shown)]
    raise CheckError(f"line {line}: the checker does not know {called}")


def _straight(arguments: list[Any], values: list[Any], tools: dict[str, Array], line: int) -> LineAction:
    target = values[0]
    position, orientation, configuration, _ = target.children
    X = _frame_of(position, orientation, line)
    words = vector(_numbers(configuration, line), 4, line)
    _known_tool(values[3], tools, line)
    timed = _time(arguments[1])
    speed = turn = None
    if timed is None:
        speed, turn, *_ = vector(_numbers(values[1], line), 4, line) * (1e-3, np.pi / 180, 1.0, 1.0)
    return LineAction(
        line=line,
        X=X,
        configuration={word: int(value) for word, value in zip(_WORDS, words, strict=True)},
        duration=timed,
        speed=speed,
        turn_speed=turn,
        zone=_zone(values[2], line),
    )


def _time(argument: Any) -> float | None:
    """Return the time of the switch T of an argument [s]; None without it."""
    for switch in argument.children[1:]:
        if str(switch.children[0]) == "T":
            return number(switch.children[1], argument.meta.line)
    return None


def _zone(node: Any, line: int) -> float:
    """Return how far from its end a motion may pass into the next [m]."""
    if node.data == "name":
        word = _name(node, line)
        return 0.0 if word == "fine" else float(word[1:]) * 1e-3
    return number(node.children[_PATH_ZONE], line) * 1e-3


def _known_tool(node: Any, tools: dict[str, Array], line: int) -> None:
    if _name(node, line) not in tools:
        raise CheckError(f"line {line}: the tool is not declared")


def _name(node: Any, line: int) -> str:
    if node.data != "name":
        raise CheckError(f"line {line}: expected a name")
    return str(node.children[0].children[0])


def _numbers(node: Any, line: int) -> str:
    if node.data != "numbers":
        raise CheckError(f"line {line}: expected plain numbers in brackets")
    return str(node.children[0])


def _frame(node: Any, line: int) -> Array:
    return _frame_of(node.children[0], node.children[1], line)


def _frame_of(position: Any, orientation: Any, line: int) -> Array:
    X = np.eye(4)
    X[:3, 3] = vector(_numbers(position, line), 3, line) / 1000.0
    quaternion = vector(_numbers(orientation, line), 4, line)
    if abs(quaternion @ quaternion - 1.0) > _NORM:
        raise CheckError(f"line {line}: expected a quaternion of length one")
    X[:3, :3] = from_quaternion(quaternion)
    return X
