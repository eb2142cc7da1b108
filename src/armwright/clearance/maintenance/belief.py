"""What is known of the clearances and wear coefficients of pins: samples, updated by what a check measures.

A clearance is that of the new pin and its growth. Between checks growths follow the table, and scatter about it as sums
of independent grains do. At a check the samples are described by a normal distribution of new clearances, growths and
logarithms of wear coefficients; the posterior is found by importance sampling about its mode, in stages that each
propose what the one before has found, so that neither a wide prior nor an accurate reading leaves few samples.

Source:
    Kotecha and Djurić, "Gaussian particle filtering", IEEE Transactions on Signal Processing 51 (2003); spec of the
    life, 5.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import attrs
import numpy as np
from scipy.special import ndtri

from armwright.arrays import Array, Numbers, integer, not_negative, positive
from armwright.clearance.maintenance.wear_history import GrowthTable
from armwright.errors import InvalidValueError, ShapeError

# No pin has less [m].
_LEAST_CLEARANCE = 1e-7
# Degrees of freedom of the proposal: its tails are wider than those of the posterior.
_TAILS = 6.0
# Samples by which proposals are improved, and what is kept of the spread of the one before.
_PILOTS, _BLEND = 1000, 0.1
# The search for the mode begins at the mean and at so many of the best samples.
_STARTS = 3
# Its steps of derivatives, in standard deviations; the parts of a step that are tried; and what ends it.
_ITERATIONS, _DIFFERENCE, _PARTS, _STILL = 20, 0.3, 0.5 ** np.arange(7.0), 1e-4
FEWEST_SAMPLES, _MOST = 100, 100_000
# A logarithm within which no wear coefficient is bounded by rounding.
_WIDEST = 5.0


@attrs.frozen(kw_only=True, eq=False)
class WearPrior:
    """What is known of p pins before any measurement.

    Attributes:
        clearances: (p,) means of new pins [m].
        clearance_spread: standard deviation of each [m].
        coefficients: (p,) medians of the wear coefficients [m²/N].
        spread: standard deviation of the logarithm that all pins have in common.
        pin_spread: standard deviation of the logarithm of a single bearing about that of all.
        grain: of wear: the variance of a growth divided by its mean [m].
        scatter: standard deviation of a growth between two checks, as a part of its mean: how well its law is known.
    """

    clearances: Array
    clearance_spread: float
    coefficients: Array
    spread: float
    pin_spread: float
    grain: float
    scatter: float = 0.05

    def __attrs_post_init__(self) -> None:
        """Check the ranges."""
        if self.clearances.ndim != 1 or self.coefficients.shape != self.clearances.shape:
            raise ShapeError(
                f"expected clearances and wear coefficients (p,), got {self.clearances.shape} and "
                f"{self.coefficients.shape}"
            )
        if not np.all(self.clearances > 0):
            raise InvalidValueError(f"clearances: expected more than 0, got {self.clearances.min() * 1e3:g} mm")
        for coefficient in self.coefficients:
            positive(float(coefficient), "wear coefficient")
        not_negative(self.clearance_spread, "spread of the clearances")
        not_negative(self.grain, "grain of the wear")
        not_negative(self.scatter, "scatter of the wear")
        for name, spread in (("spread", self.spread), ("pin spread", self.pin_spread)):
            if not_negative(spread, f"{name} of the wear coefficients") > _WIDEST:
                raise InvalidValueError(
                    f"{name} of the wear coefficients: expected at most {_WIDEST:g}, got {spread:g}"
                )

    @property
    def fastest(self) -> float:
        """The largest wear coefficient that has to be expected: nineteen in twenty are smaller [m²/N]."""
        return float(self.coefficients.max() * np.exp(ndtri(0.95) * np.hypot(self.spread, self.pin_spread)))

    def draw(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Return (count, p) clearances [m] and logarithms of wear coefficients."""
        shape = (count, len(self.clearances))
        logs = np.log(self.coefficients) + self.spread * rng.standard_normal((count, 1))
        logs = logs + self.pin_spread * rng.standard_normal(shape)
        clearances = self.clearances + self.clearance_spread * rng.standard_normal(shape)
        return np.maximum(clearances, _LEAST_CLEARANCE), logs

    def growth_deviation(self, growth: Array) -> Array:
        """Return the standard deviations of growths of the same shape [m]."""
        return np.sqrt(self.grain * growth + (self.scatter * growth) ** 2)

    def new_bearing(self, pin: int, logs: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return (s,) clearances [m] and logarithms of a new bearing, beside pins with logarithms (s, p).

        It wears as the others do, but for its own scatter: the logarithms of all tell what they have in common.
        """
        count, p = logs.shape
        own, common, single = logs - np.log(self.coefficients), self.spread**2, self.pin_spread**2
        if single == 0:
            level = own.mean(axis=1)
        else:
            variance = common * single / (single + p * common)
            level = own.sum(axis=1) * variance / single + np.sqrt(variance) * rng.standard_normal(count)
        clearances = self.clearances[pin] + self.clearance_spread * rng.standard_normal(count)
        single_logs = np.log(self.coefficients[pin]) + level + self.pin_spread * rng.standard_normal(count)
        return np.maximum(clearances, _LEAST_CLEARANCE), single_logs


class Measured(NamedTuple):
    """What a check says of the pins: values that were predicted, with normal errors.

    Attributes:
        predicted: (..., k) values for new clearances (..., p) and growths (..., p) [m].
        values: (k,) [m].
        covariance: (k, k) of their errors [m²].
    """

    predicted: Callable[[Array, Array], Array]
    values: Array
    covariance: Array


@attrs.frozen(kw_only=True, eq=False)
class Belief:
    """Samples of the state of p pins after some strokes, each as probable as any other.

    Attributes:
        prior: of new pins.
        table: growth of the clearances.
        strokes: done.
        new: (s, p) clearances of the new pins [m].
        growths: (s, p) of the clearances since [m].
        logs: (s, p) natural logarithms of the wear coefficients [m²/N].
        misfit: sum of the squares by which the last check and what was believed before disagree at least, in standard
            deviations; it follows chi-square with as many degrees of freedom as values were measured.
    """

    prior: WearPrior
    table: GrowthTable
    strokes: float
    new: Array
    growths: Array
    logs: Array
    misfit: float = 0.0

    @classmethod
    def of_new_pins(cls, prior: WearPrior, table: GrowthTable, rng: np.random.Generator, samples: int = 1000) -> Belief:
        """Return what is known of new pins."""
        if not FEWEST_SAMPLES <= integer(samples, "samples", least=1) <= _MOST:
            raise InvalidValueError(f"samples: expected {FEWEST_SAMPLES} to {_MOST}, got {samples}")
        new, logs = prior.draw(rng, samples)
        return cls(prior=prior, table=table, strokes=0.0, new=new, growths=np.zeros_like(new), logs=logs)

    @property
    def clearances(self) -> Array:
        """(s, p) [m]."""
        return self.new + self.growths

    def growths_after(self, strokes: Array, noise: Array) -> Array:
        """Return (n, s, p) growths of the clearances after as many strokes (n,) altogether [m].

        Args:
            strokes: none before those already done.
            noise: (s, p) standard normal numbers, of the scatter of the growth [1].
        """
        exposure = (strokes[:, None, None] - self.strokes) * np.exp(self.logs)
        mean = self.table.grown(self.growths, exposure)
        return np.maximum(mean + self.prior.growth_deviation(mean - self.growths) * noise, 0.0)

    def forecast(self, strokes: Array, noise: Array) -> Array:
        """Return (n, s, p) clearances after as many strokes (n,) altogether [m]; see ``growths_after``."""
        return self.new + self.growths_after(strokes, noise)

    def at(self, strokes: float, rng: np.random.Generator) -> Belief:
        """Return what is known after more strokes, without a measurement."""
        noise = rng.standard_normal(self.clearances.shape)
        return attrs.evolve(self, strokes=strokes, growths=self.growths_after(np.array([strokes]), noise)[0])

    def thinned(self, samples: int, rng: np.random.Generator) -> Belief:
        """Return what is known with fewer samples, drawn from these."""
        rows = rng.choice(len(self.new), samples, replace=False)
        return attrs.evolve(self, new=self.new[rows], growths=self.growths[rows], logs=self.logs[rows])

    def updated(self, strokes: float, measured: Measured, rng: np.random.Generator) -> Belief:
        """Return what is known after a check.

        Args:
            strokes: at which it was made.
            measured: by it.
            rng: for the samples.

        Raises:
            InvalidValueError: the check is earlier than what is known, or its errors have no covariance.
        """
        if strokes < self.strokes:
            raise InvalidValueError(f"strokes: expected at least {self.strokes:g}, got {strokes:g}")
        state = np.concatenate([self.new, self.growths, self.logs], axis=-1)
        p, (count, size) = self.new.shape[1], state.shape
        mean, factor = state.mean(axis=0), _root(np.cov(state, rowvar=False))
        try:
            whiten = np.linalg.inv(np.linalg.cholesky(measured.covariance))
        except np.linalg.LinAlgError:
            raise InvalidValueError("measured: expected a positive definite covariance") from None

        def states(u: Array) -> tuple[Array, Array, Array]:
            """Return new clearances, growths now and logarithms, for rows of standard normal numbers (..., 4 p)."""
            before = mean + u[..., :size] @ factor.T
            new, logs = np.maximum(before[..., :p], _LEAST_CLEARANCE), before[..., 2 * p :]
            growths = np.maximum(before[..., p : 2 * p], 0.0)
            grown = self.table.grown(growths, (strokes - self.strokes) * np.exp(np.minimum(logs, 0.0)))
            now = np.maximum(grown + self.prior.growth_deviation(grown - growths) * u[..., size:], 0.0)
            return new, now, logs

        def residuals(u: Array) -> Array:
            new, growths, _ = states(u)
            misfit = measured.values - measured.predicted(new, growths)
            return np.concatenate([u, misfit @ whiten.T], axis=-1)

        # Walls of many shapes fit about as well: the search begins at the best of some samples.
        few = min(count, _PILOTS)
        starts = np.concatenate([np.zeros((1, size + p)), rng.standard_normal((few, size + p))])
        order = (residuals(starts) ** 2).sum(axis=-1).argsort()
        modes = [_mode(residuals, starts[row]) for row in {0, *order[:_STARTS].tolist()}]
        mode, spread = min(modes, key=lambda one: float((residuals(one[0]) ** 2).sum()))
        least = float((residuals(mode) ** 2).sum())
        for drawn in (few, few, count):
            normal = rng.standard_normal((drawn, size + p))
            scale = np.sqrt(_TAILS / rng.chisquare(_TAILS, (drawn, 1)))
            u = mode + (normal * scale) @ spread.T
            squares = (residuals(u) ** 2).sum(axis=-1)
            least = min(least, float(squares.min()))
            # The logarithm of a density of Student, without its constant.
            proposed = -0.5 * (_TAILS + size + p) * np.log1p(((normal * scale) ** 2).sum(axis=-1) / _TAILS)
            weights = -0.5 * squares - proposed
            weights = np.exp(weights - weights.max())
            weights /= weights.sum()
            # The next stage is about what this one has found, and not narrower than it was.
            mode, before = weights @ u, spread
            found = np.cov(u, rowvar=False, aweights=weights, ddof=0) + _BLEND * before @ before.T
            spread = np.linalg.cholesky(np.asarray(found, dtype=np.float64))
        u = u[_systematic_sample(weights, rng)]
        new, growths, logs = states(u)
        return attrs.evolve(self, strokes=strokes, new=new, growths=growths, logs=logs, misfit=least)

    def with_new_bearing(self, pin: int, rng: np.random.Generator) -> Belief:
        """Return what is known after a bearing was changed."""
        new, growths, logs = self.new.copy(), self.growths.copy(), self.logs.copy()
        new[:, pin], logs[:, pin] = self.prior.new_bearing(pin, self.logs, rng)
        growths[:, pin] = 0.0
        return attrs.evolve(self, new=new, growths=growths, logs=logs)

    def interval(self, level: float = 0.9) -> tuple[Array, Array]:
        """Return (2, p) the bounds between which clearances [m] and wear coefficients [m²/N] lie with a probability."""
        if not 0 < level < 1:
            raise InvalidValueError(f"level: expected a probability between 0 and 1, got {level:g}")
        bounds = (0.5 - level / 2, 0.5 + level / 2)
        return np.quantile(self.clearances, bounds, axis=0), np.exp(np.quantile(self.logs, bounds, axis=0))


# ---- inside --------------------------------------------------------------------------------------------------------


def _mode(residuals: Callable[[Array], Array], start: Array) -> tuple[Array, Array]:
    """Return where (n,), near a start, the sum of the squares of residuals is least, and a root of the covariance.

    Residuals have corners, at the states between which the walls of a life are lines: derivatives are differences over
    a good part of a standard deviation.
    """
    x, size = start, len(start)
    for _ in range(_ITERATIONS):
        steps = _DIFFERENCE * np.eye(size)
        jacobian = (residuals(x + steps) - residuals(x - steps)).T / (2 * _DIFFERENCE)
        now, information = residuals(x), jacobian.T @ jacobian
        tried = x - _PARTS[:, None] * np.linalg.solve(information, jacobian.T @ now)
        squares = (residuals(tried) ** 2).sum(axis=-1)
        best = int(squares.argmin())
        if squares[best] > (now**2).sum() - _STILL:
            break
        x = tried[best]
    return x, np.linalg.cholesky(np.linalg.inv(information))


def _root(covariance: Array) -> Array:
    """Return a matrix whose product with its transpose is a covariance, singular or not."""
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(safe, safe))
    return np.asarray(safe[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _systematic_sample(weights: Array, rng: np.random.Generator) -> Numbers:
    """Return as many numbers of samples as there are weights, each as often as its weight asks for."""
    total = np.cumsum(weights)
    places = (np.arange(len(weights)) + rng.random()) * (total[-1] / len(weights))
    return np.asarray(np.minimum(np.searchsorted(total, places), len(weights) - 1))
