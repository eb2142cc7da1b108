"""Inverse kinematics step by step, for every arm without a closed form: fewer than six joints, six, or more."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.reach import stretched_length
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward, link_frames, per_joint, stack, tool_frame
from armwright.kinematics.inverse_kinematics.candidates import POSE_TOLERANCE, Candidate, pose_errors, rank
from armwright.kinematics.inverse_kinematics.revolutions import joint_distance, midpoints, nearest_equivalent
from armwright.kinematics.inverse_kinematics.solution import InverseSolution, violations
from armwright.kinematics.jacobians import frame_columns
from armwright.spatial.rotations import rotation_vector

# Starting configurations in one round, and rounds at most: there is another while none has led to the pose and, where
# the solutions can be counted, while the last one brought a new one.
_STARTS = 48
_ROUNDS = 5
_STEPS = 150
# What a rotation by one radian is worth, in parts of the size of the arm; and where an arm of few joints cannot turn
# the tool to a pose, so that it comes to its position at least.
_WEIGHT, _POSITION_FIRST = 0.25, 1e-4
# A residual this small, in parts of the size of the arm, is rounding.
_ROUNDING = 1e-15
# A configuration whose residual no longer falls by this part in a step stands at the bottom of its valley.
_STILL = 1e-9
# The damping, in parts of the squared residual: what it begins with, and how it answers a step that fails or succeeds;
# and the least, in parts of what it is added to, where it is not lost if two joints do the same.
_DAMPING, _FAILED, _SUCCEEDED = 1.0, 8.0, 0.25
_LEAST_DAMPING = 1e-14
# Joints that a pose takes.
_POSE = 6
# Configurations closer than this are one: at the edge of the reach half of the digits are gone [rad] or [m].
_SAME_CONFIGURATION = 1e-5
# Of the endless configurations of more joints examples are given, so far apart [rad], or in parts of the size.
_EXAMPLES_APART = 0.1
# A joint motion is taken for free where the tool is not moved by it to first order (singular values below this part
# of the largest), nor by so long a motion along it once the other joints have made up for its curvature [rad] or [m].
_IDLE = 1e-6
_FREE_WAY = 0.05


@attrs.frozen(kw_only=True, eq=False)
class _Task:
    """Bring the tool of an arm to a pose, joints kept between bounds.

    Attributes:
        arm: the arm.
        X: (4, 4) the pose, or (k, 4, 4), one for each of k configurations.
        lower: (n,) lower bounds, may be infinite.
        upper: (n,) upper bounds.
        weight: what a rotation by one radian is worth, in parts of the size of the arm.
        size: how long the arm is, for what is small [m].
        length: what a rotation by one radian is worth [m].
    """

    arm: Arm
    X: Array
    lower: Array
    upper: Array
    weight: float = _WEIGHT
    size: float = attrs.field(init=False)
    length: float = attrs.field(init=False)

    @size.default
    def _size(self) -> float:
        """Return how long the arm is, joint after joint, slides as far as they go; 1 m where it has no length [m]."""
        total = float(np.linalg.norm(self.arm.tool[:3, 3]))
        for joint in self.arm.joints:
            way = joint.limits.upper - joint.limits.lower
            slide = way if not joint.revolute and math.isfinite(way) else 0.0
            total += joint.span() + slide
        return total or 1.0

    @length.default
    def _length(self) -> float:
        return max(self.size * self.weight, POSE_TOLERANCE)


def numeric_inverse(arm: Arm, X: Array, near: Array) -> InverseSolution:
    """Return configurations that put the tool at one pose, found by damped least squares from many starts.

    The starts are the present configuration and points spread evenly over the joint limits, always the same ones. The
    limits hold during the search. When no start leads to the pose the search is made again without limits, to
    distinguish a pose that only the limits exclude from one that is out of reach; then the configuration with the least
    error is returned, in which a rotation by one radian counts as much as a quarter of the arm's length; with fewer
    than six joints, which cannot turn the tool to every pose, as good as nothing: the tool comes to the position.

    An arm of six joints or fewer has a finite number of solutions: those that were found are given, most often all.
    With more joints they are endless, and those that were found are examples, nearest first, some joint at
    least 0.1 rad apart, or a slide a tenth of the arm.

    Args:
        arm: any arm.
        X: (4, 4) tool pose in the base frame.
        near: (n,) the present joint positions.

    Source:
        Levenberg (1944), Marquardt (1963); damping in proportion to the squared residual after Sugihara (2011); starts
        by the additive recurrence of Roberts (2018).
    """
    limited = _Task(arm=arm, X=X, lower=arm.limits.lower, upper=arm.limits.upper)
    tried, reached = _search(limited, near, rounds=1 if _is_too_far(arm, X) else _ROUNDS)
    if not len(reached):
        free = _unlimited(arm, X)
        more = _descend(free, np.concatenate([tried, _starts(limited, near, 0, _STARTS)]))
        reached = np.array([nearest_equivalent(arm, q, near) for q in _reaching(free, more)]).reshape(-1, arm.n)
        tried = np.concatenate([tried, more])
    if not len(reached):
        if arm.n < _POSE:
            free = attrs.evolve(free, weight=_POSITION_FIRST)
            tried = _descend(free, tried)
        distances, angles = pose_errors(arm, tried, X)
        best = nearest_equivalent(arm, tried[np.hypot(distances, free.length * angles).argmin()], near)
        return rank(arm, X, [Candidate(best, "numeric 1")], near, apart=_SAME_CONFIGURATION, X_near=forward(arm, best))
    return ranked(arm, X, near, reached)


def search_from(arm: Arm, X: Array, near: Array, starts: Array, *, more: bool) -> Array:
    """Return the configurations (l, n) that meet one pose, sought from starts (k, n), whatever the limits.

    Args:
        arm: any arm.
        X: (4, 4) tool pose in the base frame.
        near: (n,) the present joint positions.
        starts: (k, n) joint positions.
        more: whether to search within the limits as well, as ``numeric_inverse`` does.
    """
    free = _unlimited(arm, X)
    reached = _reaching(free, _descend(free, starts)) if len(starts) else np.empty((0, arm.n))
    reached = np.array([nearest_equivalent(arm, q, near) for q in reached]).reshape(-1, arm.n)
    if more:
        limited = _Task(arm=arm, X=X, lower=arm.limits.lower, upper=arm.limits.upper)
        reached = np.concatenate([reached, _search(limited, near)[1]])
    return reached


def ranked(
    arm: Arm, X: Array, near: Array, reached: Array, name: Callable[[Array], str] | None = None
) -> InverseSolution:
    """Return the solution made of configurations (k, n) that meet a pose; those of one name are numbered."""
    named = _named(_unlimited(arm, X), reached, near, name or (lambda _: "numeric"))
    return rank(arm, X, named, near, apart=_SAME_CONFIGURATION)


def descend_from(arm: Arm, X: Array, near: Array) -> Array:
    """Return the configurations (k, n) that single descents from configurations ``near`` lead to, whatever the limits.

    For poses close to those of ``near``, as on a path; whether they are met is for the caller to see.

    Args:
        arm: any arm.
        X: (k, 4, 4) tool poses in the base frame.
        near: (k, n) joint positions.
    """
    return _descend(_unlimited(arm, X), near)


def free_joints(arm: Arm, X: Array, q: Array) -> tuple[int, ...]:
    """Return the numbers of the joints that can move, together, without moving the tool; none of a redundant arm.

    Args:
        arm: any arm.
        X: (4, 4) the pose of its tool.
        q: (n,) a configuration there.
    """
    return _free_joints(_unlimited(arm, X), q)


def _unlimited(arm: Arm, X: Array) -> _Task:
    """Return the task without bounds of the joints."""
    endless = np.full(arm.n, np.inf)
    return _Task(arm=arm, X=X, lower=-endless, upper=endless)


def _is_too_far(arm: Arm, X: Array) -> bool:
    """Whether a pose is farther away than an arm of turning joints is long, so that more starts are no use."""
    away = float(np.linalg.norm(X[:3, 3] - arm.base[:3, 3]))
    return all(joint.revolute for joint in arm.joints) and away > stretched_length(arm)


def _search(task: _Task, near: Array, rounds: int = _ROUNDS) -> tuple[Array, Array]:
    """Return all configurations (k, n) that the descents ended in, and those (l, n) that meet the pose."""
    tried = reached = np.empty((0, task.arm.n))
    for number in range(rounds):
        ends = _descend(task, _starts(task, near, number * _STARTS, _STARTS))
        fresh = _reaching(task, ends)
        known = [Candidate(q, "") for q in reached]
        news = any(not any(_same(task, q, other) for other in known) for q in fresh)
        tried, reached = np.concatenate([tried, ends]), np.concatenate([reached, fresh])
        if len(reached) and (task.arm.n > 6 or not news):
            break
    return tried, reached


def _named(task: _Task, reached: Array, near: Array, name: Callable[[Array], str]) -> list[Candidate]:
    """Number the configurations, nearest first, one of each free family."""
    solutions: list[Candidate] = []
    names: Counter[str] = Counter()
    nearest = (nearest_equivalent(task.arm, q, near) for q in reached)
    for q in sorted(nearest, key=lambda q: (bool(violations(task.arm, q)), joint_distance(task.arm, near, q))):
        if any(_same(task, q, other) for other in solutions):
            continue
        names[word := name(q)] += 1
        solutions.append(Candidate(q, f"{word} {names[word]}", _free_joints(task, q)))
    return solutions


def _same(task: _Task, q: Array, other: Candidate) -> bool:
    """Whether a configuration is another one, or nearly so of a redundant arm, or a member of the family free there."""
    arm = task.arm
    locked = [i for i in range(arm.n) if i + 1 not in other.free]
    apart = q - other.q
    apart = np.where(arm.revolute, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart)
    least: float | Array = _SAME_CONFIGURATION
    if arm.n > _POSE:
        least = np.where(arm.revolute, _EXAMPLES_APART, _EXAMPLES_APART * task.size)[locked]
    return bool((np.abs(apart[locked]) < least).all())


def _free_joints(task: _Task, q: Array) -> tuple[int, ...]:
    """Return the numbers of the joints that can move, together, without moving the tool; none of a redundant arm.

    An idle motion of the Jacobian alone is no proof: a stretched arm has one as well, and cannot move. So a step along
    it is made and the error that remains corrected.
    """
    if task.arm.n > 6:
        return ()
    _, J = _residual_and_jacobian(task, q[None], task.X)
    _, sigma, Vt = np.linalg.svd(J[0])
    rank = int((sigma > _IDLE * sigma[0]).sum())
    joints: set[int] = set()
    for idle in Vt[rank:]:
        loose = _unlimited(task.arm, task.X)
        moved = _descend(loose, (q + _FREE_WAY * idle)[None])[0]
        if len(_reaching(loose, moved[None])) and np.linalg.norm(moved - q) > _FREE_WAY / 2:
            joints.update(int(i) + 1 for i in np.flatnonzero(np.abs(moved - q) > _SAME_CONFIGURATION))
    return tuple(sorted(joints))


def _reaching(task: _Task, q: Array) -> Array:
    """Return those of the configurations (k, n) that meet the pose."""
    distance, angle = pose_errors(task.arm, q, task.X)
    return q[(distance <= POSE_TOLERANCE) & (angle <= POSE_TOLERANCE)]


def _descend(task: _Task, q: Array) -> Array:
    """Go from every start (k, n) down to where the residual is least, by damped least squares within the bounds."""
    q, X = q.copy(), np.broadcast_to(task.X, (len(q), 4, 4))
    running = np.arange(len(q))
    damping = np.full(len(q), _DAMPING)
    e, J = _residual_and_jacobian(task, q, X)
    square = np.sum(e**2, axis=-1)
    weights = np.where(task.arm.revolute, task.size**2, 1.0)
    for _ in range(_STEPS):
        moved = _bounded_step(task, q[running], e, J, (damping * square / task.size**2)[:, None] * weights)
        e_moved, J_moved = _residual_and_jacobian(task, moved, X[running])
        square_moved = np.sum(e_moved**2, axis=-1)
        better = square_moved < square
        still = better & (square_moved > (1 - _STILL) * square)
        q[running[better]] = moved[better]
        e[better], J[better] = e_moved[better], J_moved[better]
        square = np.where(better, square_moved, square)
        damping = np.where(better, damping * _SUCCEEDED, damping * _FAILED)
        keep = ~still & (square > (_ROUNDING * task.size) ** 2) & (damping < 1 / _ROUNDING)
        running, e, J, square, damping = running[keep], e[keep], J[keep], square[keep], damping[keep]
        if not len(running):
            break
    return q


def _bounded_step(task: _Task, q: Array, e: Array, J: Array, damping: Array) -> Array:
    """Return configurations (k, n) after one damped step; a joint at a bound that the step would pass holds still."""
    lower, upper = task.lower, task.upper
    H = np.swapaxes(J, -1, -2) @ J
    g = (np.swapaxes(J, -1, -2) @ e[..., None])[..., 0]
    locked = np.zeros(q.shape, dtype=bool)
    diagonal = np.arange(q.shape[-1])
    damping = np.maximum(damping, _LEAST_DAMPING * np.maximum(H[:, diagonal, diagonal], task.size**2))
    step = np.zeros(q.shape)
    for _ in range(2):
        H_held = np.where(locked[:, :, None] | locked[:, None, :], 0.0, H)
        H_held[:, diagonal, diagonal] += np.where(locked, 1.0, damping)
        step = np.linalg.solve(H_held, np.where(locked, 0.0, g)[..., None])[..., 0]
        outwards = ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
        if not outwards.any():
            break
        locked |= outwards
    # More than a radian, or a third of the arm, is no longer the neighbourhood that the step was made for.
    longest = np.where(task.arm.revolute, 1.0, task.size / 3)
    step /= np.maximum(np.max(np.abs(step) / longest, axis=-1, keepdims=True), 1.0)
    return np.clip(q + np.where(locked, 0.0, step), lower, upper)


def _residual_and_jacobian(task: _Task, q: Array, X: Array) -> tuple[Array, Array]:
    """Return the residuals (k, 6) of configurations (k, n) at poses (..., 4, 4) [m], and their Jacobians (k, 6, n)."""
    scalars, lead = per_joint(q), q.shape[:-1]
    frames = link_frames(task.arm, scalars)
    R, p = tool_frame(task.arm, frames[-1])
    R_BT = stack([x for row in R for x in row], lead).reshape(*lead, 3, 3)
    turn = rotation_vector(X[..., :3, :3] @ np.swapaxes(R_BT, -1, -2))
    e = np.concatenate([X[..., :3, 3] - stack(p, lead), task.length * turn], axis=-1)
    columns = frame_columns(task.arm, frames, p)
    J = np.stack([stack(column, lead) for column in columns], axis=-1)
    return e, J * np.repeat((1.0, task.length), 3)[:, None]


def _starts(task: _Task, near: Array, first: int, count: int) -> Array:
    """Return starting configurations ``first`` to ``first + count``, the present one being number 0.

    They fill the box of the limits evenly: each is the last one moved on by the powers of 1/g, where g is the number
    above 1 with gⁿ⁺¹ = g + 1, modulo the box.
    """
    n = task.arm.n
    g = 2.0
    for _ in range(60):
        g = (1 + g) ** (1 / (n + 1))
    fractions = (0.5 + np.arange(first, first + count)[:, None] * g ** -np.arange(1.0, n + 1)) % 1.0
    around = np.clip(near, task.lower, task.upper)
    reach = np.where(task.arm.revolute, math.pi, task.size)
    middle = midpoints(task.lower, task.upper, around)
    low, high = np.maximum(task.lower, middle - reach), np.minimum(task.upper, middle + reach)
    starts: Array = low + fractions * (high - low)
    if first == 0:
        starts[0] = around
    return starts
