"""Routines: loops over tables of numbers, written once and run by NumPy or compiled.

An equation of one row needs nothing of other rows. Where each row needs what came of the one before it, or the largest
of all, a routine says so with ``Loops``: a loop over indices whose steps stand for themselves, ``each`` and the largest
and least, is a call of NumPy for all of them, and one number after the other in machine code. One whose steps follow
each other, ``walk`` and ``until``, is a loop of Python over floats, and the same in machine code.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol, TypeAlias

import numpy as np

from armwright.arrays import Array, Flags
from armwright.tracing.door import RoutineDoor, layout_is_known
from armwright.tracing.native import function_address, processor
from armwright.tracing.scalar import Scalar

# A table has a ``shape``, and its numbers are read and written by index, a tuple of them where it has several axes.
# ``table.part(axis, k)`` is the table without an axis, at its place k, and ``table.behind(k, axis)`` that from k on.
# ``table.shaped(...)`` has its first numbers, in C order, as a table of other lengths, where it is no such part.
# Within ``walk`` tables of two axes are read row by row, ``table.row(i)[k]``.
Table: TypeAlias = Any
# Takes loops, the tables to read, and the tables to write.
Routine: TypeAlias = Callable[..., None]

# Three axes of loops at most stand for themselves.
_AXES = 3


class Loops(Protocol):
    """Loops over indices from 0. Scalars are compared and chosen between as in equations of rows."""

    def each(self, sizes: Sequence[Scalar], body: Callable[..., Sequence[Scalar]], count: int = 1) -> list[Table]:
        """Return ``count`` new tables of what a body returns for each tuple of indices; not within a loop."""

    def fill(self, tables: Sequence[Table], sizes: Sequence[Scalar], body: Callable[..., Sequence[Scalar]]) -> None:
        """Write into tables what a body returns for each tuple of indices; not within a loop.

        The body may read the tables at its own indices only: which of the others are written before is not defined.
        """

    def table(self, *sizes: Scalar) -> Table:
        """Return a new table of so many numbers along each axis; not within a loop."""

    def sums(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Table:
        """Return a new table of the sums of what a body returns for the indices before each, from 0 to all of them."""

    def highest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Table:
        """Return a new table of the largest of what a body returns for the indices up to each."""

    def merged(self, first: Table, second: Table) -> Table:
        """Return a new table of the numbers of two tables in order; both are so but for rounding."""

    def kept(self, sizes: Sequence[Scalar], body: Callable[..., Scalar]) -> tuple[list[Table], Scalar]:
        """Return new tables of the indices, one per axis, for which a condition holds, and how many there are."""

    def whole(self, x: Scalar) -> Scalar:
        """Return a number without a fraction as an index."""

    def number(self, i: Scalar) -> Scalar:
        """Return an index as a number."""

    def segment(self, starts: Table, x: Scalar, count: Scalar) -> Scalar:
        """Return which of ``count`` segments, by their starts, a number is in; at a start the next."""

    def walk(
        self, size: Scalar, carry: Sequence[Scalar], step: Callable[..., Sequence[Scalar]], *, reverse: bool = False
    ) -> tuple[Scalar, ...]:
        """Apply a step to one index after the other; it takes the index and what was carried, and returns the new."""

    def follow(
        self,
        sizes: Sequence[Scalar],
        start: Callable[[Scalar], Scalar],
        step: Callable[[Scalar, Scalar, Scalar], Scalar],
        *,
        reverse: bool = False,
    ) -> Table:
        """Return a new table of two axes whose rows follow each other, each column by itself; not within a loop.

        A step takes the row, the column, and the number of the row before, and returns the new one; before the first
        row there are the numbers that ``start`` returns for the columns.
        """

    def until(
        self, most: int, carry: Sequence[Scalar], step: Callable[..., tuple[Scalar, Sequence[Scalar]]]
    ) -> tuple[Scalar, ...]:
        """Apply a step until it is done; it takes what was carried, and returns whether it is and what is new."""

    def when(
        self, condition: Scalar, then: Callable[[], Sequence[Scalar]], otherwise: Callable[[], Sequence[Scalar]]
    ) -> tuple[Scalar, ...]:
        """Return what one of two functions returns; only that one runs. Within ``walk`` and ``until`` only."""

    def largest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the largest of what a body returns for the indices; minus infinity of none."""

    def least(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the least of what a body returns for the indices; infinity of none."""

    def total(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the sum of what a body returns for the indices."""

    def first_largest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
        """Return the largest of what a body returns, and the first index for which it does."""

    def first_least(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
        """Return the least of what a body returns, and the first index for which it does."""


class Runner(Protocol):
    """What runs routines."""

    def __call__(self, routine: Routine, inputs: Sequence[Array], *shapes: tuple[int, ...]) -> list[Array]:
        """Return the tables of some shapes that a routine writes, from the arrays that it reads.

        A routine is a function of a module, which all arrays of one place have the same number of axes for.
        """


def with_numpy(routine: Routine, inputs: Sequence[Array], *shapes: tuple[int, ...]) -> list[Array]:
    """Run a routine with NumPy: see ``Runner``."""
    results = [_PlainTable(np.zeros(shape)) for shape in shapes]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        routine(_PlainLoops(), *(_PlainTable(np.asarray(x, dtype=np.float64)) for x in inputs), *results)
    return [x.array for x in results]


class _Compiled:
    """Runs routines as machine code, which is compiled when it is first needed: see ``Runner``."""

    def __init__(self, *, quickly: bool) -> None:
        """Begin without functions.

        Args:
            quickly: whether they are compiled with the least effort: see ``native.function_address``.
        """
        self._quickly = quickly
        self._functions: dict[Routine, Callable[..., None]] = {}

    def __call__(self, routine: Routine, inputs: Sequence[Array], *shapes: tuple[int, ...]) -> list[Array]:
        """Run a routine.

        Raises:
            MemoryError: there is not enough for the tables of the routine.
        """
        results = list(map(np.empty, shapes))
        function = self._functions.get(routine)
        if function is None:
            axes = tuple(np.ndim(x) for x in (*inputs, *results))
            function = self._functions[routine] = _function(routine, axes, quickly=self._quickly)
        function(*inputs, *results)
        return results


compiled: Runner = _Compiled(quickly=False)
compiled_quickly: Runner = _Compiled(quickly=True)


def _function(routine: Routine, axes: tuple[int, ...], *, quickly: bool) -> Callable[..., None]:
    """Return the compiled function of a routine, of arrays that have so many axes each."""
    door = RoutineDoor(axes)
    module, name = routine.__module__, routine.__qualname__
    known = name.isidentifier() and module.startswith("armwright.")
    origin = f"routine {module} {name} {axes}" if known else ""

    def ir() -> str:
        from armwright.tracing.emit_loops import EmittedLoops  # noqa: PLC0415 - not needed by later processes

        return EmittedLoops(processor().target.lanes).module(routine, axes) + door.ir()

    if not layout_is_known():
        return partial(_by_addresses, function_address(ir, "routine", origin, quickly=quickly))

    function: Callable[..., None]

    def careful(*arrays: Array) -> None:
        converted = [np.ascontiguousarray(x, dtype=np.float64) for x in arrays]
        if tuple(x.ndim for x in converted) != axes:
            raise TypeError(f"{name}: expected arrays with {axes} axes")
        if all(x is y for x, y in zip(arrays, converted, strict=True)):
            raise MemoryError(f"{name}: not enough memory")
        function(*converted)

    function = door.open(name, function_address(ir, "call", origin, quickly=quickly), careful)
    return function


def _by_addresses(address: int, *arrays: Array) -> None:
    """Call a routine where it is not known how objects lie in memory."""
    plain = [np.ascontiguousarray(x, dtype=np.float64) for x in arrays]
    lengths = [length for x in plain for length in x.shape]
    function = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 4)(address)
    addresses = (ctypes.c_void_p * len(plain))(*(x.ctypes.data for x in plain))
    memory = (ctypes.cast(getattr(ctypes.pythonapi, x), ctypes.c_void_p) for x in ("PyMem_RawMalloc", "PyMem_RawFree"))
    if function(addresses, (ctypes.c_int64 * len(lengths))(*lengths), *memory):
        raise MemoryError("not enough memory for a routine")


class _Index:
    """All indices of a loop at once, so many along an axis, from some number on."""

    __slots__ = ("axis", "places", "size", "start")

    def __init__(self, axis: int, size: int, start: int = 0) -> None:
        self.axis, self.size, self.start, self.places = axis, size, start, slice(start, start + size)

    def __add__(self, by: int) -> _Index:
        return _Index(self.axis, self.size, self.start + by)

    def __sub__(self, by: int) -> _Index:
        return _Index(self.axis, self.size, self.start - by)

    @property
    def numbers(self) -> Any:
        lengths = [1] * _AXES
        lengths[self.axis] = self.size
        return np.arange(self.start, self.start + self.size).reshape(lengths)


class _PlainTable:
    """A table as an array; as a list while single numbers or rows are read or written."""

    def __init__(self, array: Any) -> None:
        self.shape = array.shape
        self._array = array
        self._items: list[Any] | None = None
        self._changed = False

    @property
    def array(self) -> Any:
        if self._changed:
            self._array[...] = self._items
            self._items, self._changed = None, False
        return self._array

    def row(self, i: int) -> Array:
        if self._items is None:
            self._items = list(self.array)
        row: Array = self._items[i]
        return row

    def part(self, axis: int, k: int) -> _PlainTable:
        return _PlainTable(self.array[(*[slice(None)] * axis, k)])

    def behind(self, k: int, axis: int = 0) -> _PlainTable:
        return _PlainTable(self.array[(*[slice(None)] * axis, slice(k, None))])

    def shaped(self, *lengths: int) -> _PlainTable:
        return _PlainTable(self.array.reshape(-1)[: math.prod(lengths)].reshape(lengths))

    def forget(self) -> None:
        """Take note that the array has been written to."""
        self._items = None

    def __getitem__(self, key: Any) -> Scalar:
        if type(key) is int:
            if self._items is None:
                self._items = self.array.tolist()
            return self._items[key]
        if type(key) is slice:
            return self.array[key]
        lengths, places, axes = [1] * _AXES, [], list[int]()
        for index in key if type(key) is tuple else (key,):
            kind = type(index)
            if kind is _Index:
                lengths[index.axis] = index.size
                axes.append(index.axis)
                places.append(index.places)
            elif kind is np.ndarray:
                return self._gathered(key if type(key) is tuple else (key,))
            elif kind is slice:
                return self.array[key]
            else:
                places.append(index)
        values = self.array[tuple(places)]
        # An inner loop may run over an axis of the table before that of an outer one.
        in_order = sorted(axes)
        return (values if axes == in_order else values.transpose([axes.index(k) for k in in_order])).reshape(lengths)

    def _gathered(self, key: tuple[Any, ...]) -> Any:
        """Return the elements at places that differ from index to index."""
        return self.array[tuple(index.numbers if type(index) is _Index else index for index in key)]

    def __setitem__(self, key: int, value: float) -> None:
        if self._items is None:
            self._items = self.array.tolist()
        self._items[key], self._changed = value, True


def _where(condition: Flags, then: Sequence[Scalar], otherwise: Sequence[Scalar]) -> list[Scalar]:
    return [np.where(condition, x, y) for x, y in zip(then, otherwise, strict=True)]


class _PlainLoops:
    """See ``Loops``: what stands for itself is an axis of arrays."""

    def __init__(self) -> None:
        self._axis = 0

    def each(self, sizes: Sequence[int], body: Callable[..., Sequence[Scalar]], count: int = 1) -> list[_PlainTable]:
        tables = [_PlainTable(np.zeros(sizes)) for _ in range(count)]
        self.fill(tables, sizes, body)
        return tables

    def fill(self, tables: Sequence[_PlainTable], sizes: Sequence[int], body: Callable[..., Sequence[Scalar]]) -> None:
        if not all(sizes):
            return
        self._axis = len(sizes)
        values = body(*map(_Index, range(len(sizes)), sizes))
        self._axis = 0
        for table, x in zip(tables, values, strict=True):
            # Axes of reductions are left over.
            there = np.ndim(x) and len(sizes) < _AXES
            table.array[tuple(map(slice, sizes))] = x[(..., *[0] * (_AXES - len(sizes)))] if there else x
            table.forget()

    def table(self, *sizes: int) -> _PlainTable:
        return _PlainTable(np.zeros(sizes))

    def sums(self, size: int, body: Callable[[Any], Scalar]) -> _PlainTable:
        sums = np.zeros(size + 1)
        np.cumsum(self._of_all(size, body), out=sums[1:])
        return _PlainTable(sums)

    def highest(self, size: int, body: Callable[[Any], Scalar]) -> _PlainTable:
        return _PlainTable(np.maximum.accumulate(self._of_all(size, body)))

    def merged(self, first: _PlainTable, second: _PlainTable) -> _PlainTable:
        return _PlainTable(np.sort(np.concatenate([first.array, second.array])))

    def kept(self, sizes: Sequence[int], body: Callable[..., Scalar]) -> tuple[list[_PlainTable], int]:
        (held,) = self.each(sizes, lambda *indices: [body(*indices)])
        kept = held.array.nonzero()
        return [_PlainTable(x) for x in kept], len(kept[0])

    def whole(self, x: Scalar) -> Scalar:
        return x.astype(np.intp) if isinstance(x, np.ndarray) else int(x)

    def number(self, i: Any) -> Scalar:
        return i.numbers if type(i) is _Index else i

    def segment(self, starts: _PlainTable, x: Scalar, count: int) -> Scalar:
        place = starts.array.searchsorted(x, side="right") - 1
        return np.minimum(np.maximum(place, 0), count - 1)

    def _of_all(self, size: int, body: Callable[[Any], Scalar]) -> Any:
        return np.broadcast_to(body(_Index(0, size)), (size, *[1] * (_AXES - 1))).reshape(size)

    def walk(
        self, size: int, carry: Sequence[Scalar], step: Callable[..., Sequence[Scalar]], *, reverse: bool = False
    ) -> tuple[Scalar, ...]:
        for i in reversed(range(size)) if reverse else range(size):
            carry = step(i, *carry)
        return tuple(carry)

    def follow(
        self,
        sizes: Sequence[int],
        start: Callable[[Any], Scalar],
        step: Callable[[int, Any, Scalar], Scalar],
        *,
        reverse: bool = False,
    ) -> _PlainTable:
        rows, columns = sizes
        table, j = np.zeros((rows, columns)), _Index(0, columns)
        value = start(j)
        for i in reversed(range(rows)) if reverse else range(rows):
            value = step(i, j, value)
            table[i] = value[:, 0, 0]
        return _PlainTable(table)

    def until(
        self, most: int, carry: Sequence[Scalar], step: Callable[..., tuple[Scalar, Sequence[Scalar]]]
    ) -> tuple[Scalar, ...]:
        finished: Any = None
        for _ in range(most):
            done, new = step(*carry)
            if isinstance(done, np.ndarray):
                # Of many at once each stays as it was when it was done.
                carry = new if finished is None else _where(finished, carry, new)
                finished = done if finished is None else finished | done
                done = finished.all()
            else:
                carry = new
            if done:
                break
        return tuple(carry)

    def when(
        self, condition: Scalar, then: Callable[[], Sequence[Scalar]], otherwise: Callable[[], Sequence[Scalar]]
    ) -> tuple[Scalar, ...]:
        return tuple(then() if condition else otherwise())

    def largest(self, size: int, body: Callable[[Any], Scalar]) -> Scalar:
        return self._reduced(partial(np.maximum.reduce, initial=-math.inf), size, body)

    def least(self, size: int, body: Callable[[Any], Scalar]) -> Scalar:
        return self._reduced(partial(np.minimum.reduce, initial=math.inf), size, body)

    def total(self, size: int, body: Callable[[Any], Scalar]) -> Scalar:
        return self._reduced(np.add.reduce, size, body)

    def first_largest(self, size: int, body: Callable[[Any], Scalar]) -> tuple[Scalar, Scalar]:
        if self._axis:
            values = self._of_inner(size, body)
            at = values.argmax(axis=self._axis, keepdims=True)
            return values.max(axis=self._axis, keepdims=True), at
        values = body(slice(size))
        first = values.argmax()
        return values.item(first), first

    def first_least(self, size: int, body: Callable[[Any], Scalar]) -> tuple[Scalar, Scalar]:
        if self._axis:
            values = self._of_inner(size, body)
            at = values.argmin(axis=self._axis, keepdims=True)
            return values.min(axis=self._axis, keepdims=True), at
        values = body(slice(size))
        first = values.argmin()
        return values.item(first), first

    def _of_inner(self, size: int, body: Callable[[Any], Scalar]) -> Any:
        """Return what a body returns for the indices of an inner loop, along the next axis."""
        axis = self._axis
        self._axis += 1
        values = body(_Index(axis, size))
        self._axis = axis
        return values

    def _reduced(self, reduce: Callable[..., Any], size: int, body: Callable[[Any], Scalar]) -> Scalar:
        if not self._axis:
            return float(reduce(body(slice(size))))
        return reduce(self._of_inner(size, body), axis=self._axis, keepdims=True)
