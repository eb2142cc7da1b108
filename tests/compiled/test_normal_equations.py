"""Normal equations of the parameters of the dynamics."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.compiled.normal_equations import normal_equations
from armwright.dynamics.identification import base_parameters, base_regressor
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.regressors import dynamic_parameters, regressor
from armwright.errors import InvalidValueError, KindError, ShapeError

ROUNDING = 1e-12  # relative to the largest number
ARM = load_arm("stanford")


def _assert_near(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.parametrize("lead", [(), (1,), (511,), (513,), (3, 500)])
def test_sums(lead: tuple[int, ...], rng: np.random.Generator) -> None:
    """The sums over blocks are those over all samples, with the weight of each joint, whatever their number."""
    q, qd, qdd, tau = rng.normal(size=(4, *lead, 6))
    weights = rng.uniform(0, 2, size=6)
    weights[2] = 0.0  # a joint that was not measured
    Y = regressor(ARM, q, qd, qdd).reshape(-1, 6, 84)

    A, b = normal_equations(ARM, q, qd, qdd, tau, weights=weights)

    _assert_near(A, np.einsum("kij,i,kil->jl", Y, weights, Y))
    _assert_near(b, np.einsum("kij,i,ki->j", Y, weights, tau.reshape(-1, 6)))
    np.testing.assert_array_equal(A, A.T)


def test_fit(rng: np.random.Generator) -> None:
    """Efforts of an arm, fitted by least squares, are predicted for other motions, though no parameter is found."""
    q, qd, qdd = rng.normal(size=(3, 600, 6))
    others = rng.normal(size=(3, 50, 6))

    A, b = normal_equations(compile_arm(ARM), q, qd, qdd, inverse_dynamics(ARM, q, qd, qdd))
    theta = np.linalg.lstsq(A, b, rcond=1e-12)[0]

    expected = inverse_dynamics(ARM, *others)
    # The normal equations square the condition of the problem.
    np.testing.assert_allclose(regressor(ARM, *others) @ theta, expected, atol=1e-6 * np.abs(expected).max())
    assert np.linalg.matrix_rank(A) < 84
    assert np.abs(theta - dynamic_parameters(ARM)).max() > 0.01


def test_fit_of_base_parameters(rng: np.random.Generator) -> None:
    """Base parameters are found again, from efforts of an arm whose rotors and friction count."""
    q, qd, qdd = rng.normal(size=(3, 600, 6))
    base = base_parameters(ARM)

    A, b = normal_equations(ARM, q, qd, qdd, inverse_dynamics(ARM, q, qd, qdd), base=True)

    Y = base_regressor(ARM, q, qd, qdd)
    _assert_near(A, np.einsum("kij,kil->jl", Y, Y))
    expected = base.combinations @ dynamic_parameters(ARM)
    # The normal equations square the condition of the problem.
    np.testing.assert_allclose(np.linalg.solve(A, b), expected, atol=1e-8 * np.abs(expected).max())


def test_mistakes() -> None:
    """What does not fit is refused by name."""
    zeros = np.zeros((4, 6))

    with pytest.raises(ShapeError, match="tau"):
        normal_equations(ARM, zeros, zeros, zeros, np.zeros((4, 5)))
    with pytest.raises(ShapeError, match="leading axes must broadcast"):
        normal_equations(ARM, zeros, zeros, zeros, np.zeros((3, 6)))
    with pytest.raises(InvalidValueError, match="tau: every number must be finite"):
        normal_equations(ARM, zeros, zeros, zeros, np.full(6, np.nan))
    with pytest.raises(InvalidValueError, match="weights: expected numbers of 0 or more"):
        normal_equations(ARM, zeros, zeros, zeros, zeros, weights=[1, 1, 1, 1, 1, -1])
    with pytest.raises(InvalidValueError, match="weights: expected numbers no larger than"):
        normal_equations(ARM, zeros, zeros, zeros, zeros, weights=[1, 1, 1, 1, 1, 1e101])
    with pytest.raises(KindError, match="expected an Arm"):
        normal_equations("stanford", zeros, zeros, zeros, zeros)  # type: ignore[arg-type]
