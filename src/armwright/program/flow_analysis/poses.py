"""Where frames stand and how long steps are, as far as the text of a program says so.

A pose is twelve numbers, columns n, o, a, p, in metres.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

from armwright.program.language.kinds import VariableKind
from armwright.program.language.units import convert
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.syntax import tree

if TYPE_CHECKING:
    from armwright.program.flow_analysis.state import FlowState

Pose: TypeAlias = tuple[float, ...]

HERE: Pose = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_NUMBERS = 12


def after(first: Pose, step: Pose) -> Pose:
    """Return the pose at a step from another."""
    turned = [
        sum(first[3 * k + row] * step[3 * column + k] for k in range(3)) for column in range(4) for row in range(3)
    ]
    return (*turned[:9], *(first[9 + row] + turned[9 + row] for row in range(3)))


def inverse(pose: Pose) -> Pose:
    """Return the step back."""
    turned = [pose[3 * column + row] for row in range(3) for column in range(3)]
    back = [-sum(pose[3 * row + k] * pose[9 + k] for k in range(3)) for row in range(3)]
    return (*turned, *back)


def certain(state: "FlowState", node: tree.Expression) -> Pose | None:
    """Return the pose or step that an expression gives; None where that is not certain."""
    if isinstance(node, tree.Binary):
        return _product(state, node)
    if isinstance(node, tree.Matrix):
        return _matrix(state, node)
    if isinstance(node, tree.Function):
        return _function(state, node)
    if isinstance(node, tree.Name) and node.key == WORLD:
        return HERE
    if (name := state.variable(node, VariableKind.FRAME)) is not None:
        return state.table.where(name)
    name = state.variable(node, VariableKind.TRANS)
    return None if name is None else state.steps[name]


def _product(state: "FlowState", node: tree.Binary) -> Pose | None:
    first, operations = tree.operation_chain(node)
    pose = certain(state, first)
    for operation in operations:
        step = certain(state, operation.right) if operation.operation == "*" else None
        if pose is None or step is None:
            return None
        pose = after(pose, step)
    return pose


def _matrix(state: "FlowState", node: tree.Matrix) -> Pose | None:
    if len(node.items) != _NUMBERS:
        return None
    turn, shift = _amounts(state, node.items[:9]), _lengths(state, node.items[9:])
    return None if turn is None or shift is None else (*turn, *shift)


def _function(state: "FlowState", node: tree.Function) -> Pose | None:
    key, arguments = node.name.key, node.arguments
    if key == "XYZ" and len(arguments) == 3:
        shift = _lengths(state, arguments)
        return None if shift is None else (*HERE[:9], *shift)
    if len(arguments) != 1:
        return None
    if key == "INV":
        pose = certain(state, arguments[0])
        return None if pose is None else inverse(pose)
    if key in ("ROTX", "ROTY", "ROTZ"):
        angle = _amounts(state, arguments)
        return None if angle is None else _turn("XYZ".index(key[-1]), angle[0] * state.symbols.units.radians)
    return None


def _turn(axis: int, angle: float) -> Pose:
    """Return the rotation about an axis by an angle [rad]."""
    pose = list(HERE)
    u, other = (axis + 1) % 3, (axis + 2) % 3
    pose[3 * u + u] = pose[3 * other + other] = math.cos(angle)
    pose[3 * u + other], pose[3 * other + u] = math.sin(angle), -math.sin(angle)
    return tuple(pose)


def _lengths(state: "FlowState", nodes: Sequence[tree.Expression]) -> tuple[float, ...] | None:
    amounts = _amounts(state, nodes)
    return None if amounts is None else tuple(amount * state.symbols.units.metres for amount in amounts)


def _amounts(state: "FlowState", nodes: Sequence[tree.Expression]) -> tuple[float, ...] | None:
    """Return numbers in the units of the program."""
    pose = []
    for node in nodes:
        if isinstance(node, tree.Number):
            number = None if math.isnan(node.value) else convert(node.value, node.unit, state.symbols.units)
        else:
            known = state.number(node)
            number = None if known is None else known[0]
        if number is None:
            return None
        pose.append(number)
    return tuple(pose)
