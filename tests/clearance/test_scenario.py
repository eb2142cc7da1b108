"""Scenarios: samples are as far apart as is asked for, in whole steps, and the last one is at the end."""

import numpy as np
import pytest

from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.correction import tip_positions
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import thesis_path
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate

# Sums of a few doubles.
ROUNDING = 1e-12


@pytest.mark.parametrize("sample", [1e-4, 3.3e-4, 7e-3, 0.13, 10.0])
def test_samples_end_with_the_path(five_bar: Linkage, sample: float) -> None:
    """Whatever time lies between samples, the steps are no longer than asked for and the last ends the path."""
    task = prepare_scenario(five_bar, thesis_path("y1"), Settings(step=2e-5, sample=sample))

    assert task.steps % task.stride == 0
    assert task.h <= 2e-5 * (1 + ROUNDING)
    assert task.steps * task.h == pytest.approx(0.25, abs=ROUNDING)


def test_two_samples_are_the_first_and_the_last(five_bar: Linkage) -> None:
    """Two samples of a run are its first and its last: the tip ends where it does with many."""
    path = thesis_path("y1")
    often, seldom = (
        simulate(prepare_scenario(five_bar, path, Settings(step=2e-5, sample=target))) for target in (2e-5, 10.0)
    )

    np.testing.assert_array_equal(seldom.time, [0.0, often.time[-1]])
    np.testing.assert_array_equal(seldom.tip, often.tip[[0, -1]])
    np.testing.assert_allclose(tip_positions(seldom, np.array([0.0, 0.25])), seldom.tip, atol=ROUNDING)
    assert [target["time"] for target in ClearanceRun.of(seldom).as_data()["targets"]] == pytest.approx(
        [0.0, 0.25], abs=ROUNDING
    )
