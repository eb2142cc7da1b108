"""Signs that readings contradict an arm though its fit looks good: outliers that share a joint, impossible errors.

A joint whose encoder turns another joint too (q3 = a2 q2 + q3, as on palletisers), one in other units or of the other
sign, makes outliers of readings as soon as it moves. A robust fit then drops all of them and is sure of the rest.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.stats import chi2, mannwhitneyu

from armwright.arrays import Array, Flags, positive
from armwright.calibration.fitting import CHECKS, PRIOR_SIGMA_ANGLE, PRIOR_SIGMA_LENGTH, Calibration
from armwright.calibration.readings import Readings

# A hypothesis is rejected at this level of significance; so few outliers are not tested, and so large a part of all is
# too many.
_SIGNIFICANCE, _MIN_COUNT, _MANY = 1e-4, 5, 0.2
# Errors of a link that are larger than so many prior sigmas are no errors of a link.
_MAX_SIGMAS = 3.0


def find_contradictions(calibration: Calibration, measured: Readings, noise: float | None = None) -> Iterator[str]:
    """Give the reasons, in words, for which readings contradict the arm that was fitted to them.

    Args:
        calibration: of the arm.
        measured: the readings that it was fitted to.
        noise: standard deviation of a measured coordinate or distance, if it is stated [m].

    Raises:
        InvalidValueError: the noise is not above 0.
    """
    outlying = np.zeros(len(measured), dtype=np.bool_)
    outlying[list(calibration.outliers)] = True
    count = int(outlying.sum())
    shared = _shared_joint(measured.q, outlying) if _MIN_COUNT <= count <= len(measured) - _MIN_COUNT else None
    if shared is not None:
        yield (
            f"the {count} readings that do not count are those in which joint {shared + 1} is elsewhere "
            f"than in the {len(measured) - count} that do; the residuals of the rest say nothing of it: {CHECKS}"
        )
    elif outlying.mean() > _MANY:
        yield (
            f"{count} of {len(measured)} readings do not count, and a fit that leaves out so many "
            f"praises the rest: {CHECKS}"
        )
    lengths = dict(zip(calibration.model.names, calibration.model.is_length, strict=True))
    impossible = [
        f"{name} {value * 1e3:+.3g} {'mm' if lengths[name] else 'mrad'}"
        for name, value in zip(calibration.names, calibration.values, strict=True)
        if name.startswith("joint")
        and abs(value) > _MAX_SIGMAS * (PRIOR_SIGMA_LENGTH if lengths[name] else PRIOR_SIGMA_ANGLE)
    ]
    if impossible:
        yield f"{', '.join(impossible)}: no link is made so badly; {CHECKS}"
    if noise is not None:
        yield from _excess_residuals(calibration, measured, noise)


def _excess_residuals(calibration: Calibration, measured: Readings, noise: float) -> Iterator[str]:
    """Test by chi-square whether the residuals are larger than the stated noise makes them."""
    positive(noise, "noise", "m")
    residuals = calibration.model.residuals(measured, calibration.errors)
    # Lengths have their share of the degrees of freedom.
    degrees_of_freedom = max(1.0, calibration.degrees_of_freedom * float(np.mean(~residuals.is_rotation)))
    ratio = calibration.noise.length / noise
    p_value = float(chi2.sf(degrees_of_freedom * ratio**2, degrees_of_freedom))
    if p_value < _SIGNIFICANCE:
        yield (
            f"the residuals have a standard deviation of {calibration.noise.length * 1e3:.3g} mm per coordinate, "
            f"{ratio:.3g} times the {noise * 1e3:.3g} mm that are stated, which comes by chance in {100 * p_value:.2g} "
            f"% of cases: the geometry of this arm does not explain the readings; --beyond tries what else may"
        )


def _shared_joint(q: Array, outlying: Flags) -> int | None:
    """Return the joint, from 0, by which outliers differ most from the others; None if that may be chance."""
    joints = [i for i in range(q.shape[1]) if np.ptp(q[:, i]) > 0]
    p_values = []
    for i in joints:
        away = np.abs(q[:, i] - np.median(q[~outlying, i]))
        p_values.append(float(mannwhitneyu(away[outlying], away[~outlying], alternative="greater").pvalue))
    if not joints or min(p_values) * len(joints) > _SIGNIFICANCE:
        return None
    return joints[int(np.argmin(p_values))]
