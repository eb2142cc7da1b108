"""The point of an ellipsoid that is farthest from the origin."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from armwright.arrays import Array

# A coordinate of the mean below this part of all is none: the farthest points lie on both of its sides.
_CENTRED = 1e-12
# A multiplier beyond the largest eigenvalue by a smaller part of its bound is the hard case.
_HARD = 1e-15


def farthest_point(mean: Array, covariance: Array) -> Array:
    """Return the point of the ellipsoid (x - mean)' C⁻¹ (x - mean) = 1 that is farthest from the origin.

    With a choice of two sides it is one of them.

    Args:
        mean: (d,) middle of the ellipsoid.
        covariance: (d, d), symmetric and positive semidefinite.

    Returns:
        (d,) the point.

    Source:
        Conn, Gould & Toint (2000), Trust-region methods, section 7.3: the secular equation, and its hard case.
    """
    squares, axes = np.linalg.eigh(covariance)
    squares = np.maximum(squares, 0.0)
    m, largest = axes.T @ mean, float(squares[-1])
    pull = np.sqrt(squares) * m
    size = float(np.linalg.norm(pull))
    if size <= _CENTRED * largest:
        # As good as centred, or without extent.
        way = np.sqrt(largest) * axes[:, -1]
        return np.asarray(mean + (way if way @ mean >= 0 else -way))

    # With x = mean + S z, S the root of the covariance: (beyond + gaps) z = pull, and z has the length 1.
    gaps = largest - squares

    def excess(beyond: float) -> float:
        return float(np.square(pull / (beyond + gaps)).sum()) - 1

    if excess(_HARD * size) > 0:
        z = pull / (brentq(excess, _HARD * size, size * (1 + 1e-12), xtol=1e-300, rtol=8.9e-16) + gaps)
    else:
        top = gaps <= _CENTRED * largest
        z = np.where(top, 0.0, pull / np.where(top, 1.0, gaps))
        z[-1] = np.copysign(np.sqrt(max(1 - float(z @ z), 0.0)), m[-1])
    return np.asarray(mean + axes @ (np.sqrt(squares) * z / np.linalg.norm(z)))
