"""First-order reliability: the failure that is nearest to the mean, and the probability it gives."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from armwright.arrays import Array

# A coordinate whose mean is below this part of the limit is centred: failures lie on both of its sides.
_CENTRED = 1e-12


def nearest_failure(mean: Array, covariance: Array, limit: float) -> Array:
    """Return the error of the limit's length that is most probable; with a choice of two sides, one of them.

    Args:
        mean: (d,) mean error.
        covariance: (d, d) of the error.
        limit: length at which it fails.

    Source:
        Hasofer & Lind (1974); the point of a sphere that is nearest in the metric of the covariance solves the secular
        equation of a trust region, Conn, Gould & Toint (2000), section 7.3.
    """
    variances, axes = np.linalg.eigh(covariance)
    variances = np.maximum(variances, 0.0)
    m = axes.T @ mean
    length = float(np.linalg.norm(m))
    if length >= limit or not variances[-1]:
        return np.asarray(mean * (limit / length)) if length else np.asarray(limit * axes[:, -1])

    def excess(multiplier: float) -> float:
        return float(np.square(m / (1 - multiplier * variances / variances[-1])).sum()) - limit**2

    largest = variances > variances[-1] * (1 - _CENTRED)
    end = 1 - 1e-15
    if np.abs(m[largest]).max() > _CENTRED * limit and excess(end) > 0:
        multiplier = brentq(excess, 0.0, end, xtol=1e-16, rtol=8.9e-16)
        point = m / (1 - multiplier * variances / variances[-1])
    else:
        rest = np.where(largest, 0.0, m / np.where(largest, 1.0, 1 - variances / variances[-1]))
        point = rest if np.linalg.norm(rest) < limit else rest * (limit / np.linalg.norm(rest))
        point = point.copy()
        point[-1] = np.copysign(np.sqrt(max(limit**2 - float((point**2).sum()), 0.0)), m[-1])
    return np.asarray(axes @ (point * (limit / np.linalg.norm(point))))


def reliability_index(mean: Array, covariance: Array, limit: float) -> float:
    """Return the distance of the nearest failure from the mean in standard deviations; negative if the mean fails."""
    away = nearest_failure(mean, covariance, limit) - mean
    squared = away @ np.linalg.pinv(covariance, rcond=1e-14, hermitian=True) @ away
    return float(np.copysign(np.sqrt(squared), limit - np.linalg.norm(mean)))


def form(mean: Array, covariance: Array, limit: float) -> float:
    """Return the probability of failure by the half space beyond the nearest failure.

    It misses failures in other directions: for a mean near zero it is too small by a factor of two and more.
    """
    return float(ndtr(-reliability_index(mean, covariance, limit)))
