"""How good a calibration is on points that it has not seen."""

from collections.abc import Callable, Sequence

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, floats
from armwright.calibration.fitting import calibrate
from armwright.errors import InvalidValueError


def cross_validated(
    arm: Arm,
    q: ArrayLike,
    points: ArrayLike,
    *,
    folds: int = 5,
    seed: int = 0,
    base: Array | None = None,
    without: Sequence[str] = (),
    progress: Callable[[int], None] | None = None,
) -> Array:
    """Return how far each point is from where an arm calibrated without it would have its tool.

    The points are dealt out into folds by chance; each fold is held against a calibration by all others.

    Args:
        arm: as it is said to be, with n joints.
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) where the tool was [m].
        folds: how many parts the points are dealt out into.
        seed: of the dealing.
        base: see ``calibrate``.
        without: see ``calibrate``.
        progress: told how many folds are done.

    Returns:
        (m,) distances [m].

    Raises:
        InvalidValueError: there are not as many points as folds, or too few for the errors of the arm.
    """
    places, seen = np.atleast_2d(floats(q, "q")), np.atleast_2d(floats(points, "points"))
    if not 2 <= folds <= len(seen):
        raise InvalidValueError(f"folds: expected 2 to {len(seen)}, one point in each or more, got {folds}")
    dealt = np.random.default_rng(seed).permutation(len(seen)) % folds
    off = np.zeros(len(seen))
    for fold in range(folds):
        away = dealt == fold
        found = calibrate(arm, places[~away], seen[~away], base=base, without=without)
        off[away] = np.linalg.norm(found.predict(places[away]) - seen[away], axis=1)
        if progress is not None:
            progress(fold + 1)
    return off
