"""From a routine, see ``loops``, to LLVM IR: loops over numbers one by one, written as the routine runs.

Nothing is reordered or joined, so that a routine has the same bits as with NumPy but where sums are long. What it
takes of memory for its own tables is given back before it returns.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from armwright.tracing.graph import Traced
from armwright.tracing.scalar import Scalar, larger, select, smaller

_ON_NUMBERS = {
    "add": "fadd double {0}, {1}",
    "subtract": "fsub double {0}, {1}",
    "multiply": "fmul double {0}, {1}",
    "divide": "fdiv double {0}, {1}",
    "negate": "fneg double {0}",
    "less": "fcmp olt double {0}, {1}",
    "less_equal": "fcmp ole double {0}, {1}",
    "absolute": "call double @llvm.fabs.f64(double {0})",
    "sqrt": "call double @llvm.sqrt.f64(double {0})",
}
_ON_INTEGERS = {
    "add": "add i64 {0}, {1}",
    "subtract": "sub i64 {0}, {1}",
    "multiply": "mul i64 {0}, {1}",
    "less": "icmp slt i64 {0}, {1}",
    "less_equal": "icmp sle i64 {0}, {1}",
}
_TRUTHS = frozenset({"less", "less_equal"})
_DECLARED = (
    "declare double @llvm.fabs.f64(double)",
    "declare double @llvm.sqrt.f64(double)",
)


class _Value(NamedTuple):
    """A value of the code: its type, and what stands for it; a constant has its number."""

    kind: str
    text: str
    constant: float | None = None


class EmittedLoops:
    """The code of one function: the loops of a routine as it asks for them, see ``loops.Loops``."""

    def __init__(self) -> None:
        """Begin an empty function."""
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
            kind = self._common(values[1:])
            condition, (then, otherwise) = values[0], (self._as(x, kind) for x in values[1:])
            return self._let(kind, f"select i1 {self._as(condition, 'i1')}, {kind} {then}, {kind} {otherwise}")
        if op == "sqrt":
            x = Traced(self, operands[0])  # type: ignore[arg-type]
            operands = (select(x < 0.0, 0.0, x).node,)
            values = [self._values[operands[0]]]
        kind = self._common(values)
        kind = "double" if kind == "i64" and op not in _ON_INTEGERS else kind
        instruction = (_ON_INTEGERS if kind == "i64" else _ON_NUMBERS)[op]
        return self._let("i1" if op in _TRUTHS else kind, instruction.format(*(self._as(x, kind) for x in values)))

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
        computed = {x.kind for x in values if x.constant is None}
        return "double" if "double" in kinds else next(iter(computed or kinds))

    def _as(self, x: _Value, kind: str) -> str:
        """Return what stands for a value as one of a type."""
        if x.constant is not None:
            if kind == "double":
                return _constant(float(x.constant))
            return str(int(x.constant)) if kind == "i64" else str(bool(x.constant)).lower()
        if x.kind == kind:
            return x.text
        if x.kind == "i64" and kind == "double":
            return self._name(f"sitofp i64 {x.text} to double")
        raise TypeError(f"{x.kind} where {kind} is needed")

    def _text(self, x: Scalar, kind: str) -> str:
        return self._as(self._values[self.node(x)], kind)

    def _kind(self, x: Scalar) -> str:
        return self._values[self.node(x)].kind

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

        def step(i: Scalar) -> tuple[()]:
            self._fill(tables, sizes[1:], (*indices, i), body)
            return ()

        self.walk(sizes[0], (), step)

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
        return self._traced("i64", self._name(f"fptosi double {self._text(x, 'double')} to i64"))

    def number(self, i: Scalar) -> Scalar:
        """Return an index as a number."""
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
    ) -> tuple[Scalar, ...]:
        self._count += 1
        name = f"loop{self._count}"
        kinds = [self._kind(x) for x in carry]
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
        kinds = [self._kind(x) for x in first]
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
        return "\n".join([*_DECLARED, head, "entry:", *self._lines, *end, "  ret i64 %status0", "}", ""])


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
        """Return an element."""
        loops = self._loops
        return loops._traced("double", loops._name(f"load double, ptr {self._address(key)}"))  # noqa: SLF001

    def __setitem__(self, key: Scalar, value: Scalar) -> None:
        """Write an element."""
        loops = self._loops
        text = loops._text(value, "double")  # noqa: SLF001
        loops._lines.append(f"  store double {text}, ptr {self._address(key)}")  # noqa: SLF001

    def _address(self, key: Scalar) -> str:
        loops = self._loops
        indices = [loops._text(x, "i64") for x in (key if isinstance(key, tuple) else (key,))]  # noqa: SLF001
        place = "0"
        for index, stride in zip(indices, self._strides, strict=True):
            if index != "0":
                further = loops._product(index, stride)  # noqa: SLF001
                place = further if place == "0" else loops._name(f"add i64 {place}, {further}")  # noqa: SLF001
        return loops._name(f"getelementptr double, ptr {self._pointer}, i64 {place}")  # noqa: SLF001


def _constant(value: float) -> str:
    (bits,) = struct.unpack("<Q", struct.pack("<d", value))
    return f"0x{bits:016X}"
