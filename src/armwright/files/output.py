"""Writing results: a folder gets all of its files or none, a file all of its text or none.

The files are made in a staging folder and moved in when all are whole. What a folder of results holds stands in its
``run.json``, with the SHA-256 hash of every file. It is moved in last: where a process was killed between two moves,
the hashes tell which files are not of the run that the folder speaks of.
"""

import contextlib
import errno
import fcntl
import hashlib
import json
import os
import re
import stat
import sys
from codecs import BOM_UTF8
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from armwright.errors import OutputError
from armwright.files.exchange import exchange_files, overwrite
from armwright.files.inputs import decode, is_source, read_bytes, regular_file
from armwright.files.result_folder import BACKUP, PREFIX, deferred_signals, staging_folder

Content: TypeAlias = str | bytes | Iterable[str]

# What this process has written, in order, as it was named: who is interrupted afterwards says so.
WRITTEN: dict[Path, None] = {}
# What a folder holds, and the word by which it is known for one of armwright's.
RECORD = "run.json"
FORMAT = "armwright results 1"
# What results are called: a record is data, and only what has such a name is ever removed because a record names it.
_RESULT_NAMES = re.compile(
    r"(motion|measured|samples|path|corners|dh_\w+)\.csv|events\.jsonl|(frames|move|errors|measures|tables|summary)\.json|"
    r"report\.html|arm\.(toml|urdf)|(log|bag)\.mcap|metadata\.yaml|calibration\.conf|kinematics\.yaml|camera\.toml|move\.(gif|mp4)|"
    r"(figure[\w.-]*|\d\d+-[\w -]+|joints|hand|paths?|residuals|distances|workspace|verification|bearings|error|"
    r"spectrum|forces|energy)\.svg|seen-\d+\.png|ARM_\d+\.(csv|trajectory\.yaml|goal\.yaml)|(events|proof)\.json|"
    r"[A-Za-z]\w*\.(script|src|mod|ls)"
)
# A record that is larger is none of ours [bytes], and hashes are worked out in pieces [bytes].
_LARGEST_RECORD, _PIECE = 200_000_000, 1 << 20
# Links that a path may lead through, as Linux has it.
_MAX_LINKS = 40


def write_folder(folder: Path, files: Mapping[str, Content], record: Mapping[str, Any] | None = None) -> None:
    """Write files into a folder, all of them or none, in place of the results that were there.

    They are made beside the folder, or in it where it is a mount point or where nothing can be made beside it, and
    moved in when all are whole; signals wait meanwhile. An error, a full disk or an interruption leaves what was there
    before. Files of older results that are not written anew go; other files in the folder stay, those that a record
    of somebody else's names too.

    Args:
        folder: made where it is missing, with its parents.
        files: by name: the text, or pieces of it that are written as they come; or bytes.
        record: what ``run.json`` says beside the hashes of the files.

    Raises:
        OutputError: the folder or a file cannot be written; the text says which and why.
    """
    named, folder = folder, _resolve(folder)
    left: dict[str, str] = {}
    with (
        _make_parents(folder, lambda error: f"cannot write to '{folder}': {folder_error_text(error, folder)}"),
        staging_folder(_staging_parent(folder), folder, lambda dead: left.update(recorded_hashes(dead))) as new,
    ):
        hashes = {name: _write(new / name, content) for name, content in files.items()}
        _write(new / RECORD, record_text(hashes, record or {}))
        with deferred_signals():
            _replace(folder, new, [*files, RECORD], left)
            WRITTEN[named] = None


def write_file(path: Path, text: Content, *, back: bool = False) -> None:
    """Write one file, or leave what was there before. A link stays one, and so do its owner and who may read the file.

    A file that cannot be replaced is written where it stands: one that is mounted by itself, as into a container, one
    that the user may write to in a folder where nothing can be made, one of somebody else, and one of several names.

    Args:
        path: its folder is made where it is missing, with its parents. A device, a pipe or an open descriptor, such as
            ``/dev/stdout``, is written to as it is.
        text: or pieces of it that are written as they come; or bytes.
        back: it may be a file that was read, and is to be changed.

    Raises:
        OutputError: it cannot be written, or it was read; the text says why.
    """
    if (number := descriptor(path)) is not None:
        _write_to_descriptor(number, path, text)
        return
    if path == Path("-"):
        raise OutputError("cannot write '-': expected the name of a file, or /dev/stdout for the standard output")
    named, path = path, _resolve(path)
    if not back and is_source(path):
        raise OutputError(
            f"cannot write '{named}': it is an input of this command and would be overwritten; name another file"
        )
    with _make_parents(path, lambda error: f"cannot write '{path}': {error.strerror or error}"):
        there = path.stat() if path.exists() else None
        if there is not None and not stat.S_ISREG(there.st_mode) and not stat.S_ISDIR(there.st_mode):
            with path.open("wb") as stream:
                stream.writelines(_encode(text))
        elif there is not None and _must_overwrite(path, there):
            data = b"".join(_encode(text))
            with deferred_signals():
                overwrite(path, data)
                WRITTEN[named] = None
        else:
            _write_beside(path, named, text, there)


def write_back(path: Path, before: str, text: str, bound: str = "table_mb") -> None:
    """Replace the text of a file that was read, completely or not at all; links and permissions are preserved.

    The most frequent line ending of the file is used, and a byte order mark is preserved.

    Args:
        path: the file; where it is missing, it is made.
        before: its text as it was read.
        text: its new text.
        bound: the name of the limit of its size, in MB.

    Raises:
        FileFormatError: the file cannot be read any more.
        OutputError: the file cannot be written, or has changed since; the message has the reason.
    """
    # A pipe would be waited for, for ever.
    data = read_bytes(regular_file(path), bound) if path.exists() else b""
    if decode(data, path) != before:
        raise OutputError(f"cannot write '{path}': it has changed since it was read; nothing was written")
    mark = "\ufeff" if data.startswith(BOM_UTF8) else ""
    end = "\r\n" if 2 * data.count(b"\r\n") > data.count(b"\n") else "\n"
    write_file(path, mark + text.replace("\n", end), back=True)


def descriptor(path: Path) -> int | None:
    """Return the number of the open descriptor that a path names, such as ``/dev/stdin``; None where it names none."""
    folders = (Path(f"/proc/{os.getpid()}/fd"), Path("/dev/fd"))
    with contextlib.suppress(OSError, ValueError):
        for _ in range(_MAX_LINKS):
            folder = path.parent.resolve()
            if folder in folders and path.name.isascii() and path.name.isdigit():
                return int(path.name[:9])
            path = folder / path.readlink()
    return None


def _write_to_descriptor(number: int, path: Path, text: Content) -> None:
    """Write into an open descriptor, behind what was printed so far."""
    try:
        sys.stdout.flush()
        with os.fdopen(os.dup(number), "wb") as stream:
            stream.writelines(_encode(text))
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(f"cannot write '{path}': {error.strerror or error}") from error


def _must_overwrite(path: Path, there: os.stat_result) -> bool:
    """Whether a file is written where it stands: beside it nothing can be made, or it has several names."""
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "it is write-protected")
    return there.st_nlink > 1 or not os.access(path.parent, os.W_OK | os.X_OK)


def _write_beside(path: Path, named: Path, text: Content, there: os.stat_result | None) -> None:
    """Write a file beside its place, and move it there.

    Args:
        path: where it goes.
        named: how the user calls it.
        text: what is in it.
        there: the state of the file that is there; None where there is none.
    """
    with staging_folder(path.parent, path) as new:
        made = new / path.name
        _write(made, text)
        with deferred_signals():
            try:
                if there is not None:
                    _copy_owner_and_mode(made, there)
                made.replace(path)
            except OSError as error:
                if error.errno not in (errno.EBUSY, errno.EPERM) or there is None:
                    raise
                overwrite(path, made.read_bytes())
            WRITTEN[named] = None


def _copy_owner_and_mode(path: Path, there: os.stat_result) -> None:
    """Give a file the owner and the mode of another; an ``EPERM`` where that is not allowed."""
    made = path.stat()
    if (made.st_uid, made.st_gid) != (there.st_uid, there.st_gid):
        os.chown(path, there.st_uid, there.st_gid)
    path.chmod(stat.S_IMODE(there.st_mode))


def record_text(hashes: Mapping[str, str], said: Mapping[str, Any]) -> str:
    """Return the text of ``run.json``.

    Args:
        hashes: SHA-256 of every file of the results, by name.
        said: what else it says.
    """
    return json.dumps({"format": FORMAT, **said, "files": dict(hashes)}, indent=2, ensure_ascii=False) + "\n"


def stray_files(folder: Path) -> tuple[str, ...]:
    """Return the files that do not belong to the results of a folder: changed, missing, or of another run.

    Args:
        folder: of results.

    Returns:
        Their names, sorted; empty where all is as it was written, or where the folder holds no results of armwright.
    """
    return tuple(sorted(name for name, digest in recorded_hashes(folder).items() if sha256(folder / name) != digest))


def is_stray(path: Path) -> bool:
    """Whether a file stands in a folder of results, and is not what the run of that folder has written.

    One that the run has not written at all is somebody's own, unless files of the run are missing or changed: then it
    may be of another run, which was killed before it wrote its record.
    """
    digest = recorded_hashes(path.parent).get(path.name)
    if digest is None:
        return path.name != RECORD and path.exists() and bool(stray_files(path.parent))
    return sha256(path) != digest


def sha256(path: Path) -> str | None:
    """Return the SHA-256 hash of a file; None where there is no such file."""
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return None
        digest = hashlib.sha256()
        with path.open("rb") as file:
            while piece := file.read(_PIECE):
                digest.update(piece)
    except OSError:
        return None
    return digest.hexdigest()


def folder_error_text(error: OSError, folder: Path) -> str:
    """Say why a folder cannot be made or written to; of a file that is in its place, that it is one."""
    for place in (folder, *folder.parents):
        if place.is_file():
            return "it is a file; expected a folder" if place == folder else f"'{place}' is a file"
    return error.strerror or str(error)


def _staging_parent(folder: Path) -> Path:
    """Return where results are staged: beside their folder, or in it where they could not be moved from there."""
    parent = folder.parent
    if not folder.is_dir():
        return parent
    movable = not folder.is_mount() and folder.stat().st_dev == parent.stat().st_dev
    return parent if movable and os.access(parent, os.W_OK | os.X_OK) else folder


def _resolve(path: Path) -> Path:
    """Return the target of a path: symbolic links are kept, and their target is replaced."""
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise OutputError(f"cannot write {str(path)!r}: {error}; nothing was written") from error


def _replace(folder: Path, new: Path, names: list[str], left: Mapping[str, str]) -> None:
    """Move results in; a folder that does not exist yet comes as a whole.

    Args:
        folder: of the results.
        new: where they were made.
        names: of the files, in the order in which they are moved.
        left: hashes of files that a process was about to move in when it was killed.
    """
    if not folder.exists():
        new.replace(folder)
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with contextlib.suppress(OSError):  # no other process moves results into the folder meanwhile
            fcntl.flock(handle, fcntl.LOCK_EX)
        named = recorded_hashes(folder)
        # What somebody has changed since is theirs.
        gone = {
            name
            for name, digest in (*named.items(), *left.items())
            if name not in names and _RESULT_NAMES.fullmatch(name) and sha256(folder / name) == digest
        }
        _refuse_to_replace(folder, names, gone, {*named, *left})
        kept = new.with_name(BACKUP)
        kept.mkdir()
        exchange_files(folder, new, kept, names, gone)
        with contextlib.suppress(OSError):  # the moves outlive a power cut
            os.fsync(handle)
    finally:
        os.close(handle)


def _read_record(folder: Path) -> dict[str, Any] | None:
    """Return what the record of a folder says; None where there is none of ours."""
    path = folder / RECORD
    try:
        state = path.lstat()
        if not stat.S_ISREG(state.st_mode) or state.st_size > _LARGEST_RECORD:
            return None
        said = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    ours = isinstance(said, dict) and said.get("format") == FORMAT and isinstance(said.get("files"), dict)
    return said if ours else None


def recorded_hashes(folder: Path) -> dict[str, str]:
    """Return the hashes of the files that the record of a folder names; none where it is no record of ours."""
    files = (_read_record(folder) or {}).get("files", {})
    # A record is data: it names files of its own folder, and nothing else.
    return {name: digest for name, digest in files.items() if isinstance(digest, str) and _is_file_name(name)}


def _is_file_name(name: str) -> bool:
    """Whether a text is the name of a file in a folder, and not of one in which results are made."""
    try:
        os.fsencode(name)
    except UnicodeEncodeError:
        return False
    return name not in ("", "..") and name == Path(name).name and "\0" not in name and not name.startswith(PREFIX)


def _write(path: Path, content: Content) -> str:
    """Write a file to the disk and return its SHA-256 hash."""
    digest = hashlib.sha256()
    with path.open("wb") as file:
        for data in _encode(content):
            digest.update(data)
            file.write(data)
        file.flush()
        os.fsync(file.fileno())
    return digest.hexdigest()


def _encode(content: Content) -> Iterator[bytes]:
    for piece in [content] if isinstance(content, str | bytes) else content:
        yield piece if isinstance(piece, bytes) else piece.encode("utf-8", errors="backslashreplace")


@contextlib.contextmanager
def _make_parents(path: Path, message: Callable[[OSError], str]) -> Iterator[None]:
    """Make the missing folders above a path, and remove them again where writing it fails."""
    with contextlib.ExitStack() as made:
        for folder in [parent for parent in path.parents if not parent.exists()][::-1]:
            made.callback(_remove_empty, folder)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot make '{path.parent}': {folder_error_text(error, path.parent)}; nothing was written"
            ) from error
        try:
            yield
        except OSError as error:
            raise OutputError(f"{message(error)}; nothing was written") from error
        made.pop_all()


def _remove_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


def _refuse_to_replace(folder: Path, names: Collection[str], gone: Collection[str], known: Collection[str]) -> None:
    """Fail before the first file is moved in, not between two.

    Args:
        folder: of the results.
        names: of the files that are moved in.
        gone: names of files that are taken away.
        known: names of files that a run has written.

    Raises:
        OSError: the folder cannot be written to; it has a folder of such a name, a file of the user's, or one that was
            read for the results.
    """
    if not os.access(folder, os.W_OK):
        raise PermissionError(0, "permission denied")
    ours = {*known, RECORD} if _read_record(folder) is not None else known
    for name in names:
        if (folder / name).is_dir():
            raise IsADirectoryError(0, f"it contains a folder '{name}'")
        if name not in ours and os.path.lexists(folder / name):
            why = "is not a result of armwright and would be overwritten: move it, or name another folder"
            raise FileExistsError(errno.EEXIST, f"it contains '{name}', which {why}")
    for name in sorted({*names, *gone}):
        if is_source(folder / name):
            why = "which would be overwritten: name another folder"
            raise FileExistsError(errno.EEXIST, f"it contains the input '{name}', {why}")
