"""Staging folders, in which results are complete before they are moved to their folder.

A process holds a lock on its staging folder until it ends, however it ends. A folder whose lock is free was left by a
dead process, and is removed when the next results are written beside it.
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
_LOCK, NEW, BACKUP = "lock", "new", "kept"
# The content of a staging folder; a folder of that name with other content belongs to somebody else.
_CONTENT = {_LOCK, NEW, BACKUP}
_MAX_PATH_LENGTH = 65536
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextlib.contextmanager
def staging_folder(parent: Path, target: Path, inspect: Callable[[Path], None] | None = None) -> Iterator[Path]:
    """Make a staging folder, and remove it again, together with those of dead processes.

    Args:
        parent: its parent, on the file system of the results, so that they can be moved.
        target: path of the results.
        inspect: called with the results that a dead process has left for the same path, before they are removed.

    Yields:
        An empty folder.

    Raises:
        OSError: it cannot be made.
    """
    for place in {parent, target} if target.is_dir() else {parent}:
        remove_abandoned_folders(place, target, inspect)
    with _make_staging_folder(parent, target) as folder:
        new = folder / NEW
        new.mkdir()
        yield new


@contextlib.contextmanager
def _make_staging_folder(parent: Path, target: Path) -> Iterator[Path]:
    while True:
        folder = parent / f"{PREFIX}{secrets.token_hex(_DIGITS // 2)}"
        folder.mkdir()
        # Another process may remove the folder as abandoned before it is locked; then another one is made.
        with contextlib.suppress(FileNotFoundError):
            lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            if _try_lock(lock) is not False and (folder / _LOCK).exists():
                break
            os.close(lock)
    try:
        os.write(lock, os.fsencode(target))
        yield folder
    finally:
        with deferred_signals():
            _remove(folder)
            os.close(lock)


def remove_abandoned_folders(
    parent: Path, target: Path | None = None, inspect: Callable[[Path], None] | None = None
) -> None:
    """Remove the staging folders of dead processes; those of live ones stay.

    Args:
        parent: where they are.
        target: of whose results ``found`` is told.
        inspect: is shown what was made there of results for ``target``.
    """
    with contextlib.suppress(OSError):
        for folder in parent.glob(f"{PREFIX}*"):
            with contextlib.suppress(OSError):
                _remove_if_abandoned(folder, target, inspect)


def _remove_if_abandoned(folder: Path, target: Path | None, inspect: Callable[[Path], None] | None) -> None:
    state = folder.lstat()
    if not stat.S_ISDIR(state.st_mode) or state.st_uid != os.geteuid() or not _NAME.fullmatch(folder.name):
        return
    inside = {path.name for path in folder.iterdir()}
    if not inside:
        folder.rmdir()
    elif _LOCK in inside and inside <= _CONTENT:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            if stat.S_ISREG(os.fstat(lock).st_mode) and _try_lock(lock):
                has_same_target = target is not None and os.read(lock, _MAX_PATH_LENGTH) == os.fsencode(target)
                if inspect is not None and has_same_target:
                    inspect(folder / NEW)
                _remove(folder)
        finally:
            os.close(lock)


def _remove(folder: Path) -> None:
    """Remove a staging folder, its lock last, so that it counts as abandoned if this process is killed meanwhile."""
    for name in _CONTENT - {_LOCK}:
        shutil.rmtree(folder / name, ignore_errors=True)
    shutil.rmtree(folder, ignore_errors=True)


def _try_lock(file: int) -> bool | None:
    """Lock a file; return whether it was possible, and None where the file system has no locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


@contextlib.contextmanager
def deferred_signals() -> Iterator[None]:
    """Defer signals that end a process to the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        # Python hands signals to the main thread alone.
        yield
        return
    deferred: list[int] = []
    handlers: dict[int, Any] = {}
    try:
        for number in _SIGNALS:
            handler = signal.getsignal(number)
            if handler is not None and handler is not signal.SIG_IGN:
                handlers[number] = handler
                signal.signal(number, lambda number, _frame: deferred.append(number))
        yield
    finally:
        for changed, handler in handlers.items():
            signal.signal(changed, handler)
        if deferred:
            signal.raise_signal(deferred[0])
