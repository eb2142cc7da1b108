"""The graph that an equation leaves when it is run on traced scalars: every value once, constants folded.

Nodes are hash-consed: the same operation on the same operands is the same node, so shared terms are computed once
however the equation is written. Constants are folded, and 0·x, 1·x, x+0, x-x and their like disappear; so the zeros of
an arm's twists and offsets cost nothing. That is right of finite numbers, which inputs must be. Where an equation
itself divides by 0, a product of 0 and the quotient is 0, not NaN.

The operations of a graph are

- ``constant`` and ``input``: leaves, with a value and an index.
- ``add``, ``subtract``, ``multiply``, ``divide``, ``negate``, ``absolute``, ``sqrt``, ``cbrt``, ``exp``, ``sin``,
  ``cos``, ``atan2``, and ``round``: to the nearest integer, the even one of two.
- ``less``, ``less_equal``: 1 where it holds, else 0; and ``select``: its second operand where the first is not 0, else
  its third.
- ``loop``: see ``Loop``; and its results, ``state`` and ``each``.

Source:
    Cooper & Torczon (2011), Engineering a Compiler, section 8.4.1: value numbering, with algebraic identities.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from armwright.arrays import number

_COMMUTATIVE = frozenset({"add", "multiply"})
# The exponential function of more than this is beyond the range of float64.
LARGEST_POWER = 709.782712893384
# The results of a loop.
_LOOP_RESULTS = frozenset({"state", "each"})


class Node(NamedTuple):
    """An operation and the numbers of the nodes that are its operands.

    Attributes:
        op: name of the operation.
        operands: numbers of nodes.
        value: of a constant its value; of an input, a loop and a result of a loop its index; 0 of others.
    """

    op: str
    operands: tuple[int, ...]
    value: float = 0.0


class TooManyNodesError(Exception):
    """A graph has more nodes than its limit."""


class LoopStep(NamedTuple):
    """What a loop does for one kind of link.

    Attributes:
        graph: its inputs are the state, then the values of the link, then the constants of the link.
        results: the nodes of the new state, then of the results of the link.
    """

    graph: "Graph"
    results: tuple[int, ...]


class Loop(NamedTuple):
    """A loop over links.

    Its node, ``loop``, has the index of the loop as its value. Its operands are the numbers of the state at the
    beginning and then, value by value, those of all links. Nodes of which it is the operand are the numbers of the last
    ``state``, by their index, and the results of ``each`` link: result k of link i of n has the index k n + i.

    Attributes:
        steps: by the kind of link.
        kinds: the kind of each link.
        constants: of each link, as many as its kind has.
        carried: how many numbers the state has.
        reverse: whether the last link comes first.
    """

    steps: tuple[LoopStep, ...]
    kinds: tuple[int, ...]
    constants: tuple[tuple[float, ...], ...]
    carried: int
    reverse: bool

    def links(self, operands: Sequence[int]) -> list[tuple[int, ...]]:
        """Return the operands of the loop's node that are values of links: those of all links, for each value."""
        n, values = len(self.kinds), operands[self.carried :]
        return [tuple(values[k : k + n]) for k in range(0, len(values), n)]


class Graph:
    """Nodes in an order in which each comes after its operands.

    Attributes:
        nodes: all of them.
        loops: those of the nodes ``loop``, by their index.
        rolls: whether a scan becomes a loop.
    """

    def __init__(self, *, rolls: bool = False, max_nodes: int | None = None) -> None:
        """Begin empty.

        Args:
            rolls: whether a scan becomes a loop; otherwise it is written out link by link.
            max_nodes: another node is refused with ``TooManyNodesError``; None for any number.
        """
        self.nodes: list[Node] = []
        self.loops: list[Loop] = []
        self.rolls = rolls
        self._max_nodes = max_nodes
        self._known: dict[tuple[Any, ...], int] = {}

    def inputs(self, count: int) -> list["Traced"]:
        """Return the next ``count`` inputs."""
        first = sum(node.op == "input" for node in self.nodes)
        return [Traced(self, self.record(Node("input", (), float(first + i)))) for i in range(count)]

    def constant(self, value: float) -> int:
        """Return the node of a constant; -0.0 is another than 0.0."""
        return self.record(Node("constant", (), float(value)))

    def apply(self, op: str, *operands: int) -> int:
        """Return the node of an operation, simplified where its value is known or it does nothing."""
        if all(self.nodes[i].op == "constant" for i in operands):
            return self.constant(_FOLD[op](*(self.nodes[i].value for i in operands)))
        if op in _SIMPLIFY and (simple := _SIMPLIFY[op](self, *operands)) is not None:
            return simple
        if op in _COMMUTATIVE:
            operands = tuple(sorted(operands))
        return self.record(Node(op, operands))

    def loop(self, loop: Loop, operands: Sequence[int]) -> int:
        """Return the node of a loop."""
        self.loops.append(loop)
        return self.record(Node("loop", tuple(operands), float(len(self.loops) - 1)))

    def value(self, node: int) -> float | None:
        """Return the value of a constant, None of any other node."""
        return self.nodes[node].value if self.nodes[node].op == "constant" else None

    def node(self, x: Any) -> int:
        """Return the node of a scalar, a traced one or a number.

        Raises:
            TypeError: it was traced in another graph, as where an equation or a scan takes it past its arguments.
            KindError: it is neither a scalar nor a number.
            InvalidValueError: it is a number beyond the range of float64.
        """
        if isinstance(x, bool | np.bool_):
            return self.constant(float(x))
        if not isinstance(x, Traced):
            return self.constant(number(x, "equation"))
        if x.graph is not self:
            raise TypeError(
                "a scalar of another graph: an equation, or a step of a scan, takes scalars from its arguments only"
            )
        return x.node

    def known(self, node: Node) -> int | None:
        """Return the number of a node, None if there is none like it."""
        return self._known.get(_key(node))

    def record(self, node: Node) -> int:
        """Return the node of an operation as it is, the same one for the same operation."""
        key = _key(node)
        if key not in self._known:
            if len(self.nodes) == self._max_nodes:
                raise TooManyNodesError
            self._known[key] = len(self.nodes)
            self.nodes.append(node)
        return self._known[key]


def _key(node: Node) -> tuple[Any, ...]:
    """Return the key of a node in the table of known ones; -0.0 is another constant than 0.0."""
    return node.op, node.operands, node.value, math.copysign(1.0, node.value)


_Operator: TypeAlias = Callable[["Traced", Any], "Traced"]


def _binary(op: str) -> tuple[_Operator, _Operator]:
    """Return the method of a binary operator, and the reflected one, whose operands are exchanged."""

    def method(self: "Traced", other: Any) -> "Traced":
        return traced(op, self, other)

    def reflected(self: "Traced", other: Any) -> "Traced":
        return traced(op, other, self)

    return method, reflected


class Traced:
    """A scalar that writes down what is done with it."""

    __slots__ = ("graph", "node")
    __hash__ = None  # type: ignore[assignment]
    # NumPy must not take a traced scalar apart when a float64 meets it.
    __array_ufunc__ = None

    def __init__(self, graph: Graph, node: int) -> None:
        """Stand for a node of a graph."""
        self.graph, self.node = graph, node

    __add__, __radd__ = _binary("add")
    __sub__, __rsub__ = _binary("subtract")
    __mul__, __rmul__ = _binary("multiply")
    __truediv__, __rtruediv__ = _binary("divide")
    __lt__, __gt__ = _binary("less")
    __le__, __ge__ = _binary("less_equal")

    def __eq__(self, other: object) -> "Traced":  # type: ignore[override]
        # One number is equal to another where neither is less; nothing is equal to what is not a number.
        return traced("multiply", traced("less_equal", self, other), traced("less_equal", other, self))

    def __ne__(self, other: object) -> "Traced":  # type: ignore[override]
        return traced("subtract", 1.0, self == other)

    def __neg__(self) -> "Traced":
        return traced("negate", self)

    def __abs__(self) -> "Traced":
        return traced("absolute", self)

    def __pow__(self, power: int) -> "Traced":
        if isinstance(power, Traced) or power != 2:
            raise TypeError("a traced scalar has no power but 2: write products, quotients and sqrt")
        return self * self

    def __bool__(self) -> bool:
        raise TypeError("a traced scalar has no truth value yet: write select(condition, then, otherwise)")

    def __float__(self) -> float:
        raise TypeError("a traced scalar has no value yet: of functions take sin, cos and others of armwright.tracing")

    def __repr__(self) -> str:
        return "<traced scalar>"


def traced(op: str, *operands: Any) -> Traced:
    """Apply an operation to scalars of which at least one is traced."""
    graph = next(x.graph for x in operands if isinstance(x, Traced))
    return Traced(graph, graph.apply(op, *(graph.node(x) for x in operands)))


def is_traced(*scalars: Any) -> bool:
    """Whether any of the scalars is traced."""
    return any(isinstance(x, Traced) for x in scalars)


def reachable(graph: Graph, outputs: Iterable[int]) -> list[int]:
    """Return the nodes that the outputs need, in order."""
    needed = set()
    waiting = list(outputs)
    while waiting:
        node = waiting.pop()
        if node not in needed:
            needed.add(node)
            waiting.extend(graph.nodes[node].operands)
    return sorted(needed)


def nodes_of_angles(graph: Graph) -> set[int]:
    """Return the nodes that the argument of a sine or cosine depends on, and the arguments themselves."""
    angles: list[int] = []
    for op, operands, value in graph.nodes:
        if op in ("sin", "cos"):
            angles.append(operands[0])
        elif op == "loop":
            angles += _angles_of_loop(graph.loops[int(value)], operands)
    return set(reachable(graph, angles))


def _angles_of_loop(loop: Loop, operands: Sequence[int]) -> list[int]:
    """Return the operands of a loop that the arguments of its sines and cosines depend on."""
    angles: list[int] = []
    values = loop.links(operands)
    for kind, step in enumerate(loop.steps):
        nodes = [step.graph.nodes[i] for i in nodes_of_angles(step.graph)]
        inputs = {int(node.value) for node in nodes if node.op == "input"}
        # An angle that depends on the state may depend on anything.
        if any(k < loop.carried for k in inputs):
            return list(operands)
        used = [values[k - loop.carried] for k in inputs if k - loop.carried < len(values)]
        angles += [
            of_links[i] for of_links in used for i, kind_of_link in enumerate(loop.kinds) if kind_of_link == kind
        ]
    return angles


def operation_count(graph: Graph, outputs: Iterable[int]) -> dict[str, int]:
    """Count the operations that the outputs need, by kind; inputs and constants cost nothing.

    Those of a loop are counted for every link.
    """
    count: Counter[str] = Counter()
    for node in (graph.nodes[i] for i in reachable(graph, outputs)):
        if node.op == "loop":
            loop = graph.loops[int(node.value)]
            of_kinds = [operation_count(*step) for step in loop.steps]
            for kind in loop.kinds:
                count.update(of_kinds[kind])
        elif node.operands and node.op not in _LOOP_RESULTS:
            count[node.op] += 1
    return dict(sorted(count.items()))


def _quotient(a: float, b: float) -> float:
    """Divide as the processor does: by 0 too."""
    if b:
        return a / b
    return math.nan if a == 0 or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1.0, b)


def exponential(a: float) -> float:
    """Return e to the power of ``a``, infinity beyond the range of float64."""
    return math.exp(a) if not a > LARGEST_POWER else math.inf


_FOLD: dict[str, Callable[..., float]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": _quotient,
    "negate": lambda a: -a,
    "sin": lambda a: math.sin(a) if math.isfinite(a) else math.nan,
    "cos": lambda a: math.cos(a) if math.isfinite(a) else math.nan,
    "sqrt": lambda a: math.sqrt(max(a, 0.0)),
    "cbrt": math.cbrt,
    "exp": exponential,
    "atan2": math.atan2,
    "absolute": abs,
    "round": lambda a: float(round(a)) if math.isfinite(a) else a,
    "less": lambda a, b: float(a < b),
    "less_equal": lambda a, b: float(a <= b),
    "select": lambda c, a, b: a if c else b,
}


def _simple_add(graph: Graph, a: int, b: int) -> int | None:
    for x, y in ((a, b), (b, a)):
        if graph.value(x) == 0:
            return y
        if graph.nodes[y].op == "negate":
            return graph.apply("subtract", x, graph.nodes[y].operands[0])
    return None


def _simple_subtract(graph: Graph, a: int, b: int) -> int | None:
    if graph.value(b) == 0:
        return a
    if a == b:
        return graph.constant(0.0)
    if graph.value(a) == 0:
        return graph.apply("negate", b)
    if graph.nodes[b].op == "negate":
        return graph.apply("add", a, graph.nodes[b].operands[0])
    return None


def _simple_multiply(graph: Graph, a: int, b: int) -> int | None:
    for x, y in ((a, b), (b, a)):
        value = graph.value(x)
        if value == 0:
            return graph.constant(0.0)
        if value == 1:
            return y
        if value == -1:
            return graph.apply("negate", y)
    signs = [graph.nodes[x].op == "negate" for x in (a, b)]
    if any(signs):
        bare = [graph.nodes[x].operands[0] if sign else x for x, sign in zip((a, b), signs, strict=True)]
        product = graph.apply("multiply", *bare)
        return product if all(signs) else graph.apply("negate", product)
    return None


def _simple_divide(graph: Graph, a: int, b: int) -> int | None:
    if graph.value(a) == 0:
        return graph.constant(0.0)
    if graph.value(b) in (1, -1):
        return a if graph.value(b) == 1 else graph.apply("negate", a)
    return None


def _simple_negate(graph: Graph, a: int) -> int | None:
    node = graph.nodes[a]
    if node.op == "negate":
        return node.operands[0]
    if node.op == "subtract":
        return graph.apply("subtract", *reversed(node.operands))
    return None


def _simple_parity(op: str) -> Callable[[Graph, int], int | None]:
    def simplify(graph: Graph, a: int) -> int | None:
        node = graph.nodes[a]
        if node.op != "negate":
            return None
        of_positive = graph.apply(op, node.operands[0])
        return of_positive if op in ("cos", "absolute") else graph.apply("negate", of_positive)

    return simplify


def _simple_select(graph: Graph, condition: int, then: int, otherwise: int) -> int | None:
    value = graph.value(condition)
    if value is not None:
        return then if value else otherwise
    # Two zeros of either sign are one choice: the sign of a zero is not worth a comparison.
    alike = then == otherwise or (graph.value(then) is not None and graph.value(then) == graph.value(otherwise))
    return otherwise if alike else None


_SIMPLIFY: dict[str, Callable[..., int | None]] = {
    "add": _simple_add,
    "subtract": _simple_subtract,
    "multiply": _simple_multiply,
    "divide": _simple_divide,
    "negate": _simple_negate,
    "sin": _simple_parity("sin"),
    "cos": _simple_parity("cos"),
    "absolute": _simple_parity("absolute"),
    "select": _simple_select,
}
