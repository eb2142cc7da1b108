"""From the operations of a graph to LLVM IR: straight-line code, for one configuration and for many in vectors.

Inputs and outputs are arrays in C order, one row per configuration. For many, blocks of as many rows as a vector has
lanes are transposed in registers, so that each lane is a configuration. Nothing is left to the compiler that would
change a bit: it is not told that it may reorder or join operations. So a configuration has the same bits alone, in any
batch and at any width of the vectors, on all processors that multiply and add in one instruction.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from armwright.tracing.graph import Node
from armwright.tracing.machine import MachineCode

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
# Bytes of a number, and of a line of the cache.
_DOUBLE, _LINE = 8, 64


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
        self._count = 0
        self.number = self.of("double")
        self.suffix = "f64" if lanes == 1 else f"v{lanes}f64"
        self.never = self.splat("i1 false")

    def module(self) -> str:
        """Return all of it."""
        return "\n".join([*sorted(self.intrinsics), "", *self.lines, ""])

    def of(self, kind: str) -> str:
        """Return the type of a vector of a kind of element."""
        return kind if self.lanes == 1 else f"<{self.lanes} x {kind}>"

    def splat(self, element: str) -> str:
        """Return a constant vector of one element, written with its type."""
        return element.partition(" ")[2] if self.lanes == 1 else f"<{', '.join([element] * self.lanes)}>"

    def constant(self, value: float) -> str:
        (bits,) = struct.unpack("<Q", struct.pack("<d", value))
        return self.splat(f"double 0x{bits:016X}")

    def let(self, expression: str) -> str:
        """Write an instruction, and return the name of its result."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {expression}")
        return f"%v{self._count}"

    def do(self, statement: str) -> None:
        """Write an instruction without a result, or a label."""
        self.lines.append(statement if statement.endswith(":") else f"  {statement}")

    def call(self, name: str, *operands: str, suffix: str = "") -> str:
        suffix = suffix or self.suffix
        kinds = ", ".join([self.number] * len(operands))
        self.intrinsics.add(f"declare {self.number} @llvm.{name}.{suffix}({kinds})")
        return self.let(
            f"call {self.number} @llvm.{name}.{suffix}({', '.join(f'{self.number} {x}' for x in operands)})"
        )

    def copy(self, to: str, source: str, size: str) -> None:
        """Write the copy of so many bytes."""
        self.intrinsics.add("declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)")
        self.do(f"call void @llvm.memcpy.p0.p0.i64(ptr {to}, ptr {source}, i64 {size}, i1 false)")

    def address(self, pointer: str, offset: str | int, kind: str = "double") -> str:
        """Return the address of an element of an array."""
        return pointer if offset == 0 else self.let(f"getelementptr {kind}, ptr {pointer}, i64 {offset}")

    # ---- the operations of a graph ----

    def graph(self, code: MachineCode, inputs: Sequence[str]) -> dict[int, str]:
        """Write all operations; return the names of their results by node."""
        names: dict[int, str] = {}
        for i in code.order:
            node = code.graph.nodes[i]
            if node.op == "constant":
                names[i] = self.constant(node.value)
            elif node.op == "input":
                names[i] = inputs[int(node.value)]
            elif node.op == "bit":
                place = int(code.graph.nodes[node.operands[1]].value)
                names[i] = self._bit(names[node.operands[0]], place)
            else:
                names[i] = self._operation(node, [names[j] for j in node.operands])
        return names

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

    def load_columns(self, pointer: str, width: int) -> list[str]:
        """Return the columns of a block of rows (lanes, width), each a vector."""
        if self.lanes == 1 or width == 1:
            return [self.let(f"load {self.number}, ptr {self.address(pointer, i)}, align 8") for i in range(width)]
        columns: dict[int, str] = {}
        for start in _windows(width, self.lanes):
            rows = [self._load_row(pointer, r, start, width) for r in range(self.lanes)]
            columns |= {start + k: x for k, x in enumerate(self._transposed(rows)) if start + k < width}
        return [columns[i] for i in range(width)]

    def store_columns(self, pointer: str, columns: Sequence[str]) -> None:
        """Write columns, each a vector, as a block of rows."""
        width = len(columns)
        if self.lanes == 1 or width == 1:
            for i, x in enumerate(columns):
                self.do(f"store {self.number} {x}, ptr {self.address(pointer, i)}, align 8")
            return
        for start in _windows(width, self.lanes):
            block = [columns[start + k] if start + k < width else "poison" for k in range(self.lanes)]
            # A row of fewer numbers than a vector begins where the one before it ends too far: it is written behind it.
            for r, row in enumerate(self._transposed(block)):
                self._store_row(pointer, r, start, width, row)

    def store_flags(self, pointer: str, columns: Sequence[str]) -> None:
        """Write columns of truth values as a block of rows of bytes."""
        if len(columns) == _DOUBLE and self.lanes > 1:
            # A row of eight bytes is one word: each column sets a bit of it.
            words, truth, row = self.of("i64"), self.of("i1"), self.splat("i64 0")
            for i, x in enumerate(columns):
                one = self.let(
                    f"select {truth} {x}, {words} {self.splat(f'i64 {1 << 8 * i}')}, {words} {self.splat('i64 0')}"
                )
                row = self.let(f"or {words} {row}, {one}")
            self.do(f"store {words} {row}, ptr {pointer}, align 1")
            return
        for i, x in enumerate(columns):
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
    _fetch_next_block(text, inputs, outputs, here)
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


def _fetch_next_block(text: _Text, inputs: Sequence[Column], outputs: Sequence[Column], here: Sequence[str]) -> None:
    """Ask for the memory of the next block while this one is worked on."""
    text.intrinsics.add("declare void @llvm.prefetch.p0(ptr, i32, i32, i32)")
    for i, (place, one) in enumerate(zip(here, [*inputs, *outputs], strict=True)):
        block = text.lanes * one.size
        for line in range(0, block, _LINE):
            ahead, is_written = text.address(place, block + line, "i8"), int(i >= len(inputs))
            text.do(f"call void @llvm.prefetch.p0(ptr {ahead}, i32 {is_written}, i32 3, i32 1)")


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
    names = text.graph(code, values)
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
    values = [x for place, one in zip(read, inputs, strict=True) for x in text.load_columns(place, one.width)]
    names = text.graph(code, values)
    results = iter(code.outputs)
    for place, one in zip(written, outputs, strict=True):
        columns = [names[next(results)] for _ in range(one.width)]
        (text.store_flags if one.flag else text.store_columns)(place, columns)
    return tuple(text.never if x is None else names[x] for x in (code.invalid, code.unusual))  # type: ignore[return-value]


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
