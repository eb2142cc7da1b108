"""Routines: loops over tables of numbers, written once and run by NumPy or compiled.

An equation of one row needs nothing of other rows. Where each row needs what came of the one before it, or the largest
of all, a routine says so with ``Loops``: a loop over indices whose steps stand for themselves, ``each`` and the largest
and least, is a call of NumPy for all of them, and one number after the other in machine code. One whose steps follow
each other, ``walk`` and ``until``, is a loop of Python over floats, and the same in machine code.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from armwright.arrays import Array, Flags
from armwright.tracing.door import RoutineDoor, layout_is_known
from armwright.tracing.emit_loops import EmittedLoops
from armwright.tracing.native import function_address
from armwright.tracing.scalar import Scalar

# A table has a ``shape``, and its numbers are read and written by index, a tuple of them where it has two axes. Within
# ``walk`` tables of two axes are read row by row, ``table.row(i)[k]``.
Table: TypeAlias = Any
# Takes loops, the tables to read, and the tables to write.
Routine: TypeAlias = Callable[..., None]

# Two axes of loops at most stand for themselves.
_AXES = 2


class Loops(Protocol):
    """Loops over indices from 0. Scalars are compared and chosen between as in equations of rows."""

    def each(self, sizes: Sequence[Scalar], body: Callable[..., Sequence[Scalar]], count: int = 1) -> list[Table]:
        """Return ``count`` new tables of what a body returns for each tuple of indices; not within a loop."""

    def fill(self, tables: Sequence[Table], sizes: Sequence[Scalar], body: Callable[..., Sequence[Scalar]]) -> None:
        """Write into tables what a body returns for each tuple of indices; not within a loop."""

    def table(self, *sizes: Scalar) -> Table:
        """Return a new table of so many numbers along each axis; not within a loop."""

    def walk(
        self, size: Scalar, carry: Sequence[Scalar], step: Callable[..., Sequence[Scalar]], *, reverse: bool = False
    ) -> tuple[Scalar, ...]:
        """Apply a step to one index after the other; it takes the index and what was carried, and returns the new."""

    def until(
        self, most: int, carry: Sequence[Scalar], step: Callable[..., tuple[Scalar, Sequence[Scalar]]]
    ) -> tuple[Scalar, ...]:
        """Apply a step until it is done; it takes what was carried, and returns whether it is and what is new."""

    def when(
        self, condition: Scalar, then: Callable[[], Sequence[Scalar]], otherwise: Callable[[], Sequence[Scalar]]
    ) -> tuple[Scalar, ...]:
        """Return what one of two functions returns; only that one runs. Within ``walk`` and ``until`` only."""

    def largest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the largest of what a body returns for the indices; some there must be."""

    def least(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> Scalar:
        """Return the least of what a body returns for the indices; some there must be."""

    def first_largest(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
        """Return the largest of what a body returns, and the first index for which it does; within ``walk`` only."""

    def first_least(self, size: Scalar, body: Callable[[Scalar], Scalar]) -> tuple[Scalar, Scalar]:
        """Return the least of what a body returns, and the first index for which it does; within ``walk`` only."""


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
        routine(_PlainLoops(), *map(_PlainTable, inputs), *results)
    return [x.array for x in results]


def compiled(routine: Routine, inputs: Sequence[Array], *shapes: tuple[int, ...]) -> list[Array]:
    """Run a routine as machine code, which is compiled when it is first needed: see ``Runner``.

    Raises:
        MemoryError: there is not enough for the tables of the routine.
    """
    results = list(map(np.empty, shapes))
    function = _FUNCTIONS.get(routine)
    if function is None:
        axes = tuple(np.ndim(x) for x in (*inputs, *results))
        function = _FUNCTIONS[routine] = _function(routine, axes)
    function(*inputs, *results)
    return results


_FUNCTIONS: dict[Routine, Callable[..., None]] = {}


def _function(routine: Routine, axes: tuple[int, ...]) -> Callable[..., None]:
    """Return the compiled function of a routine, of arrays that have so many axes each."""
    door = RoutineDoor(axes)
    module, name = routine.__module__, routine.__qualname__
    known = name.isidentifier() and module.startswith("armwright.")
    origin = f"routine {module} {name} {axes}" if known else ""

    def ir() -> str:
        return EmittedLoops().module(routine, axes) + door.ir()

    if not layout_is_known():
        return partial(_by_addresses, function_address(ir, "routine", origin))

    def careful(*arrays: Array) -> None:
        converted = [np.ascontiguousarray(x, dtype=np.float64) for x in arrays]
        if tuple(x.ndim for x in converted) != axes:
            raise TypeError(f"{name}: expected arrays with {axes} axes")
        if all(x is y for x, y in zip(arrays, converted, strict=True)):
            raise MemoryError(f"{name}: not enough memory")
        function(*converted)

    function = door.open(name, function_address(ir, "call", origin), careful)
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


class _Index(NamedTuple):
    """All indices of a loop at once, so many along an axis."""

    axis: int
    size: int


class _PlainTable:
    """A table as an array; as a list while single numbers or rows are read or written."""

    def __init__(self, array: Array) -> None:
        self.shape = array.shape
        self._array: Array | None = array
        self._items: list[Any] | None = None

    @property
    def array(self) -> Array:
        if self._array is None:
            self._array = np.array(self._items)
        return self._array

    def row(self, i: int) -> Array:
        if self._items is None:
            self._items = list(self.array)
        row: Array = self._items[i]
        return row

    def __getitem__(self, key: Any) -> Scalar:
        if type(key) is int:
            if self._items is None:
                self._items = self.array.tolist()
            return self._items[key]
        if type(key) is slice:
            return self.array[key]
        # A whole number takes one of the last axis.
        indices = (key,) if type(key) is _Index else key
        lengths = [1] * _AXES
        for index in indices:
            if type(index) is _Index:
                lengths[index.axis] = index.size
        places = tuple(slice(index.size) if type(index) is _Index else index for index in indices)
        return self.array[places].reshape(lengths)

    def __setitem__(self, key: int, value: float) -> None:
        if self._items is None:
            self._items = self.array.tolist()
        self._items[key], self._array = value, None


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
        self._axis = len(sizes)
        values = body(*map(_Index, range(len(sizes)), sizes))
        self._axis = 0
        for table, x in zip(tables, values, strict=True):
            # Axes of reductions are left over.
            table.array[tuple(map(slice, sizes))] = x if len(sizes) == _AXES else x[(..., *[0] * (_AXES - len(sizes)))]

    def table(self, *sizes: int) -> _PlainTable:
        return _PlainTable(np.zeros(sizes))

    def walk(
        self, size: int, carry: Sequence[Scalar], step: Callable[..., Sequence[Scalar]], *, reverse: bool = False
    ) -> tuple[Scalar, ...]:
        for i in reversed(range(size)) if reverse else range(size):
            carry = step(i, *carry)
        return tuple(carry)

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
        return self._reduced(np.maximum.reduce, size, body)

    def least(self, size: int, body: Callable[[Any], Scalar]) -> Scalar:
        return self._reduced(np.minimum.reduce, size, body)

    def first_largest(self, size: int, body: Callable[[Any], Scalar]) -> tuple[float, int]:
        values = body(slice(size))
        at = values.argmax()
        return values.item(at), at

    def first_least(self, size: int, body: Callable[[Any], Scalar]) -> tuple[float, int]:
        values = body(slice(size))
        at = values.argmin()
        return values.item(at), at

    def _reduced(self, reduce: Callable[..., Any], size: int, body: Callable[[Any], Scalar]) -> Scalar:
        axis = self._axis
        if not axis:
            return float(reduce(body(slice(size))))
        self._axis += 1
        values = body(_Index(axis, size))
        self._axis = axis
        return reduce(values, axis=axis, keepdims=True)
