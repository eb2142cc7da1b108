"""The configurations of an arm in a cell: which are free, and how far apart they are in metres of movement."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from armwright.arrays import Array
from armwright.motion.trajectory import Trajectory
from armwright.physics.clearance import ClearanceChecker, Meeting
from armwright.spatial.shapes import farthest

# Bodies are kept this far apart on a path, or half of what they are apart at its ends where that is less [m].
ROOM = 0.01
# Levers are measured at so many configurations.
_LOOKS = 64
# A joint that moves no body counts as if it moved one by this part of what others do.
_LEAST_LEVER = 0.02
# Configurations nearer than this are the same [rad] or [m].
_SAME = 1e-9


class JointSpace:
    """The configurations of an arm in a cell, checked one by one and counted.

    Attributes:
        arm: the arm.
        levers: (n,) how far each joint moves a point of the arm at most [m/rad], or 1.
        step: configurations on a straight leg are checked where the arm has moved by this at most [m].
        checked: number of configurations that were checked.
        left: number that may still be checked.
    """

    def __init__(self, checker: ClearanceChecker, arm: str, others: Mapping[str, Trajectory], margin: float) -> None:
        """Take an arm, and what all others do: they stand where that ends.

        Args:
            checker: the bodies of the cell.
            arm: name of the arm.
            others: motions of all other arms.
            margin: of distance that bodies keep [m].
        """
        self.step, self.checked, self.left = 1.0, 0, 0
        self._checker, self._name, self._margin = checker, arm, margin
        self._standing = {name: motion(motion.duration) for name, motion in others.items()}
        moved = [body.arm == arm and body.link > 0 for body in checker.bodies]
        # Pairs that the arm does not move do not count.
        self._counting = np.array([moved[a] or moved[b] for a, b in checker.pairs], dtype=bool)
        self._margins = self._least = np.where(self._counting, margin, -np.inf)
        self.arm = checker.arms[arm].arm.arm
        self._ends = np.zeros((0, self.arm.n))
        self.levers = _levers(checker, arm)

    def overlaps(self, q: Array) -> list[Meeting]:
        """Return the pairs of bodies that are nearer at a configuration (n,) than they may be, the nearest first."""
        self.checked += 1
        distances = self._checker.distances_of(self._at(q), self._margin + ROOM)
        pairs = np.flatnonzero(self._counting & (distances < self._margin))
        meetings = [Meeting(0, self._checker.pairs[k], float(distances[k])) for k in pairs.tolist()]
        return sorted(meetings, key=lambda meeting: meeting.distance)

    def set_ends(self, ends: Array) -> None:
        """Keep bodies apart by ``ROOM``, or half of what they are apart at the ends of a path (k, n), which are free."""
        within = self._margin + 2 * ROOM
        distances = np.min([self._checker.distances_of(self._at(q), within) for q in ends], axis=0)
        self._margins = np.where(self._counting, np.maximum(self._margin, (distances + self._margin) / 2), -np.inf)
        self._ends = ends

    def is_free(self, q: Array) -> bool:
        """Whether all of several configurations (k, n) are free; False where no more may be checked."""
        inner = ~(np.abs(q[:, None] - self._ends).max(axis=2, initial=0.0) < _SAME).any(axis=1)
        looked_at = q[inner][: self.left]
        meeting = self._checker.first_meeting(self._at(looked_at), self._margins) if len(looked_at) else None
        count = len(looked_at) if meeting is None else meeting.number + 1
        self.checked += count
        self.left -= count
        return meeting is None and len(looked_at) == int(inner.sum())

    def leg_is_free(self, a: Array, b: Array) -> bool:
        """Whether configurations on the straight leg from one (n,) to another are free, the other included."""
        count = max(int(np.ceil(np.abs(b - a) @ self.levers / self.step)), 1)
        return self.is_free(a + _coarse_first(count)[:, None] * (b - a))

    def _at(self, q: Array) -> dict[str, Array]:
        return {**self._standing, self._name: q}


def _coarse_first(count: int) -> Array:
    """Return the parts 1/count to 1, the last first, then such as halve what has been left."""
    back = np.arange(count)
    # The more often a number can be halved, the earlier.
    twos = back & -back
    order = np.argsort(np.where(back == 0, -count, -twos), kind="stable")
    return np.asarray(1 - order / count)


def _levers(checker: ClearanceChecker, arm: str) -> Array:
    """Return the largest levers (n,) of the joints of an arm, at random configurations that are always the same."""
    compiled = checker.arms[arm].arm
    limits, joints = compiled.arm.limits, compiled.arm.joints
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    frames = compiled.link_poses(np.random.default_rng(0).uniform(lower, upper, (_LOOKS, len(joints))))
    levers = np.zeros(len(joints))
    for body in checker.bodies:
        if body.arm == arm:
            centres = (frames[:, body.link] @ body.solid.pose)[:, :3, 3]
            for i in range(body.link):
                away, axis = centres - frames[:, i, :3, 3], frames[:, i, :3, 2]
                across = np.linalg.norm(np.cross(axis, away), axis=1).max()
                levers[i] = max(levers[i], across + farthest(body.solid.shape))
    levers[~compiled.arm.revolute] = 1.0
    return np.maximum(levers, _LEAST_LEVER * levers.max())
