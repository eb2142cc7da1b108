"""Errors of linkages with random clearances: the published pose, exact laws, and plain sampling."""

from functools import cache

import mpmath
import numpy as np
import pytest
from scipy.stats import lognorm

from armwright.clearance.linkage import Linkage
from armwright.clearance.poses import closed_at_tips
from armwright.clearance.reader import load_linkage
from armwright.clearance.sensitivities import rest_sensitivities
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError
from armwright.reliability.exceedance import exceedance
from armwright.reliability.first_order import form, reliability_index
from armwright.reliability.linear_error import LinearError, fosm
from armwright.reliability.linkage_errors import RandomClearances, RandomLinkage
from armwright.reliability.tip_samples import tip_samples
from samples import Sample

Q1, MEAN, DEVIATION = (-0.18, -0.6), np.array([0.328, 0.171, 0.483]) * 1e-3, 2e-5
# Four million samples at Q1, and methods of first order: limit mm, sampled, its error, FOSM, index, FORM.
PUBLISHED = (
    (0.58, 0.20268, 2.3e-4, 0.19481, 0.8555, 0.19615),
    (0.60, 0.03880, 1.0e-4, 0.03535, 1.7860, 0.03705),
    (0.62, 0.003628, 3.0e-5, 0.00294, 2.7052, 0.00341),
)


# Fewer failures than this do not scatter normally.
_COUNTED = 30


@cache
def five_bar() -> Linkage:
    return load_linkage("five-bar")


def at_rest(*poses: tuple[float, float], **others: object) -> RandomLinkage:
    """The five-bar with clearances of arm A."""
    clearances = RandomClearances(mean=MEAN, covariance=np.eye(3) * DEVIATION**2, **others)  # type: ignore[arg-type]
    return RandomLinkage.at(five_bar(), closed_at_tips(five_bar(), poses), clearances)


def ruben(mean: np.ndarray, covariance: np.ndarray, limit: float) -> float:
    """Return P(|e| > limit) of a normal e in high precision, as a series of central chi-square laws by Ruben (1962)."""
    variances, axes = np.linalg.eigh(covariance)
    with mpmath.workdps(60):
        own = [mpmath.mpf(float(v)) for v in variances]
        shifts = [mpmath.mpf(float(m)) ** 2 / v for m, v in zip(axes.T @ mean, own, strict=True)]
        scale = min(own)
        ratios = [1 - scale / v for v in own]
        parts = [mpmath.exp(-sum(shifts) / 2) * mpmath.sqrt(mpmath.fprod(scale / v for v in own))]
        slopes: list[mpmath.mpf] = []
        x = mpmath.mpf(limit) ** 2 / scale / 2
        order = mpmath.mpf(len(own)) / 2
        tail, last = mpmath.mpf(0), mpmath.gammainc(order, x, regularized=True)
        grown, step = last, x**order * mpmath.exp(-x) / mpmath.gamma(order + 1)
        for j in range(6000):
            tail += parts[j] * grown
            # What is left of the parts is at most multiplied by one.
            if 1 - sum(parts) < tail * mpmath.mpf("1e-9") and j > 10:
                break
            grown, step = grown + step, step * x / (order + j + 1)
            slopes.append(
                sum(g ** (j + 1) + (j + 1) * scale * d / v * g**j for g, d, v in zip(ratios, shifts, own, strict=True))
            )
            parts.append(sum(slopes[j - i] * parts[i] for i in range(j + 1)) / (2 * (j + 1)))
        return float(tail)


def test_published_pose() -> None:
    """From the linkage follow the printed derivatives at Q1, and the printed probabilities by every method."""
    middle = rest_sensitivities(five_bar(), closed_at_tips(five_bar(), [Q1]), [3e-4] * 3)
    B = middle.of("clearance")[0]
    np.testing.assert_allclose(B, [[0.6545, 0.6187, -0.8721], [-0.8197, -0.7748, -0.3134]], rtol=0, atol=5.1e-5)
    printed = B.round(4)
    mean, covariance = printed @ MEAN * 1e3, printed @ printed.T * 0.02**2
    np.testing.assert_allclose(mean, (-0.10075, -0.55272), rtol=0, atol=5.1e-6)
    np.testing.assert_allclose(covariance[[0, 0, 1], [0, 1, 1]], (6.2869e-4, -2.9702e-4, 5.4818e-4), rtol=0, atol=6e-9)
    for limit, sampled, error, second_moment, index, first_order in PUBLISHED:
        assert exceedance(mean, covariance, limit) == pytest.approx(sampled, abs=3 * error)
        assert fosm(mean, covariance, limit) == pytest.approx(second_moment, abs=5.1e-6)
        assert reliability_index(mean, covariance, limit) == pytest.approx(index, abs=5.1e-5)
        assert form(mean, covariance, limit) == pytest.approx(first_order, abs=5.1e-6)


def test_complete_equilibria(rng: np.random.Generator) -> None:
    """About the mean clearances the linear law differs from complete equilibria by little of the spread."""
    random = at_rest(Q1, (0.0, -0.575))
    z = rng.normal(size=(50, 3))
    assert np.linalg.norm(random.equilibria(z) - random.drawn_errors(z), axis=-1).max() < 1e-3 * DEVIATION
    np.testing.assert_allclose(random.equilibria(np.zeros((1, 3)))[0], random.offset, rtol=0, atol=1e-15)


def test_lengths_and_zeros(rng: np.random.Generator) -> None:
    """Lengths and zeros of drives add their variances, and move the tip as in complete equilibrium."""
    deviations = {"link2.length": 1e-5, "link4.zero": 2e-5}
    clearances = RandomClearances(mean=MEAN, covariance=np.zeros((3, 3)))
    q = closed_at_tips(five_bar(), [Q1])
    random = RandomLinkage.at(five_bar(), q, clearances, deviations)
    found = rest_sensitivities(five_bar(), q, MEAN)
    columns = np.stack([found.column(name)[0] * size for name, size in deviations.items()], axis=-1)
    np.testing.assert_allclose(random.error.covariance[0], columns @ columns.T, rtol=1e-12)
    np.testing.assert_allclose(random.shares[0], [0, 0, 0, *np.square(columns).sum(axis=0) / np.square(columns).sum()])
    z = rng.normal(size=(5, 5))
    np.testing.assert_allclose(random.equilibria(z), random.drawn_errors(z), rtol=0, atol=1e-8)


def test_friction(rng: np.random.Generator) -> None:
    """Journals anywhere in their cones put the tip where complete equilibria do; the law is that of sampling."""
    clearances = RandomClearances(mean=MEAN, covariance=np.eye(3) * DEVIATION**2)
    q = closed_at_tips(five_bar(), [Q1, (0.0, -0.575)])
    random = RandomLinkage.at(five_bar(), q, clearances, friction=True)
    z = rng.normal(size=(20_000, random.size))
    few = z[:50]
    # The wall of a cone of 0.05 rad is curved: that is a thousandth of the clearance.
    assert np.linalg.norm(random.equilibria(few) - random.drawn_errors(few), axis=-1).max() < 2e-3 * MEAN.sum()
    assert random.shares.sum(axis=1) == pytest.approx([1, 1])
    sizes = np.linalg.norm(random.drawn_errors(z), axis=-1)
    limit = float(np.quantile(sizes.max(axis=1), 0.99))
    found = random.error.path_probability(limit, samples=10_000)
    assert found.probability == pytest.approx(0.01, abs=5 * np.hypot(found.standard_error, np.sqrt(0.01 / len(z))))
    assert found.standard_error < 0.05 * found.probability


def test_correlated_clearances(rng: np.random.Generator) -> None:
    """Of an estimate the covariance counts, normal or lognormal; shares add up to one."""
    root = rng.normal(size=(3, 3)) * 1e-5
    for shape in ("normal", "lognormal"):
        clearances = RandomClearances(mean=MEAN, covariance=root @ root.T, shape=shape)  # type: ignore[arg-type]
        drawn = clearances.values(rng.normal(size=(100_000, 3)))
        np.testing.assert_allclose(drawn.mean(axis=0), MEAN, rtol=0, atol=5e-7)
        np.testing.assert_allclose(np.cov(drawn.T), root @ root.T, rtol=0, atol=1e-11)
    random = RandomLinkage.at(five_bar(), closed_at_tips(five_bar(), [Q1]), clearances)
    assert random.shares.sum() == pytest.approx(1)


def test_lognormal_clearance() -> None:
    """With one lognormal clearance the law is that of its logarithm, into the tail."""
    spread = 0.3
    clearances = RandomClearances(mean=[1.0], covariance=[[np.expm1(spread**2)]], shape="lognormal")
    way = np.array([0.6, 0.8])
    error = LinearError(
        names=("c",),
        deviations=[1.0],
        offset=way[None],
        jacobian=(way[:, None] @ clearances.linear)[None],
        exact=lambda z: clearances.values(z)[:, None] * way,
    )
    for limit in (1.5, 3.0, 4.5):
        exact = float(lognorm.sf(limit, spread, scale=np.exp(-(spread**2) / 2)))
        found = error.path_probability(limit, samples=20_000)
        assert found.probability == pytest.approx(exact, abs=5 * found.standard_error)
        assert found.standard_error < 0.05 * exact
        assert error.pose_probabilities(limit)[0] == pytest.approx(exact, rel=0.05)


@pytest.mark.proof
@pytest.mark.share(0.001)
def test_plain_sampling(sample: Sample) -> None:
    """From 0.1 to 1e-5 probabilities are those of ten million linkages, at poses and on a path, of both shapes."""
    poses = [Q1, (0.0, -0.575), (0.18, -0.6), (-0.15, -0.45), (0.1, -0.7)]
    count, scores = sample.count(10_000_000), []
    rng = np.random.default_rng(sample.seed)
    for shape in ("normal", "lognormal"):
        error = at_rest(*poses, shape=shape).error
        sizes = np.linalg.norm(error.errors(rng.normal(size=(20_000, 3))), axis=-1)
        path = sizes.max(axis=1)
        # Limits of some probabilities on the path, if its largest error were normal.
        limits = path.mean() + path.std() * np.array([1.3, 2.3, 3.1, 3.7, 4.3])
        beyond, at_first = np.zeros(len(limits)), np.zeros(len(limits))
        for block in np.array_split(np.arange(count), max(count // 200_000, 1)):
            sizes = np.linalg.norm(error.errors(rng.normal(size=(len(block), 3))), axis=-1)
            largest = sizes.max(axis=1)
            beyond += [(largest > limit).sum() for limit in limits]
            at_first += [(sizes[:, 0] > limit).sum() for limit in limits]
        for limit, failed, first in zip(limits.tolist(), beyond / count, at_first / count, strict=True):
            found = error.path_probability(
                limit, samples=100_000 if sample.whole else 10_000, seed=int(rng.integers(2**31))
            )
            if found.probability >= max(1e-5, _COUNTED / count):
                own = np.sqrt(found.probability / count)
                scores.append((failed - found.probability) / np.hypot(own, found.standard_error))
            if shape == "lognormal":
                continue
            exact = float(error.pose_probabilities(limit)[0])
            if exact >= max(1e-5, _COUNTED / count):
                scores.append((first - exact) / np.sqrt(exact / count))
    sizes = np.abs(scores)
    sample.record(
        f"probabilities against {count:,} linkages, beyond three standard errors",
        len(scores),
        int((sizes > 3).sum()),
        worst=f"{sizes.max():.2f}",
    )
    assert sizes.max() < 4.5


@pytest.mark.proof
@pytest.mark.share(0.1)
def test_exact_laws(sample: Sample) -> None:
    """From 1e-5 to 1e-8 probabilities are those of the law in high precision, of one and of several design points."""
    worst, count = [0.0, 0.0], 0
    B = at_rest(Q1).jacobian[0] * 1e3
    narrow = np.array([[1.0, 0.2], [0.2, 0.3]])
    cases = [
        (at_rest(Q1).offset[0] * 1e3, B @ B.T * 0.02**2),
        (np.zeros(2), B @ B.T * 0.02**2),
        (np.zeros(2), np.eye(2) * 0.02**2),
        (np.array([0.0, 0.3]), narrow @ narrow.T * 0.01),
    ]
    for mean, covariance in cases[:: 1 if sample.whole else 2]:
        values, axes = np.linalg.eigh(covariance)
        error = LinearError(
            names=("a", "b"), deviations=[1.0, 1.0], offset=mean[None], jacobian=(axes * np.sqrt(values))[None]
        )
        for probability in (1e-5, 1e-6, 1e-7, 1e-8)[:: 1 if sample.whole else 3]:
            limit = _limit_of(mean, covariance, probability)
            exact = ruben(mean, covariance, limit)
            found = error.path_probability(limit, seed=sample.seed)
            worst[0] = max(worst[0], abs(exceedance(mean, covariance, limit) / exact - 1))
            worst[1] = max(worst[1], abs(found.probability / exact - 1))
            count += 1
    sample.record(
        "probabilities of 1e-5 to 1e-8 against the law in 60 digits, off by more than 5 %",
        count,
        int(max(worst) > 0.05),
        exact_law=f"{worst[0]:.1e}",
        sampled=f"{worst[1]:.3f}",
    )
    assert worst[0] < 1e-8
    assert worst[1] < 0.05


def _limit_of(mean: np.ndarray, covariance: np.ndarray, probability: float) -> float:
    low, high = float(np.linalg.norm(mean)), 10.0
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if exceedance(mean, covariance, middle) > probability else (low, middle)
    return high


@pytest.mark.proof
@pytest.mark.share(0.005)
def test_a_million_equilibria(sample: Sample) -> None:
    """The law at Q1 is that of linkages whose complete equilibria are computed."""
    random, count = at_rest(Q1), sample.count(1_000_000)
    limits = np.array([0.58, 0.60, 0.62]) * 1e-3
    z = np.random.default_rng(sample.seed).normal(size=(count, 3))
    sizes = np.linalg.norm(tip_samples(random.task, z, seed=sample.seed)[:, 0], axis=-1)
    exact = np.array([random.error.pose_probabilities(limit)[0] for limit in limits])
    found = (sizes[:, None] > limits).mean(axis=0)
    scores = np.abs(found - exact) / np.sqrt(exact * (1 - exact) / count)
    sample.record(
        f"law at Q1 against {count:,} equilibria, beyond three standard errors",
        3,
        int((scores > 3).sum()),
        law=" ".join(f"{x:.5g}" for x in exact),
        sampled=" ".join(f"{x:.5g}" for x in found),
    )
    assert scores.max() < 4.5


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"covariance": np.eye(2)}, ShapeError),
        ({"mean": [-1.0, 0, 0]}, InvalidValueError),
        ({"mean": [0.0, 1, 1], "shape": "lognormal"}, InvalidValueError),
        ({"covariance": -np.eye(3)}, InvalidValueError),
        ({"shape": "lognorml"}, UnknownNameError),
        ({"covariance": np.full((3, 3), np.nan)}, InvalidValueError),
    ],
)
def test_what_are_no_clearances(fields: dict, error: type[Exception]) -> None:
    """Numbers that no clearances have are refused."""
    with pytest.raises(error):
        RandomClearances(**({"mean": [1.0, 1, 1], "covariance": np.eye(3)} | fields))


def test_what_is_no_dimension() -> None:
    """A length that the linkage has not is named, with the nearest."""
    clearances = RandomClearances(mean=MEAN, covariance=np.zeros((3, 3)))
    with pytest.raises(UnknownNameError, match=r"link2\.length"):
        RandomLinkage.at(five_bar(), closed_at_tips(five_bar(), [Q1]), clearances, {"link2.lenght": 1e-5})
