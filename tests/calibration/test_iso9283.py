"""AP, AD and RP of measured arms."""

import numpy as np
import pytest

from armwright.calibration.cross_validation import distinct_configurations, random_folds
from armwright.calibration.iso9283 import accuracy, repeatability
from armwright.calibration.readings import readings
from armwright.errors import TooFewError


def test_by_hand() -> None:
    """Two configurations, 3 and 4 mm off to either side: AP is 3.5 mm, AD what their distance grew by."""
    q = np.array([[0.0], [1.0]])
    seen = readings(q, [[0.0, 0.003, 0.0], [1.004, 0.0, 0.0]])

    found = accuracy(seen, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))

    assert found is not None
    assert pytest.approx(0.0035) == found.AP
    assert found.AP_largest == pytest.approx(0.004)
    assert pytest.approx(np.hypot(1.004, 0.003) - 1.0) == found.AD
    assert repeatability(seen) is None


def test_repeated() -> None:
    """A configuration measured three times has a barycentre, an RP of mean plus three deviations, and a floor."""
    q = np.array([[0.0], [0.0], [0.0], [1.0]])
    cloud = np.array([[0.001, 0, 0], [-0.001, 0, 0], [0, 0, 0.0]])
    seen = readings(q, np.vstack([cloud, [[1.0, 0, 0]]]))

    found, words = repeatability(seen), accuracy(seen, np.array([[0.0, 0, 0]] * 3 + [[1.0, 0, 0]]))

    assert found is not None
    assert words is not None
    assert found.configurations == 1
    assert found.cycles == 3
    distances = np.array([1e-3, 1e-3, 0.0])
    assert pytest.approx(distances.mean() + 3 * distances.std(ddof=1)) == found.RP
    assert found.floor == pytest.approx(1e-3)
    assert pytest.approx(0.0, abs=1e-15) == words.AP


def test_one_configuration() -> None:
    """One configuration has no distance from another."""
    assert accuracy(readings(np.zeros((2, 1)), np.zeros((2, 3))), np.zeros((2, 3))) is None


def test_one_configuration_cannot_be_held_out() -> None:
    """Of one configuration, however often measured, nothing is left to hold out."""
    with pytest.raises(TooFewError, match="folds: 30 readings of one joint configuration leave none to hold out"):
        random_folds(np.ones((30, 6)), 5, 0)


def test_repeats_are_held_out_together() -> None:
    """What was measured again is in the fold of the first time: it would tell the answer."""
    q = np.repeat(np.arange(10.0), 3)[:, None]

    folds = random_folds(q, 5, 0)

    np.testing.assert_array_equal(distinct_configurations(q), np.repeat(np.arange(10), 3))
    for away in folds:
        assert away.reshape(10, 3).all(axis=1).sum() == 2
        assert away.sum() == 6


def test_encoders_never_say_the_same() -> None:
    """Positions read back from encoders differ in the last digits, and are of one configuration all the same."""
    rng = np.random.default_rng(0)
    q = np.repeat(rng.uniform(-2, 2, (8, 6)), 4, axis=0) + 1e-6 * rng.standard_normal((32, 6))

    np.testing.assert_array_equal(distinct_configurations(q), np.repeat(np.arange(8), 4))
    np.testing.assert_array_equal(distinct_configurations(rng.uniform(-2, 2, (5, 6))), np.arange(5))
