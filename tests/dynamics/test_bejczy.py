"""Bejczy's model of the Stanford arm at JPL."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.dynamics.bejczy import PRINTED, Coefficients, bejczy_efforts, bejczy_gravity, bejczy_inertias, fitted
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import ShapeError, UnsupportedArmError
from oracles.arms import random_configurations


@pytest.fixture
def fit(rng: np.random.Generator) -> Coefficients:
    arm = load_arm("stanford-jpl")
    return fitted(arm, random_configurations(arm, rng, 500))


def test_fit_finds_the_report(fit: Coefficients) -> None:
    """Of the sixteen numbers all but three come out as printed, to 3 % or to the last printed digit.

    The report adds the rotor of joint 3 to what the slide carries, in b4 and k2, and in b20 it has forty times what
    the gripper resists about its own axis.
    """
    slips = {"b4", "k2", "b20"}
    for field in attrs.fields(Coefficients):
        fitted_value, printed = getattr(fit, field.name), getattr(PRINTED, field.name)
        near = abs(fitted_value - printed) <= max(0.03 * abs(printed), 0.5e-3)
        assert near == (field.name not in slips), (field.name, fitted_value, printed)


def test_fit_by_hand(fit: Coefficients) -> None:
    """What can be read off the masses and lengths: sums of masses, first moments, moments of inertia."""
    assert fit.b4 == fit.k2 == pytest.approx(4.25 + 1.08 + 0.63 + 0.51)
    assert fit.slide == pytest.approx(6.47 + 0.782)
    assert fit.b3 == pytest.approx(2 * 4.25 * -0.6447, rel=0.01)
    moment = 0.63 * 0.0566 + 0.51 * (0.2477 - 0.0922)
    assert fit.b5 == pytest.approx(2 * moment, rel=0.05)
    assert fit.k3 == pytest.approx(moment, rel=0.01)
    assert fit.b20 == pytest.approx(0.0003)
    assert fit.b19 == 0.02
    assert fit.b18 == pytest.approx(0.005 + 0.51 * 0.2477 * (0.2477 - 2 * 0.0922))


def test_model_is_near_the_arm(fit: Coefficients, rng: np.random.Generator) -> None:
    """With fitted constants the model misses the diagonal of the mass matrix and gravity by a few percent at most."""
    arm = load_arm("stanford-jpl")
    q = random_configurations(arm, rng, 200)
    D = np.diagonal(mass_matrix(arm, q), axis1=-2, axis2=-1)
    G = gravity_efforts(arm, q)

    for k in range(200):
        inertias = np.array(bejczy_inertias(fit, q[k].tolist()))
        holding = np.array(bejczy_gravity(fit, q[k].tolist(), arm.gravity[2]))
        np.testing.assert_allclose(inertias, D[k], rtol=0.05)
        np.testing.assert_allclose(holding, G[k], atol=0.005 * np.abs(G).max())


def test_efforts_are_inertias_and_gravity(rng: np.random.Generator) -> None:
    """Each joint feels its own acceleration and gravity; a whole motion is as its configurations."""
    q, qdd = rng.normal(size=(2, 3, 4, 6))

    tau = bejczy_efforts(q, qdd, gravity=9.80621)

    assert tau.shape == (3, 4, 6)
    row = q[1, 2].tolist()
    expected = np.array(bejczy_inertias(PRINTED, row)) * qdd[1, 2] + bejczy_gravity(PRINTED, row, 9.80621)
    np.testing.assert_allclose(tau[1, 2], expected)


def test_slide_carries_its_weight() -> None:
    """Upright, the slide of an arm that stands needs a positive force: it holds what it carries up."""
    assert bejczy_efforts(np.zeros(6), np.zeros(6))[2] == pytest.approx(7.257 * 9.80665)


def test_only_stanford_arms() -> None:
    """A PUMA has no slide, and five joints are not six."""
    with pytest.raises(
        UnsupportedArmError, match="'puma560' is not a Stanford arm: expected six joints, of which only"
    ):
        fitted(load_arm("puma560"), np.zeros((10, 6)))
    with pytest.raises(ShapeError, match="qdd: expected 6 numbers on the last axis"):
        bejczy_efforts(np.zeros(6), np.zeros(5))
