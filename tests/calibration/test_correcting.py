"""The corrected arm: an arm like any other, that is where the calibration says."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.chain import chain_of
from armwright.calibration.correcting import corrected_arm
from armwright.calibration.fitting import calibrate
from armwright.calibration.validation import cross_validated
from armwright.errors import InvalidValueError
from armwright.kinematics.forward import forward
from calibration.simulated import postures, random_arm, random_errors, random_pose, seen

# Products of ten poses [m].
ROUNDING = 1e-12


@pytest.mark.parametrize("n", [3, 5, 7])
def test_corrected_arm(n: int, rng: np.random.Generator) -> None:
    """The forward kinematics of the corrected arm are those of the calibration, in the frame of the measurements."""
    arm = random_arm(rng, n, slides=True)
    chain = chain_of(arm, base=random_pose(rng, 0.5))
    q = postures(rng, arm, 60)
    found = calibrate(arm, q, seen(chain, q, random_errors(rng, chain), 5e-5, rng), without=("beta",))

    better = corrected_arm(found)

    np.testing.assert_allclose(forward(better, q)[:, :3, 3], found.predict(q), atol=ROUNDING)
    assert better.links == arm.links


def test_turns_about_y_do_not_fit_a_table(rng: np.random.Generator) -> None:
    """A turn about y between parallel axes has no place in a table, and the text says what to do."""
    arm = load_arm("ur5")
    chain = chain_of(arm)
    q = postures(rng, arm, 60)
    found = calibrate(arm, q, seen(chain, q, random_errors(rng, chain), 5e-5, rng))

    with pytest.raises(InvalidValueError, match=r'calibrate without=\("beta",\)'):
        corrected_arm(found)


def test_held_out_points_tell_the_noise(rng: np.random.Generator) -> None:
    """Held-out points are as far off as the noise of three coordinates makes them, and a little more."""
    arm = load_arm("puma560")
    chain = chain_of(arm)
    q, noise = postures(rng, arm, 120), 1e-4
    off = cross_validated(arm, q, seen(chain, q, random_errors(rng, chain), noise, rng))

    usual = noise * np.sqrt(8 / np.pi)
    assert 0.95 * usual < off.mean() < 1.35 * usual


@pytest.mark.parametrize("folds", [1, 7])
def test_folds(folds: int) -> None:
    """There are two folds or more, and a point in each."""
    with pytest.raises(InvalidValueError, match="folds: expected 2 to 6"):
        cross_validated(load_arm("ntu-3r"), np.zeros((6, 3)), np.zeros((6, 3)), folds=folds)
