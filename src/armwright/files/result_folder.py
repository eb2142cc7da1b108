"""Folders in which results are made whole before they are moved to their place.

A process holds a lock on its own until it ends, however it ends; so a folder whose lock is free is a dead process's,
and goes with the next results that are written beside it.
"""

import contextlib
import fcntl
import os
import re
import secrets
import shutil
import signal
import stat
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

PREFIX = ".armwright-"
_DIGITS = 16
_NAME = re.compile(rf"{re.escape(PREFIX)}[0-9a-f]{{{_DIGITS}}}")
_LOCK, NEW, KEPT = "lock", "new", "kept"
# What is in a staging folder; a folder of that name with anything else in it is somebody else's.
_OWN = {_LOCK, NEW, KEPT}
_MAX_PATH_LENGTH = 65536
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextlib.contextmanager
def staging(parent: Path, target: Path, found: Callable[[Path], None] | None = None) -> Iterator[Path]:
    """Make a folder beside results, and remove it again, with those that dead processes have left there.

    Args:
        parent: where it is made; on the file system of the results, so that they can be moved.
        target: where the results will stand.
        found: is shown what a dead process has left of results for the same place, before it is removed.

    Yields:
        An empty folder.

    Raises:
        OSError: it cannot be made.
    """
    for place in {parent, target} if target.is_dir() else {parent}:
        remove_abandoned(place, target, found)
    with _made(parent, target) as folder:
        new = folder / NEW
        new.mkdir()
        yield new


@contextlib.contextmanager
def _made(parent: Path, target: Path) -> Iterator[Path]:
    while True:
        folder = parent / f"{PREFIX}{secrets.token_hex(_DIGITS // 2)}"
        folder.mkdir()
        # Somebody who cleans up may take the folder for abandoned before it is locked; then there is another.
        with contextlib.suppress(FileNotFoundError):
            lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            if _locked(lock) is not False and (folder / _LOCK).exists():
                break
            os.close(lock)
    try:
        os.write(lock, os.fsencode(target))
        yield folder
    finally:
        with signals_held():
            _remove(folder)
            os.close(lock)


def remove_abandoned(parent: Path, target: Path | None = None, found: Callable[[Path], None] | None = None) -> None:
    """Remove the staging folders that processes have left which ended before they could; those of live ones stay.

    Args:
        parent: where they are.
        target: of whose results ``found`` is told.
        found: is shown what was made there of results for ``target``.
    """
    with contextlib.suppress(OSError):
        for folder in parent.glob(f"{PREFIX}*"):
            with contextlib.suppress(OSError):
                _remove_if_abandoned(folder, target, found)


def _remove_if_abandoned(folder: Path, target: Path | None, found: Callable[[Path], None] | None) -> None:
    state = folder.lstat()
    if not stat.S_ISDIR(state.st_mode) or state.st_uid != os.geteuid() or not _NAME.fullmatch(folder.name):
        return
    inside = {path.name for path in folder.iterdir()}
    if not inside:
        folder.rmdir()
    elif _LOCK in inside and inside <= _OWN:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            if stat.S_ISREG(os.fstat(lock).st_mode) and _locked(lock):
                if found is not None and target is not None and os.read(lock, _MAX_PATH_LENGTH) == os.fsencode(target):
                    found(folder / NEW)
                _remove(folder)
        finally:
            os.close(lock)


def _remove(folder: Path) -> None:
    """Remove a staging folder, its lock last: whoever is killed meanwhile leaves one that is known for abandoned."""
    for name in _OWN - {_LOCK}:
        shutil.rmtree(folder / name, ignore_errors=True)
    shutil.rmtree(folder, ignore_errors=True)


def _locked(file: int) -> bool | None:
    """Lock a file; return whether it could be, and None where the file system knows no locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Hold signals that end a process until the block is done; then they have their effect."""
    if threading.current_thread() is not threading.main_thread():
        # Python hands signals to the main thread alone.
        yield
        return
    held: list[int] = []
    handlers: dict[int, Any] = {}
    try:
        for number in _SIGNALS:
            handler = signal.getsignal(number)
            if handler is not None and handler is not signal.SIG_IGN:
                handlers[number] = handler
                signal.signal(number, lambda number, _frame: held.append(number))
        yield
    finally:
        for known, handler in handlers.items():
            signal.signal(known, handler)
        if held:
            signal.raise_signal(held[0])
