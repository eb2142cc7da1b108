"""Against the non-central chi-square law, and Imhof's integral of quadratic forms."""

import numpy as np
import pytest
from scipy.stats import chi, ncx2

from armwright.errors import InvalidValueError, ShapeError
from armwright.reliability.exceedance import exceedance
from samples import Sample


def by_directions(mean: np.ndarray, deviations: np.ndarray, limit: float) -> float:
    """Return the same probability by an integral over the directions of the deviations, the mean being within."""
    turns = 2 * np.pi * (np.arange(1200) + 0.5) / 1200
    circle, weights = np.stack([np.cos(turns), np.sin(turns)], axis=-1), np.full(1200, 1 / 1200)
    if len(mean) == 3:
        height, parts = np.polynomial.legendre.leggauss(400)
        flat = np.sqrt(1 - height**2)[:, None, None] * circle
        ways = np.concatenate([flat, np.broadcast_to(height[:, None, None], (400, 1200, 1))], axis=-1).reshape(-1, 3)
        weights = (parts[:, None] / 2 * weights).ravel()
    else:
        ways = circle
    steps = ways * deviations
    a, b = (steps**2).sum(axis=-1), steps @ mean
    distance = (np.sqrt(b**2 + a * (limit**2 - mean @ mean)) - b) / a
    return float(weights @ chi.sf(distance, len(mean)))


def imhof(mean: np.ndarray, deviations: np.ndarray, limit: float) -> float:
    """Return the probability that a sum of squares of independent normal numbers is above limit², by Imhof (1961)."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    period = 4 * np.pi / limit**2
    u = (np.arange(40_000)[:, None] + (nodes + 1) / 2) * period
    angle, decay = -(limit**2) * u / 2, np.ones_like(u)
    for m, deviation in zip(mean, deviations, strict=True):
        v, shift = deviation**2, (m / deviation) ** 2
        bent = 1 + (v * u) ** 2
        angle += (np.arctan(v * u) + shift * v * u / bent) / 2
        decay *= bent**0.25 * np.exp(shift * (v * u) ** 2 / (2 * bent))
    return 0.5 + float((np.sin(angle) / (u * decay) @ weights).sum() * period / 2) / np.pi


@pytest.mark.proof
@pytest.mark.share(0.02)
def test_equal_variances(sample: Sample) -> None:
    """Of equal variances the squared length is non-central chi-square, down to 1e-300."""
    rng = np.random.default_rng(sample.seed)
    worst = 0.0
    for _ in range(sample.count(2000)):
        d, deviation = int(rng.integers(1, 4)), 10 ** rng.uniform(-4, 1)
        mean = rng.normal(size=d) * rng.choice([0, 0.1, 1, 5])
        limit = np.linalg.norm(mean) + deviation * rng.uniform(0.01, 30)
        turn, _ = np.linalg.qr(rng.normal(size=(d, d)))
        found = exceedance(mean, turn @ turn.T * deviation**2, limit)
        shift = (mean @ mean) / deviation**2
        expected = ncx2.sf((limit / deviation) ** 2, d, shift) if shift < 1e4 else 0.0
        if expected > 1e-14:  # beyond it, and far from zero, SciPy has few digits
            worst = max(worst, abs(found / expected - 1))
    sample.record("probabilities of equal variances", sample.count(2000), int(worst > 1e-9), worst=f"{worst:.1e}")
    assert worst < 1e-9


@pytest.mark.proof
@pytest.mark.share(0.05)
def test_unequal_variances(sample: Sample) -> None:
    """Of unequal variances it is the integral over directions, into the tail."""
    rng = np.random.default_rng(sample.seed)
    worst = 0.0
    for _ in range(sample.count(200)):
        d = int(rng.integers(2, 4))
        deviations, mean = 10 ** rng.uniform(-1, 0, d), rng.normal(size=d) * rng.choice([0.0, 0.5])
        axes, _ = np.linalg.qr(rng.normal(size=(d, d)))
        limit = float(np.linalg.norm(mean) + deviations.max() * rng.uniform(0.1, 9))
        found = exceedance(axes @ mean, axes @ np.diag(deviations**2) @ axes.T, limit)
        worst = max(worst, abs(found / by_directions(mean, deviations, limit) - 1))
    sample.record("probabilities of quadratic forms", sample.count(200), int(worst > 1e-7), worst=f"{worst:.1e}")
    assert worst < 1e-7


def test_imhof() -> None:
    """Imhof's integral gives the same, where its digits suffice."""
    mean, deviations = np.array([0.3, -0.2]), np.array([0.5, 0.8])
    assert exceedance(mean, np.diag(deviations**2), 2.0) == pytest.approx(imhof(mean, deviations, 2.0), rel=1e-6)


def test_flat_errors() -> None:
    """A coordinate that does not vary leaves less of the limit to the others; alone, it exceeds it or not."""
    flat = exceedance([3.0, 0.0], [[0, 0], [0, 1.0]], 5.0)
    assert flat == pytest.approx(exceedance([0.0], [[1.0]], 4.0), rel=1e-14)
    assert exceedance([3.0, 0, 0], np.zeros((3, 3)), 2.9) == 1
    assert exceedance([3.0, 0, 0], np.zeros((3, 3)), 3.1) == 0
    turned = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 0]])  # along a diagonal, of variance 2
    assert exceedance([0.0, 0, 0], turned, 4.0) == pytest.approx(exceedance([0.0], [[2.0]], 4.0), rel=1e-12)


def test_of_the_thesis_linkage() -> None:
    """Pose Q1 of the five-bar, against four million samples, of which these are the mean and the standard error."""
    B = np.array([[0.6545, 0.6187, -0.8721], [-0.8197, -0.7748, -0.3134]])
    mean, covariance = B @ [0.328, 0.171, 0.483], B @ B.T * 0.02**2
    for limit, sampled, error in ((0.58, 0.20268, 2.3e-4), (0.60, 0.03880, 1e-4), (0.62, 0.003628, 3e-5)):
        assert exceedance(mean, covariance, limit) == pytest.approx(sampled, abs=3 * error)
    assert exceedance([0.5619, 0], np.eye(2) * 0.02**2, 0.6) == pytest.approx(0.0295279, abs=5e-8)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (([0.0], [[1.0]], 0.0), InvalidValueError),
        (([0.0], [[1.0]], np.nan), InvalidValueError),
        (([0.0], [[-1.0]], 1.0), InvalidValueError),
        (([0.0, 0], [[1.0, 1], [0, 1]], 1.0), InvalidValueError),
        (([np.nan], [[1.0]], 1.0), InvalidValueError),
        (([0.0, 0], [[1.0]], 1.0), ShapeError),
        ((np.zeros(4), np.eye(4), 1.0), ShapeError),
    ],
)
def test_what_is_no_law(arguments: tuple, error: type[Exception]) -> None:
    """What has no probability is refused."""
    with pytest.raises(error):
        exceedance(*arguments)
