"""Reading programs of FANUC's pendant as far as they are written in plan mode."""

import re
from collections.abc import Mapping
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
from armwright.export.checkers.grammar import number, parse
from armwright.export.checkers.orientations import from_zyx_degrees

_JOINTS = 6
_PLACE = re.compile(r"P\[(\d+)\]\{\s*GP1:\s*UF : 0, UT : (\d+),\s*(J1=[^}]*?)\s*\};")
_JOINT = re.compile(r"J(\d)= *(-?\d+\.\d+) deg")
_SPEED = re.compile(r"(\d+(?:\.\d*)?)(msec|sec|%)")
# Of units of time: their length, and how far a time is rounded up for its digits [s].
TIMES = {"msec": (1e-3, 1e-3), "sec": (1.0, 0.1)}
WAIT_ROUNDING = 0.01


def read(text: str) -> ReadProgram:
    """Return what a program of the pendant does.

    Raises:
        CheckError: it has a statement that the checker does not know.
    """
    tree = parse("fanuc", text)
    name = next(str(node) for node in tree.children if getattr(node, "type", "") == "NAME")
    places = [node for node in tree.children if getattr(node, "type", "") == "POSITION"]
    reader = _Reader(dict(position(node) for node in places))
    for line in tree.find_data("line"):
        if line.children[0] is not None:
            reader.statement(line.children[0], line.meta.line)
    if reader.tool is None:
        raise CheckError("line 1: the program sets no tool")
    return ReadProgram(name=name, X_CT=reader.tool, actions=tuple(reader.actions))


class _Reader:
    """The registers of the controller while its program is read."""

    def __init__(self, places: Mapping[str, tuple[str, Array]]) -> None:
        self.tool: Array | None = None
        self.actions: list[Action] = []
        self._places = places
        # The numbers of the position register; None while it may hold joints.
        self._register: dict[int, float] | None = None
        self._tool_number = ""

    def statement(self, node: Any, line: int) -> None:
        """Read one statement."""
        match node.data:
            case "comment":
                pass
            case "motion":
                self._motion(node, line)
            case "assign":
                self._assign(str(node.children[0].children[0]), node.children[1], line)
            case "wait" if str(node.children[1]) == "(sec)":
                seconds = number(node.children[0], line)
                self.actions.append(WaitAction(line=line, seconds=seconds, rounding=WAIT_ROUNDING))
            case "message":
                self.actions.append(TextAction(line=line, text=str(node.children[0])[len("MESSAGE[") : -1]))
            case other:
                raise CheckError(f"line {line}: the checker does not know this statement ({other})")

    def _motion(self, node: Any, line: int) -> None:
        kind, place, speed, end, *others = node.children
        tool, q = self._places.get(str(place), (None, None))
        found = _SPEED.fullmatch(speed)
        if q is None or tool != self._tool_number or found is None or any(others):
            raise CheckError(f"line {line}: the checker knows motions to joint positions with the tool in a time alone")
        value, unit = float(found[1]), found[2]
        length, rounding = TIMES.get(unit, (0.0, 0.0))
        duration = value * length if length else None
        passes = end not in ("FINE", "CNT0")
        if kind == "J":
            part = None if length else value / 100.0
            joints = JointAction(line=line, q=q, duration=duration, speed_part=part, passes=passes, rounding=rounding)
            self.actions.append(joints)
        elif kind == "L" and length and not passes:
            self.actions.append(LineAction(line=line, q=q, duration=duration, rounding=rounding))
        else:
            raise CheckError(f"line {line}: the checker knows straight lines in a time, with a stop, alone")

    def _assign(self, target: str, value: Any, line: int) -> None:
        said = str(value.children[0]) if value.data in ("name", "register", "number") else ""
        if (output := re.fullmatch(r"DO\[(\d+)\]", target)) and said in ("ON", "OFF"):
            self.actions.append(OutputAction(line=line, output=int(output[1]), on=said == "ON"))
        elif (target, said) == ("PR[9]", "LPOS"):
            self._register = {}
        elif self._register is not None and (part := re.fullmatch(r"PR\[9,([1-6])\]", target)):
            self._register[int(part[1])] = number(value, line)
        elif (target, said) == ("UTOOL[9]", "PR[9]") and self._register and len(self._register) == _JOINTS:
            X = np.eye(4)
            X[:3, :3] = from_zyx_degrees([self._register[i] for i in (6, 5, 4)])
            X[:3, 3] = np.array([self._register[i] for i in (1, 2, 3)]) / 1000.0
            self.tool = X
        elif (target, said) == ("UTOOL_NUM", "9") and self.tool is not None:
            self._tool_number = said
        elif (target, said) != ("UFRAME_NUM", "0"):
            raise CheckError(f"line {line}: the checker does not know what {target} is set to here")


def position(token: Any) -> tuple[str, tuple[str, Array]]:
    """Return the name of a position, its tool and its joint positions (6,) as the controller counts them [rad]."""
    found = _PLACE.fullmatch(token)
    joints = _JOINT.findall(found[3]) if found is not None else []
    if found is None or [int(joint) for joint, _ in joints] != list(range(1, _JOINTS + 1)):
        raise CheckError(f"line {token.line}: the checker knows positions as six joints alone")
    return f"P[{found[1]}]", (found[2], np.deg2rad([float(angle) for _, angle in joints]))
