"""Bytes by key, kept for the next process: what takes long to make, and can be made again at any time.

What lies in the store may be code that will run. So it is read only from a folder that nobody but the user (and the
administrator) can write to, and every entry carries the SHA-256 of its key and its bytes: what comes out is, byte for
byte, what went in under that key, or nothing. An entry that was cut off, overwritten, exchanged or made by others
counts as absent and is made anew. A store that cannot be used, or a disk that is full, costs time and nothing else.
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
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import attrs

from armwright.errors import CacheWarning

# What an entry begins with; behind it stand the SHA-256 and the bytes.
_MARK = b"armwright store 1\n"
_DIGEST = hashlib.sha256().digest_size
# No entry of ours comes near it; what is longer is not read [bytes].
_MAX_LENGTH = 1 << 28
_HALF = ".tmp"
# A half-written file is left by a process that was killed; after so long no process still writes it [s].
_FORGOTTEN = 3600.0
# So long a process waits for another that makes the same entry, which may have been stopped; then it makes its own [s].
_PATIENCE = 120.0
_GLANCE = 0.02
_PRIVATE_FOLDER, _PRIVATE_FILE = 0o700, 0o600
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


@attrs.frozen
class Store:
    """Bytes by key in one folder.

    Attributes:
        folder: where they lie; None where nothing can be kept.
    """

    folder: Path | None

    def get(self, key: str) -> bytes | None:
        """Return what was put under a key, checked; None where there is nothing or it is damaged.

        Args:
            key: letters and digits.
        """
        if self.folder is None:
            return None
        try:
            entry = _read(self.folder / key)
        except OSError:
            return None
        start = len(_MARK) + _DIGEST
        data = entry[start:]
        return data if entry[:start] == _MARK + _digest(key, data) else None

    def put(self, key: str, data: bytes) -> bool:
        """Keep bytes under a key, in place of what may be there, and return whether they are kept.

        They are written aside, forced onto the disk and renamed, so that a reader finds all of them or none.

        Args:
            key: letters and digits.
            data: what to keep.
        """
        if self.folder is None:
            return False
        try:
            make_private(self.folder)
            _clear(self.folder)
            _replace(self.folder / key, _MARK + _digest(key, data) + data)
        except OSError:  # full, read-only, over a quota: the bytes will be made again
            return False
        return True

    def made(self, key: str, make: Callable[[], bytes]) -> bytes:
        """Return what was put under a key; where there is nothing sound, make it and keep it.

        Of processes that want the same at once, one makes it and the others wait for it.

        Args:
            key: letters and digits.
            make: makes it.
        """
        data = self.get(key)
        if data is None:
            with self.alone(key):
                data = self.get(key)
                if data is None:
                    data = make()
                    self.put(key, data)
        return data

    @contextlib.contextmanager
    def alone(self, key: str) -> Iterator[None]:
        """Keep other processes from making the same entry meanwhile, as far as that can be done.

        Nothing depends on it but time: where the lock cannot be had, two processes make the same.
        """
        with contextlib.ExitStack() as stack:
            with contextlib.suppress(OSError):
                stack.enter_context(self._lock(key))
            yield

    @contextlib.contextmanager
    def _lock(self, key: str) -> Iterator[None]:
        if self.folder is None:
            raise FileNotFoundError
        make_private(self.folder)
        # One file for many keys: locks are never removed, since another process may be about to take one.
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK
        handle = os.open(self.folder / f"{key[:2]}.lock", flags, _PRIVATE_FILE)
        try:
            give_up = time.monotonic() + _PATIENCE
            while time.monotonic() < give_up:
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    time.sleep(_GLANCE)
            yield
        finally:
            os.close(handle)


def user_store(name: str) -> Store:
    """Return a store in the user's cache folder, which is not made before something is put in.

    Where others could change what lies there, nothing is read from it or kept in it, and a warning says so once.

    Args:
        name: of the store, a folder in the cache folder.
    """
    folder = cache_folder()
    if folder is None:
        return Store(None)
    return _store(folder, name)


@cache
def _store(folder: Path, name: str) -> Store:
    reason = distrust(folder / name)
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

    None where the user has no home: no such variable is set and no such user is known, as in many containers.
    """
    own = os.environ.get("ARMWRIGHT_CACHE")
    if own:
        return Path(own).absolute()
    caches = os.environ.get("XDG_CACHE_HOME", "")
    if Path(caches).is_absolute():
        return Path(caches) / "armwright"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    return home / ".cache" / "armwright" if home.is_absolute() else None


def make_private(folder: Path) -> None:
    """Make a folder and its parents where they are missing, for the user alone whatever the mask says.

    Raises:
        OSError: it cannot be made.
    """
    for missing in reversed([one for one in (folder, *folder.parents) if not one.exists()]):
        with contextlib.suppress(FileExistsError):
            missing.mkdir(mode=_PRIVATE_FOLDER)


def distrust(folder: Path) -> str:
    """Say why somebody else could change what lies in a folder, or would lie in it; empty where nobody can.

    The folder itself, and the one above it, must belong to the user and be closed to the writing of others. So must
    all folders on the way to them, or be of the kind of /tmp, where nobody touches what belongs to others. The
    administrator is trusted; links count as what they lead to.

    Args:
        folder: there or not.
    """
    try:
        for part in (folder, *folder.parents):
            if part.is_symlink() and not _trusted(part.lstat().st_uid):
                return f"'{part}' is a link that belongs to another user"
        real = folder.resolve()
        for part in (real, *real.parents):
            if part.exists():
                reason = _weakness(part, strict=part in (real, folder.parent.resolve()))
                if reason:
                    return reason
    except (OSError, RuntimeError):  # no leave to look, or a ring of links: then nothing can be read there either
        return ""
    return ""


def _weakness(folder: Path, *, strict: bool) -> str:
    """Say why somebody else could change what a folder holds."""
    about = folder.stat()
    if not _trusted(about.st_uid):
        return f"'{folder}' belongs to another user"
    writers = about.st_mode & _OTHERS_WRITE
    if not writers or not stat.S_ISDIR(about.st_mode):
        return ""
    if not strict and (about.st_mode & stat.S_ISVTX or (writers == stat.S_IWGRP and _only_member(about.st_gid))):
        return ""
    return f"other users may write to '{folder}' (mode {stat.S_IMODE(about.st_mode):o})"


def _trusted(owner: int) -> bool:
    return owner in (0, os.geteuid())


def _only_member(group: int) -> bool:
    """Whether a group is the user's own: many systems give each user one, and let it write."""
    import grp  # noqa: PLC0415 - rarely asked
    import pwd  # noqa: PLC0415

    try:
        user, entry = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return user.pw_gid == group and user.pw_name == entry.gr_name and set(entry.gr_mem) <= {user.pw_name}


def _digest(key: str, data: bytes) -> bytes:
    return hashlib.sha256(b"%s\n%s" % (key.encode(), data)).digest()


def _read(path: Path) -> bytes:
    """Return the bytes of a file that only the user can have written; they are checked as they lie in memory."""
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with os.fdopen(handle, "rb") as file:
        about = os.fstat(handle)
        sound = stat.S_ISREG(about.st_mode) and _trusted(about.st_uid) and not about.st_mode & _OTHERS_WRITE
        return file.read(about.st_size) if sound and about.st_size < _MAX_LENGTH else b""


def _replace(path: Path, data: bytes) -> None:
    """Write a file whole, onto the disk and for the user alone, in place of what may have its name."""
    handle, name = tempfile.mkstemp(prefix=f"{path.name}.", suffix=_HALF, dir=path.parent)
    half = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(handle)
        if path.is_dir() and not path.is_symlink():  # the name is ours
            shutil.rmtree(path)
        half.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            half.unlink(missing_ok=True)
        raise


def _clear(folder: Path) -> None:
    """Remove what killed processes left half-written."""
    long_ago = time.time() - _FORGOTTEN
    for half in folder.glob(f"*{_HALF}"):
        with contextlib.suppress(OSError):
            if half.lstat().st_mtime < long_ago:
                half.unlink()
