"""Running programs in KRL, as far as program mode writes them."""

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
from armwright.export.checkers.grammar import fields, parse
from armwright.export.checkers.machine import (
    EndProgram,
    Machine,
    ReturnValue,
    World,
    angles_of,
    arithmetic,
    pose_of,
)
from armwright.export.checkers.orientations import from_zyx_degrees

_FRAME, _AXES = tuple("XYZABC"), tuple(f"A{i}" for i in range(1, 7))
_SIMPLE: dict[str, Callable[[float], float]] = {"ABS": abs, "SQRT": math.sqrt}
_ANGLES: dict[str, Callable[[float], float]] = {"SIN": math.sin, "COS": math.cos, "TAN": math.tan}
# A frame is its fields by name; a position has S and T too, as far as they are known.
_Frame = dict[str, float]


def run(texts: Sequence[str], world: World) -> ReadProgram:
    """Return what a program in KRL, with its data list, does in a cell.

    Raises:
        CheckError: it has what the machine does not know, or does not come to its end.
    """
    units = [unit for text in texts for unit in parse("krl", text).children if hasattr(unit, "data")]
    procedures = [unit for unit in units if unit.data == "procedure"]
    if not procedures or procedures[0].children[1] is not None:
        raise CheckError("line 1: expected a procedure without parameters")
    machine = _Machine(world)
    for unit in units:
        if unit.data == "data":
            machine.block(one for one in unit.children if getattr(one, "data", "") == "statement")
        else:
            name = unit.children[0 if unit.data == "procedure" else 1]
            machine.units[str(name).upper()] = unit
    with suppress(EndProgram, ReturnValue):
        machine.block(procedures[0].children[2:])
    machine.X_CT = _matrix(machine.system["$TOOL"])
    return machine.read_program(str(procedures[0].children[0]))


class _Machine(Machine):
    """A controller that runs KRL.

    Attributes:
        units: procedures and functions by name.
        system: variables of the controller.
        types: of variables, in the scopes of ``frames`` as well.
    """

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.units: dict[str, Any] = {}
        self.system: dict[str, Any] = {"$NULLFRAME": dict.fromkeys(_FRAME, 0.0), "$BASE": dict.fromkeys(_FRAME, 0.0)}
        self.types: list[dict[str, str]] = [{}]
        self._timer: tuple[str, float] = ("", 0.0)
        self._percent = 100.0

    # ---- statements ------------------------------------------------------------------------------------------------

    def block(self, statements: Iterable[Any]) -> None:
        """Run statements."""
        for node in statements:
            self.count_step(node.meta.line)
            inner = node.children[0] if node.data == "statement" else node
            self._statement(inner if hasattr(inner, "data") else node, node.meta.line)

    def _statement(self, node: Any, line: int) -> None:  # noqa: C901, PLR0912 - one case per kind
        parts = node.children
        match node.data:
            case "declare":
                self._declare(parts)
            case "assign":
                self._assign(parts[0], self.value(parts[1]), line)
            case "motion":
                self._motion(node, line)
            case "call":
                self._call(node, line)
            case "if":
                condition, then, *otherwise = parts
                if self.truth(condition, line):
                    self.block(then.children)
                elif otherwise and otherwise[0] is not None:
                    self.block(otherwise[0].children)
            case "while":
                while self.truth(parts[0], line):
                    self.count_step(line)
                    self.block(parts[1].children)
            case "repeat":
                self.block(parts[0].children)
                while not self.truth(parts[1], line):
                    self.count_step(line)
                    self.block(parts[0].children)
            case "for":
                self._for(parts, line)
            case "loop":
                while True:
                    self.count_step(line)
                    self.block(parts[0].children)
            case "wait":
                self.done(WaitAction(line=line, seconds=float(self.value(parts[0]))))
            case "wait_for":
                self._wait_for(parts[0], line)
            case "return":
                raise ReturnValue(None if parts[0] is None else self.value(parts[0]))
            case "halt":
                raise EndProgram
            case other:
                raise CheckError(f"line {line}: the machine does not know this statement ({other})")

    def _declare(self, parts: Sequence[Any]) -> None:
        kind, *declared = parts
        local = bool(self.frames)
        for one in declared:
            target = one.children[0]
            name, sizes = str(target.children[0]).upper(), [self.value(size) for size in target.children[1:] if size]
            scope = self.frames[-1] if local else self.variables
            self.types[-1][name] = str(kind).upper()
            if name not in scope:
                scope[name] = {} if sizes and str(kind).upper() != "CHAR" else None

    def _for(self, parts: Sequence[Any], line: int) -> None:
        name, first, last, step, body = parts
        now, end, by = self.value(first), self.value(last), 1 if step is None else self.value(step)
        if not all(isinstance(one, int) for one in (now, end, by)) or not by:
            raise CheckError(f"line {line}: FOR counts in whole numbers")
        while (now <= end) if by > 0 else (now >= end):
            self.count_step(line)
            self._store(str(name).upper(), now, line)
            self.block(body.children)
            now += by
        self._store(str(name).upper(), now, line)

    def _wait_for(self, condition: Any, line: int) -> None:
        value = self.value(condition)
        if not isinstance(value, bool):
            raise CheckError(f"line {line}: expected a condition")
        if condition.data == "name" and str(condition.children[0].children[0]).upper() == "TRUE":
            self.world.wait()
        while not self.truth(condition, line):
            self.count_step(line)
            self.world.wait()

    def _store(self, name: str, value: Any, line: int) -> None:
        scope = self.frames[-1] if self.frames and name in self.frames[-1] else self.variables
        if name not in scope:
            raise CheckError(f"line {line}: {name} is not declared")
        scope[name] = _as_type(self._type(name), value, line)

    def _type(self, name: str) -> str:
        return self.types[-1 if self.frames and name in self.frames[-1] else 0][name]

    def _assign(self, target: Any, value: Any, line: int) -> None:
        name, *others = target.children
        name = str(name).upper()
        if name in ("$OUT", "$TIMER", "$TIMER_STOP"):
            index = self.value(others[0])
            if name == "$OUT":
                self.done(OutputAction(line=line, output=index, on=value))
            elif name == "$TIMER" and not value:
                self._timer = (str(index), self.world.now)
            elif value:
                raise CheckError(f"line {line}: the machine knows timers that begin at 0 alone")
        elif name == "$LOOP_MSG":
            self.done(TextAction(line=line, text=str(value)))
        elif name.startswith("$"):
            self.system[".".join([name, *(str(one).upper() for one in others)])] = value
        elif not others:
            self._store(name, value, line)
        elif hasattr(others[0], "data"):
            elements = self.lookup(name, line)
            elements[tuple(self.value(one) for one in others)] = _as_type(self._type(name), value, line)
        else:
            fields_of = self.lookup(name, line)
            if fields_of is None:
                self._store(name, {}, line)
                fields_of = self.lookup(name, line)
            fields_of[str(others[0]).upper()] = float(value)

    # ---- motions ---------------------------------------------------------------------------------------------------

    def _motion(self, node: Any, line: int) -> None:
        kind, record, *ways = node.children
        values, passes = self.value(record), bool(ways)
        if tuple(values) == _AXES and kind.upper() == "PTP":
            q = np.deg2rad([values[axis] for axis in _AXES])
            self.done(JointAction(line=line, q=q, speed_part=self._percent / 100.0, passes=passes))
            return
        X = _matrix(self.system["$BASE"]) @ _matrix(values)
        words = {word: int(values[word]) for word in "ST" if word in values}
        if kind.upper() == "PTP":
            # Without a status that of before is kept, and without a turn the axes take the shortest way.
            part, kept = self._percent / 100.0, () if "S" in words else ("S",)
            q = np.zeros(len(_AXES))
            self.done(JointAction(line=line, q=q, X=X, configuration=words, kept=kept, speed_part=part, passes=passes))
        elif kind.upper() == "LIN":
            zone = self.system.get("$APO.CDIS", 0.0) * 1e-3 if passes else 0.0
            speed, turn = self.system.get("$VEL.CP"), float(np.deg2rad(self.system.get("$VEL.ORI1", 0.0)))
            self.done(LineAction(line=line, X=X, configuration=words, speed=speed, turn_speed=turn, zone=zone))
        else:
            raise CheckError(f"line {line}: the machine knows PTP and LIN alone")

    # ---- values ----------------------------------------------------------------------------------------------------

    def value(self, node: Any) -> Any:  # noqa: PLR0911 - one case per kind
        """Return the value of an expression."""
        line, parts = node.meta.line, node.children
        match node.data:
            case "number":
                text = str(parts[0])
                return int(text) if text.isdecimal() else float(text)
            case "string":
                return str(parts[0])[1:-1]
            case "enum":
                return str(parts[0])
            case "numbers":
                return fields(str(parts[0]))
            case "name":
                return self._named(parts[0], line)
            case "call":
                return self._call(node, line)
            case "frames":
                X = _matrix(self.value(parts[0]))
                for part in parts[1:]:
                    X = X @ _matrix(self.value(part))
                return _fields(X)
            case "sum" | "product":
                return self._chain(parts, line)
        return self.operation(node)

    def _chain(self, parts: Sequence[Any], line: int) -> Any:
        total = self.value(parts[0])
        for operation, part in zip(parts[1::2], parts[2::2], strict=True):
            other = self.value(part)
            whole = isinstance(total, int) and isinstance(other, int)
            total = arithmetic(str(operation), total, other, line)
            # Whole numbers stay whole: what is behind the point of a quotient is lost.
            total = int(total) if whole else total
        return total

    def _named(self, target: Any, line: int) -> Any:
        name, *others = target.children
        name = str(name).upper()
        if name in ("TRUE", "FALSE"):
            return name == "TRUE"
        if name in ("$IN", "$OUT"):
            return self.world.read(self.value(others[0]), is_input=name == "$IN")
        if name == "$TIMER":
            number, since = self._timer
            if number != str(self.value(others[0])):
                raise CheckError(f"line {line}: another timer runs")
            return (self.world.now - since) * 1e3
        if name == "$LOOP_MSG":
            return ""
        held = self.system[name] if name in self.system else self.lookup(name, line)
        if others and hasattr(others[0], "data"):
            held = held.get(tuple(self.value(one) for one in others))
        elif others and others[0] is not None:
            held = held.get(str(others[0]).upper())
        if held is None:
            raise CheckError(f"line {line}: {name} has no value yet")
        return dict(held) if isinstance(held, dict) else held

    def _call(self, node: Any, line: int) -> Any:  # noqa: C901 - one case per function
        target, *arguments = node.children
        name = str(target.children[0] if hasattr(target, "data") else target).upper()
        values = [one.children[0] for one in arguments if one is not None and one.children[0] is not None]
        if name in self.units:
            return self._unit(self.units[name], [self.value(one) for one in values], line)
        match name:
            case "BAS":
                word = self.value(values[0])
                if word == "#VEL_PTP":
                    self._percent = float(self.value(values[1]))
                elif word != "#INITMOV":
                    raise CheckError(f"line {line}: the machine does not know {word}")
            case "PULSE":
                output = self.value(values[0].children[0].children[1])
                if not self.truth(values[1], line):
                    raise CheckError(f"line {line}: the machine knows pulses that are on alone")
                self.done(PulseAction(line=line, output=output, seconds=float(self.value(values[2]))))
            case "STRCLEAR":
                return True
            case "SWRITE":
                shape = self.value(values[3]).replace("%d", "%.0f")
                text = shape % tuple(self.value(one) for one in values[4:])
                self._store(str(values[0].children[0].children[0]).upper(), text, line)
            case "ATAN2":
                return math.degrees(math.atan2(*(self.value(one) for one in values)))
            case _ if name in _SIMPLE:
                return _SIMPLE[name](self.value(values[0]))
            case _ if name in _ANGLES:
                return _ANGLES[name](math.radians(self.value(values[0])))
            case _:
                raise CheckError(f"line {line}: the machine does not know {name}")
        return None

    def _unit(self, unit: Any, arguments: list[Any], line: int) -> Any:
        """Run a procedure or function."""
        _, parameters, *body = unit.children if unit.data == "procedure" else unit.children[1:]
        named = (
            [] if parameters is None else [[str(part).upper() for part in one.children] for one in parameters.children]
        )
        if len(named) != len(arguments) or any(way != "IN" for _, way in named):
            raise CheckError(f"line {line}: expected {len(named)} arguments by value")
        self.frames.append({name: value for (name, _), value in zip(named, arguments, strict=True)})
        self.types.append({})
        try:
            self.block(body)
        except ReturnValue as result:
            return result.value
        finally:
            self.frames.pop()
            self.types.pop()
        return None


def _as_type(kind: str, value: Any, line: int) -> Any:
    """Return a value as a variable of a type holds it: whole numbers are rounded."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    fits = {
        "INT": number,
        "REAL": number,
        "BOOL": isinstance(value, bool),
        "FRAME": isinstance(value, dict),
        "POS": isinstance(value, dict),
    }
    if not fits.get(kind, True):
        raise CheckError(f"line {line}: {value!r} is no {kind}")
    if kind == "INT":
        return math.floor(value + 0.5)
    if kind == "REAL":
        return float(value)
    return dict(value) if isinstance(value, dict) else value


def _matrix(frame: _Frame) -> Array:
    try:
        R = from_zyx_degrees([frame[name] for name in "ABC"])
        return pose_of(R, np.array([frame[name] for name in "XYZ"]) / 1e3)
    except KeyError as error:
        raise CheckError(f"line 0: a frame without {error}") from None


def _fields(X: Array) -> _Frame:
    numbers = [*(X[:3, 3] * 1e3).tolist(), *angles_of(X)]
    return dict(zip(_FRAME, numbers, strict=True))
