"""The X-spline: a cubic through knots whose rate at each knot needs only the next one.

Each inner knot gives one equation for the rates m,

    a m_last + m + b m_next = a P'(t_last) + P'(t) + b P'(t_next)

with P the parabola through the knot and its two neighbours, and h the times to them. Cubics are met exactly, and
other curves to the fourth order, where

    a h_last + b h_next = h_last h_next / (h_last + h_next)

The report has b = 0: then each rate follows from the one before it and the next knot, which is what lets
``xspline_online`` plan while the arm moves. With b = h_last / 2 (h_last + h_next), as ``smooth_xspline`` has it, it is
the spline whose acceleration is continuous, which has to know all knots.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, floats, one_or_each
from armwright.errors import InvalidValueError
from armwright.motion.continuity_report import continuity
from armwright.motion.cubic_polynomials import hermite
from armwright.motion.knots import divided, limit_per_joint, rate_or_rest, timed_points
from armwright.motion.trajectory import Trajectory
from armwright.tracing.loops import Loops, Runner, Table
from armwright.tracing.scalar import Scalar, select, smaller

# Before and after a knot; and the knots beside it with itself between.
Pair: TypeAlias = tuple[Scalar, Scalar]
Triple: TypeAlias = tuple[Scalar, Scalar, Scalar]

# What this part of a rate adds to another one is lost in its digits.
_FORGOTTEN = 1e-20
# So few rows are solved sooner as a full matrix than SciPy is imported.
_FEW = 200
# New knots are put so much closer than the jump asks for, at most so many for one, so often, and so many in all.
_CLOSER, _PARTS, _ROUNDS, _MAX_PARTS = 1.05, 8, 40, 100_000


def usual_weight(steps: Pair, b: Scalar = 0.0) -> Scalar:
    """Return the a that makes the spline exact for cubics, given b; for b = 0 it is the report's."""
    h_last, h_next = steps
    return h_next / (h_last + h_next) - b * (h_next / h_last)


def right_side(slopes: Pair, steps: Pair, a: Scalar, b: Scalar) -> Scalar:
    """Return a P'(t_last) + P'(t) + b P'(t_next) of the parabola with these mean slopes before and after a knot."""
    (slope_last, slope_next), (h_last, h_next) = slopes, steps
    curve = (slope_next - slope_last) / (h_last + h_next)
    before, middle, after = slope_last - h_last * curve, slope_last + h_last * curve, slope_next + h_next * curve
    return a * before + middle + b * after


def rate_of_knot(knots: Triple, m_last: Scalar, steps: Pair) -> Scalar:
    """Return the rate at the middle one of three knots, given the rate at the first: the report's choice, b = 0.

    For equal steps h it is (q_next + 4 q - 5 q_last) / 4h - m_last / 2.
    """
    (q_last, q, q_next), (h_last, h_next) = knots, steps
    a = usual_weight(steps)
    return right_side(((q - q_last) / h_last, (q_next - q) / h_next), steps, a, 0.0) - a * m_last


def xspline(
    times: ArrayLike,
    knots: ArrayLike,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    *,
    a: ArrayLike | None = None,
    b: ArrayLike | None = None,
) -> Trajectory:
    """Return the X-spline through knots: position and speed continuous, acceleration may jump at a knot.

    The jumps are what ``continuity`` reports. For equal steps h they are -h²/3 times the fourth derivative of the curve
    that the knots are on; ``xspline_along`` chooses the steps that keep them small.

    Args:
        times: (k,) of the knots, rising from 0 [s].
        knots: (k, n) joint positions.
        start: (n,) rate at the first knot; at rest when left out.
        end: (n,) rate at the last knot; at rest when left out.
        a: parameters of the k - 2 inner knots, or one for all; when left out, what makes it exact for cubics.
        b: the same; 0 when left out.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two knots, or shapes that do not fit.
        InvalidValueError: times do not rise from 0, a number is not finite, or at some knot |a| + |b| is not below 1,
            which is what makes sure that there is one such spline and no other.

    Source:
        Clenshaw & Negus (1978); Behforooz, Papamichael & Worsey (1980); TR-83-008, "straight line motion", (26), (27).
    """
    t, q = timed_points("X-spline", times, knots, "knots")
    joints = q.shape[1]
    ends = rate_or_rest(start, joints, "start"), rate_or_rest(end, joints, "end")
    return _through(t, q, ends, *_parameters(np.diff(t), a, b))


def smooth_xspline(times: Array, knots: Array, *, rest: bool, run: Runner) -> Trajectory:
    """Return the X-spline through knots (k, n) at times (k,) whose acceleration is continuous.

    Its |a| + |b| is 1/2 at every inner knot; nothing is checked.

    Args:
        times: (k,) of the knots.
        knots: (k, n) joint positions; four knots at least where the joints do not rest.
        rest: whether the joints rest at both ends; otherwise they have the rates of the cubics through the four knots
            there.
        run: runs the routine.
    """
    h = times[1:] - times[:-1]
    b = h[:-1] / (2 * (h[:-1] + h[1:]))
    if len(times) > _FEW:
        ends = (
            (np.zeros(knots.shape[1]),) * 2
            if rest
            else (rate_at_first(times, knots), rate_at_first(times[::-1], knots[::-1]))
        )
        return _through(times, knots, ends, usual_weight((h[:-1], h[1:]), b), b)
    k, n = knots.shape
    (terms,) = run(_smooth, [times, knots, np.array([float(rest)])], (k - 1, 4, n))
    return Trajectory.of_planner(times.copy(), terms)


def _smooth(loops: Loops, times: Table, knots: Table, rest: Table, terms: Table) -> None:
    """Write the cubics of ``smooth_xspline``: the equations of inner knots are solved by elimination, row by row."""
    k, n = knots.shape
    rests = rest[0] > 0
    last, inner = k - 1, k - 2
    (h,) = loops.each([last], lambda i: [times[i + 1] - times[i]])
    (slope,) = loops.each([last, n], lambda i, j: [(knots[i + 1, j] - knots[i, j]) / h[i]])

    def rates(j: Scalar) -> list[Scalar]:
        first, final = [smaller(last, i) for i in range(4)], [last - smaller(last, i) for i in range(4)]
        return [
            select(rests, 0.0, _rate_through([times[i] for i in at], [knots[i, j] for i in at]))
            for at in (first, final)
        ]

    start, end = loops.table(n), loops.table(n)
    loops.fill([start, end], [n], rates)

    def weights(i: Scalar) -> list[Scalar]:
        b = h[i] / (2 * (h[i] + h[i + 1]))
        return [usual_weight((h[i], h[i + 1]), b), b]

    a, b = loops.each([inner], weights, 2)

    def right(i: Scalar, j: Scalar) -> list[Scalar]:
        return [right_side((slope[i, j], slope[i + 1, j]), (h[i], h[i + 1]), a[i], b[i])]

    (sides,) = loops.each([inner, n], right)
    # Each equation without the rate of the knot before: m + upper m_next = side.
    upper, pivot = loops.table(inner), loops.table(inner)

    def eliminated(i: Scalar, before: Scalar) -> tuple[Scalar]:
        pivot[i] = under = 1 - a[i] * before
        upper[i] = after = b[i] / under
        return (after,)

    loops.walk(inner, (0.0,), eliminated)
    forward = loops.follow([inner, n], lambda j: start[j], lambda i, j, m: (sides[i, j] - a[i] * m) / pivot[i])
    found = loops.follow([inner, n], lambda j: end[j], lambda i, j, m: forward[i, j] - upper[i] * m, reverse=True)
    m = loops.table(k, n)
    loops.fill([m.behind(1)], [inner, n], lambda i, j: [found[i, j]])
    loops.fill([m.part(0, 0)], [n], lambda j: [start[j]])
    loops.fill([m.part(0, last)], [n], lambda j: [end[j]])

    def of_segment(i: Scalar, j: Scalar) -> list[Scalar]:
        return list(hermite(knots[i, j], m[i, j], knots[i + 1, j], m[i + 1, j], h[i]))

    loops.fill([terms.part(1, power) for power in range(4)], [last, n], of_segment)


def _rate_through(t: list[Scalar], q: list[Scalar]) -> Scalar:
    """Return the rate at the first of four knots: that of the cubic through them, by divided differences."""
    first = [(q[i + 1] - q[i]) / (t[i + 1] - t[i]) for i in range(3)]
    second = [(first[i + 1] - first[i]) / (t[i + 2] - t[i]) for i in range(2)]
    third = (second[1] - second[0]) / (t[3] - t[0])
    return first[0] + (t[0] - t[1]) * (second[0] + (t[0] - t[2]) * third)


def xspline_along(
    curve: Callable[[Array], ArrayLike],
    times: ArrayLike,
    jump: ArrayLike,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
) -> Trajectory:
    """Return an X-spline along a curve, with knots so close that no acceleration jumps by more than allowed.

    A jump falls with the square of the step, so where it is too large the steps beside it are divided, until the
    spline keeps the bound at every knot: that is measured, not estimated.

    Args:
        curve: takes times (k,) and returns joint positions (k, n).
        times: (k,) where to begin with, rising from 0 [s]; all of them stay knots.
        jump: (n,) the largest jump of acceleration that is allowed, or one for all; infinite where any is.
        start: (n,) rate of the curve at its start; at rest when left out.
        end: (n,) rate of the curve at its end; at rest when left out.

    Returns:
        The spline; its ``times`` are those of the knots.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two knots, or shapes that do not fit.
        InvalidValueError: times do not rise from 0, a number is not finite, a bound is not above 0, or no spacing keeps
            it: with the joint, the time, the jump found and the jump allowed. That is so where the curve has a corner,
            or other rates at its ends.
    """
    spline = xspline(times, curve(floats(times, "times", LARGEST)), start, end)
    allowed = limit_per_joint(jump, spline.coefficients.shape[2], "jump")
    for _ in range(_ROUNDS):
        jumps = np.abs(continuity(spline).jumps[2, 1:-1])
        excess = (jumps / allowed).max(axis=1, initial=0.0)
        if not (excess > 1).any():
            return spline
        # A knot asks for more of both steps beside it.
        reduction = np.maximum(np.append(excess, 0.0), np.append(0.0, excess))
        parts = np.where(reduction > 1, np.clip(np.ceil(_CLOSER * np.sqrt(reduction)), 2, _PARTS), 1).astype(np.intp)
        if parts.sum() > _MAX_PARTS:
            break
        finer = divided(spline.times, parts)
        if not (np.diff(finer) > 0).all():
            break
        spline = xspline(finer, curve(finer), start, end)
    k, j = np.unravel_index(int((jumps / allowed).argmax()), jumps.shape)
    raise InvalidValueError(
        f"X-spline: with {len(spline.times)} knots the acceleration of joint {j + 1} still jumps by {jumps[k, j]:.6g} "
        f"at {spline.times[k + 1]:g} s, {allowed[j]:g} is allowed; the curve has a corner there, or its rate at the "
        "start or end differs from the specified one"
    )


def rate_at_first(t: Array, q: Array) -> Array:
    """Return the rate (n,) at the first of four knots or more: that of the cubic through them."""
    return np.asarray(_rate_through(list(t[:4]), list(q[:4])))


def _parameters(h: Array, a: ArrayLike | None, b: ArrayLike | None) -> tuple[Array, Array]:
    """Return a and b of every inner knot, (k-2,) each, with which there is one spline."""
    inner = len(h) - 1
    weight_b = np.zeros(inner) if b is None else one_or_each(b, inner, "b", "inner knot")
    weight_a = usual_weight((h[:-1], h[1:]), weight_b) if a is None else one_or_each(a, inner, "a", "inner knot")
    sums = np.abs(weight_a) + np.abs(weight_b)
    for i in np.flatnonzero(sums >= 1):
        raise InvalidValueError(
            f"X-spline: |a| + |b| must be below 1 for the spline to exist and be unique, got {sums[i]:g} at knot "
            f"{i + 1} (a = {weight_a[i]:g}, b = {weight_b[i]:g})"
        )
    return np.asarray(weight_a), weight_b


def _through(t: Array, q: Array, ends: tuple[Array, Array], a: Array, b: Array) -> Trajectory:
    """Return the spline through knots q (k, n) at times t (k,)."""
    h = t[1:] - t[:-1]
    m = _rates(h, q, ends, a, b)
    return Trajectory(times=t, coefficients=np.stack(hermite(q[:-1], m[:-1], q[1:], m[1:], h[:, None]), axis=1))


def _rates(h: Array, q: Array, ends: tuple[Array, Array], a: Array, b: Array) -> Array:
    """Return the rates (k, n) that solve the equations of all inner knots."""
    m = np.empty_like(q)
    m[0], m[-1] = ends
    if len(h) == 1:
        return m
    slope, steps = (q[1:] - q[:-1]) / h[:, None], h[:, None]
    right = right_side((slope[:-1], slope[1:]), (steps[:-1], steps[1:]), a[:, None], b[:, None])
    right[0] -= a[0] * m[0]
    right[-1] -= b[-1] * m[-1]
    m[1:-1] = _in_turn(right, a) if not b.any() else _at_once(right, a, b)
    return m


def _in_turn(right: Array, a: Array) -> Array:
    """Return the m with a m_last + m = right for all rows, the first of which has no last one.

    Rows are taken together in pairs, fours, eights: a logarithm of steps over all rows instead of one over each. As
    products of numbers below 1 vanish, few of them are needed. There is nothing to compile or to import for it.
    """
    m, factor, stride = right.copy(), -a[:, None], 1
    factor[0] = 0.0
    while stride < len(m):
        m[stride:] += factor[stride:] * m[:-stride]
        factor[stride:] = factor[stride:] * factor[:-stride]
        factor[:stride] = 0.0
        if np.abs(factor).max() < _FORGOTTEN:
            break
        stride *= 2
    return m


def _at_once(right: Array, a: Array, b: Array) -> Array:
    """Return the m with a m_last + m + b m_next = right for all rows."""
    if len(a) <= _FEW:
        return np.asarray(np.linalg.solve(np.eye(len(a)) + np.diag(a[1:], -1) + np.diag(b[:-1], 1), right))
    from scipy.linalg import solve_banded  # noqa: PLC0415 - SciPy takes longer to import than all else

    bands = np.stack([np.append(0.0, b[:-1]), np.ones(len(a)), np.append(a[1:], 0.0)])
    return np.asarray(solve_banded((1, 1), bands, right))
