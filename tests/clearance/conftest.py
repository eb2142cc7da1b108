"""What the tests of features and estimates share: one sweep of the five-bar, made once."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.estimation.kriging import Surrogate, fit_surrogate
from armwright.clearance.feature_sweep import FeatureSweep, feature_vector
from armwright.clearance.linkage import Linkage
from armwright.clearance.reader import load_linkage
from armwright.sweep.designs import sobol
from clearance.arms import CENTRE, PATHS

# From where to where clearances are swept [m], in how many runs.
RANGE, RUNS = (0.1e-3, 0.5e-3), 128
# The thesis' three features, and where the tip is at the start.
FEATURES = ("slope", "intercept", "amp_dc", "offset_x", "offset_y")


class Swept(NamedTuple):
    """128 five-bars on three paths, and what was learnt of them."""

    task: FeatureSweep
    points: Array
    values: Mapping[str, Array]
    surrogate: Surrogate

    def features(self, clearances: Array) -> Array:
        """All features (..., f) of other five-bars, without noise."""
        return feature_vector(self.task(np.atleast_2d(clearances)), PATHS, FEATURES)


@pytest.fixture(scope="session")
def five_bar() -> Linkage:
    return load_linkage("five-bar")


@pytest.fixture(scope="session")
def swept(five_bar: Linkage) -> Swept:
    pytest.importorskip("sklearn")
    task = FeatureSweep(linkage=five_bar, paths=PATHS, simulation_settings=CENTRE, replicates=0)
    design = sobol(dict.fromkeys(task.parameters, RANGE), RUNS, 0)
    values = task(design.points)
    names = [f"{path}_{feature}" for path in PATHS for feature in FEATURES]
    table = feature_vector(values, PATHS, FEATURES)
    surrogate = fit_surrogate(task.parameters, design.points, names, table, ranges=[RANGE] * 3)
    return Swept(task, design.points, values, surrogate)
