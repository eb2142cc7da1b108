"""Writing results: a folder gets all of its files or none, a file all of its text or none."""

import contextlib
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from armwright.errors import OutputError


def write_folder(folder: Path, files: Mapping[str, str | bytes | Iterable[str]]) -> None:
    """Write files into a folder, all of them or none.

    They are written beside the folder first and moved in when all are whole, so an error, a full disk or an
    interruption leaves what was there before. Other files in the folder stay.

    Args:
        folder: made where it is missing, with its parents.
        files: by name: the text, or pieces of it that are written as they come; or bytes.

    Raises:
        OutputError: the folder or a file cannot be written; the text says which and why.
    """
    folder = folder.absolute()
    made = _make_parents(folder)
    try:
        with tempfile.TemporaryDirectory(prefix=".armwright-", dir=folder.parent) as beside:
            for name, text in files.items():
                _write(Path(beside) / name, text)
            folder.mkdir(exist_ok=True)
            _refuse_what_cannot_be_replaced(folder, files)
            for name in files:
                (Path(beside) / name).replace(folder / name)
    except OSError as error:
        _remove(made)
        raise OutputError(f"cannot write to '{folder}': {reason(error, folder)}; nothing was written") from error
    except BaseException:
        _remove(made)
        raise


def write_file(path: Path, text: str | Iterable[str]) -> None:
    """Write one file, or leave what was there before.

    Args:
        path: its folder is made where it is missing, with its parents.
        text: or pieces of it that are written as they come.

    Raises:
        OutputError: it cannot be written; the text says why.
    """
    path = path.absolute()
    made = _make_parents(path)
    try:
        with tempfile.TemporaryDirectory(prefix=".armwright-", dir=path.parent) as beside:
            _write(Path(beside) / path.name, text)
            (Path(beside) / path.name).replace(path)
    except OSError as error:
        _remove(made)
        raise OutputError(f"cannot write '{path}': {error.strerror or error}; nothing was written") from error
    except BaseException:
        _remove(made)
        raise


def reason(error: OSError, folder: Path) -> str:
    """Say why a folder cannot be made or written to; of a file that is in its place, that it is one."""
    for place in (folder, *folder.parents):
        if place.is_file():
            return "it is a file, and a folder is needed" if place == folder else f"'{place}' is a file"
    return error.strerror or str(error)


def _write(path: Path, text: str | bytes | Iterable[str]) -> None:
    if isinstance(text, bytes):
        with path.open("wb") as binary:
            binary.write(text)
            binary.flush()
            os.fsync(binary.fileno())
        return
    with path.open("w", encoding="utf-8", errors="backslashreplace", newline="\n") as file:
        file.writelines([text] if isinstance(text, str) else text)
        file.flush()
        os.fsync(file.fileno())


def _make_parents(folder: Path) -> list[Path]:
    """Make the missing folders above ``folder`` and return them, the deepest first."""
    missing = [parent for parent in folder.parents if not parent.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        _remove(missing)
        raise OutputError(
            f"cannot make '{folder.parent}': {reason(error, folder.parent)}; nothing was written"
        ) from error
    return missing


def _refuse_what_cannot_be_replaced(folder: Path, files: Iterable[str]) -> None:
    """Fail before the first file is moved in, not between two."""
    if not os.access(folder, os.W_OK):
        raise PermissionError(0, "permission denied")
    for name in files:
        if (folder / name).is_dir():
            raise IsADirectoryError(0, f"'{name}' in it is a folder")


def _remove(folders: Iterable[Path]) -> None:
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()
