"""A controlled stop: from any moment of a motion to rest, without a jump of position, speed or acceleration."""

import math

import numpy as np
from numpy.polynomial import Polynomial

from armwright.arrays import Array, ArrayLike, number, one_per_joint
from armwright.errors import InvalidValueError
from armwright.motion.trajectory import Trajectory

# A joint that accelerates is not brought to rest sooner: its acceleration has to fade [s].
_SETTLE = 0.02
# No stop is shorter, so that it is no step [s].
_SHORTEST = 1e-4
# How finely the shortest stop is looked for, as a ratio of one time to the next.
_FINER = 1.02


def brake(running: Trajectory, t: float, acceleration: ArrayLike, *, period: float | None = None) -> Trajectory:
    """Return the motion that stops an arm.

    Every joint stops by itself, as soon as its limit allows: its acceleration goes from what it has to zero as a
    parabola whose peak is the limit.

    Args:
        running: the motion to be stopped.
        t: when [s], within it.
        acceleration: largest accelerations (n,) [rad/s²] or [m/s²]; a joint that accelerates more at ``t`` may go on
            with as much.
        period: of the servo [s], to last a whole number of them; any duration when left out.

    Raises:
        InvalidValueError: ``t`` is outside the motion, or an acceleration is not above 0.
    """
    if not 0 <= number(t, "t") <= running.duration:
        raise InvalidValueError(f"t: expected 0 to {running.duration:g} s, got {t:g}")
    q, qd, qdd = (running(t, order) for order in range(3))
    limit = one_per_joint(acceleration, len(q), "acceleration")
    if not (limit > 0).all():
        raise InvalidValueError(f"acceleration: expected more than 0 for every joint, got {limit.min():g}")
    stops = [_stop(*state) for state in zip(q.tolist(), qd.tolist(), qdd.tolist(), limit.tolist(), strict=True)]
    knots = sorted({0.0, *(time for time, _ in stops)})
    if period is not None or len(knots) == 1:
        tick = period or _SETTLE
        knots.append(max(1, math.ceil(knots[-1] / tick - 1e-9)) * tick)
        if knots[-1] - knots[-2] < 1e-9:
            knots[-2:] = [knots[-1]]
    coefficients = np.zeros((len(knots) - 1, 5, len(q)))
    for segment, start in enumerate(knots[:-1]):
        for joint, (time, polynomial) in enumerate(stops):
            coefficients[segment, :, joint] = _from(polynomial, start, time)
    return Trajectory(times=np.array(knots), coefficients=coefficients)


def _stop(q: float, qd: float, qdd: float, limit: float) -> tuple[float, Polynomial]:
    """Return how long one joint takes to stop, and its position until then."""
    if qd == 0 and qdd == 0:
        return 0.0, Polynomial([q])
    most = max(limit, abs(qdd))
    time = max(0.5 * abs(qd) / most, _SETTLE if qdd else _SHORTEST)
    while _peak(qd, qdd, time) > most * (1 + 1e-9):
        time *= _FINER
    c = -6 * qd / time - 2 * qdd
    return time, Polynomial([q, qd, qdd / 2, (c - 2 * qdd) / (6 * time), (qdd - c) / (12 * time**2)])


def _peak(qd: float, qdd: float, time: float) -> float:
    """Return the largest acceleration of a stop: a parabola from ``qdd`` to 0 whose integral is ``-qd``."""
    c = -6 * qd / time - 2 * qdd
    bend = qdd - c
    at = (2 * qdd - c) / (2 * bend) if bend else 0.0
    inside = qdd + (c - 2 * qdd) * at + bend * at**2 if 0 < at < 1 else 0.0
    return max(abs(qdd), abs(inside))


def _from(polynomial: Polynomial, start: float, end: float) -> Array:
    """Return the five coefficients of a joint's position from some time on; behind its end it rests."""
    if start >= end:
        rest = polynomial(end)
        return np.array([rest, 0.0, 0.0, 0.0, 0.0])
    shifted = polynomial(Polynomial([start, 1.0])).coef
    return np.concatenate([shifted, np.zeros(5 - len(shifted))])
