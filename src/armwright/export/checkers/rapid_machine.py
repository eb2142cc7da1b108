"""Running programs in RAPID, as far as program mode writes them."""

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.export.checkers.actions import (
    CheckError,
    JointAction,
    LineAction,
    OutputAction,
    PulseAction,
    ReadProgram,
    TextAction,
    WaitAction,
)
from armwright.export.checkers.grammar import parse
from armwright.export.checkers.machine import (
    EndProgram,
    Machine,
    ReturnValue,
    World,
    arithmetic,
    pose_of,
)
from armwright.export.checkers.orientations import from_quaternion, from_zyx_degrees

_WORDS = ("cf1", "cf4", "cf6", "cfx")
_INITIAL: dict[str, Any] = {"num": 0.0, "bool": False, "string": ""}
# How far the square of the length of a quaternion may be off one.
_NORM = 1e-6
# Of zone data: the part for the tool point.
_PATH_ZONE = 1
_SIMPLE: dict[str, Callable[[float], float]] = {
    "Abs": abs,
    "Sqrt": math.sqrt,
    "Round": lambda value: math.floor(value + 0.5),
}
_ANGLES: dict[str, Callable[[float], float]] = {"Sin": math.sin, "Cos": math.cos, "Tan": math.tan}


def run(texts: Sequence[str], world: World) -> ReadProgram:
    """Return what a module of RAPID does in a cell.

    Raises:
        CheckError: it has what the machine does not know, or does not come to its end.
    """
    modules = [module for text in texts for module in parse("rapid", text).children]
    if len(modules) != 1:
        raise CheckError("line 1: expected one module")
    name, *items = (item for item in modules[0].children if item is not None)
    machine = _Machine(world)
    for item in items:
        if item.data == "declare":
            machine.declare(item)
        elif item.data in ("procedure", "function"):
            key = item.children[0 if item.data == "procedure" else 1]
            machine.routines[str(key).lower()] = item
        else:
            raise CheckError(f"line {item.meta.line}: expected data or a routine")
    if "main" not in machine.routines:
        raise CheckError("line 1: expected the procedure main")
    with suppress(EndProgram):
        machine.routine("main", [], 1)
    return machine.read_program(str(name))


class _Machine(Machine):
    """A controller that runs RAPID.

    Attributes:
        routines: by name in lower case.
        kinds: of variables.
    """

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.routines: dict[str, Any] = {}
        self.kinds: dict[str, str] = {}
        self._follows = True

    def declare(self, node: Any) -> None:
        """Declare data of the module."""
        _, kind, name, *others = (one for one in node.children if one is not None)
        key = str(name).lower()
        self.kinds[key] = str(kind)
        if str(kind) in ("tooldata", "wobjdata"):
            parts = self.value(others[-1])
            self.variables[key] = _pose(parts[1] if str(kind) == "tooldata" else parts[3], node.meta.line)
            if str(kind) == "tooldata":
                self.X_CT = self.variables[key]
        else:
            self.variables[key] = {} if others else _INITIAL.get(str(kind))

    # ---- statements ------------------------------------------------------------------------------------------------

    def block(self, statements: Iterable[Any]) -> None:
        """Run statements."""
        for node in statements:
            self.count_step(node.meta.line)
            self._statement(node, node.meta.line)

    def _statement(self, node: Any, line: int) -> None:
        parts = node.children
        match node.data:
            case "assign":
                self._assign(parts[0], self.value(parts[1]), line)
            case "call":
                self._instruction(node, line)
            case "if":
                self._if(parts, line)
            case "while":
                while self.truth(parts[0], line):
                    self.count_step(line)
                    self.block(parts[1].children)
            case "for":
                self._for(parts, line)
            case "return":
                raise ReturnValue(None if parts[0] is None else self.value(parts[0]))
            case "exit":
                raise EndProgram
            case other:
                raise CheckError(f"line {line}: the machine does not know this statement ({other})")

    def _if(self, parts: Sequence[Any], line: int) -> None:
        *branches, last = parts
        for condition, body in zip(branches[::2], branches[1::2], strict=True):
            if self.truth(condition, line):
                self.block(body.children)
                return
        if last is not None:
            self.block(last.children)

    def _for(self, parts: Sequence[Any], line: int) -> None:
        name, first, last, step, body = parts
        if step is None:
            raise CheckError(f"line {line}: without STEP the loop may count down")
        now, end, by = self.value(first), self.value(last), self.value(step)
        scope = self.frames[-1]
        hidden = scope.get(str(name).lower())
        while (now <= end) if by > 0 else (now >= end):
            self.count_step(line)
            scope[str(name).lower()] = now
            self.block(body.children)
            now += by
        scope.pop(str(name).lower(), None)
        if hidden is not None:
            scope[str(name).lower()] = hidden

    def _assign(self, target: Any, value: Any, line: int) -> None:
        name, *others = target.children
        key = str(name).lower()
        scope = self.frames[-1] if self.frames and key in self.frames[-1] else self.variables
        if key not in scope:
            raise CheckError(f"line {line}: {name} is not declared")
        if self.kinds.get(key) == "pose":
            value = _pose(value, line)
        if not others:
            scope[key] = value
        elif all(hasattr(one, "data") for one in others):
            scope[key][tuple(self._index(one, line) for one in others)] = value
        else:
            raise CheckError(f"line {line}: the machine knows variables and their elements alone")

    def _index(self, node: Any, line: int) -> int:
        value = self.value(node)
        if value != round(value):
            raise CheckError(f"line {line}: {value} is no index")
        return int(value)

    # ---- instructions ----------------------------------------------------------------------------------------------

    def _instruction(self, node: Any, line: int) -> None:  # noqa: C901 - one case per kind
        name = str(node.children[0])
        listed = node.children[1].children if node.children[1] is not None else []
        values = [one.children[0] for one in listed]
        switches = {
            str(switch.children[0]): switch.children[1] if len(switch.children) > 1 else None
            for one in listed
            for switch in one.children
            if getattr(switch, "data", "") == "switch"
        }
        match name:
            case "ConfL" if "Off" in switches:
                pass
            case "ConfJ":
                self._follows = "On" in switches
            case "MoveAbsJ":
                target = self.value(values[0])
                q, passes = np.deg2rad(target[0]), self._zone(values[2], line) > 0
                self.done(JointAction(line=line, q=q, duration=self._time(switches), passes=passes))
            case "MoveJ" | "MoveL":
                self._move(name, values, switches, line)
            case "SetDO":
                self.done(OutputAction(line=line, output=_word(values[0], line), on=self.value(values[1]) == 1))
            case "PulseDO":
                seconds, output = float(self.value(switches["PLength"])), _word(values[1], line)
                self.done(PulseAction(line=line, output=output, seconds=seconds))
            case "WaitTime":
                self.done(WaitAction(line=line, seconds=float(self.value(values[0]))))
            case "WaitUntil":
                self._wait_until(values[0], switches, line)
            case "TPWrite":
                self.done(TextAction(line=line, text=str(self.value(values[0]))))
            case _ if name.lower() in self.routines:
                self.routine(name, [self.value(one) for one in values], line)
            case _:
                raise CheckError(f"line {line}: the machine does not know {name}")

    def _move(self, name: str, values: Sequence[Any], switches: dict[str, Any], line: int) -> None:
        target = self.value(values[0])
        if not isinstance(self.value(values[3]), np.ndarray):
            raise CheckError(f"line {line}: the tool is not declared")
        X = self.value(switches["WObj"]) @ _pose(target[:2], line)
        words = {word: int(value) for word, value in zip(_WORDS, target[2], strict=True)}
        duration, zone = self._time(switches), self._zone(values[2], line)
        if name == "MoveJ":
            if not self._follows:
                words = {"cfx": words["cfx"]}
            q = np.zeros(6)
            how = {"configuration": words, "duration": duration, "passes": zone > 0}
            self.done(JointAction(line=line, q=q, X=X, **how))  # type: ignore[arg-type]
            return
        speed = turn = None
        if duration is None:
            rates = self.value(values[1])
            speed, turn = rates[0] * 1e-3, math.radians(rates[1])
        self.done(
            LineAction(line=line, X=X, configuration=words, duration=duration, speed=speed, turn_speed=turn, zone=zone)
        )

    def _time(self, switches: dict[str, Any]) -> float | None:
        return float(self.value(switches["T"])) if "T" in switches else None

    def _zone(self, node: Any, line: int) -> float:
        """Return how far from its end a motion may pass into the next [m]."""
        if node.data == "name":
            if _word(node, line) != "fine":
                raise CheckError(f"line {line}: the machine knows fine, and zones by numbers")
            return 0.0
        return float(self.value(node)[_PATH_ZONE]) * 1e-3

    def _wait_until(self, condition: Any, switches: dict[str, Any], line: int) -> None:
        limit = self.value(switches["MaxTime"]) if "MaxTime" in switches else math.inf
        begun, late = self.world.now, False
        while not self.truth(condition, line):
            self.count_step(line)
            if self.world.now - begun >= limit - 1e-9:
                late = True
                break
            self.world.wait()
        if "TimeFlag" in switches:
            self.variables[_word(switches["TimeFlag"], line).lower()] = late
        elif late:
            raise CheckError(f"line {line}: the wait ends in an error")

    # ---- values ----------------------------------------------------------------------------------------------------

    def value(self, node: Any) -> Any:  # noqa: PLR0911 - one case per kind
        """Return the value of an expression."""
        line, parts = node.meta.line, node.children
        match node.data:
            case "number":
                return float(parts[0])
            case "string":
                return str(parts[0])[1:-1].replace('""', '"').replace("\\\\", "\\")
            case "true" | "false":
                return node.data == "true"
            case "numbers":
                return [float(one) for one in str(parts[0])[1:-1].split(",")]
            case "list":
                return [self.value(one) for one in parts if one is not None]
            case "name":
                return self._named(parts[0], line)
            case "call_function":
                listed = parts[1].children if parts[1] is not None else []
                return self._function(str(parts[0]), [one.children[0] for one in listed], line)
            case "sum" | "product":
                total = self.value(parts[0])
                for operation, part in zip(parts[1::2], parts[2::2], strict=True):
                    other = self.value(part)
                    joined = isinstance(total, str) and operation == "+"
                    total = total + other if joined else arithmetic(str(operation), total, other, line)
                return total
        return self.operation(node)

    def _named(self, target: Any, line: int) -> Any:
        name, *others = target.children
        held = self.lookup(str(name).lower(), line)
        if others and hasattr(others[0], "data"):
            held = held.get(tuple(self._index(one, line) for one in others))
            others = []
        if held is None:
            raise CheckError(f"line {line}: {name} has no value yet")
        match [str(one) for one in others]:
            case []:
                return held
            case ["trans"]:
                return (held[:3, 3] * 1e3).tolist()
            case ["rot"]:
                return held[:3, :3]
            case ["trans", axis]:
                return float(held["xyz".index(axis), 3]) * 1e3
        raise CheckError(f"line {line}: the machine does not know this part of {name}")

    def _function(self, name: str, nodes: Sequence[Any], line: int) -> Any:  # noqa: C901, PLR0911 - one case per kind
        if name.lower() in self.routines:
            return self.routine(name, [self.value(one) for one in nodes], line)
        if name in ("DInput", "DOutput"):
            return float(self.world.read(_word(nodes[0], line), is_input=name == "DInput"))
        values = [self.value(one) for one in nodes]
        match name:
            case "PoseMult":
                return _pose(values[0], line) @ _pose(values[1], line)
            case "PoseInv":
                return np.linalg.inv(_pose(values[0], line))
            case "OrientZYX":
                return from_zyx_degrees(values)
            case "Distance":
                return float(np.linalg.norm(np.subtract(values[0], values[1])))
            case "ValToStr":
                return str(values[0]).upper() if isinstance(values[0], bool) else f"{values[0]:.6g}"
            case "ATan2":
                return math.degrees(math.atan2(*values))
            case _ if name in _SIMPLE:
                return _SIMPLE[name](values[0])
            case _ if name in _ANGLES:
                return _ANGLES[name](math.radians(values[0]))
        raise CheckError(f"line {line}: the machine does not know {name}")

    def routine(self, name: str, arguments: list[Any], line: int) -> Any:
        """Run a procedure, or a function for its value."""
        node = self.routines[name.lower()]
        _, parameters, *body = node.children if node.data == "procedure" else node.children[1:]
        listed = [] if parameters is None else [one.children for one in parameters.children]
        if len(listed) != len(arguments):
            raise CheckError(f"line {line}: {name} takes {len(listed)} arguments")
        scope: dict[str, Any] = {}
        for (kind, key, *_), value in zip(listed, arguments, strict=True):
            scope[str(key).lower()] = _pose(value, line) if str(kind) == "pose" else value
        self.frames.append(scope)
        try:
            self.block(one for one in body if one is not None)
        except ReturnValue as result:
            return result.value
        finally:
            self.frames.pop()
        return None


def _word(node: Any, line: int) -> str:
    if node.data != "name":
        raise CheckError(f"line {line}: expected a name")
    return str(node.children[0].children[0])


def _pose(value: Any, line: int) -> Array:
    """Return a pose (4, 4) of a place in millimetres and a quaternion, or of an orientation that was computed."""
    if isinstance(value, np.ndarray):
        return value
    if len(value) != 2 or len(value[0]) != 3:
        raise CheckError(f"line {line}: expected a place and an orientation")
    rotation = value[1]
    if not isinstance(rotation, np.ndarray):
        if abs(float(np.dot(rotation, rotation)) - 1.0) > _NORM:
            raise CheckError(f"line {line}: expected a quaternion of length one")
        rotation = from_quaternion(rotation)
    return pose_of(rotation, np.array(value[0]) / 1e3)
