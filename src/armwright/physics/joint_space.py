"""The configurations of an arm in a cell: which are free, and how far apart they are in metres of movement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.motion.obstruction import beyond_limits
from armwright.motion.trajectory import Trajectory
from armwright.physics.clearance import ClearanceChecker, resolution
from armwright.physics.configuration_checks import ConfigurationChecks, Meeting
from armwright.spatial.shapes import farthest

# Distances up to this are looked for [m].
ROOM = 0.01
# Levers are measured at so many configurations.
_SAMPLES = 64
# A joint that moves no body counts as if it moved one by this part of what others do.
_LEAST_LEVER = 0.02
# Configurations nearer than this are the same [rad] or [m].
_SAME = 1e-9


class Margins(NamedTuple):
    """The distances that p pairs of bodies have to keep [m]; minus infinity where they do not count.

    Attributes:
        start: (p,) where a path begins.
        between: (p,) on it.
        end: (p,) where it ends.
    """

    start: Array
    between: Array
    end: Array


class JointSpace:
    """The configurations of an arm in a cell, checked one by one and counted.

    Attributes:
        arm: the arm.
        levers: (n,) how far each joint moves a point of the arm at most [m/rad], or 1.
        step: configurations on a straight leg are checked where the arm has moved by this at most [m].
        checked: number of configurations that were checked.
        left: number that may still be checked.
    """

    def __init__(
        self, checker: ClearanceChecker, arm: str, others: Mapping[str, Trajectory], margin: float | Margins
    ) -> None:
        """Take an arm, and what all others do: they stand where that ends.

        Args:
            checker: the bodies of the cell.
            arm: name of the arm.
            others: motions of all other arms.
            margin: of distance that bodies keep [m], all of them the same or each pair its own.
        """
        self.step, self.checked, self.left = 1.0, 0, 0
        self._checks, self._pairs, self._name = ConfigurationChecks(checker), checker.pairs, arm
        self._standing = {name: motion(motion.duration) for name, motion in others.items()}
        # Pairs that the arm does not move do not count.
        moved = [body.arm == arm and body.link > 0 for body in checker.bodies]
        counting = np.array([moved[a] or moved[b] for a, b in checker.pairs], dtype=bool)
        margins = margin if isinstance(margin, Margins) else Margins(*[np.full(len(counting), margin)] * 3)
        # What comes nearer than can be told counts as a contact on motions.
        self._start, self._least, self._end = (np.where(counting, each + resolution(each), -np.inf) for each in margins)
        self._margins = self._least
        self.arm = checker.arms[arm].arm.arm
        self._ends = np.zeros((0, self.arm.n))
        self.levers = _levers(checker, arm)

    def overlaps(self, q: Array, *, start: bool) -> list[Meeting]:
        """Return the pairs that are too near at the start or an end (n,) of a path, the nearest first."""
        self.checked += 1
        margins = self._start if start else self._end
        distances = self._checks.distances_of(self._at(q), max(float(margins.max(initial=0.0)), ROOM))
        pairs = np.flatnonzero(distances < margins)
        meetings = [Meeting(0, self._pairs[k], float(distances[k])) for k in pairs.tolist()]
        return sorted(meetings, key=lambda meeting: meeting.distance)

    def set_ends(self, ends: Array, room: float) -> None:
        """Keep bodies apart by some room [m], or half of what they are apart at the ends (k, n) of a path."""
        within = float(self._least.max(initial=0.0)) + 2 * room
        distances = np.min([self._checks.distances_of(self._at(q), within) for q in ends], axis=0)
        self._margins = np.where(np.isinf(self._least), -np.inf, np.maximum(self._least, (distances + self._least) / 2))
        self._ends = ends

    def is_free(self, q: Array) -> bool:
        """Whether all of several configurations (k, n) are free; False where no more may be checked."""
        # Joints are kept within their limits by who asks; of coupled drives they do not know.
        if self.arm.coupling is not None and beyond_limits(self.arm, q, np.zeros(len(q))) is not None:
            return False
        inner = ~(np.abs(q[:, None] - self._ends).max(axis=2, initial=0.0) < _SAME).any(axis=1)
        looked_at = q[inner][: self.left]
        meeting = self._checks.first_meeting(self._at(looked_at), self._margins) if len(looked_at) else None
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
    frames = compiled.link_poses(np.random.default_rng(0).uniform(lower, upper, (_SAMPLES, len(joints))))
    levers = np.zeros(len(joints))
    for body in checker.bodies:
        if body.arm == arm:
            centres = (frames[:, body.link] @ body.solid.pose)[:, :3, 3]
            for i in range(body.link):
                away, axis = centres - frames[:, i, :3, 3], frames[:, i, :3, 2]
                across = np.linalg.norm(np.cross(axis, away), axis=1).max()
                levers[i] = max(levers[i], across + farthest(body.solid.shape))
    levers[~compiled.arm.revolute] = 1.0
    return np.asarray(np.maximum(levers, _LEAST_LEVER * levers.max()))
