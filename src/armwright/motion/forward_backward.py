"""The largest x = s'² along a path under bounds |a u + b x + c| <= 1 with u = s'' constant on every interval.

Two passes: backward, from the end, the largest x from which the end can still be reached; forward, from the start, the
largest u that stays below them. Standing still, x = u = 0, keeps all bounds, so there is always a path.
"""

from __future__ import annotations

import logging
import math
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.extras import import_extra

# The largest x there is, where nothing binds. The solver of toppra loses its path among numbers so far apart.
UNBOUNDED = 1e12
_MAX_OF_TOPPRA = 1e3
# A coefficient of u this much smaller than the largest is 0.
_NONE = 1e-12
# Bounds may be passed by this much: rounding.
_ROUNDING = 1e-12
_ROUNDS = 100


class Bounds(NamedTuple):
    """Bounds |a u + b x + c| <= 1 on each of N intervals, x at its start; (N, rows) each, with |c| < 1."""

    a: Array
    b: Array
    c: Array


def largest_squares(bounds: Bounds, lengths: Array, rests: tuple[bool, bool]) -> Array:
    """Return the largest x at the ends of the intervals (N + 1,).

    Args:
        bounds: on every interval.
        lengths: (N,) of the intervals.
        rests: whether x may be anything at the start and at the end; else it is 0.

    Source:
        Pham & Pham, "A new approach to time-optimal path parameterization based on reachability analysis" (2018).
    """
    sides, twice = _sides(bounds), (2 * lengths).tolist()
    reachable = [0.0] * (len(twice) + 1)
    reachable[-1] = UNBOUNDED if rests[1] else 0.0
    top, top_highs, top_lows = sides.top.tolist(), *sides.room(sides.top)
    for i in reversed(range(len(twice))):
        # Mostly the end is reached from the largest x of all.
        by_end = 1 / twice[i] * top[i]
        high, low = min(top_highs[i], reachable[i + 1] / twice[i] - by_end), max(top_lows[i], -by_end)
        if high - low >= -_ROUNDING * (abs(high) + abs(low)):
            reachable[i] = top[i]
        else:
            reachable[i] = _largest(sides, i, twice[i], reachable[i + 1])
    x = [reachable[0] if rests[0] else 0.0]
    most, _ = sides.room(np.array(reachable[:-1]))
    uppers, leans = list(sides.upper[:, 1:]), list(sides.lean[:, 1:])
    for i in range(len(twice)):
        u = most[i] if x[i] == reachable[i] else float(np.minimum.reduce(uppers[i] - leans[i] * x[i]))
        x.append(max(0.0, min(reachable[i + 1], x[i] + twice[i] * u)))
    return np.array(x)


class _Sides(NamedTuple):
    """Bounds lower - lean x <= u <= upper - lean x on N intervals, (N, rows + 1) each, and x <= top, (N,).

    The first column is kept for what comes after an interval. A row that does not bound u is infinite.
    """

    upper: Array
    lower: Array
    lean: Array
    top: Array

    def room(self, x: Array) -> tuple[list[float], list[float]]:
        """Return the least upper and the greatest lower bounds of u on every interval at x (N,)."""
        by_x = self.lean[:, 1:] * x[:, None]
        return (self.upper[:, 1:] - by_x).min(axis=1).tolist(), (self.lower[:, 1:] - by_x).max(axis=1).tolist()


def _sides(bounds: Bounds) -> _Sides:
    blank = np.zeros((len(bounds.a), 1))
    a, b, c = (np.concatenate([blank, each], axis=1) for each in bounds)
    on_u = np.abs(a) > _NONE * np.abs(a).max(axis=1, keepdims=True)
    side = np.sign(a)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        upper, lower = np.where(on_u, (side - c) / a, np.inf), np.where(on_u, (-side - c) / a, -np.inf)
        tops = np.where(on_u | (b == 0), UNBOUNDED, (1 - np.sign(b) * c) / np.abs(b))
        lean = np.where(on_u, b / a, 0.0)
    return _Sides(upper, lower, lean, np.minimum(tops.min(axis=1), UNBOUNDED))


def _largest(sides: _Sides, i: int, twice: float, reachable: float) -> float:
    """Return the largest x of an interval from which some u leads to an x between 0 and ``reachable`` at its end.

    The room for u, between its least upper and its greatest lower bound, is a concave function of x that is 0 or more
    at x = 0: Newton's steps from the right never pass its root.
    """
    upper, lower, lean = sides.upper[i], sides.lower[i], sides.lean[i]
    upper[0], lower[0], lean[0] = reachable / twice, 0.0, 1 / twice
    x = float(sides.top[i])
    for _ in range(_ROUNDS):
        by_x = lean * x
        highs, lows = upper - by_x, lower - by_x
        j, k = int(highs.argmin()), int(lows.argmax())
        room, size = float(highs[j] - lows[k]), float(abs(highs[j]) + abs(lows[k]))
        slope = float(lean[j] - lean[k])
        if room >= -_ROUNDING * size or slope <= 0:
            break
        x = min(x, max(0.0, float(upper[j] - lower[k]) / slope))
    return x


def by_toppra(bounds: Bounds, lengths: Array, rests: tuple[bool, bool]) -> Array:
    """Return the same as ``largest_squares``, found by toppra and its solver of linear programs.

    Raises:
        ArmwrightError: its solver gives up, as it does for some problems that have a solution.
        MissingExtraError: toppra is not installed.
    """
    algorithm = import_extra("toppra.algorithm", "method='toppra'", "optimal")
    constraint = import_extra("toppra.constraint", "method='toppra'", "optimal")
    logging.getLogger("toppra").setLevel(logging.CRITICAL)  # what goes wrong is reported by errors
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    rows = bounds.a.shape[1]
    params = (
        *(np.concatenate([array, array[-1:]]) for array in bounds),
        np.concatenate([np.eye(rows), -np.eye(rows)]),
        np.ones(2 * rows),
        None,
        np.tile((0.0, _MAX_OF_TOPPRA), (len(s), 1)),
    )
    limits = constraint.LinearConstraint()
    limits.identical = True
    limits.compute_constraint_params = lambda *_arguments: params
    run = algorithm.TOPPRA([limits], SimpleNamespace(path_interval=s[[0, -1]]), gridpoints=s, solver_wrapper="seidel")
    sets = run.compute_controllable_sets(0.0, math.sqrt(_MAX_OF_TOPPRA) if rests[1] else 0.0)
    sd = None
    if not np.isnan(sets).any():
        run.compute_controllable_sets = lambda *_ends: sets  # an end that is left free is not among its arguments
        _, sd, _ = run.compute_parameterization(math.sqrt(sets[0, 1]) if rests[0] else 0.0, 0.0)
    if sd is None or np.isnan(sd).any():
        raise ArmwrightError(
            "toppra's solver of linear programs failed, as it does for some feasible problems: omit method=, or use "
            "another number of intervals"
        )
    return np.asarray(sd**2, dtype=np.float64)
