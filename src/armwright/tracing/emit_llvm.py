"""From the operations of a graph to LLVM IR, for one configuration and for many in vectors.

Code is straight but for the loops of a graph. The state of a loop stays in registers. What it takes of the links, and
what it leaves for loops behind it, lies on the stack, a vector per link; constants of the links are a table.

Inputs and outputs are arrays in C order, one row per configuration. For many, blocks of as many rows as a vector has
lanes are transposed in registers, so that each lane is a configuration. Nothing is left to the compiler that would
change a bit: it is not told that it may reorder or join operations. So a configuration has the same bits alone, in any
batch and at any width of the vectors, on all processors that multiply and add in one instruction.
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import accumulate
from typing import NamedTuple

from armwright.tracing.graph import Graph, Loop, Node, reachable
from armwright.tracing.machine import MachineCode, with_results

# What a kernel returns beside 0: some configuration is without meaning, or unusual.
MEANINGLESS, UNUSUAL = 1, 2

_INTRINSICS = {"fma": "fma", "absolute": "fabs", "sqrt": "sqrt"}
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
    "not": "xor {truth} {0}, {holds}",
    "number": "uitofp {truth} {0} to {number}",
}
# What is no operation.
_READ = frozenset({"constant", "input", "state", "each"})
# Bytes of a number, and of a line of the cache.
_DOUBLE, _LINE = 8, 64
# Blocks of rows of more bytes than this do not stay in the nearest cache: they are written from front to back, and not
# asked for before.
_LONG_ROW = 2048


def _copy() -> str:
    """Return a function that copies bytes, many at once as long as there are so many: code of ours calls no library."""
    lines = ["define internal void @copy(ptr %to, ptr %from, i64 %size) nounwind {", "entry:", "  br label %by64"]
    done, before = "0", "entry"
    for size, then in ((64, "by8"), (8, "by1"), (1, "end")):
        kind = f"<{size} x i8>" if size > 1 else "i8"
        lines += [
            f"by{size}:",
            f"  %at{size} = phi i64 [{done}, %{before}], [%next{size}, %copy{size}]",
            f"  %next{size} = add i64 %at{size}, {size}",
            f"  %fits{size} = icmp ule i64 %next{size}, %size",
            f"  br i1 %fits{size}, label %copy{size}, label %{then}",
            f"copy{size}:",
            f"  %from{size} = getelementptr i8, ptr %from, i64 %at{size}",
            f"  %to{size} = getelementptr i8, ptr %to, i64 %at{size}",
            f"  %x{size} = load {kind}, ptr %from{size}, align 1",
            f"  store {kind} %x{size}, ptr %to{size}, align 1",
            f"  br label %by{size}",
        ]
        done, before = f"%at{size}", f"by{size}"
    return "\n".join([*lines, "end:", "  ret void", "}"])


class Column(NamedTuple):
    """An array of a kernel: how many numbers a row has, and whether they are truth values, of one byte each."""

    width: int
    flag: bool = False

    @property
    def size(self) -> int:
        """The size of a row [bytes]."""
        return self.width * (1 if self.flag else _DOUBLE)


class Target(NamedTuple):
    """What code is written for.

    Attributes:
        lanes: how many numbers a vector holds.
        has_fma: whether the processor multiplies and adds in one instruction; otherwise that is rounded twice.
    """

    lanes: int
    has_fma: bool


class _Text:
    """IR under construction, for vectors of a number of lanes; one lane is a plain number."""

    def __init__(self, target: Target) -> None:
        self.lanes, self.has_fma = lanes, _ = target
        self.lines: list[str] = []
        self.intrinsics: set[str] = set()
        self.ahead: list[_Ahead] = []
        self.ahead_in: Loop | None = None
        self._count = 0
        self._block = ""
        self._tables: list[str] = []
        self._scratch: list[str] = []
        self.number = self.of("double")
        self.suffix = "f64" if lanes == 1 else f"v{lanes}f64"
        self.never = self.splat("i1 false")

    def module(self) -> str:
        """Return all of it."""
        entry = self.lines.index("entry:") + 1
        body = [*self.lines[:entry], *self._scratch, *self.lines[entry:]]
        return "\n".join([*sorted(self.intrinsics), *self._tables, "", *body, ""])

    def of(self, kind: str) -> str:
        """Return the type of a vector of a kind of element."""
        return kind if self.lanes == 1 else f"<{self.lanes} x {kind}>"

    def splat(self, element: str) -> str:
        """Return a constant vector of one element, written with its type."""
        return element.partition(" ")[2] if self.lanes == 1 else f"<{', '.join([element] * self.lanes)}>"

    def constant(self, value: float) -> str:
        return self.splat(f"double 0x{_bits(value):016X}")

    def let(self, expression: str) -> str:
        """Write an instruction, and return the name of its result."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {expression}")
        return f"%v{self._count}"

    def do(self, statement: str) -> None:
        """Write an instruction without a result, or a label."""
        if statement.endswith(":"):
            self._block = statement.removesuffix(":")
            self.lines.append(statement)
        else:
            self.lines.append(f"  {statement}")

    def call(self, name: str, *operands: str) -> str:
        function = f"{self.number} @llvm.{name}.{self.suffix}"
        self.intrinsics.add(f"declare {function}({', '.join([self.number] * len(operands))})")
        return self.let(f"call {function}({', '.join(f'{self.number} {x}' for x in operands)})")

    def copy(self, to: str, source: str, size: str) -> None:
        """Write the copy of so many bytes."""
        self.intrinsics.add(_copy())
        self.do(f"call void @copy(ptr {to}, ptr {source}, i64 {size})")

    def address(self, pointer: str, offset: str | int, kind: str = "double") -> str:
        """Return the address of an element of an array."""
        return pointer if offset == 0 else self.let(f"getelementptr {kind}, ptr {pointer}, i64 {offset}")

    def scratch(self, count: int) -> str:
        """Return the address of as many vectors on the stack."""
        name = f"%scratch{len(self._scratch)}"
        self._scratch.append(f"  {name} = alloca [{count} x {self.number}], align {_LINE}")
        return name

    def load(self, vectors: str, place: str | int) -> str:
        """Return a vector of an array in scratch memory."""
        address = self.address(vectors, place, self.number)
        return self.let(f"load {self.number}, ptr {address}, align {self.lanes * _DOUBLE}")

    def store(self, x: str, vectors: str, place: str | int) -> None:
        """Write a vector of an array in scratch memory."""
        address = self.address(vectors, place, self.number)
        self.do(f"store {self.number} {x}, ptr {address}, align {self.lanes * _DOUBLE}")

    def table(self, kind: str, values: Sequence[str]) -> str:
        """Return the address of constants."""
        name = f"@table{len(self._tables)}"
        elements = ", ".join(f"{kind} {x}" for x in values)
        self._tables.append(
            f"{name} = private unnamed_addr constant [{len(values)} x {kind}] [{elements}], align {_LINE}"
        )
        return name

    def everywhere(self, table: str, place: str) -> str:
        """Return a constant of a table in all lanes."""
        one = self.let(f"load double, ptr {self.address(table, place)}, align {_DOUBLE}")
        if self.lanes == 1:
            return one
        first = self.let(f"insertelement {self.number} poison, double {one}, i32 0")
        mask = f"<{self.lanes} x i32> zeroinitializer"
        return self.let(f"shufflevector {self.number} {first}, {self.number} poison, {mask}")

    # ---- the operations of a graph ----

    def graph(self, graph: Graph, order: Sequence[int], values: "_Values") -> None:
        """Write all operations; the names of their results are among the values then."""
        for i in _straight_first(graph, order):
            self.node(graph, i, values)

    def node(self, graph: Graph, i: int, values: "_Values") -> None:
        """Write an operation, or a loop."""
        node = graph.nodes[i]
        if node.op in _READ:
            return
        if node.op == "loop":
            values.loop(i)
        elif node.op == "bit":
            place = int(graph.nodes[node.operands[1]].value)
            values.names[i] = self._bit(values[node.operands[0]], place)
        else:
            values.names[i] = self._operation(node, [values[j] for j in node.operands])

    def loop(self, loop: Loop, start: Sequence[str], links: Sequence[str]) -> "_Left":
        """Write a loop.

        Args:
            loop: what it does.
            start: the state before it.
            links: the addresses of the values of the links, each an array with a vector for every link.
        """
        n, kinds = len(loop.kinds), range(len(loop.steps))
        width = max(map(len, loop.constants))
        rows = [[*row, *[0.0] * (width - len(row))] for row in loop.constants]
        constants = self.table("double", [f"0x{_bits(x):016X}" for row in rows for x in row])
        each = [self.scratch(n) for _ in loop.steps[0].results[loop.carried :]]
        self._count += 1
        name, before = f"loop{self._count}", self._block
        first, last, by = (n - 1, 0, -1) if loop.reverse else (0, n - 1, 1)
        link = f"%{name}_link"
        state = [f"%{name}_state{k}" for k in range(loop.carried)]
        self.do(f"br label %{name}")
        self.do(f"{name}:")
        self.do(f"{link} = phi i64 [{first}, %{before}], [{link}_next, %{name}_end]")
        for x, begin in zip(state, start, strict=True):
            self.do(f"{x} = phi {self.number} [{begin}, %{before}], [{x}_next, %{name}_end]")
        if loop is self.ahead_in:
            self.fetch_ahead(link, n)
        row = self.let(f"mul i64 {link}, {width}")
        labels = [f"{name}_kind{kind}" for kind in kinds]
        if len(labels) > 1:
            kind_of = self.table("i8", [str(kind) for kind in loop.kinds])
            kind = self.let(f"load i8, ptr {self.address(kind_of, link, 'i8')}, align 1")
            cases = " ".join(f"i8 {k}, label %{label}" for k, label in enumerate(labels))
            self.do(f"switch i8 {kind}, label %{labels[-1]} [{cases}]")
        else:
            self.do(f"br label %{labels[0]}")

        def read(k: int) -> str:
            if k < len(state):
                return state[k]
            k -= len(state)
            if k < len(links):
                return self.load(links[k], link)
            return self.everywhere(constants, self.let(f"add i64 {row}, {k - len(links)}"))

        new: list[list[str]] = []
        for label, (graph, results) in zip(labels, loop.steps, strict=True):
            self.do(f"{label}:")
            values = _Values(self, graph, read)
            self.graph(graph, reachable(graph, results), values)
            names = [values[i] for i in results]
            for x, array in zip(names[loop.carried :], each, strict=True):
                self.store(x, array, link)
            new.append(names[: loop.carried])
            self.do(f"br label %{name}_end")
        self.do(f"{name}_end:")
        for x, of_kinds in zip(state, zip(*new, strict=True), strict=True):
            ways = ", ".join(f"[{of_kind}, %{label}]" for of_kind, label in zip(of_kinds, labels, strict=True))
            self.do(f"{x}_next = phi {self.number} {ways}")
        self.do(f"{link}_next = add i64 {link}, {by}")
        self.do(f"%{name}_done = icmp eq i64 {link}, {last}")
        self.do(f"br i1 %{name}_done, label %{name}_left, label %{name}")
        self.do(f"{name}_left:")
        return _Left([f"{x}_next" for x in state], each)

    def fetch_ahead(self, link: str, links: int) -> None:
        """Ask for the memory of the next block while this one is worked on: a part of it at each link."""
        for ahead in self.ahead:
            lines = -(-ahead.size // (_LINE * links))
            start = self.address(ahead.start, self.let(f"mul i64 {link}, {lines * _LINE}"), "i8")
            for line in range(lines):
                self.fetch(start, line * _LINE, is_written=ahead.is_written)

    def fetch(self, start: str, offset: int, *, is_written: bool) -> None:
        """Ask for a line of memory."""
        self.intrinsics.add("declare void @llvm.prefetch.p0(ptr, i32, i32, i32)")
        address = self.address(start, offset, "i8")
        self.do(f"call void @llvm.prefetch.p0(ptr {address}, i32 {int(is_written)}, i32 3, i32 1)")

    def _operation(self, node: Node, x: Sequence[str]) -> str:
        if node.op == "fma" and not self.has_fma:
            product = self.let(f"fmul {self.number} {x[0]}, {x[1]}")
            return self.let(f"fadd {self.number} {product}, {x[2]}")
        if node.op in _INTRINSICS:
            return self.call(_INTRINSICS[node.op], *x)
        holds = self.splat("i1 true")
        return self.let(_INSTRUCTIONS[node.op].format(*x, number=self.number, truth=self.of("i1"), holds=holds))

    def _bit(self, value: str, place: int) -> str:
        whole = self.of("i64")
        bits = self.let(
            f"and {whole} {self.let(f'bitcast {self.number} {value} to {whole}')}, {self.splat(f'i64 {1 << place}')}"
        )
        return self.let(f"icmp ne {whole} {bits}, {self.splat('i64 0')}")

    # ---- rows in memory, lanes in registers ----

    def columns(self, pointer: str, width: int) -> Iterator[tuple[int, str]]:
        """Give the columns of a block of rows (lanes, width), each a vector, with their numbers."""
        if self.lanes == 1 or width == 1:
            for i in range(width):
                yield i, self.let(f"load {self.number}, ptr {self.address(pointer, i)}, align 8")
            return
        for start in _windows(width, self.lanes):
            rows = [self._load_row(pointer, r, start, width) for r in range(self.lanes)]
            yield from ((start + k, x) for k, x in enumerate(self._transposed(rows)) if start + k < width)

    def parts(self, pointer: str, column: Column, nodes: Sequence[int]) -> list["_Part"]:
        """Return the parts in which columns, each a vector, are written as a block of rows.

        Args:
            pointer: where the block begins.
            column: what the array is.
            nodes: of the columns.
        """
        if column.flag:
            return [_Part(tuple(nodes), lambda values: self._store_flags(pointer, values, nodes))]
        width = column.width
        if self.lanes == 1 or width == 1:
            return [_Part((node,), partial(self._store_column, pointer, i, node)) for i, node in enumerate(nodes)]
        windows = [(start, tuple(nodes[start : start + self.lanes])) for start in _windows(width, self.lanes)]
        return [_Part(part, partial(self._store_window, pointer, start, width, part)) for start, part in windows]

    def _store_column(self, pointer: str, i: int, node: int, values: "_Values") -> None:
        self.do(f"store {self.number} {values[node]}, ptr {self.address(pointer, i)}, align 8")

    def _store_window(self, pointer: str, start: int, width: int, nodes: Sequence[int], values: "_Values") -> None:
        block = [*(values[node] for node in nodes), *["poison"] * (self.lanes - len(nodes))]
        # A row of fewer numbers than a vector begins where the one before it ends too far: it is written behind it.
        for r, row in enumerate(self._transposed(block)):
            self._store_row(pointer, r, start, width, row)

    def _store_flags(self, pointer: str, values: "_Values", columns: Sequence[int]) -> None:
        """Write columns of truth values as a block of rows of bytes."""
        if len(columns) == _DOUBLE and self.lanes > 1:
            # A row of eight bytes is one word: each column sets a bit of it.
            words, truth, row = self.of("i64"), self.of("i1"), self.splat("i64 0")
            for i, node in enumerate(columns):
                chosen = f"{words} {self.splat(f'i64 {1 << 8 * i}')}, {words} {self.splat('i64 0')}"
                one = self.let(f"select {truth} {values[node]}, {chosen}")
                row = self.let(f"or {words} {row}, {one}")
            self.do(f"store {words} {row}, ptr {pointer}, align 1")
            return
        for i, node in enumerate(columns):
            x = values[node]
            for r in range(self.lanes):
                one = x if self.lanes == 1 else self.let(f"extractelement {self.of('i1')} {x}, i32 {r}")
                place = self.address(pointer, r * len(columns) + i, "i8")
                self.do(f"store i8 {self.let(f'zext i1 {one} to i8')}, ptr {place}, align 1")

    def _load_row(self, pointer: str, r: int, start: int, width: int) -> str:
        place = self.address(pointer, r * width + start)
        inside = self.lanes * width - (r * width + start)
        if inside >= self.lanes:
            return self.let(f"load {self.number}, ptr {place}, align 8")
        self.intrinsics.add(
            f"declare {self.number} @llvm.masked.load.{self.suffix}.p0(ptr, i32, {self.of('i1')}, {self.number})"
        )
        return self.let(
            f"call {self.number} @llvm.masked.load.{self.suffix}.p0(ptr {place}, i32 8, {self.of('i1')} "
            f"{self._first(inside)}, {self.number} zeroinitializer)"
        )

    def _store_row(self, pointer: str, r: int, start: int, width: int, row: str) -> None:
        place = self.address(pointer, r * width + start)
        inside = self.lanes * width - (r * width + start)
        if inside >= self.lanes:
            self.do(f"store {self.number} {row}, ptr {place}, align 8")
            return
        self.intrinsics.add(
            f"declare void @llvm.masked.store.{self.suffix}.p0({self.number}, ptr, i32, {self.of('i1')})"
        )
        self.do(
            f"call void @llvm.masked.store.{self.suffix}.p0({self.number} {row}, ptr {place}, i32 8, {self.of('i1')} "
            f"{self._first(inside)})"
        )

    def _first(self, count: int) -> str:
        return f"<{', '.join('i1 true' if k < count else 'i1 false' for k in range(self.lanes))}>"

    def _transposed(self, vectors: Sequence[str]) -> list[str]:
        """Return the transpose of as many vectors as they have lanes, by exchanges of ever larger parts."""
        lanes, vectors, step = self.lanes, list(vectors), 1
        while step < lanes:
            low = [i - step + lanes if i // step % 2 else i for i in range(lanes)]
            high = [i + lanes if i // step % 2 else i + step for i in range(lanes)]
            for i in range(lanes):
                if not i // step % 2:
                    pair = vectors[i], vectors[i + step]
                    vectors[i], vectors[i + step] = (self._shuffle(*pair, picks) for picks in (low, high))
            step *= 2
        return vectors

    def _shuffle(self, a: str, b: str, picks: Sequence[int]) -> str:
        if a == b == "poison":
            return "poison"
        mask = ", ".join(f"i32 {k}" for k in picks)
        return self.let(f"shufflevector {self.number} {a}, {self.number} {b}, <{self.lanes} x i32> <{mask}>")


class _Ahead(NamedTuple):
    """Memory to ask for before it is needed: its address, its size [bytes], and whether it will be written."""

    start: str
    size: int
    is_written: bool


class _Part(NamedTuple):
    """A part of the outputs: the nodes that it takes, and what writes it."""

    nodes: tuple[int, ...]
    write: Callable[["_Values"], None]


class _Left(NamedTuple):
    """What a loop leaves: the names of the state's numbers, and the addresses of the results of the links."""

    state: list[str]
    each: list[str]


class _Values:
    """The names of the values of a graph, by node; what lies in memory is loaded wherever it is used."""

    def __init__(self, text: _Text, graph: Graph, read: Callable[[int], str], inputs: str = "") -> None:
        """Begin with the inputs.

        Args:
            text: where loads are written.
            graph: whose values they are.
            read: gives an input by its number.
            inputs: the address of all inputs in scratch memory, if they are there.
        """
        self.names: dict[int, str] = {}
        self._text, self._graph, self._read, self._inputs = text, graph, read, inputs
        self._left: dict[int, _Left] = {}
        self._copies: dict[tuple[int, ...], str] = {}

    def __getitem__(self, i: int) -> str:
        """Return the name of a value."""
        op, operands, value = self._graph.nodes[i]
        if op == "constant":
            return self._text.constant(value)
        if op == "input":
            return self._read(int(value))
        if op == "state":
            return self._left[operands[0]].state[int(value)]
        if op == "each":
            return self._text.load(*self._place(operands[0], int(value)))
        return self.names[i]

    def loop(self, i: int) -> None:
        """Write a loop."""
        node = self._graph.nodes[i]
        loop = self._graph.loops[int(node.value)]
        links = [self._vectors(nodes) for nodes in loop.links(node.operands)]
        self._left[i] = self._text.loop(loop, [self[k] for k in node.operands[: loop.carried]], links)

    def _place(self, loop: int, value: int) -> tuple[str, int]:
        """Return the array of a result of a loop, and which link's it is."""
        k, link = divmod(value, len(self._graph.loops[int(self._graph.nodes[loop].value)].kinds))
        return self._left[loop].each[k], link

    def _vectors(self, nodes: tuple[int, ...]) -> str:
        """Return the address of values one after the other, where they are already or where they are copied to."""
        op, operands, first = self._graph.nodes[nodes[0]]
        if op in ("each", "input") and all(
            self._graph.nodes[k] == Node(op, operands, first + i) for i, k in enumerate(nodes)
        ):
            if op == "input" and self._inputs:
                return self._text.address(self._inputs, int(first), self._text.number)
            if op == "each" and (place := self._place(operands[0], int(first)))[1] == 0:
                return place[0]
        if nodes not in self._copies:
            self._copies[nodes] = self._text.scratch(len(nodes))
            for i, k in enumerate(nodes):
                self._text.store(self[k], self._copies[nodes], i)
        return self._copies[nodes]


def _straight_first(graph: Graph, order: Sequence[int]) -> Sequence[int]:
    """Return nodes in an order in which as much as possible stands before each loop."""
    if not graph.loops:
        return order
    behind: dict[int, int] = {}
    for i in order:
        node = graph.nodes[i]
        behind[i] = max((behind[k] for k in node.operands), default=0) + (node.op == "loop")
    return sorted(order, key=behind.__getitem__)


def _bits(value: float) -> int:
    (bits,) = struct.unpack("<Q", struct.pack("<d", value))
    return int(bits)


def _windows(width: int, lanes: int) -> Iterator[int]:
    """Give where the vectors of a row begin; the last ends with the row, where it is long enough."""
    yield from range(0, max(width - lanes, 0), lanes)
    yield max(width - lanes, 0)


def single_ir(code: MachineCode, inputs: Sequence[Column], outputs: Sequence[Column], target: Target) -> str:
    """Return the IR of ``single(arrays)``, for one configuration.

    Args:
        code: what is computed; its inputs and outputs are those of the arrays, one after the other.
        inputs: the arrays that are read.
        outputs: the arrays that are written.
        target: what it is written for; a vector is one number here.

    Returns:
        IR of a function of one pointer, to the addresses of the arrays, inputs first. It returns a status:
        ``MEANINGLESS`` or ``UNUSUAL``, or 0 where all is well.
    """
    text = _Text(target._replace(lanes=1))
    text.do("define i64 @single(ptr noalias %arrays) {")
    text.do("entry:")
    pointers = [
        text.let(f"load ptr, ptr {text.address('%arrays', i, 'ptr')}") for i in range(len(inputs) + len(outputs))
    ]
    bad, odd = _body(text, code, inputs, outputs, pointers)
    text.do(f"ret i64 {_status(text, bad, odd)}")
    text.do("}")
    return text.module()


def rows_ir(code: MachineCode, inputs: Sequence[Column], outputs: Sequence[Column], target: Target) -> str:
    """Return the IR of ``rows(first, last, arrays)``, for rows ``first`` to ``last`` of the arrays.

    Arguments and result are those of ``single_ir``; the status is that of all rows together.
    """
    text = _Text(target)
    lanes, truth, arrays = target.lanes, text.of("i1"), [*inputs, *outputs]
    text.do(f'define i64 @rows(i64 %first, i64 %last, ptr noalias %arrays) "prefer-vector-width"="{64 * lanes}" {{')
    text.do("entry:")
    starts = [text.let(f"load ptr, ptr {text.address('%arrays', i, 'ptr')}") for i in range(len(arrays))]
    spare = [text.let(f"alloca [{lanes * one.size} x i8], align {_LINE}") for one in arrays]
    text.do("%some = icmp slt i64 %first, %last")
    text.do("br i1 %some, label %block, label %none")
    text.do("block:")
    text.do("%row = phi i64 [%first, %entry], [%next, %ahead]")
    text.do(f"%bad = phi {truth} [{text.never}, %entry], [%bad_now, %ahead]")
    text.do(f"%odd = phi {truth} [{text.never}, %entry], [%odd_now, %ahead]")
    text.do("%left = sub i64 %last, %row")
    text.do(f"%whole = icmp sge i64 %left, {lanes}")
    here = [
        text.address(start, text.let(f"mul i64 %row, {one.size}"), "i8")
        for start, one in zip(starts, arrays, strict=True)
    ]
    text.do("br i1 %whole, label %work, label %copy")
    _copy_last_rows(text, inputs, here, spare)
    text.do("work:")
    places = [text.let(f"phi ptr [{a}, %block], [{b}, %copy]") for a, b in zip(here, spare, strict=True)]
    if code.graph.loops:
        text.ahead = [
            _Ahead(text.address(start, lanes * one.size, "i8"), lanes * one.size, i >= len(inputs))
            for i, (start, one) in enumerate(zip(here, arrays, strict=True))
        ]
        # The longest loop has the most time for it.
        text.ahead_in = max(code.graph.loops, key=lambda loop: sum(len(step.graph.nodes) for step in loop.steps))
    bad, odd = _body(text, code, inputs, outputs, places)
    text.do(f"%bad_now = or {truth} %bad, {bad}")
    text.do(f"%odd_now = or {truth} %odd, {odd}")
    text.do("br i1 %whole, label %ahead, label %put")
    text.do("put:")
    for to, place, one in zip(here[len(inputs) :], spare[len(inputs) :], outputs, strict=True):
        text.copy(to, place, text.let(f"mul i64 %left, {one.size}"))
    text.do("br label %ahead")
    text.do("ahead:")
    text.do(f"%next = add i64 %row, {lanes}")
    text.do("%more = icmp slt i64 %next, %last")
    text.do("br i1 %more, label %block, label %done")
    text.do("done:")
    text.do(f"ret i64 {_status(text, '%bad_now', '%odd_now')}")
    text.do("none:")
    text.do("ret i64 0")
    text.do("}")
    return text.module()


def _copy_last_rows(text: _Text, inputs: Sequence[Column], here: Sequence[str], spare: Sequence[str]) -> None:
    """Write the copy of the last rows, fewer than a vector has lanes, filled up with the last of them."""
    text.intrinsics.add("declare i64 @llvm.smin.i64(i64, i64)")
    text.do("copy:")
    text.do("%k = phi i64 [0, %block], [%k_next, %copy]")
    text.do("%k_last = sub i64 %left, 1")
    text.do("%k_from = call i64 @llvm.smin.i64(i64 %k, i64 %k_last)")
    for place, to, one in zip(here, spare, inputs, strict=False):
        source = text.address(place, text.let(f"mul i64 %k_from, {one.size}"), "i8")
        text.copy(text.address(to, text.let(f"mul i64 %k, {one.size}"), "i8"), source, str(one.size))
    text.do("%k_next = add i64 %k, 1")
    text.do(f"%k_done = icmp eq i64 %k_next, {text.lanes}")
    text.do("br i1 %k_done, label %work, label %copy")


def lanes_ir(code: MachineCode, inputs: int, count: int, target: Target) -> str:
    """Return the IR of ``lanes(x, y)``, for configurations that lie side by side in memory.

    Number ``i`` of configuration ``k`` is at ``i * count + k`` of the array ``x``, likewise of ``y``.

    Args:
        code: what is computed.
        inputs: how many numbers it takes.
        count: how many configurations there are, a multiple of the lanes.
        target: what it is written for.
    """
    text = _Text(target)
    text.do("define void @lanes(ptr noalias %x, ptr noalias %y) {")
    text.do("entry:")
    text.do("br label %block")
    text.do("block:")
    text.do("%first = phi i64 [0, %entry], [%next, %block]")
    x, y = (text.address(array, "%first") for array in ("%x", "%y"))
    kind = text.number
    values = [text.let(f"load {kind}, ptr {text.address(x, i * count)}, align 8") for i in range(inputs)]
    names = _Values(text, code.graph, values.__getitem__)
    text.graph(code.graph, code.order, names)
    for i, node in enumerate(code.outputs):
        text.do(f"store {kind} {names[node]}, ptr {text.address(y, i * count)}, align 8")
    text.do(f"%next = add i64 %first, {target.lanes}")
    text.do(f"%more = icmp slt i64 %next, {count}")
    text.do("br i1 %more, label %block, label %done")
    text.do("done:")
    text.do("ret void")
    text.do("}")
    return text.module()


def _body(
    text: _Text, code: MachineCode, inputs: Sequence[Column], outputs: Sequence[Column], pointers: Sequence[str]
) -> tuple[str, str]:
    """Write the work on one block; return whether configurations are invalid, and unusual."""
    read, written = pointers[: len(inputs)], pointers[len(inputs) :]
    columns = [text.columns(place, one.width) for place, one in zip(read, inputs, strict=True)]
    starts = [0, *accumulate(one.width for one in inputs)]
    if code.graph.loops:
        memory = text.scratch(starts[-1])
        for start, of_input in zip(starts, columns, strict=False):
            for i, x in of_input:
                text.store(x, memory, start + i)
        values = _Values(text, code.graph, lambda k: text.load(memory, k), memory)
    else:
        names = {start + i: x for start, of_input in zip(starts, columns, strict=False) for i, x in of_input}
        values = _Values(text, code.graph, names.__getitem__)
    parts: list[_Part] = []
    first = 0
    for place, one in zip(written, outputs, strict=True):
        parts += text.parts(place, one, code.outputs[first : first + one.width])
        first += one.width
    if code.graph.loops:
        text.graph(code.graph, code.order, values)
        for part in parts:
            part.write(values)
    else:
        in_turn = any(one.size > _LONG_ROW for one in outputs)
        order = with_results(code, [part.nodes for part in parts], in_turn=in_turn)
        lines = _lines(written, outputs, text.lanes)
        every, waiting = max(1, len(order) // max(1, len(lines))), iter(lines)
        for count, (i, known) in enumerate(order, 1):
            text.node(code.graph, i, values)
            # One line now and then: many at once, or those of the next block, would drive out of the nearest cache
            # what is worked on.
            if count % every == 0 and (line := next(waiting, None)):
                text.fetch(*line, is_written=True)
            for k in known:
                parts[k].write(values)
    return tuple(text.never if x is None else values[x] for x in (code.invalid, code.unusual))  # type: ignore[return-value]


def _lines(pointers: Sequence[str], columns: Sequence[Column], lanes: int) -> list[tuple[str, int]]:
    """Return the lines of blocks of rows that are not long, those at the same place of all blocks together.

    Each is the address of its block and its place from there. There are none of single rows.
    """
    short = [(place, one) for place, one in zip(pointers, columns, strict=True) if lanes > 1 and one.size <= _LONG_ROW]
    end = max((lanes * one.size for _, one in short), default=0)
    return [(place, k) for k in range(0, end, _LINE) for place, one in short if k < lanes * one.size]


def _status(text: _Text, bad: str, odd: str) -> str:
    """Write the status of a kernel."""
    parts = []
    for found, value in ((bad, MEANINGLESS), (odd, UNUSUAL)):
        one = found
        if text.lanes > 1:
            bits = text.let(f"bitcast {text.of('i1')} {found} to i{text.lanes}")
            one = text.let(f"icmp ne i{text.lanes} {bits}, 0")
        parts.append(text.let(f"select i1 {one}, i64 {value}, i64 0"))
    # What has no meaning is not unusual.
    return text.let(f"select i1 {text.let(f'icmp ne i64 {parts[0]}, 0')}, i64 {parts[0]}, i64 {parts[1]}")
