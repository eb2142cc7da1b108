"""Whether the bodies of a cell meet at configurations of its arms, of which many are looked at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array, Numbers
from armwright.physics.clearance import ClearanceChecker
from armwright.physics.distances import TOLERANCE
from armwright.spatial.shapes import box_about


class Meeting(NamedTuple):
    """Two bodies that are too near at a configuration.

    Attributes:
        number: of the configuration, from 0.
        bodies: their numbers.
        distance: between them [m]; below 0 where they overlap.
    """

    number: int
    bodies: tuple[int, int]
    distance: float


class NearBodies(NamedTuple):
    """The two bodies that are nearest to one another.

    Attributes:
        names: of both.
        distance: between them [m]; below 0 where they overlap, by how far one has to be moved.
    """

    names: tuple[str, str]
    distance: float


class ConfigurationChecks:
    """The bodies of a cell at configurations of its arms."""

    def __init__(self, checker: ClearanceChecker) -> None:
        """Take the bodies, and which pairs of them may not meet."""
        self._checker = checker
        self._pairs = np.array(checker.pairs, dtype=np.intp).reshape(-1, 2)
        boxes = [box_about(body.solid.shape) for body in checker.bodies]
        self._two_balls = checker.radii[self._pairs].sum(axis=1)
        self._boxes = np.array([box for box, _ in boxes]).reshape(-1, 3)
        self._around = np.array([around for _, around in boxes])

    @property
    def pair_count(self) -> int:
        """The number of pairs that may not meet."""
        return len(self._pairs)

    def first_meeting(self, configurations: Mapping[str, Array], margins: Array) -> Meeting | None:
        """Return the first of several configurations at which bodies are closer than they may be; None for none.

        Args:
            configurations: (k, n) of each arm; (n,) of one that stands.
            margins: (p,) the distance that each pair has to keep [m].
        """
        poses = self._poses_at(configurations)
        nearest = self._least_distances(poses)
        standing: set[int] = set()
        for i in np.flatnonzero((nearest < margins).any(axis=1)).tolist():
            near = np.flatnonzero(nearest[i] < margins)
            moving = set(self._pairs[near].ravel().tolist()) - standing
            for body in moving:
                self._checker.distances.set_pose(body, poses[i, body])
            standing |= {body for body in moving if self._checker.bodies[body].arm is None}
            for (a, b), margin in zip(self._pairs[near].tolist(), margins[near].tolist(), strict=True):
                distance = self._checker.distances.between(a, b, max(margin, TOLERANCE))
                if distance < margin:
                    return Meeting(i, (a, b), distance)
        return None

    def nearest(self, configurations: Mapping[str, Array], within: float) -> NearBodies | None:
        """Return the two bodies that are nearest at one configuration (n,) of each arm; None where none are so near.

        Of bodies that overlap those are the nearest that are deepest in one another.

        Args:
            configurations: of each arm.
            within: distance [m].
        """
        if not len(self._pairs):
            return None
        poses = self._poses_at(configurations)
        bounds = self._balls_apart(poses[0, :, :3, 3])
        near = np.flatnonzero(bounds < within)
        bounds[near] = self._least_distances(poses, near)[0]
        found: tuple[int, int] | None = None
        least, placed = within, set[int]()
        for k in near[np.argsort(bounds[near])].tolist():
            if bounds[k] >= least:
                break
            a, b = self._pairs[k].tolist()
            for body in {a, b} - placed:
                self._checker.distances.set_pose(body, poses[0, body])
                placed.add(body)
            distance = self._checker.distances.between(a, b, max(least, TOLERANCE))
            if distance < least:
                least, found = distance, (a, b)
        if found is None:
            return None
        one, other = (self._checker.bodies[number].name for number in found)
        return NearBodies((one, other), least)

    def distances_of(self, configurations: Mapping[str, Array], within: float) -> Array:
        """Return the distances (p,) of all pairs at one configuration (n,) of each arm [m]; ``within`` where more."""
        poses = self._poses_at(configurations)
        result = np.full(len(self._pairs), within)
        for body, pose in enumerate(poses[0]):
            self._checker.distances.set_pose(body, pose)
        for k in np.flatnonzero(self._least_distances(poses)[0] < within).tolist():
            a, b = self._pairs[k].tolist()
            result[k] = self._checker.distances.between(a, b, within)
        return result

    def _poses_at(self, configurations: Mapping[str, Array]) -> Array:
        """Return the poses (k, b, 4, 4) of all bodies at configurations."""
        rows = {name: np.atleast_2d(q) for name, q in configurations.items()}
        return self._checker.body_poses(self._checker.link_frames(rows))

    def _balls_apart(self, positions: Array) -> Array:
        """Return lower bounds (p,) of the distances of pairs whose bodies are at positions (b, 3): between balls."""
        a, b = self._pairs.T
        return np.asarray(np.linalg.norm(positions[a] - positions[b], axis=1) - self._two_balls)

    def _least_distances(self, poses: Array, of: Numbers | slice = slice(None)) -> Array:
        """Return lower bounds (k, p) of the distances of pairs: from a ball about one body to a box about the other."""
        pairs = self._pairs[of].T
        bounds = np.full((len(poses), pairs.shape[1]), -np.inf)
        positions, R = poses[:, :, :3, 3], poses[:, :, :3, :3]
        for ball, box in (pairs, pairs[::-1]):
            away = positions[:, ball] - positions[:, box]
            inside = np.einsum("kpi,kpij->kpj", away, R[:, box])
            beyond = np.abs(inside) - self._boxes[box]
            # A centre inside the box is as deep in it as the nearest face is away.
            apart = np.linalg.norm(np.maximum(beyond, 0.0), axis=2) + np.minimum(beyond.max(axis=2), 0.0)
            np.maximum(bounds, apart - self._around[box] - self._checker.radii[ball], out=bounds)
        return bounds
