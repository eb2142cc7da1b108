"""Cubics: from rate to rate in a given time, and through points with rates given or estimated."""

from __future__ import annotations

import numpy as np

from armwright.arrays import LARGEST, ArrayLike, exact_shape
from armwright.motion.knots import check_duration, rate_or_rest, timed_points, two_ends
from armwright.motion.trajectory import Trajectory
from armwright.tracing.scalar import Scalar


def hermite(q_last: Scalar, m_last: Scalar, q: Scalar, m: Scalar, h: Scalar) -> tuple[Scalar, ...]:
    """Return the four coefficients of the cubic with positions q and rates m at both ends of a time h [s].

    Scalars may be floats, arrays, or nodes of a graph.
    """
    slope = (q - q_last) / h
    return q_last, m_last, (3 * slope - 2 * m_last - m) / h, (m_last + m - 2 * slope) / (h * h)


def cubic(
    q_start: ArrayLike, q_goal: ArrayLike, duration: float, start: ArrayLike | None = None, end: ArrayLike | None = None
) -> Trajectory:
    """Return the cubic from one configuration to another; at rest at both ends, unless rates are given.

    Args:
        q_start: (n,) joint positions [rad] or [m].
        q_goal: (n,) joint positions.
        duration: [s], a billionth or more.
        start: (n,) rate at the start; 0 when left out.
        end: (n,) rate at the end; 0 when left out.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: positions or rates are not (n,).
        InvalidValueError: a number is NaN or infinite, or the duration too short.

    Source:
        Craig, "Introduction to Robotics", cubic polynomials.
    """
    duration = check_duration(duration)
    here, goal = two_ends(q_start, q_goal)
    first, last = rate_or_rest(start, len(here), "start"), rate_or_rest(end, len(here), "end")
    return Trajectory(times=(0.0, duration), coefficients=np.stack(hermite(here, first, goal, last, duration))[None])


def cubic_through(times: ArrayLike, points: ArrayLike, rates: ArrayLike | None = None) -> Trajectory:
    """Return cubics through points: position and speed continuous, the acceleration may jump at a point.

    Args:
        times: (k,) of the points, rising from 0 [s].
        points: (k, n) joint positions.
        rates: (k, n) at the points. When left out, a joint rests at both ends, and where it reverses; elsewhere it
            has the mean of the slopes of the paths before and after. ``xspline`` chooses better rates, which follow
            a curve to the fourth order.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two points, or shapes that do not fit.
        InvalidValueError: times do not rise from 0, or a number is not finite.

    Source:
        Craig, "Introduction to Robotics", cubic polynomials for a path with via points.
    """
    t, q = timed_points("cubics", times, points)
    h = np.diff(t)[:, None]
    if rates is None:
        slopes = np.diff(q, axis=0) / h
        m = np.zeros_like(q)
        m[1:-1] = np.where(slopes[:-1] * slopes[1:] > 0, (slopes[:-1] + slopes[1:]) / 2, 0.0)
    else:
        m = exact_shape(rates, q.shape, "rates", LARGEST)
    return Trajectory(times=t, coefficients=np.stack(hermite(q[:-1], m[:-1], q[1:], m[1:], h), axis=1))
