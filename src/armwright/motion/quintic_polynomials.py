"""Quintics: point to point at rest at both ends, and through samples."""

from __future__ import annotations

import math

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import Array, ArrayLike, joint_array, number
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.motion.knots import NOWHERE, check_duration, two_ends
from armwright.motion.limited import limited_positions
from armwright.motion.trajectory import Trajectory, hold

# RLO and VAL count speed in percent of normal; 120 is all the arm allows.
TOP_SPEED = 120.0
LOWEST_SPEED = 1.0
# Peaks of 10 u³ - 15 u⁴ + 6 u⁵ on [0, 1]: of its first and of its second derivative.
PEAK_SPEED = 15 / 8
PEAK_ACCELERATION = 10 / math.sqrt(3)


def quintic(q_start: ArrayLike, q_goal: ArrayLike, duration: float) -> Trajectory:
    """Return the motion 10u³ - 15u⁴ + 6u⁵, with speed and acceleration 0 at both ends.

    Args:
        q_start: (n,) joint positions [rad] or [m].
        q_goal: (n,) joint positions.
        duration: [s], a billionth or more.

    Raises:
        KindError: an argument is something else than real numbers.
        ShapeError: the positions are not (n,), both of them.
        InvalidValueError: a number is NaN or infinite, or the duration too short.

    Source:
        Mujtaba (1980); TR-83-008, "point to point motion".
    """
    duration = check_duration(duration)
    start, goal = two_ends(q_start, q_goal)
    displacement = goal - start
    powers = np.array((0.0, 0.0, 0.0, 10 / duration**3, -15 / duration**4, 6 / duration**5))
    coefficients = powers[:, None] * displacement
    coefficients[0] += start
    return Trajectory(times=(0.0, duration), coefficients=coefficients[None])


def hermite(times: Array, q: Array, qd: Array, qdd: Array) -> Trajectory:
    """Return the motion through samples whose positions, velocities and accelerations are all continuous.

    Args:
        times: (k,) [s], increasing from 0.
        q: (k, n) joint positions [rad] or [m].
        qd: (k, n) joint velocities.
        qdd: (k, n) joint accelerations.

    Returns:
        A quintic between each two samples.
    """
    h = np.diff(times)[:, None]
    step, fall, bend = (
        q[1:] - q[:-1] - h * qd[:-1] - h**2 * qdd[:-1] / 2,
        qd[1:] - qd[:-1] - h * qdd[:-1],
        np.diff(qdd, axis=0),
    )
    powers = [
        q[:-1],
        qd[:-1],
        qdd[:-1] / 2,
        (10 * step - 4 * h * fall + h**2 * bend / 2) / h**3,
        (-15 * step + 7 * h * fall - h**2 * bend) / h**4,
        (6 * step - 3 * h * fall + h**2 * bend / 2) / h**5,
    ]
    return Trajectory(times=times, coefficients=np.stack(powers, axis=1))


def shortest_duration(arm: Arm, displacement: ArrayLike) -> float:
    """Return the shortest time of a quintic over ``displacement`` (n,) inside the speed and acceleration limits [s]."""
    displacement = np.abs(limited_positions(arm, joint_array(displacement, arm.n, "displacement")))
    by_speed: Array = PEAK_SPEED * displacement / arm.all_limits.speed
    by_acceleration: Array = np.sqrt(PEAK_ACCELERATION * displacement / arm.all_limits.acceleration)
    return float(max(by_speed.max(), by_acceleration.max()))


def point_to_point(arm: Arm, q_start: ArrayLike, q_goal: ArrayLike, speed: float = 100.0) -> Trajectory:
    """Return the quintic from one configuration to another, timed by the joint limits.

    Args:
        arm: the arm, with n joints.
        q_start: (n,) joint positions [rad] or [m].
        q_goal: (n,) joint positions.
        speed: 1 to 120; 120 is the fastest the limits allow, all else in proportion.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: the positions are not (n,).
        InvalidValueError: a number is NaN or infinite, or the speed is out of range.
        IncapableArmError: no joint that moves has a limit of speed or acceleration.

    Source:
        TR-83-008, "point to point motion"; the meaning of 120 from its section on MOVE.
    """
    speed = check_speed(speed)
    start, goal = single_configuration(arm, q_start, "q_start"), single_configuration(arm, q_goal, "q_goal")
    displacement = goal - start
    if np.abs(displacement).max() <= NOWHERE:
        return hold(start, 0.0)
    shortest = shortest_duration(arm, displacement)
    if shortest == 0:
        raise IncapableArmError(
            f"arm '{arm.name}': no moving joint has a limit of speed or acceleration, so the duration of the move "
            "is undefined"
        )
    return quintic(start, goal, shortest * TOP_SPEED / speed)


def check_speed(speed: float) -> float:
    """Return ``speed`` if it is one.

    Raises:
        KindError: it is no number.
        InvalidValueError: it is outside 1..120.
    """
    speed = number(speed, "speed")
    if not LOWEST_SPEED <= speed <= TOP_SPEED:
        raise InvalidValueError(f"speed {speed:g} is outside {LOWEST_SPEED:g}..{TOP_SPEED:g}")
    return speed
