"""Machine code of LLVM IR: compiled once, kept in the user's cache, and loaded from there by later processes.

What is loaded comes out of a store that checks every byte (``armwright.files.store``).
"""

import contextlib
import hashlib
import os
import sys
import threading
from functools import cache
from typing import Any, Literal, NamedTuple

from armwright.files.store import user_store
from armwright.tracing.emit_llvm import Target

# Engines own the code that they have loaded, and live as long as the process: others may hold its addresses.
_LOADED: dict[str, Any] = {}
_LOADING = threading.RLock()
# A process that is forked while another thread compiles would wait for that thread, which it does not have.
os.register_at_fork(before=_LOADING.acquire, after_in_parent=_LOADING.release, after_in_child=_LOADING.release)
# What is stored begins with this, and the object of the compiler follows.
_SIGNATURE = b"object of LLVM\n"

# The operations of longer IR, in lines, stay in its order, and are compiled with less effort: the order that LLVM finds
# keeps ever more values at a time, which makes derivatives up to two fifths slower, and takes twice as long to find.
# Where more than this part are divisions and roots, as in closed-form inverse kinematics, it is better.
_LONG, _MANY_QUOTIENTS = 2500, 0.005


class Processor(NamedTuple):
    """What code is made for.

    Attributes:
        name: as LLVM calls it.
        features: what it can do, in LLVM's words.
        target: how code is written for it.
    """

    name: str
    features: str
    target: Target


@cache
def processor() -> Processor:
    """Return the processor of this machine."""
    import llvmlite.binding as llvm  # noqa: PLC0415 - costs a twentieth of a second, and only kernels need it

    has = llvm.get_host_cpu_features()
    arm = not any(name.startswith("sse") for name in has)
    lanes = 8 if has.get("avx512f") else 4 if has.get("avx2") else 2
    return Processor(llvm.get_host_cpu_name(), has.flatten(), Target(lanes, has_fma=bool(has.get("fma", arm))))


def function_address(ir: str, name: str) -> int:
    """Return the address of a function of some IR, which is compiled unless it was before.

    Args:
        ir: LLVM IR. It holds numbers and names of ours only: no text that came from a user.
        name: of the function.
    """
    key = _key(ir)
    with _LOADING:
        if key not in _LOADED:
            _LOADED[key] = _load(key, ir)
        return int(_LOADED[key].get_function_address(name))


def _load(key: str, ir: str) -> Any:
    store = user_store("compiled")
    stored = store.get(key)
    with contextlib.nullcontext() if stored else store.locked(key):
        stored = stored or store.get(key)  # another process may have made it meanwhile
        # LLVM does not look at what it loads: bytes of ours that are no object would end the process.
        if stored is None or not stored.startswith(_SIGNATURE):
            stored = _SIGNATURE + _compile(ir)
            store.put(key, stored)
    return _engine(stored.removeprefix(_SIGNATURE))


def _compile(ir: str) -> bytes:
    import llvmlite.binding as llvm  # noqa: PLC0415

    module = llvm.parse_assembly(ir)
    module.verify()
    lines, quotients = ir.count("\n"), ir.count(" fdiv ") + ir.count("@llvm.sqrt")
    if lines <= _LONG or quotients > _MANY_QUOTIENTS * lines:
        return bytes(_machine().emit_object(module))
    # The setting is that of the process, where Numba compiles, too.
    llvm.set_option("armwright", "-enable-misched=false")
    try:
        return bytes(_machine(effort=1).emit_object(module))
    finally:
        llvm.set_option("armwright", "-enable-misched=true")


def _engine(code: bytes) -> Any:
    import llvmlite.binding as llvm  # noqa: PLC0415

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def _machine(effort: Literal[1, 2] = 2) -> Any:
    """Return a code generator for this machine; an engine takes the one that it is given."""
    import llvmlite.binding as llvm  # noqa: PLC0415

    with contextlib.suppress(RuntimeError):  # newer versions have done it by themselves
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    host = processor()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=host.name, features=host.features, opt=effort, jit=True
    )


def _key(ir: str) -> str:
    """Name IR by itself, what compiles it, and the processor it is compiled for."""
    import llvmlite  # noqa: PLC0415

    parts = [ir, sys.platform, llvmlite.__version__, *map(str, processor())]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
