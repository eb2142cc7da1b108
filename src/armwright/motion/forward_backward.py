"""The largest x = s'² along a path under bounds |a u + b x + c| <= 1 with u = s'' constant on every interval.

Two passes: backward, from the end, the largest x from which the end can still be reached, by the one linear inequality
that each bound makes of what comes after; forward, from the start, the largest u that stays below them. Standing still,
x = u = 0, keeps all bounds, so there is always a path.
"""

from __future__ import annotations

import logging
import math
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.extras import import_extra
from armwright.tracing.loops import Loops, Runner, Table, with_numpy
from armwright.tracing.scalar import Scalar, larger, select, smaller

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

    a: Any
    b: Any
    c: Any


def largest_squares(bounds: Bounds, lengths: Array, rests: tuple[bool, bool], run: Runner = with_numpy) -> Array:
    """Return the largest x at the ends of the intervals (N + 1,).

    Args:
        bounds: on every interval.
        lengths: (N,) of the intervals.
        rests: whether x may be anything at the start and at the end; else it is 0.
        run: runs the routine.

    Source:
        Pham & Pham, "A new approach to time-optimal path parameterization based on reachability analysis" (2018).
    """
    ends = np.where(rests, UNBOUNDED, 0.0)
    return run(_largest_squares, [*bounds, lengths, ends], (len(lengths) + 1,))[0]


def _largest_squares(loops: Loops, *tables: Table) -> None:
    """Write the largest x at the ends of the intervals, given bounds, lengths, and the largest at both ends of all."""
    a, b, c, lengths, ends, x = tables
    write_largest_squares(loops, Bounds(a, b, c), lengths, (ends[0], ends[1]), x)


class Nothing:
    """A table of zeros."""

    def __getitem__(self, key: Scalar) -> float:
        """Return 0."""
        return 0.0


def write_largest_squares(loops: Loops, bounds: Bounds, lengths: Table, ends: tuple[Scalar, Scalar], x: Table) -> None:
    """Write the largest x (N + 1,) as ``largest_squares`` returns them.

    Args:
        loops: the loops of a routine.
        bounds: tables of the bounds.
        lengths: table of the lengths of the intervals.
        ends: the largest x that there may be at the start and at the end.
        x: the table to write.
    """
    a, b, c = bounds
    intervals, rows = a.shape
    sides = _sides(loops, a, b, c)
    # Of each interval by itself, all at once.
    (own,) = loops.each([intervals], lambda i: [_largest(loops, sides, i, lengths[i])])

    # Some u must not lead beyond what comes after: (lower - lean x) 2 h + x <= after, for each lower bound.
    def by_after(i: Scalar, r: Scalar) -> list[Scalar]:
        twice = 2 * lengths[i]
        falls = 1 - sides.lean[i, r] * twice
        part = select(falls > 0, 1 / select(falls > 0, falls, 1.0), 0.0)
        return [select(falls > 0, -sides.lower[i, r] * twice * part, math.inf), part]

    fixed, part = loops.each([intervals, rows], by_after, 2)
    reachable = loops.table(intervals + 1)
    reachable[intervals] = ends[1]

    def backward(i: Scalar, after: Scalar) -> tuple[Scalar]:
        starts, by = fixed.row(i), part.row(i)
        reached = loops.least(rows, lambda r: starts[r] + by[r] * after)
        reachable[i] = here = larger(smaller(own[i], reached), 0.0)
        return (here,)

    loops.walk(intervals, (ends[1],), backward, reverse=True)
    x[0] = smaller(reachable[0], ends[0])
    (most,) = loops.each([intervals], lambda i: [sides.least_upper(loops, i, reachable[i])])

    def forward(i: Scalar, here: Scalar) -> tuple[Scalar, ...]:
        def sought() -> tuple[Scalar]:
            upper, lean = sides.upper.row(i), sides.lean.row(i)
            return (loops.least(rows, lambda r: upper[r] - lean[r] * here),)

        (u,) = loops.when(here >= reachable[i], lambda: (most[i],), sought)
        x[i + 1] = after = larger(smaller(reachable[i + 1], here + 2 * lengths[i] * u), 0.0)
        return (after,)

    loops.walk(intervals, (x[0],), forward)


class _Sides(NamedTuple):
    """Bounds lower - lean x <= u <= upper - lean x on N intervals, (N, rows) each, and x <= top, (N,).

    A row that does not bound u is infinite.
    """

    upper: Table
    lower: Table
    lean: Table
    top: Table

    def least_upper(self, loops: Loops, i: Scalar, x: Scalar) -> Scalar:
        """Return the least upper bound of u on an interval at x."""
        return loops.least(self.upper.shape[1], lambda r: self.upper[i, r] - self.lean[i, r] * x)


def _sides(loops: Loops, a: Table, b: Table, c: Table) -> _Sides:
    intervals, rows = a.shape
    (most,) = loops.each([intervals], lambda i: [loops.largest(rows, lambda r: abs(a[i, r]))])

    def of_row(i: Scalar, r: Scalar) -> list[Scalar]:
        on_u, on_x = abs(a[i, r]) > _NONE * most[i], abs(b[i, r]) > 0
        side = select(a[i, r] < 0, -1.0, 1.0)
        by = select(on_u, a[i, r], 1.0)
        upper, lower = (select(on_u, (s * side - c[i, r]) / by, s * math.inf) for s in (1.0, -1.0))
        top = (1 - select(b[i, r] < 0, -1.0, 1.0) * c[i, r]) / select(on_x, abs(b[i, r]), 1.0)
        lean = select(on_u, b[i, r] / by, 0.0)
        return [upper, lower, lean, select(on_u, UNBOUNDED, select(on_x, top, UNBOUNDED))]

    upper, lower, lean, tops = loops.each([intervals, rows], of_row, 4)
    (top,) = loops.each([intervals], lambda i: [smaller(loops.least(rows, lambda r: tops[i, r]), UNBOUNDED)])
    return _Sides(upper, lower, lean, top)


def _largest(loops: Loops, sides: _Sides, i: Scalar, length: Scalar) -> Scalar:
    """Return the largest x of an interval at which there is room for u, and some u leads to an x of 0 or more.

    The room, between the least upper and the greatest lower bound, is a concave function of x that is 0 or more at
    x = 0: Newton's steps from the right never pass its root.
    """
    upper, lower, lean = sides.upper, sides.lower, sides.lean
    rows = upper.shape[1]

    def step(x: Scalar) -> tuple[Scalar, tuple[Scalar]]:
        high, j = loops.first_least(rows, lambda r: upper[i, r] - lean[i, r] * x)
        low, k = loops.first_largest(rows, lambda r: lower[i, r] - lean[i, r] * x)
        slope = lean[i, j] - lean[i, k]
        done = select(high - low >= -_ROUNDING * (abs(high) + abs(low)), True, slope <= 0)
        ahead = (upper[i, j] - lower[i, k]) / select(slope > 0, slope, 1.0)
        return done, (select(done, x, smaller(x, larger(ahead, 0.0))),)

    (x,) = loops.until(_ROUNDS, (sides.top[i],), step)
    rises = 1 / (2 * length)

    def from_above(r: Scalar) -> Scalar:
        more = lean[i, r] - rises
        return select(more > 0, upper[i, r] / select(more > 0, more, 1.0), math.inf)

    return smaller(x, loops.least(rows, from_above))


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
