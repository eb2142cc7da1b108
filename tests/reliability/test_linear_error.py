"""Probabilities of linear errors: against the exact law, plain sampling and the published figures of first order."""

import numpy as np
import pytest

from armwright.errors import InvalidValueError, ShapeError
from armwright.reliability.exceedance import exceedance
from armwright.reliability.first_order import form, nearest_failure, reliability_index
from armwright.reliability.linear_error import LinearError, fosm
from samples import Sample

# Pose Q1 of the thesis' five-bar, and clearances A.
B = np.array([[0.6545, 0.6187, -0.8721], [-0.8197, -0.7748, -0.3134]])
MEAN, COVARIANCE = B @ [0.328, 0.171, 0.483], B @ B.T * 0.02**2


def random_error(rng: np.random.Generator, poses: int = 1) -> LinearError:
    """A random error of one to three coordinates, its mean often zero."""
    d = int(rng.integers(1, 4))
    k = int(rng.integers(d, 9))
    return LinearError(
        names=tuple(f"x{i}" for i in range(k)),
        deviations=rng.uniform(0.05, 1, k),
        offset=rng.normal(size=(poses, d)) * rng.choice([0.0, 0.5, 3.0]),
        jacobian=rng.normal(size=(poses, d, k)),
    )


def test_figures_of_first_order() -> None:
    """FOSM and FORM give the published figures, which the exact law exceeds."""
    figures = ((0.58, 0.19481, 0.8555, 0.19615), (0.60, 0.03535, 1.7860, 0.03705), (0.62, 0.00294, 2.7052, 0.00341))
    for limit, second_moment, index, first_order in figures:
        assert fosm(MEAN, COVARIANCE, limit) == pytest.approx(second_moment, abs=5.1e-6)
        assert reliability_index(MEAN, COVARIANCE, limit) == pytest.approx(index, abs=5.1e-5)
        assert form(MEAN, COVARIANCE, limit) == pytest.approx(first_order, abs=5.1e-6)
        assert exceedance(MEAN, COVARIANCE, limit) > form(MEAN, COVARIANCE, limit)


@pytest.mark.proof
@pytest.mark.share(0.02)
def test_nearest_failure(sample: Sample) -> None:
    """No point of the limit's length is more probable, centred and flat errors included."""
    for rng in sample.cases(2000):
        error = random_error(rng)
        mean, covariance = error.offset[0], error.covariance[0]
        limit = float(np.linalg.norm(mean) + np.sqrt(np.trace(covariance)) * rng.uniform(0.1, 5))
        point = nearest_failure(mean, covariance, limit)
        others = rng.normal(size=(2000, len(mean)))
        others[:1000] = point + 0.05 * limit * others[:1000]
        others *= limit / np.linalg.norm(others, axis=1)[:, None]
        inverse = np.linalg.inv(covariance)
        distances = np.einsum("ci,ij,cj->c", others - mean, inverse, others - mean)
        assert np.linalg.norm(point) == pytest.approx(limit, rel=1e-9)
        assert (point - mean) @ inverse @ (point - mean) <= distances.min() * (1 + 1e-9)
    sample.record("nearest failures", sample.count(2000), 0)


@pytest.mark.proof
@pytest.mark.share(0.03)
def test_importance_sampling(sample: Sample) -> None:
    """At one pose the sampled probability is that of the exact law within its standard error, down to 1e-12."""
    scores, errors = [], []
    for rng in sample.cases(300):
        error = random_error(rng)
        limit = float(np.linalg.norm(error.offset) + np.sqrt(np.trace(error.covariance[0])) * rng.uniform(0.5, 6))
        exact = error.pose_probabilities(limit)[0]
        found = error.path_probability(limit, samples=20_000, seed=int(rng.integers(2**31)))
        scores.append((found.probability - exact) / found.standard_error)
        errors.append(found.standard_error / exact)
    scores = np.array(scores)
    sample.record("estimates within four standard errors", len(scores), int((np.abs(scores) > 4).sum()))
    assert np.abs(scores).max() < 5
    assert np.square(scores).sum() < len(scores) + 5 * np.sqrt(2 * len(scores))
    assert np.median(errors) < 0.03


def test_path(rng: np.random.Generator) -> None:
    """On a path it is that of plain sampling, at least that of the worst pose, and at most their sum."""
    error = random_error(rng, poses=12)
    scale = np.sqrt(np.trace(error.covariance, axis1=1, axis2=2).max())
    limit = float(np.linalg.norm(error.offset, axis=1).max() + scale)
    z = rng.normal(size=(200_000, len(error.names)))
    errors = np.einsum("pdk,mk->mpd", error.standardized, z) + error.offset
    plain = float((np.linalg.norm(errors, axis=-1) > limit).any(axis=-1).mean())

    found = error.path_probability(limit, seed=3)

    spread = np.hypot(found.standard_error, np.sqrt(plain * (1 - plain) / len(z)))
    assert found.probability == pytest.approx(plain, abs=5 * spread)
    poses = error.pose_probabilities(limit)
    assert poses.max() - 5 * found.standard_error <= found.probability <= poses.sum() + 5 * found.standard_error


def test_shares(rng: np.random.Generator) -> None:
    """Shares add up to one, and those of a deviation that is doubled grow fourfold against the others."""
    error = random_error(rng, poses=3)
    wider = LinearError(
        names=error.names,
        deviations=error.deviations * np.where(np.arange(len(error.names)) == 0, 2, 1),
        offset=error.offset,
        jacobian=error.jacobian,
    )
    np.testing.assert_allclose(error.shares.sum(axis=1), 1)
    ratio = wider.shares[:, 0] / (1 - wider.shares[:, 0]) / (error.shares[:, 0] / (1 - error.shares[:, 0]))
    if len(error.names) > 1:
        np.testing.assert_allclose(ratio, 4)


def test_next_to_impossible() -> None:
    """Far beyond all deviations sampling still agrees with the exact law, and nothing overflows."""
    error = LinearError(names=("x", "y"), deviations=[1.0, 1.0], offset=[[0.0, 0.0]], jacobian=[[[1.0, 0], [0, 1.0]]])

    assert error.path_probability(35.0).probability == pytest.approx(np.exp(-(35.0**2) / 2), rel=0.05)


def test_certain_and_impossible() -> None:
    """A mean beyond the limit fails for certain where nothing varies; without deviations within it nothing does."""
    still = LinearError(names=("a",), deviations=[0.0], offset=[[2.0, 0]], jacobian=[[[1.0], [0]]])
    assert still.path_probability(1.0, samples=1000).probability == pytest.approx(1)
    assert still.path_probability(3.0, samples=1000).probability == 0
    assert still.pose_probabilities(3.0).tolist() == [0]


@pytest.mark.parametrize(
    ("changed", "error"),
    [
        ({"deviations": [-1.0]}, InvalidValueError),
        ({"deviations": [1.0, 2]}, ShapeError),
        ({"jacobian": [[[1.0]]]}, ShapeError),
        ({"offset": [[0.0] * 4], "jacobian": np.ones((1, 4, 1))}, ShapeError),
        ({"offset": np.zeros((0, 2)), "jacobian": np.zeros((0, 2, 1))}, ShapeError),
    ],
)
def test_what_is_no_error(changed: dict, error: type[Exception]) -> None:
    """Arrays that do not fit are refused."""
    fields = {"names": ("a",), "deviations": [1.0], "offset": [[0.0, 0]], "jacobian": [[[1.0], [0]]]}
    with pytest.raises(error):
        LinearError(**(fields | changed))


@pytest.mark.parametrize("count", [1, 2])
def test_fewer_deviations_than_coordinates(count: int, rng: np.random.Generator) -> None:
    """One or two deviations of an error in space are sampled as well as many."""
    jacobian = rng.normal(size=(1, 3, count))
    names = tuple(f"x{i}" for i in range(count))
    error = LinearError(names=names, deviations=np.ones(count), offset=np.zeros((1, 3)), jacobian=jacobian)
    limit = 3 * float(np.linalg.norm(jacobian[0], 2))
    found = error.path_probability(limit, samples=20_000)
    assert found.probability == pytest.approx(error.pose_probabilities(limit)[0], abs=5 * found.standard_error)
