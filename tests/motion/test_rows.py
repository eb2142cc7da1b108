"""Equations of rows: NumPy and kernels evaluate them alike, joint by joint."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.motion.polynomials import composed_peaks, peaks, shifted
from armwright.motion.rows import Evaluator, by_kernels, on_arrays
from armwright.tracing.loops import Runner, compiled, with_numpy
from armwright.tracing.scalar import Scalar, larger, smaller


def _of_joint(terms: list[Scalar], offsets: list[Scalar], row: list[Scalar]) -> list[list[Scalar]]:
    """Return two outputs of a joint, of one and of two scalars."""
    return [[terms[0] * row[0] + terms[2]], [larger(terms[1], offsets[0]), smaller(row[1], terms[0])]]


def _of_row(x: list[Scalar], y: list[Scalar]) -> list[list[Scalar]]:
    """Return the sum of a row and a product."""
    return [[x[0] + x[1] + x[2], x[0] * y[0]]]


@pytest.fixture(params=[on_arrays, by_kernels])
def evaluate(request: pytest.FixtureRequest) -> Evaluator:
    """Both ways to evaluate an equation."""
    way: Evaluator = request.param
    return way


def test_rows_of_joints(evaluate: Evaluator, rng: np.random.Generator) -> None:
    """Inputs of joints and of rows meet in every joint, whatever the memory of the arrays is like."""
    terms, offsets, row = rng.normal(size=(7, 3, 5)), rng.normal(size=(5, 1, 7)).T, rng.normal(size=(7, 2))

    one, two = evaluate(_of_joint, [terms, offsets], [row])

    assert (one.shape, two.shape) == ((7, 1, 5), (7, 2, 5))
    np.testing.assert_allclose(one[:, 0], terms[:, 0] * row[:, :1] + terms[:, 2], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(two[:, 0], np.maximum(terms[:, 1], offsets[:, 0]))
    np.testing.assert_array_equal(two[:, 1], np.minimum(row[:, 1:], terms[:, 0]))


def test_rows_without_joints(evaluate: Evaluator, rng: np.random.Generator) -> None:
    """An equation of rows alone gives one output per row."""
    x, y = rng.normal(size=(9, 3)), rng.normal(size=(9, 1))

    (found,) = evaluate(_of_row, [], [x, y])

    np.testing.assert_allclose(found, np.stack([x.sum(axis=1), x[:, 0] * y[:, 0]], axis=1), rtol=0, atol=1e-14)


def test_peaks_against_a_dense_grid(evaluate: Evaluator, rng: np.random.Generator) -> None:
    """No sample of a polynomial is beyond the peak, and some come up to it."""
    for degree in (1, 2, 3, 5, 9):
        terms, lengths = rng.normal(size=(6, degree + 1, 3)), rng.uniform(0.1, 1.5, 6)
        peak = peaks(terms, lengths, evaluate)
        sampled = np.max([_magnitudes(terms[k], lengths[k], 0) for k in range(6)], axis=0)
        assert (sampled <= peak * (1 + 1e-12) + 1e-12).all()
        np.testing.assert_allclose(sampled, peak, rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("run", [compiled, with_numpy])
def test_peaks_of_a_run(run: Runner, rng: np.random.Generator) -> None:
    """The polynomial of a run along cubics is their composition, and no sample of its rates is beyond their peaks."""
    for _ in range(10):
        m, p, n = (int(x) for x in rng.integers(1, 8, 3))
        cubics, law, places = rng.normal(size=(m, 4, n)), rng.normal(size=(p, 4)), rng.integers(0, m, p)
        times = np.append(0.0, np.cumsum(rng.uniform(0.1, 1.5, p)))

        terms, *rates = composed_peaks(cubics, law, places, times, run)

        for k in range(p):
            t = rng.uniform(0, times[k + 1] - times[k], 5)
            s = np.polynomial.Polynomial(law[k])(t)
            there = [np.polynomial.Polynomial(joint)(s) for joint in cubics[places[k]].T]
            np.testing.assert_allclose([np.polynomial.Polynomial(x)(t) for x in terms[k].T], there, atol=1e-9)
        for order, peak in enumerate(rates, 1):
            sampled = np.max([_magnitudes(terms[k], times[k + 1] - times[k], order) for k in range(p)], axis=0)
            assert (sampled <= peak * (1 + 1e-12) + 1e-12).all()
            np.testing.assert_allclose(sampled, peak, rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize("run", [compiled, with_numpy])
def test_peaks_of_single_pieces(run: Runner, rng: np.random.Generator) -> None:
    """Where the rate of a piece rises and falls several times its largest peak is found as well."""
    for _ in range(200):
        cubics, law, length = rng.normal(size=(1, 4, 2)), rng.normal(size=(1, 4)), rng.uniform(0.3, 1.5)

        terms, *rates = composed_peaks(cubics, law, np.zeros(1, dtype=np.intp), np.array([0.0, length]), run)

        for order, peak in enumerate(rates, 1):
            assert (_magnitudes(terms[0], length, order) <= peak * (1 + 1e-9)).all()


def _magnitudes(terms: Array, length: float, order: int) -> Array:
    """Return the largest magnitudes of polynomials (k, n) at many samples, (n,)."""
    t = np.linspace(0.0, length, 4001)
    values = [np.polynomial.Polynomial(joint).deriv(order)(t) for joint in terms.T]
    return np.asarray(np.abs(values).max(axis=1))


def test_shifted_polynomials(evaluate: Evaluator, rng: np.random.Generator) -> None:
    """A polynomial around another position has the same values there."""
    terms, shift = rng.normal(size=(4, 5, 2)), rng.normal(size=4)

    moved = shifted(terms, shift, evaluate)

    for k in range(4):
        for j in range(2):
            same = np.polynomial.Polynomial(terms[k, :, j])(shift[k] + 0.3)
            assert np.polynomial.Polynomial(moved[k, :, j])(0.3) == pytest.approx(same, abs=1e-12)
