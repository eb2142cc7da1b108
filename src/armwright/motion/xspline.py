"""The X-spline: a cubic through knots whose rate at each knot needs only the next one."""

import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, floats, one_per_joint
from armwright.errors import InvalidValueError, ShapeError
from armwright.motion.trajectory import Trajectory


def xspline_rates(times: ArrayLike, knots: ArrayLike, start: ArrayLike, end: ArrayLike) -> Array:
    """Return the rate at every knot, one after the other.

    With P the parabola through three neighbouring knots and a = h_next / (h_last + h_next), the rate m follows
    from a m_last + m = a P'(t_last) + P'(t). For equal steps h this is the report's

        m_i = (q_{i+1} + 4 q_i - 5 q_{i-1}) / 4h - m_{i-1} / 2

    Args:
        times: (k,) of the knots, rising [s].
        knots: (k, n) joint positions.
        start: (n,) rate at the first knot.
        end: (n,) rate at the last knot.

    Returns:
        (k, n).

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two knots, or shapes that do not fit.
        InvalidValueError: times do not rise, or a number is not finite.

    Source:
        Clenshaw & Negus (1978); Behforooz, Papamichael & Worsey (1980); TR-83-008, "straight line motion".
    """
    t, q = _knots(times, knots)
    h = np.diff(t)
    if (h <= 0).any():
        i = int(np.argmax(h <= 0))
        raise InvalidValueError(f"X-spline: times must rise, got {t[i]:g} s and then {t[i + 1]:g} s at knot {i + 1}")
    slope = np.diff(q, axis=0) / h[:, None]
    rates = np.empty_like(q)
    rates[0] = one_per_joint(start, q.shape[1], "start")
    for i in range(1, len(t) - 1):
        last, coming = h[i - 1], h[i]
        a = coming / (last + coming)
        curve = (slope[i] - slope[i - 1]) / (last + coming)
        rates[i] = a * (slope[i - 1] - last * curve) + (slope[i - 1] + last * curve) - a * rates[i - 1]
    rates[-1] = one_per_joint(end, q.shape[1], "end")
    return rates


def xspline(
    times: ArrayLike, knots: ArrayLike, start: ArrayLike | None = None, end: ArrayLike | None = None
) -> Trajectory:
    """Return the X-spline through knots: position and speed continuous, acceleration may jump at a knot.

    Args:
        times: (k,) of the knots, rising from 0 [s].
        knots: (k, n) joint positions.
        start: (n,) rate at the first knot; at rest when left out.
        end: (n,) rate at the last knot; at rest when left out.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two knots, or shapes that do not fit.
        InvalidValueError: times do not rise from 0, or a number is not finite.
    """
    t, q = _knots(times, knots)
    rest = np.zeros(q.shape[-1])
    m = xspline_rates(t, q, rest if start is None else start, rest if end is None else end)
    h = np.diff(t)[:, None]
    slope = np.diff(q, axis=0) / h
    bend = (3 * slope - 2 * m[:-1] - m[1:]) / h
    twist = (m[:-1] + m[1:] - 2 * slope) / h**2
    return Trajectory(times=t, coefficients=np.stack([q[:-1], m[:-1], bend, twist], axis=1))


def _knots(times: ArrayLike, knots: ArrayLike) -> tuple[Array, Array]:
    """Return times (k,) and knots (k, n), two at least."""
    t, q = floats(times, "times", LARGEST), floats(knots, "knots", LARGEST)
    if t.ndim != 1 or q.ndim != 2 or len(t) != len(q) or len(t) < 2 or not q.size:
        raise ShapeError(f"X-spline: expected k times and (k, n) knots with k at least 2, got {t.shape} and {q.shape}")
    return t, q
