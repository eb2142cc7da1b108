"""From a graph to the source of a kernel: straight-line code inside a loop over many configurations.

Inputs and outputs are row-major at the door, one row per configuration. Inside, blocks of ``LANES`` configurations
are turned over so that each quantity lies in a row of its own; the loop over the lanes is what the compiler
vectorises. Every block is computed whole, the unused lanes of the last one too: so each configuration goes through
the same instructions whether it comes alone or among millions, and its bits are the same.
"""

import inspect
import textwrap
from collections.abc import Callable, Sequence

import attrs

from armwright.tracing import elementary
from armwright.tracing.graph import Graph, Traced, operation_count, reachable
from armwright.tracing.scalar import Scalar

# Configurations in a block: 64 lanes of the thirty-odd rows of a six-joint arm stay in the first-level cache.
LANES = 64

_INFIX = {
    "add": "{} + {}",
    "subtract": "{} - {}",
    "multiply": "{} * {}",
    "divide": "{} / {}",
    "negate": "-{}",
    "absolute": "abs({})",
    "sqrt": "sqrt({0} if {0} > 0.0 else 0.0)",
    "atan2": "arc_tangent({}, {})",
    "less": "{} < {}",
    "less_equal": "{} <= {}",
    "select": "{1} if {0} else {2}",
}

_HEAD = '''"""Emitted by armwright: {title}. {count} operations per configuration."""

from math import sqrt

import numpy as np
from numba import float64, njit, types

'''

_KERNEL = """
@njit(
    types.void({signature}),
    fastmath={{"contract"}}, error_model="numpy", nogil=True, cache=True,
)
def kernel({arguments}):
    x = np.zeros({in_size})
    y = np.zeros({out_size})
    for start in range(first, last, {lanes}):
        m = min({lanes}, last - start)
{load}
        for k in range({lanes}):
{body}
{store}
"""


@attrs.frozen(kw_only=True)
class Emitted:
    """The source of a kernel and what it takes.

    Attributes:
        title: what it computes, in words.
        source: Python for Numba.
        inputs: width of each input array.
        outputs: width of each output array.
        operations: how many of each kind, per configuration.
    """

    title: str
    source: str
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]
    operations: dict[str, int]


def emit(title: str, equation: Callable[..., Sequence[Sequence[Scalar]]], inputs: Sequence[int]) -> Emitted:
    """Trace an equation and write its kernel.

    Args:
        title: what it computes, in words.
        equation: takes one list of scalars per input, returns one list per output.
        inputs: how many scalars each input has.

    Returns:
        The kernel's source; its function takes the first row and the one after the last, then the arrays.
    """
    graph = Graph()
    lists = [graph.inputs(width) for width in inputs]
    results = equation(*lists)
    outputs = [[x.node if isinstance(x, Traced) else graph.constant(float(x)) for x in row] for row in results]
    flat = [node for row in outputs for node in row]
    widths = tuple(len(row) for row in outputs)
    operations = operation_count(graph, flat)
    names = [*(f"in{i}" for i in range(len(inputs))), *(f"out{i}" for i in range(len(outputs)))]
    kinds = ["types.int64"] * 2 + ["float64[:, ::1]"] * len(names)
    kernel = _KERNEL.format(
        signature=", ".join(kinds),
        arguments=", ".join(["first", "last", *names]),
        in_size=max(sum(inputs), 1) * LANES,
        out_size=max(sum(widths), 1) * LANES,
        lanes=LANES,
        load=_moves("in", inputs, "x[{row} * {lanes} + r] = {name}[start + r, {column}]"),
        body=textwrap.indent("\n".join(_lines(graph, flat)), " " * 12),
        store=_moves("out", widths, "{name}[start + r, {column}] = y[{row} * {lanes} + r]"),
    )
    head = _HEAD.format(title=title, count=sum(operations.values()))
    helpers = [name for name, ops in _HELPERS.items() if ops & set(operations)]
    return Emitted(
        title=title,
        source=head + "".join(_helper(name) for name in helpers) + kernel,
        inputs=tuple(inputs),
        outputs=widths,
        operations=operations,
    )


_HELPERS = {"sine_cosine": {"sin", "cos"}, "arc_tangent": {"atan2"}}


def _helper(name: str) -> str:
    text = inspect.getsource(getattr(elementary, name))
    return f'\n@njit(fastmath={{"contract"}}, error_model="numpy", forceinline=True)\n{text}\n'


def _moves(name: str, widths: Sequence[int], move: str) -> str:
    """Write the loops that carry rows in or out of a block."""
    lines: list[str] = []
    row = 0
    for i, width in enumerate(widths):
        lines.append("        for r in range(m):")
        lines += [
            "            " + move.format(name=f"{name}{i}", row=row + column, column=column, lanes=LANES)
            for column in range(width)
        ]
        row += width
    return "\n".join(lines)


def _lines(graph: Graph, outputs: Sequence[int]) -> list[str]:
    """Write one assignment per node, and the outputs at the end."""
    lines: list[str] = []
    names: dict[int, str] = {}
    circular: set[int] = set()
    for i in reachable(graph, outputs):
        node = graph.nodes[i]
        operands = [names[j] for j in node.operands]
        names[i] = f"v{i}"
        if node.op == "constant":
            names[i] = f"({node.value!r})"
        elif node.op == "input":
            lines.append(f"v{i} = x[{int(node.value)} * {LANES} + k]")
        elif node.op in ("sin", "cos"):
            angle = node.operands[0]
            names[i] = f"{node.op}{angle}"
            if angle not in circular:
                circular.add(angle)
                lines.append(f"sin{angle}, cos{angle} = sine_cosine({operands[0]})")
        else:
            lines.append(f"v{i} = {_INFIX[node.op].format(*operands)}")
    lines += [f"y[{place} * {LANES} + k] = {names[node]}" for place, node in enumerate(outputs)]
    return lines
