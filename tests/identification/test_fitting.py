"""Fits: least squares as others do it, errors that noise in time does not deceive, outliers, and memory."""

import tracemalloc
from collections.abc import Iterator

import attrs
import numpy as np
import pytest
from scipy.linalg import toeplitz

from armwright.errors import TooFewError
from armwright.identification.equations import Equations, equations
from armwright.identification.fitting import ordinary, robust, summed, weighted
from armwright.identification.model import DynamicModel
from armwright.identification.signals import motions, preparation_of
from identification.simulated import log, noise, truth
from samples import Sample

THETA = np.array([2.0, -1.0, 0.5])


def _linear(
    rng: np.random.Generator, count: int = 4000, *, sigma: tuple[float, float] = (0.5, 2.0), correlation: float = 0.0
) -> Equations:
    """Equations of two joints with three parameters, whose columns change slowly, as motions do."""
    t = np.arange(count) / 100
    columns = np.stack([np.sin(rng.uniform(0.5, 5, (2, 1)) * t + rng.uniform(0, 6, (2, 1))) for _ in THETA], axis=-1)
    columns = columns.transpose(1, 0, 2)
    tau = columns @ THETA + sigma * noise(rng, (count, 2), correlation)
    return Equations("log", t, columns, tau, np.ones((count, 2), dtype=bool))


def test_least_squares_as_numpy_has_it(rng: np.random.Generator) -> None:
    """Sums of blocks give the parameters and the covariance of one large system."""
    block = _linear(rng)
    halves = [Equations("log", *(part[rows] for part in block[1:])) for rows in (slice(1000), slice(1000, None))]
    A, y = block.columns.reshape(-1, 3), block.tau.reshape(-1)
    values, rest, *_ = np.linalg.lstsq(A, y, rcond=None)

    fit = ordinary(summed(halves))

    np.testing.assert_allclose(fit.values, values, rtol=1e-10)
    np.testing.assert_allclose(fit.covariance, rest[0] / (len(y) - 3) * np.linalg.inv(A.T @ A), rtol=1e-9)
    assert fit.condition == pytest.approx(np.linalg.cond(A))


def test_weights_of_joints_are_their_variances(rng: np.random.Generator) -> None:
    """A joint with four times the noise counts a sixteenth: standard deviations come out, and errors fall."""
    sums = summed([_linear(rng)])

    fit = weighted(sums)

    np.testing.assert_allclose(fit.sigma, [0.5, 2.0], rtol=0.05)
    assert (fit.errors < ordinary(sums).errors).all()


def test_errors_of_autocorrelated_noise_are_those_of_its_covariance(rng: np.random.Generator) -> None:
    """The errors agree with the exact covariance of least squares under a first-order process, to a quarter."""
    block = _linear(rng, 3000, correlation=0.9)
    fit = robust([block])
    Gamma = toeplitz(0.9 ** np.arange(3000))
    bread = sum(block.columns[:, j].T @ block.columns[:, j] / fit.sigma[j] ** 2 for j in range(2))
    meat = sum(
        block.columns[:, j].T @ Gamma @ block.columns[:, j] * s**2 / fit.sigma[j] ** 4 for j, s in enumerate((0.5, 2.0))
    )
    exact = np.linalg.inv(bread) @ meat @ np.linalg.inv(bread)

    np.testing.assert_allclose(fit.errors, np.sqrt(exact.diagonal()), rtol=0.25)
    assert (fit.errors > 2 * weighted(summed([block])).errors).all()
    assert fit.order == (1, 1)


@pytest.mark.share(0.3)
def test_intervals_cover_as_often_as_they_say(sample: Sample) -> None:
    """Intervals of 90 % hold the true parameters in 90 % of all draws, of noise that hangs together or does not."""
    inside, count = 0, 0
    for rng in sample.cases(300):
        fit = robust([_linear(rng, 2000, correlation=rng.choice([0.0, 0.5, 0.9]))])
        inside += int((np.abs(fit.values - THETA) < 1.645 * fit.errors).sum())
        count += 3
    # Four standard deviations of the count, and three hundredths for what the process of the noise is not known well.
    spread = 4 * np.sqrt(0.09 / count) + 0.03
    sample.record("intervals of 90 % under autocorrelated noise", count, count - inside, covered=inside / count)
    assert abs(inside / count - 0.9) < spread


def test_outliers_are_named_and_do_no_harm(rng: np.random.Generator) -> None:
    """Ten wild readings are found at their times and joints; the parameters stay within their errors."""
    block = _linear(rng)
    wild = rng.choice(len(block.t), 10, replace=False)
    tau = block.tau.copy()
    tau[wild, 1] += 60.0
    spoilt = block._replace(tau=tau)

    fit = robust([spoilt])

    assert {(round(outlier.t, 6), outlier.joint) for outlier in fit.outliers} == {
        (round(block.t[k], 6), 1) for k in wild
    }
    assert (np.abs(fit.values - THETA) < 4 * fit.errors).all()
    assert np.abs(fit.values - THETA).max() < np.abs(ordinary(summed([spoilt])).values - THETA).max()


def test_parameters_of_an_arm_come_back(rng: np.random.Generator) -> None:
    """Without noise the base parameters of an arm are found to a thousandth of their size."""
    arm = truth()
    model = DynamicModel(arm=arm)
    perfect = log(arm, rng, sigma=0.0, resolution=1e-12)
    preparation = preparation_of([perfect], cutoff=30.0, decimation=10)
    from armwright.dynamics.regressors import dynamic_parameters

    drives = [(m.inertia, m.viscous, m.coulomb_forward, m.offset) for m in arm.motors]
    expected = model.base.combinations @ np.concatenate([dynamic_parameters(arm)[:60], np.ravel(drives)])

    fit = weighted(summed(equations(model, motions([perfect], preparation), 10)))

    np.testing.assert_allclose(fit.values, expected, atol=3e-3)


def test_too_few_equations_are_refused(rng: np.random.Generator) -> None:
    """Fewer equations than parameters are refused with both numbers."""
    block = _linear(rng, 4000)
    none = block._replace(usable=np.zeros_like(block.usable))
    with pytest.raises(TooFewError, match="0 usable equations for 3 base parameters"):
        ordinary(summed([none]))
    with pytest.raises(TooFewError, match="no equation is left"):
        summed([])


@attrs.frozen
class _Stream:
    """Equations that are made anew each time they are gone through, as those of a file that memory does not hold."""

    blocks: int

    def __iter__(self) -> Iterator[Equations]:
        for k in range(self.blocks):
            yield _linear(np.random.default_rng(k), 4000, correlation=0.5)


def test_memory_does_not_grow_with_equations() -> None:
    """Eight times as many equations, made anew as they are gone through, need no more memory."""
    peaks = []
    for blocks in (2, 16):
        tracemalloc.start()
        fit = robust(_Stream(blocks))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()

    assert peaks[1] < 1.2 * peaks[0]
    assert (np.abs(fit.values - THETA) < 5 * fit.errors).all()
