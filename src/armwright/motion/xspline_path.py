"""The X-spline: a cubic through knots whose rate at each knot needs only the next one.

Each inner knot gives one equation for the rates m,

    a m_last + m + b m_next = a P'(t_last) + P'(t) + b P'(t_next)

with P the parabola through the knot and its two neighbours, and h the times to them. Cubics are met exactly, and
other curves to the fourth order, where

    a h_last + b h_next = h_last h_next / (h_last + h_next)

The report has b = 0: then each rate follows from the one before it and the next knot, which is what lets
``xspline_online`` plan while the arm moves. With ``smooth_weight``, b = h_last / 2 (h_last + h_next), it is the spline
whose acceleration is continuous, which has to know all knots.
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
from armwright.tracing.scalar import Scalar

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


def smooth_weight(times: Array) -> Array:
    """Return the b of every inner knot with which the acceleration is continuous, (k - 2,), for times (k,)."""
    h = times[1:] - times[:-1]
    return np.asarray(h[:-1] / (2 * (h[:-1] + h[1:])))


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


def smooth_xspline(times: Array, knots: Array, start: Array, end: Array) -> Trajectory:
    """Return the X-spline of ``smooth_weight`` through knots (k, n) at times (k,), with rates (n,) at its ends.

    Its |a| + |b| is 1/2 at every knot; nothing is checked.
    """
    h, b = times[1:] - times[:-1], smooth_weight(times)
    return _through(times, knots, (start, end), usual_weight((h[:-1], h[1:]), b), b)


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
