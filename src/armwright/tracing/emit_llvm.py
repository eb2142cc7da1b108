"""LLVM IR of kernels, for one configuration and for many in vectors.

Inputs and outputs are arrays in C order, one row per configuration. For many, blocks of as many rows as a vector has
lanes are transposed in registers, so that each lane is a configuration. Nothing is left to the compiler that would
change a bit: it is not told that it may reorder or join operations. So a configuration has the same bits alone, in any
batch and at any width of the vectors, on all processors that multiply and add in one instruction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import accumulate
from typing import NamedTuple

from armwright.tracing.llvm_builder import CACHE_LINE, DOUBLE, Builder
from armwright.tracing.llvm_operations import Block, Operations, Prefetch
from armwright.tracing.machine import MachineCode, with_results

# What a kernel returns beside 0: some configuration is without meaning, or unusual.
MEANINGLESS, UNUSUAL = 1, 2

# Blocks with rows of more bytes than this do not stay in the nearest cache: they are written from front to back, and
# not fetched before.
_LONG_ROW = 2048


class Column(NamedTuple):
    """An array of a kernel: how many numbers a row has, and whether they are truth values, of one byte each."""

    width: int
    flag: bool = False

    @property
    def size(self) -> int:
        """The size of a row [bytes]."""
        return self.width * (1 if self.flag else DOUBLE)


class Target(NamedTuple):
    """What code is written for.

    Attributes:
        lanes: how many numbers a vector holds.
        has_fma: whether the processor multiplies and adds in one instruction; otherwise that is rounded twice.
    """

    lanes: int
    has_fma: bool


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
    b = Builder(1, has_fma=target.has_fma)
    b.do("define i64 @single(ptr noalias %arrays) {")
    b.do("entry:")
    pointers = [b.let(f"load ptr, ptr {b.address('%arrays', i, 'ptr')}") for i in range(len(inputs) + len(outputs))]
    invalid, unusual = _body(b, code, inputs, outputs, pointers)
    b.do(f"ret i64 {_status(b, invalid, unusual)}")
    b.do("}")
    return b.module()


def rows_ir(code: MachineCode, inputs: Sequence[Column], outputs: Sequence[Column], target: Target) -> str:
    """Return the IR of ``rows(first, last, arrays)``, for the rows from ``first`` to before ``last`` of the arrays.

    Arguments and result are those of ``single_ir``; the status is that of all rows together. The last rows, if they
    are fewer than a vector has lanes, are copied to the stack, and the results from there.
    """
    b = Builder(target.lanes, has_fma=target.has_fma)
    lanes, arrays = target.lanes, [*inputs, *outputs]
    b.do(f'define i64 @rows(i64 %first, i64 %last, ptr noalias %arrays) "prefer-vector-width"="{64 * lanes}" {{')
    b.do("entry:")
    starts = [b.let(f"load ptr, ptr {b.address('%arrays', i, 'ptr')}") for i in range(len(arrays))]
    spare = [b.let(f"alloca [{lanes * array.size} x i8], align {CACHE_LINE}") for array in arrays]
    b.do("%some = icmp slt i64 %first, %last")
    b.do("br i1 %some, label %block, label %none")
    b.do("block:")
    b.do("%row = phi i64 [%first, %entry], [%next, %ahead]")
    b.do(f"%bad = phi {b.truth} [{b.false}, %entry], [%bad_now, %ahead]")
    b.do(f"%odd = phi {b.truth} [{b.false}, %entry], [%odd_now, %ahead]")
    b.do("%left = sub i64 %last, %row")
    b.do(f"%whole = icmp sge i64 %left, {lanes}")
    here = [
        b.address(start, b.let(f"mul i64 %row, {array.size}"), "i8")
        for start, array in zip(starts, arrays, strict=True)
    ]
    b.do("br i1 %whole, label %work, label %copy")
    _copy_last_rows(b, inputs, here, spare)
    b.do("work:")
    pointers = [b.let(f"phi ptr [{x}, %block], [{y}, %copy]") for x, y in zip(here, spare, strict=True)]
    prefetch = _prefetch(b, code, inputs, outputs, here) if code.graph.loops else None
    invalid, unusual = _body(b, code, inputs, outputs, pointers, prefetch=prefetch)
    b.do(f"%bad_now = or {b.truth} %bad, {invalid}")
    b.do(f"%odd_now = or {b.truth} %odd, {unusual}")
    b.do("br i1 %whole, label %ahead, label %put")
    b.do("put:")
    for to, source, array in zip(here[len(inputs) :], spare[len(inputs) :], outputs, strict=True):
        b.copy(to, source, b.let(f"mul i64 %left, {array.size}"))
    b.do("br label %ahead")
    b.do("ahead:")
    b.do(f"%next = add i64 %row, {lanes}")
    b.do("%more = icmp slt i64 %next, %last")
    b.do("br i1 %more, label %block, label %done")
    b.do("done:")
    b.do(f"ret i64 {_status(b, '%bad_now', '%odd_now')}")
    b.do("none:")
    b.do("ret i64 0")
    b.do("}")
    return b.module()


def _copy_last_rows(b: Builder, inputs: Sequence[Column], here: Sequence[str], spare: Sequence[str]) -> None:
    """Write the copy of the last rows, fewer than a vector has lanes, filled up with the last of them."""
    b.declare("i64 @llvm.smin.i64(i64, i64)")
    b.do("copy:")
    b.do("%k = phi i64 [0, %block], [%k_next, %copy]")
    b.do("%k_last = sub i64 %left, 1")
    b.do("%k_from = call i64 @llvm.smin.i64(i64 %k, i64 %k_last)")
    for start, to, array in zip(here, spare, inputs, strict=False):
        source = b.address(start, b.let(f"mul i64 %k_from, {array.size}"), "i8")
        b.copy(b.address(to, b.let(f"mul i64 %k, {array.size}"), "i8"), source, str(array.size))
    b.do("%k_next = add i64 %k, 1")
    b.do(f"%k_done = icmp eq i64 %k_next, {b.lanes}")
    b.do("br i1 %k_done, label %work, label %copy")


def _prefetch(
    b: Builder, code: MachineCode, inputs: Sequence[Column], outputs: Sequence[Column], here: Sequence[str]
) -> Prefetch:
    """Return the blocks behind those that begin ``here``, and the longest loop, which has the most time for them."""
    sizes = [b.lanes * array.size for array in (*inputs, *outputs)]
    blocks = [
        Block(b.address(start, size, "i8"), size, i >= len(inputs))
        for i, (start, size) in enumerate(zip(here, sizes, strict=True))
    ]
    return Prefetch(max(code.graph.loops, key=lambda loop: sum(len(step.graph.nodes) for step in loop.steps)), blocks)


def lanes_ir(code: MachineCode, inputs: int, count: int, target: Target) -> str:
    """Return the IR of ``lanes(x, y)``, for configurations that lie side by side in memory.

    Number ``i`` of configuration ``k`` is at ``i * count + k`` of the array ``x``, likewise of ``y``.

    Args:
        code: what is computed.
        inputs: how many numbers it takes.
        count: how many configurations there are, a multiple of the lanes.
        target: what it is written for.
    """
    b = Builder(target.lanes, has_fma=target.has_fma)
    b.do("define void @lanes(ptr noalias %x, ptr noalias %y) {")
    b.do("entry:")
    b.do("br label %block")
    b.do("block:")
    b.do("%first = phi i64 [0, %entry], [%next, %block]")
    x, y = (b.address(array, "%first") for array in ("%x", "%y"))
    vectors = [b.let(f"load {b.number}, ptr {b.address(x, i * count)}, align {DOUBLE}") for i in range(inputs)]
    operations = Operations(b, code.graph, vectors.__getitem__)
    operations.write_all(code.order)
    for i, node in enumerate(code.outputs):
        b.do(f"store {b.number} {operations[node]}, ptr {b.address(y, i * count)}, align {DOUBLE}")
    b.do(f"%next = add i64 %first, {target.lanes}")
    b.do(f"%more = icmp slt i64 %next, {count}")
    b.do("br i1 %more, label %block, label %done")
    b.do("done:")
    b.do("ret void")
    b.do("}")
    return b.module()


def _body(
    b: Builder,
    code: MachineCode,
    inputs: Sequence[Column],
    outputs: Sequence[Column],
    pointers: Sequence[str],
    *,
    prefetch: Prefetch | None = None,
) -> tuple[str, str]:
    """Write the work on one block of rows; return whether configurations are invalid, and unusual."""
    read, written = pointers[: len(inputs)], pointers[len(inputs) :]
    starts = [0, *accumulate(array.width for array in inputs)]
    vectors = (
        (start + i, x)
        for pointer, array, start in zip(read, inputs, starts, strict=False)
        for i, x in _loaded(b, pointer, array.width)
    )
    ends = [0, *accumulate(array.width for array in outputs)]
    stores = [
        store
        for pointer, array, start in zip(written, outputs, ends, strict=False)
        for store in _stores(b, pointer, array, code.outputs[start : start + array.width])
    ]
    if code.graph.loops:
        memory = b.stack_vectors(starts[-1])
        for i, x in vectors:
            b.store(x, memory, i)
        operations = Operations(b, code.graph, lambda k: b.load(memory, k), inputs=memory, prefetch=prefetch)
        operations.write_all(code.order)
        for store in stores:
            store.write(operations)
    else:
        operations = Operations(b, code.graph, dict(vectors).__getitem__)
        in_turn = any(array.size > _LONG_ROW for array in outputs)
        order = with_results(code, [store.nodes for store in stores], in_turn=in_turn)
        _write_with_stores(b, operations, order, stores, _lines(written, outputs, b.lanes))
    invalid, unusual = (b.false if x is None else operations[x] for x in (code.invalid, code.unusual))
    return invalid, unusual


def _write_with_stores(
    b: Builder,
    operations: Operations,
    order: Sequence[tuple[int, list[int]]],
    stores: Sequence[_Store],
    lines: Sequence[tuple[str, int]],
) -> None:
    """Write operations, stores of results as soon as they are known, and prefetches of the lines that these write."""
    interval, waiting = max(1, len(order) // max(1, len(lines))), iter(lines)
    for count, (i, complete) in enumerate(order, 1):
        operations.write(i)
        # One line now and then: many at once, or those of the next block, would drive out of the nearest cache what is
        # worked on.
        if count % interval == 0 and (line := next(waiting, None)):
            b.prefetch(*line, is_written=True)
        for k in complete:
            stores[k].write(operations)


def _lines(pointers: Sequence[str], columns: Sequence[Column], lanes: int) -> list[tuple[str, int]]:
    """Return the lines of blocks of rows that are not long, those at the same offset of all blocks together.

    Each is the address of its block and its offset [bytes]. There are none of single rows.
    """
    sizes = [lanes * array.size if lanes > 1 and array.size <= _LONG_ROW else 0 for array in columns]
    blocks = list(zip(pointers, sizes, strict=True))
    return [(start, k) for k in range(0, max(sizes, default=0), CACHE_LINE) for start, size in blocks if k < size]


def _status(b: Builder, invalid: str, unusual: str) -> str:
    """Write the status of a kernel."""
    statuses = []
    for lanes, value in ((invalid, MEANINGLESS), (unusual, UNUSUAL)):
        any_lane = lanes
        if b.lanes > 1:
            any_lane = b.let(f"icmp ne i{b.lanes} {b.let(f'bitcast {b.truth} {lanes} to i{b.lanes}')}, 0")
        statuses.append(b.let(f"select i1 {any_lane}, i64 {value}, i64 0"))
    # What has no meaning is not unusual.
    return b.let(f"select i1 {b.let(f'icmp ne i64 {statuses[0]}, 0')}, i64 {statuses[0]}, i64 {statuses[1]}")


# ---- rows in memory, lanes in registers ----


class _Store(NamedTuple):
    """What writes a part of the outputs, and the nodes that it takes."""

    nodes: tuple[int, ...]
    write: Callable[[Operations], None]


def _loaded(b: Builder, pointer: str, width: int) -> Iterator[tuple[int, str]]:
    """Load a block of rows (lanes, width); give its columns, each a vector, with their numbers."""
    if b.lanes == 1 or width == 1:
        for i in range(width):
            yield i, b.let(f"load {b.number}, ptr {b.address(pointer, i)}, align {DOUBLE}")
        return
    for start in _windows(width, b.lanes):
        rows = [b.load_first(*_part_of_row(b, pointer, r, start, width)) for r in range(b.lanes)]
        yield from ((start + k, x) for k, x in enumerate(_transposed(b, rows)) if start + k < width)


def _stores(b: Builder, pointer: str, column: Column, nodes: Sequence[int]) -> list[_Store]:
    """Return what writes columns, each a vector, as a block of rows.

    Args:
        b: where it is written.
        pointer: where the block begins.
        column: what the array is.
        nodes: of the columns.
    """
    if column.flag:
        return [_Store(tuple(nodes), partial(_store_flags, b, pointer, nodes))]
    width = column.width
    if b.lanes == 1 or width == 1:
        return [_Store((node,), partial(_store_column, b, pointer, i, node)) for i, node in enumerate(nodes)]
    windows = [(start, tuple(nodes[start : start + b.lanes])) for start in _windows(width, b.lanes)]
    return [_Store(part, partial(_store_window, b, pointer, part, start=start, width=width)) for start, part in windows]


def _store_column(b: Builder, pointer: str, i: int, node: int, operations: Operations) -> None:
    b.do(f"store {b.number} {operations[node]}, ptr {b.address(pointer, i)}, align {DOUBLE}")


def _store_window(
    b: Builder, pointer: str, nodes: Sequence[int], operations: Operations, *, start: int, width: int
) -> None:
    block = [*(operations[node] for node in nodes), *["poison"] * (b.lanes - len(nodes))]
    # A row of fewer numbers than a vector begins where the one before it ends too far: it is written behind it.
    for r, row in enumerate(_transposed(b, block)):
        b.store_first(row, *_part_of_row(b, pointer, r, start, width))


def _store_flags(b: Builder, pointer: str, nodes: Sequence[int], operations: Operations) -> None:
    """Write columns of truth values as a block of rows of bytes."""
    if len(nodes) == DOUBLE and b.lanes > 1:
        # A row of eight bytes is one word: each column sets a bit of it.
        words, row = b.vector_type("i64"), b.splat("i64 0")
        for i, node in enumerate(nodes):
            choices = f"{words} {b.splat(f'i64 {1 << 8 * i}')}, {words} {b.splat('i64 0')}"
            byte = b.let(f"select {b.truth} {operations[node]}, {choices}")
            row = b.let(f"or {words} {row}, {byte}")
        b.do(f"store {words} {row}, ptr {pointer}, align 1")
        return
    for i, node in enumerate(nodes):
        column = operations[node]
        for r in range(b.lanes):
            flag = column if b.lanes == 1 else b.let(f"extractelement {b.truth} {column}, i32 {r}")
            address = b.address(pointer, r * len(nodes) + i, "i8")
            b.do(f"store i8 {b.let(f'zext i1 {flag} to i8')}, ptr {address}, align 1")


def _windows(width: int, lanes: int) -> Iterator[int]:
    """Give where the vectors of a row begin; the last ends with the row, where it is long enough."""
    yield from range(0, max(width - lanes, 0), lanes)
    yield max(width - lanes, 0)


def _part_of_row(b: Builder, pointer: str, row: int, start: int, width: int) -> tuple[str, int]:
    """Return the address of a row of a block from a column on, and how many numbers of the block follow."""
    offset = row * width + start
    return b.address(pointer, offset), b.lanes * width - offset


def _transposed(b: Builder, vectors: Sequence[str]) -> list[str]:
    """Return the transpose of as many vectors as they have lanes, by exchanges of ever larger parts."""
    lanes, vectors, step = b.lanes, list(vectors), 1
    while step < lanes:
        low = [i - step + lanes if i // step % 2 else i for i in range(lanes)]
        high = [i + lanes if i // step % 2 else i + step for i in range(lanes)]
        for i in range(lanes):
            if not i // step % 2:
                pair = vectors[i], vectors[i + step]
                vectors[i], vectors[i + step] = (b.shuffle(*pair, picks) for picks in (low, high))
        step *= 2
    return vectors
