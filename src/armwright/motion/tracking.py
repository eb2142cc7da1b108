"""Joints that follow a motion of the tool, with a bound on how far the tool leaves it.

The joints are solved at knots, each configuration next to the one before it, and joined by an X-spline. Where the tool
is too far off between two knots, more are put: the error of a spline falls with the fourth power of the step. What
stops the arm is returned and not raised, as whoever tries several branches goes on with the next; where there is doubt
about it, the path is followed once more in small steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.chain import beside, chain
from armwright.motion.deviation import (
    ToolMotion,
    TrackingError,
    curve_bounds,
    tracking_error,
)
from armwright.motion.knots import divided
from armwright.motion.obstruction import (
    MAX_SLOWDOWN,
    Diagnosis,
    Obstruction,
    PathError,
    beyond_limits,
    diagnose_obstruction,
    nearest_singularity,
    singular,
    unmet,
)
from armwright.motion.solver import Solver
from armwright.motion.tolerance import Tolerance
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_path import rate_at_first, smooth_xspline, xspline

# Rounds of putting knots where they are missing, and how much closer they are put than the error asks for; into how
# many parts an interval is divided at most.
_ROUNDS, _CLOSER, _PARTS = 12, 1.1, 8
# Where knots are this part of the duration apart and a joint is still too fast, more of them do not help.
_SHORT = 64
# Where the tool does stay on its path a joint may have to be this much faster yet: only there is the tool slowed.
_TRACKED = 1.5
# So many knots at most are followed one by one for what stops the arm; steps between them are halved where needed.
_DIAGNOSED = 300
# Revolutions; a limit passed by this part of one is not passed.
_TURN, _NONE = 2 * np.pi, 1e-9


class Task(NamedTuple):
    """What is to be followed, and how.

    Attributes:
        solver: the arm, with n joints.
        motion: of the tool.
        q_start: (n,) joint positions at its start.
        tolerance: how far the tool may be from it.
        diagnosis: how far it may be off where it is searched for what stops the arm.
        rest: whether the joints rest at both ends; otherwise they run on as the motion does.
        report_spline: whether the spline is the report's, through the given knots alone, whose error may pass the
            tolerance: ``excess`` says by how much. Otherwise its acceleration is continuous, and knots are added where
            the tool is too far from its path.
        whole_turns: whether joints may start revolutions away, to be inside their limits later.
        clock: when times of the motion are passed at the speed that is asked for [s], where a motion is timed later;
            None where limits and speeds do not stop the arm when it is searched for what does.
        max_slowdown: how many times as fast as its limit a joint may have to be, before more knots are put for it.
        max_knots: that are put.
    """

    solver: Solver
    motion: ToolMotion
    q_start: Array
    tolerance: Tolerance
    diagnosis: Tolerance
    rest: bool = True
    report_spline: bool = False
    whole_turns: bool = False
    clock: Callable[[Array], Array] | None = None
    max_slowdown: float = MAX_SLOWDOWN
    max_knots: int = 4000


class Tracking(NamedTuple):
    """A motion of the joints that follows a motion of the tool.

    Attributes:
        trajectory: of the joints.
        error: of the tool on each interval between two knots.
        speed: (m, n) the largest speeds of the joints on these intervals, exactly.
    """

    trajectory: Trajectory
    error: TrackingError
    speed: Array


def track(task: Task, knots: Array, *, diagnose: bool = True) -> Tracking:
    """Follow a motion of the tool with the joints.

    Args:
        task: what is to be followed.
        knots: (k,) times to begin with, those at which the motion changes its form among them [s].
        diagnose: whether it is searched for what really stops the arm; not needed where no reason is asked for.

    Raises:
        PathError: the arm cannot follow it: what stops it, and where.
    """
    tracked = _refined(task, knots, None)
    # A pose that is out of reach is so for every configuration.
    if isinstance(tracked, Obstruction) and tracked.cause != "reach" and diagnose:
        tracked = _diagnosed(task, knots, tracked)
    if isinstance(tracked, Obstruction):
        raise path_error(task.motion, tracked)
    return tracked


def excess(error: TrackingError, allowed: Tolerance) -> Array:
    """Return how many times the tolerance the error of the tool is on each interval (m,)."""
    backward = 0.0 if error.backward is None else error.backward
    position = np.maximum(error.position, backward) / allowed.position
    return np.maximum(position, error.orientation / allowed.orientation)


def too_far(task: Task, tracking: Tracking) -> Obstruction:
    """Return that the tool cannot be kept on its path, however many knots there are, with the worst interval."""
    arm, trajectory = task.solver.arm, tracking.trajectory
    worst, speed = int(excess(tracking.error, task.tolerance).argmax()), arm.limits.speed
    time = float(trajectory.times[worst])
    q, q_next = trajectory(trajectory.times[worst : worst + 2])
    jump = np.abs(q_next - q) / np.where(np.isfinite(speed), speed, 1.0)
    joint, near = int(jump.argmax()) + 1, nearest_singularity(arm, q)
    reason = (
        f"the tool cannot be kept within {task.tolerance.position * 1e3:.3g} mm of its path: the arm is singular "
        f"there ({near}), {arm.joint_label(joint - 1)} would have to move infinitely fast"
    )
    return Obstruction("singular", time, joint, reason)


def path_error(motion: ToolMotion, obstruction: Obstruction) -> PathError:
    """Return the error for what stops the arm, with the position in words."""
    segment, fraction, where = motion.where(obstruction.time)
    cause, _, joint, reason, *_ = obstruction
    return PathError(cause, segment, fraction, f"{where} {reason}", joint=joint, reason=reason)


def check_velocities(task: Task, tracking: Tracking) -> None:
    """Refuse a motion that could only be crawled along.

    Raises:
        PathError: a joint would have to move so many times as fast as its limit.
    """
    ratio = _velocity_ratios(task, tracking.trajectory, tracking.speed)
    if ratio.max() > _TRACKED * MAX_SLOWDOWN:
        worst, times = int(ratio.max(axis=1).argmax()), tracking.trajectory.times
        ends = slice(worst, worst + 2)
        obstruction = singular(task.solver.arm, tracking.trajectory(times[ends]), times[ends], ratio[worst])
        raise path_error(task.motion, obstruction)


def _velocity_ratios(task: Task, trajectory: Trajectory, speed: Array) -> Array:
    """Return how many times as fast as its limit each joint is on each interval (m, n), at the speed that is asked for.

    Args:
        task: what is followed.
        trajectory: of the joints.
        speed: (m, n) their largest speeds on its intervals.
    """
    times = trajectory.times
    if task.clock is None:
        return np.asarray(speed / task.solver.arm.limits.speed)
    passed = task.clock(times)
    slower = ((passed[1:] - passed[:-1]) / (times[1:] - times[:-1]))[:, None]
    return np.asarray(speed / slower / task.solver.arm.limits.speed)


def _diagnosed(task: Task, knots: Array, obstruction: Obstruction) -> Tracking | Obstruction:
    """Follow the path in small steps: return what stops the arm there, or follow it once more where nothing does."""
    sparse = np.append(knots[: -1 : -(-len(knots) // _DIAGNOSED)], knots[-1])
    diagnosis = diagnose_obstruction(
        task.solver, task.motion(sparse), sparse, task.q_start, task.diagnosis, clock=task.clock
    )
    if diagnosis is None:
        return obstruction
    arm = task.solver.arm
    q = _within_limits_by_revolutions(arm, diagnosis.q, None) if task.whole_turns else diagnosis.q
    beyond = beyond_limits(arm, q, diagnosis.times) if task.clock is None else None
    precise = beyond or diagnosis.obstruction
    if precise is None:
        return _refined(task, knots, diagnosis)
    return obstruction if precise.agrees(obstruction, float(knots[-1])) else precise


def _refined(task: Task, knots: Array, guide: Diagnosis | None) -> Tracking | Obstruction:
    """Put knots until the tool stays within the tolerance everywhere, near the configurations of a diagnosis if any."""
    arm, configurations = task.solver.arm, None if guide is None else guide.guide
    for _ in range(_ROUNDS):
        X = task.motion.poses_for(task.solver, knots)
        if configurations is None:
            q, failed = chain(task.solver, X, task.q_start)
        else:
            q, failed = beside(task.solver, X, configurations(knots))
        q = _within_limits_by_revolutions(arm, q, failed) if task.whole_turns else q
        obstruction = beyond_limits(arm, q[:failed], knots)
        if obstruction is None and failed is not None:
            obstruction = unmet(arm, X[failed], q[failed - 1], float(knots[failed]), float(knots[failed]))
        if obstruction is not None:
            return obstruction
        trajectory = _spline(task, knots, q)
        h = knots[1:] - knots[:-1]
        bounds = curve_bounds(task.solver, trajectory)
        speed = bounds.speed
        error = tracking_error(task.solver, task.motion, trajectory, bounds.tool, task.tolerance)
        tracking = Tracking(trajectory, error, speed)
        ratios = excess(error, task.tolerance)
        if ratios.max() <= 1:
            # Between two knots that keep a limit the spline may pass it where a joint reverses.
            return beyond_limits(arm, bounds.turning, knots) or tracking
        if task.report_spline:
            return tracking
        ratio = np.where((h < knots[-1] / _SHORT)[:, None], _velocity_ratios(task, trajectory, speed), 0.0)
        if ratio.max() > task.max_slowdown:
            worst = int(ratio.max(axis=1).argmax())
            return singular(arm, q[worst : worst + 2], knots[worst : worst + 2], ratio[worst])
        parts = np.where(ratios > 1, np.clip(np.ceil(_CLOSER * ratios**0.25), 2, _PARTS), 1).astype(np.intp)
        if parts.sum() > task.max_knots:
            break
        knots = divided(knots, parts)
        if task.solver.inverse_branches is None:  # from where they nearly are already they are found at once
            configurations = trajectory
    return too_far(task, tracking)


def _spline(task: Task, knots: Array, q: Array) -> Trajectory:
    """Return the spline through configurations (k, n) at knots (k,)."""
    if task.report_spline:
        still = np.zeros(q.shape[1])
        return xspline(
            knots, q, *((still, still) if task.rest else (rate_at_first(knots, q), rate_at_first(knots[::-1], q[::-1])))
        )
    return smooth_xspline(knots, q, rest=task.rest, run=task.solver.run)


def _within_limits_by_revolutions(arm: Arm, q: Array, failed: int | None) -> Array:
    """Rotate joints by as few revolutions as bring all of their path inside the limits, where any do."""
    lowest, highest = q[:failed].min(axis=0), q[:failed].max(axis=0)
    least, most = (arm.limits.lower - lowest) / _TURN, (arm.limits.upper - highest) / _TURN
    turns = np.where(least > _NONE, np.ceil(least), np.where(most < -_NONE, np.floor(most), 0.0))
    fits = (turns >= least - _NONE) & (turns <= most + _NONE) & arm.revolute
    return np.asarray(q + _TURN * np.where(fits, turns, 0.0))
