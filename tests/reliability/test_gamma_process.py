"""Growth as a gamma process: against a grid over both of its numbers, and the coverage of its intervals."""

import numpy as np
import pytest
from scipy.stats import gamma

from armwright.errors import InvalidValueError, ShapeError, TooFewError
from armwright.reliability.gamma_process import gamma_process
from samples import Sample

# Of the simulated processes; written before they were simulated for the first time.
SEED = 20_261_127
STROKES, GROWTHS = [1e6, 1e6, 2e6, 1e6], [1.1e-6, 0.8e-6, 2.3e-6, 1.2e-6]


def test_grid_over_shape_and_rate() -> None:
    """The probability of a growth is that of a sum over a grid of shapes and rates."""
    found = gamma_process(STROKES, GROWTHS)
    a, b = (np.geomspace(*ends, 300)[:, None] for ends in ((1e-8, 1.0), (1e4, 1e12)))
    b = b.T
    logs = sum(gamma.logpdf(x, a * n, scale=1 / b) for n, x in zip(STROKES, GROWTHS, strict=True))
    weights = np.exp(logs - logs.max())
    for growth, strokes in ((2e-6, 1e6), (2e-6, 3e6), (1e-5, 5e6)):
        expected = (weights * gamma.sf(growth, a * strokes, scale=1 / b)).sum() / weights.sum()
        assert found.failure(growth, strokes) == pytest.approx(expected, rel=0.01, abs=1e-4)
    assert found.failure(2e-6, 0) == 0
    for part in (0.1, 0.5):
        assert found.failure(5e-6, found.quantile(5e-6, part)) == pytest.approx(part)


def test_regular_growth() -> None:
    """Growth that hardly varies goes on as it was."""
    found = gamma_process([1e6] * 5, 1e-6 * (1 + 1e-4 * np.array([1, -1, 2, 0, -2])))
    assert found.quantile(5e-6, 0.5) == pytest.approx(5e6, rel=1e-3)
    assert found.quantile(5e-6, 0.95) / found.quantile(5e-6, 0.05) < 1.01


@pytest.mark.proof
@pytest.mark.share(0.03)
def test_intervals_cover(sample: Sample) -> None:
    """From 5 to 95 % lie the lives of about nine in ten processes that were measured eight times."""
    count, covered = sample.count(200), 0
    for number in range(count):
        rng = np.random.default_rng([SEED, number])
        shape, size, left = 10 ** rng.uniform(0, 1), 1e-6, 2e-5
        x = rng.gamma(shape, size / shape, 8)
        found = gamma_process(np.full(8, 1e6), x)
        # Growth in steps of a hundredth of an increment, far beyond the limit.
        path = np.cumsum(rng.gamma(shape / 100, size / shape, 20_000))
        life = 1e4 * (int((path > left).argmax()) + 1)
        covered += found.quantile(left, 0.05) <= life <= found.quantile(left, 0.95)
    sample.record(f"lives of gamma processes, seed {SEED} fixed beforehand", count, 0, covered=covered / count)
    assert abs(covered / count - 0.9) <= (0.05 if count == 200 else 0.3)


@pytest.mark.parametrize(
    ("strokes", "growths", "error"),
    [
        ([1.0, 1], [1.0, 1], TooFewError),
        ([1.0, 1, 1], [1.0, -1, 1], InvalidValueError),
        ([1.0, 1, 0], [1.0, 1, 1], InvalidValueError),
        ([1.0, 1, 1], [1.0, 1], ShapeError),
        ([1.0, 1, np.nan], [1.0, 1, 1], InvalidValueError),
    ],
)
def test_what_is_no_growth(strokes: list, growths: list, error: type[Exception]) -> None:
    """What does not grow, or was measured too seldom, is refused."""
    with pytest.raises(error):
        gamma_process(strokes, growths)


def test_what_is_never_reached() -> None:
    """A growth that is out of reach, and a part that is none, are refused."""
    found = gamma_process(STROKES, GROWTHS)
    with pytest.raises(InvalidValueError, match="expected one near"):
        found.quantile(1e15, 0.5)
    with pytest.raises(InvalidValueError, match="part"):
        found.quantile(1.0, 0.0)
