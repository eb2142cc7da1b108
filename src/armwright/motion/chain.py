"""Postures along a path: each next to the one before it."""

import numpy as np

from armwright.arrays import Array, Flags
from armwright.kinematics.inverse.numeric import next_posture
from armwright.kinematics.inverse.turns import nearest_turn, travel
from armwright.motion.solver import Solver

# A pose is met to this [m], and to this in the entries of its rotation.
MET, _TURN_MET = 1e-8, 1e-6
# A joint that moves farther from pose to pose may have jumped from one posture to another [rad] or [m].
_JUMP = 1.0
# A posture this far from the one the arm has at the start of the path is another one [rad] or [m].
_OTHER = 1e-6


def chain(solver: Solver, X: Array, q_start: Array) -> tuple[Array, int | None]:
    """Solve the poses of a path one after the other.

    A free joint stays where it was at the pose before. Without a closed form each posture is sought from the one
    before it.

    Args:
        solver: the arm.
        X: (k, 4, 4) poses, of which the first is that of ``q_start``.
        q_start: (n,) joint positions at the first pose.

    Returns:
        (k, n) postures, and the number of the first pose that is not met; None where all are. Postures beyond that
        one mean nothing.
    """
    q = np.empty((len(X), solver.arm.n))
    q[:] = q_start
    if solver.inverse_branches is None:
        for k in range(1, len(X)):
            q[k] = next_posture(solver.arm, X[k], q[k - 1])
            if _missed(solver, q[k], X[k]):
                break
    else:
        found, singular = solver.inverse_branches(X, q_start)
        if _along_one_branch(solver, found, singular, q) and not _missed(solver, q, X).any():
            return q, None
        for k in range(1, len(X)):
            candidates = solver.inverse_branches(X[k], q[k - 1])[0] if singular[k].any() else found[k]
            candidates = nearest_turn(solver.arm, candidates, q[k - 1])
            q[k] = min(candidates, key=lambda posture: travel(solver.arm, q[k - 1], posture))
    missed = np.flatnonzero(_missed(solver, q, X))
    return q, int(missed[0]) if len(missed) else None


def _along_one_branch(solver: Solver, found: Array, singular: Array, q: Array) -> bool:
    """Fill in the branch that the first posture belongs to, where it goes on to the end without a jump."""
    branch = int(np.abs(found[0] - q[0]).max(axis=-1).argmin())
    steps = np.diff(found[:, branch], axis=0)
    turns = np.array([joint.revolute for joint in solver.arm.joints])
    steps -= np.where(turns, 2 * np.pi * np.round(steps / (2 * np.pi)), 0.0)
    if singular[:, branch].any() or np.abs(found[0, branch] - q[0]).max() > _OTHER or np.abs(steps).max() > _JUMP:
        return False
    q[1:] = q[0] + np.cumsum(steps, axis=0)
    return True


def _missed(solver: Solver, q: Array, X: Array) -> Flags:
    """Return which postures (..., n) do not meet their poses (..., 4, 4): an arm of few joints may turn otherwise."""
    off = np.abs(solver.forward(q) - X)
    return np.asarray((off[..., :3, 3].max(axis=-1) > MET) | (off[..., :3, :3].max(axis=(-2, -1)) > _TURN_MET))
