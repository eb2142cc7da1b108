"""The results of a sweep as one labelled file: netCDF, which xarray, Matlab and Julia read."""

import json
from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from armwright.errors import FileFormatError, InvalidValueError, shown
from armwright.files.output import RECORD, record_text, recorded, sha256
from armwright.files.reading import regular
from armwright.sweep.designs import Design
from armwright.sweep.errors import SweepError
from armwright.sweep.extras import extra
from armwright.sweep.folder import MANIFEST, RESULTS, Folder, write_text_whole, write_whole
from armwright.sweep.netcdf import LONGEST, Variable, Writer
from armwright.sweep.task import Rows, Status, Task, shapes

if TYPE_CHECKING:
    import xarray

# The axis of the bytes of a message, which xarray makes one text again.
_LETTERS = "letter"


def load(folder: Path | str) -> "xarray.Dataset":
    """Return the results of a finished sweep; numbers are read from the disk when they are asked for.

    Args:
        folder: of the sweep.

    Returns:
        dataset: over the dimension ``run`` the parameters as coordinates, the outputs, and of every run ``status``
            (a ``Status``) and ``message``; with units, descriptions and where they come from as attributes.

    Raises:
        FileFormatError: the file is damaged, or its ``run.json`` is missing.
        MissingExtraError: a library of the extra ``sweep`` is not installed.
        SweepError: there is no finished sweep in the folder.
    """
    xr = extra("xarray")
    path = Path(folder) / RESULTS
    damaged = "it stays as it is; move it away or delete it and run the sweep again: it is made again of the blocks"
    if not path.exists():
        state = "is not finished; run it again to go on" if path.with_name(MANIFEST).exists() else "is not there"
        raise SweepError(f"'{folder}': the sweep {state}")
    told, found = recorded(path.parent).get(RESULTS), sha256(regular(path))
    if told is None:
        raise FileFormatError(path, None, "", f"cannot be checked: no {RECORD} beside it tells its hash; {damaged}")
    if told != found:
        raise FileFormatError(path, None, "", f"damaged: its hash is not that in {RECORD}; {damaged}")
    try:
        # Units such as "hours" are those of a quantity, not of a calendar.
        dataset: xarray.Dataset = xr.open_dataset(
            path, engine="scipy", decode_times=False, decode_timedelta=False, mask_and_scale=False
        )
    except Exception as error:
        raise FileFormatError(path, None, "", f"damaged: {shown(error)}; {damaged}") from error
    return dataset


def refuse_too_long(task: Task, runs: int) -> None:
    """Refuse a sweep whose results are longer than a file can hold.

    Raises:
        InvalidValueError: an output has more than 4 GiB.
    """
    for name, shape in shapes(task).items():
        if 8 * prod(shape) * runs > LONGEST:
            raise InvalidValueError(
                f"output '{name}': {runs} runs of {prod(shape)} numbers are more than the 4 GiB that a file holds of "
                "one output; take fewer numbers of a run, or cut the design in two"
            )


def gather(folder: Folder, design: Design) -> None:
    """Write the results of a sweep whose blocks are all there, block by block.

    Args:
        folder: of the sweep, held by this process.
        design: the points.

    Raises:
        OutputError: they cannot be written; the blocks stay.
        FileFormatError: a block is damaged.
        SweepError: a block has gone since it was done.
    """

    def write(half: Path) -> None:
        _write(folder, design, half)
        # The record comes first: results that it does not fit are never found, results without it could not be checked.
        text = record_text({RESULTS: sha256(half) or ""}, {"versions": dict(folder.made)})
        write_text_whole(folder.path / RECORD, text)

    write_whole(folder.results, write)


def _write(folder: Folder, design: Design, path: Path) -> None:
    task = folder.task
    letters = max(1, *(len(text.encode()) for _, rows in _blocks(folder) for text in rows.message))
    sizes = {"run": len(design), **{name: axis.values.size for name, axis in task.axes.items()}, _LETTERS: letters}
    with path.open("wb") as file:
        writer = Writer(file, sizes, _provenance(folder, task), _variables(task, design))
        writer.put("run", np.arange(len(design)))
        for name, axis in task.axes.items():
            writer.put(name, axis.values)
        for name, column in zip(design.names, design.points.T, strict=True):
            writer.put(name, column)
        for first, rows in _blocks(folder):
            for name, values in rows.values.items():
                writer.put(name, values, first)
            writer.put("status", rows.status, first)
            texts = b"".join(text.encode().ljust(letters, b"\0") for text in rows.message)
            writer.put("message", np.frombuffer(texts, dtype="S1").reshape(-1, letters), first)


def _blocks(folder: Folder) -> Iterator[tuple[int, Rows]]:
    """Read the blocks with the number of the first run of each."""
    for number in range(folder.blocks):
        rows = folder.kept(number)
        if rows is None:
            raise SweepError(f"'{folder.path}': block {number} has gone just now; start again to go on")
        yield number * folder.block, rows


def _variables(task: Task, design: Design) -> list[Variable]:
    """Return what the file has, with units and descriptions."""
    variables = [Variable(name="run", dims=("run",), kind="i4", attributes={"long_name": "number of the run"})]
    for name, axis in task.axes.items():
        told = {"long_name": axis.description, "units": axis.units}
        variables.append(Variable(name=name, dims=(name,), kind="f8", attributes=told))
    variables += [
        Variable(name=name, dims=("run",), kind="f8", attributes={"units": design.units[name]}) for name in design.names
    ]
    among = {"coordinates": " ".join(design.names)}
    for name, one in task.outputs.items():
        told = {"long_name": one.description, "units": one.units, **among}
        variables.append(Variable(name=name, dims=("run", *one.dims), kind="f8", attributes=told))
    flags: dict[str, str | npt.NDArray[np.int8]] = {
        "long_name": "what became of the run",
        "flag_values": np.array(list(Status), dtype=np.int8),
        "flag_meanings": " ".join(status.name.lower() for status in Status),
        **among,
    }
    why = {"long_name": "why the run failed", "_Encoding": "utf-8", **among}
    return [
        *variables,
        Variable(name="status", dims=("run",), kind="i1", attributes=flags),
        Variable(name="message", dims=("run", _LETTERS), kind="S1", attributes=why),
    ]


def _provenance(folder: Folder, task: Task) -> dict[str, str]:
    """Return when, by what and with which settings the results were made."""
    return {
        "Conventions": "CF-1.11",
        "title": task.name,
        "source": f"armwright {folder.made['armwright']}",
        "date_created": folder.made["date"],
        "versions": json.dumps(folder.made, ensure_ascii=False),
        "settings": json.dumps(folder.sweep["settings"], ensure_ascii=False),
        "design": json.dumps(folder.sweep["design"], ensure_ascii=False),
    }
