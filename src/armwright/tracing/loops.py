"""Routines: loops over tables of numbers, written once and run by NumPy or compiled.

An equation of one row needs nothing of other rows. Where each row needs what came of the one before it, or the largest
of all, a routine says so with ``Loops``: a loop over indices whose steps stand for themselves, ``each`` and the largest
and least, is a call of NumPy for all of them, and one number after the other in machine code. One whose steps follow
each other, ``walk`` and ``until``, is a loop of Python over floats, and the same in machine code.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from armwright.arrays import Array, Flags
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

    def __call__(self, routine: Routine, inputs: Sequence[Array], shape: tuple[int, ...]) -> Array:
        """Return the table of a shape that a routine writes, from the arrays that it reads."""


def with_numpy(routine: Routine, inputs: Sequence[Array], shape: tuple[int, ...]) -> Array:
    """Run a routine with NumPy: see ``Runner``."""
    result = _PlainTable(np.zeros(shape))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        routine(_PlainLoops(), *map(_PlainTable, inputs), result)
    return result.array


def compiled(routine: Routine, inputs: Sequence[Array], shape: tuple[int, ...]) -> Array:
    """Run a routine as machine code, which is compiled when it is first needed: see ``Runner``."""
    result = np.empty(shape)
    arrays = [*(np.ascontiguousarray(x, dtype=np.float64) for x in inputs), result]
    lengths = [length for x in arrays for length in x.shape]
    function = _function(routine, *(x.ndim for x in arrays))
    addresses = (ctypes.c_void_p * len(arrays))(*(x.ctypes.data for x in arrays))
    function(addresses, (ctypes.c_int64 * len(lengths))(*lengths))
    return result


@cache
def _function(routine: Routine, *axes: int) -> Callable[..., None]:
    address = function_address(EmittedLoops().module(routine, axes), "routine")
    return ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(address)


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
