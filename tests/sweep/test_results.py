"""The file of results against another reader of netCDF, and what does not fit into it."""

from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.io import netcdf_file

from armwright.errors import InvalidValueError
from armwright.sweep import results
from armwright.sweep.designs import Design, full_factorial
from armwright.sweep.runner import run
from armwright.sweep.task import check_task
from sweep_tasks import Fall

pytest.importorskip("xarray")


@attrs.frozen(kw_only=True)
class Complaining(Fall):
    """A fall of which some runs fail for a reason of some letters."""

    letters: int

    def __call__(self, points: np.ndarray) -> dict[str, object]:
        """Fail at odd speeds, for reasons of the speed's length at most."""
        reasons = ["µ" * min(int(speed), self.letters) if speed % 2 else "" for speed in points[:, 0]]
        return {**super().__call__(points), "failure": reasons}


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("chunk", [1, 200, 1_000_000])
@pytest.mark.parametrize("block", [1, 3, 50])
@pytest.mark.parametrize("length", [1, 2, 3, 4, 5])
def test_against_scipy(length: int, block: int, chunk: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SciPy reads what was written bit by bit, however odd the lengths of outputs, texts and blocks are."""
    monkeypatch.setattr(results, "_CHUNK", chunk)
    design = full_factorial({"speed": np.arange(11.0)}, units={"speed": "m/s"})
    task = Complaining(samples=length, letters=length)
    run(task, design, tmp_path / "out", block=block, workers=1).close()

    with netcdf_file(tmp_path / "out" / "results.nc", mmap=False) as read:
        assert read.version_byte == 2
        assert read.title == b"fall"
        assert dict(read.dimensions) == {"run": None, "time": length, "letter": 2 * length}
        variables = {name: np.array(variable.data) for name, variable in read.variables.items()}
        assert read.variables["height"].long_name == b"height over the start"
        np.testing.assert_array_equal(read.variables["status"].flag_values, [0, 1, 2])
    expected = task(design.points)
    np.testing.assert_array_equal(variables["run"], np.arange(11))
    np.testing.assert_array_equal(variables["speed"], design.points[:, 0])
    np.testing.assert_array_equal(variables["time"], task.axes["time"].values)
    np.testing.assert_array_equal(variables["height"], expected["height"])
    np.testing.assert_array_equal(variables["depth"], expected["depth"])
    np.testing.assert_array_equal(variables["status"], [bool(reason) for reason in expected["failure"]])
    texts = [row.tobytes().rstrip(b"\0").decode() for row in variables["message"]]
    assert texts == expected["failure"]


def test_run_that_fits_into_no_row(speeds: Design) -> None:
    """A run of more than 2 GiB is refused before it is begun: 268 500 000 numbers are 2.148 GB."""
    time = np.broadcast_to(0.0, 1000)
    check_task(Fall(samples=1000), speeds.names)
    many = attrs.evolve(Fall().outputs["height"], dims=("x", "y", "z"))

    class Long(Fall):
        outputs = {"height": many}  # noqa: RUF012
        axes = {name: attrs.evolve(Fall().axes["time"], values=time) for name in many.dims}  # noqa: RUF012

    with pytest.raises(InvalidValueError, match="a run of 1000000000 numbers has more than 2 GiB"):
        check_task(Long(), speeds.names)
