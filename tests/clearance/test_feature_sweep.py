"""Sweeps over clearances: the features of single simulations, the same bits whoever makes them, rows that fail."""

import json
import pickle
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.clearance.feature_sweep import FeatureSweep, feature_vector, is_random, is_sweep_of
from armwright.clearance.features import Features, simulation_features
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path
from armwright.clearance.predictability import MAX_DISTANCE, perturb_clearances
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.sweep.designs import Design, latin_hypercube
from armwright.sweep.errors import SweepError
from armwright.sweep.progress import Progress
from armwright.sweep.runner import run
from armwright.sweep.task import Status, check_task, evaluate
from clearance.arms import ARM_A, ARM_B, CENTRE, varied

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

RANGE = (0.1e-3, 0.5e-3)
# So much friction in a pin no step can follow.
STUCK = 1e4


@pytest.fixture(scope="module")
def task(five_bar: Linkage) -> FeatureSweep:
    return FeatureSweep(linkage=five_bar, paths=("y1",), simulation_settings=CENTRE)


@pytest.fixture(scope="module")
def design(task: FeatureSweep) -> Design:
    return latin_hypercube(dict.fromkeys(task.parameters, RANGE), 24, 7, units=dict.fromkeys(task.parameters, "m"))


def bits(results: Any) -> dict[str, bytes]:
    """All numbers and texts of some results."""
    return {name: pickle.dumps(results[name].values.tolist()) for name in (*results.coords, *results.data_vars)}


def test_features_of_the_simulation(five_bar: Linkage, task: FeatureSweep) -> None:
    """Without runs beside it a row has the features of the simulation with those clearances, bit for bit."""
    rows = varied(task, replicates=0)(np.array([ARM_B, ARM_A]))

    alone = simulate(prepare_scenario(five_bar, named_path("y1"), CENTRE), ARM_A)
    for name, value in simulation_features(alone)._asdict().items():
        assert rows[f"y1_{name}"][1] == value, name
    assert rows["y1_peak"][1] == alone.peaks.max()
    assert rows["failure"] == ["", ""]


def test_means_and_spreads_over_runs_that_nobody_can_tell_apart(five_bar: Linkage) -> None:
    """On y9 a row is the mean of four runs a nanometre apart, with their spread and until when they are together."""
    task = FeatureSweep(linkage=five_bar, paths=("y9",), simulation_settings=CENTRE)

    rows = task(np.array([ARM_B, ARM_A]))

    runs = simulate(prepare_scenario(five_bar, named_path("y9"), CENTRE), perturb_clearances(ARM_A, 3))
    for name, values in {**simulation_features(runs)._asdict(), "peak": runs.peaks.max(axis=-1)}.items():
        assert rows[f"y9_{name}"][1] == pytest.approx(values.mean(), rel=1e-12), name
        assert rows[f"y9_{name}_spread"][1] == pytest.approx(values.std(ddof=1), rel=1e-9), name
    apart = np.linalg.norm(runs.error - runs.error[0], axis=-1).max(axis=0)
    assert apart[runs.time <= rows["y9_until"][1]].max() <= MAX_DISTANCE < apart.max()
    # The journals rattle from the start: its slope is chance, and where it begins is not.
    assert rows["y9_slope_spread"][1] > 1e-4
    assert rows["y9_offset_y_spread"][1] < 1e-9


def test_chance_is_told_from_what_a_design_changes(five_bar: Linkage) -> None:
    """Over 32 linkages slope and intercept of y13 are chance, its start and its mean are not; nothing of y1 is."""
    task = FeatureSweep(linkage=five_bar, paths=("y1", "y13"))
    rows = task(latin_hypercube(dict.fromkeys(task.parameters, RANGE), 32, 7).points)

    names = [f"{path}_{name}" for path in task.paths for name in Features._fields]
    chance = {name for name in names if is_random(rows[name], rows[f"{name}_spread"], 4)}

    assert chance == {"y13_slope", "y13_intercept"}
    assert rows["y13_until"].max() < 0.1 < rows["y1_until"].min()


def test_chance_that_is_left_in_means(rng: np.random.Generator) -> None:
    """Means over four runs of pure chance vary by a quarter of its variance, and are not taken for more."""
    runs = rng.normal(0.0, 1.0, (400, 4))
    means = rng.normal(0.0, 1.1, 400)[:, None]

    assert is_random(runs.mean(axis=1), runs.std(axis=1, ddof=1), 4)
    assert is_random((0.7 * means + runs).mean(axis=1), runs.std(axis=1, ddof=1), 4)
    assert not is_random((1.2 * means + runs).mean(axis=1), runs.std(axis=1, ddof=1), 4)


def test_friction_is_a_parameter(five_bar: Linkage, task: FeatureSweep) -> None:
    """With friction as a parameter, its usual value gives the usual row, and another one another row."""
    with_friction = varied(task, free=("friction",))
    usual = five_bar.material.friction

    rows = with_friction(np.array([[*ARM_A, usual], [*ARM_A, 0.0]]))

    assert with_friction.parameters == ("c_J2", "c_J3", "c_J4", "friction")
    assert rows["y1_intercept"][0] == task(ARM_A[None])["y1_intercept"][0]
    # By 0.07 to 0.10 mm between 0.05 and none (spec of the clearance, 4.4).
    assert 0.02e-3 < abs(rows["y1_intercept"][1] - rows["y1_intercept"][0]) < 0.15e-3


def test_free_parameters(five_bar: Linkage) -> None:
    """Restitution, payload and scale of the efforts follow the clearances; what sweeps of friction wrote stays so."""
    settings = Settings(step=2e-5, sample=5e-4)
    task = FeatureSweep(linkage=five_bar, paths=("y1",), simulation_settings=settings, replicates=0)
    free = varied(task, free=("payload", "restitution", "torque_scale"))
    material = five_bar.material

    rows = free(np.array([[*ARM_A, 0.0, material.restitution, 1.0], [*ARM_A, 0.05, material.restitution, 1.0]]))

    usual = task(ARM_A[None])["y1_intercept"][0]
    assert free.parameters == ("c_J2", "c_J3", "c_J4", "payload", "restitution", "torque_scale")
    assert rows["y1_intercept"][0] == pytest.approx(usual, rel=1e-9)
    assert abs(rows["y1_intercept"][1] / usual - 1) > 0.1
    assert free.settings["free"] == ["payload", "restitution", "torque_scale"]
    assert "free" not in varied(task, free=("friction",)).settings
    with pytest.raises(UnknownNameError, match=r"no free parameter 'payloads'\. Did you mean 'payload'"):
        varied(task, free=("payloads",))
    with pytest.raises(InvalidValueError, match="free parameters: 'payload' occurs twice"):
        varied(task, free=("payload", "payload"))


def test_outputs_are_those_announced(task: FeatureSweep) -> None:
    """What a task returns is what it says it will, with units, and its settings are plain enough for JSON."""
    both = attrs.evolve(task, paths=("y1", "x2"))
    rows = evaluate(both, ARM_A[None])

    check_task(both, both.parameters)
    columns = [*Features._fields, "peak"]
    columns += [f"{name}_spread" for name in columns] + ["until"]
    assert {*rows.dtype.names} - {"status", "message"} == {
        f"{path}_{name}" for path in ("y1", "x2") for name in columns
    }
    units = {name: output.units for name, output in both.outputs.items()}
    assert (units["x2_slope"], units["x2_slope_spread"], units["x2_until"]) == ("m/s", "m/s", "s")
    plain = json.loads(json.dumps(dict(both.settings)))
    assert plain["simulation"]["friction"]["velocity"] == "centre"
    assert plain["linkage"]["bodies"][0]["mass"] == 2.5
    assert plain["replicates"] == 3


def test_feature_vector(task: FeatureSweep) -> None:
    """Chosen features stand path by path, in the order asked for."""
    rows = task(np.array([ARM_A, ARM_B]))

    table = feature_vector(rows, ["y1"], ["intercept", "slope"])

    np.testing.assert_array_equal(table, np.stack([rows["y1_intercept"], rows["y1_slope"]], axis=-1))


def test_workers_make_their_own_tables(task: FeatureSweep) -> None:
    """A task that has run is sent without its tables of drives, and does the same where it arrives."""
    here = task(ARM_A[None])
    sent = pickle.dumps(task)

    there = pickle.loads(sent)(ARM_A[None])

    assert len(sent) < 10_000
    assert bits_of(there) == bits_of(here)


def bits_of(rows: dict[str, Any]) -> dict[str, bytes]:
    return {name: pickle.dumps(np.asarray(values).tolist()) for name, values in rows.items()}


def test_same_bits_whoever_simulates(task: FeatureSweep, tmp_path: Path) -> None:
    """One process, two, a Dask cluster, and blocks of other lengths make the same bits."""
    pytest.importorskip("xarray")
    distributed = pytest.importorskip("distributed")
    design = latin_hypercube(dict.fromkeys(task.parameters, RANGE), 6, 7, units=dict.fromkeys(task.parameters, "m"))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as cluster:
        ways: list[dict[str, Any]] = [
            {"workers": 1},
            {"workers": 2, "block": 3},
            {"scheduler": cluster.scheduler_address, "block": 5},
        ]
        result = [bits(run(task, design, tmp_path / str(i), **way)) for i, way in enumerate(ways)]

    assert all(copy == result[0] for copy in result[1:])


def test_diverging_run(task: FeatureSweep, tmp_path: Path) -> None:
    """A run that diverges is a row that says so; those beside it keep their bits, and the sweep goes on."""
    pytest.importorskip("xarray")
    with_friction = varied(task, free=("friction",))
    well = np.array([[*ARM_A, 0.05], [*ARM_B, 0.05], [*ARM_A, 0.0]])
    points = np.insert(well, 1, [*ARM_B, STUCK], axis=0)

    results = run(with_friction, Design(names=with_friction.parameters, points=points), tmp_path / "out", workers=1)

    assert results.status.values.tolist() == [Status.DONE, Status.FAILED, Status.DONE, Status.DONE]
    assert results.message.values[1] == "the simulation diverged"
    assert np.isnan(results.y1_slope[1])
    alone = with_friction(well)
    np.testing.assert_array_equal(results.y1_amp_dc.values[[0, 2, 3]], alone["y1_amp_dc"])


def test_impossible_rows(task: FeatureSweep, tmp_path: Path) -> None:
    """A clearance of nothing, and one of two metres, are rows with a message; the others are simulated."""
    pytest.importorskip("xarray")
    points = np.array([ARM_A, (0.0, 1e-4, 1e-4), (2.0, 2.0, 2.0), ARM_B])

    results = run(task, Design(names=task.parameters, points=points), tmp_path / "out", workers=1)

    assert results.status.values.tolist() == [Status.DONE, Status.FAILED, Status.FAILED, Status.DONE]
    assert "clearances: contact needs them above 0, got 0 mm" in str(results.message.values[1])
    assert "the loops do not close" in str(results.message.values[2])


def test_stopped_and_begun_again(task: FeatureSweep, design: Design, tmp_path: Path) -> None:
    """A sweep that was stopped goes on where it was, and ends with the bits of one that was not."""
    pytest.importorskip("xarray")
    reports: list[Progress] = []

    def stop(now: Progress) -> None:
        if now.done == 16:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        run(task, design, tmp_path / "out", block=8, workers=1, progress=stop)
    again = run(task, design, tmp_path / "out", block=8, workers=1, progress=reports.append)

    assert (reports[0].resumed, reports[-1].done) == (16, 24)
    assert bits(again) == bits(run(task, design, tmp_path / "whole", workers=1))


def test_folder_of_other_settings(task: FeatureSweep, design: Design, tmp_path: Path) -> None:
    """A folder of sweeps with the other friction is refused, and the difference is named."""
    pytest.importorskip("xarray")
    few = attrs.evolve(design, points=design.points[:2])
    run(task, few, tmp_path / "out", workers=1)
    other = attrs.evolve(task, simulation_settings=attrs.evolve(CENTRE, threshold=2e-2))

    with pytest.raises(SweepError, match=r"settings\.simulation"):
        run(other, few, tmp_path / "out", workers=1)


def test_unknown_path(five_bar: Linkage) -> None:
    """A path that there is not is answered with what there is; none is swept twice, and one is needed.

    Pick and place has no straight part.
    """
    for name in ("y15", "pick-and-place"):
        with pytest.raises(UnknownNameError, match=f"no test path '{name}'"):
            FeatureSweep(linkage=five_bar, paths=("y1", name))
    with pytest.raises(InvalidValueError, match="paths: 'y1' occurs twice"):
        FeatureSweep(linkage=five_bar, paths=("y1", "y3", "y1"))
    with pytest.raises(InvalidValueError, match="paths: expected one or more, got none"):
        FeatureSweep(linkage=five_bar, paths=())
    with pytest.raises(InvalidValueError, match="replicates: expected 0 to 15, got 16"):
        FeatureSweep(linkage=five_bar, paths=("y1",), replicates=16)


def test_a_sweep_belongs_to_its_linkage(five_bar: Linkage) -> None:
    """A sweep is one of the linkage it was made of, whatever its own clearances, and of no other."""
    stored = json.loads(json.dumps(FeatureSweep(linkage=five_bar, paths=("y1",)).settings))

    assert is_sweep_of(stored, five_bar)
    assert is_sweep_of(stored, five_bar.with_clearances({"J2": 0.1e-3}))
    assert not is_sweep_of(stored, load_linkage("four-bar"))
    assert not is_sweep_of(stored, attrs.evolve(five_bar, loads=()))
    assert not is_sweep_of({}, five_bar)
