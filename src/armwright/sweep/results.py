"""The results of a sweep as one labelled file: netCDF, which xarray, Matlab and Julia read."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from armwright.errors import FileFormatError
from armwright.files.inputs import regular_file
from armwright.files.output import RECORD, record_text, recorded_hashes, sha256
from armwright.sweep.errors import SweepError
from armwright.sweep.extras import extra
from armwright.sweep.folder import MANIFEST, RESULTS, Folder, write_whole
from armwright.sweep.task import Rows, Status, failed_row

if TYPE_CHECKING:
    import xarray

# So much is written at a time, where there is so much, but one block at least [bytes].
_CHUNK = 1_000_000
# Where the header of the file counts the records, as four big-endian bytes (NASA ESDS-RFC-011v2.0, 2011).
_RECORD_COUNT = 4


def load(folder: Path | str) -> "xarray.Dataset":
    """Return the results of a finished sweep; numbers are read from the disk when they are asked for.

    Args:
        folder: of the sweep.

    Returns:
        dataset: over the dimension ``run`` the parameters as coordinates, the outputs, and of every run ``status``
            (a ``Status``) and ``message``; with units, descriptions and provenance as attributes.

    Raises:
        FileFormatError: the file is damaged, or its ``run.json`` is missing.
        MissingExtraError: a library of the extra ``sweep`` is not installed.
        SweepError: there is no finished sweep in the folder.
    """
    xr = extra("xarray")
    path = Path(folder) / RESULTS
    if not path.exists():
        state = "is not finished; run it again to resume" if path.with_name(MANIFEST).exists() else "does not exist"
        raise SweepError(f"'{folder}': the sweep {state}")
    expected = recorded_hashes(path.parent).get(RESULTS)
    if expected != sha256(regular_file(path)):
        missing = f"it cannot be verified: its folder has no {RECORD} with its checksum"
        damage = f"damaged: its checksum does not match {RECORD}" if expected else missing
        advice = "move or delete it and run the sweep again: it is generated from the blocks"
        raise FileFormatError(path, None, "", f"{damage}; it is not changed; {advice}")
    # Units such as "hours" are those of a quantity, not of a calendar.
    dataset: xarray.Dataset = xr.open_dataset(
        path, engine="scipy", decode_times=False, decode_timedelta=False, mask_and_scale=False
    )
    return dataset


def write_results(folder: Folder) -> None:
    """Write the results of a sweep whose blocks are all there, block by block.

    Args:
        folder: of the sweep, held by this process.

    Raises:
        OutputError: they cannot be written; the blocks stay.
        FileFormatError: a block is damaged, or has gone since it was done.
    """

    def write(partial: Path) -> None:
        _write_blocks(folder, partial)
        # The record comes first: results without it could not be checked, and one without results harms nobody.
        text = record_text({RESULTS: sha256(partial) or ""}, {"versions": folder.provenance})
        write_whole(folder.path / RECORD, lambda record: record.write_text(text, encoding="utf-8"))

    write_whole(folder.path / RESULTS, write)


def _write_blocks(folder: Folder, path: Path) -> None:
    """Write some blocks at a time, so that the results may be larger than the memory.

    The runs are the records of the file, which stand one after the other behind its header. So the file is that of the
    first blocks, followed by the records of the others, with their number corrected.
    """
    letters = max(len(text.encode()) for rows in _read_chunks(folder) for text in rows["message"].tolist())
    nothing = failed_row(folder.task, Status.FAILED, "")[:0]
    header = len(_netcdf_bytes(folder, 0, nothing, letters))
    done = 0
    with path.open("wb") as file:
        for rows in _read_chunks(folder):
            file.write(_netcdf_bytes(folder, done, rows, letters)[header if done else 0 :])
            done += len(rows)
        file.seek(_RECORD_COUNT)
        file.write(done.to_bytes(4, "big"))


def _read_chunks(folder: Folder) -> Iterator[Rows]:
    """Read the blocks, some at a time."""
    size = failed_row(folder.task, Status.FAILED, "").nbytes * folder.block
    some = _CHUNK // size + 1
    numbers = range(len(folder.blocks))
    for first in numbers[::some]:
        yield np.concatenate([folder.read_block(number) for number in numbers[first : first + some]])


def _netcdf_bytes(folder: Folder, start: int, rows: Rows, letters: int) -> bytes:
    """Return a file of some runs, as classic netCDF with 64-bit offsets.

    Args:
        folder: of the sweep.
        start: number of the first run.
        rows: of the runs.
        letters: length of the longest message of the sweep [bytes].
    """
    task, design = folder.task, folder.design
    runs = np.arange(start, start + len(rows), dtype=np.int32)
    coordinates: dict[str, Any] = {"run": ("run", runs, {"long_name": "number of the run"})}
    for name, axis in task.axes.items():
        coordinates[name] = (name, axis.values, {"long_name": axis.description, "units": axis.units})
    for name, column in zip(design.names, design.points.T, strict=True):
        coordinates[name] = ("run", column[runs], {"units": design.units[name]})
    variables: dict[str, Any] = {
        name: (("run", *output.dims), rows[name], {"long_name": output.description, "units": output.units})
        for name, output in task.outputs.items()
    }
    flags = {
        "long_name": "how the run ended",
        "flag_values": np.array(list(Status), dtype=np.int8),
        "flag_meanings": " ".join(status.name.lower() for status in Status),
    }
    variables["status"] = ("run", rows["status"], flags)
    # All records have texts of the same length, in bytes.
    messages = np.array([text.encode() for text in rows["message"].tolist()], dtype=f"S{max(letters, 1)}")
    variables["message"] = ("run", messages, {"long_name": "why the run failed", "_Encoding": "utf-8"})
    provenance = {
        "Conventions": "CF-1.11",
        "title": task.name,
        "source": f"armwright {folder.provenance['armwright']}",
        "date_created": folder.provenance["date"],
        "versions": json.dumps(folder.provenance, ensure_ascii=False),
        "settings": json.dumps(folder.sweep["settings"], ensure_ascii=False),
        "design": json.dumps(folder.sweep["design"], ensure_ascii=False),
    }
    dataset = extra("xarray").Dataset(variables, coordinates, provenance)
    encoding = {name: {"_FillValue": None} for name in dataset.variables} | {"message": {"char_dim_name": "letter"}}
    return bytes(dataset.to_netcdf(engine="scipy", format="NETCDF3_64BIT", unlimited_dims=["run"], encoding=encoding))
