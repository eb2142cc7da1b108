"""What is known of clearances after a measurement: a distribution, not a number.

The likelihood compares all features together, with the noise of the measurement, the doubt of the surrogate, and what
impacts leave to chance. Samples come of an ensemble of walkers.

Source:
    Spec of the clearance, 4.4; Goodman & Weare (2010) for the walkers.
"""

from collections.abc import Callable, Mapping

import attrs
import numpy as np
from scipy.stats import chi2

from armwright.arrays import Array, ArrayLike, floats, one_core
from armwright.clearance.estimating.kriging import Surrogate, solve_features
from armwright.errors import InvalidValueError, ShapeError

_WALKERS, _STEPS, _BURN = 60, 300, 100
_STRETCH = 2.0
# A parameter is told when its standard deviation is at most this part of what was known before.
_TOLD = 0.3


@attrs.frozen(kw_only=True, eq=False)
class Posterior:
    """What is known of parameters.

    Attributes:
        names: k parameters.
        samples: (s, k) drawn from the distribution, SI.
        lower: (k,) of the range that was thought possible.
        upper: (k,).
        misfit: probability that features as far off as these are seen where the model holds; small ones say that
            the model, or the noise it was told, is wrong.
    """

    names: tuple[str, ...]
    samples: Array
    lower: Array
    upper: Array
    misfit: float

    @property
    def mean(self) -> Array:
        """(k,) the mean."""
        return np.asarray(self.samples.mean(axis=0), dtype=np.float64)

    @property
    def deviations(self) -> Array:
        """(k,) standard deviations."""
        return np.asarray(self.samples.std(axis=0, ddof=1), dtype=np.float64)

    @property
    def correlation(self) -> Array:
        """(k, k) correlation of the parameters."""
        return np.atleast_2d(np.corrcoef(self.samples, rowvar=False))

    @property
    def identifiable(self) -> Mapping[str, bool]:
        """Whether the measurement told each parameter: it is known much better than before."""
        before = (self.upper - self.lower) / np.sqrt(12)
        told = self.deviations <= _TOLD * before
        return dict(zip(self.names, map(bool, told), strict=True))

    def interval(self, level: float = 0.9) -> Array:
        """Return (k, 2) between which each parameter lies with a probability, as much left out on either side."""
        if not 0 < level < 1:
            raise InvalidValueError(f"level: expected a probability between 0 and 1, got {level:g}")
        ends = np.quantile(self.samples, [0.5 - level / 2, 0.5 + level / 2], axis=0)
        return np.asarray(ends.T, dtype=np.float64)


def posterior(surrogate: Surrogate, seen: ArrayLike, noise: ArrayLike, *, seed: int = 0) -> Posterior:
    """Return what features that were seen say of the parameters.

    Args:
        surrogate: of f features.
        seen: (f,) features.
        noise: (f, f) covariance of the measurement, or (f,) standard deviations.
        seed: of the walkers.

    Raises:
        ShapeError: features or noise do not fit.
    """
    goal, spread = floats(seen, "seen"), floats(noise, "noise")
    count = len(surrogate.features)
    if goal.shape != (count,) or spread.shape not in ((count,), (count, count)):
        raise ShapeError(f"expected {count} features and their noise, got shapes {goal.shape} and {spread.shape}")
    measured = np.diag(spread**2) if spread.ndim == 1 else spread
    lower, upper = surrogate.lower, surrogate.upper

    def log_density(points: Array) -> Array:
        mean, deviation = surrogate.predict(np.clip(points, lower, upper))
        covariance = measured + surrogate.correlation * deviation[..., :, None] * deviation[..., None, :]
        missing = mean - goal
        solved = np.linalg.solve(covariance, missing[..., None])[..., 0]
        density = -0.5 * (missing * solved).sum(axis=-1) - 0.5 * np.linalg.slogdet(covariance)[1]
        inside = np.all((points >= lower) & (points <= upper), axis=-1)
        return np.where(inside, density, -np.inf)

    centre = solve_features(
        surrogate, goal, np.sqrt(np.diag(measured) + surrogate.predict((lower + upper)[None] / 2)[1][0] ** 2)
    )
    with one_core():
        samples, best = _walk(log_density, centre, lower, upper, seed)
    mean, deviation = surrogate.predict(best[None])
    covariance = measured + surrogate.correlation * np.outer(deviation[0], deviation[0])
    missing = mean[0] - goal
    freedom = max(1, count - len(lower))
    misfit = float(chi2.sf(missing @ np.linalg.solve(covariance, missing), freedom))
    return Posterior(names=surrogate.parameters, samples=samples, lower=lower, upper=upper, misfit=misfit)


def _walk(
    log_density: Callable[[Array], Array], centre: Array, lower: Array, upper: Array, seed: int
) -> tuple[Array, Array]:
    """Return samples of walkers that stretch towards and away from one another, and the likeliest place they saw."""
    rng = np.random.default_rng(seed)
    k = len(centre)
    spread = 0.02 * (upper - lower)
    places = np.clip(centre + spread * rng.standard_normal((_WALKERS, k)), lower + 1e-3 * spread, upper - 1e-3 * spread)
    density = log_density(places)
    half = _WALKERS // 2
    kept, heights = [], []
    for step in range(_STEPS):
        for own, others in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
            z = ((_STRETCH - 1) * rng.random(half) + 1) ** 2 / _STRETCH
            partner = places[others][rng.integers(half, size=half)]
            new = partner + z[:, None] * (places[own] - partner)
            found = log_density(new)
            taken = np.log(rng.random(half)) < (k - 1) * np.log(z) + found - density[own]
            places[own] = np.where(taken[:, None], new, places[own])
            density[own] = np.where(taken, found, density[own])
        if step >= _BURN:
            kept.append(places.copy())
            heights.append(density.copy())
    samples = np.concatenate(kept)
    return samples, samples[np.concatenate(heights).argmax()]
