"""Growth that is measured again and again, as a gamma process: increments that are independent, positive and random.

A growth over n strokes has the gamma law of shape a n and rate b. Given a, the rate has a gamma posterior; a itself is
known on a grid. The growth to come then has, given a, the law of a ratio of gamma numbers, so that nothing is sampled.

Source:
    van Noortwijk (2009), A survey of the application of gamma processes in maintenance; spec of the life, 4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import betaincc, gammaln

from armwright.arrays import Array, ArrayLike, floats, not_negative, positive
from armwright.errors import InvalidValueError, ShapeError, TooFewError

# Points of the grid of the logarithm of a, and how wide it is: an increment varies by 1 / sqrt(shape) of itself. The
# likelihood of nearly regular growth hardly falls before the end.
_POINTS, _LEAST_SHAPE, _LARGEST_SHAPE = 400, 1e-2, 1e6
# Lives are found between these parts and multiples of the strokes that were measured.
_RANGE = 1e-9, 1e12


class GammaProcess(NamedTuple):
    """What measured increments say of a gamma process.

    Attributes:
        shapes: (m,) grid of a, shape per stroke.
        probabilities: (m,) of each; they add up to one.
        strokes: that were measured.
        growth: over these [m] or [rad].
        increments: how many there were.
    """

    shapes: Array
    probabilities: Array
    strokes: float
    growth: float
    increments: int

    def failure(self, growth: float, strokes: float) -> float:
        """Return the probability that the growth over strokes to come is larger than some growth.

        Args:
            growth: what is left until the limit [m] or [rad].
            strokes: from the last measurement on.
        """
        left, coming = positive(growth, "growth"), not_negative(strokes, "strokes")
        if not coming:
            return 0.0
        # The new growth by itself and the old one is beta, since the rate is that of both.
        part = left / (left + self.growth)
        return float(self.probabilities @ betaincc(self.shapes * coming, self.shapes * self.strokes, part))

    def quantile(self, growth: float, part: float) -> float:
        """Return the strokes to come after which the growth is larger than some growth with a probability.

        Args:
            growth: what is left until the limit [m] or [rad].
            part: the probability, 0.1 for the B10 life.

        Raises:
            InvalidValueError: a number is out of its range, or the growth is never reached with this probability.
        """
        positive(growth, "growth")
        if not 0 < part < 1:
            raise InvalidValueError(f"part: expected a number between 0 and 1, got {part:g}")

        def excess(log: float) -> float:
            return self.failure(growth, float(np.exp(log))) - part

        low, high = (np.log(self.strokes * end) for end in _RANGE)
        if excess(low) > 0 or excess(high) < 0:
            raise InvalidValueError(f"growth: expected one near that of {self.growth:g} measured, got {growth:g}")
        return float(np.exp(brentq(excess, low, high, xtol=1e-12)))


def gamma_process(strokes: ArrayLike, growths: ArrayLike) -> GammaProcess:
    """Return what measured increments say of a gamma process, nothing being known of it before.

    The errors of the measurements must be small against the increments.

    Args:
        strokes: (n,) of each increment.
        growths: (n,) in them [m] or [rad].

    Raises:
        ShapeError: the arrays do not have one length.
        TooFewError: there are fewer than three increments.
        InvalidValueError: one is not above zero.
    """
    n, x = floats(strokes, "strokes"), floats(growths, "growths")
    if n.ndim != 1 or n.shape != x.shape:
        raise ShapeError(f"expected strokes and growths (n,), got {n.shape} and {x.shape}")
    if len(n) < 3:
        raise TooFewError(f"expected three increments at least, got {len(n)}")
    if not (n > 0).all() or not (x > 0).all():
        raise InvalidValueError(
            "increments: a gamma process only grows, in more than 0 strokes; measure more seldom, or more accurately"
        )
    shapes = np.geomspace(_LEAST_SHAPE, _LARGEST_SHAPE, _POINTS) / n.mean()
    own = shapes[:, None] * n
    # The reference priors of the rate and of the logarithm of a; the rate is integrated out.
    logs = (own * np.log(x) - gammaln(own)).sum(axis=1) + gammaln(shapes * n.sum()) - shapes * n.sum() * np.log(x.sum())
    probabilities = np.exp(logs - logs.max())
    return GammaProcess(
        shapes=shapes,
        probabilities=probabilities / probabilities.sum(),
        strokes=float(n.sum()),
        growth=float(x.sum()),
        increments=len(n),
    )
