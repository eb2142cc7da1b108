"""Files that take the place of others: all of them or none, and where they stand if they cannot be replaced."""

import contextlib
import os
from collections.abc import Iterable
from io import FileIO
from pathlib import Path


def exchange_files(folder: Path, new: Path, kept: Path, names: Iterable[str], gone: Iterable[str]) -> None:
    """Move files into a folder; where one cannot be moved, those that were there come back.

    A file that is mounted by itself cannot be replaced, nor one of somebody else in a folder like /tmp; that shows
    only when it is tried.

    Args:
        folder: where they go.
        new: where they were made, on the same file system.
        kept: an empty folder there, for what was in their place.
        names: of the files, in the order in which they are moved.
        gone: names of files in the folder that are taken away.

    Raises:
        OSError: a file cannot be moved; the folder is as it was.
    """
    aside: list[str] = []
    placed: list[str] = []
    try:
        for name in gone:
            (folder / name).replace(kept / name)
            aside.append(name)
        for name in names:
            if _back_up(folder / name, kept / name):
                aside.append(name)
            (new / name).replace(folder / name)
            placed.append(name)
    except BaseException:
        for name in {*placed} - {*aside}:
            with contextlib.suppress(OSError):
                (folder / name).unlink()
        for name in reversed(aside):
            with contextlib.suppress(OSError):
                (kept / name).replace(folder / name)
        raise


def overwrite(path: Path, data: bytes) -> None:
    """Write a file where it stands, which can be done where it cannot be replaced.

    Args:
        path: of a file that is there.
        data: its bytes from now on.

    Raises:
        OSError: it cannot be written; its old bytes are there again.
    """
    with path.open("r+b", buffering=0) as file:
        old = file.read()
        try:
            _write_in_place(file, data)
        except BaseException:
            with contextlib.suppress(OSError):
                _write_in_place(file, old)
            raise


def _back_up(path: Path, kept: Path) -> bool:
    """Keep a file under a second name, or move it there; return whether there was one."""
    try:
        os.link(path, kept, follow_symlinks=False)
    except FileNotFoundError:
        return False
    except OSError:  # not every file system has second names
        path.replace(kept)
    return True


def _write_in_place(file: FileIO, data: bytes) -> None:
    """Write bytes over those of a file; its space is given back last, so that the old ones would find it again."""
    file.seek(0)
    left = memoryview(data)
    while left:
        left = left[file.write(left) :]
    file.truncate()
    os.fsync(file.fileno())
