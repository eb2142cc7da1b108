"""Running a sweep: what comes out, the same bits whoever does the work, and rows that fail."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.errors import ArmwrightError, InvalidValueError, KindError, MissingExtraError
from armwright.sweep.designs import Design, full_factorial, latin_hypercube
from armwright.sweep.errors import SweepError
from armwright.sweep.progress import Progress
from armwright.sweep.results import load
from armwright.sweep.runner import run
from armwright.sweep.task import Axis, Output, Status
from sweep_tasks import TIMES, Fall, calls_of

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

xr = pytest.importorskip("xarray")


def bits(results: Any) -> dict[str, bytes]:
    """All numbers and texts of some results."""
    names = [*results.coords, *results.data_vars]
    return {name: pickle.dumps(results[name].values.tolist()) for name in names}


def test_results(speeds: Design, tmp_path: Path) -> None:
    """Every run has its row, with the numbers one works out by hand: at 30 m/s a stone is 30 t - g t²/2 high."""
    results = run(Fall(), speeds, tmp_path / "out", block=7, workers=1)

    assert dict(results.sizes) == {"run": 40, "time": 5}
    assert set(results.coords) == {"run", "speed", "time"}
    np.testing.assert_array_equal(results.speed, np.arange(40.0))
    np.testing.assert_array_equal(results.time, TIMES)
    np.testing.assert_allclose(results.height[30], (0.0, 7.193_437_5, 13.773_75, 19.740_937_5, 25.095))
    np.testing.assert_allclose(results.depth, 4.905 - np.arange(40.0))
    assert (results.status == Status.DONE).all()
    assert (results.message == "").all()


def test_labels(speeds: Design, tmp_path: Path) -> None:
    """The file on the disk says what its numbers are and where they come from."""
    run(Fall(gravity=1.62), speeds, tmp_path / "out", workers=1).close()

    results = load(tmp_path / "out")

    assert results.height.dims == ("run", "time")
    assert results.height.attrs == {"long_name": "height over the start", "units": "m"}
    assert (results.speed.attrs["units"], results.time.attrs["units"]) == ("m/s", "s")
    assert results.status.attrs["flag_meanings"] == "done failed killed"
    assert results.attrs["title"] == "fall"
    assert '"gravity": 1.62' in results.attrs["settings"]
    assert '"kind": "full factorial"' in results.attrs["design"]
    assert '"numpy"' in results.attrs["versions"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "blocks",
        "lock",
        "results.nc",
        "run.json",
        "sweep.json",
    ]


def test_same_bits(local_cluster: Any, tmp_path: Path) -> None:
    """One process, two, a Dask cluster, and blocks of other lengths have the same bits."""
    design = latin_hypercube({"speed": (0.0, 30.0)}, 50, 7)
    task = Fall(raises_above=29.0)
    ways: list[dict[str, Any]] = [
        {"workers": 1, "block": 8},
        {"workers": 2, "block": 8},
        {"scheduler": local_cluster.scheduler_address, "block": 8},
        {"workers": 1, "block": 50},
        {"workers": 1, "block": 1},
    ]

    found = [bits(run(task, design, tmp_path / str(i), **way)) for i, way in enumerate(ways)]

    assert Status.FAILED in pickle.loads(found[0]["status"])
    for other in found[1:]:
        assert other == found[0]


def test_workers_are_processes(speeds: Design, tmp_path: Path) -> None:
    """Two workers do a sweep in processes of their own, each block once."""
    run(Fall(calls=tmp_path / "calls", company=2), speeds, tmp_path / "out", block=5, workers=2)

    calls = calls_of(tmp_path / "calls")
    assert sorted(speed for _, row in calls for speed in row) == list(range(40))
    assert len({process for process, _ in calls}) == 2


def test_rows_that_raise(speeds: Design, tmp_path: Path) -> None:
    """Where the task raises, the rows are tried one by one; the others of the block have their numbers."""
    results = run(Fall(raises_above=37.5), speeds, tmp_path / "out", block=16, workers=1)

    assert results.status.values.tolist() == [Status.DONE] * 38 + [Status.FAILED] * 2
    assert results.message.values.tolist()[36:] == ["", "", *["FloatingPointError: it left the atmosphere"] * 2]
    np.testing.assert_allclose(results.depth[:38], 4.905 - np.arange(38.0))
    assert np.isnan(results.depth[38:]).all()
    assert np.isnan(results.height[38:]).all()


@attrs.frozen
class Told:
    """A task that tells which of its rows failed; the rest of what it is stands in fields."""

    returned: Callable[[np.ndarray], Any] = lambda points: {
        "y": points[:, 0],
        "failure": ["" if x < 2 else f"diverged\nat {x:g}" + "\0" for x in points[:, 0]],
    }
    outputs: dict[str, Output] = attrs.field(factory=lambda: {"y": Output()})
    axes: dict[str, Axis] = attrs.field(factory=dict)
    settings: dict[str, Any] = attrs.field(factory=dict)
    name: str = "told"

    def __call__(self, points: np.ndarray) -> Any:
        """Whatever a test wants returned."""
        return self.returned(points)


THREE = full_factorial({"x": [1, 2, 3]})


def test_rows_that_are_told_of(tmp_path: Path) -> None:
    """A task may say itself which rows failed; what numbers they have stay."""
    results = run(Told(), THREE, tmp_path / "out", workers=1)

    assert results.status.values.tolist() == [Status.DONE, Status.FAILED, Status.FAILED]
    assert results.message.values.tolist() == ["", "diverged at 2", "diverged at 3"]
    assert results.y.values.tolist() == [1, 2, 3]


def test_points_are_read_only(tmp_path: Path) -> None:
    """A task cannot change its points, which would change other blocks."""

    def spoil(points: np.ndarray) -> Any:
        points[:] = 0.0
        return {"y": points[:, 0]}

    results = run(Told(returned=spoil), THREE, tmp_path / "out", workers=1)

    assert results.message.values.tolist() == ["ValueError: assignment destination is read-only"] * 3


WRONG: list[tuple[Any, type[ArmwrightError], str]] = [
    (Told(returned=lambda _: 1), SweepError, "task 'told' returned 1; expected outputs by name"),
    (Told(returned=lambda x: {"z": x[:, 0]}), SweepError, "returned z; its outputs are y"),
    (Told(returned=lambda x: {"y": x}), SweepError, r"'y': expected shape \(3,\), got \(3, 1\)"),
    (Told(returned=lambda x: {"y": ["a"] * len(x)}), SweepError, "'y': expected numbers"),
    (Told(returned=lambda x: {"y": x[:, 0], "failure": [""]}), SweepError, "expected 3 texts, one per run, got 1"),
    (Told(outputs={}), InvalidValueError, "task 'told': expected one output or more, got none"),
    (
        Told(outputs={"x": Output()}),
        InvalidValueError,
        "'x' cannot be an output of the task: it is already a parameter of",
    ),
    (Told(outputs={"status": Output()}), InvalidValueError, "'status' cannot be an output of the task"),
    (Told(outputs={"a b": Output()}), InvalidValueError, "'a b' as an output of the task: expected an identifier"),
    (Told(outputs={"y": Output(dims=["t"])}), InvalidValueError, "'y': the task has no axis 't'. Known: none."),
    (Told(settings={"law": object()}), KindError, "setting 'law': expected a value that JSON can"),
    (Told(settings={"law": float("nan")}), KindError, "setting 'law': expected a value that JSON can"),
]


@pytest.mark.parametrize("number", range(len(WRONG)))
def test_wrong_tasks(number: int, tmp_path: Path) -> None:
    """A task that does not do as it says ends the sweep, with what it did."""
    task, error, text = WRONG[number]

    with pytest.raises(error, match=text):
        run(task, THREE, tmp_path / "out", workers=1)


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (("a", "a"), "'a' cannot be a parameter of the design: it is already a parameter of the design"),
        (("a b", "c"), "'a b' as a parameter of the design: expected an identifier of letters, digits and _"),
        (("status", "c"), "'status' cannot be a parameter of the design: it is already a name that every result has"),
    ],
)
def test_wrong_parameters(names: tuple[str, str], text: str, tmp_path: Path) -> None:
    """Each column of the results has a name of its own, which is a word."""
    with pytest.raises(InvalidValueError, match=text):
        run(Fall(), Design(names=names, points=[[1.0, 2.0]]), tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("asked", "error", "text"),
    [
        ({"block": 0}, InvalidValueError, "block: expected an integer of at least 1, got 0"),
        ({"workers": 0}, InvalidValueError, "workers: expected an integer of at least 1, got 0"),
        ({"workers": 10**30}, InvalidValueError, "workers: expected at most 1000 processes of this machine, got 1000"),
        ({"workers": 1.5}, KindError, "workers: expected an integer, got 1.5"),
        ({"workers": 2, "scheduler": "tcp://127.0.0.1:1"}, InvalidValueError, "specify either workers"),
        ({"design": [1, 2]}, KindError, "design: expected a Design, got list"),
    ],
)
def test_mistakes(asked: dict[str, Any], error: type[ArmwrightError], text: str, tmp_path: Path) -> None:
    """What cannot be is refused before anything is written."""
    design = asked.pop("design", THREE)

    with pytest.raises(error, match=text):
        run(Fall(), design, tmp_path / "out", **asked)
    assert not (tmp_path / "out").exists()


def test_task_that_cannot_be_sent(tmp_path: Path) -> None:
    """Workers get a task by pickle; one that cannot be pickled is refused with the reason."""
    with pytest.raises(KindError, match=r"task 'told' cannot be sent to workers: .*lambda"):
        run(Told(), THREE, tmp_path / "out", block=1, workers=2)


SCRIPT = """
import sys
from armwright.sweep.designs import full_factorial
from armwright.sweep.runner import run
from sweep_tasks import Fall

run(Fall(), full_factorial({"speed": range(40)}), sys.argv[1], block=8, workers=2)
"""


def test_script_without_a_guard(tmp_path: Path) -> None:
    """A script that sweeps without asking whether it is the main one is told how it should look."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")

    done = subprocess.run(
        [sys.executable, script, tmp_path / "out"],
        env={"PYTHONPATH": ":".join(sys.path)},
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        timeout=300,
    )

    last = done.stderr.splitlines()[-1]
    assert "SweepError: worker processes do not start. A script that starts a sweep does so below" in last


def test_progress(speeds: Design, tmp_path: Path) -> None:
    """Who asks is told at the start and after every block."""
    told: list[Progress] = []

    run(Fall(raises_above=38.5), speeds, tmp_path / "out", block=16, workers=1, progress=told.append)

    assert [(now.done, now.failed) for now in told] == [(0, 0), (16, 0), (32, 0), (40, 1)]
    assert told[0].remaining is None
    assert told[1].remaining == pytest.approx(24 / told[1].rate)
    assert told[-1].remaining == 0.0


def test_silence(speeds: Design, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The library prints nothing."""
    run(Fall(raises_above=30.0), speeds, tmp_path / "out", block=16, workers=2)

    assert capfd.readouterr() == ("", "")


# What the numbers of the runs between may take beyond what the first 200 take [bytes]; all of them are 22 MB.
SLACK = 1_000_000


MEMORY = """
import sys, tracemalloc
from pathlib import Path
import numpy as np
from armwright.sweep.designs import full_factorial
from armwright.sweep.runner import run
from sweep_tasks import Fall

def sweep(runs):
    design = full_factorial({"speed": np.arange(runs)})
    run(Fall(samples=1000), design, Path(sys.argv[1]) / str(runs), block=20, workers=1).close()

def peak(runs):
    tracemalloc.start()
    sweep(runs)
    used = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return used

sweep(60)  # libraries are loaded
print(peak(200), peak(1000))
"""


def test_memory_is_flat(tmp_path: Path) -> None:
    """Five times as many runs take no more memory: 1000 runs of 1000 numbers, a few blocks at a time."""
    # In a process of its own: threads that a cluster left in this one would be counted too.
    command = [sys.executable, "-c", MEMORY, str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300).stdout
    few, many = map(int, said.split())

    assert many < few + SLACK


@pytest.mark.parametrize("missing", ["xarray", "threadpoolctl"])
def test_missing_library(missing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a library of the extra it is said how to get it, before any work."""
    monkeypatch.setitem(sys.modules, missing, None)

    with pytest.raises(MissingExtraError, match=f"a sweep needs {missing}; install it by: pip install"):
        run(Fall(), THREE, tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


def test_missing_dask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without Dask sweeps run, but on no cluster."""
    monkeypatch.setitem(sys.modules, "distributed", None)

    run(Fall(), THREE, tmp_path / "cores", workers=1)
    with pytest.raises(MissingExtraError, match=r"needs distributed; install it by: pip install 'armwright\[sweep\]'"):
        run(Fall(), THREE, tmp_path / "cluster", scheduler="tcp://127.0.0.1:1")


def test_import_is_light() -> None:
    """What sweeps need beyond the core is loaded when a sweep is run."""
    heavy = "{'xarray', 'threadpoolctl', 'distributed', 'dask', 'pandas', 'scipy.stats', 'numba'}"
    code = f"import sys, armwright.sweep.runner; print({heavy} & set(sys.modules))"

    done = subprocess.run(
        [sys.executable, "-c", code], env={"PYTHONPATH": ":".join(sys.path)}, capture_output=True, text=True, check=True
    )

    assert done.stdout == "set()\n"
