"""A new goal for an arm that is moving: position, speed and acceleration go on without a jump.

Ruckig finds the phases of constant jerk that lead from any state to the goal in the shortest time; here they become a
trajectory like any other, so that limits are checked exactly and the motion can be joined, sampled and changed
again.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import Array, ArrayLike, not_negative, one_or_each, one_per_joint, positive
from armwright.errors import ArmwrightError, InvalidValueError
from armwright.extras import import_extra
from armwright.kinematics.inverse_kinematics.solution import violations
from armwright.motion.deviation import turning_positions
from armwright.motion.efforts import checked
from armwright.motion.knots import NOWHERE, rate_or_rest
from armwright.motion.limited import limited_label, limited_motion, passed_limits
from armwright.motion.trajectory import Trajectory, hold, join

# By default a joint has its full acceleration after this time [s].
JERK_TIME = 0.1
# A state beyond a limit by this part of it is at the limit.
_AT_LIMIT = 1e-9
# The default jerk rises at most so many times where a state asks for more.
_MAX_JERK = 1000.0
# A joint does not have its full acceleration sooner than this: rounding would make steps of it [s].
_SHORTEST_RISE = 1e-6
_GAVE_UP = (
    "Ruckig found no motion to the new goal: a distance, a limit or a jerk differs from the others by orders of "
    "magnitude; check their units"
)


class OnlineError(ArmwrightError, ValueError):
    """No motion leads from the present state to the new goal inside the limits; the text says why."""


class _Task(NamedTuple):
    """The state of an arm, and the positions and speeds to reach from it, (n,) each."""

    arm: Arm
    q: Array
    qd: Array
    qdd: Array
    q_goal: Array
    qd_goal: Array


def retarget(
    arm: Arm,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    q_goal: ArrayLike,
    *,
    qd_goal: ArrayLike | None = None,
    jerk: ArrayLike | None = None,
    synchronised: bool = True,
    brake: bool = False,
    period: float | None = None,
) -> Trajectory:
    """Return the shortest motion from a state to a goal inside the limits of speed, acceleration and jerk.

    Args:
        arm: the arm, with n joints, all of which have a limit of acceleration.
        q: (n,) joint positions now [rad] or [m].
        qd: (n,) joint speeds now.
        qdd: (n,) joint accelerations now.
        q_goal: (n,) joint positions to reach.
        qd_goal: (n,) joint speeds to reach them with; at rest when left out.
        jerk: largest change of acceleration per time, (n,) or one for all [rad/s³] or [m/s³]. When left out, what
            gives a joint its full acceleration in 0.1 s; more where the present acceleration would otherwise carry
            it over its limit of speed.
        synchronised: whether all joints arrive at the same time; else each arrives as soon as it can and rests.
        brake: whether a state beyond the limits is accepted: it is brought back inside first, as fast as the jerk
            allows.
        period: of the servo [s], to end on a whole number of them; any duration when left out.

    Returns:
        Cubics, one for every time in which no joint changes its jerk. The goal is met to 1e-8 rad or m, which is
        Ruckig's own rounding, and nearly always to 1e-13.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: an array is not (n,).
        InvalidValueError: a number is NaN, infinite or out of range; a joint has no limit of acceleration; the goal
            is beyond a limit.
        OnlineError: the state is beyond a limit or must pass one, or a joint cannot stop before the end of its range.
        MissingExtraError: Ruckig is not installed.

    Source:
        Berscheid & Kroeger, "Jerk-limited real-time trajectory generation with arbitrary target states" (2021).
    """
    start, goal = single_configuration(arm, q, "q"), single_configuration(arm, q_goal, "q_goal")
    n = arm.n
    qd, qdd = one_per_joint(qd, n, "qd"), one_per_joint(qdd, n, "qdd")
    task = _Task(arm, start, qd, qdd, goal, rate_or_rest(qd_goal, n, "qd_goal"))
    _check_goal(task)
    jerk_limits = _jerk_limits(task, jerk, brake=brake)
    if not synchronised and (task.qd_goal.any() or period is not None):
        raise InvalidValueError(
            "synchronised=False: joints that arrive independently stop at the goal, so qd_goal and period are not "
            "allowed"
        )
    if period is not None:
        period = positive(period, "period", "s")
    if not (task.qd.any() or task.qdd.any() or task.qd_goal.any()) and np.abs(goal - start).max() <= NOWHERE:
        return hold(start, 0.0)
    motion = _motion(task, *_phases(task, jerk_limits, synchronised=synchronised, period=period))
    _check_range(task, motion)
    _check_drives(task, motion)
    return motion


def replace_goal(
    arm: Arm,
    running: Trajectory,
    t: float,
    q_goal: ArrayLike,
    *,
    qd_goal: ArrayLike | None = None,
    jerk: ArrayLike | None = None,
    synchronised: bool = True,
    brake: bool = False,
    period: float | None = None,
) -> Trajectory:
    """Return a running motion up to a time, and from there on the shortest one to a new goal.

    Position, speed and acceleration do not jump. Where the running motion itself jumps in acceleration at that very
    time, the acceleration just before it counts.

    Args:
        arm: the arm, with n joints.
        running: motion of its joints.
        t: when it gets the new goal [s]; a motion that has ended at rest stands until then.
        q_goal: (n,) joint positions to reach [rad] or [m].
        qd_goal: as in ``retarget``, and so are all others.
        jerk: largest change of acceleration per time.
        synchronised: whether all joints arrive at the same time.
        brake: whether a state beyond the limits is accepted.
        period: of the servo [s]; the part from ``t`` on lasts a whole number of them.

    Raises:
        KindError: ``running`` is no trajectory.
        ShapeError: the running motion is of another number of joints.
        InvalidValueError: the time is before the start, or after the end of a motion that does not end at rest.
        OnlineError: as in ``retarget``, and so are all others.
    """
    goal = single_configuration(arm, q_goal, "q_goal")
    checked(arm, running, "running")
    before = _up_to(running, not_negative(t, "t", "s"))
    q, qd, qdd = (before(before.duration, order) for order in (0, 1, 2))
    after = retarget(
        arm, q, qd, qdd, goal, qd_goal=qd_goal, jerk=jerk, synchronised=synchronised, brake=brake, period=period
    )
    return after if before.duration == 0 else join([before, after])


def _up_to(running: Trajectory, t: float) -> Trajectory:
    """Return the part of a motion before a time, so that its end is the state just before that time."""
    if t > running.duration:
        end = running(running.duration)
        if np.abs(running(running.duration, 1)).max() > _AT_LIMIT:
            raise InvalidValueError(
                f"t: the motion ends at {running.duration:g} s and not at rest, so its state at {t:g} s is undefined"
            )
        return join([running, hold(end, t - running.duration)])
    count = max(1, int(np.searchsorted(running.times, t, side="left")))
    times = np.append(running.times[:count], t)
    return Trajectory(times=times, coefficients=running.coefficients[:count])


def _check_goal(task: _Task) -> None:
    """Refuse a goal that no motion can end in, and an arm without limits."""
    arm, speed = task.arm, task.arm.limits.speed
    for fault in violations(arm, task.q_goal):
        raise InvalidValueError(f"q_goal: {fault}")
    for j in np.flatnonzero(np.abs(task.qd_goal) > speed * (1 + _AT_LIMIT)).tolist():
        beyond = _beyond_limit(arm, j, "s", task.qd_goal[j], speed[j])
        raise InvalidValueError(f"qd_goal: the velocity of {arm.joint_label(j)} would be {beyond}")
    for j in np.flatnonzero(~np.isfinite(arm.limits.acceleration)).tolist():
        raise InvalidValueError(
            f"arm '{arm.name}': {arm.joint_label(j)} has no limit of acceleration, so the duration of the motion to a "
            "new goal is undefined"
        )


def _jerk_limits(task: _Task, limits: ArrayLike | None, *, brake: bool) -> Array:
    """Return the largest jerks (n,) to plan with; refuse a state that they cannot keep inside the limits."""
    arm = task.arm
    speed, acceleration = arm.limits.speed, arm.limits.acceleration
    if limits is None:
        jerk = acceleration / JERK_TIME
    else:
        jerk = one_or_each(limits, arm.n, "jerk", "joint")
        if not (jerk > 0).all():
            raise InvalidValueError(f"jerk: expected more than 0, got {jerk.min():g}")
        for j in np.flatnonzero(jerk * _SHORTEST_RISE > acceleration).tolist():
            largest = f"{acceleration[j] / _SHORTEST_RISE:.3g} {arm.joints[j].units.position}/s³"
            raise InvalidValueError(
                f"jerk: {arm.joint_label(j)} would reach its full acceleration in less than a microsecond; expected "
                f"at most {largest}, got {jerk[j]:.3g}"
            )
    # While an acceleration dies away at a constant jerk the speed still grows by a²/(2 jerk).
    room = speed * (1 + _AT_LIMIT) - task.qd * np.sign(task.qdd)
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(task.qdd != 0, task.qdd**2 / (2 * np.maximum(room, 0.0)), 0.0)
    if limits is None:
        jerk = np.clip(least, jerk, jerk * _MAX_JERK)
    if not brake:
        _check_state(task, jerk, least)
    return jerk


def _check_state(task: _Task, jerk: Array, least: Array) -> None:
    """Refuse a state beyond a limit, or one that passes its limit of speed with jerks below the ``least`` (n,)."""
    arm, speed, acceleration = task.arm, task.arm.limits.speed, task.arm.limits.acceleration
    allowed = "; brake=True accepts it and first brakes to within the limits"
    for does, per, rates, most in (("accelerates by", "s²", task.qdd, acceleration), ("moves at", "s", task.qd, speed)):
        for j in np.flatnonzero(np.abs(rates) > most * (1 + _AT_LIMIT)).tolist():
            beyond = _beyond_limit(arm, j, per, rates[j], most[j])
            raise OnlineError(f"{arm.joint_label(j)} of '{arm.name}' {does} {beyond}{allowed}")
    for j in np.flatnonzero(least > jerk * (1 + _AT_LIMIT)).tolist():
        top, unit = task.qd[j] + task.qdd[j] * abs(task.qdd[j]) / (2 * jerk[j]), arm.joints[j].units.position
        raise OnlineError(
            f"{arm.joint_label(j)} of '{arm.name}' would come to {top:.6g} {unit}/s while its acceleration of "
            f"{task.qdd[j]:.6g} {unit}/s² dies away, its limit is {speed[j]:.6g} {unit}/s: a jerk of {least[j]:.3g} "
            f"{unit}/s³ instead of {jerk[j]:.3g} keeps it{allowed}"
        )


def _beyond_limit(arm: Arm, j: int, per: str, rate: float, limit: float) -> str:
    """Return a rate of a joint, from 0, and the limit that it passes, in words."""
    unit = f"{arm.joints[j].units.position}/{per}"
    return f"{rate:.6g} {unit}, its limit is {limit:.6g} {unit}"


def _phases(task: _Task, jerk_limits: Array, *, synchronised: bool, period: float | None) -> tuple[Array, Array, float]:
    """Ask Ruckig for the phases of constant jerk of every joint.

    Returns:
        How long they last (n, k) [s]; their jerks (n, k + 1), the last of which is that of the rest after the joint has
        arrived; and the duration of the motion [s].
    """
    ruckig: Any = import_extra("ruckig", "a new goal for a running motion", "online", "Ruckig")
    n, arm = task.arm.n, task.arm
    request = ruckig.InputParameter(n)
    request.current_position, request.current_velocity = task.q.tolist(), task.qd.tolist()
    request.current_acceleration = task.qdd.tolist()
    request.target_position, request.target_velocity = task.q_goal.tolist(), task.qd_goal.tolist()
    request.target_acceleration = [0.0] * n
    request.max_velocity, request.max_acceleration = arm.limits.speed.tolist(), arm.limits.acceleration.tolist()
    request.max_jerk = jerk_limits.tolist()
    request.synchronization = ruckig.Synchronization.Time if synchronised else ruckig.Synchronization.No
    if period is not None:
        request.duration_discretization = ruckig.DurationDiscretization.Discrete
    result = ruckig.Trajectory(n)
    generator = ruckig.Ruckig(n) if period is None else ruckig.Ruckig(n, period)
    try:
        answer = generator.calculate(request, result)
    except ruckig.RuckigError as error:
        raise OnlineError(_GAVE_UP) from error
    if answer != ruckig.Result.Working or not math.isfinite(result.duration):
        raise OnlineError(_GAVE_UP)
    profiles = result.profiles[0]
    lengths = np.array([[*profile.brake.t, *profile.t] for profile in profiles])
    jerks = np.array([[*profile.brake.j, *profile.j, 0.0] for profile in profiles])
    return lengths, jerks, float(result.duration)


def _motion(task: _Task, lengths: Array, jerks: Array, duration: float) -> Trajectory:
    """Return the motion of phases of constant jerk, cut wherever some joint changes its jerk.

    States come by integrating the phases, so that they join exactly.
    """
    q, qd, qdd = (np.empty_like(jerks) for _ in range(3))
    q[:, 0], qd[:, 0], qdd[:, 0] = task.q, task.qd, task.qdd
    for k in range(lengths.shape[1]):
        q[:, k + 1], qd[:, k + 1], qdd[:, k + 1] = _after(lengths[:, k], q[:, k], qd[:, k], qdd[:, k], jerks[:, k])
    # What is left there of speed and acceleration is rounding.
    qd[:, -1], qdd[:, -1] = task.qd_goal, 0.0
    starts = np.concatenate([np.zeros((len(q), 1)), np.cumsum(lengths, axis=1)], axis=1)
    cuts = np.unique(starts)
    times = np.append(cuts[cuts < duration], duration)
    # The phase that each joint is in, (segments, n), and the time since that began.
    k = (starts <= times[:-1, None, None]).sum(axis=2) - 1
    joint = np.arange(len(q))
    jerk = jerks[joint, k]
    q, qd, qdd = _after(times[:-1, None] - starts[joint, k], q[joint, k], qd[joint, k], qdd[joint, k], jerk)
    return Trajectory(times=times, coefficients=np.stack([q, qd, qdd / 2, jerk / 6], axis=1))


def _after(h: Array, q: Array, qd: Array, qdd: Array, jerk: Array) -> tuple[Array, Array, Array]:
    """Return positions, speeds and accelerations after a time of constant jerk."""
    return q + h * (qd + h * (qdd / 2 + h * jerk / 6)), qd + h * (qdd + h * jerk / 2), qdd + h * jerk


def _check_drives(task: _Task, motion: Trajectory) -> None:
    """Refuse a motion that passes a limit of coupled drives: here each joint is timed by its own limits alone."""
    arm, n, limits = task.arm, task.arm.n, task.arm.all_limits
    if len(limits.speed) == n:
        return
    of_drives = limited_motion(arm, motion)
    accelerations, speeds = of_drives.peaks(2), of_drives.peaks(1)
    rates = ("accelerate by", "s²", accelerations, limits.acceleration), ("move at", "s", speeds, limits.speed)
    for does, per, peaks, most in rates:
        for k in np.flatnonzero(peaks[n:] > most[n:] * (1 + _AT_LIMIT)).tolist():
            beyond = _beyond_limit(arm, k, per, peaks[n + k], most[n + k])
            raise OnlineError(
                f"on its motion to the new goal {limited_label(arm, n + k)} of '{arm.name}' would {does} {beyond}: "
                "joints are timed one by one here; use lower limits of the joints that it moves"
            )
    for fault in passed_limits(arm, motion):
        if fault.drive:
            raise OnlineError(f"on its motion to the new goal {fault}")


def _check_range(task: _Task, motion: Trajectory) -> None:
    """Refuse a motion that passes the end of a joint's range; one that begins beyond it may come back."""
    # The goal, with which the last segment ends, has been checked.
    c = motion.coefficients
    positions = np.concatenate([c[:, 0], *turning_positions(c, np.diff(motion.times))])
    lowest, highest = positions.min(axis=0), positions.max(axis=0)
    if (lowest >= task.arm.limits.lower).all() and (highest <= task.arm.limits.upper).all():
        return
    for extreme, worse in ((lowest, np.less), (highest, np.greater)):
        for fault in violations(task.arm, extreme):
            if worse(fault.value, fault.limit) and worse(fault.value, task.q[fault.joint - 1]):
                raise OnlineError(f"on its motion to the new goal {fault}: it moves too fast to stop before")
