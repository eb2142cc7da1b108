"""What stops the arm on its way through poses, found by a close look."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.kinematics.inverse_kinematics.solution import InverseSolution, Outcome, violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.singularity_analysis import singularities
from armwright.motion.chain import Room, Step, missed, on_one_branch, step_by_step
from armwright.motion.solver import Solver

Cause: TypeAlias = Literal["reach", "limits", "singular"]

# A path that asks a joint for this many times its top speed meets a singularity; it is refused, not crawled along.
# Accelerations say nothing of it: a short line asks much of them wherever it lies.
SLOWEST = 20.0
# So many times as fast is at once.
_AT_ONCE = 1e4
# A joint with this part of what the fastest one does, each by its limit, is to blame as well.
_BLAMED = 0.5
# A stop found less closely is the same if it is no farther off than these parts of the way: one where a joint rushes,
# and any other, which is told by the knot beyond it.
_SAME_RUSH, _SAME = 0.05, 0.2


class Stop(NamedTuple):
    """What stops the arm.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` posture.
        place: before which pose, from 0; a fraction on the way to the next.
        joint: number of the joint, from 1; None where it is no single one.
        reason: what happens there, in words.
        rush: how many times as fast as it may the joint would have to move; None where something else stops it.
        near: the singularity that makes it so fast.
        blamed: numbers of all joints that it makes fast, in parts of their limits.
    """

    cause: Cause
    place: float
    joint: int | None
    reason: str
    rush: float | None = None
    near: str = ""
    blamed: tuple[int, ...] = ()

    def agrees(self, cause: Cause, joint: int | None, reason: str, off: float) -> bool:
        """Whether a stop found less closely, and so far off, is this one, told by a joint that is to blame."""
        if cause != self.cause:
            return False
        if self.rush is not None:
            return joint in self.blamed and f"({self.near})" in reason and off < _SAME_RUSH
        return joint == self.joint and off < _SAME


class CloseLook(NamedTuple):
    """What a close look at the way through poses finds.

    Attributes:
        stop: what stops the arm; None where nothing does.
        places: (m,) where it looked: numbers of poses, from 0; fractions between them.
        q: (m, n) the postures there.
    """

    stop: Stop | None
    places: Array
    q: Array


class Guide(NamedTuple):
    """About which postures an arm has on its way, as a close look found them.

    Attributes:
        at: (k,) where on the way the poses are that were looked through, rising.
        look: what was found.
    """

    at: Array
    look: CloseLook

    def postures(self, at: Array) -> Array:
        """Return about which postures (m, n) the arm has at other places of the way (m,)."""
        places = np.interp(at, self.at, np.arange(len(self.at)))
        return np.stack([np.interp(places, self.look.places, joint) for joint in self.look.q.T], axis=-1)


def nearest_singularity(arm: Arm, q: ArrayLike) -> str:
    """Return the name of the factor that is nearest to zero, such as ``wrist``; see ``Factor``."""
    return min(singularities(arm, q).factors, key=lambda factor: abs(factor.value) / factor.scale).name


def cause_of(solution: InverseSolution) -> Cause:
    """Return why no posture of a solution can be taken."""
    return "reach" if solution.outcome is Outcome.OUT_OF_REACH else "limits"


def at_speed(arm: Arm, joint: int, factor: float) -> str:
    """Say that a joint, from 1, would have to move so many times as fast as it may."""
    how = "at once" if factor > _AT_ONCE else f"{factor:.0f} times as fast as it may"
    return f"{arm.called(joint - 1)} would have to move {how}"


def changing(arm: Arm, q: Array) -> str:
    """Say that the posture ``q`` (n,) ends, and why."""
    return f"the posture would have to change: the arm is singular there ({nearest_singularity(arm, q)})"


def look_closely(
    solver: Solver, X: Array, times: Array, q_start: Array, room: Room, *, poses_only: bool = False
) -> CloseLook | None:
    """Follow poses step by step, up to what stops the arm.

    Args:
        solver: the arm.
        X: (k, 4, 4) poses, of which the first is that of ``q_start``.
        times: (k,) when they are passed [s].
        q_start: (n,) joint positions at the first pose.
        room: how far the hand may be from the straight ways between the poses.
        poses_only: whether nothing but a pose that is not met stops the arm, neither limits nor speeds.

    Returns:
        What stops the arm, and where it looked; None where all postures are of one branch and no joint moves far
        between two of them: then there is no more to see than at the poses themselves.
    """
    if on_one_branch(solver, X, q_start):
        return None
    steps: list[Step] = []
    stop = None
    for step in step_by_step(solver, X, q_start, room):
        stop = _stop(solver, steps[-1], step, times, poses_only=poses_only) if steps else None
        steps.append(step)
        if stop is not None:
            break
    return CloseLook(stop, np.array([step.place for step in steps]), np.array([step.q for step in steps]))


def _stop(solver: Solver, before: Step, step: Step, times: Array, *, poses_only: bool) -> Stop | None:
    """Return what stops the arm on a step."""
    arm, place = solver.arm, before.place
    if missed(solver, step.q, step.X):
        solution = inverse(arm, step.X, before.q)
        if solution.outcome is Outcome.OUT_OF_REACH:
            return Stop("reach", step.place, None, solution.explain())
        return Stop("singular", place, idlest(arm, before.q), changing(arm, before.q))
    if poses_only:
        return None
    since = float(np.interp(step.place, np.arange(len(times)), times) - np.interp(place, np.arange(len(times)), times))
    rush = np.abs(step.q - before.q) / (since * arm.limit("speed"))
    if rush.max() > SLOWEST:
        joint, factor = int(rush.argmax()) + 1, float(rush.max())
        near = nearest_singularity(
            arm, min((before.q, step.q), key=lambda q: float(singularities(arm, q).singular_values[-1]))
        )
        reason = f"{at_speed(arm, joint, factor)}: the arm is nearly singular there ({near})"
        blamed = tuple((np.flatnonzero(rush > _BLAMED * rush.max()) + 1).tolist())
        return Stop("singular", place, joint, reason, rush=factor, near=near, blamed=blamed)
    for fault in violations(arm, step.q):
        return Stop("limits", step.place, fault.joint, str(fault))
    return None


def idlest(arm: Arm, q: Array) -> int:
    """Return the number, from 1, of the joint that is fastest in the motion that moves the hand least, by its limit."""
    speed = arm.limit("speed")
    idle = np.linalg.svd(jacobian(arm, q))[2][-1]
    return int((np.abs(idle) / np.where(np.isfinite(speed), speed, 1.0)).argmax()) + 1
