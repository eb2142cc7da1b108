"""Configurations along a path: each next to the one before it."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags
from armwright.kinematics.inverse_kinematics.numeric import descend_from
from armwright.kinematics.inverse_kinematics.revolutions import joint_distances, wrapped_near
from armwright.motion.solver import Solver
from armwright.motion.tolerance import Tolerance
from armwright.spatial.poses import between
from armwright.spatial.rotations import angle_between
from armwright.tracing.loops import Loops, Table
from armwright.tracing.scalar import Scalar, select

# A pose is met to this [m], and to this in the entries of its rotation.
MET, _TURN_MET = 1e-8, 1e-6
# A joint that moves farther from pose to pose may have jumped from one configuration to another [rad] or [m].
_JUMP = 1.0
# A configuration this far from the one the arm has at the start of the path is another one [rad] or [m].
_OTHER = 1e-6
# Without a closed form every so many poses are solved one after the other. Those between are away from the straight
# segment by no more than this part of it, or by this [rad] or [m].
_STRIDE, _STRAIGHT, _CLOSE = 4, 0.25, 0.02
# A step is halved at most so often; no tool has to keep nearer to its path than this [m], [rad].
_HALVINGS, _CLOSEST = 16, (1e-6, 5e-6)


# A revolution; and what is added to round to a whole number.
_TURN, _ROUNDING = 2 * math.pi, 6755399441055744.0


class Step(NamedTuple):
    """A configuration along poses.

    Attributes:
        place: which pose, from 0; with the fraction of the segment to the next.
        X: (4, 4) the pose.
        q: (n,) the configuration.
    """

    place: float
    X: Array
    q: Array


def chain(solver: Solver, X: Array, q_start: Array) -> tuple[Array, int | None]:
    """Solve the poses of a path one after the other, each by the configuration nearest to the one before it.

    Beside a singularity, where a joint has to rotate far between two poses, the nearest configuration may be of
    another branch or be reached by rotating in the other direction. A motion through such configurations leaves the
    path between the poses: whoever plans one takes samples there, and where the path cannot be kept, asks
    ``step_by_step`` for the obstacle.

    A free joint stays where it was at the pose before. Without a closed form each configuration is sought from the one
    before it.

    Args:
        solver: the arm.
        X: (k, 4, 4) poses, of which the first is that of ``q_start``.
        q_start: (n,) joint positions at the first pose.

    Returns:
        (k, n) configurations, and the number of the first pose that is not met; None where all are. Configurations
        beyond that one mean nothing.
    """
    q = np.empty((len(X), solver.arm.n))
    q[:] = q_start
    if solver.inverse_branches is None:
        if (several := _several_at_once(solver, X, q_start)) is not None:
            return several, None
        for k in range(1, len(X)):
            q[k] = _nearest(solver, X[k], q[k - 1])
            if missed(solver, q[k], X[k]):
                break
    else:
        branches, singular = solver.inverse_branches(X, q_start)
        if (same_branch := _along_one_branch(solver, X, branches, singular, q_start)) is not None:
            return same_branch, None
        for k in range(1, len(X)):
            q[k] = _nearest(solver, X[k], q[k - 1], None if singular[k].any() else branches[k])
    return q, _first_missed(solver, q, X)


def _several_at_once(solver: Solver, X: Array, q_start: Array) -> Array | None:
    """Solve some poses of a path one after the other and those between them at once, from straight segments between.

    Returns:
        (k, n) configurations; None where one is not met, or is so far from the straight segment that the arm may have
        jumped.
    """
    some = np.append(np.arange(0, len(X) - 1, _STRIDE), len(X) - 1)
    q = [q_start]
    for k in some[1:]:
        q.append(_nearest(solver, X[k], q[-1]))
        if missed(solver, q[-1], X[k]):
            return None
    steps = np.abs(np.diff(q, axis=0)).max(axis=1)
    straight = np.stack([np.interp(np.arange(len(X)), some, joint) for joint in np.transpose(q)], axis=-1)
    branches, failed = beside(solver, X, straight)
    room = np.append(np.repeat(np.maximum(_STRAIGHT * steps, _CLOSE), np.diff(some)), _CLOSE)
    return branches if failed is None and (np.abs(branches - straight).max(axis=1) <= room).all() else None


def on_one_branch(solver: Solver, X: Array, q_start: Array) -> bool:
    """Whether the branch of the first configuration meets all poses (k, 4, 4) without a jump."""
    if solver.inverse_branches is None:
        return False
    branches, singular = solver.inverse_branches(X, q_start)
    return _along_one_branch(solver, X, branches, singular, q_start) is not None


def beside(solver: Solver, X: Array, guide: Array) -> tuple[Array, int | None]:
    """Solve poses (k, 4, 4) each by the configuration nearest to its guide (k, n); returns what ``chain`` does."""
    if solver.inverse_branches is None:
        q = descend_from(solver.arm, X, guide)
    else:
        q = _nearest_of(solver.arm, solver.inverse_branches(X, guide)[0], guide)
    return q, _first_missed(solver, q, X)


def step_by_step(solver: Solver, X: Array, q_start: Array, allowed: Tolerance) -> Iterator[Step]:
    """Give the configurations that an arm comes to along poses.

    Where the tool, halfway between two configurations, would be off the straight segment between their poses, the step
    is taken in two halves, and so on.

    Args:
        solver: the arm.
        X: (k, 4, 4) poses, of which the first is that of ``q_start``.
        q_start: (n,) joint positions at the first pose.
        allowed: how far the tool may be off.

    Yields:
        Every pose and those that were put between, from the first; whether they are met is for the caller to see.
    """
    step = Step(0.0, X[0], q_start)
    yield step
    for k in range(1, len(X)):
        step = yield from _between(solver, step, Step(float(k), X[k], step.q), allowed, _HALVINGS)


def _between(solver: Solver, first: Step, goal: Step, allowed: Tolerance, halvings: int) -> Generator[Step, None, Step]:
    """Yield the configurations after ``first`` up to the pose of ``goal``, whose own is not used; return the last."""
    last = goal._replace(q=_nearest(solver, goal.X, first.q))
    halfway = between(first.X, goal.X, 0.5)
    if halvings == 0 or not _astray(solver.forward((first.q + last.q) / 2), halfway, allowed):
        yield last
        return last
    step = Step((first.place + goal.place) / 2, halfway, first.q)
    middle = yield from _between(solver, first, step, allowed, halvings - 1)
    return (yield from _between(solver, middle, goal, allowed, halvings - 1))


def _astray(X: Array, X_asked: Array, allowed: Tolerance) -> bool:
    """Whether the tool deviates from its path by more than is allowed."""
    distance = float(np.linalg.norm(X[:3, 3] - X_asked[:3, 3]))
    turned = float(angle_between(X_asked[:3, :3], X[:3, :3]))
    return distance > max(allowed.position, _CLOSEST[0]) or turned > max(allowed.orientation, _CLOSEST[1])


def _nearest(solver: Solver, X: Array, q: Array, candidates: Array | None = None) -> Array:
    """Return the configuration (n,) at a pose nearest to ``q``, of ``candidates`` (k, n) where they are known."""
    if solver.inverse_branches is None:
        return np.asarray(descend_from(solver.arm, X[None], q[None])[0])
    if candidates is None:
        candidates = solver.inverse_branches(X, q)[0]
    return _nearest_of(solver.arm, candidates, q)


def _nearest_of(arm: Arm, candidates: Array, q: Array) -> Array:
    """Return of candidates (..., k, n) those that are reached soonest from configurations (..., n)."""
    turned = wrapped_near(arm, candidates, q[..., None, :])
    nearest = joint_distances(arm, q[..., None, :], turned).argmin(axis=-1)
    return np.asarray(np.take_along_axis(turned, nearest[..., None, None], axis=-2)[..., 0, :])


def _along_one_branch(solver: Solver, X: Array, branches: Array, singular: Array, q_start: Array) -> Array | None:
    """Return the branch (k, n) of the first configuration if it meets all poses (k, 4, 4) without a jump, else None."""
    revolute = solver.arm.revolute.astype(np.float64)
    q, facts = solver.run(_on_branch, [branches, q_start, revolute], (len(X), len(q_start)), (3,))
    branch, apart, step = facts.tolist()
    if singular[:, int(branch)].any() or not (apart <= _OTHER and step <= _JUMP):
        return None
    difference = np.abs(solver.forward(q) - X)
    met = difference[:, :3, 3].max() <= MET and difference[:, :3, :3].max() <= _TURN_MET
    return q if met else None


def _on_branch(loops: Loops, *tables: Table) -> None:
    """Write configurations of the branch that the first one is of, without whole turns from one to the next.

    Read are the branches of poses, the first configuration, and which joints rotate; written are also the number of
    the branch, how far it is from the first configuration, and the longest step of a joint.
    """
    branches, start, revolute, q, facts = tables
    last, n = branches.shape[0] - 1, branches.shape[2]
    (away,) = loops.each([branches.shape[1]], lambda b: [loops.largest(n, lambda j: abs(branches[0, b, j] - start[j]))])
    apart, branch = loops.first_least(branches.shape[1], lambda b: away[b])

    def step(i: Scalar, j: Scalar) -> list[Scalar]:
        x = branches[i + 1, branch, j] - branches[i, branch, j]
        # Adding 1.5 · 2^52 rounds to a whole number.
        turns = (x / _TURN + _ROUNDING) - _ROUNDING
        return [x - _TURN * select(revolute[j] > 0, turns, 0.0)]

    (steps,) = loops.each([last, n], step)
    (longest,) = loops.each([last], lambda i: [loops.largest(n, lambda j: abs(steps[i, j]))])
    on = loops.follow([last, n], lambda j: start[j], lambda i, j, before: before + steps[i, j])
    loops.fill([q.part(0, 0)], [n], lambda j: [start[j]])
    loops.fill([q.behind(1)], [last, n], lambda i, j: [on[i, j]])
    facts[0], facts[1] = branch, apart
    facts[2] = loops.largest(last, lambda i: longest[i])


def _first_missed(solver: Solver, q: Array, X: Array) -> int | None:
    """Return the number of the first pose that its configuration misses; None where none is missed."""
    failed = np.flatnonzero(missed(solver, q, X))
    return int(failed[0]) if len(failed) else None


def missed(solver: Solver, q: Array, X: Array) -> Flags:
    """Return which configurations (..., n) miss their poses (..., 4, 4), as those of arms of few joints may."""
    difference = np.abs(solver.forward(q) - X)
    p, R = difference[..., :3, 3], difference[..., :3, :3]
    return np.asarray((p.max(axis=-1) > MET) | (R.max(axis=(-2, -1)) > _TURN_MET))
