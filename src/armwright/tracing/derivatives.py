"""Derivatives of a traced equation: a graph of its partial derivatives, by either mode of automatic differentiation.

Forward mode carries the derivative by one input along with every value; reverse mode carries the derivative of one
output back to everything that it depends on. Both write nodes into the graph of the equation, where terms that they
share with it or with each other are one node, and what is 0 disappears.

Where an operation has no derivative, the one here is

- 0 for ``round`` and for comparisons, and so for what a choice gains by changing over: Coulomb friction, as a
  function of the velocity, has the derivative 0 at rest, too. A choice has the derivative of the branch that is chosen.
- 0 for the absolute value at 0, and for the angle of the point (0, 0).
- 0 for a root at 0 and below, where ``sqrt`` itself is 0, and for a cube root at 0.

Source:
    Griewank & Walther (2008), Evaluating Derivatives, chapter 3.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import overload

from armwright.tracing.graph import Graph, Traced, operation_count, reachable
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix

# Rows of nodes: one per output, in it one per input.
Rows = list[list[int]]


def jacobian(outputs: Sequence[Scalar], inputs: Sequence[Traced]) -> Matrix:
    """Return the partial derivatives of outputs by inputs, by the mode that leaves fewer operations.

    Args:
        outputs: traced scalars, or numbers, which have no derivative.
        inputs: inputs of the graph of the equation, at least one.

    Returns:
        (outputs, inputs) traced scalars.

    Raises:
        TypeError: an output was traced in another graph.
    """
    graph = inputs[0].graph
    ends = [graph.node(x) for x in outputs]
    starts = [x.node for x in inputs]
    rows = None
    if not _may_divide_by_zero(graph, ends):
        rows = reverse_mode(graph, ends, starts)
        count = _count(graph, rows)
        other = forward_mode(graph, ends, starts, max_new=count)
        if other is not None and _count(graph, other) <= count:
            rows = other
    rows = rows or forward_mode(graph, ends, starts)
    return [[Traced(graph, node) for node in row] for row in rows]


@overload
def forward_mode(graph: Graph, outputs: Sequence[int], inputs: Sequence[int]) -> Rows: ...


@overload
def forward_mode(graph: Graph, outputs: Sequence[int], inputs: Sequence[int], max_new: int) -> Rows | None: ...


def forward_mode(
    graph: Graph, outputs: Sequence[int], inputs: Sequence[int], max_new: int | None = None
) -> Rows | None:
    """Return the nodes of the derivatives of outputs by inputs, one sweep per input.

    None where that takes more than ``max_new`` new nodes: to go on is a waste of time then.
    """
    order, first = reachable(graph, outputs), len(graph.nodes)
    zero = graph.constant(0.0)
    columns = []
    for x in inputs:
        tangents = {x: graph.constant(1.0)}
        for i in order:
            if (tangent := _tangent(graph, i, tangents)) is not None:
                tangents[i] = tangent
        columns.append([tangents.get(i, zero) for i in outputs])
        if max_new is not None and len(graph.nodes) - first > max_new:
            return None
    return [list(row) for row in zip(*columns, strict=True)]


def reverse_mode(graph: Graph, outputs: Sequence[int], inputs: Sequence[int]) -> Rows:
    """Return the nodes of the derivatives of outputs by inputs, one sweep per output.

    Where a branch that is not chosen divides by 0, the result may be NaN, which that of ``forward_mode`` is not.
    """
    zero = graph.constant(0.0)
    rows = []
    for y in outputs:
        order = reachable(graph, [y])
        depend = set(inputs)
        depend.update(i for i in order if i in depend or not depend.isdisjoint(graph.nodes[i].operands))
        adjoints = {y: graph.constant(1.0)}
        for i in reversed(order):
            if i not in adjoints or i not in depend:
                continue
            for k, operand in enumerate(graph.nodes[i].operands):
                share = _times_partial(graph, i, k, adjoints[i]) if operand in depend else None
                if share is not None:
                    adjoints[operand] = graph.apply("add", adjoints[operand], share) if operand in adjoints else share
        rows.append([adjoints.get(x, zero) for x in inputs])
    return rows


def replaced(scalars: Sequence[Scalar], by: Mapping[int, Scalar], graph: Graph) -> list[Scalar]:
    """Return scalars of a graph in which inputs have become other scalars.

    Args:
        scalars: traced scalars of the graph, or numbers.
        by: what to put for an input, by the number of its node; it must not need what is replaced.
        graph: the graph.
    """
    new = {node: x.node if isinstance(x, Traced) else graph.constant(float(x)) for node, x in by.items()}
    for i in reachable(graph, [x.node for x in scalars if isinstance(x, Traced)]):
        if i not in new:
            op, operands, _ = graph.nodes[i]
            changed = tuple(new[k] for k in operands)
            new[i] = i if changed == operands else graph.apply(op, *changed)
    return [Traced(graph, new[x.node]) if isinstance(x, Traced) else x for x in scalars]


def _count(graph: Graph, rows: Rows) -> int:
    return sum(operation_count(graph, [node for row in rows for node in row]).values())


def _may_divide_by_zero(graph: Graph, outputs: Sequence[int]) -> bool:
    """Whether a branch of a choice divides: perhaps by 0, where it is not chosen."""
    choices = [graph.nodes[i].operands[1:] for i in reachable(graph, outputs) if graph.nodes[i].op == "select"]
    branches = reachable(graph, [branch for branches in choices for branch in branches])
    return any(graph.nodes[i].op == "divide" for i in branches)


def _tangent(graph: Graph, i: int, tangents: Mapping[int, int]) -> int | None:
    """Return the derivative of a node, given those of its operands; None for 0."""
    op, operands, _ = graph.nodes[i]
    if op == "select":
        zero = graph.constant(0.0)
        return _unless_zero(graph, graph.apply("select", operands[0], *(tangents.get(k, zero) for k in operands[1:])))
    total: int | None = None
    for k, operand in enumerate(operands):
        part = _times_partial(graph, i, k, tangents[operand]) if operand in tangents else None
        if part is not None:
            total = part if total is None else graph.apply("add", total, part)
    return None if total is None else _unless_zero(graph, total)


def _times_partial(graph: Graph, i: int, k: int, x: int) -> int | None:
    """Return ``x`` times the derivative of a node by its operand number ``k``; None for 0."""
    op, operands, _ = graph.nodes[i]
    if op not in _PARTIALS:
        return None
    result = _PARTIALS[op](graph, i, operands, k, x)
    return None if result is None else _unless_zero(graph, result)


def _unless_zero(graph: Graph, node: int) -> int | None:
    return None if graph.value(node) == 0 else node


def _subtract(graph: Graph, _i: int, _operands: tuple[int, ...], k: int, x: int) -> int:
    return graph.apply("negate", x) if k == 1 else x


def _multiply(graph: Graph, _i: int, operands: tuple[int, ...], k: int, x: int) -> int:
    return graph.apply("multiply", x, operands[1 - k])


def _divide(graph: Graph, i: int, operands: tuple[int, ...], k: int, x: int) -> int:
    # One division for all derivatives.
    inverse = graph.apply("divide", graph.constant(1.0), operands[1])
    if k == 0:
        return graph.apply("multiply", x, inverse)
    return graph.apply("negate", graph.apply("multiply", x, graph.apply("multiply", i, inverse)))


def _sin(graph: Graph, _i: int, operands: tuple[int, ...], _k: int, x: int) -> int:
    return graph.apply("multiply", x, graph.apply("cos", *operands))


def _cos(graph: Graph, _i: int, operands: tuple[int, ...], _k: int, x: int) -> int:
    return graph.apply("negate", graph.apply("multiply", x, graph.apply("sin", *operands)))


def _inverse_where_positive(graph: Graph, factor: float, x: int) -> int:
    """Return factor / x where x is above 0, and 0 elsewhere."""
    zero = graph.constant(0.0)
    quotient = graph.apply("divide", graph.constant(factor), x)
    return graph.apply("select", graph.apply("less", zero, x), quotient, zero)


def _sqrt(graph: Graph, i: int, _operands: tuple[int, ...], _k: int, x: int) -> int:
    return graph.apply("multiply", x, _inverse_where_positive(graph, 0.5, i))


def _cbrt(graph: Graph, i: int, _operands: tuple[int, ...], _k: int, x: int) -> int:
    # By the square of the root, which is positive on either side of 0.
    return graph.apply("multiply", x, _inverse_where_positive(graph, 1 / 3, graph.apply("multiply", i, i)))


def _exp(graph: Graph, i: int, _operands: tuple[int, ...], _k: int, x: int) -> int:
    return graph.apply("multiply", x, i)


def _atan2(graph: Graph, _i: int, operands: tuple[int, ...], k: int, x: int) -> int:
    squares = [graph.apply("multiply", a, a) for a in operands]
    inverse = _inverse_where_positive(graph, 1.0, graph.apply("add", *squares))
    product = graph.apply("multiply", x, graph.apply("multiply", operands[1 - k], inverse))
    return graph.apply("negate", product) if k == 1 else product


def _absolute(graph: Graph, _i: int, operands: tuple[int, ...], _k: int, x: int) -> int:
    (a,) = operands
    zero, plus, minus = (graph.constant(value) for value in (0.0, 1.0, -1.0))
    below = graph.apply("select", graph.apply("less", a, zero), minus, zero)
    return graph.apply("multiply", x, graph.apply("select", graph.apply("less", zero, a), plus, below))


def _select(graph: Graph, _i: int, operands: tuple[int, ...], k: int, x: int) -> int | None:
    zero = graph.constant(0.0)
    if k == 0:
        return None
    return graph.apply("select", operands[0], *((x, zero) if k == 1 else (zero, x)))


# Of a graph, a node, its operands, the number of one of them and x: x times the derivative of the node by the operand.
_PARTIALS: dict[str, Callable[[Graph, int, tuple[int, ...], int, int], int | None]] = {
    "add": lambda _graph, _i, _operands, _k, x: x,
    "subtract": _subtract,
    "multiply": _multiply,
    "divide": _divide,
    "negate": lambda graph, _i, _operands, _k, x: graph.apply("negate", x),
    "sin": _sin,
    "cos": _cos,
    "sqrt": _sqrt,
    "cbrt": _cbrt,
    "exp": _exp,
    "atan2": _atan2,
    "absolute": _absolute,
    "select": _select,
}
