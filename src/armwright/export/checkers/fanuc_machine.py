"""Running programs of FANUC's pendant, as far as program mode writes them."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeAlias

import attrs
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
from armwright.export.checkers.fanuc import TIMES, WAIT_ROUNDING, position
from armwright.export.checkers.grammar import parse
from armwright.export.checkers.machine import EndProgram, Machine, World, arithmetic, pose_of
from armwright.export.checkers.orientations import from_zyx_degrees

_REGISTER = re.compile(r"([A-Z_]+)\[(\d+)(?:,(\d+))?(?::[^\]]*)?\]")
_SPEED = re.compile(r"(R\[[^\]]*\]|\d+(?:\.\d*)?)(%|mm/sec|deg/sec|msec|sec)")
# Programs that call one another are nested no deeper.
_DEEPEST = 10
# Until a wait is over, in seconds of $WAITTMOUT.
_TIMEOUT_UNIT = 0.01
_AXES = range(1, 7)
_Address: TypeAlias = tuple[str, int]


@attrs.frozen(eq=False)
class _Program:
    """A program: its statements with their lines, where its labels are and where blocks go on, and its positions."""

    statements: Sequence[tuple[Any, int]]
    labels: Mapping[int, int]
    partners: Mapping[int, int]
    positions: Mapping[str, tuple[str, Array]]


def run(texts: Sequence[str], world: World) -> ReadProgram:
    """Return what a program of the pendant does in a cell.

    Args:
        texts: of the program, and of those that it calls.
        world: the cell.

    Raises:
        CheckError: it has what the machine does not know, or does not come to its end.
    """
    programs = [_read(text) for text in texts]
    machine = _Machine(world, dict(programs))
    if len(machine.programs) != len(programs):
        raise CheckError("line 1: two programs have one name")
    name = programs[0][0]
    with suppress(EndProgram):
        machine.call(name, 1)
    return machine.read_program(name)


def _read(text: str) -> tuple[str, _Program]:
    """Return the name of a program, and the program."""
    tree = parse("fanuc", text)
    name = next(str(node) for node in tree.children if getattr(node, "type", "") == "NAME")
    places = [node for node in tree.children if getattr(node, "type", "") == "POSITION"]
    found = [(line.children[0], line.meta.line) for line in tree.find_data("line") if line.children[0] is not None]
    statements = sorted(found, key=lambda one: one[1])
    labels: dict[int, int] = {}
    partners: dict[int, int] = {}
    opened: list[int] = []
    for i, (node, line) in enumerate(statements):
        match node.data:
            case "bare":
                kind, number = _address(str(node.children[0]), line)
                if kind != "LBL" or number in labels:
                    raise CheckError(f"line {line}: expected a label that is new")
                labels[number] = i
            case "if" | "for":
                opened.append(i)
            case "else" | "end_if" | "end_for":
                kinds = {"else": ("if",), "end_if": ("if", "else"), "end_for": ("for",)}[str(node.data)]
                if not opened or statements[opened[-1]][0].data not in kinds:
                    raise CheckError(f"line {line}: this ends no block")
                begin = opened.pop()
                partners[begin] = i
                if node.data == "end_for":
                    partners[i] = begin
                if node.data == "else":
                    opened.append(i)
    if opened:
        raise CheckError(f"line {statements[opened[-1]][1]}: this block has no end")
    return name, _Program(statements, labels, partners, dict(position(place) for place in places))


def _address(text: str, line: int) -> _Address:
    """Return the kind and the number of a register, a label, an input or an output."""
    found = _REGISTER.fullmatch(text)
    if found is None or found[3] is not None:
        raise CheckError(f"line {line}: the machine does not know {text}")
    return found[1], int(found[2])


class _Machine(Machine):
    """A controller of FANUC.

    Attributes:
        programs: by name.
    """

    def __init__(self, world: World, programs: Mapping[str, _Program]) -> None:
        super().__init__(world)
        self.programs = programs
        self._registers: dict[_Address, float | bool] = {}
        # Numbers of the position register; None while it may hold joints.
        self._pose: dict[int, float] | None = None
        self._tool, self._timeout, self._depth = "", 30.0, 0
        self._tools: dict[str, Array] = {}

    def call(self, name: str, line: int) -> None:
        """Run a program to its end."""
        if name not in self.programs:
            raise CheckError(f"line {line}: there is no program {name}")
        self._depth += 1
        if self._depth > _DEEPEST:
            raise CheckError(f"line {line}: programs call one another too deep")
        program, here = self.programs[name], 0
        ends: dict[int, float] = {}
        while here < len(program.statements):
            node, at = program.statements[here]
            self.count_step(at)
            here = self._next(program, here, ends, node, at)
        self._depth -= 1

    def _next(self, program: _Program, here: int, ends: dict[int, float], node: Any, line: int) -> int:  # noqa: PLR0911 - one case per kind
        """Do a statement, and return which one is next."""
        parts = node.children
        match node.data:
            case "if":
                return here + 1 if self.truth(parts[0], line) else program.partners[here] + 1
            case "else":
                return program.partners[here] + 1
            case "for":
                counter, last = _address(str(parts[0]), line), self._whole(parts[3], line)
                self._set(counter, self._whole(parts[1], line), line)
                ends[here] = last
                return here + 1 if self._counts(parts, counter, last) else program.partners[here] + 1
            case "end_for":
                begin = program.partners[here]
                loop = program.statements[begin][0].children
                counter = _address(str(loop[0]), line)
                self._set(counter, self._registers[counter] + (1 if loop[2] == "TO" else -1), line)
                return begin + 1 if self._counts(loop, counter, ends[begin]) else here + 1
            case "if_line" if parts[1].data == "jump" and parts[2:] in ([], [None]):
                return self._label(program, parts[1].children[0], line) if self.truth(parts[0], line) else here + 1
            case "jump":
                return self._label(program, parts[0], line)
            case "wait":
                late = self._wait(parts, line)
                return self._label(program, parts[2], line) if late else here + 1
        self._do(program, node, line)
        return here + 1

    def _counts(self, loop: Sequence[Any], counter: _Address, last: float) -> bool:
        now = self._registers[counter]
        return now <= last if loop[2] == "TO" else now >= last

    def _whole(self, node: Any, line: int) -> float:
        value = self.value(node)
        if isinstance(value, bool) or value != round(value):
            raise CheckError(f"line {line}: FOR counts by whole numbers")
        return float(value)

    def _label(self, program: _Program, token: Any, line: int) -> int:
        kind, number = _address(str(token), line)
        if kind != "LBL" or number not in program.labels:
            raise CheckError(f"line {line}: there is no {token}")
        return program.labels[number]

    def _do(self, program: _Program, node: Any, line: int) -> None:
        parts = node.children
        match node.data:
            case "comment" | "bare" | "end_if":
                pass
            case "motion":
                self._move(program, parts, line)
            case "assign":
                self._assign(str(parts[0].children[0]), parts[1], parts[2:], line)
            case "message":
                self.done(TextAction(line=line, text=str(parts[0])[len("MESSAGE[") : -1]))
            case "call" if not any(parts[1:]):
                self.call(str(parts[0]), line)
            case "word" if str(parts[0]) == "ABORT":
                raise EndProgram
            case other:
                raise CheckError(f"line {line}: the machine does not know this statement ({other})")

    def _wait(self, parts: Sequence[Any], line: int) -> bool:
        """Wait, and return whether it was too long."""
        condition, seconds, late = parts
        value = self.value(condition)
        if not isinstance(value, bool):
            rounding = 0.0 if seconds is None else WAIT_ROUNDING
            self.done(WaitAction(line=line, seconds=float(value), rounding=rounding))
            return False
        begun = self.world.now
        while not self.truth(condition, line):
            self.count_step(line)
            if late is not None and self.world.now - begun >= self._timeout - 1e-9:
                return True
            self.world.wait()
        return False

    def _move(self, program: _Program, parts: Sequence[Any], line: int) -> None:
        kind, place, speed, end, *others = parts
        tool, q = program.positions.get(str(place), (None, None))
        found = _SPEED.fullmatch(speed)
        if q is None or tool != self._tool or found is None or any(others) or end != "FINE":
            raise CheckError(
                f"line {line}: the machine knows motions to joint positions with the tool and a stop alone"
            )
        value = self._registers.get(_address(found[1], line), 0.0) if found[1][0] == "R" else float(found[1])
        unit = found[2]
        if isinstance(value, bool) or value <= 0 or (unit == "%" and value > 100):
            raise CheckError(f"line {line}: {value} is no speed")
        length, rounding = TIMES.get(unit, (0.0, 0.0))
        duration = value * length if length else None
        if kind == "J" and unit in ("%", *TIMES):
            part = value / 100.0 if unit == "%" else None
            self.done(JointAction(line=line, q=q, duration=duration, speed_part=part, rounding=rounding))
        elif kind == "L" and unit != "%":
            rate = value / 1000.0 if unit == "mm/sec" else None
            turn = float(np.deg2rad(value)) if unit == "deg/sec" else None
            line_action = LineAction(line=line, q=q, duration=duration, speed=rate, turn_speed=turn, rounding=rounding)
            self.done(line_action)
        else:
            raise CheckError(f"line {line}: {kind} has no speed in {unit}")

    # ---- registers -------------------------------------------------------------------------------------------------

    def _assign(self, target: str, node: Any, others: Sequence[Any], line: int) -> None:
        said = str(node.children[0]) if node.data in ("name", "register", "number") else ""
        if part := re.fullmatch(r"PR\[9(?:,([1-6]))?\]", target):
            if part[1] is None and said == "LPOS":
                self._pose = {}
            elif part[1] is not None and self._pose is not None:
                self._pose[int(part[1])] = float(self.value(node))
            else:
                raise CheckError(f"line {line}: {target} may hold joints")
        elif (tool := re.fullmatch(r"UTOOL\[(\d+)\]", target)) and said == "PR[9]" and self._pose is not None:
            if len(self._pose) < len(_AXES):
                raise CheckError(f"line {line}: {said} is not whole")
            x, y, z, w, p, r = (self._pose[i] for i in _AXES)
            self._tools[tool[1]] = pose_of(from_zyx_degrees([r, p, w]), np.array([x, y, z]) / 1000.0)
        elif target == "UTOOL_NUM" and said in self._tools:
            self._tool, self.X_CT = said, self._tools[said]
        elif target == "$WAITTMOUT":
            self._timeout = self._whole(node, line) * _TIMEOUT_UNIT
        elif (target, said) != ("UFRAME_NUM", "0"):
            self._switch(_address(target, line), node, others, line)

    def _switch(self, address: _Address, node: Any, others: Sequence[Any], line: int) -> None:
        kind, number = address
        if kind != "DO":
            self._set(address, self.value(node), line)
        elif others and others[0] is not None:
            if str(node.children[0]) != "PULSE" or others[0].data != "duration":
                raise CheckError(f"line {line}: expected PULSE and its time")
            seconds = float(str(others[0].children[0]).removesuffix("sec"))
            self.done(PulseAction(line=line, output=number, seconds=seconds))
        else:
            value = self.value(node)
            if not isinstance(value, bool):
                raise CheckError(f"line {line}: an output is ON or OFF")
            self.done(OutputAction(line=line, output=number, on=value))

    def _set(self, address: _Address, value: Any, line: int) -> None:
        if address[0] not in ("R", "F") or isinstance(value, bool) != (address[0] == "F"):
            raise CheckError(f"line {line}: {address[0]}[{address[1]}] cannot hold {value}")
        self._registers[address] = value

    def value(self, node: Any) -> Any:  # noqa: PLR0911 - one case per kind
        """Return the value of an expression."""
        line, parts = node.meta.line, node.children
        match node.data:
            case "number":
                return float(parts[0])
            case "name" if str(parts[0]) in ("ON", "OFF"):
                return str(parts[0]) == "ON"
            case "register":
                kind, number = address = _address(str(parts[0]), line)
                if kind in ("DI", "DO"):
                    return self.world.read(number, is_input=kind == "DI")
                if address not in self._registers:
                    raise CheckError(f"line {line}: {parts[0]} holds nothing yet")
                return self._registers[address]
            case "sum" | "product":
                total = self.value(parts[0])
                for operation, part in zip(parts[1::2], parts[2::2], strict=True):
                    total = arithmetic(str(operation), total, self.value(part), line)
                return total
            case "expression":
                return any(self._truths(parts, line))
        return self.operation(node)
