"""Loops over links: written once as a step, run link by link, or left as a loop in the graph of a long arm.

On floats and arrays a scan is a loop of Python, and so it is on traced scalars unless their graph rolls: its code then
has every link written out, with all that is 0 or 1 there left away. For a long arm that is too much code to be fast.
There the step is traced once for each kind of link, and the graph holds a loop.
"""

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from armwright.tracing.graph import Graph, Loop, LoopStep, Node, Traced

# A scalar, or lists, tuples and named tuples of trees. Leaves that are no numbers, such as truth values, are part of
# the kind of a link.
Tree = Any


def scan(
    step: Callable[..., tuple[Tree, Tree]], state: Tree, *per_link: Sequence[Tree], reverse: bool = False
) -> tuple[Tree, list[Tree]]:
    """Apply a step to one link after the other.

    Args:
        step: takes the state and the tree of each of ``per_link`` for one link; returns the new state, whose shape
            is that of the old one, and a tree of results. It may ask what kind a link is by truth values in its
            trees, not by numbers, and takes no traced scalar but from its arguments.
        state: before the first link.
        per_link: sequences of trees, each with one for every link.
        reverse: whether the last link comes first.

    Returns:
        The state after the last step, and the results of every link in the order of the links.
    """
    links = list(zip(*per_link, strict=True))
    # One link shows what all of them are; a loop that is written out where it need not be is right, too.
    graph = next((x.graph for x in _numbers((state, links[:1])) if isinstance(x, Traced)), None)
    if graph is not None and graph.rolls and links:
        return _Rolled(graph, step, state, links, reverse=reverse).result()
    results: list[Tree] = [None] * len(links)
    for i in reversed(range(len(links))) if reverse else range(len(links)):
        state, results[i] = step(state, *links[i])
    return state, results


def _is_number(leaf: Tree) -> bool:
    return not (leaf is None or isinstance(leaf, bool | str))


def _numbers(tree: Tree) -> Iterator[Any]:
    """Give the numbers of a tree, in order."""
    if isinstance(tree, list | tuple):
        for part in tree:
            yield from _numbers(part)
    elif _is_number(tree):
        yield tree


def _replaced(tree: Tree, numbers: Iterator[Any]) -> Tree:
    """Return a tree with other numbers."""
    if not isinstance(tree, list | tuple):
        return next(numbers) if _is_number(tree) else tree
    parts = [_replaced(part, numbers) for part in tree]
    return type(tree)(*parts) if hasattr(tree, "_fields") else type(tree)(parts)


def _kind(tree: Tree) -> Hashable:
    """Return what trees have in common for which a step does the same operations."""
    if isinstance(tree, list | tuple):
        return type(tree), *map(_kind, tree)
    return isinstance(tree, Traced) if _is_number(tree) else (tree,)


class _Links(NamedTuple):
    """The links of one kind.

    Attributes:
        tree: of the first of them.
        numbers: of each of them, by the number of the link.
    """

    tree: Tree
    numbers: dict[int, list[Any]]

    def columns(self) -> list[tuple[Any, ...]]:
        """Return the values of each number in all of the links."""
        return list(zip(*self.numbers.values(), strict=True))


class _TracedStep(NamedTuple):
    """A step as it is traced for a kind of link.

    Attributes:
        graph: of the step.
        state: the nodes of the new state.
        results: the nodes of the results.
        tree: the results as the step returned them.
    """

    graph: Graph
    state: list[int]
    results: list[int]
    tree: Tree


class _Rolled:
    """A scan that becomes a loop of a graph.

    The inputs of the graph of a step are the state, then what is traced of every link, then the constants of a link. A
    number that is the same in all links of a kind is no input but a constant of the step.
    """

    def __init__(
        self, graph: Graph, step: Callable[..., tuple[Tree, Tree]], state: Tree, links: Sequence[Tree], *, reverse: bool
    ) -> None:
        self.graph, self.step, self.state, self.count, self.reverse = graph, step, state, len(links), reverse
        kinds: dict[Hashable, _Links] = {}
        for i, link in enumerate(links):
            kinds.setdefault(_kind(link), _Links(link, {})).numbers[i] = list(_numbers(link))
        self.kinds = list(kinds.values())
        self.sequences = self._sequences()
        self.tables = [self._table(kind) for kind in self.kinds]

    def result(self) -> tuple[Tree, list[Tree]]:
        """Leave the loop in the graph; return what ``scan`` does."""
        start = _nodes(self.graph, self.state)
        slots, steps = self._traced_steps(start)
        carried = max(slots, default=-1) + 1
        # Of the numbers that share a slot, the first stands for all.
        first_of_slots = [slots.index(slot) for slot in range(carried)]
        stored = [
            list(dict.fromkeys(node for node in step.results if self._is_computed(step, node, carried)))
            for step in steps
        ]
        loop = Loop(
            steps=tuple(self._loop_steps(steps, first_of_slots, stored)),
            kinds=tuple(k for _, k in sorted((i, k) for k, kind in enumerate(self.kinds) for i in kind.numbers)),
            constants=tuple(self._constants()),
            carried=carried,
            reverse=self.reverse,
        )
        initial = [start[first] for first in first_of_slots]
        loop_node = self.graph.loop(loop, [*initial, *(x for sequence in self.sequences.values() for x in sequence)])
        results: list[Tree] = [None] * self.count
        for k, step in enumerate(steps):
            for j, i in enumerate(self.kinds[k].numbers):
                values = [
                    self._of_loop("each", loop_node, stored[k].index(node) * self.count + i)
                    if node in stored[k]
                    else self._passed(step.graph.nodes[node], carried, i, [column[j] for column in self.tables[k]])
                    for node in step.results
                ]
                results[i] = _replaced(step.tree, iter(values))
        return _replaced(self.state, iter([self._of_loop("state", loop_node, slot) for slot in slots])), results

    @staticmethod
    def _loop_steps(
        steps: Sequence[_TracedStep], first_of_slots: Sequence[int], stored: Sequence[Sequence[int]]
    ) -> Iterator[LoopStep]:
        """Give the steps of the loop; one with fewer results than another has zeros for the rest."""
        most = max(map(len, stored))
        for step, results in zip(steps, stored, strict=True):
            others = [step.graph.constant(0.0) for _ in range(most - len(results))]
            yield LoopStep(step.graph, (*(step.state[first] for first in first_of_slots), *results, *others))

    def _constants(self) -> Iterator[tuple[float, ...]]:
        """Give the constants of each link."""
        rows: dict[int, tuple[float, ...]] = {}
        for kind, table in zip(self.kinds, self.tables, strict=True):
            rows |= {i: tuple(column[j] for column in table) for j, i in enumerate(kind.numbers)}
        yield from (rows[i] for i in range(self.count))

    def _passed(self, result: Node, carried: int, link: int, constants: Sequence[float]) -> Any:
        """Return the value, for a link, of a result that a step does not compute."""
        if result.op == "constant":
            return result.value
        k, sequences = int(result.value) - carried, list(self.sequences.values())
        return Traced(self.graph, sequences[k][link]) if k < len(sequences) else constants[k - len(sequences)]

    def _sequences(self) -> dict[Hashable, list[int]]:
        """Return the nodes of all links for what is traced of a link, by where these come from."""
        sequences: dict[Hashable, list[int]] = {}
        for kind in self.kinds:
            for column in kind.columns():
                if isinstance(column[0], Traced):
                    source = self._source(kind, column)
                    sequence = sequences.setdefault(source, self._from(source))
                    for i, x in zip(kind.numbers, column, strict=True):
                        sequence[i] = x.node
        return sequences

    def _source(self, kind: _Links, column: Sequence[Traced]) -> Hashable:
        """Return where the values of a number come from: a loop before this one, neighbouring inputs, or anywhere."""
        sources: set[Hashable] = set()
        for i, x in zip(kind.numbers, column, strict=True):
            op, operands, value = self.graph.nodes[x.node]
            sources.add((op, operands, value - i) if op in ("each", "input") else None)
        (source, *others) = sources
        # Other scalars come one by one; each is known by itself where it is used again.
        return tuple(x.node for x in column) if others or source is None else source

    def _from(self, source: Any) -> list[int]:
        """Return the nodes of all links of a source; for links that do not use it, where there is none, a constant."""
        zero = self.graph.constant(0.0)
        if source[0] not in ("each", "input"):
            return [zero] * self.count
        op, operands, first = source
        if op == "each":
            return [self.graph.record(Node(op, operands, first + i)) for i in range(self.count)]
        inputs = [self.graph.known(Node(op, operands, first + i)) for i in range(self.count)]
        return [zero if x is None else x for x in inputs]

    @staticmethod
    def _table(kind: _Links) -> list[tuple[float, ...]]:
        """Return the constants that differ from link to link, each once: their values in all links."""
        constants = (tuple(map(float, c)) for c in kind.columns() if not isinstance(c[0], Traced))
        return list(dict.fromkeys(c for c in constants if any(x != c[0] for x in c)))

    def _traced_steps(self, start: Sequence[int]) -> tuple[list[int], list[_TracedStep]]:
        """Trace the step for all kinds; return the slots, and the steps.

        The loop has a slot for numbers of the state that are equal in every link, such as both halves of a symmetric
        matrix: those that begin equal share one, until a step makes them differ.

        Returns:
            The slot of each number of the state, and the step of each kind.

        Source:
            Alpern, Wegman & Zadeck (1988): equality is assumed and refined until every step confirms it.
        """
        slots = _value_numbers(start)
        while True:
            steps = [self._traced_step(k, slots) for k in range(len(self.kinds))]
            finer = _value_numbers(zip(slots, *(step.state for step in steps), strict=True))
            if finer == slots:
                return slots, steps
            slots = finer

    def _traced_step(self, k: int, slots: Sequence[int]) -> _TracedStep:
        kind, table = self.kinds[k], self.tables[k]
        graph = Graph()
        state = graph.inputs(max(slots, default=-1) + 1)
        traced = dict(zip(self.sequences, graph.inputs(len(self.sequences)), strict=True))
        constants = dict(zip(table, graph.inputs(len(table)), strict=True))
        numbers: list[Any] = []
        for column in kind.columns():
            if isinstance(column[0], Traced):
                numbers.append(traced[self._source(kind, column)])
            else:
                numbers.append(constants.get(tuple(map(float, column)), column[0]))
        new, results = self.step(
            _replaced(self.state, iter([state[slot] for slot in slots])), *_replaced(kind.tree, iter(numbers))
        )
        return _TracedStep(graph, _nodes(graph, new), _nodes(graph, results), results)

    @staticmethod
    def _is_computed(step: _TracedStep, result: int, carried: int) -> bool:
        """Whether a result must be stored: not where it is a constant or an input of the link, as it came in."""
        op, _, value = step.graph.nodes[result]
        return not (op == "constant" or (op == "input" and value >= carried))

    def _of_loop(self, op: str, loop: int, value: int) -> Traced:
        return Traced(self.graph, self.graph.record(Node(op, (loop,), float(value))))


def _nodes(graph: Graph, tree: Tree) -> list[int]:
    """Return the nodes of the numbers of a tree."""
    return [graph.node(x) for x in _numbers(tree)]


def _value_numbers(values: Iterable[Hashable]) -> list[int]:
    """Return a number for each value, the same for equal ones; new values are counted from 0."""
    known: dict[Hashable, int] = {}
    return [known.setdefault(value, len(known)) for value in values]
