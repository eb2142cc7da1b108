"""What a stranger tried with the commands of linkages with play: options that clash, files of something else."""

import json
from pathlib import Path

import numpy as np
import pytest

from armwright.clearance.paths import thesis_path
from cli_calls import armwright

ESTIMATE = {
    "parameters": {
        "J2": {"mean": 3e-4, "deviation": 1e-6, "identifiable": True},
        "J3": {"mean": 2e-4, "deviation": 1e-6, "identifiable": True},
        "J4": {"mean": 4e-4, "deviation": 1e-6, "identifiable": True},
    },
    "misfit": 0.4,
    "correlation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
}
# Thirty-two draws with a deviation of a micrometre lie so near to their mean [m].
DRAWN = 1e-6


@pytest.fixture
def estimate(tmp_path: Path) -> Path:
    """A file as ``clearance estimate --json`` prints it."""
    file = tmp_path / "estimate.json"
    file.write_text(json.dumps(ESTIMATE))
    return file


def test_corrected_for_the_estimate(estimate: Path, tmp_path: Path) -> None:
    """A path is corrected for the play that was estimated, and the summary names this, not that of the catalogue."""
    folder = tmp_path / "out"
    done = armwright(
        *("clearance", "correct", "five-bar", "--path", "y1", "--knots", "4", "--rounds", "1"),
        *("--estimate", estimate, "--json", "-o", folder),
    )

    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    means = {name: one["mean"] for name, one in ESTIMATE["parameters"].items()}  # type: ignore[attr-defined]
    assert told["clearances"] == pytest.approx(means, abs=DRAWN)
    assert {file.name for file in folder.iterdir()} == {"path.csv", "summary.json", "paths.svg", "run.json"}


def test_no_path_for_a_contradiction(estimate: Path) -> None:
    """What contradicts its model, or is not told, is nothing to correct a path for: the status is 3."""
    estimate.write_text(json.dumps(ESTIMATE | {"misfit": 1e-9}))
    wrong = armwright("clearance", "correct", "five-bar", "--estimate", estimate)
    parameters = {**ESTIMATE["parameters"], "J3": {"mean": 2e-4, "deviation": 1e-4, "identifiable": False}}  # type: ignore[dict-item]
    estimate.write_text(json.dumps(ESTIMATE | {"parameters": parameters}))
    unknown = armwright("clearance", "correct", "five-bar", "--estimate", estimate)

    assert wrong.returncode == 3
    assert "the data contradict the model" in wrong.stderr
    assert unknown.returncode == 3
    assert "the measurement does not identify J3" in unknown.stderr


def test_estimate_refuses_a_contradiction(tmp_path: Path) -> None:
    """Columns that are swapped end with status 3, what is far off, and no number for a clearance."""
    text = (Path(__file__).parents[2] / "examples" / "five_bar_rest.csv").read_text()
    head, *rows = text.strip().splitlines()
    cells = [row.split(",") for row in rows]
    off = [(float(x) - float(a), float(y) - float(b)) for _, a, b, x, y in cells]
    turned = [f"{p},{a},{b},{float(a) + v},{float(b) + u}" for (p, a, b, _, _), (u, v) in zip(cells, off, strict=True)]
    (tmp_path / "turned.csv").write_text("\n".join([head, *turned, ""]))

    done = armwright("clearance", "estimate", "five-bar", tmp_path / "turned.csv")

    assert done.returncode == 3
    assert "the data contradict the model: no clearances explain them" in done.stderr
    assert done.stdout == ""


def test_given_twice(estimate: Path) -> None:
    """Clearances are given, or those of an estimate; both at once is a slip."""
    done = armwright("clearance", "correct", "five-bar", "--estimate", estimate, "--clearance", "J2=0.1")

    assert done.returncode == 2
    assert "give either --clearance or --estimate" in done.stderr


@pytest.mark.parametrize(
    ("options", "status", "text"),
    [
        (["correct", "five-bar", "--rounds", "-1"], 2, "rounds: expected 0 to 100, got -1"),
        (["correct", "five-bar", "--rounds", str(10**30)], 2, "rounds: expected 0 to 100, got 1000"),
        (["correct", "five-bar", "--estimate", "nowhere.json"], 4, "nowhere.json: no such file"),
        (["correct", "four-bar"], 2, "with its pins closed it has 1 freedom, and a position of the tip fixes 2"),
        (["sweep", "five-bar", "--paths", "y1", "--step", "4.6e-5", "-o", "{out}"], 2, "is too long for contacts"),
    ],
)
def test_refused(options: list[str], status: int, text: str, tmp_path: Path) -> None:
    """What cannot be is refused before a simulation, in one line; a step is held against the least play of a sweep."""
    done = armwright("clearance", *(one.format(out=tmp_path / "out") for one in options))

    assert done.returncode == status
    assert text in done.stderr
    assert done.stderr.count("\n") == 1


def test_matrix_that_does_not_fit(estimate: Path) -> None:
    """A correlation of two pins is none of three."""
    estimate.write_text(json.dumps(ESTIMATE | {"correlation": [[1, 0], [0, 1]]}))
    done = armwright("clearance", "correct", "five-bar", "--estimate", estimate)

    assert done.returncode == 4
    assert "expected the output of `armwright clearance estimate --json` for five-bar" in done.stderr


def test_sweep_of_another_linkage(tmp_path: Path) -> None:
    """Clearances of a linkage cannot be told by a sweep of another; a path that is named twice is swept once."""
    pytest.importorskip("xarray")
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


def test_pick_and_place() -> None:
    """The path that is corrected can be simulated too, with its three targets."""
    done = armwright("clearance", "simulate", "five-bar", "--path", "pick-and-place", "--step", "2e-5", "--json")

    assert [one["time"] for one in json.loads(done.stdout)["targets"]] == pytest.approx([0.0, 0.25, 0.5])
