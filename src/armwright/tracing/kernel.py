"""Compiled kernels: made once per source, kept on disk, called with arrays."""

import contextlib
import fcntl
import hashlib
import importlib.util
import math
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, cached_property, partial
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.errors import ShapeError
from armwright.tracing.emit import LANES, Emitted, Shape
from armwright.version import __version__

# Below this many rows a second thread costs more than it saves.
_ROWS_PER_THREAD = 4096


@attrs.frozen(kw_only=True, eq=False, slots=False)
class Kernel:
    """An equation, compiled: the part for one configuration and the part for many, each when it is first needed.

    Attributes:
        emitted: its source, and the shapes of its inputs and outputs.
        explain: raises the error that belongs to inputs for which the conditions of the equation do not hold.
    """

    emitted: Emitted
    explain: Callable[..., object] | None = None

    @cached_property
    def one(self) -> Callable[..., int]:
        """The function of one configuration, for calls from other compiled code: see ``Emitted``."""
        return _module(self.emitted.one, self.emitted.title).one  # type: ignore[no-any-return]

    @cached_property
    def rows(self) -> Callable[..., int]:
        """The function of many configurations: see ``Emitted``."""
        return _module(self.emitted.rows, self.emitted.title).rows  # type: ignore[no-any-return]

    @cached_property
    def _axes(self) -> int:
        """Number of axes of one value of the first input."""
        return len(next(iter(self.emitted.inputs.values())))

    @cached_property
    def _single(self) -> bool:
        """Whether there is one output."""
        return len(self.emitted.outputs) == 1

    @cached_property
    def _straight(self) -> tuple[Callable[..., int], Callable[[], Array] | None]:
        """The function of one configuration, and what makes the array for its output; None for several outputs."""
        return self.one, partial(np.empty, *self._kinds[0]) if self._single else None

    @cached_property
    def _kinds(self) -> tuple[tuple[Shape, type], ...]:
        return tuple((s, bool if i in self.emitted.flags else float) for i, s in enumerate(self.emitted.outputs))

    def __call__(self, *inputs: ArrayLike, threads: int = 1, out: Any = None) -> Any:
        """Evaluate the equation for one configuration or many.

        Args:
            inputs: one array (..., *shape) per input; leading axes are broadcast.
            threads: how many cores to use; the bits do not depend on it.
            out: an array to fill and return, as returned otherwise; a tuple of them for several outputs.

        Returns:
            An array (..., *shape), or a tuple of them where the equation has several outputs.

        Raises:
            ShapeError: the number of inputs, a last axis, or the leading axes do not fit.
            InvalidValueError: a number is NaN or infinite.
            ArmwrightError: a condition of the equation does not hold; what kind, the equation says.
        """
        # One configuration as it should be, on the shortest way; what is not so is looked at below.
        try:
            if out is None and inputs[0].ndim == self._axes:  # type: ignore[union-attr]
                one, blank = self._straight
                if blank is None:
                    results = self._results((), None)
                    if not one(*inputs, *results):
                        return tuple(results)
                else:
                    result = blank()
                    if not one(*inputs, result):
                        return result
        except (AttributeError, IndexError, TypeError):
            pass
        arrays, lead = self._checked(inputs)
        results = self._results(lead, out)
        if self._run(arrays, lead, results, threads):
            for name, array in zip(self.emitted.inputs, arrays, strict=True):
                floats(array, name)
            # Inputs that add up to more than a float holds are suspected without reason.
            if self.explain is not None:
                self.explain(*arrays)
        return results[0] if self._single else tuple(results)

    def _checked(self, inputs: Sequence[ArrayLike]) -> tuple[list[Array], Shape]:
        """Return the inputs as float64, without a copy where they are already, and their leading axes."""
        title, shapes = self.emitted.title, self.emitted.inputs
        if len(inputs) != len(shapes):
            raise ShapeError(f"{title}: expected {len(shapes)} arrays ({', '.join(shapes)}), got {len(inputs)}")
        arrays = [_input(x, shape, name) for x, (name, shape) in zip(inputs, shapes.items(), strict=True)]
        leads = [x.shape[: x.ndim - len(shape)] for x, shape in zip(arrays, shapes.values(), strict=True)]
        try:
            return arrays, np.broadcast_shapes(*leads)
        except ValueError as error:
            got = ", ".join(str(array.shape) for array in arrays)
            raise ShapeError(f"{title}: leading axes must fit together, got {got}") from error

    def _results(self, lead: Shape, out: Any) -> list[Array]:
        """Return the arrays to fill: new ones, or the caller's where they are fit for it."""
        if out is None:
            return [np.empty((*lead, *shape), kind) for shape, kind in self._kinds]
        given = list(out) if isinstance(out, tuple) else [out]
        expected = [((*lead, *shape), np.dtype(kind)) for shape, kind in self._kinds]
        fit = [isinstance(x, np.ndarray) and x.flags.c_contiguous and x.flags.writeable for x in given]
        if not all(fit) or [(x.shape, x.dtype) for x in given] != expected:
            wanted = ", ".join(f"{shape} {kind}" for shape, kind in expected)
            got = ", ".join(f"{np.shape(x)} {np.asarray(x).dtype}" for x in given)
            raise ShapeError(f"out: expected writable arrays in C order, {wanted}; got {got}")
        return given

    def _run(self, arrays: list[Array], lead: Shape, results: list[Array], threads: int) -> int:
        if not lead:
            return self.one(*map(np.ascontiguousarray, arrays), *results)
        rows = math.prod(lead)
        shapes = self.emitted.inputs.values()
        flat = [_rows(x, lead, shape) for x, shape in zip(arrays, shapes, strict=True)]
        flat += [x.reshape(rows, *shape) for x, (shape, _) in zip(results, self._kinds, strict=True)]
        threads = min(threads, max(rows // _ROWS_PER_THREAD, 1))
        if threads <= 1:
            return self.rows(0, rows, *flat)
        blocks = -(-rows // LANES)
        cuts = [min(round(blocks * i / threads) * LANES, rows) for i in range(threads + 1)]
        jobs = [_pool().submit(self.rows, a, b, *flat) for a, b in pairwise(cuts)]
        return sum(job.result() for job in jobs)


def cache_folder() -> Path:
    """Return where kernels are kept: ``$ARMWRIGHT_CACHE``, or armwright in the user's cache folder."""
    own = os.environ.get("ARMWRIGHT_CACHE")
    if own:
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "armwright"


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
    return np.ascontiguousarray(array.reshape(-1, *shape))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=os.cpu_count())


_LOADED: dict[str, ModuleType] = {}
_LOADING = threading.Lock()


def _module(source: str, title: str) -> ModuleType:
    """Import the source from the cache folder, writing and compiling it first where it is not there."""
    key = _key(source)
    with _LOADING:
        if key not in _LOADED:
            folder = cache_folder() / "kernels" / key
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError:
                # A home that cannot be written to: compile for this process alone.
                folder = Path(tempfile.mkdtemp(prefix="armwright-kernel-"))
            with _alone(folder):
                _LOADED[key] = _import(folder, source, title)
        return _LOADED[key]


def _import(folder: Path, source: str, title: str) -> ModuleType:
    file = folder / "kernel.py"
    if not file.exists():
        # Never rewritten: the compiler's cache goes by the time of the file.
        file.write_text(source, encoding="utf-8")
    done = folder / "compiled"
    if not done.exists() and sys.stderr.isatty():
        print(f"armwright: compiling {title}, once", file=sys.stderr)  # noqa: T201 - asked for by who watches
    spec = importlib.util.spec_from_file_location(f"armwright_kernel_{folder.name}", file)
    assert spec is not None  # noqa: S101 - the file is there
    assert spec.loader is not None  # noqa: S101
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # the compiled code, taken from disk, looks for its module there
    spec.loader.exec_module(module)
    done.touch()
    return module


def _key(source: str) -> str:
    """Name a source by itself, the versions that compile it, and the processor it is compiled for."""
    import llvmlite.binding as llvm  # noqa: PLC0415 - costs a quarter of a second, and only kernels need it
    import numba  # noqa: PLC0415

    parts: list[Any] = [source, __version__, sys.version, np.__version__, numba.__version__, llvm.get_host_cpu_name()]
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()[:32]


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other processes from compiling the same kernel meanwhile; they wait, and then find it done."""
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(lock, fcntl.LOCK_UN)
