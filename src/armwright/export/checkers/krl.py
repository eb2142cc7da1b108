"""Reading KRL as far as it is written in plan mode."""

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
from armwright.export.checkers.grammar import fields, number, parse
from armwright.export.checkers.orientations import from_zyx_degrees

_FRAME, _AXES = tuple("XYZABC"), tuple(f"A{i}" for i in range(1, 7))

# What is set once: where frames are counted from, and that the program goes on while a text is shown.
_FIXED = {"$BASE": "$NULLFRAME", "$IPO_MODE": "#BASE", "$LOOP_CONT": "TRUE"}
_SETTINGS = ("$VEL.CP", "$VEL.ORI1", "$VEL.ORI2", "$ACC.CP", "$APO.CDIS", "$APO.CPTP")


def read(text: str) -> ReadProgram:
    """Return what a program in KRL does.

    Raises:
        CheckError: it has a statement that the checker does not know.
    """
    units = [node for node in parse("krl", text).children if hasattr(node, "data")]
    if len(units) != 1 or units[0].data != "procedure" or units[0].children[1] is not None:
        raise CheckError("line 1: expected one procedure without parameters")
    reader = _Reader()
    for statement in units[0].children[2:]:
        reader.statement(statement.children[0], statement.meta.line)
    return ReadProgram(name=str(units[0].children[0]), X_CT=reader.tool, actions=tuple(reader.actions))


class _Reader:
    """The settings of the controller while its program is read."""

    def __init__(self) -> None:
        self.tool = np.eye(4)
        self.actions: list[Action] = []
        self._percent: float | None = None
        self._settings: dict[str, float] = {}

    def statement(self, node: Any, line: int) -> None:
        """Read one statement."""
        match getattr(node, "data", None):
            case "motion":
                self._motion(node, line)
            case "assign":
                self._assign(node, line)
            case "call":
                self._call(node, line)
            case "wait_for":
                if node.children[0].data != "call" or _target(node.children[0].children[0], line) != "STRCLEAR":
                    raise CheckError(f"line {line}: the checker knows WAIT FOR StrClear alone")
            case "wait":
                self.actions.append(WaitAction(line=line, seconds=number(node.children[0], line)))
            case other:
                raise CheckError(f"line {line}: the checker does not know this statement ({other})")

    def _motion(self, node: Any, line: int) -> None:
        kind, record, *ways = node.children
        if record.data != "numbers":
            raise CheckError(f"line {line}: expected plain numbers in braces")
        values = fields(str(record.children[0]))
        passes = bool(ways)
        if kind.upper() == "PTP" and tuple(values) == _AXES:
            q = np.deg2rad([values[axis] for axis in _AXES])
            part = None if self._percent is None else self._percent / 100.0
            self.actions.append(JointAction(line=line, q=q, speed_part=part, passes=passes))
        elif kind.upper() == "LIN" and tuple(values) == (*_FRAME, "S", "T"):
            words = {word: int(values[word]) for word in "ST"}
            zone = self._settings.get("$APO.CDIS", 0.0) * 1e-3 if passes else 0.0
            speed, turn = self._settings.get("$VEL.CP"), float(np.deg2rad(self._settings.get("$VEL.ORI1", 0.0)))
            X = _frame(values)
            self.actions.append(
                LineAction(line=line, X=X, configuration=words, speed=speed, turn_speed=turn, zone=zone)
            )
        else:
            raise CheckError(f"line {line}: the checker knows PTP to axes, and LIN to a frame with S and T")

    def _assign(self, node: Any, line: int) -> None:
        target, value = node.children
        name = _target(target, line)
        if name.startswith("$OUT["):
            self.actions.append(OutputAction(line=line, output=int(name[5:-1]), on=_truth(value, line)))
        elif name == "$LOOP_MSG[]":
            self.actions.append(TextAction(line=line, text=str(value.children[0])[1:-1]))
        elif name == "$TOOL":
            self.tool = _frame(fields(str(value.children[0])))
        elif name in _FIXED:
            if _word(value, line) != _FIXED[name]:
                raise CheckError(f"line {line}: expected {_FIXED[name]}")
        elif name in _SETTINGS:
            self._settings[name] = number(value, line)
        else:
            raise CheckError(f"line {line}: the checker does not know {name}")

    def _call(self, node: Any, line: int) -> None:
        name, *arguments = node.children
        values = [argument.children[0] for argument in arguments]
        match str(name).upper(), [str(value.children[0]) for value in values]:
            case "BAS", ["#INITMOV", _]:
                pass
            case "BAS", ["#VEL_PTP", _]:
                self._percent = number(values[1], line)
            case _:
                raise CheckError(f"line {line}: the checker does not know {name}")


def _target(node: Any, line: int) -> str:
    """Return a variable as it is written, with its parts and its index."""
    first, *others = node.children
    text = str(first).upper()
    for other in others:
        if other is None:
            text += "[]"
        else:
            text += f"[{number(other, line):g}]" if hasattr(other, "data") else f".{str(other).upper()}"
    return text


def _word(node: Any, line: int) -> str:
    """Return a variable, or a word of an enumeration."""
    return str(node.children[0]) if node.data == "enum" else _target(node.children[0], line)


def _truth(node: Any, line: int) -> bool:
    word = _word(node, line) if node.data == "name" else ""
    if word not in ("TRUE", "FALSE"):
        raise CheckError(f"line {line}: expected TRUE or FALSE")
    return word == "TRUE"


def _frame(values: dict[str, float]) -> Array:
    X = np.eye(4)
    X[:3, :3] = from_zyx_degrees([values[name] for name in "ABC"])
    X[:3, 3] = np.array([values[name] for name in "XYZ"]) / 1000.0
    return X
