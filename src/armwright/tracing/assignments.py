"""From a graph to the assignments of a kernel, the same for one configuration and for many."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from armwright.arrays import LARGEST
from armwright.tracing.graph import Graph, Node, reachable

_INFIX = {
    "add": "{} + {}",
    "subtract": "{} - {}",
    "multiply": "{} * {}",
    "divide": "{} / {}",
    "negate": "-{}",
    "absolute": "abs({})",
    # Adding and taking away 1.5 · 2^52 leaves no digit behind the point.
    "round": "({} + 6755399441055744.0) - 6755399441055744.0",
    "sqrt": "sqrt({0} if {0} > 0.0 else 0.0)",
    "atan2": "arc_tangent({}, {})",
    "less": "{} < {}",
    "less_equal": "{} <= {}",
    "select": "{1} if {0} else {2}",
}

# The operations that may take in a multiplication.
_SUMS = frozenset({"add", "subtract"})

# No input whose sine is taken is larger: less than ten digits would be right.
LARGEST_ANGLE = 1e12
_NOT_FINITE = {"nan": "np.nan", "inf": "np.inf", "-inf": "-np.inf"}


class Watched(NamedTuple):
    """Sums of squares that are finite where a configuration is valid.

    Attributes:
        angles: inputs whose sine is taken, which must be finite and no larger than ``LARGEST_ANGLE``.
        others: inputs that must be finite and no larger than ``LARGEST``.
        positive: nodes that must be above 0.
        bounds: by node, beyond what it is unusual.
    """

    angles: Sequence[int]
    others: Sequence[int]
    positive: Sequence[int]
    bounds: Mapping[int, float]

    @property
    def inputs(self) -> tuple[int, ...]:
        """All inputs."""
        return (*self.angles, *self.others)

    def lines(self, names: Mapping[int, str]) -> Iterator[str]:
        """Give the assignments of ``trust``: 0; not a number without meaning; above 0 where an input is unusual."""
        # One sum of squares tells of each of them: it is not a number, infinite or too large where one of them is.
        yield "trust = 0.0"
        for inputs, largest in ((self.angles, LARGEST_ANGLE), (self.others, LARGEST)):
            yield "size = 0.0"
            yield from (f"size = fma({names[i]}, {names[i]}, size)" for i in inputs)
            yield f"trust = trust if size <= {largest**2!r} else np.nan"
        yield from (f"trust = trust if {names[i]} > 0.0 else np.nan" for i in self.positive)
        yield from (
            f"trust = trust if abs({names[i]}) <= {bound!r} else trust + 1.0" for i, bound in self.bounds.items()
        )


class Code:
    """The assignments of a kernel, the same for one configuration and for many."""

    def __init__(self, graph: Graph, outputs: Sequence[int], watched: Watched | None = None) -> None:
        self._graph, self._outputs, self._watched = graph, outputs, watched
        required = [*outputs, *(watched.positive if watched else ())]
        self._order = reachable(graph, [*(watched.inputs if watched else ()), *required])
        self.joined = fused(graph, self._order, required)

    def lines(self, load: Sequence[str], store: Sequence[str]) -> str:
        """Write one assignment per node and, of what is watched, whether the inputs can be trusted.

        Args:
            load: where each input comes from.
            store: the statement that takes each output, with a gap for its name.
        """
        lines: list[str] = []
        names: dict[int, str] = {}
        angles: set[int] = set()
        joined_products = set(self.joined.values())
        for i in self._order:
            node = self._graph.nodes[i]
            names[i] = f"v{i}"
            if node.op == "constant":
                names[i] = f"({node.value!r})" if math.isfinite(node.value) else f"({_NOT_FINITE[str(node.value)]})"
            elif node.op == "input":
                lines.append(f"v{i} = {load[int(node.value)]}")
            elif node.op in ("sin", "cos"):
                angle = node.operands[0]
                names[i] = f"{node.op}{angle}"
                if angle not in angles:
                    angles.add(angle)
                    lines.append(f"sin{angle}, cos{angle} = sine_cosine({names[angle]})")
            elif i in self.joined:
                lines.append(f"v{i} = {self._fused(node, self.joined[i], names)}")
            elif i not in joined_products:
                lines.append(f"v{i} = {_INFIX[node.op].format(*(names[j] for j in node.operands))}")
        lines += [statement.format(names[node]) for statement, node in zip(store, self._outputs, strict=True)]
        return "\n".join([*lines, *(self._watched.lines(names) if self._watched else ())])

    def _fused(self, node: Node, product: int, names: dict[int, str]) -> str:
        a, b = (names[j] for j in self._graph.nodes[product].operands)
        first, second = node.operands
        if node.op == "add":
            return f"fma({a}, {b}, {names[second if first == product else first]})"
        return f"fma({a}, {b}, -{names[second]})" if first == product else f"fma(-{a}, {b}, {names[first]})"


def fused(graph: Graph, order: Iterable[int], outputs: Iterable[int]) -> dict[int, int]:
    """Return which multiplication each sum takes in: number of the sum -> number of the multiplication.

    A compiler may join a · b + c in one instruction, rounded once, on its own, but then what it does depends on what
    stands around the code. Here it is part of the graph's translation, so a kernel gives the same bits however it is
    compiled: alone, in a vectorised loop, inlined into another loop.

    A multiplication is taken in only where that makes it disappear: by all sums that use it, or by none.

    Args:
        graph: the graph.
        order: the nodes in use.
        outputs: the nodes whose values are asked for.
    """
    users: dict[int, list[int]] = {}
    for i in order:
        for operand in set(graph.nodes[i].operands):
            users.setdefault(operand, []).append(i)
    required = set(outputs)
    products = [
        i
        for i, of in users.items()
        if graph.nodes[i].op == "multiply" and i not in required and all(graph.nodes[j].op in _SUMS for j in of)
    ]
    taken: dict[int, int] = {}
    # Those with one user first: each of them is one instruction less, whatever becomes of the others.
    for i in sorted(products, key=lambda i: (len(users[i]), -i)):
        squares = any(graph.nodes[j].operands == (i, i) for j in users[i])
        if not squares and not any(j in taken for j in users[i]):
            taken.update(dict.fromkeys(users[i], i))
    return taken
