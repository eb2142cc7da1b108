"""Draws of a posterior by importance sampling: standard normal numbers, and what measurements say of them."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from scipy.optimize import least_squares
from scipy.special import gammaincinv, gammaln, ndtri

from armwright.arrays import Array, ArrayLike, Flags, Numbers, integer
from armwright.errors import InvalidValueError

# Independent sets of draws: the spread over them is the error of any number that is computed from all.
_SETS = 8
# Draws have the density of Student's law with so many degrees of freedom, wider than the posterior in its tails.
_FREEDOM = 6.0
# Rounds in which the density of the draws is fitted to the posterior.
_ROUNDS = 3
# Added to variances of the draws, so that they stay above zero.
_FLOOR = 1e-12
# Fewer effective draws than this part of all tell nothing.
_EFFECTIVE = 0.02


@attrs.frozen(kw_only=True, eq=False)
class WeightedDraws:
    """Draws of some numbers.

    Attributes:
        z: (n, d) numbers, in sets that follow one another.
        weights: (n,) of each draw; they add up to one.
        misfit: sum of squares, of the residuals of r measurements in standard errors and of the numbers, where the
            posterior is largest: about chi-square with r degrees of freedom.
    """

    z: Array
    weights: Array
    misfit: float = 0.0

    @property
    def effective(self) -> float:
        """How many equally weighted draws tell as much."""
        return float(1 / np.square(self.weights).sum())

    @property
    def first_set(self) -> WeightedDraws:
        """The first of the sets alone."""
        return self.among(np.arange(len(self.z) // _SETS))

    def among(self, rows: Numbers) -> WeightedDraws:
        """Return some of the draws."""
        weights = self.weights[rows]
        return WeightedDraws(z=self.z[rows], weights=weights / weights.sum(), misfit=self.misfit)

    def quantile(self, values: Array, part: ArrayLike) -> Array:
        """Return (...) values that the draws do not exceed with some probabilities (...); values (n,) may be infinite.

        Raises:
            InvalidValueError: a probability is not between 0 and 1.
        """
        return _quantile(values, self.weights, part)

    def quantile_error(self, values: Array, part: float) -> float:
        """Return the standard error of a quantile, from the spread over the sets; infinite where it is not finite."""
        own = [
            float(_quantile(v, w, part))
            for v, w in zip(np.array_split(values, _SETS), np.array_split(self.weights, _SETS), strict=True)
        ]
        return float(np.std(own, ddof=1) / np.sqrt(_SETS)) if np.isfinite(own).all() else np.inf

    def probability(self, happens: Flags) -> tuple[float, float]:
        """Return the probability of what happens in some draws (n,), and its standard error."""
        parts = [
            float(w[h].sum() / w.sum())
            for h, w in zip(np.array_split(happens, _SETS), np.array_split(self.weights, _SETS), strict=True)
        ]
        return float(self.weights[happens].sum()), float(np.std(parts, ddof=1) / np.sqrt(_SETS))


def draw(
    size: int, residuals: Callable[[Array], Array] | None = None, *, samples: int = 8192, seed: int = 0
) -> WeightedDraws:
    """Draw numbers that are standard normal before measurements.

    Args:
        size: d, how many numbers.
        residuals: of the measurements, (n, r) in standard errors for numbers (n, d); None without measurements.
        samples: how many draws, rounded up to a power of two in each of eight sets.
        seed: of the draws.

    Raises:
        InvalidValueError: the measurements leave hardly any draw with a weight.

    Source:
        Rubinstein & Kroese (2008), chapter 5; Cappé et al. (2004), population Monte Carlo; Owen (1997) for the sets.
    """
    count = 2 ** int(np.ceil(np.log2(max(integer(samples, "samples", least=_SETS) / _SETS, 2))))
    centre, root, misfit = np.zeros(size), np.eye(size), 0.0
    rounds = 1
    if residuals is not None:
        centre, root = _most_probable(size, residuals)
        misfit = float(np.square(residuals(centre[None])).sum() + np.square(centre).sum())
        rounds = _ROUNDS
    rng = np.random.default_rng(seed)
    for _ in range(rounds):
        z, logs = _student(size, count, centre, root, rng)
        logs = -0.5 * np.square(z).sum(axis=1) - logs
        if residuals is not None:
            logs -= 0.5 * np.square(residuals(z)).sum(axis=1)
        weights = np.exp(logs - logs.max())
        draws = WeightedDraws(z=z, weights=weights / weights.sum(), misfit=misfit)
        if rounds > 1:
            centre = np.asarray(draws.weights @ z)
            away = z - centre
            covariance = (away * draws.weights[:, None]).T @ away
            root = np.asarray(np.linalg.cholesky(covariance + _FLOOR * np.eye(size)))
    if draws.effective < _EFFECTIVE * len(z):
        raise InvalidValueError(
            "measurements: they fit the clearances and the wear coefficient stated before so little that nothing can "
            "be said; check units and strokes, or give the wear coefficient a larger spread"
        )
    return draws


def _most_probable(size: int, residuals: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Return the numbers (d,) at which the posterior is largest, and a root (d, d) of its covariance there."""

    def both(z: Array) -> Array:
        return np.concatenate([z, residuals(z[None])[0]])

    found = least_squares(both, np.zeros(size))
    J = np.asarray(found.jac, dtype=np.float64)
    return np.asarray(found.x), np.asarray(np.linalg.cholesky(np.linalg.inv(J.T @ J)))


def _student(size: int, count: int, centre: Array, root: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return draws (n, size) of Student's law in evenly filled sets, and the logarithms of their densities."""
    from scipy.stats import qmc  # noqa: PLC0415 - a slow import

    sets = []
    for _ in range(_SETS):
        u = qmc.Sobol(size + 1, seed=rng).random(count)
        u = np.clip(u, 1e-12, 1 - 1e-12)
        scale = np.sqrt(_FREEDOM / (2 * gammaincinv(_FREEDOM / 2, u[:, -1])))
        sets.append(ndtri(u[:, :-1]) * scale[:, None])
    t = np.concatenate(sets)
    half = (_FREEDOM + size) / 2
    logs = gammaln(half) - gammaln(_FREEDOM / 2) - size / 2 * np.log(_FREEDOM * np.pi)
    logs = logs - half * np.log1p(np.square(t).sum(axis=1) / _FREEDOM) - np.log(np.diag(root)).sum()
    return centre + t @ root.T, logs


def _quantile(values: Array, weights: Array, part: ArrayLike) -> Array:
    p = np.asarray(part, dtype=np.float64)
    if not ((p >= 0) & (p <= 1)).all():
        raise InvalidValueError("part: expected 0 to 1")
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    places = (total - weights[order] / 2) / total[-1]
    ordered = values[order]
    finite = np.isfinite(ordered)
    found = np.interp(p, places[finite], ordered[finite]) if finite.any() else np.full(p.shape, np.inf)
    return np.where(p > float(total[finite][-1] / total[-1] if finite.any() else 0.0), np.inf, found)
