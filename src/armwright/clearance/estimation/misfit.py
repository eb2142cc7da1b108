"""Whether data contradict a model, and by how much that widens what they say of its parameters.

What is left of a fit, in standard deviations, has a sum of squares that follows chi-square where the model and the
noise are right. A sum so large that it hardly comes by chance says that no values of the parameters explain the data;
values that are fitted all the same mean nothing, however sharply they are told. Where it is larger than usual but may
be chance, intervals grow with it.

Source:
    Particle Data Group, Review of Particle Physics, "Introduction", scale factors of weighted means.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.stats import chi2, f

from armwright.arrays import Array, ArrayLike
from armwright.errors import ContradictionError

# Data that come by chance in a smaller part of all cases contradict the model.
CONTRADICTION = 1e-4
_NAMED = 3


def chance(square: ArrayLike, freedom: int, known: float = np.inf) -> Array:
    """Return the probability of what is left being as large or larger where the model holds.

    Args:
        square: (...) sums of squares of what is left, in standard deviations.
        freedom: how many more numbers than parameters there are; with none, nothing can contradict.
        known: of how many numbers the noise was estimated; infinite where it was given.
    """
    size = np.asarray(square, dtype=np.float64)
    if freedom < 1:
        return np.ones_like(size)
    found = chi2.sf(size, freedom) if np.isinf(known) else f.sf(size / freedom, freedom, known)
    return np.asarray(found, dtype=np.float64)


def widening(square: ArrayLike, freedom: int) -> Array:
    """Return (...) by what intervals grow: sqrt(chi2 / freedom), never below 1; see ``chance``."""
    size = np.asarray(square, dtype=np.float64)
    return np.sqrt(np.maximum(1.0, size / freedom)) if freedom >= 1 else np.ones_like(size)


def refuse_contradiction(misfit: float, farthest: Iterable[tuple[str, float]], bounds: Iterable[str]) -> None:
    """Refuse parameters that were fitted to data which contradict their model.

    Args:
        misfit: see ``chance``.
        farthest: numbers that were measured and by how many deviations they are off, in any order.
        bounds: parameters that the fit pushed to a bound, in words.

    Raises:
        ContradictionError: the misfit is below ``CONTRADICTION``.
    """
    if misfit >= CONTRADICTION:
        return
    worst = sorted(farthest, key=lambda one: -abs(one[1]))[:_NAMED]
    off = ", ".join(f"{name} by {deviations:+.3g}" for name, deviations in worst)
    ends = list(bounds)
    raise ContradictionError(
        f"the data contradict the model: no clearances explain them, and none are told (data as far off come by chance "
        f"in {100 * misfit:.2g} % of cases); farthest off, in standard deviations: {off}"
        + (f"; at a bound: {', '.join(ends)}" if ends else "")
        + "; check the payload, the lengths of the links, friction and control of the model, signs, order and units "
        "of the columns, and the noise"
    )
