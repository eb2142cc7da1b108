"""The noise of readings estimated from their residuals, outliers, and the robust weights of readings.

Source:
    Holland & Welsch (1977) for robust weights.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from armwright.arrays import Array, Flags
from armwright.calibration.readings import Numbers
from armwright.calibration.residuals import Residuals

# Readings whose squared residual is beyond this quantile of chi-square weigh less: three sigma of one number.
_QUANTILE = 0.9973
# Those beyond twice as many sigmas are outliers, which do not count in the last fit.
_OUTLIER_FACTOR = 2.0
# One of so many readings is remarkable if chance gives any of them such a residual this rarely.
_REMARKABLE = 0.01


class Noise(NamedTuple):
    """Standard deviations of measured numbers.

    Attributes:
        length: of a coordinate or a distance [m].
        angle: of a rotation about one axis [rad].
    """

    length: float
    angle: float


# Of a laser tracker, for want of better; and of rounding.
TYPICAL_NOISE, LEAST_NOISE = Noise(1e-4, 5e-4), Noise(1e-9, 1e-9)
# With fewer degrees of freedom lengths and rotations share one scale: the residuals of one kind can be next to nothing.
_MIN_DEGREES_OF_FREEDOM = 30


def length_scales(residuals: Residuals, noise: Noise) -> Array:
    """Return (r,) the factors that make lengths of all residuals, with the same standard deviation [1], [m/rad]."""
    return np.where(residuals.is_rotation, noise.length / noise.angle, 1.0)


def standard_deviations(residuals: Residuals, noise: Noise) -> Array:
    """Return (r,) the standard deviation of each measured number [m], [rad]."""
    return np.where(residuals.is_rotation, noise.angle, noise.length)


def robust_weights(residuals: Residuals, noise: Noise, *, reject_outliers: bool) -> Array:
    """Return (r,) the square roots of the soft-L1 weights of readings; all numbers of a reading have one weight.

    With ``reject_outliers`` those beyond the chi-square limit have weight 0.
    """
    square, size = _squares_by_reading(residuals.reading, residuals.values / standard_deviations(residuals, noise))
    root = (1 + square / _chi2_limit(size)) ** -0.25
    if reject_outliers:
        root[_is_outlier(square, size)] = 0.0
    return np.asarray(root[residuals.reading], dtype=np.float64)


def median_noise(residuals: Residuals, fitted: int) -> Noise:
    """Return the noise by the median over the readings, which outliers do not move.

    Args:
        residuals: of the readings.
        fitted: how many errors were fitted to them.
    """
    all_values = np.ones(len(residuals.values), dtype=np.bool_)
    return _estimate_noise(residuals, all_values, len(residuals.values) - fitted, _median_scale)


def noise_and_outliers(residuals: Residuals, readings: int, fitted: int, *, robust: bool) -> tuple[Noise, Flags, int]:
    """Return the noise, which readings are outliers (m,), and the degrees of freedom.

    Args:
        residuals: of the readings.
        readings: how many there are.
        fitted: how many errors were fitted to them.
        robust: whether some may be outliers.
    """
    outlying = np.zeros(readings, dtype=np.bool_)
    counted = np.ones(len(residuals.values), dtype=np.bool_)
    # Twice: outliers follow from the noise, and the noise from the other readings.
    for _ in range(2):
        degrees_of_freedom = max(1, int(counted.sum()) - fitted)
        correction = float(np.sqrt(counted.sum() / degrees_of_freedom))
        scale = partial(_trimmed_scale, correction=correction, robust=robust)
        noise = _estimate_noise(residuals, counted, degrees_of_freedom, scale)
        if robust:
            scaled = residuals.values / standard_deviations(residuals, noise)
            outlying = _is_outlier(*_squares_by_reading(residuals.reading, scaled))
            counted = ~outlying[residuals.reading]
    return noise, outlying, max(1, int(counted.sum()) - fitted)


def remarkable_readings(residuals: Residuals, noise: Noise) -> tuple[int, ...]:
    """Return the readings whose residuals are too large for chance, the largest first; outliers are among them.

    Args:
        residuals: of the readings.
        noise: of the measurement.
    """
    scaled = residuals.values / standard_deviations(residuals, noise)
    square, size = _squares_by_reading(residuals.reading, scaled)
    # Of as many readings as there are (Bonferroni).
    rare = chi2.sf(square, np.maximum(size, 1)) * len(square) < _REMARKABLE
    return tuple(i for i in np.argsort(-square).tolist() if rare[i])


# ---- inside --------------------------------------------------------------------------------------------------------


def _estimate_noise(
    residuals: Residuals, counted: Flags, degrees_of_freedom: int, scale: Callable[[Numbers, Array], float]
) -> Noise:
    """Return the noise of lengths and of rotations by one rule; with few degrees of freedom, of both together."""
    if degrees_of_freedom < _MIN_DEGREES_OF_FREEDOM:
        scaled = residuals.values / standard_deviations(residuals, TYPICAL_NOISE)
        common = scale(residuals.reading[counted], scaled[counted])
        return Noise(*map(max, (common * typical for typical in TYPICAL_NOISE), LEAST_NOISE))
    kinds = (~residuals.is_rotation & counted, residuals.is_rotation & counted)
    scales = (scale(residuals.reading[kind], residuals.values[kind]) for kind in kinds)
    return Noise(*map(max, scales, LEAST_NOISE))


def _squares_by_reading(reading: Numbers, values: Array) -> tuple[Array, Array]:
    """Return by reading the sum of its squared residuals, and how many they are; 0 for readings without any."""
    return np.bincount(reading, values**2).astype(np.float64), np.bincount(reading).astype(np.float64)


def _chi2_limit(size: Array) -> Array:
    """Return the quantile of chi-square with so many degrees of freedom."""
    return np.asarray(chi2.ppf(_QUANTILE, np.maximum(size, 1)), dtype=np.float64)


def _is_outlier(square: Array, size: Array) -> Flags:
    """Return which readings are outliers, by the sum of their squared residuals, in standard deviations."""
    return np.asarray(square > _OUTLIER_FACTOR**2 * _chi2_limit(size), dtype=np.bool_)


def _trimmed_scale(reading: Numbers, values: Array, *, correction: float, robust: bool) -> float:
    """Return the root mean square of residuals, if robust without readings that are far off.

    It is multiplied by a correction for the degrees of freedom that the fit has taken.
    """
    if not len(values):
        return 0.0
    if not robust:
        return float(np.sqrt(np.mean(values**2))) * correction
    square, size = _squares_by_reading(reading, values)
    square, size = square[size > 0], size[size > 0]
    limit = _chi2_limit(size)
    near = square <= limit * (_median_scale(reading, values) * correction) ** 2
    # The tail that is cut off a normal distribution would have made the mean larger.
    within = chi2.cdf(limit, size + 2) / np.maximum(chi2.cdf(limit, size), _QUANTILE)
    total, count = square[near].sum(), (size * within)[near].sum()
    return float(np.sqrt(total / count)) * correction if count else 0.0


def _median_scale(reading: Numbers, values: Array) -> float:
    """Return the standard deviation about 0 of the median reading, which outliers do not move."""
    square, size = _squares_by_reading(reading, values)
    measured = size > 0
    return float(np.sqrt(np.median(square[measured] / chi2.ppf(0.5, size[measured])))) if measured.any() else 0.0
