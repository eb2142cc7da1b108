"""Graphs evaluated with NumPy, node by node: the plain way to values of equations that exist as graphs alone."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from armwright.tracing.graph import Graph, Traced, reachable
from armwright.tracing.scalar import Scalar, atan2, cbrt, cos, exp, round_half_even, select, sin, sqrt


def evaluate(graph: Graph, outputs: Sequence[Scalar], inputs: Sequence[Scalar]) -> list[Scalar]:
    """Return the values of traced scalars.

    Args:
        graph: their graph.
        outputs: the scalars; numbers among them come back.
        inputs: the values of all inputs of the graph that they need: floats, or arrays of the same shape.

    Returns:
        A float or an array per output. A division by 0 is infinite, or NaN.
    """
    ends = [x.node for x in outputs if isinstance(x, Traced)]
    order = reachable(graph, ends)
    # Values are let go of once nothing needs them: those of many configurations take room.
    waiting = Counter(k for i in order for k in graph.nodes[i].operands) + Counter(ends)
    values: dict[int, Any] = {}
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for i in order:
            op, operands, value = graph.nodes[i]
            if op in ("input", "constant"):
                values[i] = inputs[int(value)] if op == "input" else value
                continue
            values[i] = _ON_ARRAYS[op](*(values[k] for k in operands))
            for k in operands:
                waiting[k] -= 1
                if not waiting[k]:
                    del values[k]
    return [values[x.node] if isinstance(x, Traced) else x for x in outputs]


_ON_ARRAYS: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "divide": np.divide,
    "negate": np.negative,
    "sin": sin,
    "cos": cos,
    "sqrt": sqrt,
    "cbrt": cbrt,
    "exp": exp,
    "atan2": atan2,
    "absolute": np.absolute,
    "round": round_half_even,
    # As numbers, which an equation may go on with.
    "less": lambda a, b: 1.0 * np.less(a, b),
    "less_equal": lambda a, b: 1.0 * np.less_equal(a, b),
    "select": lambda condition, then, otherwise: select(np.asarray(condition), then, otherwise),
}
