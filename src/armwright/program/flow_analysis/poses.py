"""Constant poses of frames and transformations, as far as the text of a program determines them.

A pose is twelve numbers, columns n, o, a, p, in metres.
"""

import math
from collections.abc import Sequence
from operator import add, mul
from typing import TYPE_CHECKING, TypeAlias

from armwright.program.language.kinds import VariableKind
from armwright.program.language.units import convert
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.syntax import tree

if TYPE_CHECKING:
    from armwright.program.flow_analysis.state import FlowState

Pose: TypeAlias = tuple[float, ...]

IDENTITY: Pose = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_NUMBERS = 12


def compose(first: Pose, step: Pose) -> Pose:
    """Return the composition of a pose and a transformation."""
    columns, rows = (step[i : i + 3] for i in (0, 3, 6, 9)), [first[row:9:3] for row in range(3)]
    rotated = [sum(map(mul, row, column)) for column in columns for row in rows]
    return (*rotated[:9], *map(add, first[9:], rotated[9:]))


def inverse(pose: Pose) -> Pose:
    """Return the inverse transformation."""
    shift = (-sum(map(mul, pose[i : i + 3], pose[9:])) for i in (0, 3, 6))
    return (*pose[0:9:3], *pose[1:9:3], *pose[2:9:3], *shift)


def constant_pose(state: "FlowState", node: tree.Expression) -> Pose | None:
    """Return the constant pose or transformation of an expression; None where it is not constant."""
    if isinstance(node, tree.Binary):
        return _product(state, node)
    if isinstance(node, tree.Matrix):
        return _matrix(state, node)
    if isinstance(node, tree.Function):
        return _function(state, node)
    if isinstance(node, tree.Name) and node.key == WORLD:
        return IDENTITY
    if (name := state.variable(node, VariableKind.FRAME)) is not None:
        return state.table.world_pose(name)
    name = state.variable(node, VariableKind.TRANS)
    return None if name is None else state.steps[name]


def _product(state: "FlowState", node: tree.Binary) -> Pose | None:
    first, operations = tree.operation_chain(node)
    pose = constant_pose(state, first)
    for operation in operations:
        step = constant_pose(state, operation.right) if operation.operation == "*" else None
        if pose is None or step is None:
            return None
        pose = compose(pose, step)
    return pose


def _matrix(state: "FlowState", node: tree.Matrix) -> Pose | None:
    if len(node.items) != _NUMBERS:
        return None
    rotation, shift = _numbers(state, node.items[:9]), _lengths(state, node.items[9:])
    return None if rotation is None or shift is None else (*rotation, *shift)


def _function(state: "FlowState", node: tree.Function) -> Pose | None:
    key, arguments = node.name.key, node.arguments
    if key == "XYZ" and len(arguments) == 3:
        shift = _lengths(state, arguments)
        return None if shift is None else (*IDENTITY[:9], *shift)
    if len(arguments) != 1:
        return None
    if key == "INV":
        pose = constant_pose(state, arguments[0])
        return None if pose is None else inverse(pose)
    if key in ("ROTX", "ROTY", "ROTZ"):
        angle = _numbers(state, arguments)
        return None if angle is None else _rotation("XYZ".index(key[-1]), angle[0] * state.symbols.units.radians)
    return None


def _rotation(axis: int, angle: float) -> Pose:
    """Return the rotation about an axis by an angle [rad]."""
    pose = list(IDENTITY)
    u, other = (axis + 1) % 3, (axis + 2) % 3
    pose[3 * u + u] = pose[3 * other + other] = math.cos(angle)
    pose[3 * u + other], pose[3 * other + u] = math.sin(angle), -math.sin(angle)
    return tuple(pose)


def _lengths(state: "FlowState", nodes: Sequence[tree.Expression]) -> tuple[float, ...] | None:
    amounts = _numbers(state, nodes)
    return None if amounts is None else tuple(amount * state.symbols.units.metres for amount in amounts)


def _numbers(state: "FlowState", nodes: Sequence[tree.Expression]) -> tuple[float, ...] | None:
    """Return numbers in the units of the program."""
    numbers = []
    for node in nodes:
        if isinstance(node, tree.Number):
            number = None if math.isnan(node.value) else convert(node.value, node.unit, state.symbols.units)
        else:
            number = state.constant(node)
        if number is None:
            return None
        numbers.append(number)
    return tuple(numbers)
