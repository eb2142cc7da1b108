"""The folder of a sweep: its identity, the finished blocks, and one process at a time.

    sweep.json            what the sweep is of, and with which versions it was begun
    blocks/0000007.npy    the rows of one block, and a checksum behind them
    results.nc            the results, made of the blocks when all are finished
    run.json              the SHA-256 hash of the results
    lock                  held by the process at work

Every file is written under another name and moved when it is whole and on the disk. Everything is checked when it is
read back; a damaged file is named and not changed, for its numbers may have taken hours.
"""

import contextlib
import errno
import fcntl
import hashlib
import io
import json
import os
import platform
import sys
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import scipy

from armwright.errors import FileFormatError, KindError, OutputError, shown
from armwright.files.inputs import read_text, regular
from armwright.files.output import RECORD
from armwright.sweep.designs import Design
from armwright.sweep.errors import SweepError
from armwright.sweep.task import Rows, Task
from armwright.version import __version__

_FORMAT = 2
MANIFEST, _BLOCKS, RESULTS, _LOCK = "sweep.json", "blocks", "results.nc", "lock"
# The name under which a file is written ends with this.
_PARTIAL = ".tmp"
# What the lock says begins with this; an empty one was just made.
_HOLDER = "process "


def identity(task: Task, design: Design) -> dict[str, Any]:
    """Return the identity of a sweep as JSON holds it: two sweeps of which this is equal have equal results.

    Raises:
        KindError: a setting of the task is nothing that JSON holds.
    """
    settings = dict(task.settings)
    for name, value in settings.items():
        try:
            settings[name] = json.loads(json.dumps(value, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise KindError(f"setting '{name}': expected what JSON holds, got {shown(value)}: {error}") from error
    return {
        "armwright": __version__,
        "task": task.name,
        "settings": settings,
        "outputs": {name: [list(item.dims), item.units, item.description] for name, item in task.outputs.items()},
        "axes": {
            name: [item.values.size, item.units, item.description, _sha256(item.values.tobytes()).hex()]
            for name, item in task.axes.items()
        },
        "design": {
            "kind": design.kind,
            "runs": len(design),
            "seed": design.seed,
            "ranges": {name: list(numbers) for name, numbers in design.ranges.items()},
            "parameters": [list(parameter) for parameter in design.units.items()],
            "points": _sha256(design.points.tobytes()).hex(),
        },
    }


@attrs.frozen(kw_only=True)
class Folder:
    """A folder that this process holds.

    Attributes:
        path: of the folder.
        task: what is done; its outputs are what blocks hold.
        design: the points.
        sweep: see ``identity``.
        block: rows per block.
        made: when and with which versions it was begun.
    """

    path: Path
    task: Task
    design: Design
    sweep: Mapping[str, Any]
    block: int
    made: Mapping[str, str]

    @cached_property
    def _key(self) -> bytes:
        return json.dumps(self.sweep, sort_keys=True).encode()

    @property
    def starts(self) -> range:
        """The first run of each block of the whole sweep."""
        return range(0, len(self.design), self.block)

    def write_block(self, number: int, rows: Rows) -> None:
        """Write a block.

        Raises:
            OutputError: it cannot be written.
        """
        file = io.BytesIO()
        np.save(file, rows, allow_pickle=False)
        data = file.getvalue()
        write_whole(self._file(number), lambda partial: partial.write_bytes(data + self._checksum(number, data)))

    def read_block(self, number: int) -> Rows | None:
        """Return a block as it was written; None if there is none.

        Raises:
            FileFormatError: it is damaged; its file is not changed.
        """
        path = self._file(number)
        if not path.exists():
            return None
        if not path.is_file():
            raise self._damaged(number, "it is not a file")
        try:
            file = path.read_bytes()
        except OSError as error:
            raise self._damaged(number, error.strerror or str(error)) from error
        data, checksum = file[:-32], file[-32:]
        if checksum != self._checksum(number, data):
            raise self._damaged(number, "its checksum is not that of its numbers, or of another block")
        rows: Rows = np.load(io.BytesIO(data), allow_pickle=False)
        return rows

    def _damaged(self, number: int, why: str) -> FileFormatError:
        runs = range(len(self.design))[number * self.block :][: self.block]
        advice = "it stays as it is; move it away or delete it and start again"
        text = f"damaged: {why}; {advice}: only its runs, {runs[0]} to {runs[-1]}, are done again"
        return FileFormatError(self._file(number), None, "", text)

    def _file(self, number: int) -> Path:
        return self.path / _BLOCKS / f"{number:07d}.npy"

    def _checksum(self, number: int, data: bytes) -> bytes:
        """Return a checksum of a block that no other block, and none of another sweep, has."""
        return _sha256(self._key, f"{number} of {self.block}".encode(), data)


@contextlib.contextmanager
def locked_folder(path: Path, task: Task, design: Design, block: int) -> Iterator[Folder]:
    """Hold the folder of a sweep, begun now or earlier, while other processes are kept out.

    Args:
        path: made where it is missing, with its parents.
        task: what is done.
        design: the points.
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
        _check_files(path)
        handle = os.open(path / _LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
        lock = os.fdopen(handle, "r+", encoding="utf-8", errors="replace")
    except OSError as error:
        reason = "it is a file, and a folder is needed" if path.is_file() else error.strerror or error
        raise OutputError(f"cannot write to '{path}': {reason}") from error
    with lock:
        holder = lock.read(1000).strip()
        if holder and not holder.startswith(_HOLDER):
            raise SweepError(f"'{path / _LOCK}' is not the lock of a sweep; give the sweep a folder of its own")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # it ends with the process, however that ends
        except BlockingIOError as error:
            holder = holder or "another process"
            raise SweepError(f"'{path}' is in use: {holder} works on it; wait until it is done") from error
        lock.seek(0)
        lock.truncate()
        lock.write(f"{_HOLDER}{os.getpid()} on {platform.node()}, since {_now()}\n")
        lock.flush()
        manifest = _manifest(path, sweep, block)
        for partial in _partial_files(path):
            partial.unlink(missing_ok=True)
        yield Folder(path=path, task=task, design=design, **manifest)


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file whole and onto the disk, or leave what was there before.

    Args:
        path: the file; its folder is made where it is missing.
        write: writes the file to another path.

    Raises:
        OutputError: it cannot be written; the text says why.
    """
    partial = path.with_name(path.name + _PARTIAL)
    try:
        try:
            path.parent.mkdir(exist_ok=True)
            partial.unlink(missing_ok=True)  # a link of that name would be written through
            write(partial)
            _sync(partial)
            partial.replace(path)
            _sync(path.parent)
        except BaseException:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)
            raise
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        advice = " Make room and start again: it goes on from there." if full else ""
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write '{path}': {reason}; what was finished before stays.{advice}") from error


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _partial_files(path: Path) -> list[Path]:
    """Return the files that a killed process left half written. Files of other names are somebody else's."""
    files = [path / f"{name}{_PARTIAL}" for name in (MANIFEST, RESULTS, RECORD)]
    files += (path / _BLOCKS).glob(f"{'[0-9]' * 7}.npy{_PARTIAL}")
    return [file for file in files if file.is_symlink() or file.is_file()]


def _check_files(path: Path) -> None:
    known = {path / _LOCK, path / MANIFEST, *_partial_files(path)}
    others = sorted(file.name for file in path.iterdir() if file not in known)
    if others and not (path / MANIFEST).exists():
        raise SweepError(
            f"'{path}' holds no sweep, but other things ('{others[0]}'); give the sweep a folder of its own"
        )


def _manifest(path: Path, sweep: dict[str, Any], block: int) -> dict[str, Any]:
    """Return the fields ``sweep``, ``block`` and ``made`` of a folder; begin it where there are none."""
    manifest = path / MANIFEST
    if manifest.exists():
        fields = _read_manifest(manifest)
        if differences := list(_differences("", fields["sweep"], sweep)):
            more = f"; and {len(differences) - 3} more" if len(differences) > 3 else ""
            raise SweepError(
                f"'{path}' holds another sweep: {'; '.join(differences[:3])}{more}. Give this one a folder of its own"
            )
        return fields
    made = {
        "date": _now(),
        "armwright": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "machine": f"{sys.platform} {platform.machine()}",
    }
    fields = {"block": block, "made": made, "sweep": sweep}
    text = json.dumps({"format": _FORMAT, **fields}, indent=2, ensure_ascii=False) + "\n"
    write_whole(manifest, lambda partial: partial.write_text(text, encoding="utf-8"))
    return fields


def _read_manifest(path: Path) -> dict[str, Any]:
    text = read_text(regular(path))
    try:
        fields = json.loads(text)
        version, block, made, sweep = (fields[name] for name in ("format", "block", "made", "sweep"))
        sound = type(block) is int and block >= 1 and isinstance(sweep, dict)
        sound = sound and all(isinstance(made[name], str) for name in ("date", "armwright"))
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FileFormatError(path, None, "", f"damaged: {shown(error)}") from error
    if version != _FORMAT:
        raise FileFormatError(path, None, "format", f"expected {_FORMAT}, got {shown(version)}")
    if not sound:
        raise FileFormatError(path, None, "", "damaged: block, made or sweep is not as a sweep writes it")
    return {"block": block, "made": made, "sweep": sweep}


def _differences(key: str, there: Any, here: Any) -> Iterator[str]:
    """Return what differs, key by key."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in {**there, **here}:
            yield from _differences(f"{key}.{name}" if key else name, there.get(name), here.get(name))
    elif there != here:
        yield f"{key} is {shown(there)} there, {shown(here)} here"


def _sha256(*parts: bytes) -> bytes:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.digest()


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
