"""From a traced graph to the operations of a processor, the same for every language that is emitted.

Elementary functions are written out, and which multiplication and addition become one instruction is written down, not
left to a compiler: so a configuration has the same bits whatever the language, the width of the vectors, and the code
around it.

The operations are those of a ``Graph`` without ``sin``, ``cos``, ``atan2``, ``exp``, ``cbrt`` and ``round``, and

- ``fma``: a · b + c, rounded once.
- ``bit``: whether a bit of the representation of a number is set; its number is the value of the second operand.
- ``both``, ``either``, ``differ``, ``not``: of truth values.
- ``number``: 1 for a truth value that holds, else 0.

The steps of loops are translated in the same way, each by itself; only numbers come in and go out.

Code for other types of numbers than double keeps these, which the library of its language has for each type. It has one
more operation:

- ``limit``: a constant that may be beyond the range of the type, which then has a limit of its own.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from armwright.arrays import LARGEST, LARGEST_ANGLE
from armwright.tracing.elementary import arc_tangent, cube_root, exponential, root, rounded, sine_cosine
from armwright.tracing.graph import Graph, Loop, LoopStep, Node, Traced, reachable
from armwright.tracing.scalar import select

# The operations whose result is a truth value.
TRUTHS = frozenset({"less", "less_equal", "bit", "both", "either", "differ", "not"})
# The operations that may take in a multiplication.
_SUMS = frozenset({"add", "subtract"})
# What the library of a language has for each type of numbers.
_OF_A_LIBRARY = frozenset({"sin", "cos", "atan2", "exp", "cbrt", "round"})

# Larger angles, which an equation may compute of its inputs, have no sine: it is NaN.
_LARGEST_REDUCED = 1e15


class Watched(NamedTuple):
    """The conditions that make a configuration valid, and those that make it unusual, by the numbers of nodes.

    Attributes:
        angles: inputs whose sine is taken, which must be finite and no larger than ``LARGEST_ANGLE``.
        others: inputs that must be finite and no larger than ``LARGEST``.
        positive: nodes that must be above 0.
        bounds: magnitudes beyond which nodes are unusual.
    """

    angles: Sequence[int] = ()
    others: Sequence[int] = ()
    positive: Sequence[int] = ()
    bounds: Mapping[int, float] = {}


class MachineCode(NamedTuple):
    """A graph of the operations of a processor.

    Attributes:
        graph: its nodes, each behind its operands.
        order: the nodes that the outputs and conditions need.
        outputs: the nodes of the outputs; numbers, but for flags, which are truth values.
        invalid: the truth value that a configuration has no meaning; None where none is watched.
        unusual: the truth value that an input is beyond its bound; None where there are no bounds.
        joined: how many additions take in a multiplication.
    """

    graph: Graph
    order: list[int]
    outputs: list[int]
    invalid: int | None
    unusual: int | None
    joined: int


def machine_code(
    graph: Graph,
    outputs: Sequence[int],
    watched: Watched | None = None,
    flags: Iterable[int] = (),
    *,
    any_type: bool = False,
) -> MachineCode:
    """Translate a traced graph.

    Args:
        graph: the graph of an equation.
        outputs: the nodes of the outputs.
        watched: what is watched, if anything.
        flags: which outputs, by their numbers, are truth values.
        any_type: whether it is for any type of numbers, not for double alone.
    """
    watched = watched or Watched()
    target = _Target(Graph(), any_type=any_type)
    new = target.translated(graph, [*watched.angles, *watched.others], [*outputs, *watched.positive])
    truths = set(flags)
    ends = [target.truth(new[i]) if k in truths else target.number(new[i]) for k, i in enumerate(outputs)]
    invalid, unusual = target.verdicts(watched, new)
    all_ends = [*ends, *(x for x in (invalid, unusual) if x is not None)]
    return MachineCode(target.graph, reachable(target.graph, all_ends), ends, invalid, unusual, target.joined)


def with_results(
    code: MachineCode, groups: Sequence[Sequence[int]], *, in_turn: bool = False
) -> list[tuple[int, list[int]]]:
    """Return the nodes in use in an order in which results are complete early, each with those it completes.

    A result that is written as soon as it is known is not live until the end, and takes no register there. Conditions,
    too, stand right behind what they are about: at the end they would keep all inputs live.

    Args:
        code: operations.
        groups: nodes whose values are written together.
        in_turn: whether the groups are to be complete one after the other; otherwise the nodes stay in their order.

    Returns:
        The nodes, each with the numbers of the groups that are complete with it.
    """
    rank: dict[int, int] = {i: i for i in reachable(code.graph, code.outputs)} if not in_turn else {}
    for k, nodes in enumerate(groups if in_turn else ()):
        waiting = list(nodes)
        while waiting:
            if (i := waiting.pop()) not in rank:
                rank[i] = k
                waiting.extend(code.graph.nodes[i].operands)
    for i in code.order:
        if i not in rank:
            rank[i] = max((rank[k] for k in code.graph.nodes[i].operands), default=0)
    order = sorted(code.order, key=lambda i: (rank[i], i))
    index = {node: k for k, node in enumerate(order)}
    complete: list[list[int]] = [[] for _ in order]
    last = 0
    for k, nodes in enumerate(groups):
        last = max(last if in_turn else 0, *(index[i] for i in nodes))
        complete[last].append(k)
    return list(zip(order, complete, strict=True))


# The processor for which operations are scheduled: how many multiplications, and how many additions, it issues in a
# cycle; after how many cycles the results of these, and of other operations, are ready; and among how many operations
# the next ones are chosen.
_ISSUE_WIDTH, _LATENCY, _LATENCY_OF_OTHERS, _WINDOW = 2, 4, 1, 100
_MULTIPLY = frozenset({"multiply", "fma"})
_WITHOUT_INSTRUCTION = frozenset({"constant", "limit", "input"})


def scheduled(graph: Graph, order: Sequence[int]) -> list[int]:
    """Return nodes in an order in which a processor that issues several operations at a time need not wait for results.

    Operations of one sum or one sweep wait for each other; others stand between them then. The order given is kept as
    far as that allows, so that not many more values are live at a time.

    Args:
        graph: their graph.
        order: nodes, each behind its operands; no loops.

    Source:
        List scheduling: Cooper & Torczon (2011), Engineering a Compiler, section 12.3, with the given order for the
        priority.
    """
    nodes = graph.nodes
    result = [i for i in order if nodes[i].op in _WITHOUT_INSTRUCTION]
    ready_at: dict[int, int] = dict.fromkeys(result, 0)
    waiting = [i for i in order if i not in ready_at]
    cycle = 0
    while waiting:
        # Units for multiplications and for others; of the others, only additions occupy one.
        free = {True: _ISSUE_WIDTH, False: _ISSUE_WIDTH}
        issued = set()
        for i in waiting[:_WINDOW]:
            op, operands, _ = nodes[i]
            multiplies = op in _MULTIPLY
            if free[multiplies] and all(ready_at.get(k, cycle + 1) <= cycle for k in operands):
                issued.add(i)
                is_counted = multiplies or op in _SUMS
                if is_counted:
                    free[multiplies] -= 1
                ready_at[i] = cycle + (_LATENCY if is_counted else _LATENCY_OF_OTHERS)
                result.append(i)
        if issued:
            waiting = [*(i for i in waiting[:_WINDOW] if i not in issued), *waiting[_WINDOW:]]
        cycle += 1
    return result


def _used_results(graph: Graph, order: Iterable[int]) -> dict[int, list[int]]:
    """Return which results of the links are used, by the node of the loop."""
    used: dict[int, set[int]] = {}
    for i in order:
        op, operands, value = graph.nodes[i]
        if op == "each":
            loop = graph.loops[int(graph.nodes[operands[0]].value)]
            used.setdefault(operands[0], set()).add(int(value) // len(loop.kinds))
    return {i: sorted(results) for i, results in used.items()}


class _Target:
    """The graph under construction."""

    def __init__(self, graph: Graph, *, any_type: bool) -> None:
        self.graph, self._any_type = graph, any_type
        self._kept = _OF_A_LIBRARY if any_type else frozenset()
        self.joined = 0
        # The sines and cosines of angles.
        self._sine_cosines: dict[int, tuple[Traced, Traced]] = {}
        # The largest magnitudes of values where all inputs are angles, by node, complete up to a node.
        self._magnitudes: dict[int, float] = {}
        self._first_unknown = 0

    def translated(self, graph: Graph, inputs: Sequence[int], required: Sequence[int]) -> dict[int, int]:
        """Translate what inputs and required nodes of a traced graph need; return the new nodes by the old ones."""
        order = reachable(graph, [*inputs, *required])
        joined = fused(graph, order, required)
        self.joined += len(joined)
        new: dict[int, int] = {}
        absorbed = set(joined.values())
        used = _used_results(graph, order)
        for i in order:
            node = graph.nodes[i]
            if node.op == "loop":
                new[i] = self._loop(graph.loops[int(node.value)], used.get(i, []), [new[k] for k in node.operands])
            elif node.op == "each":
                (loop,) = node.operands
                links = len(graph.loops[int(graph.nodes[loop].value)].kinds)
                k, link = divmod(int(node.value), links)
                index = used[loop].index(k) * links + link
                new[i] = self.graph.record(Node("each", (new[loop],), float(index)))
            elif i in joined:
                new[i] = self._fused(node, new, joined[i], graph.nodes[joined[i]])
            elif i not in absorbed:
                new[i] = self._operation(node, new)
        return new

    def _loop(self, loop: Loop, used: Sequence[int], operands: Sequence[int]) -> int:
        """Return the node of a loop that leaves of the results of the links those that are used."""
        steps = []
        for step in loop.steps:
            results = [*step.results[: loop.carried], *(step.results[loop.carried + k] for k in used)]
            target = _Target(Graph(), any_type=self._any_type)
            new = target.translated(step.graph, [], results)
            steps.append(LoopStep(target.graph, tuple(target.number(new[i]) for i in results)))
            self.joined += target.joined * loop.kinds.count(len(steps) - 1)
        return self.graph.loop(loop._replace(steps=tuple(steps)), [self.number(i) for i in operands])

    def _operation(self, node: Node, new: Mapping[int, int]) -> int:
        """Return the node for one of the traced graph, whose operands are translated."""
        if node.op in ("constant", "input"):
            return self.graph.record(node)
        operands = [new[i] for i in node.operands]
        if node.op == "select":
            return self._op("select", self.truth(operands[0]), *map(self.number, operands[1:]))
        if node.op == "state":
            return self.graph.record(node._replace(operands=tuple(operands)))
        return self._written_out(node.op, [self.number(i) for i in operands])

    def _written_out(self, op: str, operands: Sequence[int]) -> int:
        """Return the node of an operation of numbers; elementary functions are written out, unless they are kept."""
        if op in _WRITTEN_OUT and op not in self._kept:
            written = _WRITTEN_OUT[op](*(Traced(self.graph, i) for i in operands)).node
            if op == "atan2":
                self._magnitudes[written] = math.pi
            return written
        is_circular = op in ("sin", "cos") and op not in self._kept
        return self._sine_or_cosine(operands[0], op) if is_circular else self._op(op, *operands)

    def _sine_or_cosine(self, angle: int, op: str) -> int:
        """Return the sine or cosine of an angle, of which both are written out together."""
        if angle not in self._sine_cosines:
            x = Traced(self.graph, angle)
            sine, cosine = sine_cosine(x)
            if not self._magnitude(angle) <= _LARGEST_REDUCED:
                # Beyond, what is written out is not even between -1 and 1.
                is_reduced = abs(x) <= _LARGEST_REDUCED
                sine, cosine = select(is_reduced, sine, math.nan), select(is_reduced, cosine, math.nan)
            self._sine_cosines[angle] = sine, cosine
            self._magnitudes |= {sine.node: 1.0, cosine.node: 1.0}
        return self._sine_cosines[angle][op == "cos"].node

    def _magnitude(self, node: int) -> float:
        """Return the largest magnitude of a value where all inputs are angles, by interval arithmetic."""
        for i in range(self._first_unknown, node + 1):
            if i not in self._magnitudes:
                op, operands, value = self.graph.nodes[i]
                if op in _MAGNITUDES:
                    self._magnitudes[i] = _MAGNITUDES[op](*(self._magnitudes[k] for k in operands))
                else:
                    of_leaf = abs(value) if op == "constant" else LARGEST_ANGLE
                    self._magnitudes[i] = math.inf if operands else of_leaf
        self._first_unknown = max(self._first_unknown, node + 1)
        return self._magnitudes[node]

    def number(self, node: int) -> int:
        """Return a node as a number."""
        return self._op("number", node) if self.graph.nodes[node].op in TRUTHS else node

    def truth(self, node: int) -> int:
        """Return a node as a truth value: whether it is not 0."""
        op, operands, _ = self.graph.nodes[node]
        if op in TRUTHS:
            return node
        if op == "number":
            return operands[0]
        zero = self.graph.constant(0.0)
        return self._op("either", self._op("less", node, zero), self._op("less", zero, node))

    def verdicts(self, watched: Watched, new: Mapping[int, int]) -> tuple[int | None, int | None]:
        """Return whether a configuration is invalid, and whether it is unusual."""
        valid: list[int] = []
        # One sum of squares for all: it is NaN, infinite or too large where one of the inputs is.
        for inputs, largest in ((watched.angles, LARGEST_ANGLE), (watched.others, LARGEST)):
            if inputs:
                first, *others = (new[i] for i in inputs)
                size = self._op("multiply", first, first)
                for x in others:
                    size = self._op("fma", x, x, size)
                valid.append(self._op("less_equal", size, self._limit(largest**2)))
        zero = self.graph.constant(0.0)
        valid += [self._op("less", zero, self.number(new[i])) for i in watched.positive]
        usual = [
            self._op("less_equal", self._op("absolute", new[i]), self.graph.constant(bound))
            for i, bound in watched.bounds.items()
        ]
        invalid, unusual = (self._not_all(conditions) for conditions in (valid, usual))
        return invalid, unusual

    def _limit(self, value: float) -> int:
        return self.graph.record(Node("limit", (), value)) if self._any_type else self.graph.constant(value)

    def _not_all(self, conditions: Sequence[int]) -> int | None:
        if not conditions:
            return None
        first, *others = conditions
        for condition in others:
            first = self._op("both", first, condition)
        return self._op("not", first)

    def _fused(self, node: Node, new: Mapping[int, int], product: int, multiplication: Node) -> int:
        a, b = (self.number(new[i]) for i in multiplication.operands)
        first, second = node.operands
        if node.op == "add":
            return self._op("fma", a, b, self.number(new[second if first == product else first]))
        if first == product:
            return self._op("fma", a, b, self._op("negate", self.number(new[second])))
        return self._op("fma", self._op("negate", a), b, self.number(new[first]))

    def _op(self, op: str, *operands: int) -> int:
        return self.graph.record(Node(op, operands))


# The largest magnitude of the result of an operation, by those of its operands; others, as quotients, know no bound.
_MAGNITUDES: dict[str, Callable[..., float]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a + b,
    "multiply": lambda a, b: a * b,
    "fma": lambda a, b, c: a * b + c,
    "negate": lambda a: a,
    "absolute": lambda a: a,
    "sqrt": math.sqrt,
    "select": lambda _, a, b: max(a, b),
    "number": lambda _: 1.0,
    # A number that comes out of a loop, or into a step of it, is an angle if its sine is taken.
    "state": lambda _: LARGEST_ANGLE,
    "each": lambda _: LARGEST_ANGLE,
}
_WRITTEN_OUT: dict[str, Callable[..., Traced]] = {
    "atan2": arc_tangent,
    "cbrt": cube_root,
    "exp": exponential,
    "round": rounded,
    "sqrt": root,
}


def fused(graph: Graph, order: Iterable[int], outputs: Iterable[int]) -> dict[int, int]:
    """Return which multiplication each sum takes in: number of the sum -> number of the multiplication.

    A compiler may contract a · b + c to one instruction, rounded once, on its own, but then what it does depends on
    what stands around the code. Here it is part of the graph's translation, so a kernel gives the same bits however it
    is compiled: alone, in a vector, inlined into another loop.

    A multiplication is taken in only where that makes it disappear: by all sums that use it, or by none.

    Args:
        graph: the graph.
        order: the nodes in use.
        outputs: the nodes of the outputs.
    """
    users: dict[int, list[int]] = {}
    for i in order:
        for operand in set(graph.nodes[i].operands):
            users.setdefault(operand, []).append(i)
    required = set(outputs)
    products = [
        i
        for i, by in users.items()
        if graph.nodes[i].op == "multiply" and i not in required and all(graph.nodes[j].op in _SUMS for j in by)
    ]
    taken: dict[int, int] = {}
    # Those with one user first: each of them is one instruction less, whatever becomes of the others.
    for i in sorted(products, key=lambda i: (len(users[i]), -i)):
        squares = any(graph.nodes[j].operands == (i, i) for j in users[i])
        if not squares and not any(j in taken for j in users[i]):
            taken.update(dict.fromkeys(users[i], i))
    return taken
