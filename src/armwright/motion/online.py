"""A new goal for an arm that is moving: position, speed and acceleration go on without a jump.

Ruckig finds the phases of constant jerk that lead from any state to the goal in the shortest time; here they become a
trajectory like any other, so that limits are checked exactly and the motion can be joined, sampled and changed
again.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import LARGEST, Array, ArrayLike, floats, number, one_per_joint
from armwright.errors import ArmwrightError, InvalidValueError, MissingExtraError
from armwright.kinematics.inverse_kinematics.solution import violations
from armwright.motion.efforts import checked
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
    "Ruckig found no motion to the new goal: a path, a limit or a jerk is of quite another size than the others; check "
    "their units"
)
# A path of no joint farther than this, from rest, is none [rad] or [m].
_NOWHERE = 1e-12


class OnlineError(ArmwrightError, ValueError):
    """No motion leads from the present state to the new goal inside the limits; the text says why."""


class _Task(NamedTuple):
    """What is asked for, (n,) each."""

    q: Array
    qd: Array
    qdd: Array
    q_goal: Array
    qd_goal: Array
    speed: Array
    acceleration: Array
    jerk: Array


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
    task = _Task(
        start,
        one_per_joint(qd, n, "qd"),
        one_per_joint(qdd, n, "qdd"),
        goal,
        np.zeros(n) if qd_goal is None else one_per_joint(qd_goal, n, "qd_goal"),
        arm.limit("speed"),
        arm.limit("acceleration"),
        np.empty(n),
    )
    _check_goal(arm, task)
    task = task._replace(jerk=_jerk(arm, task, jerk, brake=brake))
    if not synchronised and (task.qd_goal.any() or period is not None):
        raise InvalidValueError(
            "synchronised=False: joints that arrive by themselves rest there, so neither qd_goal nor period fits"
        )
    if period is not None and not 0 < number(period, "period") <= LARGEST:
        raise InvalidValueError(f"period: expected more than 0 s, got {period}")
    if not (task.qd.any() or task.qdd.any() or task.qd_goal.any()) and np.abs(goal - start).max() <= _NOWHERE:
        return hold(start, 0.0)
    phases = _phases(task, synchronised=synchronised, period=period)
    _check_range(arm, task, phases)
    return _trajectory(task, phases)


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
    before = _up_to(running, number(t, "t"))
    q, qd, qdd = (before(before.duration, order) for order in (0, 1, 2))
    after = retarget(
        arm, q, qd, qdd, goal, qd_goal=qd_goal, jerk=jerk, synchronised=synchronised, brake=brake, period=period
    )
    return after if before.duration == 0 else join([before, after])


def _up_to(running: Trajectory, t: float) -> Trajectory:
    """Return the part of a motion before a time, so that its end is the state just before that time."""
    if not 0 <= t <= LARGEST:
        raise InvalidValueError(f"t: expected 0 s or more, got {t:g}")
    if t > running.duration:
        end = running(running.duration)
        if np.abs(running(running.duration, 1)).max() > _AT_LIMIT:
            raise InvalidValueError(
                f"t: the motion ends at {running.duration:g} s and not at rest, so there is no state at {t:g} s"
            )
        return join([running, hold(end, t - running.duration)])
    count = max(1, int(np.searchsorted(running.times, t, side="left")))
    times = np.append(running.times[:count], t)
    return Trajectory(times=times, coefficients=running.coefficients[:count])


def _check_goal(arm: Arm, task: _Task) -> None:
    """Refuse a goal that no motion can end in, and an arm without limits."""
    for fault in violations(arm, task.q_goal):
        raise InvalidValueError(f"q_goal: {fault}")
    for j in np.flatnonzero(np.abs(task.qd_goal) > task.speed * (1 + _AT_LIMIT)).tolist():
        raise InvalidValueError(
            f"qd_goal: {arm.called(j)} would move at {task.qd_goal[j]:.6g} {_unit(arm, j)}/s, its limit is "
            f"{task.speed[j]:.6g} {_unit(arm, j)}/s"
        )
    for j in np.flatnonzero(~np.isfinite(task.acceleration)).tolist():
        raise InvalidValueError(
            f"arm '{arm.name}': {arm.called(j)} has no limit of acceleration, so the motion to a new goal has no "
            "duration"
        )


def _jerk(arm: Arm, task: _Task, jerk_limits: ArrayLike | None, *, brake: bool) -> Array:
    """Return the jerks (n,) to plan with; refuse a state that they cannot keep inside the limits."""
    n = len(task.q)
    if jerk_limits is None:
        jerk = task.acceleration / JERK_TIME
    else:
        jerks = floats(jerk_limits, "jerk", LARGEST)
        jerk = np.full(n, jerks) if jerks.ndim == 0 else np.array(one_per_joint(jerks, n, "jerk"))
        if not (jerk > 0).all():
            raise InvalidValueError(f"jerk: expected more than 0, got {jerk.min():g}")
        for j in np.flatnonzero(jerk * _SHORTEST_RISE > task.acceleration).tolist():
            raise InvalidValueError(
                f"jerk: {arm.called(j)} would have its full acceleration in less than a microsecond; expected "
                f"{task.acceleration[j] / _SHORTEST_RISE:.3g} {_unit(arm, j)}/s³ at most, got {jerk[j]:.3g}"
            )
    speed, acceleration = (limit * (1 + _AT_LIMIT) for limit in (task.speed, task.acceleration))
    # While an acceleration dies away at a constant jerk the speed still grows by a²/(2 jerk).
    room = speed - task.qd * np.sign(task.qdd)
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(task.qdd != 0, task.qdd**2 / (2 * np.maximum(room, 0.0)), 0.0)
    if jerk_limits is None:
        jerk = np.clip(least, jerk, jerk * _MAX_JERK)
    if brake:
        return jerk
    allowed = "; brake=True accepts it and brings it back inside first"
    for j in np.flatnonzero(np.abs(task.qdd) > acceleration).tolist():
        raise OnlineError(
            f"{arm.called(j)} of '{arm.name}' accelerates by {task.qdd[j]:.6g} {_unit(arm, j)}/s², its limit is "
            f"{task.acceleration[j]:.6g} {_unit(arm, j)}/s²{allowed}"
        )
    for j in np.flatnonzero(np.abs(task.qd) > speed).tolist():
        raise OnlineError(
            f"{arm.called(j)} of '{arm.name}' moves at {task.qd[j]:.6g} {_unit(arm, j)}/s, its limit is "
            f"{task.speed[j]:.6g} {_unit(arm, j)}/s{allowed}"
        )
    for j in np.flatnonzero(least > jerk * (1 + _AT_LIMIT)).tolist():
        top = task.qd[j] + task.qdd[j] * abs(task.qdd[j]) / (2 * jerk[j])
        raise OnlineError(
            f"{arm.called(j)} of '{arm.name}' would come to {top:.6g} {_unit(arm, j)}/s while its acceleration of "
            f"{task.qdd[j]:.6g} {_unit(arm, j)}/s² dies away, its limit is {task.speed[j]:.6g} {_unit(arm, j)}/s: a "
            f"jerk of {least[j]:.3g} {_unit(arm, j)}/s³ instead of {jerk[j]:.3g} keeps it{allowed}"
        )
    return jerk


def _unit(arm: Arm, j: int) -> str:
    return "rad" if arm.joints[j].revolute else "m"


class _Phases(NamedTuple):
    """Of every joint, (n, k) each: when its phases begin [s], its jerk, and its state when they begin.

    The first phase begins at 0; the last one is the rest after the joint has arrived.
    """

    starts: Array
    jerk: Array
    q: Array
    qd: Array
    qdd: Array
    duration: float


def _phases(task: _Task, *, synchronised: bool, period: float | None) -> _Phases:
    """Ask Ruckig for the phases of constant jerk; states come by integrating them, so that they join exactly."""
    ruckig = _ruckig()
    n = len(task.q)
    request = ruckig.InputParameter(n)
    request.current_position, request.current_velocity = task.q.tolist(), task.qd.tolist()
    request.current_acceleration = task.qdd.tolist()
    request.target_position, request.target_velocity = task.q_goal.tolist(), task.qd_goal.tolist()
    request.target_acceleration = [0.0] * n
    request.max_velocity, request.max_acceleration = task.speed.tolist(), task.acceleration.tolist()
    request.max_jerk = task.jerk.tolist()
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
    jerk = np.array([[*profile.brake.j, *profile.j, 0.0] for profile in profiles])
    starts = np.concatenate([np.zeros((n, 1)), np.cumsum(lengths, axis=1)], axis=1)
    q, qd, qdd = (np.empty_like(jerk) for _ in range(3))
    q[:, 0], qd[:, 0], qdd[:, 0] = task.q, task.qd, task.qdd
    for k in range(lengths.shape[1]):
        h = lengths[:, k]
        qdd[:, k + 1] = qdd[:, k] + h * jerk[:, k]
        qd[:, k + 1] = qd[:, k] + h * (qdd[:, k] + h * jerk[:, k] / 2)
        q[:, k + 1] = q[:, k] + h * (qd[:, k] + h * (qdd[:, k] / 2 + h * jerk[:, k] / 6))
    # What is left there of speed and acceleration is rounding.
    qd[:, -1], qdd[:, -1] = task.qd_goal, 0.0
    return _Phases(starts, jerk, q, qd, qdd, float(result.duration))


def _check_range(arm: Arm, task: _Task, phases: _Phases) -> None:
    """Refuse a motion that passes the end of a joint's range; one that begins beyond it may come back."""
    lengths = np.diff(phases.starts, axis=1)
    q, qd, qdd, jerk = (array[:, :-1] for array in (phases.q, phases.qd, phases.qdd, phases.jerk))
    candidates = [phases.q]
    # A joint reverses where its speed, a parabola in each phase, is 0.
    root = np.sqrt(np.maximum(qdd**2 - 2 * jerk * qd, 0.0))
    for side in (-1.0, 1.0):
        divisor = qdd + side * root
        t = np.clip(np.where(divisor != 0, -2 * qd / np.where(divisor != 0, divisor, 1.0), 0.0), 0.0, lengths)
        candidates.append(q + t * (qd + t * (qdd / 2 + t * jerk / 6)))
    positions = np.concatenate(candidates, axis=1)
    lowest, highest = positions.min(axis=1), positions.max(axis=1)
    if (lowest >= arm.limit("lower")).all() and (highest <= arm.limit("upper")).all():
        return
    for extreme, worse in ((lowest, np.less), (highest, np.greater)):
        for fault in violations(arm, extreme):
            j = fault.joint - 1
            if worse(fault.value, fault.limit) and worse(fault.value, task.q[j]):
                raise OnlineError(f"on its motion to the new goal {fault}: it moves too fast to reverse before")


def _trajectory(task: _Task, phases: _Phases) -> Trajectory:
    """Return the motion, cut wherever some joint changes its jerk."""
    cuts = np.unique(phases.starts)
    times = np.append(cuts[cuts < phases.duration], phases.duration)
    coefficients = np.empty((len(times) - 1, 4, len(task.q)))
    # The phase that each joint is in, (segments, n), and the time since that began.
    k = (phases.starts <= times[:-1, None, None]).sum(axis=2) - 1
    joint = np.arange(len(task.q))
    h, jerk = times[:-1, None] - phases.starts[joint, k], phases.jerk[joint, k]
    q, qd, qdd = phases.q[joint, k], phases.qd[joint, k], phases.qdd[joint, k]
    coefficients[:, 0] = q + h * (qd + h * (qdd / 2 + h * jerk / 6))
    coefficients[:, 1] = qd + h * (qdd + h * jerk / 2)
    coefficients[:, 2] = (qdd + h * jerk) / 2
    coefficients[:, 3] = jerk / 6
    return Trajectory(times=times, coefficients=coefficients)


def _ruckig() -> Any:
    """Import Ruckig, which only those need whose goals change on the path."""
    try:
        return import_module("ruckig")
    except ImportError as error:
        raise MissingExtraError(
            "a new goal for a running motion needs Ruckig; install it by: pip install 'armwright[online]'"
        ) from error
