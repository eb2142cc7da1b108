"""Loops that Numba compiles: taken from the user's cache where they are there, otherwise compiled, once, and kept.

A source is executed from memory, never from a file, and what was compiled comes out of a store that checks every byte
(``armwright.files.store``): Numba writes and reads no files of its own.
"""

import contextlib
import hashlib
import marshal
import pickle
import sys
import threading
from collections.abc import Callable
from types import CodeType, ModuleType
from typing import Any

import attrs
import numpy as np

from armwright.errors import shown
from armwright.files.store import user_store
from armwright.tracing.native import processor
from armwright.version import __version__

_LOADED: dict[str, Callable[..., Any]] = {}
_LOADING = threading.Lock()


def compiled(source: str, entry: str, title: str) -> Callable[..., Any]:
    """Return the compiled function of a source; the first time it is compiled, and then kept on disk.

    The first compilation takes a second or more and is announced on the error output when a person watches.

    Args:
        source: Python for Numba: a function and, as ``SIGNATURE``, its type. It holds numbers and names of ours only:
            no text that came from a user.
        entry: the name of the function.
        title: what it computes, for the announcement.
    """
    key = _key(source)
    with _LOADING:
        if key not in _LOADED:
            _LOADED[key] = _load(key, source, entry, title)
        return _LOADED[key]


def _load(key: str, source: str, entry: str, title: str) -> Callable[..., Any]:
    store = user_store("compiled")
    stored = store.get(key)
    with contextlib.nullcontext() if stored else store.locked(key):
        stored = stored or store.get(key)  # another process may have made it meanwhile
        if stored:
            # Sound bytes may still come from a Numba that writes them in another way.
            with contextlib.suppress(Exception):
                code, made = pickle.loads(stored)  # noqa: S301 - our own, checked by the store
                return _function(key, entry, marshal.loads(code), _Exchange(made=made))  # noqa: S302
        if sys.stderr.isatty():
            print(f"armwright: compiling {shown(title)}, once", file=sys.stderr)  # noqa: T201 - asked for by who watches
        code = compile(source, f"<{_module_name(key)}>", "exec")
        exchange = _Exchange(made=None)
        function = _function(key, entry, code, exchange)
        store.put(key, pickle.dumps((marshal.dumps(code), exchange.made)))
        return function


def _function(key: str, entry: str, code: CodeType, exchange: "_Exchange") -> Callable[..., Any]:
    """Return the compiled function of a code that this process, or one like it, has emitted."""
    from numba import njit  # noqa: PLC0415 - costs half a second, and only loops need it
    from numba.core.typeinfer import register_dispatcher  # noqa: PLC0415

    module = ModuleType(_module_name(key))
    sys.modules[module.__name__] = module  # what was compiled looks for its module there
    exec(code, module.__dict__)  # noqa: S102 - numbers and names of ours
    dispatcher: Any = njit(error_model="numpy", nogil=True)(getattr(module, entry))
    dispatcher._cache = exchange  # noqa: SLF001 - Numba's own cache trusts the files that it finds
    with register_dispatcher(dispatcher):
        dispatcher.compile(module.SIGNATURE)
    dispatcher.disable_compile()
    return dispatcher  # type: ignore[no-any-return]


@attrs.define
class _Exchange:
    """What stands in for the cache of a Numba function.

    Attributes:
        made: what was compiled, taken apart to bytes; None where it has to be compiled now.
    """

    made: bytes | None
    cache_path: str = ""

    def load_overload(self, _signature: Any, context: Any) -> Any:
        """Return what was compiled before."""
        from numba.core import compiler  # noqa: PLC0415

        if self.made is None:
            return None
        context.refresh()
        results: Any = compiler.CompileResult
        return results._rebuild(context, *pickle.loads(self.made))  # noqa: S301, SLF001 - as above

    def save_overload(self, _signature: Any, result: Any) -> None:
        """Take apart what has been compiled."""
        from numba.core import serialize  # noqa: PLC0415

        dumps: Any = serialize.dumps
        self.made = dumps(result._reduce())  # noqa: SLF001


def _module_name(key: str) -> str:
    return f"armwright_kernel_{key}"


def _key(source: str) -> str:
    """Name a source by itself, the versions that compile it, and the processor it is compiled for."""
    import numba  # noqa: PLC0415

    host = processor()
    parts: list[Any] = [source, __version__, sys.version, np.__version__, numba.__version__, host.name, host.features]
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()
