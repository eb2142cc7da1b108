"""The posterior distribution of clearances after a measurement.

The likelihood compares all features together, with the noise of the measurement, the uncertainty of the surrogate, and
the random effect of impacts. An ensemble of walkers draws the samples.

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
from armwright.clearance.estimation.misfit import p_value, refuse_contradiction, widening
from armwright.clearance.free_parameters import is_physical_end, parameter_text
from armwright.errors import InvalidValueError, ShapeError

_WALKERS, _STEPS, _BURN = 60, 300, 100
_STRETCH = 2.0
# Parameters are likelier than others when their deviance is smaller by so much.
_MIN_DEVIANCE_DECREASE = 1.0
# A parameter is at a bound when it is nearer than this part of its range, or than its deviation.
_BOUND_TOLERANCE = 1e-3
# A parameter is identifiable when its standard deviation is at most this part of that of the prior.
_MAX_PRIOR_PART = 0.3


@attrs.frozen(kw_only=True, eq=False)
class Posterior:
    """The posterior distribution of parameters.

    Attributes:
        names: k parameters.
        samples: (s, k) drawn from the distribution, SI.
        lower: (k,) lower ends of the range of the prior.
        upper: (k,) its upper ends.
        misfit: probability of residuals as large where the model holds; a small one means that the model, or its
            noise, is wrong.
        best: (k,) the likeliest parameters.
        residuals: by feature, in standard deviations, at the likeliest parameters.
        widening: the factor by which residuals above the noise widen the deviations.
    """

    names: tuple[str, ...]
    samples: Array
    lower: Array
    upper: Array
    misfit: float
    best: Array
    residuals: Mapping[str, float]
    widening: float

    @property
    def bounds(self) -> Mapping[str, float]:
        """Parameters whose estimate is near an end of the swept range and that may lie beyond it, with that end.

        A coefficient of friction of 0 is a physical bound, not an end of the range; see ``free_parameters``.
        """
        ends = {}
        for i, name in enumerate(self.names):
            near = max(float(self.deviations[i]), _BOUND_TOLERANCE * float(self.upper[i] - self.lower[i]))
            for end in (float(self.lower[i]), float(self.upper[i])):
                if abs(float(self.best[i]) - end) < near and not is_physical_end(name, end):
                    ends[name] = end
        return ends

    def checked(self) -> Posterior:
        """Return the posterior itself, if features and model do not contradict each other.

        Raises:
            ContradictionError: no parameters explain the features.
        """
        ends = [f"{name.removeprefix('c_')} at {parameter_text(name, end)}" for name, end in self.bounds.items()]
        refuse_contradiction(self.misfit, self.residuals.items(), ends)
        return self

    @property
    def mean(self) -> Array:
        """(k,) means."""
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
        """Whether each parameter is identifiable: it is known much better than by the prior, and not at a bound.

        A bound narrows the distribution of a parameter beyond it.
        """
        return {name: name in self.narrowed and name not in self.bounds for name in self.names}

    @property
    def narrowed(self) -> tuple[str, ...]:
        """The parameters that are known much better than by the prior."""
        prior = (self.upper - self.lower) / np.sqrt(12)
        is_narrow = self.deviations <= _MAX_PRIOR_PART * prior
        return tuple(name for name, x in zip(self.names, is_narrow, strict=True) if x)

    def interval(self, level: float = 0.9) -> Array:
        """Return (k, 2) the central interval in which each parameter lies with the probability ``level``."""
        if not 0 < level < 1:
            raise InvalidValueError(f"level: expected a probability between 0 and 1, got {level:g}")
        ends = np.quantile(self.samples, [0.5 - level / 2, 0.5 + level / 2], axis=0)
        return np.asarray(ends.T, dtype=np.float64)


def sample_posterior(surrogate: Surrogate, measured: ArrayLike, noise: ArrayLike, *, seed: int = 0) -> Posterior:
    """Return the posterior distribution of the parameters for measured features.

    Args:
        surrogate: of f features.
        measured: (f,) features.
        noise: (f, f) covariance of the measurement, or (f,) standard deviations.
        seed: of the walkers.

    Raises:
        ShapeError: features or noise do not fit.
    """
    goal, spread = floats(measured, "measured"), floats(noise, "noise")
    count = len(surrogate.features)
    if goal.shape != (count,) or spread.shape not in ((count,), (count, count)):
        raise ShapeError(f"expected {count} features and their noise, got shapes {goal.shape} and {spread.shape}")
    noise_covariance = np.diag(spread**2) if spread.ndim == 1 else spread
    lower, upper = surrogate.lower, surrogate.upper

    freedom = max(1, count - len(lower))
    fit = _most_likely_fit(surrogate, goal, noise_covariance)

    def log_density(points: Array) -> Array:
        mean, deviation = surrogate.predict(np.clip(points, lower, upper))
        covariance = noise_covariance + surrogate.correlation * deviation[..., :, None] * deviation[..., None, :]
        residual = mean - goal
        solved = np.linalg.solve(covariance, residual[..., None])[..., 0]
        density = -0.5 * (residual * solved).sum(axis=-1) / factor**2 - 0.5 * np.linalg.slogdet(covariance)[1]
        inside = np.all((points >= lower) & (points <= upper), axis=-1)
        return np.where(inside, density, -np.inf)

    while True:
        factor = float(widening(fit.chi_square, freedom))
        with one_core():
            samples, top = _sample_walkers(log_density, fit.point, lower, upper, seed)
        # Walkers may reach a likelier optimum than the fit; the fit then moves there.
        other = _fit_at(surrogate, goal, noise_covariance, top)
        if not other.deviance < fit.deviance - _MIN_DEVIANCE_DECREASE:  # nor where either is NaN
            break
        fit = other
    residuals = fit.residual / np.sqrt(np.diag(fit.covariance))
    return Posterior(
        names=surrogate.parameters,
        samples=samples,
        lower=lower,
        upper=upper,
        misfit=float(p_value(fit.chi_square, freedom)),
        best=fit.point,
        residuals=dict(zip(surrogate.features, residuals.tolist(), strict=True)),
        widening=factor,
    )


class _Fit(NamedTuple):
    """Parameters (k,), the residual of their features (f,), its covariance (f, f), and its probability.

    Attributes:
        chi_square: of the residual.
        deviance: twice the negative logarithm of the likelihood, but for a constant.
    """

    point: Array
    residual: Array
    covariance: Array
    chi_square: float
    deviance: float


def _fit_at(surrogate: Surrogate, goal: Array, noise: Array, point: Array) -> _Fit:
    """Return the fit at a point (k,) of features (f,) that were measured with a noise covariance (f, f)."""
    (mean,), (deviation,) = surrogate.predict(point[None])
    covariance = noise + surrogate.correlation * np.outer(deviation, deviation)
    residual = goal - mean
    chi_square = float(residual @ np.linalg.solve(covariance, residual))
    return _Fit(point, residual, covariance, chi_square, chi_square + float(np.linalg.slogdet(covariance)[1]))


def _most_likely_fit(surrogate: Surrogate, goal: Array, noise: Array) -> _Fit:
    """Return the parameters whose features come nearest to the measured ones, weighted by their joint covariance."""
    covariance = _fit_at(surrogate, goal, noise, (surrogate.lower + surrogate.upper) / 2).covariance
    fits: list[_Fit] = []
    # The uncertainty of the surrogate depends on the parameters, hence two rounds.
    for _ in range(2):
        fits.append(_fit_at(surrogate, goal, noise, solve_features(surrogate, goal, covariance)))
        covariance = fits[-1].covariance
    return min(fits, key=lambda fit: fit.deviance)


def _sample_walkers(
    log_density: Callable[[Array], Array], centre: Array, lower: Array, upper: Array, seed: int
) -> tuple[Array, Array]:
    """Return samples (s, k) of walkers that stretch towards and away from one another, and the likeliest (k,)."""
    rng = np.random.default_rng(seed)
    k = len(centre)
    spread = 0.02 * (upper - lower)
    points = np.clip(centre + spread * rng.standard_normal((_WALKERS, k)), lower + 1e-3 * spread, upper - 1e-3 * spread)
    density = log_density(points)
    half = _WALKERS // 2
    samples: list[Array] = []
    top, highest = points[0].copy(), -np.inf
    for step in range(_STEPS):
        for own, others in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
            z = ((_STRETCH - 1) * rng.random(half) + 1) ** 2 / _STRETCH
            partner = points[others][rng.integers(half, size=half)]
            new = partner + z[:, None] * (points[own] - partner)
            new_density = log_density(new)
            accepted = np.log(rng.random(half)) < (k - 1) * np.log(z) + new_density - density[own]
            points[own] = np.where(accepted[:, None], new, points[own])
            density[own] = np.where(accepted, new_density, density[own])
        first = int(np.argmax(density))
        if density[first] > highest:
            top, highest = points[first].copy(), float(density[first])
        if step >= _BURN:
            samples.append(points.copy())
    return np.concatenate(samples), top
