"""What is known of clearances after a measurement: a distribution, not a number.

The likelihood compares all features together, with the noise of the measurement, the doubt of the surrogate, and what
impacts leave to chance. Samples come of an ensemble of walkers.

Source:
    Spec of the clearance, 4.4; Goodman & Weare (2010) for the walkers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats, one_core
from armwright.clearance.estimation.kriging import Surrogate, solve_features
from armwright.clearance.estimation.misfit import chance, refuse_contradiction, widening
from armwright.errors import InvalidValueError, ShapeError

_WALKERS, _STEPS, _BURN = 60, 300, 100
_STRETCH = 2.0
# Parameters are likelier than others when twice the logarithm of the likelihood is larger by so much.
_LIKELIER = 1.0
# A parameter is at a bound when it is nearer than this part of its range, or than its deviation.
_NEAR = 1e-3
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
        best: (k,) the likeliest.
        farthest: (f,) by how many standard deviations each feature is off there.
        widening: by what the deviations have grown, since the features are farther off than noise explains.
    """

    names: tuple[str, ...]
    samples: Array
    lower: Array
    upper: Array
    misfit: float
    best: Array
    farthest: Mapping[str, float]
    widening: float

    @property
    def bounds(self) -> Mapping[str, float]:
        """Parameters that may lie beyond what was swept, and the end of the range near which they were found.

        A coefficient of friction that is 0 lies at no end of what was swept but of what there is.
        """
        ends = {}
        for i, name in enumerate(self.names):
            near = max(float(self.deviations[i]), _NEAR * float(self.upper[i] - self.lower[i]))
            for end in (float(self.lower[i]), float(self.upper[i])):
                if abs(float(self.best[i]) - end) < near and end != 0:
                    ends[name] = end
        return ends

    def checked(self) -> Posterior:
        """Return the same, if features and model do not contradict one another.

        Raises:
            ContradictionError: no parameters explain the features.
        """
        ends = [f"{name.removeprefix('c_')} at {_shown(name, end)}" for name, end in self.bounds.items()]
        refuse_contradiction(self.misfit, self.farthest.items(), ends)
        return self

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
        """Whether the measurement told each parameter: it is known much better than before, and not at a bound.

        A bound makes sharp what lies beyond it.
        """
        before = (self.upper - self.lower) / np.sqrt(12)
        told = self.deviations <= _TOLD * before
        return {name: bool(one) and name not in self.bounds for name, one in zip(self.names, told, strict=True)}

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

    freedom = max(1, count - len(lower))
    fit = _likeliest(surrogate, goal, measured)

    def log_density(points: Array) -> Array:
        mean, deviation = surrogate.predict(np.clip(points, lower, upper))
        covariance = measured + surrogate.correlation * deviation[..., :, None] * deviation[..., None, :]
        off = mean - goal
        solved = np.linalg.solve(covariance, off[..., None])[..., 0]
        density = -0.5 * (off * solved).sum(axis=-1) / wider**2 - 0.5 * np.linalg.slogdet(covariance)[1]
        inside = np.all((points >= lower) & (points <= upper), axis=-1)
        return np.where(inside, density, -np.inf)

    while True:
        wider = float(widening(fit.square, freedom))
        with one_core():
            samples, top = _walk(log_density, fit.point, lower, upper, seed)
        # Walkers may come to a valley that was missed; the features are then held against that.
        other = _fit_at(surrogate, goal, measured, top)
        if not other.unlikely < fit.unlikely - _LIKELIER:  # nor where either is no number
            break
        fit = other
    off = fit.missing / np.sqrt(np.diag(fit.covariance))
    return Posterior(
        names=surrogate.parameters,
        samples=samples,
        lower=lower,
        upper=upper,
        misfit=float(chance(fit.square, freedom)),
        best=fit.point,
        farthest=dict(zip(surrogate.features, off.tolist(), strict=True)),
        widening=wider,
    )


class _Fit(NamedTuple):
    """Parameters (k,), what their features miss (f,), its covariance (f, f), and what that says.

    Attributes:
        square: of what is missing, in deviations.
        unlikely: twice the negative logarithm of the likelihood, but for a constant.
    """

    point: Array
    missing: Array
    covariance: Array
    square: float
    unlikely: float


def _fit_at(surrogate: Surrogate, goal: Array, measured: Array, point: Array) -> _Fit:
    """Return how well the features at a point (k,) are those seen (f,), measured with a covariance (f, f)."""
    (mean,), (deviation,) = surrogate.predict(point[None])
    covariance = measured + surrogate.correlation * np.outer(deviation, deviation)
    missing = goal - mean
    square = float(missing @ np.linalg.solve(covariance, missing))
    return _Fit(point, missing, covariance, square, square + float(np.linalg.slogdet(covariance)[1]))


def _likeliest(surrogate: Surrogate, goal: Array, measured: Array) -> _Fit:
    """Return the parameters whose features come nearest to those seen by the noise of all of them together."""
    covariance = _fit_at(surrogate, goal, measured, (surrogate.lower + surrogate.upper) / 2).covariance
    found: list[_Fit] = []
    # The doubt of the surface depends on where one is: twice.
    for _ in range(2):
        found.append(_fit_at(surrogate, goal, measured, solve_features(surrogate, goal, covariance)))
        covariance = found[-1].covariance
    return min(found, key=lambda one: one.unlikely)


def _shown(name: str, value: float) -> str:
    """Return a parameter in words: clearances in mm."""
    return f"{value * 1e3:g} mm" if name.startswith("c_") else f"{value:g}"


def _walk(
    log_density: Callable[[Array], Array], centre: Array, lower: Array, upper: Array, seed: int
) -> tuple[Array, Array]:
    """Return samples (s, k) of walkers that stretch towards and away from one another, and the likeliest (k,)."""
    rng = np.random.default_rng(seed)
    k = len(centre)
    spread = 0.02 * (upper - lower)
    places = np.clip(centre + spread * rng.standard_normal((_WALKERS, k)), lower + 1e-3 * spread, upper - 1e-3 * spread)
    density = log_density(places)
    half = _WALKERS // 2
    kept: list[Array] = []
    top, highest = places[0].copy(), -np.inf
    for step in range(_STEPS):
        for own, others in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
            z = ((_STRETCH - 1) * rng.random(half) + 1) ** 2 / _STRETCH
            partner = places[others][rng.integers(half, size=half)]
            new = partner + z[:, None] * (places[own] - partner)
            found = log_density(new)
            taken = np.log(rng.random(half)) < (k - 1) * np.log(z) + found - density[own]
            places[own] = np.where(taken[:, None], new, places[own])
            density[own] = np.where(taken, found, density[own])
        first = int(np.argmax(density))
        if density[first] > highest:
            top, highest = places[first].copy(), float(density[first])
        if step >= _BURN:
            kept.append(places.copy())
    return np.concatenate(kept), top
