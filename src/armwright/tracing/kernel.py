"""Compiled kernels: called with arrays, for one configuration or for many."""

import ctypes
import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache, cached_property, reduce
from inspect import Parameter, Signature
from itertools import combinations, pairwise
from operator import or_
from typing import Any, Literal, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import LARGEST, LARGEST_ANGLE, Array, ArrayLike, cores, floats, leading_axes
from armwright.errors import InvalidValueError, ShapeError, shown
from armwright.tracing.door import ROWS_BETWEEN_SIGNALS, Door, Origin, Passed
from armwright.tracing.emit import Emitted, Shape
from armwright.tracing.emit_llvm import MEANINGLESS, UNUSUAL
from armwright.tracing.native import function_address, processor

# Rows are given to threads in multiples of this, so that every one but the last works on whole vectors.
LANES = 16

# One number, which is 0 until work in progress is to end without a result.
CalledOff: TypeAlias = npt.NDArray[np.int64]

# Below this many rows a second thread costs more than it saves.
_ROWS_PER_THREAD = 4096


@attrs.frozen(kw_only=True, eq=False, slots=False)
class Kernel:
    """An equation, compiled: the part for one configuration and the part for many, each when it is first needed.

    Attributes:
        emitted: its code, and the shapes of its inputs and outputs.
        raise_for_invalid: raises the error that belongs to inputs for which the conditions of the equation do not hold.
        remark: called with inputs that are unusual, and with how many calls up from it the caller stands.
        quickly: whether it is compiled with the least effort: see ``native.function_address``.
    """

    emitted: Emitted
    raise_for_invalid: Callable[..., object] | None = None
    remark: Callable[[Sequence[Array], int], object] | None = None
    quickly: bool = False

    @cached_property
    def single(self) -> Callable[..., int]:
        """The function of one configuration, for calls from loops that Numba compiles.

        It takes the arrays of inputs and outputs, and returns a status: see ``Emitted``.
        """
        from armwright.tracing.from_numba import callable_from_numba  # noqa: PLC0415 - Numba takes half a second

        return callable_from_numba(self._address("single"), *self._passed)

    def function(self, name: str, doc: str = "", origin: Origin | None = None) -> Callable[..., Any]:
        """Return the function that evaluates the equation for one configuration or many.

        It takes one array (..., *shape) per input, leading axes are broadcast; by name only, ``threads``, how many
        cores to use, all there are when left out, on which the bits do not depend; and ``out``, an array to fill, or
        a tuple of them for several outputs. It returns an array (..., *shape), or a tuple of them. It raises

        - ShapeError: a last axis, or the leading axes do not fit, or ``out`` does not.
        - InvalidValueError: a number is NaN, infinite or beyond 1e100, an angle is beyond 1e12, or there are fewer than
          one ``threads``.
        - another ArmwrightError: a condition of the equation does not hold.

        Args:
            name: what to call it.
            doc: its docstring.
            origin: makes an object that has the function as its method, where it is unpickled.
        """
        inputs, signature = self.emitted.inputs, self.signature

        def careful(*arguments: Any, **named: Any) -> Any:
            given = signature.bind(*arguments, **named).arguments
            return self._careful([given[one] for one in inputs], given.get("threads"), given.get("out"))

        careful.__name__, careful.__qualname__, careful.__doc__ = name, name, doc
        careful.__signature__ = signature  # type: ignore[attr-defined]
        return self._door.open(name, f"{name}{signature}\n--\n\n{doc}", careful, origin)

    @cached_property
    def signature(self) -> Signature:
        """What the function takes."""
        by_name = [Parameter(one, Parameter.KEYWORD_ONLY, default=None) for one in ("threads", "out")]
        return Signature([*(Parameter(one, Parameter.POSITIONAL_OR_KEYWORD) for one in self.emitted.inputs), *by_name])

    @cached_property
    def _passed(self) -> tuple[list[Passed], list[Passed]]:
        """The arrays that are read, and those that are written."""
        flags, outputs = self.emitted.flags, enumerate(self.emitted.outputs)
        inputs = [Passed(shape, float) for shape in self.emitted.inputs.values()]
        return inputs, [Passed(shape, bool if i in flags else float) for i, shape in outputs]

    @cached_property
    def _door(self) -> Door:
        return Door(*self._passed, 2 * _ROWS_PER_THREAD)

    def _address(self, part: Literal["single", "rows"]) -> int:
        """Return the address of a function, which is compiled when it is first asked for."""
        emitted = self.emitted
        ir = emitted.single_ir if part == "single" else emitted.rows_ir
        address = function_address(lambda: ir(processor().target), part, emitted.origin, quickly=self.quickly)
        self._door.connect(part, address)
        return address

    @cached_property
    def _single(self) -> Callable[[Any], int]:
        return _SINGLE(self._address("single"))

    @cached_property
    def _rows(self) -> Callable[[int, int, Any], int]:
        return _ROWS(self._address("rows"))

    def __call__(self, *inputs: ArrayLike, threads: int | None = None, out: Any = None) -> Any:
        """Evaluate the equation: see ``function``."""
        return self._careful(inputs, threads, out)

    def _careful(self, inputs: Sequence[ArrayLike], threads: int | None, out: Any) -> Any:
        """Check everything, evaluate, and find out what is wrong where something is."""
        arrays, lead, results = self.prepared(inputs, threads, out)
        self.judge(arrays, self._run(arrays, lead, results, threads), 3)
        return results[0] if len(results) == 1 else tuple(results)

    def prepared(
        self, inputs: Sequence[ArrayLike], threads: int | None, out: Any
    ) -> tuple[list[Array], Shape, list[Array]]:
        """Check what a call is given.

        Returns:
            The inputs as float64, their leading axes, and the arrays to fill.
        """
        if threads is not None and not (_is_integer(threads) and threads > 0):
            raise InvalidValueError(f"threads: expected an integer above 0, or None for all cores, got {threads!r}")
        arrays, lead = self._checked(inputs)
        results = self._results(lead, out)
        if out is not None and any(np.may_share_memory(x, y) for x in arrays for y in results):
            arrays = [x.copy() for x in arrays]
        return arrays, lead, results

    def judge(self, arrays: Sequence[Array], status: int, callers: int) -> None:
        """Raise the error or issue the warning that belongs to the status of inputs, if any.

        Args:
            arrays: the inputs.
            status: of all their rows.
            callers: how many calls up from here the caller stands.
        """
        if status & MEANINGLESS:
            for name, array in zip(self.emitted.inputs, arrays, strict=True):
                floats(array, name, LARGEST_ANGLE if name in self.emitted.angles else LARGEST)
            # Many inputs just below what is allowed are suspected without reason.
            if self.raise_for_invalid is not None:
                self.raise_for_invalid(*arrays)
        if status & UNUSUAL and self.remark is not None:
            self.remark(arrays, callers)

    def _checked(self, inputs: Sequence[ArrayLike]) -> tuple[list[Array], Shape]:
        """Return the inputs as float64, without a copy where they are already, and their leading axes."""
        title, shapes = self.emitted.title, self.emitted.inputs
        if len(inputs) != len(shapes):
            raise ShapeError(f"{title}: expected {len(shapes)} arrays ({', '.join(shapes)}), got {len(inputs)}")
        arrays = [_input(x, shape, name) for x, (name, shape) in zip(inputs, shapes.items(), strict=True)]
        leads = [x.shape[: x.ndim - len(shape)] for x, shape in zip(arrays, shapes.values(), strict=True)]
        if leads.count(leads[0]) == len(leads):
            return arrays, leads[0]
        return arrays, leading_axes(title, arrays, leads)

    def _results(self, lead: Shape, out: Any) -> list[Array]:
        """Return the arrays to fill: new ones, or the caller's where they are fit for it."""
        _, outputs = self._passed
        if out is None:
            return [np.empty((*lead, *shape), kind) for shape, kind in outputs]
        to_fill = list(out) if isinstance(out, tuple) else [out]
        expected = [((*lead, *shape), np.dtype(kind)) for shape, kind in outputs]
        fit = [isinstance(x, np.ndarray) and x.flags.carray and not np.ma.isMaskedArray(x) for x in to_fill]
        if not all(fit) or [(x.shape, x.dtype) for x in to_fill] != expected:
            needed = ", ".join(f"{shape} {kind}" for shape, kind in expected)
            got = ", ".join(map(_described, to_fill)) or "none"
            raise ShapeError(f"out: expected writable arrays in C order, {needed}; got {got}")
        if any(np.may_share_memory(x, y) for x, y in combinations(to_fill, 2)):
            raise ShapeError("out: expected arrays apart from each other, got some that share memory")
        return to_fill

    def _run(self, arrays: list[Array], lead: Shape, results: list[Array], threads: int | None) -> int:
        if not lead:
            return self._single(_addresses([*map(_plain, arrays), *results]))
        rows = math.prod(lead)
        shapes = self.emitted.inputs.values()
        flat = [_rows(x, lead, shape) for x, shape in zip(arrays, shapes, strict=True)]
        flat += results if len(lead) == 1 else [x.reshape(rows, *x.shape[len(lead) :]) for x in results]
        addresses, run, called_off = _addresses(flat), self._rows, list[bool]()

        def work(first: int, last: int) -> int:
            status = 0
            for start in range(first, last, ROWS_BETWEEN_SIGNALS):
                if not called_off:
                    status |= run(start, min(start + ROWS_BETWEEN_SIGNALS, last), addresses)
            return status

        parts = _parts(rows, threads, max(rows // _ROWS_PER_THREAD, 1))
        if len(parts) == 1:
            return work(0, rows)
        jobs: list[Future[int]] = []
        try:
            for first, last in parts:
                jobs.append(_pool().submit(work, first, last))
            return reduce(or_, (job.result() for job in jobs))
        except BaseException as error:
            # Nothing is written to the caller's arrays after a signal has ended the call.
            called_off.append(True)
            wait(jobs)
            if not isinstance(error, RuntimeError):
                raise
        # The system gives no more threads, or the process is about to end.
        return self._run(arrays, lead, results, 1)


# The functions of a kernel; what they are given is let go of by the interpreter meanwhile.
_SINGLE = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)
_ROWS = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p)


def _addresses(arrays: Sequence[Array]) -> Any:
    """Return the addresses of arrays, as a kernel takes them; they keep the arrays."""
    addresses: Any = (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
    # Nothing else keeps a copy that is made for a call.
    addresses.arrays = arrays
    return addresses


def _is_integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _described(value: object) -> str:
    """Say of what was given to be filled what matters of it."""
    if not isinstance(value, np.ndarray):
        return shown(value)
    flags = value.flags
    words = {
        "read-only": not flags.writeable,
        "not in C order": not flags.c_contiguous,
        "not aligned": not flags.aligned,
        "masked": np.ma.isMaskedArray(value),
    }
    return " ".join([f"{value.shape} {value.dtype}", *(word for word, holds in words.items() if holds)])


def _plain(array: Array) -> Array:
    """Return ``array`` in C order and aligned, as a kernel reads it, without a copy where it is already."""
    return np.require(array, requirements=("C", "A"))


def _input(value: ArrayLike, shape: Shape, name: str) -> Array:
    """Return ``value`` as float64, without a copy where it is already."""
    array = value if type(value) is np.ndarray and value.dtype == np.float64 else floats(value, name)
    if array.shape[max(array.ndim - len(shape), 0) :] != shape:
        raise ShapeError(f"{name}: expected shape {shape} on the last axes, got shape {array.shape}")
    return array


def _rows(array: Array, lead: Shape, shape: Shape) -> Array:
    """Return ``array``, broadcast to leading axes, as rows; a copy only where it is broadcast or scattered."""
    if array.shape != (*lead, *shape):
        array = np.broadcast_to(array, (*lead, *shape))
    if len(lead) > 1:
        array = array.reshape(-1, *shape)
    return _plain(array)


def on_cores_for_long(work: Callable[[int, int, CalledOff], object], rows: int, threads: int | None) -> None:
    """Do parts of many rows whose work takes long, so that a signal is heard meanwhile: it is waited for, not done.

    Args:
        work: does rows ``first`` to ``last`` without holding the interpreter, and checks now and then whether it is
            called off.
        rows: how many there are.
        threads: how many cores to use; all when None.
    """
    called_off = np.zeros(1, dtype=np.int64)
    jobs = [_pool().submit(work, first, last, called_off) for first, last in _parts(rows, threads, rows)]
    try:
        for job in jobs:
            job.result()
    except BaseException:
        called_off[0] = 1
        wait(jobs)
        raise


def _parts(rows: int, threads: int | None, max_count: int) -> list[tuple[int, int]]:
    """Cut rows into parts for the cores between blocks of lanes: where each begins and ends."""
    blocks = -(-rows // LANES)
    count = max(1, min(cores() if threads is None else threads, blocks, max_count))
    return list(pairwise(min(round(blocks * i / count) * LANES, rows) for i in range(count + 1)))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=os.cpu_count())


# A process that is forked has none of the threads of its parent.
os.register_at_fork(after_in_child=_pool.cache_clear)
