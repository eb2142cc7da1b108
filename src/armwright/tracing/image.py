"""Images of machine code: what LLVM compiles, linked once, and put into memory by later processes without LLVM.

Loading LLVM takes longer than planning a short motion. The code of a kernel calls nobody and refers to nothing but its
own constants, by their distance. So code and constants, one behind the other with these distances filled in, run
wherever they are put. Objects of other forms are left to LLVM.
"""

import ctypes
import mmap
import platform
import struct
import sys
from functools import cache
from typing import Any, NamedTuple

# Where objects have the form that is read here.
CAN_BE_LINKED = sys.platform == "linux" and platform.machine() == "x86_64"
# Of the ELF format: what a file for this processor begins with (64 bits, little-endian), and where its fields are.
_MAGIC, _X86_64 = b"\x7fELF\x02\x01\x01", 62
_HEADER = struct.Struct("<16xHHIQQQIHHHHHH")
_SECTION, _RELOCATION, _SYMBOL = struct.Struct("<IIQQQQIIQQ"), struct.Struct("<QQq"), struct.Struct("<IBBHQQ")
_CONTENT, _SYMBOLS, _RELOCATIONS, _BLANK = 1, 2, 4, 8
_WRITABLE, _ALLOCATED = 1, 2
# Distances of 32 bits: of data, and of a function, here in the same image.
_DISTANCES = (2, 4)
# An image begins with the offset of its function in what follows.
_START = struct.Struct("<Q")


class _Section(NamedTuple):
    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    target: int
    alignment: int
    entry_size: int

    def of(self, code: bytes) -> bytes:
        return code[self.offset : self.offset + self.size]


def linked(code: bytes, name: str) -> bytes | None:
    """Return the image of an object with one function that is called; None if LLVM has to load it.

    Args:
        code: an object file.
        name: of the function.

    Source:
        System V ABI, AMD64 supplement, chapter 4.
    """
    if not code.startswith(_MAGIC):
        return None
    _, machine, _, _, _, table, _, _, _, _, _, count, _ = _HEADER.unpack_from(code)
    if machine != _X86_64:
        return None
    sections = [_Section(*_SECTION.unpack_from(code, table + _SECTION.size * i)) for i in range(count)]
    kept = {i: x for i, x in enumerate(sections) if x.flags & _ALLOCATED and x.size}
    if any(x.flags & _WRITABLE or x.kind == _BLANK for x in kept.values()):
        return None
    image, starts = bytearray(), dict[int, int]()
    for i, section in kept.items():
        if section.kind == _CONTENT:  # other kinds are for debuggers
            image += bytes(-len(image) % max(section.alignment, 1))
            starts[i] = len(image)
            image += section.of(code)
    entry = _offset_of(name, code, sections, starts)
    if entry is None or not _filled_in(image, code, sections, starts):
        return None
    return _START.pack(entry) + bytes(image)


def _filled_in(image: bytearray, code: bytes, sections: list[_Section], starts: dict[int, int]) -> bool:
    """Fill in the distances between the parts of an image; return whether these are all that it refers to."""
    for section in sections:
        if section.kind == _RELOCATIONS and section.target in starts:
            symbols = list(_SYMBOL.iter_unpack(sections[section.link].of(code)))
            for offset, info, addend in _RELOCATION.iter_unpack(section.of(code)):
                _, _, _, home, value, _ = symbols[info >> 32]
                if info & 0xFFFFFFFF not in _DISTANCES or home not in starts:
                    return False
                at = starts[section.target] + offset
                struct.pack_into("<i", image, at, starts[home] + value + addend - at)
    return True


def _offset_of(name: str, code: bytes, sections: list[_Section], starts: dict[int, int]) -> int | None:
    """Return where a function is in an image."""
    for section in sections:
        if section.kind == _SYMBOLS:
            names = sections[section.link].of(code)
            for start, _, _, home, value, _ in _SYMBOL.iter_unpack(section.of(code)):
                if home in starts and names[start : names.index(b"\0", start)] == name.encode():
                    return starts[home] + int(value)
    return None


def placed(image: bytes) -> tuple[int, Any]:
    """Put an image into memory; return the address of its function, and what keeps the memory.

    The memory can be written to before it can be executed, never both at once.

    Raises:
        OSError: the system does not allow that.
    """
    start, code = _START.unpack_from(image)[0], image[_START.size :]
    memory = mmap.mmap(-1, len(code), flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    memory.write(code)
    keeper = ctypes.c_char.from_buffer(memory)
    address = ctypes.addressof(keeper)
    if _protect()(address, len(code), mmap.PROT_READ | mmap.PROT_EXEC):
        raise OSError(ctypes.get_errno(), "memory cannot be made executable")
    # While the interpreter ends, functions and threads may still call code whose module is gone.
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(keeper))
    return address + start, keeper


@cache
def can_be_placed() -> bool:
    """Whether the system allows memory that can be executed; SELinux and others may refuse it."""
    try:
        placed(_START.pack(0) + b"\xc3")
    except OSError:
        return False
    return True


@cache
def _protect() -> Any:
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    protect.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    return protect
