"""The probability that a normal error is longer than a limit, exactly, into the far tail.

The squared length of a normal vector is a quadratic form. Its tail is integrated over one coordinate after another:
every term is positive, so a probability of 1e-12 has as many digits as one of 0.1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import erfc

from armwright.arrays import Array, ArrayLike, floats, positive
from armwright.errors import InvalidValueError, ShapeError

# Beyond so many standard deviations a coordinate adds nothing that double could represent.
_TAIL = 40.0
# Width of a panel in standard deviations, and points of Gauss and Legendre in it.
_PANEL, _POINTS = 0.5, 10
# Panels whose logarithm is so far below the largest add nothing.
_DEPTH = 34.0
# A standard deviation below this part of the largest is none.
_FLAT = 1e-9
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)
_DIMENSIONS = (1, 2, 3)


def exceedance(mean: ArrayLike, covariance: ArrayLike, limit: float) -> float:
    """Return the probability that a normal vector is longer than a limit.

    Args:
        mean: (d,) its mean, d from 1 to 3.
        covariance: (d, d), symmetric and positive semidefinite.
        limit: a length in the same unit, above zero.

    Raises:
        ShapeError: an array does not fit.
        InvalidValueError: a number is NaN or infinite, the limit is not above zero, or the covariance is none.

    Source:
        Imhof (1961) for the law; the integral here has positive terms only.
    """
    m, C = floats(mean, "mean"), floats(covariance, "covariance")
    if m.ndim != 1 or len(m) not in _DIMENSIONS or C.shape != (len(m), len(m)):
        raise ShapeError(
            f"mean and covariance: expected (d,) and (d, d) with d from 1 to 3, got {m.shape} and {C.shape}"
        )
    largest = positive(limit, "limit")
    variances, axes = np.linalg.eigh((C + C.T) / 2)
    if not np.allclose(C, C.T, rtol=1e-9, atol=0) or variances[0] < -_FLAT * max(abs(variances).max(), 1e-300):
        raise InvalidValueError("covariance: expected a symmetric matrix without negative eigenvalues")
    return _outside(axes.T @ m, np.sqrt(np.maximum(variances, 0.0)), largest)


def _outside(mean: Array, deviations: Array, limit: float) -> float:
    """Return the probability for independent coordinates, the narrowest of which comes first."""
    still = deviations <= _FLAT * max(limit, float(deviations.max()))
    if still.any():
        # A coordinate that does not vary shortens the limit of the others.
        left = limit**2 - float((mean[still] ** 2).sum())
        if left <= 0 or still.all():
            return float(left < 0)
        return _outside(mean[~still], deviations[~still], float(np.sqrt(left)))
    if len(mean) == 1:
        return float(_beyond(mean[0], deviations[0], np.asarray(limit)))
    first, deviation = float(mean[0]), float(deviations[0])
    edges = _edges(first, deviation, (float(np.linalg.norm(mean[1:])), *mean[1:]), deviations[1], limit)
    total = float(_beyond(first, deviation, np.asarray(limit)))
    # x = limit sin(u): the limit of what remains is limit cos(u), without a root at the ends.
    half = np.diff(edges) / 2
    u = (edges[:-1] + half)[:, None] + half[:, None] * _NODES
    x, rest = limit * np.sin(u), limit * np.cos(u)
    log_density = -0.5 * ((x - first) / deviation) ** 2
    if len(mean) == 2:
        values = np.exp(log_density) * _beyond(mean[1], deviations[1], rest) * np.cos(u)
    else:
        values = np.zeros_like(x)
        # The rest is beyond its limit only if it is so far from its mean, in units of its widest deviation.
        away = np.maximum(rest - np.linalg.norm(mean[1:]), 0.0) / deviations[-1]
        bound = log_density - away**2 / 2
        for i, j in np.argwhere(bound > bound.max() - _DEPTH):
            values[i, j] = np.exp(log_density[i, j]) * _outside(mean[1:], deviations[1:], rest[i, j]) * np.cos(u[i, j])
    scale = limit / (deviation * np.sqrt(2 * np.pi))
    return float(min(total + scale * float((values * _WEIGHTS * half[:, None]).sum()), 1.0))


def _beyond(mean: Any, deviation: Any, limit: Array) -> Array:
    """Return the probability that the size of one coordinate is beyond a limit."""
    width = deviation * np.sqrt(2.0)
    return np.asarray(0.5 * (erfc((limit - mean) / width) + erfc((limit + mean) / width)))


def _edges(mean: float, deviation: float, others: tuple[float, ...], spread: float, limit: float) -> Array:
    """Return borders of panels in u, over which neither the density nor the probability of the rest changes by much."""
    steps = np.arange(-_TAIL, _TAIL + _PANEL, _PANEL)
    own = (mean + deviation * steps) / limit
    sines = [own[np.abs(own) < 1]]
    for other in others:
        # Where the limit of the rest passes the mean of a coordinate, or of all together.
        cosines = (abs(other) + spread * steps) / limit
        cosines = cosines[(cosines > 0) & (cosines < 1)]
        sine = np.sqrt((1 - cosines) * (1 + cosines))
        sines += [sine, -sine]
    inner = np.arcsin(np.concatenate(sines))
    return np.unique(np.concatenate([[-np.pi / 2], inner, np.linspace(-1.5, 1.5, 7), [np.pi / 2]]))
