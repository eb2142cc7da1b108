"""From a routine, see ``loops``, to LLVM IR: loops over numbers, written as the routine runs.

The innermost loop that fills tables takes a vector of numbers at a time where all that it reads along it lies side by
side; every other loop takes one number after the other. Nothing is reordered or joined, so that a routine has the same
bits as with NumPy but where sums are long. What it takes of memory for its own tables is given back before it returns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from armwright.tracing.graph import Traced
from armwright.tracing.llvm_builder import bits
from armwright.tracing.scalar import Scalar, larger, select, smaller

# For numbers of a type, and what the functions of that type are called.
_ON_NUMBERS = {
    "add": "fadd {kind} {0}, {1}",
    "subtract": "fsub {kind} {0}, {1}",
    "multiply": "fmul {kind} {0}, {1}",
    "divide": "fdiv {kind} {0}, {1}",
    "negate": "fneg {kind} {0}",
    "less": "fcmp olt {kind} {0}, {1}",
    "less_equal": "fcmp ole {kind} {0}, {1}",
    "absolute": "call {kind} @llvm.fabs.{suffix}({kind} {0})",
    "sqrt": "call {kind} @llvm.sqrt.{suffix}({kind} {0})",
}
_ON_INTEGERS = {
    "add": "add i64 {0}, {1}",
    "subtract": "sub i64 {0}, {1}",
    "multiply": "mul i64 {0}, {1}",
    "less": "icmp slt i64 {0}, {1}",
    "less_equal": "icmp sle i64 {0}, {1}",
}
_TRUTHS = frozenset({"less", "less_equal"})
# The indices of a vector of numbers side by side, by the first of them.
_LANES = "lanes"


class _Value(NamedTuple):
    """A value of the code: its type, and what stands for it; a constant has its number."""

    kind: str
    text: str
    constant: float | None = None


class _NotSideBySideError(Exception):
    """A loop cannot take vectors of numbers."""


class EmittedLoops:
    """The code of one function: the loops of a routine as it asks for them, see ``loops.Loops``."""

    def __init__(self, lanes: int) -> None:
        """Begin an empty function.

        Args:
            lanes: how many numbers a vector has.
        """
        self._width = lanes
        self._numbers, self._truths = f"<{lanes} x double>", f"<{lanes} x i1>"
        # Which lanes of a vector are within the loop; None outside of loops over vectors.
        self._mask: str | None = None
        self._lines: list[str] = []
        self._values: list[_Value] = []
        self._tables: list[str] = []
        self._count = 0
        self._block = "entry"
        self._depth = 0

    # ---- scalars: what ``Traced`` asks of its graph ----

    def node(self, x: Any) -> int:
        """Return the number of a value."""
        if isinstance(x, Traced):
            return x.node
        if isinstance(x, bool):
            return self._new(_Value("i1", str(x).lower(), x))
        return self._new(_Value("i64" if isinstance(x, int) else "double", "", x))

    def apply(self, op: str, *operands: int) -> int:
        """Write an operation and return the number of its result."""
        values = [self._values[i] for i in operands]
        if op == "select":
            condition, *choices = values
            kind = self._common(choices)
            by = self._truths if condition.kind == self._truths else "i1"
            if kind == _LANES or (by == self._truths and kind == "i64"):
                raise _NotSideBySideError
            if by == self._truths and kind in ("double", "i1"):
                kind = self._vector_of(kind)
            then, otherwise = (self._as(x, kind) for x in choices)
            return self._let(kind, f"select {by} {self._as(condition, by)}, {kind} {then}, {kind} {otherwise}")
        if op == "sqrt":
            x = Traced(self, operands[0])  # type: ignore[arg-type]
            operands = (select(x < 0.0, 0.0, x).node,)
            values = [self._values[operands[0]]]
        kind = self._common(values)
        if kind == _LANES:
            return self._shifted(op, values)
        kind = "double" if kind == "i64" and op not in _ON_INTEGERS else kind
        texts = [self._as(x, kind) for x in values]
        if kind == "i64":
            return self._let("i1" if op in _TRUTHS else kind, _ON_INTEGERS[op].format(*texts))
        truth, suffix = ("i1", "f64") if kind == "double" else (self._truths, f"v{self._width}f64")
        return self._let(truth if op in _TRUTHS else kind, _ON_NUMBERS[op].format(*texts, kind=kind, suffix=suffix))

    def _shifted(self, op: str, values: Sequence[_Value]) -> int:
        """Return indices side by side that begin farther on, or before."""
        first, *others = values
        if op not in ("add", "subtract") or [x.kind for x in values] != [_LANES, "i64"]:
            raise _NotSideBySideError
        return self._let(_LANES, _ON_INTEGERS[op].format(first.text, self._as(others[0], "i64")))

    def _new(self, value: _Value) -> int:
        self._values.append(value)
        return len(self._values) - 1

    def _let(self, kind: str, instruction: str) -> int:
        return self._new(_Value(kind, self._name(instruction)))

    def _name(self, instruction: str) -> str:
        self._count += 1
        self._lines.append(f"  %v{self._count} = {instruction}")
        return f"%v{self._count}"

    def _product(self, a: str, b: str) -> str:
        return b if a == "1" else a if b == "1" else self._name(f"mul i64 {a}, {b}")

    def _traced(self, kind: str, text: str) -> Traced:
        return Traced(self, self._new(_Value(kind, text)))  # type: ignore[arg-type]

    def _common(self, values: Sequence[_Value]) -> str:
        """Return the type of an operation; a whole constant is an integer only beside others."""
        kinds = {x.kind for x in values}
        if _LANES in kinds:
            return _LANES
        if self._numbers in kinds:
            return self._numbers
        if self._truths in kinds:
            return self._truths
        computed = {x.kind for x in values if x.constant is None}
        return "double" if "double" in kinds else next(iter(computed or kinds))

    def _as(self, x: _Value, kind: str) -> str:
        """Return what stands for a value as one of a type."""
        if x.constant is not None:
            if kind == "double":
                return bits(float(x.constant))
            if kind in ("i64", "i1"):
                return str(int(x.constant)) if kind == "i64" else str(bool(x.constant)).lower()
        if x.kind == kind:
            return x.text
        if x.kind == "i64" and kind == "double":
            return self._name(f"sitofp i64 {x.text} to double")
        if kind == self._numbers and x.kind in ("double", "i64"):
            return self._splat("double", self._as(x, "double"))
        if kind == self._truths and x.kind == "i1":
            return self._splat("i1", self._as(x, "i1"))
        if self._mask is not None:
            raise _NotSideBySideError
        raise TypeError(f"{x.kind} where {kind} is needed")

    def _vector_of(self, kind: str) -> str:
        return f"<{self._width} x {kind}>"

    def _splat(self, kind: str, text: str) -> str:
        """Return a vector whose lanes are all the same number."""
        vector = self._vector_of(kind)
        first = self._name(f"insertelement {vector} poison, {kind} {text}, i64 0")
        return self._name(f"shufflevector {vector} {first}, {vector} poison, <{self._width} x i32> zeroinitializer")

    def _indices(self, first: str) -> str:
        """Return indices side by side as a vector."""
        vector = self._vector_of("i64")
        steps = ", ".join(f"i64 {k}" for k in range(self._width))
        return self._name(f"add {vector} {self._splat('i64', first)}, <{steps}>")

    def _text(self, x: Scalar, kind: str) -> str:
        return self._as(self._values[self.node(x)], kind)

    def _kind(self, x: Scalar) -> str:
        return self._values[self.node(x)].kind

    def _one_by_one(self, values: Sequence[Scalar]) -> list[str]:
        """Return the types of values that come from one of several blocks, which indices side by side cannot."""
        kinds = [self._kind(x) for x in values]
        if _LANES in kinds:
            raise _NotSideBySideError
        return kinds

    # ---- loops ----

    def each(
        self, sizes: Sequence[Scalar], body: Callable[..., Sequence[Scalar]], count: int = 1
    ) -> list[EmittedTable]:
        """Return new tables of what a body returns for each tuple of indices."""
        tables = [self.table(*sizes) for _ in range(count)]
        self.fill(tables, sizes, body)
        return tables

    def fill(
        self, tables: Sequence[EmittedTable], sizes: Sequence[Scalar], body: Callable[..., Sequence[Scalar]]
    ) -> None:
        """Write into tables what a body returns for each tuple of indices."""
        self._fill(tables, list(sizes), (), body)

    def _fill(
        self,
        tables: Sequence[EmittedTable],
        sizes: list[Scalar],
        indices: tuple[Scalar, ...],
        body: Callable[..., Sequence[Scalar]],
    ) -> None:
        if not sizes:
            for table, x in zip(tables, body(*indices), strict=True):
                table[indices] = x
            return

        if len(sizes) == 1 and self._filled_by_vectors(tables, sizes[0], indices, body):
            return

        def step(i: Scalar) -> tuple[()]:
            self._fill(tables, sizes[1:], (*indices, i), body)
            return ()

        self.walk(sizes[0], (), step)

    def _filled_by_vectors(
        self,
        tables: Sequence[EmittedTable],
        size: Scalar,
        indices: tuple[Scalar, ...],
        body: Callable[..., Sequence[Scalar]],
    ) -> bool:
        """Fill tables by vectors of numbers along the last axis; return False, and write nothing, where one cannot."""
        mark = len(self._lines), len(self._values), self._block, self._depth
        length = self._text(size, "i64")
        shift = self._width.bit_length() - 1
        vectors = self._name(f"ashr i64 {self._name(f'add i64 {length}, {self._width - 1}')}, {shift}")

        def step(k: Scalar) -> tuple[()]:
            first = self._name(f"shl i64 {self._text(k, 'i64')}, {shift}")
            vector = self._vector_of("i64")
            self._mask = self._name(f"icmp slt {vector} {self._indices(first)}, {self._splat('i64', length)}")
            lanes = (*indices, self._traced(_LANES, first))
            for table, x in zip(tables, body(*lanes), strict=True):
                table[lanes] = x
            return ()

        try:
            self.walk(self._traced("i64", vectors), (), step)
        except _NotSideBySideError:
            lines, values, self._block, self._depth = mark
            del self._lines[lines:], self._values[values:]
            return False
        finally:
            self._mask = None
        return True

    def table(self, *sizes: Scalar) -> EmittedTable:
        """Return a new table of so many numbers along each axis; not within a loop."""
        if self._depth:
            raise TypeError("a new table within a loop")
        count = "1"
        lengths = [self._text(size, "i64") for size in sizes]
        for length in lengths:
            count = self._name(f"mul i64 {count}, {length}")
        # Memory of no bytes may have no address.
        bytes_ = self._name(f"add i64 {self._name(f'mul i64 {count}, 8')}, 8")
        pointer = self._name(f"call noalias ptr %allocate(i64 {bytes_})")
        none, label = self._name(f"icmp eq ptr {pointer}, null"), f"table{self._count}"
        self._jump(f"br i1 {none}, label %short{len(self._tables)}, label %{label}", label)
        self._tables.append(pointer)
        return EmittedTable(self, pointer, lengths)

    def sums(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> EmittedTable:
        """Return a new table of the sums of what a body returns for the indices before each, from 0 to all of them."""
        table = self.table(size + 1)
        table[0] = 0.0

        def step(i: Scalar, total: Scalar) -> tuple[Scalar]:
            table[i + 1] = after = total + body(i)
            return (after,)

        self.walk(size, (0.0,), step)
        return table

    def highest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> EmittedTable:
        """Return a new table of the largest of what a body returns for the indices up to each."""
        table = self.table(size)

        def step(i: Scalar, most: Scalar) -> tuple[Scalar]:
            table[i] = after = larger(most, body(i))
            return (after,)

        self.walk(size, (-math.inf,), step)
        return table

    def merged(self, first: EmittedTable, second: EmittedTable) -> EmittedTable:
        """Return a new table of the numbers of two tables in order; both are so but for rounding."""
        (m,), (n,) = first.shape, second.shape
        table = self.table(m + n)

        def taken(k: Scalar, i: Scalar, j: Scalar) -> tuple[Scalar, ...]:
            (x,) = self.when(i < m, lambda: (first[i],), lambda: (math.inf,))
            (y,) = self.when(j < n, lambda: (second[j],), lambda: (math.inf,))
            table[k] = select(x <= y, x, y)
            return i + select(x <= y, 1, 0), j + select(x <= y, 0, 1)

        self.walk(m + n, (0, 0), taken)

        def sunk(k: Scalar) -> tuple[()]:
            x = table[k]

            def step(at: Scalar) -> tuple[Scalar, tuple[Scalar]]:
                (before,) = self.when(at > 0, lambda: (table[at - 1],), lambda: (-math.inf,))
                done = before <= x

                def moved() -> tuple[Scalar]:
                    table[at] = before
                    return (at - 1,)

                return done, self.when(done, lambda: (at,), moved)

            (at,) = self.until(k + 1, (k + 0,), step)
            table[at] = x
            return ()

        self.walk(m + n, (), sunk)
        return table

    def kept(self, sizes: Sequence[Scalar], body: Callable[..., Scalar]) -> tuple[list[EmittedTable], Scalar]:
        """Return new tables of the indices, one per axis, for which a condition holds, and how many there are."""
        every: Scalar = 1
        for size in sizes:
            every = size * every
        tables = [self.table(every) for _ in sizes]

        def step(left: Sequence[Scalar], indices: tuple[Scalar, ...], count: Scalar) -> tuple[Scalar]:
            if left:
                (count,) = self.walk(left[0], (count,), lambda i, count: step(left[1:], (*indices, i), count))
                return (count,)
            for table, i in zip(tables, indices, strict=True):
                table[count] = i
            return (count + select(body(*indices), 1, 0),)

        (count,) = step(sizes, (), 0)
        return tables, count

    def whole(self, x: Scalar) -> Scalar:
        """Return a number without a fraction as an index."""
        if self._kind(x) == self._numbers:
            raise _NotSideBySideError
        return self._traced("i64", self._name(f"fptosi double {self._text(x, 'double')} to i64"))

    def number(self, i: Scalar) -> Scalar:
        """Return an index as a number."""
        if self._kind(i) == _LANES:
            indices = self._indices(self._values[self.node(i)].text)
            return self._traced(
                self._numbers, self._name(f"sitofp {self._vector_of('i64')} {indices} to {self._numbers}")
            )
        return self._traced("double", self._text(i, "double"))

    def segment(self, starts: EmittedTable, x: Scalar, count: Scalar) -> Scalar:
        """Return which of ``count`` segments, by their starts, a number is in; at a start the next."""

        def step(low: Scalar, high: Scalar) -> tuple[Scalar, tuple[Scalar, ...]]:
            middle = self._traced("i64", self._name(f"lshr i64 {self._text(low + high, 'i64')}, 1"))
            behind = starts[middle] <= x
            low, high = select(behind, middle, low), select(behind, high, middle)
            return high - low <= 1, (low, high)

        return self.until(64, (0, count), step)[0]

    def walk(
        self, size: Scalar, carry: Sequence[Scalar], step: Callable[..., Sequence[Scalar]], *, reverse: bool = False
    ) -> tuple[Scalar, ...]:
        """Apply a step to one index after the other; it takes the index and what was carried, and returns the new."""
        return self._loop(size, carry, lambda i, *state: (False, step(i, *state)), reverse=reverse)

    def follow(
        self,
        sizes: Sequence[Scalar],
        start: Callable[[Scalar], Scalar],
        step: Callable[[Scalar, Scalar, Scalar], Scalar],
        *,
        reverse: bool = False,
    ) -> EmittedTable:
        """Return a new table of two axes whose rows follow each other, each column by itself."""
        table = self.table(*sizes)

        def of_column(j: Scalar) -> tuple[()]:
            def of_row(i: Scalar, before: Scalar) -> tuple[Scalar]:
                table[i, j] = x = step(i, j, before)
                return (x,)

            self.walk(sizes[0], (start(j),), of_row, reverse=reverse)
            return ()

        self.walk(sizes[1], (), of_column)
        return table

    def until(
        self, most: int, carry: Sequence[Scalar], step: Callable[..., tuple[Scalar, Sequence[Scalar]]]
    ) -> tuple[Scalar, ...]:
        """Apply a step until it is done; it takes what was carried, and returns whether it is and what is new."""
        return self._loop(most, carry, lambda _, *state: step(*state), reverse=False)

    def _loop(
        self,
        size: Scalar,
        carry: Sequence[Scalar],
        step: Callable[..., tuple[Scalar, Sequence[Scalar]]],
        *,
        reverse: bool,
        kinds: Sequence[str] = (),
    ) -> tuple[Scalar, ...]:
        """Write a loop; what is carried has its own types, or given ones."""
        self._count += 1
        name = f"loop{self._count}"
        kinds = kinds or self._one_by_one(carry)
        mark = len(self._lines), len(self._values), self._block
        starts, length = [self._text(x, kind) for x, kind in zip(carry, kinds, strict=True)], self._text(size, "i64")
        first = self._name(f"sub i64 {length}, 1") if reverse else "0"
        before = self._block
        self._jump(f"br label %{name}", name)
        head = len(self._lines)
        state = [self._traced(kind, f"%{name}_{i}") for i, kind in enumerate(kinds)]
        index = f"%{name}_i"
        inside = self._name(f"icmp sge i64 {index}, 0" if reverse else f"icmp slt i64 {index}, {length}")
        self._jump(f"br i1 {inside}, label %{name}_do, label %{name}_left", f"{name}_do")
        self._depth += 1
        done, new = step(self._traced("i64", index), *state)
        self._depth -= 1
        # A number that is the same for all lanes at first may differ between them later.
        wider = [self._numbers if self._kind(x) == self._numbers else k for x, k in zip(new, kinds, strict=True)]
        if wider != list(kinds):
            lines, values, self._block = mark
            del self._lines[lines:], self._values[values:]
            return self._loop(size, carry, step, reverse=reverse, kinds=wider)
        texts = [self._text(x, kind) for x, kind in zip(new, kinds, strict=True)]
        next_index = self._name(f"add i64 {index}, {-1 if reverse else 1}")
        end = self._block
        phis = [f"  {index} = phi i64 [{first}, %{before}], [{next_index}, %{end}]"]
        for i, (kind, start, text) in enumerate(zip(kinds, starts, texts, strict=True)):
            phis.append(f"  %{name}_{i} = phi {kind} [{start}, %{before}], [{text}, %{end}]")
        self._lines[head:head] = phis
        if done is False:
            self._jump(f"br label %{name}", f"{name}_left")
            return tuple(state)
        self._jump(f"br i1 {self._text(done, 'i1')}, label %{name}_left, label %{name}", f"{name}_left")
        return tuple(
            self._traced(kind, self._name(f"phi {kind} [{self._text(old, kind)}, %{name}], [{text}, %{end}]"))
            for kind, old, text in zip(kinds, state, texts, strict=True)
        )

    def when(
        self, condition: Scalar, then: Callable[[], Sequence[Scalar]], otherwise: Callable[[], Sequence[Scalar]]
    ) -> tuple[Scalar, ...]:
        """Return what one of two functions returns; only that one runs."""
        self._count += 1
        name = f"if{self._count}"
        self._jump(f"br i1 {self._text(condition, 'i1')}, label %{name}_a, label %{name}_b", f"{name}_a")
        self._depth += 1
        first = then()
        kinds = self._one_by_one(first)
        a, a_end = [self._text(x, kind) for x, kind in zip(first, kinds, strict=True)], self._block
        self._jump(f"br label %{name}", f"{name}_b")
        b, b_end = [self._text(x, kind) for x, kind in zip(otherwise(), kinds, strict=True)], self._block
        self._depth -= 1
        self._jump(f"br label %{name}", name)
        return tuple(
            self._traced(kind, self._name(f"phi {kind} [{x}, %{a_end}], [{y}, %{b_end}]"))
            for kind, x, y in zip(kinds, a, b, strict=True)
        )

    def largest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the largest of what a body returns for the indices; the least number there is where none is."""
        (most,) = self.walk(size, (-math.inf,), lambda i, most: (larger(most, body(i)),))
        return most

    def least(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the least of what a body returns for the indices."""
        (least,) = self.walk(size, (math.inf,), lambda i, least: (smaller(least, body(i)),))
        return least

    def total(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the sum of what a body returns for the indices."""
        (total,) = self.walk(size, (0.0,), lambda i, total: (total + body(i),))
        return total

    def first_largest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
        """Return the largest of what a body returns, and the first index for which it does."""
        return self._first(size, body, -math.inf, lambda x, most: most < x)

    def first_least(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
        """Return the least of what a body returns, and the first index for which it does."""
        return self._first(size, body, math.inf, lambda x, least: x < least)

    def _first(
        self, size: Scalar, body: Callable[[Scalar], Scalar], start: float, better: Callable[[Scalar, Scalar], Scalar]
    ) -> tuple[Scalar, Scalar]:
        def step(i: Scalar, best: Scalar, at: Scalar) -> tuple[Scalar, Scalar]:
            x = body(i)
            return select(better(x, best), x, best), select(better(x, best), i, at)

        best, at = self.walk(size, (start, 0), step)
        return best, at

    def _loaded(self, address: str, *, vector: bool) -> Scalar:
        if not vector:
            return self._traced("double", self._name(f"load double, ptr {address}"))
        arguments = f"ptr {address}, i32 8, {self._truths} {self._mask}, {self._numbers} zeroinitializer"
        load = f"call {self._numbers} @llvm.masked.load.v{self._width}f64.p0({arguments})"
        return self._traced(self._numbers, self._name(load))

    def _store(self, x: Scalar, address: str, *, vector: bool) -> None:
        if vector:
            text = self._text(x, self._numbers)
            arguments = f"{self._numbers} {text}, ptr {address}, i32 8, {self._truths} {self._mask}"
            self._lines.append(f"  call void @llvm.masked.store.v{self._width}f64.p0({arguments})")
            return
        if self._mask is not None:  # written once for each number of the loop, of which the last one stays
            raise _NotSideBySideError
        self._lines.append(f"  store double {self._text(x, 'double')}, ptr {address}")

    def _jump(self, branch: str, label: str) -> None:
        self._lines += [f"  {branch}", f"{label}:"]
        self._block = label

    # ---- the function ----

    def module(self, routine: Callable[..., None], axes: Sequence[int]) -> str:
        """Return the IR of ``routine(tables, lengths, allocate, free)``, which returns 0, or 1 where memory is short.

        Args:
            routine: takes loops, and a table for each array.
            axes: how many axes each array has.
        """
        tables, place = [], 0
        for k, count in enumerate(axes):
            pointer = self._name(f"load ptr, ptr {self._name(f'getelementptr ptr, ptr %tables, i64 {k}')}")
            places = [self._name(f"getelementptr i64, ptr %lengths, i64 {place + i}") for i in range(count)]
            tables.append(EmittedTable(self, pointer, [self._name(f"load i64, ptr {one}") for one in places]))
            place += count
        routine(self, *tables)
        # What was taken is given back, the last one first, also where memory was too short for another.
        end = [f"  br label %short{len(self._tables)}_end"]
        for k in reversed(range(len(self._tables) + 1)):
            before = f"[0, %{self._block}]" if k == len(self._tables) else f"[%status{k + 1}, %short{k + 1}_end]"
            end += [] if k == len(self._tables) else [f"short{k}:", f"  br label %short{k}_end"]
            end += [f"short{k}_end:", f"  %status{k} = phi i64 {before}"]
            end[-1] += "" if k == len(self._tables) else f", [1, %short{k}]"
            if k:
                end += [f"  call void %free(ptr {self._tables[k - 1]})", f"  br label %short{k - 1}_end"]
        head = "define i64 @routine(ptr noalias %tables, ptr noalias %lengths, ptr %allocate, ptr %free) nounwind {"
        numbers, truths, suffix = self._numbers, self._truths, f"v{self._width}f64"
        declared = [
            f"declare {kind} @llvm.{name}.{of}({kind})"
            for name in ("fabs", "sqrt")
            for kind, of in (("double", "f64"), (numbers, suffix))
        ]
        declared += [
            f"declare {numbers} @llvm.masked.load.{suffix}.p0(ptr, i32, {truths}, {numbers})",
            f"declare void @llvm.masked.store.{suffix}.p0({numbers}, ptr, i32, {truths})",
        ]
        return "\n".join([*declared, head, "entry:", *self._lines, *end, "  ret i64 %status0", "}", ""])


class EmittedTable:
    """An array in memory, or a part of one."""

    def __init__(
        self, loops: EmittedLoops, pointer: str, lengths: Sequence[str], strides: Sequence[str] | None = None
    ) -> None:
        """Stand for an array by its address, the lengths of its axes, and how far apart their numbers are."""
        self._loops, self._pointer, self._lengths = loops, pointer, lengths
        self._strides: list[str] = list(strides or [])
        if strides is None:
            # In C order.
            self._strides = ["1"] * len(lengths)
            for i in reversed(range(len(lengths) - 1)):
                self._strides[i] = loops._product(self._strides[i + 1], lengths[i + 1])  # noqa: SLF001 - of one module

    @property
    def shape(self) -> tuple[Scalar, ...]:
        """How long the axes are."""
        return tuple(self._loops._traced("i64", length) for length in self._lengths)  # noqa: SLF001

    def row(self, i: Scalar) -> EmittedTable:
        """Return a row as a table of one axis less."""
        return self.part(0, i)

    def part(self, axis: int, k: Scalar) -> EmittedTable:
        """Return the table without an axis, at one place of it."""
        if self._loops._kind(k) == _LANES:  # noqa: SLF001 - of one module
            raise _NotSideBySideError
        pointer = self._address((*[0] * axis, k, *[0] * (len(self._lengths) - axis - 1)))
        lengths, strides = (list(x[:axis]) + list(x[axis + 1 :]) for x in (self._lengths, self._strides))
        return EmittedTable(self._loops, pointer, lengths, strides)

    def behind(self, k: Scalar, axis: int = 0) -> EmittedTable:
        """Return the table from a place of an axis on."""
        loops = self._loops
        pointer = self._address((*[0] * axis, k, *[0] * (len(self._lengths) - axis - 1)))
        length = loops._name(f"sub i64 {self._lengths[axis]}, {loops._text(k, 'i64')}")  # noqa: SLF001
        return EmittedTable(loops, pointer, [*self._lengths[:axis], length, *self._lengths[axis + 1 :]], self._strides)

    def shaped(self, *lengths: Scalar) -> EmittedTable:
        """Return the first numbers of a whole table as one of other lengths."""
        loops = self._loops
        return EmittedTable(loops, self._pointer, [loops._text(x, "i64") for x in lengths])  # noqa: SLF001

    def __getitem__(self, key: Scalar) -> Scalar:
        """Return an element, or elements side by side."""
        return self._loops._loaded(self._address(key), vector=self._is_vector(key))  # noqa: SLF001

    def __setitem__(self, key: Scalar, value: Scalar) -> None:
        """Write an element, or elements side by side."""
        self._loops._store(value, self._address(key), vector=self._is_vector(key))  # noqa: SLF001

    def _is_vector(self, key: Scalar) -> bool:
        """Whether an index stands for elements side by side."""
        loops = self._loops
        lanes = [loops._kind(x) == _LANES for x in (key if isinstance(key, tuple) else (key,))]  # noqa: SLF001
        if any(lanes[:-1]) or (lanes[-1] and self._strides[-1] != "1"):
            raise _NotSideBySideError
        return lanes[-1]

    def _address(self, key: Scalar) -> str:
        loops = self._loops
        keys = [loops._values[loops.node(x)] for x in (key if isinstance(key, tuple) else (key,))]  # noqa: SLF001
        indices = [x.text if x.kind == _LANES else loops._as(x, "i64") for x in keys]  # noqa: SLF001
        place = "0"
        for index, stride in zip(indices, self._strides, strict=True):
            if index != "0":
                further = loops._product(index, stride)  # noqa: SLF001
                place = further if place == "0" else loops._name(f"add i64 {place}, {further}")  # noqa: SLF001
        return loops._name(f"getelementptr double, ptr {self._pointer}, i64 {place}")  # noqa: SLF001
