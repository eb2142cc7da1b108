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
