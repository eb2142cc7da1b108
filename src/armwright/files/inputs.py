"""Reading files, never more of one than its limit allows, and never what is no file where data name it."""

import codecs
import contextlib
import hashlib
import io
import itertools
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from armwright.errors import FileFormatError, KindError, closest, shown
from armwright.files.limits import MEGABYTE, limit, limit_message

_PIECE_BYTES = 1 << 20
# By the letter with which `ls -l` marks them.
_FILE_TYPES = {"p": "a pipe", "c": "a device", "b": "a device", "s": "a socket", "d": "a folder"}
# Names of a folder among which the nearest to a missing one is looked for.
_MAX_NAMES = 1000
# The SHA-256 hash of what was read last of every file: the file may be another by now, or a pipe, which is empty then.
_HASHES_OF_READ_FILES: dict[Path, str] = {}
# The files that this process has read, by where they were then.
_SOURCES: dict[Path, None] = {}


def file_path(value: Path | str) -> Path:
    """Return the path of a file.

    Raises:
        KindError: it is none, such as a number or the text of the file as bytes.
    """
    if not isinstance(value, str | Path):
        raise KindError(f"expected the path of a file, got {shown(value)}")
    return Path(value)


def regular_file(path: Path) -> Path:
    """Return the path of a file that data name: an import, the model of an arm. It must be a regular file.

    What the user names on the command line may be a pipe; what a file names may not, as reading it might never end.

    Raises:
        FileFormatError: it is a pipe, a device, a socket or a folder.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return path  # reading it says what is wrong
    if not stat.S_ISREG(mode):
        kind = _FILE_TYPES.get(stat.filemode(mode)[0], "something else")
        raise FileFormatError(path, None, "", f"expected a file, got {kind}")
    return path


def file_below(folder: Path, name: str) -> Path:
    """Return the path of a file that data name beside themselves: it must lie below their folder, links followed.

    Raises:
        FileFormatError: it lies elsewhere, or is no regular file.
    """
    path = folder / name
    try:
        path.exists()  # fails where a name is too long
        below = path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a name that no file can have, or links in a circle
        below = False
    if not below or Path(name).is_absolute():
        raise FileFormatError(folder, None, "", f"expected the name of a file below this folder, got {shown(name)}")
    return regular_file(path)


def read_pieces(path: Path | str, bound: str = "file_mb") -> Iterator[bytes]:
    """Give what a file holds, piece by piece, not more than a limit.

    Args:
        path: the file, or a pipe.
        bound: the name of the limit of its size, in MB.

    Raises:
        FileFormatError: it is missing (the nearest name in its folder is told), a folder, or larger than the limit.
    """
    path, most, got = file_path(path), limit(bound) * MEGABYTE, 0
    try:
        # Who refuses a row stops asking for pieces; a bare handle is closed with this generator, and never before it.
        # A file such as those of /proc may make its reader wait for ever though it is a regular one; a pipe shall wait.
        waits = 0 if not stat.S_ISREG(path.stat().st_mode) else os.O_NONBLOCK
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | waits)
        note_source(path)
        try:
            size = os.fstat(handle).st_size
            if size > most:
                raise _size_error(path, bound, size)
            while piece := os.read(handle, _PIECE_BYTES):
                got += len(piece)
                if got > most:
                    raise _size_error(path, bound, None)
                yield piece
        finally:
            os.close(handle)
    except FileNotFoundError:
        near = closest(path.name, _names_in(path.parent))
        hint = f"; did you mean '{path.parent / near}'?" if near else ""
        raise FileFormatError(path, None, "", f"no such file{hint}") from None
    except IsADirectoryError:
        raise FileFormatError(path, None, "", "expected a file, got a folder") from None
    except OSError as error:
        raise FileFormatError(path, None, "", f"cannot be read: {error.strerror}") from error
    except ValueError as error:  # a zero byte in the name
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(repr(str(path)), None, "", "no file can have this name") from error


def read_bytes(path: Path | str, bound: str = "file_mb") -> bytes:
    """Return what a file holds.

    Args:
        path: the file, or a pipe.
        bound: the name of the limit of its size, in MB.

    Raises:
        FileFormatError: it is missing (the nearest name in its folder is told), a folder, or larger than the limit.
    """
    data = b"".join(read_pieces(path, bound))
    _HASHES_OF_READ_FILES[Path(path)] = hashlib.sha256(data).hexdigest()
    return data


def hash_of_read_file(path: Path) -> str | None:
    """Return the SHA-256 hash of what this process has read last of a file; None where it has not read it."""
    return _HASHES_OF_READ_FILES.get(path)


def forget_read_files() -> None:
    """Forget what was read, as a new process does."""
    _HASHES_OF_READ_FILES.clear()
    _SOURCES.clear()


def note_source(path: Path) -> None:
    """Take note that this process reads a file, so that no results take its place."""
    _SOURCES[path.absolute()] = None


def is_source(path: Path) -> bool:
    """Whether a path leads to a file that this process has read, by whatever name: results would take its place."""
    try:
        there = path.stat()
    except (OSError, ValueError):
        return False
    return stat.S_ISREG(there.st_mode) and any(_is_same_file(source, there) for source in _SOURCES)


def _is_same_file(path: Path, state: os.stat_result) -> bool:
    with contextlib.suppress(OSError):
        return os.path.samestat(path.stat(), state)
    return False


def read_text(path: Path | str, bound: str = "file_mb") -> str:
    """Return the text of a UTF-8 file; a mark of byte order is dropped, line ends become line feeds.

    Args:
        path: the file, or a pipe.
        bound: the name of the limit of its size, in MB.

    Raises:
        FileFormatError: it is missing (the nearest name in its folder is told), a folder, larger than the limit, or not
            UTF-8.
    """
    return decode(read_bytes(path, bound), path)


def read_lines(path: Path | str, bound: str = "table_mb") -> Iterator[str]:
    """Give the lines of a UTF-8 file, one after the other, with their ends; never more than a piece of it is held.

    Args:
        path: the file, or a pipe.
        bound: the name of the limit of its size, in MB.

    Raises:
        FileFormatError: it cannot be read, it or a line is larger than the limit, or it is not UTF-8.
    """
    decoder = codecs.getincrementaldecoder("utf-8-sig")()
    rest, number, longest = "", 0, limit("line_characters")
    for piece in itertools.chain(read_pieces(path, bound), [b""]):
        try:
            text = rest + decoder.decode(piece, final=not piece)
        except UnicodeDecodeError as error:
            line = number + 1 + rest.count("\n") + error.object[: error.start].count(b"\n")
            raise utf8_error(path, line, error.object[error.start]) from error
        # What follows the last line feed waits for its end; where there is none, carriage returns may end lines.
        whole = len(text) if not piece else max(text.rfind("\n"), text.rfind("\r", 0, -1)) + 1
        rest = text[whole:]
        for line_text in io.StringIO(text[:whole], newline=""):
            number += 1
            if len(line_text) > longest:
                raise _line_length_error(path, number)
            yield line_text
        if len(rest) > longest:
            raise _line_length_error(path, number + 1)


def read_program(path: Path | str) -> str:
    """Return the text of a program, or of intermediate code; see ``read_text``.

    Raises:
        FileFormatError: it cannot be read, is larger than the limit, or not UTF-8.
    """
    return read_text(path, "program_mb")


def read_typed_program(stream: BinaryIO) -> str:
    """Return the text of a program that is typed or piped into the standard input.

    Raises:
        FileFormatError: it is larger than the limit, or not UTF-8.
    """
    most, name = limit("program_mb") * MEGABYTE, "standard input"
    data = stream.read(most + 1)
    if len(data) > most:
        raise _size_error(name, "program_mb", None)
    return decode(data, name)


def decode(data: bytes, path: Path | str) -> str:
    """Return the text that bytes are; a mark of byte order is dropped, line ends become line feeds.

    Raises:
        FileFormatError: they are not UTF-8; the text names ``path`` and the line.
    """
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        # The decoder counts behind a mark of byte order, so its own bytes are those to look at.
        line = error.object[: error.start].count(b"\n") + 1
        raise utf8_error(path, line, error.object[error.start]) from error


def utf8_error(path: Path | str, line: int, byte: int) -> FileFormatError:
    """Return the error that says which byte of a line is no UTF-8."""
    return FileFormatError(path, line, "", f"not UTF-8 text: byte 0x{byte:02x} is invalid; save it as UTF-8")


def _size_error(path: Path | str, bound: str, size: int | None) -> FileFormatError:
    got = None if size is None else f"{size / MEGABYTE:,.1f}"
    return FileFormatError(path, None, "", f"too large: {limit_message(bound, got)}")


def _line_length_error(path: Path | str, line: int) -> FileFormatError:
    return FileFormatError(path, line, "", f"a line is too long: {limit_message('line_characters')}")


def _names_in(folder: Path) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.name for entry, _ in zip(entries, range(_MAX_NAMES), strict=False))
    except OSError:
        return []
