"""Until when a run is a prediction, against runs that the claim has not seen."""

import numpy as np

from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import TEST_PATHS, thesis_path
from armwright.clearance.predictability import APART, perturbed, with_outlook
from armwright.clearance.preparing import prepare
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from samples import Sample


def test_claim_holds_against_other_runs(five_bar: Linkage, sample: Sample) -> None:
    """Until the time that is told, a run with clearances that it has not seen, a nanometre away, stays with it."""
    worst, count = 0.0, sample.count(30)
    for rng in sample.cases(30):
        path, c = thesis_path(str(rng.choice(list(TEST_PATHS)))), rng.uniform(0.1e-3, 0.5e-3, 3)
        task = prepare(five_bar, path, Settings())
        run, outlook = with_outlook(task, c)
        other = simulate(task, c + rng.uniform(-1e-9, 1e-9, 3))
        before = run.time <= outlook.until
        worst = max(worst, float(np.linalg.norm(other.error - run.error, axis=-1)[before].max()))
    sample.record(
        "predictable until t, against another run a nanometre away", count, int(worst > 2 * APART), worst=worst
    )

    assert worst < 3 * APART


def test_bits_beside_others(five_bar: Linkage) -> None:
    """The run keeps its bits whatever runs beside it, in whatever number of threads, and the claim does too."""
    task, c = prepare(five_bar, thesis_path("x4"), Settings()), np.array((3e-4, 4.8e-4, 1.6e-4))

    alone = simulate(task, c)
    runs = [with_outlook(task, c, threads=threads) for threads in (1, 2)]

    for run, outlook in runs:
        np.testing.assert_array_equal(run.q, alone.q)
        np.testing.assert_array_equal(run.works["driven"], alone.works["driven"])
        assert outlook.until == runs[0][1].until
        assert not outlook.to_the_end
        assert outlook.spread.max() > APART


def test_perturbations() -> None:
    """The first of the runs is the run itself; the others are a nanometre away at most, and all have some play."""
    rows = perturbed(np.array((1e-9, 3e-4)))

    np.testing.assert_array_equal(rows[0], (1e-9, 3e-4))
    assert np.abs(rows - rows[0]).max() <= 1e-9
    assert rows.min() > 0
    assert len(np.unique(rows[:, 1])) == len(rows)
