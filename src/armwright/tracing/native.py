"""Machine code of LLVM IR: compiled once, kept in the user's cache, and loaded from there by later processes.

What is loaded comes out of a store that checks every byte (``armwright.files.store``).
"""

import contextlib
import hashlib
import os
import threading
from collections.abc import Callable
from functools import cache
from typing import Any, Literal, NamedTuple

from armwright.errors import ArmwrightError
from armwright.files.store import user_store
from armwright.tracing.emit_llvm import Target
from armwright.tracing.image import CAN_BE_LINKED, linked, placed
from armwright.tracing.surroundings import sources_are_unchanged, surroundings
from armwright.version import __version__

# Addresses of functions by their keys, with what keeps the code as long as the process lives; and by their references.
_LOADED: dict[str, tuple[int, Any]] = {}
_REFERRED: dict[str, int] = {}
_COMPILING = threading.RLock()
# A process that is forked while another thread compiles would wait for that thread, which it does not have.
os.register_at_fork(before=_COMPILING.acquire, after_in_parent=_COMPILING.release, after_in_child=_COMPILING.release)
# What is stored begins with one of these: code for any place in memory, an object of the compiler, and the key of code.
_IMAGE, _OBJECT, _REFERENCE = b"image\n", b"object of LLVM\n", b"reference\n"

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


def function_address(ir: str | Callable[[], str], name: str, origin: str = "", *, quickly: bool = False) -> int:
    """Return the address of a function of some IR, which is compiled unless it was before.

    Args:
        ir: LLVM IR, or what makes it. It holds numbers and names of ours only: no text that came from a user.
        name: of the function.
        origin: what the IR follows from, in surroundings that are the same: a process that finds the code by it does
            not ask for the IR. Empty where that cannot be said.
        quickly: whether it is compiled with the least effort, in a third of the time, where it was not compiled
            before: for code of which a call takes so little, or of which there are so few, that its speed does not
            matter. The bits of its results are the same.
    """
    reference = _reference(name, origin, quickly=quickly)
    if reference and (known := _REFERRED.get(reference)):
        return known
    key = _referred(reference) if reference else None
    if key is None and reference and quickly:
        key = _referred(_reference(name, origin, quickly=False))
    address = None if key is None else _loaded(key)
    if address is None:
        text = ir if isinstance(ir, str) else ir()
        key = _key(text, name, quickly=quickly)
        address = _loaded(key)
        if address is None:
            address = _made(key, text, name, quickly=quickly)
        if reference and sources_are_unchanged():
            user_store("compiled").put(reference, _REFERENCE + key.encode())
    if reference:
        _REFERRED[reference] = address
    return address


def _reference(name: str, origin: str, *, quickly: bool) -> str:
    around = surroundings() if origin else ""
    return hashlib.sha256(f"{name}\n{origin} {quickly}\n{around}".encode()).hexdigest() if around else ""


def _referred(reference: str) -> str | None:
    """Return the key of the code that another process has made of the same."""
    stored = user_store("compiled").get(reference)
    return stored.removeprefix(_REFERENCE).decode() if stored and stored.startswith(_REFERENCE) else None


def _loaded(key: str) -> int | None:
    """Return the address of code that this process or another has made before, None where there is none."""
    if key not in _LOADED:
        stored = user_store("compiled").get(key)
        if stored is None:
            return None
        try:
            # Two threads may do this at once: either copy does.
            if stored.startswith(_IMAGE):
                _LOADED[key] = placed(stored.removeprefix(_IMAGE))
            # LLVM does not look at what it loads: bytes of ours that are no object would end the process.
            elif stored.startswith(_OBJECT):
                name, _, code = stored.removeprefix(_OBJECT).partition(b"\n")
                _LOADED[key] = _engine(code, name.decode())
        except OSError:  # memory of ours cannot be executed
            return None
    return _LOADED[key][0] if key in _LOADED else None


def _made(key: str, ir: str, name: str, *, quickly: bool) -> int:
    store = user_store("compiled")
    # Others are waited for without the lock of this process, so that a fork does not wait for them.
    with store.locked(key):
        address = _loaded(key)  # another process may have made it meanwhile
        if address is None:
            code = _compile(ir, quickly=quickly)
            image = linked(code, name)
            store.put(key, _OBJECT + name.encode() + b"\n" + code if image is None else _IMAGE + image)
            _LOADED[key] = _engine(code, name) if image is None else _placed(image)
            address = _LOADED[key][0]
        return address


def _placed(image: bytes) -> tuple[int, Any]:
    try:
        return placed(image)
    except OSError as error:  # LLVM would run into the same, and end the process
        raise ArmwrightError(
            f"compiled functions need memory that can be executed, which this system refuses ({error.strerror}): allow "
            "it for this process (execmem of SELinux), or call the plain functions"
        ) from error


def _compile(ir: str, *, quickly: bool = False) -> bytes:
    import llvmlite.binding as llvm  # noqa: PLC0415

    lines, quotients = ir.count("\n"), ir.count(" fdiv ") + ir.count("@llvm.sqrt")
    with _COMPILING:
        module = llvm.parse_assembly(ir)
        module.verify()
        if quickly:
            return bytes(_machine(effort=0).emit_object(module))
        if lines <= _LONG or quotients > _MANY_QUOTIENTS * lines:
            return bytes(_machine().emit_object(module))
        # The setting is that of the process, where Numba compiles, too.
        llvm.set_option("armwright", "-enable-misched=false")
        try:
            return bytes(_machine(effort=1).emit_object(module))
        finally:
            llvm.set_option("armwright", "-enable-misched=true")


def _engine(code: bytes, name: str) -> tuple[int, Any]:
    """Let LLVM load an object; return the address of its function, and what keeps it."""
    import llvmlite.binding as llvm  # noqa: PLC0415

    with _COMPILING:
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        return int(engine.get_function_address(name)), engine


def _machine(effort: Literal[0, 1, 2] = 2) -> Any:
    """Return a code generator for this machine; an engine takes the one that it is given."""
    import llvmlite.binding as llvm  # noqa: PLC0415

    with contextlib.suppress(RuntimeError):  # newer versions have done it by themselves
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    host = processor()
    # In the small model code refers to its constants by their distance, as an image of it has to.
    model = {"reloc": "pic", "codemodel": "small"} if CAN_BE_LINKED else {"jit": True}
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=host.name, features=host.features, opt=effort, **model
    )


def _key(ir: str, name: str, *, quickly: bool) -> str:
    """Name code by its IR and function, by what compiles it and how, and by the processor it is compiled for."""
    import llvmlite  # noqa: PLC0415
    import llvmlite.binding as llvm  # noqa: PLC0415

    # Other versions of ours link otherwise, and processes of 32 bits run on the same processor.
    compiler = __version__, llvmlite.__version__, llvm.llvm_version_info, llvm.get_process_triple()
    parts = [ir, name, str(quickly), *map(str, compiler), *map(str, processor())]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
