"""Straight lines with a certificate."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import Array, ArrayLike
from armwright.kinematics.inverse_kinematics.candidates import exact_pose
from armwright.kinematics.inverse_kinematics.solution import violations_of
from armwright.motion.certified_motion import CertifiedMotion, fastest, standstill
from armwright.motion.obstruction import PathError
from armwright.motion.path import NEGLIGIBLE, TURN_RADIUS, report_speed, report_step
from armwright.motion.quintic_polynomials import check_speed
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.straight_path import StraightPath, line
from armwright.motion.tolerance import Tolerance, tolerance
from armwright.motion.tool_limits import ToolLimits
from armwright.motion.tracking import Task, check_velocities, track
from armwright.spatial.rotations import rotation_vector

# Part of the time in which the tool gathers speed, and again in which it loses it, by the speed that is asked for.
RAMP = 0.25
# Of an allowed deviation of a line in a program no more is used than the first of these that it allows and with which
# the line can be run [m].
COARSE = (1e-3, 2e-3, 5e-3)
# With limits of the tool a line is kept so closely [m], so that its speed is steady.
_STEADY = 2e-5
# Knots to begin with, at least and at most.
_MIN_KNOTS, _MAX_KNOTS = 9, 1000


def straight_line(
    arm: AnyArm,
    q_start: ArrayLike,
    X_goal: ArrayLike,
    *,
    deviation: float = 1e-3,
    rotation: float | None = None,
    speed: float = 100.0,
    period: float | None = None,
) -> CertifiedMotion:
    """Plan a straight line of the tool and certify it.

    Knots are solved on the line and joined by an X-spline in joint space; where the tool strays too far between two of
    them, more are put in. This path of the joints is run as fast as their limits of speed and acceleration and the
    speed of the tool allow, and all of it slower where an effort would pass its limit.

    Args:
        arm: an arm, or a compiled one, which plans some three times faster.
        q_start: (n,) present joint positions [rad] or [m].
        X_goal: (4, 4) pose at the end of the line.
        deviation: allowed distance of the tool from the line [m].
        rotation: allowed angle from the orientation that belongs to the position of the tool on the line, and to its
            progress on it [rad]; 5 mrad for each mm of the deviation when left out. On a line shorter than the
            deviation the progress alone counts.
        speed: 1 to 120, 100 is normal: by the report's rule, as a LINE of the robot language has it.
        period: of the servo [s], to end on a whole number of them; any duration when left out.

    Returns:
        The motion, at rest at both ends, and its certificate.

    Raises:
        PathError: a pose of the line is out of reach, a joint passes a limit, the configuration would have to change
            on the path, or a singularity keeps the tool from staying within the deviation; with the position and the
            cause.
        InvalidValueError: deviation, rotation or speed are out of range.
        IncapableArmError: gravity alone takes more than a joint may give.
    """
    return certified_line(arm, q_start, X_goal, tolerance(deviation, rotation), speed=speed, period=period)


def certified_line(
    arm: AnyArm,
    q_start: ArrayLike,
    X_goal: ArrayLike,
    allowed: Tolerance,
    *,
    speed: float,
    period: float | None = None,
    diagnose: bool = True,
    weak: bool = False,
    tool: ToolLimits | None = None,
) -> CertifiedMotion:
    """Plan a straight line as ``straight_line`` does.

    Args:
        arm: as for ``straight_line``, as are the others that are not named here.
        q_start: the same.
        X_goal: the same.
        allowed: how far the tool may be from the line.
        speed: the same.
        period: the same.
        diagnose: whether it is searched for what really stops a line: not for those who try many lines.
        weak: as for ``fastest``.
        tool: further limits of the tool; its speed is used instead of that of the report's rule.
    """
    solver = solver_of(arm)
    q, B = single_configuration(solver.arm, q_start, "q_start"), exact_pose(X_goal)
    for violation in violations_of(solver.arm, q.tolist()):
        reason = str(violation)
        raise PathError("limits", 0, 0.0, f"at the start {reason}", joint=violation.joint, reason=reason)
    A = np.asarray(solver.forward(q))
    rotation = rotation_vector(A[:3, :3].T @ B[:3, :3])
    even = even_time(solver.arm, A, B, rotation, speed, tool=tool)
    if even is None:
        return standstill(solver, q, allowed)
    motion = line(A, B, rotation, even, near=allowed.position)
    task = Task(solver, motion, q, allowed, allowed, rest=False, clock=partial(requested_time, even))
    tracked = track(task, _knots(solver.arm, motion, allowed), diagnose=diagnose)
    check_velocities(task, tracked)
    ramp = 0.0 if tool is None else math.dist(A[:3, 3], B[:3, 3]) / even / tool.acceleration
    nominal = max(even / (1 - RAMP), even + ramp)
    return fastest(solver, tracked, allowed, nominal=nominal, period=period, weak=weak, ramp=ramp)


def coarse_line(
    arm: AnyArm, q_start: Array, X_goal: Array, *, deviation: float, speed: float, tool: ToolLimits | None = None
) -> CertifiedMotion:
    """Return the line of a program: kept closer than asked where that is no obstruction, run even by a weak arm.

    More than a millimetre is not used but where a line can be run for it; more than 5 mm would only rotate the tool.
    Where the tool has limits of its own, less is tried first: the nearer it is to the line, the steadier is its speed.

    Raises:
        PathError: as for ``straight_line``.
        ArmwrightError: as for ``straight_line``, but for an arm whose joints cannot hold it up.
    """
    errors: list[PathError] = []
    for tried in tried_deviations(deviation, tool):
        try:
            return certified_line(arm, q_start, X_goal, tolerance(tried), speed=speed, weak=True, tool=tool)
        except PathError as error:
            errors.append(error)
            if error.cause == "reach":  # a pose out of reach is so for every deviation
                break
    raise errors[0]


def coarse_deviations(deviation: float) -> list[float]:
    """Return the deviations that a path is tried with, of those that an allowed one includes [m]."""
    return [each for each in COARSE if each <= deviation] or [deviation]


def tried_deviations(deviation: float, tool: ToolLimits | None) -> list[float]:
    """Return the deviations that a path is tried with [m]: close ones first where the tool has limits of its own."""
    coarse = coarse_deviations(deviation)
    return coarse if tool is None else [min(_STEADY, deviation), *coarse]


def requested_line(arm: Arm, A: Array, B: Array, speed: float) -> StraightPath | None:
    """Return the line from A to B at the speed of the report's rule, whatever the joints; None for one of no length."""
    rotation = rotation_vector(A[:3, :3].T @ B[:3, :3])
    even = even_time(arm, A, B, rotation, speed)
    return None if even is None else line(A, B, rotation, even, near=0.0, ramp=RAMP)


def even_time(
    arm: Arm, A: Array, B: Array, rotation: Array, speed: float, *, tool: ToolLimits | None = None
) -> float | None:
    """Return how long a line takes at its full speed throughout [s]; None where it has no length.

    Args:
        arm: the arm.
        A: (4, 4) pose at the start.
        B: (4, 4) pose at the end.
        rotation: (3,) rotation vector from start to end [rad].
        speed: 1 to 120.
        tool: further limits of the tool; its speed is used instead of that of the report's rule.

    Raises:
        InvalidValueError: the speed is out of range.
    """
    check_speed(speed)
    length = max(math.dist(A[:3, 3], B[:3, 3]), TURN_RADIUS * math.hypot(*rotation))
    if length <= NEGLIGIBLE:
        return None
    report = report_speed(arm, A[:3, 3], B[:3, 3], speed)
    if tool is None:
        return length / report
    return limited_time(arm, math.dist(A[:3, 3], B[:3, 3]), math.hypot(*rotation), report, tool)


def limited_time(arm: Arm, shift: float, angle: float, report: float, tool: ToolLimits) -> float:
    """Return how long a path takes at its full speed throughout, where the tool has limits [s].

    Args:
        arm: the arm.
        shift: length of the path [m].
        angle: by which the tool turns on it [rad].
        report: speed by the report's rule [m/s].
        tool: the limits.
    """
    aimed = tool.aimed
    given = math.isfinite(tool.speed)
    by_rule = (TURN_RADIUS * angle if given else max(shift, TURN_RADIUS * angle)) / report
    return max(by_rule, shift / min(aimed.speed, arm.tool_speed), aimed.even_time(shift, angle))


def _knots(arm: Arm, motion: StraightPath, allowed: Tolerance) -> Array:
    """Return times to begin with, as many as the report's rule asks for."""
    A, B = motion.poses[:, :3, 3]
    count = math.ceil(math.dist(A, B) / report_step(arm, A, B, allowed.position)) + 2
    last = min(max(_MIN_KNOTS, count), _MAX_KNOTS) - 1
    return np.asarray(motion.duration * (np.arange(last + 1) / last))


def requested_time(even: float, t: Array) -> Array:
    """Return when times of a line at even speed are passed where the tool gathers speed first, and loses it, evenly.

    Args:
        even: the duration at even speed [s].
        t: (k,) [s].
    """
    ramp = RAMP * even / (1 - RAMP)
    near = np.minimum(t, even - t)
    after = np.where(near < ramp / 2, np.sqrt(2 * ramp * np.maximum(near, 0.0)), near + ramp / 2)
    return np.where(t < even / 2, after, even + ramp - after)
