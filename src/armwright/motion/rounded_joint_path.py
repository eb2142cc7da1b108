"""Straight legs of the joints from configuration to configuration, with rounded corners, run without a stop.

About each corner the rates of the joints go over from those of one leg to those of the next by 2 h² and, from the
middle on, 1 - 2 (1 - h)², h from 0 to 1. So the path is made of cubics with a continuous second derivative, stays in
the triangle of its corner, and is on the legs themselves between the corners. It misses the corner by a sixth of the
half-width of the blend times the change of the rate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.motion.joint_path import natural_speeds
from armwright.motion.limit_utilization import slowing_for_limits
from armwright.motion.polynomials import shifted
from armwright.motion.quintic_polynomials import TOP_SPEED, check_speed, point_to_point
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.timing_law import TimedPath, timed
from armwright.motion.trajectory import Trajectory

# Intervals between knots, at least: on each the timing is refined.
_INTERVALS = 100
# Positions on half of a leg at which it is looked how far the tool is from the corner.
_LOOKS = 257
# Between two blends a leg shorter than this part of the path is rounding.
_NO_LEG = 1e-9


class RoundedRun(NamedTuple):
    """A run along straight legs of the joints with rounded corners.

    Attributes:
        trajectory: of the joints, at rest and without acceleration at both ends, inside their limits.
        corners: (k - 2,) when the middle of each blend is passed [s].
        begins: (k - 2,) when each blend begins [s].
        ends: (k - 2,) when it ends [s].
    """

    trajectory: Trajectory
    corners: Array
    begins: Array
    ends: Array


def rounded_joint_path(times: Array, points: Array, widths: Array) -> Trajectory:
    """Return straight legs with rounded corners.

    Args:
        times: (k,) parameters at which the points would be passed, rising from 0.
        points: (k, n) joint positions.
        widths: (k - 2,) half-widths of the blends at the inner points, above 0; no two overlap.

    Returns:
        The path; what it calls time is a mere parameter.
    """
    rates = np.diff(points, axis=0) / np.diff(times)[:, None]
    starts = np.concatenate([[0.0], times[1:-1] + widths])
    ends = np.concatenate([times[1:-1] - widths, times[-1:]])
    begins, terms = [], []
    for i, rate in enumerate(rates):
        leg_start = points[i] + rate * (starts[i] - times[i])
        if ends[i] - starts[i] > _NO_LEG * times[-1]:
            begins.append(starts[i])
            terms.append([leg_start, rate, 0 * rate, 0 * rate])
        if i + 1 < len(rates):
            r, bend = widths[i], (rates[i + 1] - rate) / widths[i] ** 2
            corner = points[i + 1] - rate * r
            middle = corner + rate * r + bend * r**3 / 6
            begins += [ends[i], times[i + 1]]
            terms += [
                [corner, rate, 0 * rate, bend / 6],
                [middle, (rate + rates[i + 1]) / 2, bend * r / 2, -bend / 6],
            ]
    return Trajectory(times=np.append(begins, times[-1]), coefficients=np.array(terms))


def rounded_run(arm: AnyArm, points: Array, rounding: Array, speed: float = 100.0) -> RoundedRun:
    """Return a run through configurations past rounded corners, from rest to rest.

    Args:
        arm: the arm, or a compiled one.
        points: (k, n) joint positions, two or more, no two neighbours the same.
        rounding: (k - 2,) of the shorter leg at each inner point the part that is rounded, above 0 and at most 1.
        speed: 1 to 120; 120 is the fastest the limits of speed and acceleration allow, all else in proportion.

    Returns:
        The run; between two configurations that of ``point_to_point``. It is slowed where the efforts ask for it.

    Raises:
        IncapableArmError: gravity and dry friction alone take more than a joint may give, or no joint that moves has a
            limit.
        InvalidValueError: the speed is out of range.
    """
    solver, slower = solver_of(arm), TOP_SPEED / check_speed(speed)
    if len(points) == 2:
        motion = point_to_point(solver.arm, points[0], points[1], speed)
        return RoundedRun(motion.slowed(slowing_for_limits(arm, motion)[0]), *np.zeros((3, 0)))
    lengths = (np.abs(np.diff(points, axis=0)) / natural_speeds(solver.arm, points)).max(axis=1)
    times = np.concatenate([[0.0], np.cumsum(lengths)])
    widths = rounding * np.minimum(lengths[:-1], lengths[1:]) / 2
    path = _finer(rounded_joint_path(times, points, widths))
    run = timed(solver, path, np.ones(len(path.coefficients)))
    motion = run.trajectory.slowed(slower)
    motion = motion.slowed(slowing_for_limits(arm, motion)[0])
    at = [_when(run, inner) * motion.duration for inner in (times[1:-1], times[1:-1] - widths, times[1:-1] + widths)]
    return RoundedRun(motion, *at)


def rounding_within(solver: Solver, points: Array, distances: Array) -> Array:
    """Return how much is rounded at corners so that the tool is on a leg farther than a distance from its corner.

    Args:
        solver: the arm.
        points: (k, n) joint positions, no two neighbours the same.
        distances: (k - 2,) from the corner at which the rounding may begin, and end [m].

    Returns:
        (k - 2,) of the shorter leg at each inner point the part that is rounded, above 0 and at most 1.
    """
    lengths = (np.abs(np.diff(points, axis=0)) / natural_speeds(solver.arm, points)).max(axis=1)
    parts = np.linspace(0.0, 0.5, _LOOKS)[:, None]
    rounding = []
    for corner, distance in enumerate(distances.tolist(), 1):
        at = np.asarray(solver.forward(points[corner : corner + 1]))[0, :3, 3]
        widths = []
        for other in (corner - 1, corner + 1):
            q = points[corner] + parts * (points[other] - points[corner])
            away = np.linalg.norm(np.asarray(solver.forward(q))[:, :3, 3] - at, axis=1)
            farther = np.flatnonzero(away > distance)
            last = parts[max(int(farther[0]) - 1, 1) if len(farther) else -1, 0]
            widths.append(float(last) * lengths[min(corner, other)])
        rounding.append(2 * min(widths) / min(lengths[corner - 1 : corner + 1]))
    return np.asarray(np.minimum(np.array(rounding), 1.0))


def _finer(path: Trajectory) -> Trajectory:
    """Return the same path in so many segments that it can be timed well."""
    lengths = np.diff(path.times)
    counts = np.ceil(_INTERVALS * lengths / path.duration).astype(np.intp)
    segments = np.repeat(np.arange(len(lengths)), counts)
    parts = np.concatenate([np.arange(count) / count for count in counts.tolist()])
    shift = parts * lengths[segments]
    times = np.append(path.times[segments] + shift, path.duration)
    return Trajectory(times=times, coefficients=shifted(path.coefficients[segments], shift))


def _when(run: TimedPath, parameters: Array) -> Array:
    """Return at which parts of its duration a run is at parameters of its path."""
    return np.array([run.when(parameter) for parameter in parameters.tolist()])
