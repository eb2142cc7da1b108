"""The thesis' two arms, how their simulations are set so that its numbers come back, and parts of its paths."""

from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike
from armwright.clearance.equations import FrictionModel
from armwright.clearance.feature_sweep import FeatureSweep
from armwright.clearance.paths import Path
from armwright.clearance.settings import Settings

# Clearances of J2, J3 and J4 [m].
ARM_A, ARM_B = np.array((0.328, 0.171, 0.483)) * 1e-3, np.array((0.460, 0.480, 0.460)) * 1e-3
CENTRE = Settings(friction=FrictionModel(velocity="centre"), threshold=1e-2)
PATHS = ("y1", "y3", "y7")
# Where these paths start [m].
STARTS = np.array(((-0.15, -0.7), (-0.05, -0.7), (0.15, -0.7)))


def accuracy(estimated: ArrayLike, true: ArrayLike) -> Array:
    """Mean accuracy of clearances (..., 3) as the thesis counts it [%]."""
    estimated, true = np.asarray(estimated), np.asarray(true)
    return np.asarray(100 * (1 - np.abs(estimated / true - 1)).mean(axis=-1))


def beginning(path: Path, end: float) -> Path:
    """A path up to a time [s]."""
    pieces = int(np.searchsorted(path.knots, end))
    return attrs.evolve(path, knots=np.append(path.knots[:pieces], end), pieces=path.pieces[:pieces], targets=(0.0,))


def varied(task: FeatureSweep, **changes: Any) -> FeatureSweep:
    """The same sweep in another way, on the paths that the first one has prepared: to prepare one takes long.

    Args:
        task: the first one.
        changes: fields that the prepared paths do not depend on, such as ``replicates`` and ``free``.
    """
    other = attrs.evolve(task, **changes)
    vars(other)["tasks"] = task.tasks
    return other
