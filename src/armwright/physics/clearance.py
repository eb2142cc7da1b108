"""Whether the bodies of a cell meet on motions: decided along the whole way, not at samples.

At a configuration where two solids are d apart they cannot meet before both together have moved by d. How far a solid
can move follows from how far the joints before it move, and from its distances from their axes. An interval of time is
clear where that is less than the distance in its middle, for every pair of solids; otherwise it is halved for the pairs
that are left, until no pair can come closer by more than the resolution.

Source:
    Schwarzer, Saha & Latombe (2005), Adaptive dynamic collision checking for single and multiple articulated robots in
    complex environments.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm
from armwright.motion.trajectory import Trajectory
from armwright.physics.distances import TOLERANCE, Distances
from armwright.spatial.shapes import Solid, farthest

Numbers: TypeAlias = npt.NDArray[np.intp]

# Pairs that may come closer by no more than this are decided by their distance [m].
RESOLUTION = 0.5e-3
# Intervals that a motion is cut into at first, and that are looked at together.
_FIRST, _BATCH = 16, 512


class Body(NamedTuple):
    """A solid of a cell.

    Attributes:
        name: in messages.
        solid: in the frame of the link that carries it; in the world where none does.
        arm: the arm that carries it; None where it stands.
        link: of the arm, from 1; 0 is its base.
    """

    name: str
    solid: Solid
    arm: str | None = None
    link: int = 0


class PlacedArm(NamedTuple):
    """An arm in a cell.

    Attributes:
        arm: the arm.
        base: (4, 4) pose of its base frame in the world.
    """

    arm: CompiledArm
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


class _Interval(NamedTuple):
    """An interval of time, and the pairs of bodies that may meet on it."""

    start: float
    end: float
    pairs: Numbers


class ClearanceChecker:
    """The bodies of a cell, and which pairs of them may not meet."""

    def __init__(self, arms: Mapping[str, PlacedArm], bodies: Sequence[Body], pairs: Sequence[tuple[int, int]]) -> None:
        """Take the bodies.

        Args:
            arms: by name.
            bodies: with their arms among those.
            pairs: the numbers of bodies that may not meet.
        """
        self._arms, self._bodies = arms, bodies
        self._pairs = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        self._distances = Distances([body.solid.shape for body in bodies])
        self._radii = np.array([farthest(body.solid.shape) for body in bodies])

    def first_contact(self, motions: Mapping[str, Trajectory], margin: float = 0.0) -> Closest | None:
        """Return where bodies come closer than a margin for the first time while arms move; None where none do.

        Args:
            motions: of all arms, from the same time on; an arm whose motion ends stands.
            margin: of distance that is kept [m].
        """
        duration = max(motion.duration for motion in motions.values())
        times = np.linspace(0.0, duration, _FIRST + 1)
        every = np.arange(len(self._pairs))
        # Intervals with the pairs that are left, the earliest last.
        left = [_Interval(times[i], times[i + 1], every) for i in reversed(range(_FIRST))]
        while left:
            batch = [left.pop() for _ in range(min(_BATCH, len(left)))]
            halves: list[_Interval] = []
            for interval, (near, contact) in zip(batch, self._decide(motions, batch, margin), strict=True):
                if contact is not None and not halves:
                    return contact
                # Something may be earlier than a contact: it is looked at again when that is decided.
                pairs = near if contact is None else np.append(near, self._number_of(contact.bodies))
                if len(pairs):
                    middle = (interval.start + interval.end) / 2
                    halves += [_Interval(interval.start, middle, pairs), _Interval(middle, interval.end, pairs)]
            left += reversed(halves)
        return None

    def _number_of(self, bodies: tuple[int, int]) -> int:
        return int(np.flatnonzero((self._pairs == bodies).all(axis=1))[0])

    def _decide(
        self, motions: Mapping[str, Trajectory], batch: Sequence[_Interval], margin: float
    ) -> list[tuple[Numbers, Closest | None]]:
        """Return for intervals the pairs that are left, and the closest of those that meet."""
        starts, ends = np.array([x.start for x in batch]), np.array([x.end for x in batch])
        poses, moved = self._placed(motions, starts, ends)
        centres = poses[:, :, :3, 3]
        results: list[tuple[Numbers, Closest | None]] = []
        for i, (start, end, pairs) in enumerate(batch):
            a, b = self._pairs[pairs].T
            closer = moved[i, a] + moved[i, b] + margin + TOLERANCE
            apart = np.linalg.norm(centres[i, a] - centres[i, b], axis=1) - self._radii[a] - self._radii[b]
            near = np.flatnonzero(apart < closer)
            left, contact = [], None
            for body in {*a[near].tolist(), *b[near].tolist()}:
                self._distances.place(body, poses[i, body])
            for k in near.tolist():
                bodies = int(a[k]), int(b[k])
                distance = self._distances.between(*bodies, within=closer[k])
                if distance >= closer[k]:
                    continue
                if closer[k] - margin - TOLERANCE <= RESOLUTION:
                    if contact is None or distance < contact.distance:
                        contact = Closest(distance, bodies, float(start + end) / 2)
                else:
                    left.append(pairs[k])
            results.append((np.array(left, dtype=np.intp), contact))
        return results

    def _placed(self, motions: Mapping[str, Trajectory], starts: Array, ends: Array) -> tuple[Array, Array]:
        """Return the poses (k, b, 4, 4) of all bodies in the middle of intervals, and how far they may be from there.

        The second are upper bounds (k, b) of the distance that a point of a body moves from the middle to any time of
        the interval.
        """
        middles = (starts + ends) / 2
        poses = np.empty((len(starts), len(self._bodies), 4, 4))
        moved = np.zeros((len(starts), len(self._bodies)))
        for name, placed in self._arms.items():
            motion = motions[name]
            frames = placed.base @ placed.arm.link_poses(motion(middles))
            changes = _largest_changes(motion, starts, ends)
            for number, body in enumerate(self._bodies):
                if body.arm == name:
                    poses[:, number] = frames[:, body.link] @ body.solid.pose
                    carried = frames[:, : body.link + 1]
                    moved[:, number] = _movement(
                        placed.arm.arm, carried, poses[:, number], self._radii[number], changes
                    )
        for number, body in enumerate(self._bodies):
            if body.arm is None:
                poses[:, number] = body.solid.pose
        return poses, moved


def _movement(arm: Arm, frames: Array, pose: Array, radius: float, changes: Array) -> Array:
    """Return upper bounds (k,) of how far a point of a body moves while joints move.

    The joints may be moved one after the other, the outermost first: then each axis is where it was, and the body is as
    much farther from it as it has been moved before.

    Args:
        arm: that carries the body.
        frames: (k, l + 1, 4, 4) poses of the frames up to that of the link that carries it.
        pose: (k, 4, 4) of the body.
        radius: of the body about its origin [m].
        changes: (k, n) how far each joint moves [rad] or [m].
    """
    total = np.zeros(len(frames))
    for i in reversed(range(frames.shape[1] - 1)):
        lever: Array = np.ones(len(frames))
        if arm.joints[i].revolute:
            axis, away = frames[:, i, :3, 2], pose[:, :3, 3] - frames[:, i, :3, 3]
            across = away - (away * axis).sum(axis=1)[:, None] * axis
            lever = np.linalg.norm(across, axis=1) + radius + total
        total = total + changes[:, i] * lever
    return total


def _largest_changes(motion: Trajectory, starts: Array, ends: Array) -> Array:
    """Return how far each joint may be from its position in the middle of intervals (k,), (k, n)."""
    peaks = motion.segment_peaks(1)
    first = np.clip(np.searchsorted(motion.times, starts, side="right") - 1, 0, len(peaks) - 1)
    last = np.clip(np.searchsorted(motion.times, ends, side="left") - 1, 0, len(peaks) - 1)
    spans = zip(first.tolist(), np.maximum(first, last).tolist(), strict=True)
    fastest = np.array([peaks[i : j + 1].max(axis=0) for i, j in spans])
    return np.asarray(fastest * ((ends - starts) / 2)[:, None])
