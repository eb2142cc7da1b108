"""What stands in a cell yields to a tool that comes down on it in a motion that a force may end.

The deepest contact counts: its force is the stiffness times the depth, along the normal of the contact. Depths and
normals are those of the convex solids by which collisions are found.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from armwright.arrays import Array
from armwright.cell.contact_course import NOTHING, ContactCourse, Pair, Pressing
from armwright.cell.model import Cell
from armwright.cell.part_poses import PartPoses
from armwright.motion.trajectory import Trajectory, hold
from armwright.physics.cell_bodies import Body
from armwright.physics.clearance import ClearanceChecker, Window
from armwright.physics.collisions import CellCollisions
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Sphere

# A contact that becomes no deeper than this is none, as of what stands on something [m].
_TOUCH = 1e-5
# Ticks that are computed together.
_BLOCK = 32
# Ticks of a contact that are looked at, about.
_MAX_TICKS = 20_000
# Points of the rim of a cylinder.
_RIM = 16
# Contacts whose normals are so near that of the deepest press together: cosine of the angle.
_SAME_NORMAL = 0.9
# Time of a first contact [ticks].
_TIME_TOLERANCE = 1e-8


class YieldingScene:
    """The fixtures of a cell, and the parts that no arm holds, as springs."""

    def __init__(self, cell: Cell) -> None:
        """Take a cell. Its solids are prepared when they are first needed."""
        self._cell = cell

    @cached_property
    def _collisions(self) -> CellCollisions:
        return CellCollisions(self._cell)

    def along(
        self,
        arm: str,
        trajectory: Trajectory,
        now: float,
        parts: PartPoses,
        *,
        guarded: bool,
        pressed: frozenset[Pair],
    ) -> ContactCourse:
        """Return the contacts of the tool of an arm, and of what it holds, along a motion; see ``SceneContacts``."""
        checker, pairs = self._collisions.tool_pairs(arm, parts)
        counted = [pair for pair in pairs if guarded or pair in pressed]
        motion = _ToolMotion(self._cell, arm, trajectory, checker, counted, pressed)
        return motion.course(now, guarded=guarded)


class _ToolMotion:
    """A motion of one tool among bodies that stand."""

    def __init__(  # noqa: PLR0917 - a motion, and what it is among
        self,
        cell: Cell,
        arm: str,
        trajectory: Trajectory,
        checker: ClearanceChecker,
        pairs: Sequence[Pair],
        pressed: frozenset[Pair],
    ) -> None:
        self._cell, self._arm, self._trajectory = cell, arm, trajectory
        self._checker, self._pairs = checker, pairs
        self._motions: Mapping[str, Trajectory] = {
            **{name: hold(other.start, 0.0) for name, other in cell.arms.items()},
            arm: trajectory,
        }
        numbers = {pair: number for number, pair in enumerate(checker.pairs)}
        self._numbers = np.array([numbers[pair] for pair in pairs], dtype=np.intp)
        self._last = round(trajectory.duration / cell.period)
        # What overlaps from the start, and was not pressed in, counts from there on.
        self._free = np.zeros(len(pairs))
        start = self._depths(self._poses(np.zeros(1))[0])
        self._free = np.where([pair in pressed for pair in pairs], 0.0, np.maximum(start, 0.0))

    def _poses(self, ticks: Array) -> Array:
        """Return the poses (t, b, 4, 4) of all bodies at some ticks, which may be between two."""
        times = np.minimum(ticks * self._cell.period, self._trajectory.duration)
        return self._checker.poses(self._motions, times)

    def _depths(self, poses: Array) -> Array:
        """Return how deep each pair overlaps, (k,) [m], below 0 where it does not, where all bodies are (b, 4, 4)."""
        solids, radii, depths = self._checker.distances, self._checker.radii, np.full(len(self._pairs), -_TOUCH)
        for place, (own, other) in enumerate(self._pairs):
            if np.linalg.norm(poses[own, :3, 3] - poses[other, :3, 3]) < radii[own] + radii[other] + _TOUCH:
                solids.set_pose(own, poses[own])
                solids.set_pose(other, poses[other])
                depths[place] = -solids.between(own, other, _TOUCH)
        return np.asarray(depths - self._free)

    def course(self, now: float, *, guarded: bool) -> ContactCourse:
        """Return the contacts, until one is deeper than it may be."""
        ticks: list[int] = []
        pressings: list[Pressing] = []
        first: float | None = None
        excess: int | None = None
        tick: int | None = 0
        if self._pairs and (self._depths(self._poses(np.zeros(1))[0]) <= 0).all():
            first, tick = self._next_contact(0)
        allowed = self._cell.contact.max_depth
        while self._pairs and tick is not None and excess is None:
            # Of a very long contact not every tick is looked at.
            stride = 1 + (self._last - tick) // _MAX_TICKS
            numbers = range(tick, min(tick + stride * _BLOCK, self._last + 1), stride)
            for number, poses in zip(numbers, self._poses(np.array(numbers, dtype=np.float64)), strict=True):
                row = self._depths(poses)
                ticks.append(number)
                pressings.append(self._pressing(poses, row) if row.max() > 0 else NOTHING)
                if row.max() <= 0:
                    tick = self._next_contact(number)[1]
                    break
                if not number:
                    allowed = max(allowed, pressings[0].depth)
                if row.max() > allowed + _TOUCH:
                    excess = number
                    break
                tick = min(number + stride, self._last) if number < self._last else None
        return ContactCourse(
            guarded=guarded,
            t0=now,
            ticks=tuple(ticks),
            pressings=tuple(pressings),
            last_tick=self._last if excess is None else excess,
            first_contact=None if first is None or not guarded else now + first,
            excess_tick=excess,
        )

    def _next_contact(self, tick: int) -> tuple[float | None, int | None]:
        """Return when something is touched after a tick [s], and the first tick in contact; None where nothing is."""
        period, duration = self._cell.period, self._trajectory.duration
        margins = -(self._free + _TOUCH)
        window = Window(min(tick * period, duration), duration, self._numbers, margins)
        met = self._checker.first_contact(self._motions, windows=[window])
        if met is None:
            return None, None
        place = self._pairs.index(met.bodies)

        def depth(tick: float) -> float:
            return float(self._depths(self._poses(np.array([tick]))[0])[place])

        before = math.floor(met.time / period)
        while before > tick and depth(before) > 0:
            before -= 1
        if depth(before) > 0:
            return before * period, before
        from scipy.optimize import brentq  # noqa: PLC0415 - half of what a run would import, and few touch anything

        time = period * float(brentq(depth, before, met.time / period, xtol=_TIME_TOLERANCE))
        return time, min(before + 1, self._last)

    def _pressing(self, poses: Array, depths: Array) -> Pressing:
        """Return what is pressed on where all bodies are (b, 4, 4) and pairs overlap so deep (k,) [m]."""
        deepest = int(depths.argmax())
        places = [deepest, *(place for place in np.flatnonzero(depths > 0).tolist() if place != deepest)]
        contacts = [self._contact(poses, self._pairs[place], float(depths[place])) for place in places]
        normal = contacts[0][1]
        alike = [number for number, (_, other) in enumerate(contacts) if other @ normal >= _SAME_NORMAL]
        weights = depths[[places[number] for number in alike]]
        centre = weights @ np.array([contacts[number][0] for number in alike]) / weights.sum()
        force = self._cell.contact.stiffness * depths[deepest] * normal
        return Pressing(
            depth=float(depths[deepest]),
            wrench=np.concatenate([force, np.cross(centre - self._tool_point(poses), force)]),
            body=self._checker.bodies[self._pairs[deepest][1]].name,
            pairs=frozenset(self._pairs[place] for place in places),
        )

    def _tool_point(self, poses: Array) -> Array:
        """Return the tool point (3,) where all bodies are (b, 4, 4) [m]."""
        own = self._pairs[0][0]
        X_LB = self._checker.bodies[own].solid.pose
        X_WT = poses[own] @ inverse(X_LB) @ self._cell.arms[self._arm].arm.tool
        return np.asarray(X_WT[:3, 3])

    def _contact(self, poses: Array, pair: Pair, depth: float) -> tuple[Array, Array]:
        """Return where two bodies press on each other (3,) [m], and the direction (3,) in which the tool is pushed."""
        solids = self._checker.distances
        for body in pair:
            solids.set_pose(body, poses[body])
        own, other = solids.nearest(*pair, within=_TOUCH).points
        normal = (other - own) / np.linalg.norm(other - own)
        centres = [
            _pressed_centre(self._checker.bodies[body], poses[body], direction, depth)
            for body, direction in zip(pair, (-normal, normal), strict=True)
        ]
        # The smaller of both surfaces is that of the contact.
        return min(centres, key=lambda it: it[1])[0], normal


def _pressed_centre(body: Body, X: Array, direction: Array, depth: float) -> tuple[Array, float]:
    """Return the centre (3,) of what of a body is pressed in [m], and its radius.

    Args:
        body: the body.
        X: (4, 4) its pose in the world.
        direction: (3,) into what it presses on, in the world.
        depth: how deep it presses [m].
    """
    points = _outermost(body.solid.shape, X[:3, :3].T @ direction) @ X[:3, :3].T + X[:3, 3]
    heights = points @ direction
    weights = np.maximum(heights - heights.max() + depth, 0.0)
    centre = weights @ points / weights.sum()
    return centre, float(np.linalg.norm(points[weights > 0] - centre, axis=1).max())


def _outermost(shape: Shape, direction: Array) -> Array:
    """Return points (k, 3) of a solid among which those are that reach farthest in a direction (3,) [m]."""
    match shape:
        case Box(size=size):
            return np.array(np.meshgrid(*np.outer((-0.5, 0.5), size).T)).reshape(3, -1).T
        case Cylinder(radius=radius, length=length):
            angles = np.arange(_RIM) * (2 * math.pi / _RIM) + math.atan2(direction[1], direction[0])
            rim = np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1)
            return np.concatenate([np.insert(rim, 2, z, axis=1) for z in (-length / 2, length / 2)])
        case Capsule(radius=radius, length=length):
            return np.array([(0.0, 0.0, -length / 2), (0.0, 0.0, length / 2)]) + radius * direction
        case Sphere(radius=radius):
            return (radius * direction)[None]
        case Mesh(vertices=vertices):
            return np.asarray(vertices)
