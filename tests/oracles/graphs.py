"""Graphs of traced equations run on floats, node by node: what an emitted kernel must agree with."""

import math
import operator
import struct
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from armwright.tracing.graph import Graph, reachable
from armwright.tracing.machine import MachineCode


def evaluate(graph: Graph, outputs: Sequence[int], inputs: Sequence[float]) -> list[float]:
    """Return the values of nodes of a graph, by folding it with constants for its inputs."""
    folded, values = Graph(), {}
    for i in reachable(graph, outputs):
        node = graph.nodes[i]
        if node.op in ("input", "constant"):
            values[i] = folded.constant(inputs[int(node.value)] if node.op == "input" else node.value)
        else:
            values[i] = folded.apply(node.op, *(values[j] for j in node.operands))
    return [folded.value(values[i]) for i in outputs]


def evaluate_machine(code: MachineCode, outputs: Sequence[int], inputs: Sequence[float], *, fma: bool = True) -> Any:
    """Return the values of nodes of the operations of a processor, by exact fractions where it rounds once.

    Args:
        code: the operations.
        outputs: which nodes; a truth value is a bool.
        inputs: numbers.
        fma: whether a product that is added to is not rounded.
    """
    joined = fused_multiply_add if fma else (lambda a, b, c: a * b + c)
    operations = {**_OPERATIONS, "fma": joined}
    values: dict[int, Any] = {}
    for i in code.order:
        op, operands, value = code.graph.nodes[i]
        if op == "constant":
            values[i] = value
        elif op == "input":
            values[i] = inputs[int(value)]
        else:
            values[i] = operations[op](*(values[j] for j in operands))
    return [values[i] for i in outputs]


def fused_multiply_add(a: float, b: float, c: float) -> float:
    """Return a · b + c, rounded once."""
    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    # The sign of a zero is that of the sum of zeros, and + where numbers cancel.
    return float(exact) if exact else a * b + c if 0 in (a, b) else 0.0


def _quotient(a: float, b: float) -> float:
    return float(np.float64(a) / np.float64(b))


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": _quotient,
    "negate": operator.neg,
    "absolute": abs,
    "sqrt": lambda a: float(np.sqrt(np.float64(a))),
    "less": operator.lt,
    "less_equal": operator.le,
    "select": lambda c, a, b: a if c else b,
    "bit": lambda a, place: bool(struct.unpack("<Q", struct.pack("<d", a))[0] >> int(place) & 1),
    "both": operator.and_,
    "either": operator.or_,
    "differ": operator.xor,
    "not": operator.not_,
    "number": float,
}


def _angle(y: complex, x: complex) -> complex:
    """The angle of the real point, and from there on to the complex one, which is near."""
    y_0, x_0 = np.real(y), np.real(x)
    return np.arctan2(y_0, x_0) + np.arctan((y * x_0 - x * y_0) / (x * x_0 + y * y_0))


def _cube_root(a: complex) -> complex:
    """The root of the real number, and from there on along its tangent."""
    root = np.cbrt(np.real(a))
    return root + 1j * np.imag(a) / (3 * root * root)


# Functions of complex numbers whose values and slopes at real ones are those of an operation.
_OF_COMPLEX: dict[str, Callable[..., complex]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "negate": lambda a: -a,
    "sin": np.sin,
    "cos": np.cos,
    "sqrt": np.sqrt,
    "cbrt": _cube_root,
    "exp": np.exp,
    "atan2": _angle,
    "absolute": lambda a: a if np.real(a) > 0 else -a,
    "round": lambda a: np.round(np.real(a)),
    "less": lambda a, b: np.real(a) < np.real(b),
    "less_equal": lambda a, b: np.real(a) <= np.real(b),
    "select": lambda condition, a, b: a if condition else b,
}
_STEP = 1e-150  # so small that its square is nothing beside 1, which a difference of two values could not take


def complex_step(graph: Graph, outputs: Sequence[int], inputs: Sequence[float], k: int) -> list[float]:
    """Return the derivatives of nodes by input ``k``, exact but for rounding: Squire & Trapp (1998)."""
    values: dict[int, complex] = {}
    for i in reachable(graph, outputs):
        op, operands, value = graph.nodes[i]
        if op == "input":
            values[i] = complex(inputs[int(value)], _STEP if int(value) == k else 0.0)
        else:
            values[i] = value if op == "constant" else _OF_COMPLEX[op](*(values[j] for j in operands))
    return [float(np.imag(values[i]) / _STEP) for i in outputs]
