"""Closed forms by decomposition into subproblems, for arms of three to six joints, over abstract scalars.

A displacement of the tool from where it is at joint positions 0 is the product of the displacements about the joint
axes as they lie then. Points and directions that some axes leave where they are take these axes out of an equation:
what remains is a subproblem of one joint.

Source:
    Elias & Wen (2022), "IK-Geo"; Ostermeier et al. (2024), "EAIK". The order of the steps is another here: the outer
    joint before the inner one, which then makes up for what the outer lost near a singularity.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.axes import SAME, Axes, are_perpendicular
from armwright.kinematics.inverse_kinematics.branches import ClosedForm, Solved
from armwright.kinematics.inverse_kinematics.geometry import ON_AXIS, Sign
from armwright.kinematics.inverse_kinematics.subproblems import Turn, rotated, turn_onto, turn_to_height
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector, add, apply, dot, product, scale, subtract, transpose

# How the first three axes of an arm are paired.
Pair: TypeAlias = Literal["first parallel", "last parallel", "first meet", "last meet"]
# Below this sine of the angle between them two axes fall together, and only the sum of their angles is determined.
SINGULAR_SINE = 1e-10
# What is smaller than this in a direction is rounding, and none of the equations' business.
_ROUNDING = 1e-15
_NAMES = {"shoulder": ("left", "right"), "elbow": ("up", "down"), "wrist": ("no-flip", "flip")}
_ROLES = ("", "shoulder", "shoulder", "elbow", "elbow", "wrist", "wrist", "wrist")


class Three(NamedTuple):
    """Three angles, and which are free."""

    angles: tuple[Scalar, Scalar, Scalar]
    free: tuple[Scalar, Scalar, Scalar]


@attrs.frozen(kw_only=True, eq=False)
class OfAxes(ClosedForm):
    """A closed form that knows an arm by its axes.

    Attributes:
        axes: at joint positions 0.
    """

    axes: Axes

    @cached_property
    def h(self) -> list[Vector]:
        """The directions of the axes."""
        return [constant(row) for row in self.axes.directions]

    def displacement(self, R_BT: Matrix, p_BT: Vector) -> tuple[Matrix, Vector]:
        """Return rotation and translation of the displacement of the tool from where it is at joint positions 0."""
        R = product(R_BT, transpose(self.axes.X_BT[:3, :3].tolist()))
        return R, subtract(p_BT, apply(R, self.axes.X_BT[:3, 3].tolist()))

    def label(self, branch: int, q: Array) -> str:
        """Name a branch by the joints whose choice tells it from the others.

        Where axes 2 and 3 are parallel and at a right angle to axis 1, shoulder and elbow are named by how the arm
        stands, as those of a PUMA are.
        """
        signs = list(self.signs[branch])
        if self.arm_end is not None:
            signs[:2] = stance(self.axes, q, self.arm_end)
        return label_of(self.deciding, signs)

    @property
    def arm_end(self) -> Array | None:
        """The point (3,) at the end of the forearm, if axes 2 and 3 are parallel and at a right angle to axis 1."""
        return None

    @property
    @abstractmethod
    def deciding(self) -> tuple[int, ...]:
        """The joints, from 1, whose subproblem has two answers, in the order of the signs."""


@attrs.frozen(kw_only=True, eq=False)
class Decomposed(OfAxes):
    """A closed form that a displacement of the tool is enough for."""

    def solve(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch from the displacement of the tool, over abstract scalars."""
        return self.displaced(*self.displacement(R_BT, p_BT), near, signs)

    @abstractmethod
    def displaced(self, R: Matrix, p: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch for a displacement of the tool, over abstract scalars.

        Args:
            R: rotation of the displacement.
            p: where it brings the origin of the base.
            near: joint positions; what the displacement leaves open takes its value from here.
            signs: those of the branch.
        """


def stance(axes: Axes, q: Array, end: Array) -> tuple[Sign, Sign]:
    """Return whether an arm stands to the left, and whether its elbow is up, each 1 or -1.

    It stands to the left where it reaches out on the side that joint 1 faces, with the plane of the arm on the left
    of that; its elbow is up where it is above the line from joint 2 to the end of the forearm.

    Args:
        axes: of an arm whose axes 2 and 3 are parallel and at a right angle to axis 1.
        q: (n,) joint positions.
        end: (3,) the end of the forearm at joint positions 0 [m].
    """
    o, h = axes.points, axes.directions.tolist()
    places = [o[1], o[2], end]
    for i in (2, 1, 0):
        moved = [add(rotated(h[i], q[i], (p - o[i]).tolist()), o[i].tolist()) for p in places[i:]]
        places[i:] = [np.array(p) for p in moved]
    shoulder, at_elbow, at_end = places
    y = np.array(rotated(h[0], q[0], h[1]))
    y = -y if (at_end - o[0]) @ y < -SAME else y
    left = (at_end - o[0]) @ np.cross(y, h[0]) > 0
    span, upper = (v - y * (v @ y) for v in (at_end - shoulder, at_elbow - shoulder))
    lift = upper - span * (upper @ span) / max(span @ span, SAME**2)
    return 1 if left else -1, 1 if lift @ np.array(h[0]) > 0 else -1


def label_of(joints: Sequence[int], signs: Sequence[Sign]) -> str:
    """Name the answers that joints, from 1, give: shoulder, elbow and wrist; by the joint where one gives two."""
    roles = [_ROLES[joint] for joint in joints]
    words = []
    for joint, sign in sorted(zip(joints, signs, strict=True)):
        role = _ROLES[joint]
        which = role if roles.count(role) == 1 else f"joint {joint}"
        words.append(f"{which} {_NAMES[role][0 if sign > 0 else 1]}")
    return ", ".join(words)


@attrs.frozen(kw_only=True, eq=False)
class Wristed(Decomposed):
    """Three revolute joints that bring a point to its place, and up to three whose axes meet in it.

    Attributes:
        pair: how the axes of the first three are paired.
        centre: (3,) the point where the others meet, at joint positions 0 [m].
        meets: (3,) the point where the pair meets; nothing of a parallel pair.
    """

    pair: Pair
    centre: Array
    meets: Array | None = None

    @property
    def deciding(self) -> tuple[int, ...]:
        """The two joints that bring the point to its place, and the middle one of a wrist of three."""
        first = {"last parallel": (1, 3), "first parallel": (3, 2), "last meet": (1, 2), "first meet": (3, 1)}
        return (*first[self.pair], *((5,) if len(self.h) == 6 else ()))

    @property
    def arm_end(self) -> Array | None:
        """The centre of the wrist."""
        upright = self.pair == "last parallel" and are_perpendicular(*self.axes.directions[:2])
        return self.centre if upright else None

    def displaced(self, R: Matrix, p: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch: the first three joints by the position of the centre, the others by the rotation."""
        goal = add(apply(R, constant(self.centre)), p)
        angles, free = self._placed(goal, near, signs)
        M = R
        for axis, angle in zip(self.h[:3], angles, strict=True):
            M = turned_back(axis, angle, M)
        q, open_ = list(angles), list(free)
        wrist = self.h[3:]
        if len(wrist) == 3:
            last = three_turns(wrist, M, signs[2], near[3])
            q, open_ = [*q, *last.angles], [*open_, *last.free]
        else:
            for i, axis in enumerate(wrist):
                # The rotation of the rest is known by what it does to the next axis, or to anything after the last.
                v = wrist[i + 1] if i + 1 < len(wrist) else across(axis)
                turn = turn_onto(axis, v, apply(M, v), otherwise=near[3 + i], tolerance=SINGULAR_SINE)
                M = turned_back(axis, turn.angle, M)
                q.append(turn.angle)
                open_.append(turn.free)
        return Solved(q, dict(enumerate(open_, 1)))

    def _placed(self, goal: Vector, near: Vector, signs: Sequence[Sign]) -> Three:
        """Return the angles that bring the centre to its goal."""
        steps = {
            "last parallel": self._last_parallel,
            "first parallel": self._first_parallel,
            "last meet": self._last_meet,
            "first meet": self._first_meet,
        }
        return steps[self.pair](goal, near, signs)

    def _last_parallel(self, goal: Vector, near: Vector, signs: Sequence[Sign]) -> Three:
        """Turn joint 1 until the goal is in the plane in which joints 2 and 3 move the centre."""
        h, o, W = self.h, self.axes.points, self.centre
        first = turned_into_plane(h[0], o[0], h[1], W, goal, side=signs[0], otherwise=near[0])
        back = rotated(h[0], -first.angle, subtract(goal, constant(o[0])))
        second, third = elbow(
            h[1],
            h[2],
            constant(o[2] - o[1]),
            constant(W - o[2]),
            add(back, constant(o[0] - o[1])),
            side=signs[1],
            otherwise=near[1],
        )
        return Three((first.angle, second.angle, third.angle), (first.free, second.free, third.free))

    def _first_parallel(self, goal: Vector, near: Vector, signs: Sequence[Sign]) -> Three:
        """Turn joint 3 until the centre is as high along the axes of joints 1 and 2 as the goal."""
        h, o, W = self.h, self.axes.points, self.centre
        v = constant(W - o[2])
        height = dot(h[0], subtract(goal, constant(o[2])))
        third = turn_to_height(h[2], v, h[0], height, side=signs[0], otherwise=near[2], tolerance=ON_AXIS)
        beyond = add(rotated(h[2], third.angle, v), constant(o[2] - o[1]))
        away = subtract(goal, constant(o[0]))
        first, second = elbow(
            h[0], h[1], constant(o[1] - o[0]), beyond, away, side=signs[1], otherwise=near[0], otherwise_elbow=near[1]
        )
        return Three((first.angle, second.angle, third.angle), (first.free, second.free, third.free))

    def _last_meet(self, goal: Vector, near: Vector, signs: Sequence[Sign]) -> Three:
        """Turn joint 1 until the goal is as far from where joints 2 and 3 meet as the centre."""
        assert self.meets is not None  # noqa: S101 - axes that meet do so somewhere
        h, o, C = self.h, self.axes.points[0], self.meets
        away, arm = subtract(goal, constant(o)), constant(self.centre - C)
        first = turned_to_distance(
            reversed_axis(h[0]), away, constant(C - o), dot(arm, arm), side=signs[0], otherwise=near[0]
        )
        back = add(rotated(h[0], -first.angle, away), constant(o - C))
        second, third = two_turns(h[1], h[2], arm, back, side=signs[1], otherwise=near[1:3], tolerance=ON_AXIS)
        return Three((first.angle, second.angle, third.angle), (first.free, second.free, third.free))

    def _first_meet(self, goal: Vector, near: Vector, signs: Sequence[Sign]) -> Three:
        """Turn joint 3 until the centre is as far from where joints 1 and 2 meet as the goal."""
        assert self.meets is not None  # noqa: S101 - axes that meet do so somewhere
        h, o, C = self.h, self.axes.points[2], self.meets
        v, away = constant(self.centre - o), subtract(goal, constant(C))
        third = turned_to_distance(h[2], v, constant(C - o), dot(away, away), side=signs[0], otherwise=near[2])
        arm = add(rotated(h[2], third.angle, v), constant(o - C))
        first, second = two_turns(h[0], h[1], arm, away, side=signs[1], otherwise=near[:2], tolerance=ON_AXIS)
        return Three((first.angle, second.angle, third.angle), (first.free, second.free, third.free))


@attrs.frozen(kw_only=True, eq=False)
class Backwards(Decomposed):
    """An arm whose first three axes meet: the closed form of the same arm, held by its tool and moving its base.

    Attributes:
        forwards: the closed form of the arm whose axes are these in the other order.
    """

    forwards: Wristed

    @property
    def deciding(self) -> tuple[int, ...]:
        """The joints of the other arm, counted from the other end."""
        return tuple(len(self.h) + 1 - joint for joint in self.forwards.deciding)

    def displaced(self, R: Matrix, p: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch of the displacement of the base, seen from the tool."""
        back = transpose(R)
        found = self.forwards.displaced(back, scale(-1.0, apply(back, p)), [-x for x in reversed(near)], signs)
        free = {len(near) + 1 - joint: flag for joint, flag in found.free.items()}
        return Solved([-x for x in reversed(found.q)], free)


@attrs.frozen(kw_only=True, eq=False)
class ThreeParallel(Decomposed):
    """A revolute joint, three whose axes are parallel, and up to two more; of two, the axes meet.

    Attributes:
        centre: (3,) a point on the axes of the last joints, or where there is none on that of joint 4 [m].
    """

    centre: Array

    @property
    def deciding(self) -> tuple[int, ...]:
        """The first joint, the elbow, and the wrist where there are two joints in it."""
        return (1, 3, 5) if len(self.h) == 6 else (1, 3)

    @property
    def arm_end(self) -> Array | None:
        """Where joint 4 is."""
        return np.asarray(self.axes.points[3]) if are_perpendicular(*self.axes.directions[:2]) else None

    def displaced(self, R: Matrix, p: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch: joint 1 by the position, the sum of joints 2 to 4 by the rotation, then the elbow."""
        h, o, C = self.h, self.axes.points, self.centre
        goal = add(apply(R, constant(C)), p)
        first = turned_into_plane(h[0], o[0], h[1], C, goal, side=signs[0], otherwise=near[0])
        M = turned_back(h[0], first.angle, R)
        senses = [float(np.sign(dot(h[1], axis))) for axis in h[1:4]]
        sum_near = sum(sense * x for sense, x in zip(senses, near[1:4], strict=True))
        last: list[Turn] = []
        if len(h) == 6:
            raised, fifth = two_turns(
                h[1], h[4], h[5], apply(M, h[5]), side=signs[2], otherwise=(sum_near, near[4]), tolerance=SINGULAR_SINE
            )
            last.append(fifth)
        else:
            v = h[4] if len(h) == 5 else across(h[1])
            raised = turn_onto(h[1], v, apply(M, v), otherwise=sum_near, tolerance=SINGULAR_SINE)
        M = turned_back(h[1], raised.angle, M)
        if len(h) == 6:
            M = turned_back(h[4], last[0].angle, M)
        if len(h) > 4:
            v = across(h[-1])
            last.append(turn_onto(h[-1], v, apply(M, v), otherwise=near[-1], tolerance=SINGULAR_SINE))
        back = rotated(h[0], -first.angle, subtract(goal, constant(o[0])))
        hand = rotated(h[1], raised.angle, constant(C - o[3]))
        foot = subtract(add(back, constant(o[0] - o[1])), hand)
        second, third = elbow(
            h[1], h[2], constant(o[2] - o[1]), constant(o[3] - o[2]), foot, side=signs[1], otherwise=near[1]
        )
        fourth = senses[2] * (raised.angle - second.angle - senses[1] * third.angle)
        turns = [first, second, third, Turn(fourth, raised.free), *last]
        return Solved([turn.angle for turn in turns], {i: turn.free for i, turn in enumerate(turns, 1)})


@attrs.frozen(kw_only=True, eq=False)
class Scara(Decomposed):
    """Three revolute joints and a slide, all parallel, in any order."""

    @property
    def deciding(self) -> tuple[int, ...]:
        """The second of the revolute joints: the elbow."""
        return (self._turning[1] + 1,)

    @property
    def _turning(self) -> list[int]:
        return [i for i, kind in enumerate(self.axes.kinds) if kind == "R"]

    def displaced(self, R: Matrix, p: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch: a planar arm of two links, the last rotation, and how far the slide is out."""
        a, b, c = self._turning
        slide = self.axes.kinds.index("P")
        h, o = self.h, self.axes.points
        u = across(h[a])
        total = turn_onto(h[a], u, apply(R, u), otherwise=0.0, tolerance=SINGULAR_SINE)
        goal = add(apply(R, constant(o[c])), p)
        away = subtract(goal, constant(o[a]))
        first, second = elbow(
            h[a], h[b], constant(o[b] - o[a]), constant(o[c] - o[b]), away, side=signs[0], otherwise=near[a]
        )
        sense_b, sense_c = (float(np.sign(dot(h[a], h[i]))) for i in (b, c))
        third = sense_c * (total.angle - first.angle - sense_b * second.angle)
        q: Vector = [0.0] * 4
        q[a], q[b], q[c] = first.angle, second.angle, third
        q[slide] = dot(h[slide], subtract(goal, constant(o[c])))
        return Solved(q, {a + 1: first.free})

    def nearest_pose(self, X_BT: Array) -> Array:
        """Return the pose in reach nearest to one asked for: upright as the tool can only be, and not too far out.

        The tool keeps its position where that is within reach once it is upright.

        Args:
            X_BT: (4, 4) tool pose in the base frame.
        """
        a, b, c = self._turning
        o, h, X_0 = self.axes.points, self.axes.directions[a], self.axes.X_BT
        R = X_BT[:3, :3] @ X_0[:3, :3].T
        # The rotation about the axis that is nearest to R: the trace of their quotient is largest.
        sine, cosine = np.cross(np.eye(3), R.T).sum(axis=0) @ h, np.trace(R) - h @ R @ h
        turn = rotation_from_vector(h * math.atan2(sine, cosine))
        X = homogeneous(turn @ X_0[:3, :3], X_BT[:3, 3])
        away = X[:3, 3] + turn @ (o[c] - X_0[:3, 3]) - o[a]
        flat = away - h * (h @ away)
        links = [np.linalg.norm(np.cross(h, o[j] - o[i])) for i, j in ((a, b), (b, c))]
        distance = float(np.linalg.norm(flat))
        within = min(max(distance, abs(links[0] - links[1])), links[0] + links[1])
        direction = flat / distance if distance else np.array(across(self.h[a]))
        X[:3, 3] += direction * within - flat
        return X

    def label(self, branch: int, q: Array) -> str:  # noqa: ARG002 - the same number, how the arm stands tells
        """Name a branch by the side to which the elbow is, seen along the first axis from the end of the arm."""
        _, second, _ = self._turning
        o, h = self.axes.points, self.axes.directions
        a, b, c = self._turning
        # The angle from the first link to the second, which at joint position 0 is one of the arm.
        straight, bent = o[b] - o[a], o[c] - o[b]
        zero = np.arctan2(h[a] @ np.cross(straight, bent), straight @ bent - (straight @ h[a]) * (bent @ h[a]))
        angle = zero + np.sign(h[a] @ h[b]) * q[second]
        return "elbow right" if np.sin(angle) > 0 else "elbow left"


def constant(v: Array) -> Vector:
    """Return a vector of plain numbers, without what rounding has put where nothing is."""
    return [0.0 if abs(x) < _ROUNDING else float(x) for x in v]


def across(axis: Vector) -> Vector:
    """Return some unit vector at a right angle to a constant axis."""
    u = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    return constant(u / np.linalg.norm(u))


def reversed_axis(axis: Vector) -> Vector:
    """Return an axis that points the other way."""
    return [-x for x in axis]


def turned_back(axis: Vector, angle: Scalar, M: Matrix) -> Matrix:
    """Return a rotation matrix without the rotation about an axis that came last."""
    return transpose([rotated(axis, -angle, column) for column in transpose(M)])


def turned_into_plane(
    axis: Vector, foot: Array, normal: Vector, point: Array, goal: Vector, *, side: Sign, otherwise: Scalar
) -> Turn:
    """Return the rotation about an axis through ``foot`` after which a plane through a point meets its goal.

    Args:
        axis: to rotate about.
        foot: (3,) a point on it [m].
        normal: of the plane.
        point: (3,) in the plane, before [m].
        goal: where the plane should come to [m].
        side: which of the two.
        otherwise: the angle to take where the goal is on the axis.
    """
    height = float(np.dot(normal, point - foot))
    away = subtract(goal, constant(foot))
    return turn_to_height(reversed_axis(axis), away, normal, height, side=side, otherwise=otherwise, tolerance=ON_AXIS)


def turned_to_distance(
    axis: Vector, v: Vector, from_: Vector, square: Scalar, *, side: Sign, otherwise: Scalar
) -> Turn:
    """Return the rotation that brings ``v`` to a distance, of which the square is given, from a constant point."""
    height = 0.5 * (dot(v, v) + dot(from_, from_) - square)
    return turn_to_height(
        axis, v, from_, height, side=side, otherwise=otherwise, tolerance=ON_AXIS * math.hypot(*from_)
    )


def elbow(
    h: Vector,
    h_elbow: Vector,
    upper: Vector,
    fore: Vector,
    goal: Vector,
    *,
    side: Sign,
    otherwise: Scalar,
    otherwise_elbow: Scalar = 0.0,
) -> tuple[Turn, Turn]:
    """Return two rotations about parallel axes that bring the end of two links to a goal, seen along the axes.

    Args:
        h: the first axis, through the origin.
        h_elbow: the second, of the same direction or the opposite one.
        upper: from the first axis to the second, before.
        fore: from there to the end.
        goal: where the end should be.
        side: which of the two elbows.
        otherwise: the first angle where the goal is on the first axis.
        otherwise_elbow: the second angle where a link has no length.
    """
    seen = [subtract(v, scale(dot(h, v), h)) for v in (upper, fore, goal)]
    to_elbow, forearm, away = seen
    second = turned_to_distance(
        h_elbow, forearm, scale(-1.0, to_elbow), dot(away, away), side=side, otherwise=otherwise_elbow
    )
    reach = add(to_elbow, rotated(h_elbow, second.angle, forearm))
    return turn_onto(h, reach, away, otherwise=otherwise, tolerance=ON_AXIS), second


def two_turns(
    outer: Vector,
    inner: Vector,
    v: Vector,
    goal: Vector,
    *,
    side: Sign,
    otherwise: Sequence[Scalar],
    tolerance: float,
) -> tuple[Turn, Turn]:
    """Return rotations about two axes that meet which bring a vector, rotated by the inner one first, onto a goal."""
    height = dot(inner, v)
    first = turn_to_height(
        reversed_axis(outer), goal, inner, height, side=side, otherwise=otherwise[0], tolerance=tolerance
    )
    return first, turn_onto(inner, v, rotated(outer, -first.angle, goal), otherwise=otherwise[1], tolerance=tolerance)


def three_turns(axes: Sequence[Vector], M: Matrix, side: Sign, otherwise: Scalar) -> Three:
    """Return rotations about three axes that meet which together are a rotation.

    Args:
        axes: constant unit vectors.
        M: the rotation.
        side: which of the two.
        otherwise: the first angle, where the first and the last axis fall together.
    """
    first, second = two_turns(
        axes[0], axes[1], axes[2], apply(M, axes[2]), side=side, otherwise=(otherwise, 0.0), tolerance=SINGULAR_SINE
    )
    rest = turned_back(axes[1], second.angle, turned_back(axes[0], first.angle, M))
    u = across(axes[2])
    third = turn_onto(axes[2], u, apply(rest, u), otherwise=0.0, tolerance=SINGULAR_SINE)
    return Three((first.angle, second.angle, third.angle), (first.free, second.free, third.free))
