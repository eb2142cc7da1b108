"""The folder of a sweep: what it is of, the blocks that are finished, and one process at a time.

    sweep.json          what the sweep is of, and with which versions it was begun
    blocks/000007.npz   the rows of one block, with a checksum
    results.nc          the results, made of the blocks when all are finished
    run.json            the SHA-256 hash of the results
    lock                held by the process at work

Every file is written under another name and moved when it is whole and on the disk. What is read back is checked; what
is damaged is named and left as it is, for its numbers may have taken hours.
"""

import contextlib
import errno
import fcntl
import hashlib
import json
import os
import platform
import re
import stat
import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np
import scipy

from armwright.errors import FileFormatError, KindError, OutputError, shown
from armwright.files.output import RECORD
from armwright.files.reading import read_text, regular
from armwright.sweep.designs import Design
from armwright.sweep.errors import SweepError
from armwright.sweep.task import Rows, Task
from armwright.version import __version__

_FORMAT = 1
MANIFEST, _BLOCKS, RESULTS, _LOCK = "sweep.json", "blocks", "results.nc", "lock"
_HALF = ".tmp"
# What a process that was killed may have left half written. Other names in the folder are not ours.
_HALVES = (*(f"{name}{_HALF}" for name in (MANIFEST, RESULTS, RECORD)), f"{_BLOCKS}/*.npz{_HALF}.npz")
_HALF_BLOCK = re.compile(rf"[0-9]{{6,}}\.npz{re.escape(_HALF)}\.npz")
# What the lock says begins with this; an empty one was just made.
_HOLDER = "process "
_LONGEST_HOLDER = 1000


def identity(task: Task, design: Design) -> dict[str, Any]:
    """Return what a sweep is known by, as JSON holds it: two sweeps of which this is equal have equal results.

    Raises:
        KindError: a setting of the task is nothing that JSON holds.
    """
    told = {
        "armwright": __version__,
        "task": task.name,
        "settings": {name: _as_json(value, f"setting '{name}'") for name, value in task.settings.items()},
        "outputs": {name: [list(one.dims), one.units, one.description] for name, one in task.outputs.items()},
        "axes": {
            name: [axis.values.size, axis.units, axis.description, _digest(axis.values.tobytes())]
            for name, axis in task.axes.items()
        },
        "design": {
            "kind": design.kind,
            "runs": len(design),
            "seed": design.seed,
            "ranges": {name: list(numbers) for name, numbers in design.ranges.items()},
            "parameters": [[name, design.units[name]] for name in design.names],
            "points": _digest(design.points.tobytes()),
        },
    }
    return dict(json.loads(json.dumps(told)))


@attrs.frozen(kw_only=True)
class Folder:
    """A folder that this process holds.

    Attributes:
        path: where it is.
        sweep: what it is of; see ``identity``.
        block: rows per block.
        made: when and with which versions it was begun.
        task: what is done; its outputs are what blocks hold.
        runs: of the whole sweep.
    """

    path: Path
    sweep: Mapping[str, Any]
    block: int
    made: Mapping[str, str]
    task: Task
    runs: int
    _key: bytes = attrs.field(
        init=False, default=attrs.Factory(lambda self: json.dumps(self.sweep, sort_keys=True).encode(), takes_self=True)
    )

    @property
    def results(self) -> Path:
        """Where the results are, or will be."""
        return self.path / RESULTS

    @property
    def blocks(self) -> int:
        """The number of blocks of the whole sweep."""
        return -(-self.runs // self.block)

    def rows_of(self, number: int) -> slice:
        """Return the runs of a block."""
        return slice(number * self.block, min((number + 1) * self.block, self.runs))

    def keep(self, number: int, rows: Rows) -> None:
        """Write a block.

        Raises:
            OutputError: it cannot be written.
        """
        arrays: dict[str, Any] = {f"output_{name}": value for name, value in rows.values.items()}
        arrays |= {"status": rows.status, "message": np.array(rows.message, dtype=np.str_)}
        arrays["checksum"] = np.array(self._checksum(number, arrays))

        def write(half: Path) -> None:
            np.savez(half, **arrays)

        write_whole(self._block(number), write, suffix=f"{_HALF}.npz")

    def kept(self, number: int) -> Rows | None:
        """Return a block as it was written; None if it is not there.

        Raises:
            FileFormatError: it is damaged; its file stays as it is.
        """
        path = self._block(number)
        if path.exists() and not path.is_file():
            raise self._damaged(number, "it is not a file")
        try:
            with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                _refuse_compressed(file.zip)
                arrays = {name: file[name] for name in file.files}
            checksum = str(arrays.pop("checksum"))
        except FileNotFoundError:
            return None
        except Exception as error:  # zip files and arrays fail in many ways
            raise self._damaged(number, shown(error)) from error
        if checksum != self._checksum(number, arrays):
            raise self._damaged(number, "its checksum is not that of its numbers, or of another block")
        values = {name: arrays[f"output_{name}"] for name in self.task.outputs}
        return Rows(values, arrays["status"], tuple(arrays["message"].tolist()))

    def _damaged(self, number: int, why: str) -> FileFormatError:
        rows = self.rows_of(number)
        return FileFormatError(
            self._block(number),
            None,
            "",
            f"damaged: {why}; it stays as it is; move it away or delete it and start again: only its runs, "
            f"{rows.start} to {rows.stop - 1}, are done again",
        )

    def _block(self, number: int) -> Path:
        return self.path / _BLOCKS / f"{number:06d}.npz"

    def _checksum(self, number: int, arrays: Mapping[str, Any]) -> str:
        """Return a checksum of a block that no block of another sweep or place has."""
        parts = [self._key, f"block {number} of {self.block}".encode()]
        for name in sorted(arrays):
            parts += [f"{name} {arrays[name].dtype.str} {arrays[name].shape}".encode(), arrays[name].tobytes()]
        return _digest(*parts)


@contextlib.contextmanager
def held(path: Path, task: Task, design: Design, block: int) -> Iterator[Folder]:
    """Hold the folder of a sweep, begun now or earlier, while other processes are kept out.

    Args:
        path: made where it is missing, with its parents.
        task: what is done.
        design: where.
        block: rows per block; a folder that was begun earlier keeps its own.

    Raises:
        FileFormatError: its ``sweep.json`` cannot be read.
        KindError: a setting of the task is nothing that JSON holds.
        OutputError: the folder cannot be made or written to.
        SweepError: the folder is of another sweep or of something else, or another process holds it.
    """
    sweep = identity(task, design)
    path = path.absolute()
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock = _lock(path)
    except OSError as error:
        reason = "it is a file, and a folder is needed" if path.is_file() else error.strerror or error
        raise OutputError(f"cannot write to '{path}': {reason}") from error
    with lock:
        _take(lock, path)
        told = _begun(path, sweep, block)
        folder = Folder(
            path=path, sweep=sweep, block=told["block"], made=told["made"], task=task, runs=design.points.shape[0]
        )
        for half in _halves(path):
            half.unlink(missing_ok=True)
        yield folder


def _begun(path: Path, sweep: dict[str, Any], block: int) -> dict[str, Any]:
    """Return what the manifest says; write it if there is none."""
    manifest = path / MANIFEST
    if manifest.exists():
        told = _read_manifest(manifest)
        _compare(path, told["sweep"], sweep)
        return told
    told = {"format": _FORMAT, "block": block, "made": _versions(), "sweep": sweep}
    write_text_whole(manifest, json.dumps(told, indent=2, ensure_ascii=False) + "\n")
    return told


def write_text_whole(path: Path, text: str) -> None:
    """Write a text whole and onto the disk, or leave what was there before.

    Raises:
        OutputError: it cannot be written; the text says why.
    """

    def write(half: Path) -> None:
        half.write_text(text, encoding="utf-8")

    write_whole(path, write)


def write_whole(path: Path, write: Callable[[Path], None], suffix: str = _HALF) -> None:
    """Write a file whole and onto the disk, or leave what was there before.

    Args:
        path: the file; its folder is made where it is missing.
        write: writes what belongs there to another path.
        suffix: of that other path.

    Raises:
        OutputError: it cannot be written; the text says why.
    """
    half = path.with_name(path.name + suffix)
    try:
        try:
            path.parent.mkdir(exist_ok=True)
            half.unlink(missing_ok=True)  # a link of that name would be written through
            write(half)
            _onto_disk(half)
            half.replace(path)
            _onto_disk(path.parent)
        except BaseException:
            with contextlib.suppress(OSError):
                half.unlink(missing_ok=True)
            raise
    except OSError as error:
        full = " Make room and start again: it goes on from there." if _is_full(error) else ""
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write '{path}': {reason}; what was finished before stays.{full}") from error


def _is_full(error: OSError) -> bool:
    return error.errno in (errno.ENOSPC, errno.EDQUOT)


def _onto_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _lock(path: Path) -> IO[str]:
    """Open the lock of a folder, which holds a sweep or nothing; a link or a file of somebody else's is left alone."""
    _refuse_other_things(path)
    handle = os.open(path / _LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
    lock = os.fdopen(handle, "r+", encoding="utf-8", errors="replace")
    says = lock.read(_LONGEST_HOLDER) if stat.S_ISREG(os.fstat(handle).st_mode) else None
    if says is None or (says and not says.startswith(_HOLDER)):
        lock.close()
        raise SweepError(f"'{path / _LOCK}' is not the lock of a sweep; give the sweep a folder of its own")
    return lock


def _take(lock: IO[str], path: Path) -> None:
    """Lock a folder for this process; the lock ends with the process, however it ends."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        lock.seek(0)
        holder = lock.read(_LONGEST_HOLDER).strip() or "another process"
        raise SweepError(f"'{path}' is in use: {holder} works on it; wait until it is done") from error
    lock.seek(0)
    lock.truncate()
    lock.write(f"{_HOLDER}{os.getpid()} on {platform.node()}, since {_now()}\n")
    lock.flush()


def _halves(path: Path) -> list[Path]:
    """Return the files that a process left half written."""
    found = [half for pattern in _HALVES for half in path.glob(pattern) if half.is_symlink() or half.is_file()]
    return [half for half in found if half.parent == path or _HALF_BLOCK.fullmatch(half.name)]


def _refuse_other_things(path: Path) -> None:
    ours = {path / _LOCK, path / MANIFEST, *_halves(path)}
    strange = sorted(one.name for one in path.iterdir() if one not in ours)
    if strange and not (path / MANIFEST).exists():
        raise SweepError(
            f"'{path}' holds no sweep, but other things ('{strange[0]}'); give the sweep a folder of its own"
        )


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        told = json.loads(read_text(regular(path)))
        sound = isinstance(told["sweep"], dict) and type(told["block"]) is int and told["block"] >= 1
        sound = sound and all(isinstance(told["made"][name], str) for name in ("date", "armwright"))
        form = told["format"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(path, None, "", f"damaged: {shown(error)}") from error
    if form != _FORMAT:
        raise FileFormatError(path, None, "format", f"expected {_FORMAT}, got {shown(form)}")
    if not sound:
        raise FileFormatError(path, None, "", "damaged: block, made or sweep is not as a sweep writes it")
    return dict(told)


def _compare(path: Path, there: Any, here: Any) -> None:
    differences = list(_differences("", there, here))
    if differences:
        more = f"; and {len(differences) - 3} more" if len(differences) > 3 else ""
        raise SweepError(
            f"'{path}' holds another sweep: {'; '.join(differences[:3])}{more}. Give this one a folder of its own"
        )


def _differences(key: str, there: Any, here: Any) -> Iterator[str]:
    """Say what differs, key by key."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in {**there, **here}:
            yield from _differences(f"{key}.{name}" if key else name, there.get(name), here.get(name))
    elif there != here:
        yield f"{key} is {shown(there)} there, {shown(here)} here"


def _refuse_compressed(file: zipfile.ZipFile) -> None:
    """Refuse a compressed block: ours are not, and one of another origin may be huge once it is unpacked."""
    if any(part.compress_type != zipfile.ZIP_STORED for part in file.infolist()):
        raise ValueError("it is compressed, and blocks are not")


def _as_json(value: Any, what: str) -> Any:
    try:
        return json.loads(json.dumps(value, allow_nan=False))
    except (TypeError, ValueError) as error:
        raise KindError(f"{what}: expected what JSON holds, got {shown(value)}: {error}") from error


def _digest(*parts: bytes) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def _versions() -> dict[str, str]:
    return {
        "date": _now(),
        "armwright": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "machine": f"{sys.platform} {platform.machine()}",
    }


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
