"""Point to point in the shortest time that speed and acceleration allow: the trapezoid of speed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array, ArrayLike
from armwright.errors import InvalidValueError
from armwright.motion.knots import NOWHERE, check_duration, joint_vector, limit_per_joint, two_ends
from armwright.motion.trajectory import Trajectory, hold

# A duration that falls short of the shortest by this part of it is the shortest.
_ROUNDING = 1e-12
# A triangle has no time at constant speed; rounding must not give it some.
_TRIANGLE = 1e-15


class _Limits(NamedTuple):
    """Limits of the part of the path that has been made, and the joints that set them, from 0."""

    speed: float
    acceleration: float
    joints: tuple[int, int]


def trapezoid(
    q_start: ArrayLike, q_goal: ArrayLike, speed: ArrayLike, acceleration: ArrayLike, duration: float | None = None
) -> Trajectory:
    """Return the motion that speeds up evenly, runs at constant speed and slows down evenly, from rest to rest.

    All joints do so together, so that they move along a straight line of the joint space; the one that needs longest
    is at its limit. Where the path is so short that no joint reaches its speed, the trapezoid is a triangle. Its
    acceleration jumps: the quintic's does not.

    Args:
        q_start: (n,) joint positions [rad] or [m].
        q_goal: (n,) joint positions.
        speed: (n,) limits, or one for all; infinite where there is none.
        acceleration: (n,) limits, or one for all; some joint that moves must have one.
        duration: [s]; the shortest when left out. With more time it speeds up as hard, but to a lower speed.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: positions or limits are not (n,).
        InvalidValueError: a number is NaN, a position infinite, a limit not above 0 or missing, or the duration too
            short for the limits of a joint, or too long to be one.
    """
    start, goal = two_ends(q_start, q_goal)
    displacement = goal - start
    limits = _limits(displacement, speed, acceleration)
    requested = None if duration is None else check_duration(duration)
    if limits is None:
        return hold(start, requested or 0.0)
    shortest = _shortest(limits)
    if requested is None:
        requested = check_duration(shortest)
    elif requested < shortest * (1 - _ROUNDING):
        fastest, hardest = limits.joints
        j = fastest if limits.speed**2 < limits.acceleration else hardest
        raise InvalidValueError(
            f"duration: {requested:g} s is too short for joint {j + 1}, whose travel of {abs(displacement[j]):.6g} "
            f"takes at least {shortest:.6g} s within the limits"
        )
    a = limits.acceleration
    # The speed v at which 1 = v (T - v / a), without loss of digits, and the time to reach it.
    square = requested**2 - 4 / a
    root = math.sqrt(square) if square > _TRIANGLE * requested**2 else 0.0
    v = min(2 / (requested + root), limits.speed)
    rise = min(v / a, requested / 2)
    times = (0.0, rise, requested - rise, requested)
    risen = a * rise**2 / 2
    profile = np.array([[0, 0, a / 2], [risen, v, 0], [1 - risen, v, -a / 2]])
    coefficients = profile[:, :, None] * displacement
    coefficients[:, 0] += start
    if times[2] - times[1] <= _ROUNDING * requested:
        return Trajectory(times=(0.0, rise, requested), coefficients=coefficients[[0, 2]])
    return Trajectory(times=times, coefficients=coefficients)


def shortest_trapezoid(displacement: ArrayLike, speed: ArrayLike, acceleration: ArrayLike) -> float:
    """Return the shortest time of a trapezoid inside limits [s].

    Args:
        displacement: (n,) of the joints [rad] or [m].
        speed: (n,) limits, or one for all; infinite where there is none.
        acceleration: (n,) limits, or one for all; some joint that moves must have one.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: the limits do not fit the path.
        InvalidValueError: a number is NaN, or a limit not above 0 or missing.
    """
    limits = _limits(joint_vector(displacement), speed, acceleration)
    return 0.0 if limits is None else _shortest(limits)


def _limits(displacement: Array, speed: ArrayLike, acceleration: ArrayLike) -> _Limits | None:
    """Return how fast the part of the path from 0 to 1 may change; None where there is no path."""
    speeds = limit_per_joint(speed, len(displacement), "speed")
    accelerations = limit_per_joint(acceleration, len(displacement), "acceleration")
    if np.abs(displacement).max() <= NOWHERE:
        return None
    with np.errstate(divide="ignore"):
        by_speed, by_acceleration = speeds / np.abs(displacement), accelerations / np.abs(displacement)
    joints = int(by_speed.argmin()), int(by_acceleration.argmin())
    v, a = float(by_speed.min()), float(by_acceleration.min())
    if not math.isfinite(a):
        raise InvalidValueError("acceleration: no moving joint has a limit, so the velocity would be discontinuous")
    return _Limits(v, a, joints)


def _shortest(limits: _Limits) -> float:
    v, a, _ = limits
    return 1 / v + v / a if v * v < a else 2 / math.sqrt(a)
