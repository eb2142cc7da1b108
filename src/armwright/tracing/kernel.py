"""Compiled kernels: made once per source, kept on disk, called with arrays."""

import contextlib
import fcntl
import hashlib
import importlib.util
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.errors import ShapeError
from armwright.tracing.emit import LANES, Emitted
from armwright.version import __version__

# Below this many rows a second thread costs more than it saves.
_ROWS_PER_THREAD = 4096


@attrs.frozen(kw_only=True, eq=False)
class Kernel:
    """An equation, compiled.

    Attributes:
        emitted: its source, and the widths of its inputs and outputs.
    """

    emitted: Emitted
    _function: Callable[..., None]

    def __call__(self, *inputs: ArrayLike, threads: int = 1) -> tuple[Array, ...]:
        """Evaluate the equation for one configuration or many.

        Args:
            inputs: one array (..., width) per input; leading axes are broadcast.
            threads: how many cores to use; the bits do not depend on it.

        Returns:
            One array (..., width) per output.

        Raises:
            ShapeError: the number of inputs, a last axis, or the leading axes do not fit.
            InvalidValueError: a number is NaN or infinite.
        """
        widths = self.emitted.inputs
        if len(inputs) != len(widths):
            raise ShapeError(f"{self.emitted.title}: expected {len(widths)} arrays, got {len(inputs)}")
        arrays = [_input(x, width, f"input {i + 1}") for i, (x, width) in enumerate(zip(inputs, widths, strict=True))]
        try:
            lead = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError as error:
            shapes = ", ".join(str(array.shape) for array in arrays)
            raise ShapeError(f"{self.emitted.title}: leading axes must fit together, got {shapes}") from error
        flat = [_rows(array, (*lead, width)) for array, width in zip(arrays, widths, strict=True)]
        rows = len(flat[0])
        results = [np.empty((rows, width)) for width in self.emitted.outputs]
        self._run(rows, [*flat, *results], threads)
        return tuple(result.reshape(*lead, result.shape[1]) for result in results)

    def _run(self, rows: int, arrays: list[Array], threads: int) -> None:
        threads = min(threads, max(rows // _ROWS_PER_THREAD, 1))
        if threads <= 1:
            self._function(0, rows, *arrays)
            return
        # Blocks are counted from row 0, so the cuts fall between blocks.
        blocks = -(-rows // LANES)
        cuts = [min(round(blocks * i / threads) * LANES, rows) for i in range(threads + 1)]
        jobs = [_pool().submit(self._function, a, b, *arrays) for a, b in pairwise(cuts)]
        for job in jobs:
            job.result()


def compiled(emitted: Emitted) -> Kernel:
    """Return the kernel of an emitted source, compiled now or taken from disk.

    The first compilation takes a second or more and is announced on the error output when a person watches.
    """
    return Kernel(emitted=emitted, function=_module(emitted.source, emitted.title).kernel)


def cache_folder() -> Path:
    """Return where kernels are kept: ``$ARMWRIGHT_CACHE``, or armwright in the user's cache folder."""
    own = os.environ.get("ARMWRIGHT_CACHE")
    if own:
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "armwright"


def _input(value: ArrayLike, width: int, what: str) -> Array:
    """Return ``value`` as float64, without a copy where it is already; refuse what is not finite."""
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != width:
        raise ShapeError(f"{what}: expected {width} numbers on the last axis, got shape {array.shape}")
    # A sum is finite when all its terms are, and takes a quarter of the time of asking each.
    if not np.isfinite(array.sum()):
        floats(array, what)
    return array


def _rows(array: Array, shape: tuple[int, ...]) -> Array:
    """Return ``array``, broadcast to ``shape``, as rows; a copy only where it is broadcast, scattered or read-only."""
    if array.shape != shape:
        array = np.broadcast_to(array, shape)
    return np.require(array.reshape(-1, shape[-1]), requirements=("C", "W"))


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
