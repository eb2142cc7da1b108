"""How many cycles until the play of worn joints makes an arm's repeatability too large."""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, floats, integer, joint_array, one_or_each, positive, read_only
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.jacobians import jacobian

# Visits of a pose from which its repeatability follows.
_VISITS = 20_000


def _numbers(value: ArrayLike) -> Array:
    return read_only(floats(value, "wear rates"))


@attrs.frozen(kw_only=True, eq=False)
class WearRates:
    """How fast the plays of joints grow, and how well that is known.

    Attributes:
        median: (n,) median growth of each joint's play per cycle [rad] or [m].
        spread: (n,) standard deviation of the logarithm of the growth.
    """

    median: Array = attrs.field(converter=_numbers)
    spread: Array = attrs.field(converter=_numbers)

    def __attrs_post_init__(self) -> None:
        """Refuse rates that no wear has."""
        if self.median.ndim != 1 or self.median.shape != self.spread.shape:
            raise ShapeError(f"wear rates: expected (n,) each, got {self.median.shape} and {self.spread.shape}")
        if (self.median < 0).any() or (self.spread < 0).any():
            raise InvalidValueError("wear rates: expected 0 or more")

    def sample(self, count: int, rng: np.random.Generator) -> Array:
        """Return (count, n) random rates."""
        return np.asarray(self.median * np.exp(self.spread * rng.normal(size=(count, len(self.median)))))


class PlayLife(NamedTuple):
    """Lives of random arms until their repeatability passes a limit.

    Attributes:
        cycles: (samples,) until the limit; infinite where the play does not grow, 0 where the new arm is beyond it.
        repeatability: (p,) of the new arm at each pose [m].
        factors: (p,) repeatability of each pose by the root of the trace of its covariance.
        shares: (n,) part of each joint in the variance at the pose that passes the limit first, at the median life.
        pose: that pose, from 0.
        rates: (samples, n) growth of each joint's play per cycle [rad] or [m].
    """

    cycles: Array
    repeatability: Array
    factors: Array
    shares: Array
    pose: int
    rates: Array

    def quantile(self, part: float) -> float:
        """Return the cycles that this part of the arms does not reach."""
        if not 0 <= part <= 1:
            raise InvalidValueError(f"part: expected 0 to 1, got {part:g}")
        return float(np.quantile(self.cycles, part, method="inverted_cdf"))


def repeatability_factors(arm: Arm, q: ArrayLike, play: ArrayLike, *, visits: int = _VISITS, seed: int = 0) -> Array:
    """Return RP of ISO 9283 at poses, divided by the root of the trace of the covariance, for joints with play.

    At every visit each joint rests anywhere within its play with the same probability.

    Args:
        arm: with n joints.
        q: (p, n) poses [rad] or [m].
        play: plays, one or (n,) [rad] or [m].
        visits: of each pose.
        seed: of the visits.

    Returns:
        (p,); 0 where nothing moves.
    """
    J = jacobian(arm, np.atleast_2d(joint_array(q, arm.n)))[:, :3]
    widths = one_or_each(play, arm.n, "play", "joint")
    rests = np.random.default_rng(seed).uniform(-0.5, 0.5, size=(integer(visits, "visits", least=2), arm.n)) * widths
    factors = np.zeros(len(J))
    for p, each in enumerate(J):
        lengths = np.linalg.norm(rests @ each.T, axis=1)
        root = np.sqrt(_trace(each[None], widths**2)[0])
        factors[p] = (lengths.mean() + 3 * lengths.std()) / root if root else 0.0
    return factors


def play_life(
    arm: Arm, q: ArrayLike, play: ArrayLike, rates: WearRates, limit: float, *, samples: int = 2000, seed: int = 0
) -> PlayLife:
    """Return how many cycles random arms live until the repeatability at any pose passes a limit.

    The play p of a joint grows from its first value by its rate in every cycle. With play spread evenly, RP at a pose
    is a factor times the root of the trace of J diag(p²/12) Jᵀ, which is a quadratic equation in the cycles.

    Args:
        arm: with n joints.
        q: (p, n) poses at which the repeatability counts [rad] or [m].
        play: plays of the new arm, one or (n,) [rad] or [m].
        rates: of their growth.
        limit: of the repeatability [m].
        samples: how many arms are drawn.
        seed: of the sample.

    Raises:
        ShapeError: an array does not fit the arm.
        InvalidValueError: a number is out of its range.
    """
    configurations = np.atleast_2d(joint_array(q, arm.n))
    first, limit = one_or_each(play, arm.n, "play", "joint"), positive(limit, "limit", "m")
    if (first < 0).any():
        raise InvalidValueError("play: expected 0 or more")
    if len(rates.median) != arm.n:
        raise ShapeError(f"rates: expected one per joint, {arm.n}, got {len(rates.median)}")
    J = jacobian(arm, configurations)[:, :3]
    drawn = rates.sample(integer(samples, "samples", least=1), np.random.default_rng(seed))
    squares = (J**2).sum(axis=1)  # (p, n)
    # The factor depends on how play is shared among the joints: that of the worn arm counts where it fails.
    worn = first.copy()
    for _ in range(3):
        factors = repeatability_factors(arm, configurations, worn if worn.any() else rates.median, seed=seed)
        lives = _lives(squares, first, drawn, factors, limit)
        middle = float(np.quantile(lives.min(axis=1), 0.5, method="inverted_cdf"))
        worn = first + rates.median * (middle if np.isfinite(middle) else 0.0)
    cycles = lives.min(axis=1)
    pose = int(np.bincount(lives.argmin(axis=1), minlength=len(J)).argmax())
    variances = squares[pose] * worn**2
    new = repeatability_factors(arm, configurations, first, seed=seed) * np.sqrt(_trace(J, first**2))
    shares = variances / max(float(variances.sum()), np.finfo(float).tiny)
    return PlayLife(cycles, new, factors, shares, pose, drawn)


def _trace(J: Array, squares: Array) -> Array:
    """Return the trace of the covariance of positions for plays whose squares are given."""
    return np.asarray((J**2).sum(axis=1) @ squares / 12)


def _lives(squares: Array, first: Array, rates: Array, factors: Array, limit: float) -> Array:
    """Return (samples, p) cycles until the repeatability at each pose passes the limit."""
    a, b = rates**2 @ squares.T, (rates * first) @ squares.T
    c = first**2 @ squares.T - 12 * (limit / np.where(factors > 0, factors, 1.0)) ** 2
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        cycles = np.where(a > 0, -c / (b + root), np.inf)
    return np.asarray(np.where(c >= 0, 0.0, np.where(np.isnan(cycles), np.inf, cycles)))
