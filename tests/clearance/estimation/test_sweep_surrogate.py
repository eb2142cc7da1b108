"""What a sweep teaches: features that are chance are left out and named, the spread of the others is noise."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.clearance.estimation.sweep_surrogate import learn_from_sweep
from armwright.clearance.feature_sweep import FeatureSweep
from armwright.clearance.linkage import Linkage
from armwright.clearance.reader import load_linkage
from armwright.errors import FileFormatError, InvalidValueError
from armwright.files.output import record_text, sha256
from armwright.sweep.designs import sobol
from armwright.sweep.results import load
from armwright.sweep.runner import run
from clearance.conftest import RANGE

pytest.importorskip("sklearn")
pytest.importorskip("xarray")

STRAIGHT = ("slope", "intercept")


@pytest.fixture(scope="module")
def folder(five_bar: Linkage, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of 32 linkages on a quiet path, and on one that rattles from the start."""
    task = FeatureSweep(linkage=five_bar, paths=("y1", "y13"))
    output = tmp_path_factory.mktemp("sweep") / "out"
    run(task, sobol(dict.fromkeys(task.parameters, RANGE), 32, 0), output, workers=1).close()
    return output


def test_chance_is_left_out_and_named(folder: Path, five_bar: Linkage) -> None:
    """Of two paths the straight part of the one that rattles teaches nothing; all else is learnt with its spread."""
    sweep = learn_from_sweep(folder, five_bar, ("y1", "y13"), (*STRAIGHT, "amp_dc"))

    assert sweep.random_features == ("y13_slope", "y13_intercept")
    assert sweep.surrogate.features == ("y1_slope", "y1_intercept", "y1_amp_dc", "y13_amp_dc")
    assert 2 * sweep.predictable_until["y13"] < 0.2 < sweep.predictable_until["y1"]
    assert sweep.runs == 32
    assert sweep.surrogate.spreads is not None
    _, deviation = sweep.surrogate.predict(np.full((1, 3), 0.3e-3))
    # The mean error of y13 differs by tens of micrometres from run to run, and that of y1 by less than one.
    assert deviation[0, 3] > 10e-6


def test_nothing_but_chance(folder: Path, five_bar: Linkage) -> None:
    """Where all features that were measured are chance they determine nothing, and other paths are asked for."""
    with pytest.raises(InvalidValueError, match="on y13 all features are random: they vary more between"):
        learn_from_sweep(folder, five_bar, ("y13",), STRAIGHT)


def test_sweep_of_something_else(folder: Path, five_bar: Linkage) -> None:
    """A sweep of another linkage, or without a path that was measured, is refused."""
    with pytest.raises(InvalidValueError, match="the sweep is of another linkage than slider-crank"):
        learn_from_sweep(folder, load_linkage("slider-crank"), ("y1",), STRAIGHT)
    with pytest.raises(InvalidValueError, match="the sweep has no path x2; sweep the paths that were measured"):
        learn_from_sweep(folder, five_bar, ("y1", "x2"), STRAIGHT)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda data: data.drop_vars("y1_slope_spread"), "'y1_slope_spread'"),
        (lambda data: data.drop_vars("status"), "'status'"),
        (lambda data: data.assign(y1_slope=data["y1_slope"] * 1e308), r"y1_slope: expected numbers up to 1e\+09"),
        (lambda data: data.assign(y1_slope=("other", np.zeros(3))), "y1_slope: expected 32 numbers, got"),
        (lambda data: data.assign(status=("run", np.full(32, 2.0**40))), r"status: expected numbers up to 1e\+09"),
        (lambda data: data.assign_attrs(settings="[1"), "Expecting"),
        (lambda data: data.assign_attrs(settings="[" * 100_000), "not the results of a sweep of clearances"),
        (
            lambda data: data.assign_attrs(
                settings=data.attrs["settings"].replace('"replicates":', '"replicates": "x", "n":')
            ),
            "'x'",
        ),
        (lambda data: data.assign_attrs(design='{"ranges": 3}'), "not the results of a sweep of clearances"),
        (lambda data: data.assign_attrs(design='{"ranges": {"c_J2": ["a"], "c_J3": [1], "c_J4": [1]}}'), "'a'"),
        (lambda data: data.assign_attrs(design="{}"), "'ranges'"),
    ],
)
def test_foreign_results(
    change: Callable[[Any], Any], text: str, folder: Path, five_bar: Linkage, tmp_path: Path
) -> None:
    """Results that no sweep of clearances has written are refused by the name of their file."""
    with load(folder) as data:
        change(data).to_netcdf(tmp_path / "results.nc", engine="scipy")
    (tmp_path / "run.json").write_text(record_text({"results.nc": str(sha256(tmp_path / "results.nc"))}, {}))

    with pytest.raises(FileFormatError, match=text) as refused:
        learn_from_sweep(tmp_path, five_bar, ("y1",), STRAIGHT)

    assert f"{tmp_path / 'results.nc'}" in str(refused.value)


def test_results_that_are_a_pipe(five_bar: Linkage, tmp_path: Path) -> None:
    """Nobody waits for a pipe instead of results."""
    os.mkfifo(tmp_path / "results.nc")

    with pytest.raises(FileFormatError, match=r"results\.nc: expected a file, got a pipe"):
        learn_from_sweep(tmp_path, five_bar, ("y1",), STRAIGHT)


def test_without_runs_beside_each(five_bar: Linkage, tmp_path: Path) -> None:
    """A sweep that has no spread is learnt from as it is."""
    task = FeatureSweep(linkage=five_bar, paths=("y1",), replicates=0)
    run(task, sobol(dict.fromkeys(task.parameters, RANGE), 16, 0), tmp_path / "out", workers=1).close()

    sweep = learn_from_sweep(tmp_path / "out", five_bar, ("y1",), STRAIGHT)

    assert (sweep.random_features, sweep.predictable_until, sweep.surrogate.spreads) == ((), {}, None)
