"""A store of bytes by key, for later processes: of data that takes long to make, and can be made again at any time.

The store may contain code that will run. So it is read only from a folder that nobody but the user (and the
administrator) can write to, and every entry carries the SHA-256 of its key and its bytes: what is read is, byte for
byte, what was stored under that key, or nothing. An entry that was cut off, overwritten, exchanged or made by others
counts as absent and is made again. A store that cannot be used, or a disk that is full, costs time and nothing else.
"""

import contextlib
import fcntl
import hashlib
import os
import shutil
import stat
import tempfile
import time
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import attrs

from armwright.errors import CacheWarning

# An entry begins with this; the SHA-256 and the bytes follow.
_SIGNATURE = b"armwright store 1\n"
_DIGEST = hashlib.sha256().digest_size
# Entries of armwright are much shorter; longer ones are not read [bytes].
_MAX_LENGTH = 1 << 28
_PARTIAL_SUFFIX = ".tmp"
# A killed process leaves a partial file; after this time no process still writes it [s].
_ABANDONED_AFTER = 3600.0
# A process waits this long for another that makes the same entry, which may have been stopped [s].
_LOCK_TIMEOUT = 120.0
_LOCK_POLL = 0.02
_PRIVATE_FOLDER, _PRIVATE_FILE = 0o700, 0o600
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


@attrs.frozen
class Store:
    """Bytes by key in one folder.

    Attributes:
        folder: of the entries; None where nothing can be stored.
    """

    folder: Path | None

    def get(self, key: str) -> bytes | None:
        """Return the bytes of a key, verified; None where there are none or they are damaged.

        Args:
            key: letters and digits.
        """
        if self.folder is None:
            return None
        try:
            entry = _read(self.folder / key)
        except OSError:
            return None
        start = len(_SIGNATURE) + _DIGEST
        data = entry[start:]
        return data if entry[:start] == _SIGNATURE + _checksum(key, data) else None

    def put(self, key: str, data: bytes) -> bool:
        """Store bytes under a key, in place of others there, and return whether they are stored.

        They are written to a temporary file, flushed to the disk and renamed: a reader finds all of them or none.

        Args:
            key: letters and digits.
            data: the bytes.
        """
        if self.folder is None:
            return False
        try:
            make_private(self.folder)
            _remove_abandoned_files(self.folder)
            _replace(self.folder / key, _SIGNATURE + _checksum(key, data) + data)
        except OSError:  # full, read-only, over a quota: the bytes will be made again
            return False
        return True

    @contextlib.contextmanager
    def locked(self, key: str) -> Iterator[None]:
        """Keep other processes from making the same entry meanwhile, as far as that can be done.

        Nothing depends on it but time: without the lock, two processes make the same entry.
        """
        with contextlib.ExitStack() as stack:
            with contextlib.suppress(OSError):
                self._lock(key, stack)
            yield

    def _lock(self, key: str, stack: contextlib.ExitStack) -> None:
        if self.folder is None:
            return
        make_private(self.folder)
        # One file for many keys: locks are never removed, since another process may be about to take one.
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
        handle = os.open(self.folder / f"{key[:2]}.lock", flags, _PRIVATE_FILE)
        stack.callback(os.close, handle)
        deadline = time.monotonic() + _LOCK_TIMEOUT
        while time.monotonic() < deadline:
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # A process that was forked meanwhile has the file open as well, and would keep the lock.
                stack.callback(fcntl.flock, handle, fcntl.LOCK_UN)
                return
            time.sleep(_LOCK_POLL)


def user_store(name: str) -> Store:
    """Return a store in the user's cache folder, which is not made before something is put in.

    Where others could change what lies there, nothing is read from it or kept in it, and a warning says so once.

    Args:
        name: of the store, a folder in the cache folder.
    """
    folder = cache_folder()
    return Store(None) if folder is None else _trusted_store(folder, name)


@cache
def _trusted_store(folder: Path, name: str) -> Store:
    reason = reason_for_distrust(folder / name)
    if not reason:
        return Store(folder / name)
    warnings.warn(
        f"compiled code is not cached: {reason}. Make the folder private, or name another one in ARMWRIGHT_CACHE",
        CacheWarning,
        stacklevel=2,
    )
    return Store(None)


def cache_folder() -> Path | None:
    """Return the user's cache folder: ``$ARMWRIGHT_CACHE``, or armwright where the system keeps such folders.

    None where the user has no home: no such variable is set and no such user is known, as in many containers; or where
    the variable counts from a working directory that is gone.
    """
    if own := os.environ.get("ARMWRIGHT_CACHE"):
        try:
            return Path(own).absolute()
        except FileNotFoundError:
            return None
    caches = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not caches.is_absolute():
        try:
            caches = Path.home() / ".cache"
        except RuntimeError:
            return None
    return caches / "armwright" if caches.is_absolute() else None


def make_private(folder: Path) -> None:
    """Make a folder and its parents where they are missing, for the user alone whatever the mask says.

    Raises:
        OSError: it cannot be made.
    """
    for missing in reversed([one for one in (folder, *folder.parents) if not one.exists()]):
        with contextlib.suppress(FileExistsError):
            missing.mkdir(mode=_PRIVATE_FOLDER)


def reason_for_distrust(folder: Path) -> str:
    """Return why somebody else could change the content of a folder, now or later; empty where nobody can.

    The folder itself, and the one above it, must belong to the user and be closed to the writing of others. So must
    all folders on the way to them, or be of the kind of /tmp, where nobody touches what belongs to others. The
    administrator is trusted; links count as what they lead to.

    Args:
        folder: there or not.
    """
    try:
        for part in (folder, *folder.parents):
            if part.is_symlink() and not _is_trusted(part.lstat().st_uid):
                return f"'{part}' is a link that belongs to another user"
        real = folder.resolve()
        for part in (real, *real.parents):
            if part.exists():
                reason = _reason_for_distrust_of(part, strict=part in (real, folder.parent.resolve()))
                if reason:
                    return reason
    except (OSError, RuntimeError):  # no leave to look, or a ring of links: then nothing can be read there either
        return ""
    return ""


def _reason_for_distrust_of(folder: Path, *, strict: bool) -> str:
    """Return why somebody else could change the content of a folder that exists."""
    about = folder.stat()
    if not _is_trusted(about.st_uid):
        return f"'{folder}' belongs to another user"
    writers = about.st_mode & _WRITABLE_BY_OTHERS
    if not writers or not stat.S_ISDIR(about.st_mode):
        return ""
    if not strict and (about.st_mode & stat.S_ISVTX or (writers == stat.S_IWGRP and _is_private_group(about.st_gid))):
        return ""
    return f"other users may write to '{folder}' (mode {stat.S_IMODE(about.st_mode):o})"


def _is_trusted(owner: int) -> bool:
    return owner in (0, os.geteuid())


def _is_private_group(group: int) -> bool:
    """Whether a group is the user's own: many systems give each user one, and let it write."""
    import grp  # noqa: PLC0415 - rarely asked
    import pwd  # noqa: PLC0415

    try:
        user, entry = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return user.pw_gid == group and user.pw_name == entry.gr_name and set(entry.gr_mem) <= {user.pw_name}


def _checksum(key: str, data: bytes) -> bytes:
    return hashlib.sha256(b"%s\n%s" % (key.encode(), data)).digest()


def _read(path: Path) -> bytes:
    """Return the bytes of a file that only the user can have written; they are checked as they lie in memory."""
    with open(path, "rb", opener=_opened) as file:
        about = os.fstat(file.fileno())
        sound = stat.S_ISREG(about.st_mode) and _is_trusted(about.st_uid) and not about.st_mode & _WRITABLE_BY_OTHERS
        return file.read(about.st_size) if sound and about.st_size < _MAX_LENGTH else b""


def _opened(path: str, _flags: int) -> int:
    """Open a file to be read: no link, and nothing that would be waited for."""
    return os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)


def _replace(path: Path, data: bytes) -> None:
    """Write a file whole, onto the disk and for the user alone, in place of what may have its name."""
    handle, name = tempfile.mkstemp(prefix=f"{path.name}.", suffix=_PARTIAL_SUFFIX, dir=path.parent)
    partial = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(handle)
        if path.is_dir() and not path.is_symlink():  # the name is ours
            shutil.rmtree(path)
        partial.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        raise


def _remove_abandoned_files(folder: Path) -> None:
    """Remove the partial files of killed processes."""
    long_ago = time.time() - _ABANDONED_AFTER
    for partial in folder.glob(f"*{_PARTIAL_SUFFIX}"):
        with contextlib.suppress(OSError):
            if partial.lstat().st_mtime < long_ago:
                partial.unlink()
