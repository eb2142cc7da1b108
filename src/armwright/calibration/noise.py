"""How far readings are off by chance, which are off by more, and how much each counts for that.

Source:
    Holland & Welsch (1977) for weights of readings that are off.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from armwright.arrays import Array, Flags
from armwright.calibration.measurement_model import Residuals
from armwright.calibration.readings import Numbers

# Readings that are off by more than this part of all are by their noise count less: three deviations of one number.
_USUAL = 0.9973
# Those that are off by twice as much as that are outliers. In the end they do not count at all.
_OUTLYING = 2.0


class Noise(NamedTuple):
    """Standard deviations of what is measured.

    Attributes:
        length: of a coordinate or a distance [m].
        turn: of a turn about one axis [rad].
    """

    length: float
    turn: float


# What a laser tracker has, for want of better; and what rounding has.
TYPICAL, LEAST = Noise(1e-4, 5e-4), Noise(1e-9, 1e-9)
# With fewer numbers to spare, lengths and turns are not told apart: what is left of one kind can be next to nothing.
_FEW = 30


def length_scales(rows: Residuals, noise: Noise) -> Array:
    """Return (r,) what makes lengths of all numbers, by which they are weighed against one another [1], [m/rad]."""
    return np.where(rows.turning, noise.length / noise.turn, 1.0)


def robust_weights(rows: Residuals, noise: Noise, *, strict: bool) -> Array:
    """Return (r,) by how much readings that are off count less: the root of the weight that soft L1 gives them.

    If strict, outliers do not count.
    """
    square, size = _by_reading(rows.of, rows.off / _deviation(rows, noise))
    root = (1 + square / _limit(size)) ** -0.25
    if strict:
        root[_outlying(square, size)] = 0.0
    return np.asarray(root[rows.of], dtype=np.float64)


def median_noise(rows: Residuals, fitted: int) -> Noise:
    """Return the noise as half of the readings say, whatever the others are.

    Args:
        rows: what is left.
        fitted: how many errors were fitted to them.
    """
    return _noise(rows, np.ones(len(rows.off), dtype=np.bool_), len(rows.off) - fitted, _spread)


def noise_and_outliers(rows: Residuals, readings: int, fitted: int, *, robust: bool) -> tuple[Noise, Flags, int]:
    """Return the noise, which of so many readings are outliers, and how many numbers there are to spare.

    Args:
        rows: what is left.
        readings: how many there are.
        fitted: how many errors were fitted to them.
        robust: whether some may be outliers.
    """
    outlying = np.zeros(readings, dtype=np.bool_)
    counted = np.ones(len(rows.off), dtype=np.bool_)
    # Twice: outliers are told by the noise, and the noise by what are none.
    for _ in range(2):
        freedom = max(1, int(counted.sum()) - fitted)
        more = float(np.sqrt(counted.sum() / freedom))
        noise = _noise(rows, counted, freedom, partial(_usual, more=more, robust=robust))
        if robust:
            outlying = _outlying(*_by_reading(rows.of, rows.off / _deviation(rows, noise)))
            counted = ~outlying[rows.of]
    return noise, outlying, max(1, int(counted.sum()) - fitted)


# ---- inside --------------------------------------------------------------------------------------------------------


def _deviation(rows: Residuals, noise: Noise) -> Array:
    return np.where(rows.turning, noise.turn, noise.length)


def _noise(rows: Residuals, counted: Flags, freedom: int, spread: Callable[[Numbers, Array], float]) -> Noise:
    """Return the noise of lengths and turns by the same rule; with few numbers to spare, of both together."""
    if freedom < _FEW:
        common = spread(rows.of[counted], (rows.off / _deviation(rows, TYPICAL))[counted])
        return Noise(*(max(common * typical, least) for typical, least in zip(TYPICAL, LEAST, strict=True)))
    kinds = (~rows.turning & counted, rows.turning & counted)
    return Noise(*(max(spread(rows.of[kind], rows.off[kind]), least) for kind, least in zip(kinds, LEAST, strict=True)))


def _by_reading(of: Numbers, off: Array) -> tuple[Array, Array]:
    """Return by reading the sum of the squares of its numbers, and how many they are; 0 of those between."""
    square, size = np.bincount(of, off**2), np.bincount(of)
    return np.asarray(square, dtype=np.float64), np.asarray(size, dtype=np.float64)


def _limit(size: Array) -> Array:
    """Return what the squares of so many numbers of a normal distribution usually stay below."""
    return np.asarray(chi2.ppf(_USUAL, np.maximum(size, 1)), dtype=np.float64)


def _outlying(square: Array, size: Array) -> Flags:
    """Return which readings are outliers, by the squares of so many numbers each, in deviations."""
    return np.asarray(square > _OUTLYING**2 * _limit(size), dtype=np.bool_)


def _usual(of: Numbers, off: Array, *, more: float, robust: bool) -> float:
    """Return the root of the mean square of some numbers, without those of readings that are far off.

    It is ``more`` times as large as that of the numbers, which what was fitted to them has made smaller.
    """
    if not len(off):
        return 0.0
    if not robust:
        return float(np.sqrt(np.mean(off**2))) * more
    square, size = _there(of, off)
    limit = _limit(size)
    near = square <= limit * (_spread(of, off) * more) ** 2
    # What is cut off of a normal distribution would have made the mean larger.
    within = chi2.cdf(limit, size + 2) / np.maximum(chi2.cdf(limit, size), _USUAL)
    left, count = square[near].sum(), (size * within)[near].sum()
    return float(np.sqrt(left / count)) * more if count else 0.0


def _spread(of: Numbers, off: Array) -> float:
    """Return the standard deviation of numbers about 0 as half of the readings say, which outliers do not move."""
    square, size = _there(of, off)
    return float(np.sqrt(np.median(square / chi2.ppf(0.5, size)))) if len(size) else 0.0


def _there(of: Numbers, off: Array) -> tuple[Array, Array]:
    """Return the same of those readings that have numbers at all."""
    square, size = _by_reading(of, off)
    return square[size > 0], size[size > 0]
