"""Where compiled kernels are kept: made once per source, version and processor, safe with several processes."""

import contextlib
import fcntl
import hashlib
import importlib.util
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from armwright.version import __version__

_LOADED: dict[str, ModuleType] = {}
_LOADING = threading.Lock()


def cache_folder() -> Path:
    """Return where kernels are kept: ``$ARMWRIGHT_CACHE``, or armwright in the user's cache folder."""
    own = os.environ.get("ARMWRIGHT_CACHE")
    if own:
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "armwright"


def compiled_module(source: str, title: str) -> ModuleType:
    """Import a source from the cache folder, writing and compiling it first where it is not there.

    The first compilation takes a second or more and is announced on the error output when a person watches.

    Args:
        source: Python for Numba.
        title: what it computes, for the announcement.
    """
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
