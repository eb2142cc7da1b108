"""Running programs in URScript, as far as program mode writes them."""

import math
from collections.abc import Iterable, Sequence
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
from armwright.export.checkers.grammar import parse, vector
from armwright.export.checkers.machine import (
    BreakLoop,
    EndProgram,
    Machine,
    ReturnValue,
    World,
    arithmetic,
    pose_of,
    rotation_vector_of,
)
from armwright.export.checkers.orientations import from_rotation_vector, turn

_JOINTS = 6


def run(texts: Sequence[str], world: World) -> ReadProgram:
    """Return what a program in URScript does in a cell.

    Raises:
        CheckError: it has what the machine does not know, or does not come to its end.
    """
    (text,) = texts
    tree = parse("urscript", text)
    functions = [node for node in tree.children if node.data == "function"]
    calls = [node for node in tree.children if node.data == "call"]
    if len(functions) != 1 or len(calls) != 1 or len(tree.children) != 2:
        raise CheckError("line 1: expected one function and its call")
    machine = _Machine(world)
    name = str(functions[0].children[0])
    if str(calls[0].children[0].children[0]) != name:
        raise CheckError(f"line {calls[0].meta.line}: expected a call of {name}")
    with suppress(EndProgram):
        machine.block(functions[0].children[2:])
    return machine.read_program(name)


class _Solved:
    """Joint positions that the controller finds for a pose: those nearest to given ones."""

    def __init__(self, X: Array, near: Array) -> None:
        self.X, self.near = X, near


class _Machine(Machine):
    """A controller that runs URScript."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self._functions: dict[str, Any] = {}
        self._threads: dict[str, Any] = {}

    # ---- statements ------------------------------------------------------------------------------------------------

    def block(self, statements: Iterable[Any]) -> None:
        """Run statements."""
        for node in statements:
            self.count_step(node.meta.line)
            self._statement(node, node.meta.line)

    def _statement(self, node: Any, line: int) -> None:  # noqa: C901, PLR0912 - one case per kind
        match node.data:
            case "function":
                self._functions[str(node.children[0])] = node
            case "thread":
                self._threads[str(node.children[0])] = node
            case "assign" | "assign_global" | "assign_local":
                self._assign(node, line)
            case "if":
                self._if(node)
            case "while":
                condition, body = node.children
                while self.truth(condition, line):
                    self.count_step(line)
                    try:
                        self.block(body.children)
                    except BreakLoop:
                        break
            case "break":
                raise BreakLoop
            case "pass":
                pass
            case "return":
                raise ReturnValue(None if node.children[0] is None else self.value(node.children[0]))
            case "halt":
                raise EndProgram
            case "run":
                self._run(node, line)
            case "call":
                self._call(node)
            case other:
                raise CheckError(f"line {line}: the machine does not know this statement ({other})")

    def _if(self, node: Any) -> None:
        *parts, last = node.children
        for condition, body in zip(parts[::2], parts[1::2], strict=True):
            if self.truth(condition, node.meta.line):
                self.block(body.children)
                return
        if last is not None:
            self.block(last.children)

    def _assign(self, node: Any, line: int) -> None:
        target, value = node.children[0], self.value(node.children[1])
        if target.data == "item":
            array, index = self.value(target.children[0]), self.value(target.children[1])
            array[self._index(array, index, line)] = value
            return
        if target.data != "name":
            raise CheckError(f"line {line}: the machine knows variables and their elements alone")
        inside = node.data != "assign_global" and self.frames
        (self.frames[-1] if inside else self.variables)[str(target.children[0])] = value

    def _run(self, node: Any, line: int) -> None:
        """Run a thread that ends a pulse."""
        name = str(node.children[0].children[0].children[0])
        body = self._threads[name].children[1:] if name in self._threads else []
        if [str(one.children[0].children[0]) for one in body] != ["sleep", "set_standard_digital_out"]:
            raise CheckError(f"line {line}: the machine knows threads that end a pulse alone")
        seconds = self._arguments(body[0])[0][0]
        output, on = self._arguments(body[1])[0]
        last = self.actions[-1] if self.actions else None
        if not (isinstance(last, OutputAction) and last.output == output and last.on and on is False):
            raise CheckError(f"line {line}: the pulse of another output begins here")
        self.actions[-1] = PulseAction(line=line, output=output, seconds=seconds)

    # ---- values ----------------------------------------------------------------------------------------------------

    def value(self, node: Any) -> Any:  # noqa: C901, PLR0911 - one case per kind
        """Return the value of an expression."""
        line, parts = node.meta.line, node.children
        match node.data:
            case "number":
                text = str(parts[0])
                return int(text) if text.isdecimal() else float(text)
            case "string":
                return str(parts[0])[1:-1]
            case "true" | "false":
                return node.data == "true"
            case "numbers":
                return self._numbers(str(parts[0]), line)
            case "pose":
                return self._pose([self.value(one) for one in parts if hasattr(one, "data")])
            case "list":
                return [self.value(one) for one in parts if one is not None]
            case "name":
                return self.lookup(str(parts[0]), line)
            case "item":
                array, index = self.value(parts[0]), self.value(parts[1])
                if isinstance(array, np.ndarray):
                    return float([*array[:3, 3], *rotation_vector_of(array)][self._index(range(_JOINTS), index, line)])
                return array[self._index(array, index, line)]
            case "call":
                return self._call(node)
            case "sum" | "product":
                total = self.value(parts[0])
                for operation, part in zip(parts[1::2], parts[2::2], strict=True):
                    total = arithmetic(str(operation), total, self.value(part), line)
                return total
        return self.operation(node)

    def _index(self, array: Sequence[Any], index: Any, line: int) -> int:
        if not isinstance(index, int) or not 0 <= index < len(array):
            raise CheckError(f"line {line}: {index} is no index of {len(array)} elements")
        return index

    def _numbers(self, text: str, line: int) -> Any:
        if text.startswith("p"):
            return self._pose(vector(text, _JOINTS, line).tolist())
        return [float(one) for one in text[1:-1].split(",")]

    def _pose(self, numbers: Sequence[float]) -> Array:
        return pose_of(from_rotation_vector(numbers[3:]), np.array(numbers[:3]))

    def _arguments(self, node: Any) -> tuple[list[Any], dict[str, Any]]:
        positional, named = list[Any](), dict[str, Any]()
        for argument in node.children[1:]:
            if argument is not None:
                name, value = argument.children
                if name is None:
                    positional.append(self.value(value))
                else:
                    named[str(name)] = self.value(value)
        return positional, named

    def _call(self, node: Any) -> Any:
        name, line = str(node.children[0].children[0]), node.meta.line
        positional, named = self._arguments(node)
        if name in self._functions:
            return self._function(self._functions[name], positional)
        if name in _MOTIONS:
            return self._motion(name, positional, named, line)
        return self._built_in(name, positional, line)

    def _function(self, node: Any, arguments: list[Any]) -> Any:
        _, parameters, *body = node.children
        names = [str(one.children[0]) for one in parameters.children] if parameters is not None else []
        self.frames.append(dict(zip(names, arguments, strict=True)))
        try:
            self.block(body)
        except ReturnValue as result:
            return result.value
        finally:
            self.frames.pop()
        return None

    def _motion(self, name: str, positional: list[Any], named: dict[str, Any], line: int) -> None:
        goal = positional[0]
        if name == "movel":
            X, zone = goal, float(named.get("r", 0.0))
            self.done(LineAction(line=line, X=X, duration=named.get("t"), speed=named.get("v"), zone=zone))
            return
        solved = isinstance(goal, _Solved)
        q, duration, speed = goal.near if solved else np.array(goal), named.get("t"), named.get("v")
        X, near, passes = goal.X if solved else None, goal.near if solved else None, "r" in named
        self.done(JointAction(line=line, q=q, X=X, near=near, duration=duration, joint_speed=speed, passes=passes))

    def _built_in(self, name: str, values: list[Any], line: int) -> Any:  # noqa: C901, PLR0911, PLR0912 - one case per kind
        match name:
            case "set_tcp":
                self.X_CT = values[0]
            case "set_standard_digital_out":
                self.done(OutputAction(line=line, output=values[0], on=values[1]))
            case "sleep":
                self.done(WaitAction(line=line, seconds=float(values[0])))
            case "textmsg":
                self.done(TextAction(line=line, text=str(values[0])))
            case "sync":
                self.world.wait()
            case "get_steptime":
                return self.world.step
            case "get_standard_digital_in" | "get_standard_digital_out":
                return self.world.read(values[0], is_input=name.endswith("in"))
            case "get_inverse_kin":
                return _Solved(values[0], np.array(values[1]))
            case "pose_trans":
                return values[0] @ values[1]
            case "pose_inv":
                return np.linalg.inv(values[0])
            case "point_dist":
                return float(np.linalg.norm(values[0][:3, 3] - values[1][:3, 3]))
            case "rpy2rotvec":
                roll, pitch, yaw = values[0]
                return rotation_vector_of(turn(2, yaw) @ turn(1, pitch) @ turn(0, roll)).tolist()
            case "norm":
                return abs(values[0])
            case "floor":
                return math.floor(values[0])
            case "sqrt" | "sin" | "cos" | "tan" | "atan2":
                return getattr(math, name)(*values)
            case "str_cat":
                return f"{values[0]}{values[1]}"
            case "to_str":
                return str(values[0]) if isinstance(values[0], bool | int) else f"{values[0]:g}"
            case _:
                raise CheckError(f"line {line}: the machine does not know {name}")
        return None


_MOTIONS = ("movej", "movel")
