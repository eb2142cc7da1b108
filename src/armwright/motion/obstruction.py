"""What stops the arm along poses, and how that is diagnosed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.errors import ArmwrightError
from armwright.kinematics.inverse_kinematics.solution import InverseSolution, Outcome, violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.singularity_analysis import singularities
from armwright.motion.chain import Step, chain, missed, on_one_branch, step_by_step
from armwright.motion.limited import limited_positions
from armwright.motion.path import Path
from armwright.motion.solver import Solver
from armwright.motion.tolerance import Tolerance

Cause: TypeAlias = Literal["reach", "limits", "singular"]

# A path that asks a joint for this many times its top speed meets a singularity; it is refused, not crawled along.
# Accelerations say nothing of it: a short line asks much of them wherever it lies.
MAX_SLOWDOWN = 20.0
# So many times as fast is at once.
_AT_ONCE = 1e4
# A joint with this part of what the fastest one does, each by its limit, is to blame as well.
_BLAMED = 0.5
# An obstruction found less closely is the same if it is no farther off than these parts of the duration: one where a
# joint would be too fast, and any other, which is found at the knot beyond it.
_SAME_VELOCITY, _SAME = 0.05, 0.2


class PathError(ArmwrightError, ValueError):
    """A path cannot be followed.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` configuration.
        segment: which segment of the path, from 0.
        fraction: how far along that segment.
        joint: number of the joint that stops it, from 1; None where it is no single one, or not known.
        reason: what happens there, without the position.
    """

    def __init__(
        self, cause: Cause, segment: int, fraction: float, message: str, *, joint: int | None = None, reason: str = ""
    ) -> None:
        """Say what stops the arm, and where."""
        self.cause, self.segment, self.fraction, self.joint = cause, segment, fraction, joint
        self.reason = reason or message
        super().__init__(message)

    def restated(self, segment: int, message: str) -> PathError:
        """Return the same error by another number of its segment, and in other words."""
        return PathError(self.cause, segment, self.fraction, message, joint=self.joint, reason=self.reason)


class Obstruction(NamedTuple):
    """What stops the arm.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` configuration.
        time: when, on the motion of the tool that is followed [s].
        joint: number of the joint, from 1; None where it is no single one.
        reason: what happens there, in words.
        velocity_ratio: how many times as fast as its limit the joint would have to move; None where something else
            stops it.
        near: the singularity that makes it so fast.
        blamed: numbers of all joints that it makes fast, in parts of their limits.
    """

    cause: Cause
    time: float
    joint: int | None
    reason: str
    velocity_ratio: float | None = None
    near: str = ""
    blamed: tuple[int, ...] = ()

    def agrees(self, other: Obstruction, duration: float) -> bool:
        """Whether one that was found less closely is this one, and names a joint that is to blame."""
        if other.cause != self.cause:
            return False
        apart = abs(other.time - self.time) / duration
        if self.velocity_ratio is not None:
            return other.joint in self.blamed and f"({self.near})" in other.reason and apart < _SAME_VELOCITY
        return other.joint == self.joint and apart < _SAME


class Diagnosis(NamedTuple):
    """What is found along poses, step by step.

    Attributes:
        obstruction: what stops the arm; None where nothing does.
        times: (m,) of the steps [s].
        q: (m, n) the joint configurations there.
    """

    obstruction: Obstruction | None
    times: Array
    q: Array

    def guide(self, t: Array) -> Array:
        """Return near which configurations (k, n) the arm is at times (k,)."""
        return np.stack([np.interp(t, self.times, joint) for joint in self.q.T], axis=-1)


def nearest_singularity(arm: Arm, q: ArrayLike) -> str:
    """Return the name of the factor that is nearest to zero, such as ``wrist``; see ``Factor``."""
    return min(singularities(arm, q).factors, key=lambda factor: abs(factor.value) / factor.scale).name


def cause_of(solution: InverseSolution) -> Cause:
    """Return why no configuration of a solution can be taken."""
    return "reach" if solution.outcome is Outcome.OUT_OF_REACH else "limits"


def too_fast(arm: Arm, joint: int, ratio: float) -> str:
    """Say that a joint, from 1, would have to move so many times as fast as its limit."""
    how = "at once" if ratio > _AT_ONCE else f"{ratio:.0f} times as fast as its limit"
    return f"{arm.joint_label(joint - 1)} would have to move {how}"


def singular(arm: Arm, q: Array, times: Array, ratios: Array) -> Obstruction:
    """Return the obstruction by a singularity between two configurations.

    Args:
        arm: the arm, with n joints.
        q: (2, n) the configurations.
        times: (2,) when they are passed [s].
        ratios: (n,) how many times as fast as its limit each joint would have to move from one to the other.
    """
    index = int(np.argmin([singularities(arm, each).singular_values[-1] for each in q]))
    joint, ratio, near = int(ratios.argmax()) + 1, float(ratios.max()), nearest_singularity(arm, q[index])
    reason = f"the arm is singular there ({near}), {too_fast(arm, joint, ratio)}"
    blamed = tuple((np.flatnonzero(ratios > _BLAMED * ratio) + 1).tolist())
    return Obstruction("singular", float(times[index]), joint, reason, ratio, near, blamed)


def unmet(arm: Arm, X: Array, before: Array, time: float, time_before: float) -> Obstruction:
    """Return why a pose (4, 4) is not met from the configuration before it (n,)."""
    solution = inverse(arm, X, before)
    if not solution.allowed:
        return Obstruction(cause_of(solution), time, None, solution.explain())
    reason = f"the configuration would have to change: the arm is singular there ({nearest_singularity(arm, before)})"
    return Obstruction("singular", time_before, _idlest(arm, before), reason)


def beyond_limits(arm: Arm, q: Array, times: Array) -> Obstruction | None:
    """Return the first joint limit that configurations (..., k, n) at times (k,) pass; None where they keep them."""
    limits, positions = arm.all_limits, limited_positions(arm, q)
    if (positions >= limits.lower).all() and (positions <= limits.upper).all():
        return None
    outside = ((positions < limits.lower) | (positions > limits.upper)).any(axis=-1)
    for index in np.argwhere(outside):
        for violation in violations(arm, q[tuple(index)]):
            return Obstruction("limits", float(times[index[-1]]), violation.joint, str(violation))
    return None


def diagnose_obstruction(
    solver: Solver,
    X: Array,
    times: Array,
    q_start: Array,
    allowed: Tolerance,
    *,
    clock: Callable[[Array], Array] | None,
) -> Diagnosis | None:
    """Follow poses step by step, up to what stops the arm.

    Args:
        solver: the arm.
        X: (k, 4, 4) poses, of which the first is that of ``q_start``.
        times: (k,) when they are passed [s].
        q_start: (n,) joint positions at the first pose.
        allowed: how far the tool may be from the straight segments between the poses.
        clock: when times are passed at the speed that is asked for [s]; None where nothing but a pose that is not met
            stops the arm, neither limits nor speeds.

    Returns:
        What stops the arm, and the steps; None where all configurations are of one branch and no joint moves far
        between two of them: then there is no more to see than at the poses themselves.
    """
    if on_one_branch(solver, X, q_start):
        return None
    steps: list[Step] = []
    obstruction = None
    for step in step_by_step(solver, X, q_start, allowed):
        obstruction = _on_step(solver, steps[-1], step, times, clock) if steps else None
        steps.append(step)
        if obstruction is not None:
            break
    index = np.interp([step.place for step in steps], np.arange(len(times)), times)
    return Diagnosis(obstruction, index, np.array([step.q for step in steps]))


def _on_step(
    solver: Solver, before: Step, step: Step, times: Array, clock: Callable[[Array], Array] | None
) -> Obstruction | None:
    """Return what stops the arm on a step."""
    arm = solver.arm
    start, end = np.interp([before.place, step.place], np.arange(len(times)), times).tolist()
    if missed(solver, step.q, step.X):
        return unmet(arm, step.X, before.q, end, start)
    if clock is None:
        return None
    ratios = np.abs(step.q - before.q) / (np.diff(clock(np.array([start, end]))) * arm.limits.speed)
    if ratios.max() > MAX_SLOWDOWN:
        return singular(arm, np.stack([before.q, step.q]), np.array([start, end]), ratios)
    return beyond_limits(arm, step.q[None], np.array([end]))


def _idlest(arm: Arm, q: Array) -> int:
    """Return the number, from 1, of the joint that is fastest in the motion that moves the tool least, by its limit."""
    speed = arm.limits.speed
    idle = np.linalg.svd(jacobian(arm, q))[2][-1]
    return int((np.abs(idle) / np.where(np.isfinite(speed), speed, 1.0)).argmax()) + 1


def check_ends(solver: Solver, path: Path, q_start: Array) -> None:
    """Refuse a path to a pose that no joint configuration reaches, with ``fraction`` 1 of the path that leads there.

    Raises:
        PathError: a pose is out of reach, or has no configuration inside the joint limits.
    """
    arm = solver.arm
    q, failed = chain(solver, path.poses, q_start)
    for segment, X in enumerate(path.poses[1:]):
        if (failed is None or segment + 1 < failed) and not violations(arm, q[segment + 1]):
            continue
        solution = inverse(arm, X)
        if not solution.allowed:
            raise PathError(cause_of(solution), segment, 1.0, solution.explain())
