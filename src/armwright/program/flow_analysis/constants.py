"""Constant propagation: numbers and conditions that are known before a program runs."""

import math
from collections.abc import Callable, Mapping
from operator import add, eq, ge, gt, le, lt, mul, ne, sub, truediv

from armwright.program.syntax import tree

_ARITHMETIC: Mapping[str, Callable[[float, float], float]] = {"+": add, "-": sub, "*": mul, "/": truediv}
_RELATIONS: Mapping[str, Callable[[float, float], bool]] = {"<": lt, "<=": le, "=": eq, "<>": ne, ">=": ge, ">": gt}
# Rounding does not drop the last pass of a loop.
_ROUNDING = 1e-9

# Returns the constant value of a number or variable; None where it is not constant.
Known = Callable[[tree.Expression], float | None]


def constant_value(node: tree.Expression, known: Known) -> float | None:
    """Return the constant value of an expression; None where it is not constant, or not finite."""
    if isinstance(node, tree.Unary):
        inner = constant_value(node.operand, known) if node.operation == "-" else None
        return None if inner is None else -inner
    if not isinstance(node, tree.Binary):
        return known(node)
    first, operations = tree.operation_chain(node)
    result = constant_value(first, known)
    for operation in operations:
        calculate, right = _ARITHMETIC.get(operation.operation), constant_value(operation.right, known)
        if result is None or right is None or calculate is None:
            return None
        try:
            result = calculate(result, right)
        except (ArithmeticError, ValueError):
            return None
    return result if result is not None and math.isfinite(result) else None


def condition_value(node: tree.Expression, known: Known) -> bool | None:
    """Return the value of a condition; None where it is not constant."""
    if isinstance(node, tree.Name):
        value = known(node)
        return None if value is None else bool(value)
    if isinstance(node, tree.Unary) and node.operation == "NOT":
        inner = condition_value(node.operand, known)
        return None if inner is None else not inner
    if not isinstance(node, tree.Binary):
        return None
    if node.operation in _RELATIONS:
        left_value, right = constant_value(node.left, known), constant_value(node.right, known)
        return None if left_value is None or right is None else _RELATIONS[node.operation](left_value, right)
    first, operations = tree.operation_chain(node)
    result = condition_value(first, known)
    for operation in operations:
        if operation.operation not in ("AND", "OR"):
            return None
        # The right side of AND matters where the left one holds, that of OR where it does not.
        if result is None or result is (operation.operation == "AND"):
            right = condition_value(operation.right, known)
            result = right if result is not None or right is not (operation.operation == "AND") else None
    return result


def iteration_count(node: tree.For, known: Known) -> int | None:
    """Return the iterations of a FOR: 0, 1, or 2 for more; None where they are not constant."""
    first, last = constant_value(node.first, known), constant_value(node.last, known)
    step = 1.0 if node.step is None else constant_value(node.step, known)
    if first is None or last is None or not step:
        return None
    return int(min(2, max(0, (last - first) / step + _ROUNDING + 1)))
