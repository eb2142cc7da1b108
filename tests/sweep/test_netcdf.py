"""The files of results against another reader of netCDF, and what does not fit into one."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from armwright.errors import InvalidValueError
from armwright.sweep.netcdf import Variable, Writer
from armwright.sweep.results import refuse_too_long
from sweep_tasks import Fall


@pytest.mark.parametrize("width", [1, 2, 3, 4, 5])
def test_against_scipy(width: int, rng: np.random.Generator, tmp_path: Path) -> None:
    """SciPy reads what was written, whatever order the rows came in and however odd the lengths are."""
    numbers = rng.normal(size=(7, width, 3))
    small = np.arange(7, dtype=np.int8)
    letters = np.frombuffer(b"abcdefghijklmnopqrstuvwxyz"[: 7 * width].ljust(7 * width, b"-"), dtype="S1")
    variables = [
        Variable(name="small", dims=("run",), kind="i1", attributes={"flags": small[:3], "units": "1"}),
        Variable(name="text", dims=("run", "wide"), kind="S1", attributes={}),
        Variable(name="numbers", dims=("run", "wide", "xyz"), kind="f8", attributes={"long_name": "µ" * width}),
        Variable(name="whole", dims=("run",), kind="i4", attributes={"empty": ""}),
    ]
    with (tmp_path / "a.nc").open("wb") as file:
        writer = Writer(file, {"run": 7, "wide": width, "xyz": 3}, {"title": "t" * width}, variables)
        writer.put("numbers", numbers[4:], 4)
        writer.put("whole", -np.arange(7) * 10**8)
        writer.put("numbers", numbers[:4])
        writer.put("small", small)
        writer.put("text", letters.reshape(7, width))

    with netcdf_file(tmp_path / "a.nc", mmap=False) as read:
        assert read.version_byte == 2
        assert read.title == b"t" * width
        assert dict(read.dimensions) == {"run": 7, "wide": width, "xyz": 3}
        np.testing.assert_array_equal(read.variables["numbers"].data, numbers)
        np.testing.assert_array_equal(read.variables["whole"].data, -np.arange(7) * 10**8)
        np.testing.assert_array_equal(read.variables["small"].data, small)
        assert read.variables["text"].data.tobytes() == letters.tobytes()
        assert read.variables["numbers"].long_name.decode() == "µ" * width
        np.testing.assert_array_equal(read.variables["small"].flags, small[:3])


def test_output_that_fits_into_no_file() -> None:
    """4 GiB of one output are refused before the first run: a million runs of 537 numbers are 4.296 GB."""
    refuse_too_long(Fall(samples=536), 1_000_000)
    with pytest.raises(InvalidValueError, match="output 'height': 1000000 runs of 537 numbers are more than the 4 GiB"):
        refuse_too_long(Fall(samples=537), 1_000_000)
