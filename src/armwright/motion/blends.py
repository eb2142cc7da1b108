"""Straight segments from point to point, joined by blends of the fourth degree: Paul's method through via points.

The path does not go through the via points: it leaves the straight segment a time ``blend`` before a point and is on
the next one a time ``blend`` after it. Position, speed and acceleration are continuous.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, floats, one_or_each
from armwright.errors import InvalidValueError, ShapeError, one_of
from armwright.motion.knots import NOWHERE, limit_per_joint, timed_points
from armwright.motion.polynomials import evaluate, turning_times
from armwright.motion.trajectory import Trajectory

Ends: TypeAlias = Literal["rest", "running"]

# Of a blend whose speed changes by 1 in a half-width of 1: its peak acceleration, and what it misses its point by.
PEAK_ACCELERATION = 3 / 4
MISS = 3 / 16
# Blends that overlap by this part of their segment only touch.
_ROUNDING = 1e-12


class BlendPlan(NamedTuple):
    """Segments and blends between k points.

    Attributes:
        centres: (k,) when blends are half over; a point is on both of the segments that meet there then [s].
        blend: (k,) half-widths [s]; 0 where there is none.
        points: (k, n).
        before: (k, n) rate before each blend.
        after: (k, n) rate after it.
        end: when the last point is reached [s].
    """

    centres: Array
    blend: Array
    points: Array
    before: Array
    after: Array
    end: float


def blended(times: ArrayLike, points: ArrayLike, blend: ArrayLike, *, ends: Ends = "rest") -> Trajectory:
    """Return straight segments through points at constant rates, joined by blends at every via point.

    With h = (t - t_via + blend) / (2 blend) a blend is a0 + a1 h + a3 h³ + a4 h⁴, where a0 is where it leaves the
    straight segment, a1 = 2 blend · (rate before), a3 = 2 blend · (change of the rate), a4 = -a3 / 2. Speeds never pass
    those of the segments beside it; the acceleration is largest at the via point, 3/4 · (change of the rate) / blend.

    Args:
        times: (k,) when the points are passed, rising from 0 [s].
        points: (k, n) joint positions, or whatever is to be blended.
        blend: how long before and after a point the path is away from its straight segments [s], one number or (k,).
            With ends at rest the first and the last are the times in which the motion gathers speed and loses it;
            running ends have none, and theirs do not count.
        ends: ``rest`` starts and stops, by blends from and to standing still, in the given time: the first and the
            last segment are run a little faster for it. ``running`` starts and stops at full speed.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two points, or shapes that do not fit.
        InvalidValueError: times do not rise from 0, a blend is not above 0, a number is not finite, or blends overlap:
            with the segment, the time they need and the time it has.
        UnknownNameError: no such kind of ends.

    Source:
        Paul, "Manipulator Cartesian path control" (1979); for the ends Craig, "Introduction to Robotics", linear
        functions with blends for a path with via points.
    """
    plan = blend_plan(times, points, blend, ends)
    b = plan.blend[:, None]
    change = plan.after - plan.before
    count, joints = plan.points.shape
    coefficients = np.zeros((2 * count - 1, 5, joints))
    curves, lines = coefficients[::2], coefficients[1::2]
    curves[:, 0], curves[:, 1] = plan.points - plan.before * b, plan.before
    with np.errstate(divide="ignore", invalid="ignore"):
        curves[:, 3], curves[:, 4] = change / (4 * b**2), -change / (16 * b**3)
    lines[:, 0], lines[:, 1] = (plan.points + plan.after * b)[:-1], plan.after[:-1]
    begins = np.ravel(np.stack([plan.centres - plan.blend, plan.centres + plan.blend], axis=1))
    begins = np.clip(np.maximum.accumulate(begins), 0.0, plan.end)
    distinct = np.diff(begins) > _ROUNDING * plan.end
    inner = begins[:-1][distinct][1:]  # what comes first begins at 0, whatever of no length was left out before it
    return Trajectory(times=np.concatenate([[0.0], inner, [plan.end]]), coefficients=coefficients[distinct])


def via_deviations(times: ArrayLike, points: ArrayLike, blend: ArrayLike, *, ends: Ends = "rest") -> Array:
    """Return by how much the path misses each point when it is passed, 3/16 · blend · (change of the rate), exactly.

    Args:
        times: as for ``blended``.
        points: as for ``blended``.
        blend: as for ``blended``.
        ends: as for ``blended``.

    Returns:
        (k, n): where the path is at the time of the point, less the point; 0 at both ends.

    Raises:
        ArmwrightError: as for ``blended``.
    """
    plan = blend_plan(times, points, blend, ends)
    deviations = MISS * plan.blend[:, None] * (plan.after - plan.before)
    deviations[[0, -1]] = 0.0
    return np.asarray(deviations)


def via_distances(times: ArrayLike, points: ArrayLike, blend: ArrayLike, *, ends: Ends = "rest") -> Array:
    """Return the shortest distance at which the path passes each point, found by roots.

    It is not farther than ``via_deviations`` reports, and just as far where the rates before and after are equal in
    size.

    Args:
        times: as for ``blended``.
        points: (k, n) positions, in one unit.
        blend: as for ``blended``.
        ends: as for ``blended``.

    Returns:
        (k,), 0 at both ends.

    Raises:
        ArmwrightError: as for ``blended``.
    """
    plan = blend_plan(times, points, blend, ends)
    distances = np.zeros(len(plan.centres))
    if len(distances) > 2:
        b, v = plan.blend[1:-1, None], plan.before[1:-1]
        change = plan.after[1:-1] - v
        # Seen from the point, by the time since the blend began.
        terms = np.stack([-v * b, v, np.zeros_like(v), change / (4 * b**2), -change / (16 * b**3)], axis=1)
        squares = np.zeros((len(terms), 9, 1))
        for i in range(5):
            for j in range(5):
                squares[:, i + j, 0] += np.sum(terms[:, i] * terms[:, j], axis=-1)
        turning = np.moveaxis(turning_times(squares, 2 * b[:, 0]), -1, 0)
        times_tried = [np.zeros_like(b), b, 2 * b, *turning]
        distances[1:-1] = np.min([np.linalg.norm(evaluate(terms, t), axis=-1) for t in times_tried], axis=0)
    return distances


def blend_timing(
    points: ArrayLike, speed: ArrayLike, acceleration: ArrayLike, *, ends: Ends = "rest"
) -> tuple[Array, Array]:
    """Return times and blends (k,) with which ``blended`` keeps limits of speed and acceleration.

    Every segment is run at the speed limit of some joint, every blend at the acceleration limit of some joint. Where
    blends would overlap then, all is run slower, just so much that two of them touch.

    Args:
        points: (k, n) joint positions, no two neighbours the same.
        speed: (n,) limits, or one for all; infinite where there is none.
        acceleration: (n,) limits, or one for all.
        ends: as for ``blended``.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: fewer than two points, or limits that do not fit.
        InvalidValueError: a number is NaN, two neighbours are the same, a limit is not above 0, or a segment or a blend
            has none.
        UnknownNameError: no such kind of ends.
    """
    q = floats(points, "points", LARGEST)
    if q.ndim != 2 or len(q) < 2 or not q.size:
        raise ShapeError(f"blends: expected (k, n) points with k at least 2, got {q.shape}")
    one_of("kind of ends", ends, ("rest", "running"))
    speeds = limit_per_joint(speed, q.shape[1], "speed")
    accelerations = limit_per_joint(acceleration, q.shape[1], "acceleration")
    travel = np.diff(q, axis=0)
    for i in np.flatnonzero(np.abs(travel).max(axis=1) <= NOWHERE):
        raise InvalidValueError(f"blends: points {i + 1} and {i + 2} coincide; omit one of them")
    cruise = (np.abs(travel) / speeds).max(axis=1)
    for i in np.flatnonzero(cruise == 0):
        raise InvalidValueError(f"speed: no joint that moves from point {i + 1} to point {i + 2} has a limit")
    before, after = rates_at_points(travel / cruise[:, None], ends)
    change = np.abs(after - before)
    blend = (PEAK_ACCELERATION * change / accelerations).max(axis=1)
    for i in np.flatnonzero((blend == 0) & (change.max(axis=1) > 0)):
        raise InvalidValueError(f"acceleration: no joint whose speed changes at point {i + 1} has a limit")
    # Run k times slower, a segment takes k times as long, and the blends at its ends 1/k of their time.
    slower = np.sqrt(max(1.0, ((blend[:-1] + blend[1:]) / cruise).max()))
    blend, lasting = blend / slower, cruise * slower
    # Where the rate does not change there is nothing to blend; any width does.
    room = np.minimum(np.append(lasting, np.inf), np.append(np.inf, lasting))
    blend = np.where(blend > 0, blend, _ROUNDING * room)
    if ends == "rest":
        lasting[0] += blend[0]
        lasting[-1] += blend[-1]
        blend[[0, -1]] *= 2
    return np.concatenate([[0.0], np.cumsum(lasting)]), blend


def blend_plan(times: ArrayLike, points: ArrayLike, blend: ArrayLike, ends: Ends) -> BlendPlan:
    """Return when blends are, and the rates of the segments between them; arguments and errors as of ``blended``."""
    t, q = timed_points("blends", times, points)
    one_of("kind of ends", ends, ("rest", "running"))
    if t[0] != 0:
        raise InvalidValueError(f"blends: times must increase from 0, got {t[0]:g} s at point 1")
    b = one_or_each(blend, len(t), "blend", "point")
    centres = t.copy()
    if ends == "running":
        b[[0, -1]] = 0.0
    for i in np.flatnonzero(~(b > 0)):
        if ends == "rest" or 0 < i < len(t) - 1:
            raise InvalidValueError(f"blend: expected more than 0 s, got {b[i]:g} s at point {i + 1}")
    _check_room(t, b)
    if ends == "rest":  # standing still before and after, so that the blends there begin and end with the motion
        b[[0, -1]] /= 2
        centres[0] += b[0]
        centres[-1] -= b[-1]
    before, after = rates_at_points(np.diff(q, axis=0) / np.diff(centres)[:, None], ends)
    return BlendPlan(centres, b, q, before, after, float(t[-1]))


def _check_room(t: Array, b: Array) -> None:
    """Refuse blends that overlap."""
    for i in np.flatnonzero(b[:-1] + b[1:] > np.diff(t) * (1 + _ROUNDING)):
        raise InvalidValueError(
            f"blends overlap on the segment from point {i + 1} to point {i + 2}: they need {b[i]:g} s and "
            f"{b[i + 1]:g} s of it, {b[i] + b[i + 1]:g} s together; it lasts {t[i + 1] - t[i]:g} s"
        )


def rates_at_points(rates: Array, ends: Ends) -> tuple[Array, Array]:
    """Return the rates (k, n) before and after each point, from those of the segments (k-1, n)."""
    still = np.zeros_like(rates[:1])
    first, last = (still, still) if ends == "rest" else (rates[:1], rates[-1:])
    return np.concatenate([first, rates]), np.concatenate([rates, last])
