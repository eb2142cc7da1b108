"""What is certain of numbers and conditions before a program runs."""

import math
from collections.abc import Callable, Mapping
from operator import add, eq, ge, gt, le, lt, mul, ne, sub, truediv

from armwright.program.syntax import tree

_ARITHMETIC: Mapping[str, Callable[[float, float], float]] = {"+": add, "-": sub, "*": mul, "/": truediv}
_RELATIONS: Mapping[str, Callable[[float, float], bool]] = {"<": lt, "<=": le, "=": eq, "<>": ne, ">=": ge, ">": gt}
# A last pass of a loop that rounding would leave out is made.
_ROUNDING = 1e-9

# Gives the value of a number or variable; None where it is not certain.
Known = Callable[[tree.Expression], float | None]


def value(node: tree.Expression, known: Known) -> float | None:
    """Return what an expression comes to; None where that is not certain, or no finite number."""
    if isinstance(node, tree.Unary):
        inner = value(node.operand, known) if node.operation == "-" else None
        return None if inner is None else -inner
    if not isinstance(node, tree.Binary):
        return known(node)
    first, operations = tree.operation_chain(node)
    result = value(first, known)
    for operation in operations:
        calculate, right = _ARITHMETIC.get(operation.operation), value(operation.right, known)
        if result is None or right is None or calculate is None:
            return None
        try:
            result = calculate(result, right)
        except (ArithmeticError, ValueError):
            return None
    return result if result is not None and math.isfinite(result) else None


def holds(node: tree.Expression, known: Known) -> bool | None:
    """Return whether a condition holds; None where that is not certain."""
    if isinstance(node, tree.Unary) and node.operation == "NOT":
        inner = holds(node.operand, known)
        return None if inner is None else not inner
    if not isinstance(node, tree.Binary):
        return None
    if node.operation in _RELATIONS:
        left_value, right = value(node.left, known), value(node.right, known)
        return None if left_value is None or right is None else _RELATIONS[node.operation](left_value, right)
    first, operations = tree.operation_chain(node)
    result = holds(first, known)
    for operation in operations:
        if operation.operation not in ("AND", "OR"):
            return None
        # The right side of AND matters where the left one holds, that of OR where it does not.
        if result is None or result is (operation.operation == "AND"):
            right = holds(operation.right, known)
            result = right if result is not None or right is not (operation.operation == "AND") else None
    return result


def passes(node: tree.For, known: Known) -> int | None:
    """Return how often a FOR runs: 0, 1, or 2 for more often; None where that is not certain."""
    first, last = value(node.first, known), value(node.last, known)
    step = 1.0 if node.step is None else value(node.step, known)
    if first is None or last is None or not step:
        return None
    return int(min(2, max(0, (last - first) / step + _ROUNDING + 1)))
