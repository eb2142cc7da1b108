"""``armwright clearance sweep``, and ``estimate`` of paths by what a sweep has taught, as a user calls them."""

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from armwright.clearance.paths import named_path, thesis_path
from armwright.sweep.results import load
from cli_calls import armwright, check_mistake
from five_bar_example import CENTRE, PATHS, assert_clearances_found

pytest.importorskip("sklearn")
pytest.importorskip("xarray")

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

# A run and another one a nanometre away tell until when a path is predictable.
SWEEP = ("clearance", "sweep", "five-bar", *CENTRE, "--replicates", "1", "--workers", "1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of 64 arms on the three paths of the example."""
    path = tmp_path_factory.mktemp("sweep") / "out"
    done = armwright(*SWEEP, "-n", "64", "-o", path)
    assert done.returncode == 0, done.stderr
    first, *rest = done.stdout.splitlines()
    assert first == f"64 linkages on y1, y3, y7: {path}"
    assert [line.partition(":")[0] for line in rest] == ["y1", "y3", "y7"]
    assert all(re.fullmatch(r"y\d: predictable until t = 0\.2\d+ s in half .*, of 0\.25 s", line) for line in rest)
    return path


def test_estimate_on_paths(folder: Path) -> None:
    """The example's runs tell its clearances through a sweep of 64 simulations, and the model fits."""
    done = armwright("clearance", "estimate", "five-bar", PATHS, "--sweep", folder, "--noise-um", "2", "--json")

    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["method"] == "paths"
    assert_clearances_found(found, 0.985)
    assert found["notes"][0] == "15 features of 3 paths, learnt from 64 simulations"
    assert found["notes"][1].startswith("predictable until, in half of the simulations: y1 0.2")
    assert found["random_features"] == []
    assert set(found["predictable_until"]) == {"y1", "y3", "y7"}


def test_pages(folder: Path, tmp_path: Path) -> None:
    """A sweep has a page with the errors that it found, and an estimate one with its clearances."""
    page = (folder / "report.html").read_text()
    results = load(folder)
    errors = results["y3_amp_dc"].to_numpy() / 2 * 1e3
    assert f"<b>{errors.min():.3f} to {errors.max():.3f} mm</b><small>mean error on y3</small>" in page
    assert "<b>64</b><small>linkages on 3 paths</small>" in page
    options = ("--sweep", folder, "--noise-um", "2", "--json", "-o", tmp_path)

    found = json.loads(armwright("clearance", "estimate", "five-bar", PATHS, *options).stdout)

    assert {path.name for path in tmp_path.iterdir()} == {"report.html", "summary.json", "clearances.svg", "run.json"}
    assert json.loads((tmp_path / "summary.json").read_text()) == found
    page = (tmp_path / "report.html").read_text()
    for pin, it in found["parameters"].items():
        assert f"<b>{it['mean'] * 1e3:.3f} mm</b><small>clearance of {pin}" in page


def test_interrupted_sweep(tmp_path: Path) -> None:
    """Who stops a sweep by Ctrl-C is told that what is finished is kept, and how it goes on."""
    few = ("--paths", "y1", "--replicates", "0")
    command = ["clearance", "sweep", "five-bar", *few, "--workers", "1", "-n", "65536", "-o", "out"]
    with subprocess.Popen(
        [sys.executable, "-m", "armwright", *command], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as running:
        while not list(tmp_path.glob("out/blocks/???????.npy")) and running.poll() is None:
            time.sleep(0.1)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=300)

    assert running.returncode == 130
    kept = "finished runs are stored in 'out'; the same command resumes the sweep"
    assert said == f"armwright: interrupted; {kept}\n"
    assert list(tmp_path.glob("out/blocks/???????.npy"))


def test_sweep_goes_on(folder: Path) -> None:
    """The same command again finds all there; another design in that folder is refused, and nothing is lost."""
    arguments = (*SWEEP, "-o", folder)
    before = (folder / "results.nc").read_bytes()

    again = armwright(*arguments, "-n", "64", "--json")
    other = armwright(*arguments, "-n", "32")

    told = json.loads(again.stdout)
    chaos = told.pop("chaos")
    assert told == {"runs": 64, "failed": 0, "paths": ["y1", "y3", "y7"], "folder": str(folder)}
    assert all(0.2 < one["earliest"] <= one["until"] < 0.25 and one["chance"] == [] for one in chaos.values())
    assert other.returncode == 3
    assert "contains another sweep: design.runs is 64 in the folder, 32 here" in other.stderr
    assert (folder / "results.nc").read_bytes() == before


def test_damaged_sweep(folder: Path, tmp_path: Path) -> None:
    """Whoever reads a sweep back names the file that is damaged, with status 4; it is not changed."""
    swept = tmp_path / "swept"
    shutil.copytree(folder, swept)
    results, block = swept / "results.nc", swept / "blocks" / "0000000.npy"
    results.write_bytes(results.read_bytes()[:-1] + b"x")
    block.write_bytes(b"")
    sweep = (*SWEEP, "-n", "64", "-o", swept)

    learnt = armwright("clearance", "estimate", "five-bar", PATHS, "--sweep", swept, "--noise-um", "2")
    again = armwright(*sweep)
    results.unlink()
    anew = armwright(*sweep, "--json")

    assert [done.returncode for done in (learnt, again, anew)] == [4, 4, 4]
    assert f"armwright: {results}: damaged: its checksum does not match run.json; it is not changed" in learnt.stderr
    assert f"{results}: damaged" in again.stderr
    assert json.loads(anew.stdout)["error"]["file"] == str(block)
    assert block.read_bytes() == b""


def test_factorial_with_friction(tmp_path: Path) -> None:
    """Two levels of three clearances and of friction are sixteen runs; quiet, nothing is said."""
    options = ("--design", "factorial", "--levels", "2", "--to-friction", "0.1", "--paths", "y1", "--quiet")
    done = armwright(*SWEEP, *options, "-o", tmp_path / "out")

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    with load(tmp_path / "out") as data:
        assert data.sizes["run"] == 16
        assert np.unique(data.friction).tolist() == [0.0, 0.1]
        assert np.unique(data.c_J3).tolist() == [1e-4, 5e-4]
        assert data.c_J3.attrs["units"] == "m"
        assert data.y1_slope_spread.attrs["units"] == "m/s"
        assert data.y1_until.attrs["units"] == "s"


def test_sweep_of_another_linkage(tmp_path: Path) -> None:
    """Clearances of a linkage cannot be told by a sweep of another; a path that is named twice is swept once."""
    folder, measured = tmp_path / "sweep", tmp_path / "measured.csv"
    swept = armwright(
        "clearance", "sweep", "five-bar", "--paths", "y1,y1", "-n", "2", "--workers", "1", "--json", "-o", folder
    )
    way = thesis_path("y1")
    places = ((t, *way.evaluate(t).position * 1e3) for t in np.linspace(0.0, way.duration, 51))
    rows = [f"y1,{t:.6f},{x:.6f},{y:.6f}" for t, x, y in places]
    measured.write_text("\n".join(["path,t_s,x_mm,y_mm", *rows]))
    done = armwright("clearance", "estimate", "slider-crank", measured, "--sweep", folder, "--noise-um", "2")

    assert json.loads(swept.stdout)["paths"] == ["y1"]
    assert done.returncode == 2
    assert "the sweep is of another linkage than slider-crank" in done.stderr


MISTAKES = [
    (("sweep", "five-bar", "--paths", "y15"), "no test path 'y15'. Did you mean 'y1'?"),
    (("sweep", "five-bar", "--paths", "pick-and-place"), "no test path 'pick-and-place'"),
    (("sweep", "five-bar", "--design", "lsh"), "'lsh' is not one of 'factorial', 'lhs', 'sobol'"),
    (("sweep", "five-bar", "--design", "factorial", "--levels", "1"), "levels: expected an integer of at least"),
    (("sweep", "five-bar", "--design", "factorial", "--from-mm", "0"), "contact needs them above 0, got 0 mm"),
    (("sweep", "five-bar", "-n", "100"), "a Sobol design needs a power of two of points, got 100"),
    (("sweep", "five-bar", "--from-mm", "0.5", "--to-mm", "0.1"), "bounds of c_J2: they are reversed"),
    (("sweep", "five-bar", "--step", "1e-3"), "step: 0.001 s is too long for contacts of "),
    (("sweep", "five-bar", "--paths", "y1", "--step", "4.6e-5"), "is too long for contacts"),
    (("sweep", "five-bar", "--replicates", "16"), "replicates: expected 0 to 15, got 16"),
    (("sweep", "five-bar", "--vary", "payloads=0:0.2"), "no free parameter 'payloads'. Did you mean 'payload'?"),
    (("sweep", "five-bar", "--vary", "friction=0:0.1", "--to-friction", "0.1"), "expected it or --vary friction"),
    (("sweep", "four-bar"), "four-bar: with its pins closed it has 1 freedom"),
    (("sweep", "five-bra"), "no linkage 'five-bra'. Did you mean 'five-bar'?"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "said"), MISTAKES)
def test_mistakes(arguments: tuple[str | Path, ...], said: str, tmp_path: Path) -> None:
    """A mistake gets one message that says what to do, no traceback, and leaves no folder behind."""
    check_mistake("clearance", *arguments, "--quiet", "-o", "out", said=said, folder=tmp_path)


def test_sweep_that_does_not_fit(folder: Path, tmp_path: Path) -> None:
    """Measured paths need the noise of their samples, and a sweep of the same paths."""
    rows = [f"x2,{t:.4f},{x:.4f},{y:.4f}" for t, (x, y) in _places("x2")]
    (tmp_path / "x2.csv").write_text("\n".join([PATHS.read_text().splitlines()[0], *rows]) + "\n", encoding="utf-8")
    estimate = ("clearance", "estimate", "five-bar")

    without_noise = armwright(*estimate, PATHS, "--sweep", folder)
    other_path = armwright(*estimate, tmp_path / "x2.csv", "--sweep", folder, "--noise-um", "2")

    assert (without_noise.returncode, other_path.returncode) == (2, 2)
    assert "--noise-um: expected the standard deviation" in " ".join(without_noise.stderr.replace("│", " ").split())
    assert "the sweep has no path x2; sweep the" in other_path.stderr


def _places(path: str) -> list[tuple[float, tuple[float, float]]]:
    """Return times [s] and places [mm] along a path."""
    seconds = np.linspace(0.0, 0.29, 30)
    return list(zip(seconds.tolist(), (named_path(path).evaluate(seconds).position * 1e3).tolist(), strict=True))


def test_help() -> None:
    """The help of the command has an example in it."""
    done = armwright("clearance", "sweep", "--help", columns=120)

    assert done.returncode == 0
    assert "armwright clearance sweep five-bar" in done.stdout


def test_help_is_quick() -> None:
    """Until a command works neither NumPy nor Numba nor matplotlib is loaded: they take longer than the help may."""
    code = (
        "import armwright.cli.clearance, sys; print(sorted({'numpy', 'numba', 'sklearn', 'scipy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout == "[]\n"
