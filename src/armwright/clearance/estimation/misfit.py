"""Whether data contradict a model, and how much that widens the intervals of its parameters.

The residuals of a fit, in standard deviations, have a sum of squares that follows chi-square where the model and the
noise are right. A sum with a p-value below the significance level means that no values of the parameters explain the
data; fitted values then mean nothing, however narrow their intervals. A larger sum than expected that is not
significant widens the intervals.

Source:
    Particle Data Group, Review of Particle Physics, "Introduction", scale factors of weighted means.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.stats import chi2, f

from armwright.arrays import Array, ArrayLike
from armwright.errors import ContradictionError

# Significance level: data contradict the model if the p-value of their residuals is smaller.
CONTRADICTION = 1e-4
_MAX_NAMED = 3


def p_value(chi_square: ArrayLike, freedom: int, noise_freedom: float = np.inf) -> Array:
    """Return the probability of residuals as large or larger where the model holds.

    Args:
        chi_square: (...) sums of squared residuals, in standard deviations.
        freedom: number of measured values minus that of parameters; without any, nothing can contradict.
        noise_freedom: degrees of freedom of the estimated noise; infinite where the noise is known.
    """
    size = np.asarray(chi_square, dtype=np.float64)
    if freedom < 1:
        return np.ones_like(size)
    p = chi2.sf(size, freedom) if np.isinf(noise_freedom) else f.sf(size / freedom, freedom, noise_freedom)
    return np.asarray(p, dtype=np.float64)


def widening(chi_square: ArrayLike, freedom: int) -> Array:
    """Return (...) the factor of intervals: sqrt(chi2 / freedom), never below 1; see ``p_value``."""
    size = np.asarray(chi_square, dtype=np.float64)
    return np.sqrt(np.maximum(1.0, size / freedom)) if freedom >= 1 else np.ones_like(size)


def refuse_contradiction(misfit: float, residuals: Iterable[tuple[str, float]], bounds: Iterable[str]) -> None:
    """Refuse parameters that were fitted to data which contradict their model.

    Args:
        misfit: see ``p_value``.
        residuals: measured quantities and their residuals in standard deviations, in any order.
        bounds: parameters at a bound of the fit, in words.

    Raises:
        ContradictionError: the misfit is below ``CONTRADICTION``.
    """
    if misfit >= CONTRADICTION:
        return
    worst = sorted(residuals, key=lambda residual: -abs(residual[1]))[:_MAX_NAMED]
    listed = ", ".join(f"{name} by {deviations:+.3g}" for name, deviations in worst)
    ends = list(bounds)
    raise ContradictionError(
        f"the data contradict the model: no clearances explain them, and none are reported (test of the residuals: p = "
        f"{misfit:.2g}); largest residuals, in standard deviations: {listed}"
        + (f"; at a bound: {', '.join(ends)}" if ends else "")
        + "; check the payload, the lengths of the links, friction and control of the model, signs, order and units "
        "of the columns, and the noise"
    )
