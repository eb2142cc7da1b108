"""Whether the bodies of a cell meet on motions: decided along the whole path, not at samples.

At a configuration where two solids are d apart they cannot meet before both together have moved by d. How far a solid
can move follows from how far the joints before it move, and from its distances from their axes. An interval of time is
clear where that is less than the distance in its middle, for every pair of solids; otherwise it is halved for the pairs
that are left, until no pair can come closer by more than the resolution.

Source:
    Schwarzer, Saha & Latombe (2005), Adaptive dynamic collision checking for single and multiple articulated robots in
    complex environments.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, Numbers
from armwright.motion.trajectory import Trajectory
from armwright.physics.cell_bodies import Body
from armwright.physics.distances import TOLERANCE, Distances
from armwright.spatial.shapes import farthest

# Pairs that may come closer by no more than this are decided by their distance [m].
RESOLUTION = 0.5e-3
# Intervals that a motion is cut into at first, and that are looked at together.
_FIRST, _BATCH = 16, 512
# Intervals that are looked at together where those with the smallest distances come first.
_CLOSEST_FIRST = 64
# Least distances are found to this part of them, allowed overlaps are followed to this part.
_PART_OF_DISTANCE, _PART_OF_OVERLAP = 0.1, 0.1
# Farther apart no two bodies of a cell are [m].
_FAR = 1e4


class LinkPoses(Protocol):
    """An arm, compiled or not."""

    @property
    def arm(self) -> Arm:
        """The arm."""

    def link_poses(self, q: ArrayLike) -> Array:
        """Return the poses (k, n + 2, 4, 4) of all frames in the base frame, for positions (k, n)."""


class PlacedArm(NamedTuple):
    """An arm in a cell.

    Attributes:
        arm: the arm.
        base: (4, 4) pose of its base frame in the world.
    """

    arm: LinkPoses
    base: Array


class Closest(NamedTuple):
    """Where two bodies are closest on motions, or where they meet first.

    Attributes:
        distance: between them [m]; below 0 where they overlap. It may be less by the resolution somewhere.
        bodies: their numbers.
        time: when that is [s].
    """

    distance: float
    bodies: tuple[int, int]
    time: float


class Least(NamedTuple):
    """The least distance on motions.

    Attributes:
        closest: the least that was found; None where no two bodies come within the distance that was looked at.
        bound: no two bodies are closer than this anywhere [m].
    """

    closest: Closest | None
    bound: float


class Window(NamedTuple):
    """An interval of time, and the pairs of bodies that are looked at on it.

    Attributes:
        start: [s].
        end: [s].
        pairs: (k,) numbers of the pairs.
        margins: (k,) the distance that each has to keep [m]; below 0 where so deep an overlap is allowed.
    """

    start: float
    end: float
    pairs: Numbers
    margins: Array

    def halves(self, indices: Numbers) -> list[Window]:
        """Return both halves of the interval, with some of its pairs, by their indices."""
        middle = (self.start + self.end) / 2
        ends = (self.start, middle), (middle, self.end)
        return [Window(start, end, self.pairs[indices], self.margins[indices]) for start, end in ends]

    def cut(self) -> list[Window]:
        """Return the intervals that this one is cut into at first."""
        times = np.linspace(self.start, self.end, (_FIRST if self.end > self.start else 1) + 1).tolist()
        return [self._replace(start=start, end=end) for start, end in pairwise(times)]


class _Near(NamedTuple):
    """The pairs of a window that are too near each other to be clear on all of it.

    Attributes:
        indices: (k,) indices of the pairs of the window.
        distances: (k,) between them in the middle [m].
        moved: (k,) the most that their distances may change by until the start or the end [m].
    """

    indices: Numbers
    distances: Array
    moved: Array


class ClearanceChecker:
    """The bodies of a cell, and which pairs of them may not meet."""

    def __init__(self, arms: Mapping[str, PlacedArm], bodies: Sequence[Body], pairs: Sequence[tuple[int, int]]) -> None:
        """Take the bodies.

        Args:
            arms: by name.
            bodies: with their arms among those.
            pairs: the numbers of bodies that may not meet.
        """
        self.arms = arms
        self.distances = Distances([body.solid.shape for body in bodies])
        self.radii = np.array([farthest(body.solid.shape) for body in bodies])
        self._arrange(bodies, pairs)

    def _arrange(self, bodies: Sequence[Body], pairs: Sequence[tuple[int, int]]) -> None:
        self._bodies = bodies
        self._pairs = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        a, b = self._pairs.T
        arms = np.array([body.arm or "" for body in bodies])
        links = np.array([body.link for body in bodies], dtype=np.intp)
        self._solid_poses = np.array([body.solid.pose for body in bodies]).reshape(-1, 4, 4)
        carried = {body.arm: np.flatnonzero(arms == body.arm) for body in bodies if body.arm is not None}
        self._carried = {name: (numbers, links[numbers]) for name, numbers in carried.items()}
        # Two bodies of one arm are moved past each other by the joints between them only.
        self._of_one = (arms[a] == arms[b]) & (arms[a] != "")
        self._from = np.where(self._of_one, np.minimum(links[a], links[b]), 0)
        self._outer = np.where(self._of_one & (links[a] > links[b]), a, b)

    @property
    def bodies(self) -> Sequence[Body]:
        """The bodies."""
        return self._bodies

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The numbers of bodies that may not meet."""
        return [(a, b) for a, b in self._pairs.tolist()]

    def rearranged(
        self,
        bodies: Sequence[Body],
        pairs: Sequence[tuple[int, int]],
        further: Mapping[str, PlacedArm] | None = None,
    ) -> ClearanceChecker:
        """Return a checker of the same solids, which other links carry or which are at other poses.

        Args:
            bodies: in the same order, each with its shape.
            pairs: the numbers of bodies that may not meet.
            further: more arms that carry bodies, by name.
        """
        other = copy.copy(self)
        other.arms = {**self.arms, **(further or {})}
        ClearanceChecker._arrange(other, bodies, pairs)
        return other

    def first_contact(
        self, motions: Mapping[str, Trajectory], margin: float = 0.0, windows: Sequence[Window] | None = None
    ) -> Closest | None:
        """Return where bodies come closer than a margin for the first time while arms move; None where none do.

        Args:
            motions: of all arms, from the same time on; an arm whose motion ends stands.
            margin: of distance that is kept [m].
            windows: what is looked at, one after the other; all pairs all the time when left out.
        """
        if windows is None:
            end, count = max(motion.duration for motion in motions.values()), len(self._pairs)
            windows = [Window(0.0, end, np.arange(count), np.full(count, margin))]
        # What is left, the earliest last.
        pending = [piece for window in reversed(windows) for piece in reversed(window.cut())]
        while pending:
            batch = [pending.pop() for _ in range(min(_BATCH, len(pending)))]
            halves: list[Window] = []
            for window, near in zip(batch, self._near(motions, batch, [it.margins for it in batch]), strict=True):
                if not len(near.indices):
                    continue
                margins = window.margins[near.indices]
                touching = np.flatnonzero(near.moved <= resolution(margins))
                if len(touching) and not halves:
                    return self._closest(window, near, touching[near.distances[touching].argmin()])
                # Something may be earlier than a contact: it is looked at again when that is decided.
                halves += window.halves(near.indices)
            pending += reversed(halves)
        return None

    def least(
        self,
        motions: Mapping[str, Trajectory],
        windows: Sequence[Window],
        within: float,
        evaluations: int = 20_000,
    ) -> Least:
        """Return the least distance between bodies while arms move, to 0.5 mm or a tenth of it.

        Args:
            motions: of all arms, from the same time on; an arm whose motion ends stands.
            windows: what is looked at; the margins of their pairs do not count.
            within: larger distances are not looked for [m].
            evaluations: distances that are computed, a few more or less; where they do not suffice the bound is worse.
        """
        best: Closest | None = None
        enough = within
        # What may be closer than the best that is known, with a lower bound of its distances.
        pending = [(-math.inf, piece) for window in windows for piece in window.cut()]
        while pending and evaluations > 0:
            pending.sort(key=lambda entry: entry[0])
            batch, pending = [window for _, window in pending[:_CLOSEST_FIRST]], pending[_CLOSEST_FIRST:]
            for window, near in zip(batch, self._near(motions, batch, [enough] * len(batch)), strict=True):
                evaluations -= len(near.indices)
                if not len(near.indices):
                    continue
                if near.distances.min() < (within if best is None else best.distance):
                    best = self._closest(window, near, int(near.distances.argmin()))
                    enough = best.distance - max(RESOLUTION, _PART_OF_DISTANCE * best.distance)
                bounds = near.distances - near.moved
                close = np.flatnonzero(bounds < enough)
                if len(close):
                    bound = float(bounds[close].min())
                    pending += [(bound, half) for half in window.halves(near.indices[close])]
            pending = [entry for entry in pending if entry[0] < enough]
        return Least(best, min([enough, *(bound for bound, _ in pending)]))

    def distances_at(self, motions: Mapping[str, Trajectory], times: Array, pairs: Numbers, within: float) -> Array:
        """Return the distances (t, k) of some pairs at times (t,) [m]; ``within`` where they are more."""
        windows = [Window(time, time, pairs, np.zeros(len(pairs))) for time in times.tolist()]
        result = np.full((len(times), len(pairs)), within)
        for row, near in zip(result, self._near(motions, windows, [within] * len(windows)), strict=True):
            row[near.indices] = near.distances
        return result

    def poses(self, motions: Mapping[str, Trajectory], times: Array) -> Array:
        """Return the poses (k, b, 4, 4) of all bodies in the world at times (k,) [s]."""
        return self.body_poses(self.link_frames({name: motions[name](times) for name in self.arms}))

    def link_frames(self, configurations: Mapping[str, Array]) -> dict[str, Array]:
        """Return the frames (k, n + 2, 4, 4) of arms in the world, by name, at joint positions (k, n)."""
        return {name: self.arms[name].base @ self.arms[name].arm.link_poses(q) for name, q in configurations.items()}

    def body_poses(self, frames: Mapping[str, Array]) -> Array:
        """Return the poses (k, b, 4, 4) of all bodies in the world, where the frames of all arms are there.

        Args:
            frames: (k, n + 2, 4, 4) of each arm, or (1, n + 2, 4, 4) of one that stands.
        """
        poses = np.empty((max(map(len, frames.values()), default=1), len(self._bodies), 4, 4))
        poses[:] = self._solid_poses
        for name, (numbers, links) in self._carried.items():
            poses[:, numbers] = frames[name][:, links] @ self._solid_poses[numbers]
        return poses

    def nearest_points(self, motions: Mapping[str, Trajectory], time: float, bodies: tuple[int, int]) -> Array:
        """Return the points (2, 3) of two bodies that are nearest to each other, or deepest in each other [m]."""
        poses = self.poses(motions, np.array([time]))
        for body in bodies:
            self.distances.set_pose(body, poses[0, body])
        return self.distances.nearest(*bodies, within=_FAR).points

    def _closest(self, window: Window, near: _Near, index: int) -> Closest:
        a, b = self._pairs[window.pairs[near.indices[index]]].tolist()
        return Closest(float(near.distances[index]), (a, b), (window.start + window.end) / 2)

    def _near(
        self, motions: Mapping[str, Trajectory], batch: Sequence[Window], margins: Sequence[Array | float]
    ) -> list[_Near]:
        """Return for windows the pairs that may come closer than their margins on them."""
        starts, ends = np.array([x.start for x in batch]), np.array([x.end for x in batch])
        poses, moved = self._placed(motions, starts, ends)
        centres = poses[:, :, :3, 3]
        results: list[_Near] = []
        for i, window in enumerate(batch):
            pairs = window.pairs
            a, b = self._pairs[pairs].T
            both = np.where(self._of_one[pairs], 0.0, moved[i, a, 0])
            change = moved[i, self._outer[pairs], self._from[pairs]] + both
            closer = change + margins[i] + TOLERANCE
            apart = np.linalg.norm(centres[i, a] - centres[i, b], axis=1) - self.radii[a] - self.radii[b]
            near = np.flatnonzero(apart < closer)
            for body in {*a[near].tolist(), *b[near].tolist()}:
                self.distances.set_pose(body, poses[i, body])
            queries = zip(a[near].tolist(), b[near].tolist(), np.maximum(closer[near], TOLERANCE).tolist(), strict=True)
            distances = np.array([self.distances.between(first, second, within) for first, second, within in queries])
            kept = distances < closer[near]
            indices = near[kept]
            results.append(_Near(indices, distances[kept], change[indices]))
        return results

    def _placed(self, motions: Mapping[str, Trajectory], starts: Array, ends: Array) -> tuple[Array, Array]:
        """Return the poses (k, b, 4, 4) of all bodies in the middle of intervals, and how far they may be from there.

        The second are upper bounds (k, b, l + 1) of the distance that a point of a body moves from the middle to any
        time of the interval, as seen from the base of its arm and from each of its links.
        """
        middles = (starts + ends) / 2
        frames = self.link_frames({name: motions[name](middles) for name in self.arms})
        poses = self.body_poses(frames)
        links = max((placed.arm.arm.n for placed in self.arms.values()), default=0)
        moved = np.zeros((len(starts), len(self._bodies), links + 1))
        for name, placed in self.arms.items():
            changes = _largest_changes(motions[name], starts, ends)
            for number, body in enumerate(self._bodies):
                if body.arm == name:
                    carried = frames[name][:, : body.link + 1]
                    moved[:, number, : body.link + 1] = _movement(
                        placed.arm.arm, carried, poses[:, number], self.radii[number], changes
                    )
        return poses, moved


def resolution(margins: Array) -> Array:
    """Return by how much nearer than their margins pairs (k,) count as too near [m].

    An allowed overlap is followed more closely.
    """
    return np.where(margins < 0, np.minimum(-_PART_OF_OVERLAP * margins, RESOLUTION), RESOLUTION)


def _movement(arm: Arm, frames: Array, pose: Array, radius: float, changes: Array) -> Array:
    """Return upper bounds (k, l + 1) of how far a point of a body moves while joints move, seen from frames 0 to l.

    The joints may be moved one after the other, the outermost first: then each axis is where it was, and the body is as
    much farther from it as it has been moved before.

    Args:
        arm: that carries the body.
        frames: (k, l + 1, 4, 4) poses of the frames up to that of the link that carries it.
        pose: (k, 4, 4) of the body.
        radius: of the body about its origin [m].
        changes: (k, n) how far each joint moves [rad] or [m].
    """
    totals = np.zeros(frames.shape[:2])
    for i in reversed(range(frames.shape[1] - 1)):
        lever: Array = np.ones(len(frames))
        if arm.joints[i].revolute:
            axis, away = frames[:, i, :3, 2], pose[:, :3, 3] - frames[:, i, :3, 3]
            across = away - (away * axis).sum(axis=1)[:, None] * axis
            lever = np.linalg.norm(across, axis=1) + radius + totals[:, i + 1]
        totals[:, i] = totals[:, i + 1] + changes[:, i] * lever
    return totals


def _largest_changes(motion: Trajectory, starts: Array, ends: Array) -> Array:
    """Return how far each joint may be from its position in the middle of intervals (k,), (k, n)."""
    peaks = motion.segment_peaks(1)
    first = np.clip(np.searchsorted(motion.times, starts, side="right") - 1, 0, len(peaks) - 1)
    last = np.clip(np.searchsorted(motion.times, ends, side="left") - 1, 0, len(peaks) - 1)
    spans = zip(first.tolist(), np.maximum(first, last).tolist(), strict=True)
    fastest = np.array([peaks[i : j + 1].max(axis=0) for i, j in spans])
    return np.asarray(fastest * ((ends - starts) / 2)[:, None])
