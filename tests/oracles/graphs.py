"""Graphs of traced equations run on floats, node by node: what an emitted kernel must agree with."""

from collections.abc import Callable, Sequence

import numpy as np

from armwright.tracing.graph import Graph, reachable


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


def _angle(y: complex, x: complex) -> complex:
    """The angle of the real point, and from there on to the complex one, which is near."""
    y_0, x_0 = np.real(y), np.real(x)
    return np.arctan2(y_0, x_0) + np.arctan((y * x_0 - x * y_0) / (x * x_0 + y * y_0))


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
