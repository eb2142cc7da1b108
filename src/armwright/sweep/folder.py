"""The folder of a sweep: its identity, the finished blocks, and one process at a time.

    sweep.json            what the sweep is of, and with which versions it was begun
    blocks/0000007.npy    the rows of one block, and a checksum behind them
    results.nc            the results, made of the blocks when all are finished
    run.json              the SHA-256 hash of the results
    lock                  locked by the process that runs the sweep, with its name

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

from armwright.arrays import Array
from armwright.errors import FileFormatError, KindError, OutputError, shown
from armwright.files.inputs import read_text, regular_file
from armwright.files.output import folder_error_text
from armwright.sweep.designs import Design
from armwright.sweep.errors import SweepError
from armwright.sweep.task import Rows, Task
from armwright.version import __version__

_FORMAT = 3
MANIFEST, _BLOCKS, RESULTS, _LOCK = "sweep.json", "blocks", "results.nc", "lock"
# Suffix of the temporary name of a file that is being written.
_PARTIAL = ".tmp"
# The text of a lock file begins with this; a new one is empty.
_HOLDER_PREFIX = "process "


def sweep_identity(task: Task, design: Design) -> dict[str, Any]:
    """Return the identity of a sweep as JSON holds it: two sweeps of which this is equal have equal results.

    Raises:
        KindError: a setting of the task is nothing that JSON holds.
    """
    for name, value in task.settings.items():
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError) as error:
            text = f"setting '{name}': expected a value that JSON can represent, got {shown(value)}: {error}"
            raise KindError(text) from error
    fields = {
        "armwright": __version__,
        "task": task.name,
        "settings": dict(task.settings),
        "outputs": {name: attrs.asdict(output) for name, output in task.outputs.items()},
        "axes": {name: attrs.asdict(axis) for name, axis in task.axes.items()},
        "design": {"runs": len(design), **attrs.asdict(design)},
    }
    as_read: dict[str, Any] = json.loads(json.dumps(fields, default=_array_hash))
    return as_read


def _array_hash(array: Array) -> list[int | str]:
    """Return the shape and the SHA-256 hash of an array."""
    return [*array.shape, hashlib.sha256(array.tobytes()).hexdigest()]


@attrs.frozen(kw_only=True)
class Folder:
    """The folder of a sweep, locked by this process.

    Attributes:
        path: of the folder.
        task: of the sweep; its outputs are in the blocks.
        design: the points.
        sweep: see ``sweep_identity``.
        block: rows per block.
        provenance: when and with which versions it was begun.
    """

    path: Path
    task: Task
    design: Design
    sweep: Mapping[str, Any]
    block: int
    provenance: dict[str, str]

    @cached_property
    def blocks(self) -> list[range]:
        """The runs of each block."""
        runs = range(len(self.design))
        return [runs[start : start + self.block] for start in runs[:: self.block]]

    def block_path(self, number: int) -> Path:
        """Return the path of a block, which is there when it is finished."""
        return self.path / _BLOCKS / f"{number:07d}.npy"

    def write_block(self, number: int, rows: Rows) -> None:
        """Write a block.

        Raises:
            OutputError: it cannot be written.
        """
        file = io.BytesIO()
        np.save(file, rows, allow_pickle=False)
        data = file.getvalue()
        write_whole(self.block_path(number), lambda partial: partial.write_bytes(data + self._checksum(number, data)))

    def read_block(self, number: int) -> Rows:
        """Return a block as it was written.

        Raises:
            FileFormatError: it is damaged, or has gone; its file is not changed.
        """
        path = self.block_path(number)
        file, damage = b"", "its checksum does not match its numbers, or it is another block"
        try:
            if path.is_file():
                file = path.read_bytes()
            else:
                damage = "it is not a file"
        except OSError as error:
            damage = error.strerror or str(error)
        data, checksum = file[:-32], file[-32:]
        if checksum != self._checksum(number, data):
            runs = self.blocks[number]
            advice = "it is not changed; move or delete it and start again"
            text = f"damaged: {damage}; {advice}: only its runs, {runs[0]} to {runs[-1]}, are repeated"
            raise FileFormatError(path, None, "", text)
        rows: Rows = np.load(io.BytesIO(data), allow_pickle=False)
        return rows

    def _checksum(self, number: int, data: bytes) -> bytes:
        """Return a checksum of a block that no other block, and none of another sweep, has."""
        key = json.dumps([self.sweep, self.block, number], sort_keys=True).encode()
        return hashlib.sha256(key + data).digest()


@contextlib.contextmanager
def lock_folder(path: Path, task: Task, design: Design, block: int) -> Iterator[Folder]:
    """Lock the folder of a sweep, begun now or earlier, against other processes.

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
    sweep = sweep_identity(task, design)
    path = path.absolute()
    manifest = path / MANIFEST
    try:
        path.mkdir(parents=True, exist_ok=True)
        others = {file.name for file in path.iterdir()} - {_LOCK, MANIFEST + _PARTIAL}
        if others and not manifest.exists():
            raise SweepError(
                f"'{path}' contains files that are not of a sweep ('{min(others)}'); use a separate folder"
            )
        handle = os.open(path / _LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
        lock = os.fdopen(handle, "r+", encoding="utf-8", errors="replace")
    except OSError as error:
        raise OutputError(f"cannot write to '{path}': {folder_error_text(error, path)}") from error
    with lock:
        holder = lock.read(1000).strip()
        if holder and not holder.startswith(_HOLDER_PREFIX):
            raise SweepError(f"'{path / _LOCK}' is not the lock of a sweep; use a separate folder for the sweep")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # it ends with the process, however that ends
        except BlockingIOError as error:
            holder = holder or "another process"
            raise SweepError(f"'{path}' is in use: {holder} works on it; wait until it is done") from error
        lock.seek(0)
        lock.truncate()
        lock.write(f"{_HOLDER_PREFIX}{os.getpid()} on {platform.node()}, since {_utc_timestamp()}\n")
        lock.flush()
        fields = _read_manifest(manifest, sweep) if manifest.exists() else _write_manifest(manifest, sweep, block)
        yield Folder(path=path, task=task, design=design, sweep=sweep, block=fields["block"], provenance=fields["made"])


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
        path.parent.mkdir(exist_ok=True)
        partial.unlink(missing_ok=True)  # a link of that name would be written through
        write(partial)
        _sync(partial)
        partial.replace(path)
        _sync(path.parent)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        advice = " Free some disk space and start again: the sweep resumes." if full else ""
        why = error.strerror or str(error)
        raise OutputError(f"cannot write '{path}': {why}; finished blocks are kept.{advice}") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _write_manifest(path: Path, sweep: dict[str, Any], block: int) -> dict[str, Any]:
    """Begin a folder, and return what its manifest says."""
    made = {
        "date": _utc_timestamp(),
        "armwright": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "machine": f"{sys.platform} {platform.machine()}",
    }
    fields = {"format": _FORMAT, "block": block, "made": made, "sweep": sweep}
    text = json.dumps(fields, indent=2, ensure_ascii=False) + "\n"
    write_whole(path, lambda partial: partial.write_text(text, encoding="utf-8"))
    return fields


def _read_manifest(path: Path, sweep: dict[str, Any]) -> dict[str, Any]:
    """Return what the manifest of a folder says, if it is the folder of a sweep."""
    text = read_text(regular_file(path))
    try:
        fields: dict[str, Any] = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileFormatError(path, None, "", f"damaged: {shown(error)}") from error
    match fields:
        case {"format": version} if version != _FORMAT:
            raise FileFormatError(path, None, "format", f"expected {_FORMAT}, got {shown(version)}")
        case {"format": _, "block": block, "made": {"date": str(), "armwright": str()}, "sweep": dict(other)} if (
            type(block) is int and block >= 1
        ):
            differences = list(_differences("", other, sweep))
        case _:
            raise FileFormatError(path, None, "", "damaged: block, made or sweep is malformed")
    if differences:
        text = "; ".join(differences[:3]) + (f"; and {len(differences) - 3} more" if len(differences) > 3 else "")
        raise SweepError(f"'{path.parent}' contains another sweep: {text}. Use a separate folder for this one")
    return fields


def _differences(key: str, there: Any, here: Any) -> Iterator[str]:
    """Return what differs, key by key."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in {**there, **here}:
            yield from _differences(f"{key}.{name}" if key else name, there.get(name), here.get(name))
    elif there != here:
        yield f"{key} is {shown(there)} in the folder, {shown(here)} here"


def _utc_timestamp() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
