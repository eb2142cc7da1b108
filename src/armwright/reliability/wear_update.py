"""Wear rates from repeated measurements of play: the posterior of a lognormal prior."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array, ArrayLike, floats, not_negative, positive
from armwright.errors import InvalidValueError, ShapeError

# Points of the grid of the logarithm, and how far it reaches in standard deviations of the prior.
_POINTS, _REACH = 4001, 8.0


class RatePosterior(NamedTuple):
    """What is known of a wear rate.

    Attributes:
        rates: (m,) grid of rates per cycle.
        probabilities: (m,) of each; they add up to one.
    """

    rates: Array
    probabilities: Array

    @property
    def median(self) -> float:
        """The rate that is exceeded with probability one half."""
        return self.quantile(0.5)

    @property
    def spread(self) -> float:
        """Standard deviation of its logarithm."""
        logs = np.log(self.rates)
        mean = float(self.probabilities @ logs)
        return float(np.sqrt(self.probabilities @ (logs - mean) ** 2))

    def quantile(self, part: float) -> float:
        """Return the rate that is not exceeded with this probability."""
        if not 0 <= part <= 1:
            raise InvalidValueError(f"part: expected 0 to 1, got {part:g}")
        total = np.cumsum(self.probabilities) - self.probabilities / 2
        return float(np.exp(np.interp(part, total, np.log(self.rates))))


def updated_rate(
    *, median: float, spread: float, first: float, cycles: ArrayLike, plays: ArrayLike, errors: ArrayLike
) -> RatePosterior:
    """Return what measured plays say of a wear rate: play = first + rate · cycles, with normal errors.

    Args:
        median: of the rate before the measurements, per cycle [rad] or [m].
        spread: standard deviation of its logarithm.
        first: play of the new joint [rad] or [m].
        cycles: (m,) at which it was measured.
        plays: (m,) measured [rad] or [m].
        errors: (m,) standard errors of these.

    Raises:
        ShapeError: the arrays do not have one length.
        InvalidValueError: a number is out of its range.
    """
    positive(median, "median")
    positive(spread, "spread")
    not_negative(first, "first")
    n, p, s = floats(cycles, "cycles"), floats(plays, "plays"), floats(errors, "errors")
    if n.ndim != 1 or n.shape != p.shape or n.shape != s.shape:
        raise ShapeError(f"expected cycles, plays and errors (m,), got {n.shape}, {p.shape} and {s.shape}")
    if (n < 0).any() or (s <= 0).any():
        raise InvalidValueError("expected cycles of 0 or more, and errors above 0")
    centre, width = np.log(median), _REACH * spread
    for _ in range(4):
        logs = np.linspace(centre - width, centre + width, _POINTS)
        rates = np.exp(logs)
        misfit = (p - first - rates[:, None] * n) / s
        density = -0.5 * ((logs - np.log(median)) / spread) ** 2 - 0.5 * (misfit**2).sum(axis=1)
        probabilities = np.exp(density - density.max())
        probabilities /= probabilities.sum()
        # The grid closes in on where the probability is.
        mean = float(probabilities @ logs)
        deviation = float(np.sqrt(probabilities @ (logs - mean) ** 2))
        centre, width = mean, max(_REACH * deviation, 4 * width / _POINTS)
    return RatePosterior(rates, probabilities)
