"""Tests of whether readings contradict an arm in spite of small residuals: outliers that share a joint, large errors.

If a joint is coupled to another (q3 = a2 q2 + q3, as on palletisers), or its column has another unit or sign, readings
become outliers as soon as it moves. A robust fit then discards all of them, and the residuals of the others are small.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.stats import chi2, mannwhitneyu

from armwright.arrays import Array, Flags, positive
from armwright.calibration.fitting import CHECKS, PRIOR_SIGMA, Calibration
from armwright.calibration.readings import Readings

# Level of significance; the smallest number of outliers that is tested; and the largest part of outliers.
_SIGNIFICANCE, _MIN_COUNT, _MAX_OUTLIERS = 1e-4, 5, 0.2
# The largest error of a link, in standard deviations of its prior.
_MAX_SIGMAS = 3.0


def find_contradictions(calibration: Calibration, measured: Readings, noise: float | None = None) -> Iterator[str]:
    """Give the reasons, as text, for which the readings contradict the fitted arm.

    Args:
        calibration: of the arm.
        measured: the readings that it was fitted to.
        noise: standard deviation of a measured coordinate or distance, if it is stated [m].

    Raises:
        InvalidValueError: the noise is not above 0.
    """
    outlying = np.isin(np.arange(len(measured)), calibration.outliers)
    count = len(calibration.outliers)
    shared = _shared_joint(measured.q, outlying) if _MIN_COUNT <= count <= len(measured) - _MIN_COUNT else None
    if shared is not None:
        yield (
            f"the {count} outliers differ from the other {len(measured) - count} readings in the position of joint "
            f"{shared + 1}, so that the residuals of the others do not test that joint: {CHECKS}"
        )
    elif outlying.mean() > _MAX_OUTLIERS:
        yield (
            f"{count} of {len(measured)} readings are outliers, so many that the residuals of the others do not "
            f"confirm the model: {CHECKS}"
        )
    is_length = calibration.model.is_length[list(calibration.identifiability.fitted)]
    limits = _MAX_SIGMAS * np.where(is_length, *PRIOR_SIGMA)
    impossible = [
        f"{name} {value * 1e3:+.3g} {'mm' if length else 'mrad'}"
        for name, value, length, limit in zip(calibration.names, calibration.values, is_length, limits, strict=True)
        if name.startswith("joint") and abs(value) > limit
    ]
    if impossible:
        yield f"{', '.join(impossible)}: larger than any manufacturing error of a link; {CHECKS}"
    if noise is not None:
        yield from _excess_residuals(calibration, measured, noise)


def _excess_residuals(calibration: Calibration, measured: Readings, noise: float) -> Iterator[str]:
    """Give a message if a chi-square test finds larger residuals than the stated noise explains."""
    positive(noise, "noise", "m")
    residuals = calibration.model.residuals(measured, calibration.errors)
    # Lengths have their share of the degrees of freedom.
    degrees_of_freedom = max(1.0, calibration.degrees_of_freedom * float(np.mean(~residuals.is_rotation)))
    ratio = calibration.noise.length / noise
    p_value = float(chi2.sf(degrees_of_freedom * ratio**2, degrees_of_freedom))
    if p_value < _SIGNIFICANCE:
        yield (
            f"the residuals have a standard deviation of {calibration.noise.length * 1e3:.3g} mm per coordinate, "
            f"{ratio:.3g} times the stated {noise * 1e3:.3g} mm (chi-square test, p = {p_value:.2g}): the geometry of "
            f"this arm does not explain the readings; --beyond tries non-geometric models"
        )


def _shared_joint(q: Array, outlying: Flags) -> int | None:
    """Return the joint, from 0, by which outliers differ most from the others; None if it is not significant."""
    p_values: dict[int, float] = {}
    for i in np.flatnonzero(np.ptp(q, axis=0) > 0).tolist():
        away = np.abs(q[:, i] - np.median(q[~outlying, i]))
        p_values[i] = float(mannwhitneyu(away[outlying], away[~outlying], alternative="greater").pvalue)
    best = min(p_values, key=p_values.__getitem__, default=None)
    return None if best is None or p_values[best] * len(p_values) > _SIGNIFICANCE else best
