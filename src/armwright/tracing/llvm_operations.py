"""LLVM IR of the operations of a graph, and of its loops.

Operations are straight-line code. The state of a loop stays in registers. What it takes of the links, and what it
leaves for loops behind it, lies on the stack, a vector per link; constants of the links are a table.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from armwright.tracing.graph import Graph, Loop, Node, reachable
from armwright.tracing.llvm_builder import CACHE_LINE, Builder, bits

_INTRINSICS = {"absolute": "fabs", "sqrt": "sqrt"}
_INSTRUCTIONS = {
    "add": "fadd {number} {0}, {1}",
    "subtract": "fsub {number} {0}, {1}",
    "multiply": "fmul {number} {0}, {1}",
    "divide": "fdiv {number} {0}, {1}",
    "negate": "fneg {number} {0}",
    "less": "fcmp olt {number} {0}, {1}",
    "less_equal": "fcmp ole {number} {0}, {1}",
    "select": "select {truth} {0}, {number} {1}, {number} {2}",
    "both": "and {truth} {0}, {1}",
    "either": "or {truth} {0}, {1}",
    "differ": "xor {truth} {0}, {1}",
    "not": "xor {truth} {0}, {true}",
    "number": "uitofp {truth} {0} to {number}",
}
# Nodes that are read where they are used, and need no instruction before.
_READ = frozenset({"constant", "input", "state", "each"})


class Block(NamedTuple):
    """Memory: its address, its size [bytes], and whether it is written or read."""

    start: str
    size: int
    is_written: bool


class Prefetch(NamedTuple):
    """Memory of the next block of rows, and the loop during which it is fetched, a part at each link."""

    loop: Loop
    blocks: Sequence[Block]


class _LoopResults(NamedTuple):
    """What a loop leaves: the names of the state's numbers, and the addresses of the results of the links."""

    state: list[str]
    each: list[str]


class Operations:
    """The operations of a graph as they are written: the names of their results, by node.

    What lies in memory is loaded wherever it is used, and constants are written there.
    """

    def __init__(
        self,
        builder: Builder,
        graph: Graph,
        read: Callable[[int], str],
        *,
        inputs: str = "",
        prefetch: Prefetch | None = None,
    ) -> None:
        """Begin with the inputs.

        Args:
            builder: where instructions are written.
            graph: whose operations they are.
            read: gives an input by its number.
            inputs: the address of all inputs on the stack, if they are there.
            prefetch: memory that is fetched during one of the loops.
        """
        self._builder, self._graph, self._read = builder, graph, read
        self._inputs, self._prefetch = inputs, prefetch
        self._names: dict[int, str] = {}
        self._loops: dict[int, _LoopResults] = {}
        self._copies: dict[tuple[int, ...], str] = {}

    def __getitem__(self, i: int) -> str:
        """Return the name of the result of a node."""
        op, operands, value = self._graph.nodes[i]
        if op == "constant":
            return self._builder.constant(value)
        if op == "input":
            return self._read(int(value))
        if op == "state":
            return self._loops[operands[0]].state[int(value)]
        if op == "each":
            return self._builder.load(*self._result_of_link(operands[0], int(value)))
        return self._names[i]

    def write_all(self, order: Sequence[int]) -> None:
        """Write all operations, those that no loop comes before first."""
        for i in _before_loops_first(self._graph, order):
            self.write(i)

    def write(self, i: int) -> None:
        """Write an operation, or a loop; its operands are written already."""
        node = self._graph.nodes[i]
        if node.op in _READ:
            return
        if node.op == "loop":
            loop = self._graph.loops[int(node.value)]
            links = [self._in_memory(nodes) for nodes in loop.links(node.operands)]
            self._loops[i] = self._loop(loop, [self[k] for k in node.operands[: loop.carried]], links)
        elif node.op == "bit":
            self._names[i] = self._bit(self[node.operands[0]], int(self._graph.nodes[node.operands[1]].value))
        else:
            self._names[i] = self._operation(node.op, [self[k] for k in node.operands])

    def _operation(self, op: str, operands: Sequence[str]) -> str:
        b = self._builder
        if op == "fma":
            return b.fma(*operands)
        if op in _INTRINSICS:
            return b.intrinsic(_INTRINSICS[op], *operands)
        return b.let(_INSTRUCTIONS[op].format(*operands, number=b.number, truth=b.truth, true=b.splat("i1 true")))

    def _bit(self, value: str, index: int) -> str:
        b = self._builder
        word = b.vector_type("i64")
        representation = b.let(f"bitcast {b.number} {value} to {word}")
        bit = b.let(f"and {word} {representation}, {b.splat(f'i64 {1 << index}')}")
        return b.let(f"icmp ne {word} {bit}, {b.splat('i64 0')}")

    def _result_of_link(self, loop: int, value: int) -> tuple[str, int]:
        """Return the array of a result of a loop, and the number of the link."""
        k, link = divmod(value, len(self._graph.loops[int(self._graph.nodes[loop].value)].kinds))
        return self._loops[loop].each[k], link

    def _in_memory(self, nodes: tuple[int, ...]) -> str:
        """Return the address of values one after the other, where they are already or where they are copied to."""
        op, operands, first = self._graph.nodes[nodes[0]]
        if op in ("each", "input") and all(
            self._graph.nodes[k] == Node(op, operands, first + i) for i, k in enumerate(nodes)
        ):
            if op == "input" and self._inputs:
                return self._builder.address(self._inputs, int(first), self._builder.number)
            if op == "each" and (result := self._result_of_link(operands[0], int(first)))[1] == 0:
                return result[0]
        if nodes not in self._copies:
            self._copies[nodes] = self._builder.stack_vectors(len(nodes))
            for i, k in enumerate(nodes):
                self._builder.store(self[k], self._copies[nodes], i)
        return self._copies[nodes]

    # ---- loops ----

    def _loop(self, loop: Loop, start: Sequence[str], links: Sequence[str]) -> _LoopResults:
        """Write a loop.

        Args:
            loop: what it does.
            start: the state before it.
            links: the addresses of the values of the links, each an array with a vector for every link.
        """
        b, n = self._builder, len(loop.kinds)
        width = max(map(len, loop.constants))
        padded = [x for row in loop.constants for x in (*row, *[0.0] * (width - len(row)))]
        constants = b.table("double", [bits(x) for x in padded])
        each = [b.stack_vectors(n) for _ in loop.steps[0].results[loop.carried :]]
        before, name = b.block, b.new_label("loop")
        first, last, by = (n - 1, 0, -1) if loop.reverse else (0, n - 1, 1)
        link = f"%{name}_link"
        state = [f"%{name}_state{k}" for k in range(loop.carried)]
        b.do(f"br label %{name}")
        b.do(f"{name}:")
        b.do(f"{link} = phi i64 [{first}, %{before}], [{link}_next, %{name}_end]")
        for x, begin in zip(state, start, strict=True):
            b.do(f"{x} = phi {b.number} [{begin}, %{before}], [{x}_next, %{name}_end]")
        if self._prefetch is not None and loop is self._prefetch.loop:
            self._fetch_part(self._prefetch.blocks, link, n)
        row = b.let(f"mul i64 {link}, {width}")
        labels = [f"{name}_kind{kind}" for kind in range(len(loop.steps))]
        self._branch_to_kind(loop, link, labels)

        def read(k: int) -> str:
            if k < len(state):
                return state[k]
            k -= len(state)
            if k < len(links):
                return b.load(links[k], link)
            return b.load_splat(constants, b.let(f"add i64 {row}, {k - len(links)}"))

        new = list(self._steps(loop, read, labels, [(array, link) for array in each], f"{name}_end"))
        b.do(f"{name}_end:")
        for x, of_kinds in zip(state, zip(*new, strict=True), strict=True):
            incoming = ", ".join(f"[{of_kind}, %{label}]" for of_kind, label in zip(of_kinds, labels, strict=True))
            b.do(f"{x}_next = phi {b.number} {incoming}")
        b.do(f"{link}_next = add i64 {link}, {by}")
        b.do(f"%{name}_done = icmp eq i64 {link}, {last}")
        b.do(f"br i1 %{name}_done, label %{name}_left, label %{name}")
        b.do(f"{name}_left:")
        return _LoopResults([f"{x}_next" for x in state], each)

    def _branch_to_kind(self, loop: Loop, link: str, labels: Sequence[str]) -> None:
        """Write the branch to the step of the kind of a link."""
        b = self._builder
        if len(labels) == 1:
            b.do(f"br label %{labels[0]}")
            return
        kinds = b.table("i8", [str(kind) for kind in loop.kinds])
        kind = b.let(f"load i8, ptr {b.address(kinds, link, 'i8')}, align 1")
        cases = " ".join(f"i8 {k}, label %{label}" for k, label in enumerate(labels))
        b.do(f"switch i8 {kind}, label %{labels[-1]} [{cases}]")

    def _steps(
        self,
        loop: Loop,
        read: Callable[[int], str],
        labels: Sequence[str],
        results: Sequence[tuple[str, str]],
        end: str,
    ) -> Iterator[list[str]]:
        """Write the steps of all kinds, which store their results; give the new state of each."""
        b = self._builder
        for label, (graph, nodes) in zip(labels, loop.steps, strict=True):
            b.do(f"{label}:")
            step = Operations(b, graph, read)
            step.write_all(reachable(graph, nodes))
            names = [step[i] for i in nodes]
            for x, (array, link) in zip(names[loop.carried :], results, strict=True):
                b.store(x, array, link)
            yield names[: loop.carried]
            b.do(f"br label %{end}")

    def _fetch_part(self, blocks: Sequence[Block], link: str, links: int) -> None:
        """Fetch the part of blocks that is due at a link."""
        b = self._builder
        for block in blocks:
            lines = -(-block.size // (CACHE_LINE * links))
            start = b.address(block.start, b.let(f"mul i64 {link}, {lines * CACHE_LINE}"), "i8")
            for line in range(lines):
                b.prefetch(start, line * CACHE_LINE, is_written=block.is_written)


def _before_loops_first(graph: Graph, order: Sequence[int]) -> Sequence[int]:
    """Return nodes in an order in which as much as possible stands before each loop."""
    if not graph.loops:
        return order
    # How many loops one after the other a node waits for.
    depth: dict[int, int] = {}
    for i in order:
        node = graph.nodes[i]
        depth[i] = max((depth[k] for k in node.operands), default=0) + (node.op == "loop")
    return sorted(order, key=depth.__getitem__)
