"""Which bodies of an arm may not meet one another.

The bodies of an arm are its base (0), its links (1 to n), and what its tool holds (n + 1). All pairs of them are
checked but

- neighbours: bodies that one joint joins, or that are fixed to one another. A body without solids is passed over, so
  that the bodies before and behind it are neighbours;
- pairs that touch in all of 10,000 random configurations: solids about one joint that overlap by design. A pair that is
  apart in a single one of them is checked;
- pairs that the arm file leaves out. It may also have neighbours and pairs that always touch checked.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from armwright.arm.collision_pairs import Pair
from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array, Flags
from armwright.kinematics.forward_kinematics import link_poses
from armwright.physics.cell_bodies import Body, arm_bodies
from armwright.physics.clearance import RESOLUTION
from armwright.physics.distances import Distances
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere, farthest

# Configurations that a pair must touch in to be left out, and what they are drawn from.
CONFIGURATIONS, _SEED = 10_000, 0
# Configurations that are looked at first: most pairs are apart in one of them.
_FIRST = 50


class LeftOut(NamedTuple):
    """A pair of bodies of an arm that is not checked.

    Attributes:
        bodies: their numbers: 0 is the base, n + 1 what the tool holds.
        reason: why not, in words.
    """

    bodies: Pair
    reason: str


class SelfPairs(NamedTuple):
    """The pairs of bodies of an arm, all of which have solids.

    Attributes:
        checked: the numbers of bodies that may not meet, the smaller one first.
        left_out: those that are not checked.
    """

    checked: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...]


def self_pairs(arm: Arm, bodies: Iterable[Body] | None = None, held: Iterable[Body] = ()) -> SelfPairs:
    """Return which bodies of an arm may not meet one another: ``self_pairs(arm).checked``.

    The same arm has the same pairs every time. Numbers are those of links (``Body.link``), 0 is the base, and n + 1
    what the tool holds.

    Args:
        arm: the arm, with n joints.
        bodies: of its base and its links; those of ``arm_bodies`` when left out.
        held: of a gripper, which counts as one body of its own, in the frame of the last link.
    """
    if bodies is None:
        bodies = arm_bodies(arm.name, arm)
    solids: list[list[Solid]] = [[] for _ in range(arm.n + 2)]
    for body in bodies:
        solids[body.link].append(body.solid)
    solids[arm.n + 1] = [body.solid for body in held]
    present = [number for number, own in enumerate(solids) if own]
    neighbours = set(pairwise(present))
    touching = _Touching(arm, solids)
    checked: list[Pair] = []
    left_out: list[LeftOut] = []
    for pair in combinations(present, 2):
        if pair in arm.collisions.check:
            checked.append(pair)
        elif pair in arm.collisions.leave_out:
            left_out.append(LeftOut(pair, "left out by the arm file"))
        elif pair in neighbours:
            left_out.append(LeftOut(pair, _neighbours(arm, *pair)))
        elif touching.always(*pair):
            left_out.append(LeftOut(pair, f"touch in all of {CONFIGURATIONS:,} random configurations"))
        else:
            checked.append(pair)
    return SelfPairs(tuple(checked), tuple(left_out))


def random_configurations(arm: Arm) -> Array:
    """Return the configurations (10000, n) by which bodies always touch: within limits, the same every time."""
    lower, upper = ranges(arm)
    draws = np.random.default_rng(_SEED).random((CONFIGURATIONS, arm.n))
    return np.asarray(lower + draws * (upper - lower))


def _neighbours(arm: Arm, a: int, b: int) -> str:
    """Say why two bodies are neighbours."""
    if b == arm.n + 1 and a == arm.n:
        return "neighbours: fixed to one another"
    if b == a + 1:
        return f"neighbours: joint {b} joins them"
    between = "link" if b == a + 2 else "links"
    numbers = f"{a + 1}" if b == a + 2 else f"{a + 1} to {min(b - 1, arm.n)}"
    return f"neighbours: {between} {numbers} between them without solids"


class _Touching:
    """The bodies of an arm in random configurations."""

    def __init__(self, arm: Arm, solids: Sequence[Sequence[Solid]]) -> None:
        self._arm, self._solids = arm, solids
        self._distances: Distances | None = None
        self._numbers: dict[tuple[int, int], int] = {}
        self._configurations = random_configurations(arm)

    @cached_property
    def _first(self) -> Array:
        return self._frames(self._configurations[:_FIRST])

    @cached_property
    def _others(self) -> Array:
        return self._frames(self._configurations[_FIRST:])

    def _frames(self, configurations: Array) -> Array:
        """Return the frames (k, n + 2, 4, 4) of all bodies at configurations (k, n)."""
        frames = link_poses(self._arm, configurations)
        # What the tool holds is in the frame of the last link.
        frames[:, self._arm.n + 1] = frames[:, self._arm.n]
        return frames

    def always(self, a: int, b: int) -> bool:
        """Whether two bodies touch in all configurations, to the resolution of motions."""
        return self._all(a, b, self._first) and self._all(a, b, self._others)

    def _all(self, a: int, b: int, frames: Array) -> bool:
        """Whether two bodies touch where their frames are (k, n + 2, 4, 4)."""
        frames_a, frames_b = frames[:, a], frames[:, b]
        touch = np.zeros(len(frames_a), dtype=bool)
        unknown: list[tuple[tuple[int, int], tuple[int, int], Flags]] = []
        for i, solid in enumerate(self._solids[a]):
            for j, other in enumerate(self._solids[b]):
                surely, maybe = touch_bounds(solid, other, frames_a, frames_b)
                touch |= surely
                if (maybe & ~surely).any():
                    unknown.append(((a, i), (b, j), maybe & ~surely))
        for k in np.flatnonzero(~touch).tolist():
            if not any(maybe[k] and self._touch(first, second, frames[k]) for first, second, maybe in unknown):
                return False
        return True

    def _touch(self, first: tuple[int, int], second: tuple[int, int], frames: Array) -> bool:
        """Whether two solids, each by its body and its number there, touch at frames (n + 2, 4, 4)."""
        if self._distances is None:
            every = [(body, i) for body, own in enumerate(self._solids) for i in range(len(own))]
            self._numbers = {key: number for number, key in enumerate(every)}
            self._distances = Distances([self._solids[body][i].shape for body, i in every])
        for body, i in (first, second):
            self._distances.set_pose(self._numbers[body, i], frames[body] @ self._solids[body][i].pose)
        return self._distances.between(self._numbers[first], self._numbers[second], 2 * RESOLUTION) < RESOLUTION


class _Rod(NamedTuple):
    """A capsule along an axis of a solid, about its origin: half its length, its radius and the number of the axis."""

    half: float
    radius: float
    axis: int = 2


def touch_bounds(one: Solid, other: Solid, frames: Array, others: Array) -> tuple[Flags, Flags]:
    """Return in which configurations (k,) two solids touch for sure, and in which they may.

    Capsules within the solids, and capsules around them, bound their distance: for capsules and spheres exactly.

    Args:
        one: a solid.
        other: another one.
        frames: (k, 4, 4) poses of the frame of the first.
        others: (k, 4, 4) poses of that of the second.
    """
    # One product of large matrices is faster than many of small ones.
    X, Y = ((it.reshape(-1, 4) @ solid.pose).reshape(-1, 4, 4) for it, solid in ((frames, one), (others, other)))
    inner = _gap(_within(one.shape), X, _within(other.shape), Y)
    outer = _gap(_around(one.shape), X, _around(other.shape), Y)
    return inner < RESOLUTION, outer < RESOLUTION


def _within(shape: Shape) -> _Rod:
    """Return a capsule within a solid; that of a mesh has the radius -inf, as nothing is known of its inside."""
    match shape:
        case Box(size=size):
            axis, radius = int(size.argmax()), float(size.min()) / 2
            return _Rod(float(size[axis]) / 2 - radius, radius, axis)
        case Cylinder(radius=radius, length=length):
            radius = min(radius, length / 2)
            return _Rod(length / 2 - radius, radius)
        case Mesh():
            return _Rod(0.0, -np.inf)
    return _around(shape)


def _around(shape: Shape) -> _Rod:
    """Return a capsule around a solid."""
    match shape:
        case Box(size=size):
            axis = int(size.argmax())
            return _Rod(float(size[axis]) / 2, float(np.linalg.norm(np.delete(size, axis))) / 2, axis)
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length):
            return _Rod(length / 2, radius)
        case Sphere(radius=radius):
            return _Rod(0.0, radius)
        case Mesh():
            return _Rod(0.0, farthest(shape))


def _gap(one: _Rod, X: Array, other: _Rod, Y: Array) -> Array:
    """Return the distances (k,) of capsules at poses (k, 4, 4) of their solids; below 0 where they overlap.

    Source:
        Ericson (2004), Real-time collision detection, 5.1.9.
    """
    u, v = X[:, :3, one.axis], Y[:, :3, other.axis]
    apart = Y[:, :3, 3] - X[:, :3, 3]
    cosine, along_u, along_v = (u * v).sum(axis=1), (apart * u).sum(axis=1), (apart * v).sum(axis=1)
    square = 1 - cosine**2
    skew = np.where(square > 1e-9, square, np.inf)
    s = np.clip((along_u - cosine * along_v) / skew, -one.half, one.half)
    t = np.clip(s * cosine - along_v, -other.half, other.half)
    s = np.clip(t * cosine + along_u, -one.half, one.half)
    between = apart + t[:, None] * v - s[:, None] * u
    return np.asarray(np.linalg.norm(between, axis=1) - one.radius - other.radius)
