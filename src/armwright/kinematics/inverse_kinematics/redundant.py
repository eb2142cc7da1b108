"""Closed forms of arms with a joint too many: all branches at a given value of the parameter that is left."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.branches import ClosedForm, Solved
from armwright.kinematics.inverse_kinematics.decompositions import (
    SINGULAR_SINE,
    OfAxes,
    across,
    constant,
    label_of,
    three_turns,
    turned_back,
    turned_to_distance,
)
from armwright.kinematics.inverse_kinematics.geometry import ON_AXIS, Sign
from armwright.kinematics.inverse_kinematics.subproblems import rotated
from armwright.tracing.scalar import Scalar, atan2, cos, select, sin, sqrt
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, product, scale, subtract, transpose


@attrs.frozen(kw_only=True, eq=False)
class Redundant(ClosedForm):
    """A closed form with a parameter: ``solve`` keeps the value that it has where the arm is."""

    @abstractmethod
    def parameter_of(self, q: Vector) -> Scalar:
        """Return the parameter of a configuration [rad] or [m], over abstract scalars."""

    @abstractmethod
    def solve_at(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign], parameter: Scalar) -> Solved:
        """Return one branch at a value of the parameter, over abstract scalars: see ``solve``."""

    def solve(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign]) -> Solved:
        """Return one branch at the parameter of ``near``, over abstract scalars."""
        return self.solve_at(R_BT, p_BT, near, signs, self.parameter_of(near))


@attrs.frozen(kw_only=True, eq=False)
class Swivelling(Redundant, OfAxes):
    """A spherical shoulder, an elbow and a spherical wrist: the elbow swivels about the line from shoulder to wrist.

    The swivel is 0 where the elbow is in the plane of that line and the axis of joint 1, on the side to which the axis
    points; it counts about the line towards the wrist. With the wrist on the axis of joint 1 the direction in which the
    elbow bends with joints 1 to 3 at 0 takes the place of the axis.

    Attributes:
        shoulder: (3,) the point where axes 1 to 3 meet, at joint positions 0 [m].
        wrist: (3,) the point where axes 5 to 7 meet [m].
        elbow: (3,) a point on axis 4 [m].

    Source:
        Shimizu, Kakuya, Yoon, Kitagaki & Kosuge (2008), "Analytical inverse kinematic computation for 7-DOF redundant
        manipulators with joint limits and its application to redundancy resolution".
    """

    shoulder: Array
    wrist: Array
    elbow: Array

    @property
    def deciding(self) -> tuple[int, ...]:
        """Elbow, shoulder and wrist."""
        return (4, 2, 6)

    def parameter_of(self, q: Vector) -> Scalar:
        """Return the swivel of a configuration."""
        _, to_wrist, to_elbow = self._upper_arm(q[3])
        for axis, angle in zip(reversed(self.h[:3]), reversed(q[:3]), strict=True):
            to_wrist, to_elbow = rotated(axis, angle, to_wrist), rotated(axis, angle, to_elbow)
        _, ahead, aside = self.reference(to_wrist)
        return atan2(dot(aside, to_elbow), dot(ahead, to_elbow))

    def solve_at(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign], parameter: Scalar) -> Solved:
        """Return one branch at a swivel."""
        R, p = self.displacement(R_BT, p_BT)
        fourth = self.elbow_angle(R, p, signs[0], near[3])
        constant_part, by_cosine, by_sine = self.shoulder_rotations(R, p, fourth[0])
        c, s = cos(parameter), sin(parameter)
        R_03 = [
            [x + c * y + s * z for x, y, z in zip(*rows, strict=True)]
            for rows in zip(constant_part, by_cosine, by_sine, strict=True)
        ]
        first = three_turns(self.h[:3], R_03, signs[1], near[0])
        M = turned_back(self.h[3], fourth[0], product(transpose(R_03), R))
        last = three_turns(self.h[4:], M, signs[2], near[4])
        q = [*first.angles, fourth[0], *last.angles]
        free = [*first.free, fourth[1], *last.free]
        return Solved(q, dict(enumerate(free, 1)))

    def elbow_angle(self, R: Matrix, p: Vector, side: Sign, otherwise: Scalar) -> tuple[Scalar, Scalar]:
        """Return the angle of joint 4, which the distance of the wrist asks for, and whether it is free."""
        away = self.to_goal(R, p)
        o = self.axes.points[3]
        v, from_ = constant(self.wrist - o), constant(self.shoulder - o)
        turn = turned_to_distance(self.h[3], v, from_, dot(away, away), side=side, otherwise=otherwise)
        return turn.angle, turn.free

    def to_goal(self, R: Matrix, p: Vector) -> Vector:
        """Return the vector from the shoulder to where a displacement brings the wrist."""
        return subtract(add(apply(R, constant(self.wrist)), p), constant(self.shoulder))

    def shoulder_rotations(self, R: Matrix, p: Vector, fourth: Scalar) -> tuple[Matrix, Matrix, Matrix]:
        """Return the rotation of the upper arm: what of it is constant, goes with cosine and with sine of the swivel.

        The upper arm turns what points from the shoulder to the wrist into the line to the goal, and the elbow, which
        is off that line, into the direction of the swivel.
        """
        line, ahead, aside = self.reference(self.to_goal(R, p))
        B = transpose(self._upper_arm_frame(fourth))
        zero = [0.0, 0.0, 0.0]
        back = scale(-1.0, ahead)
        constant_part = product(transpose([line, zero, zero]), B)
        by_cosine = product(transpose([zero, ahead, aside]), B)
        by_sine = product(transpose([zero, aside, back]), B)
        return constant_part, by_cosine, by_sine

    def reference(self, to_wrist: Vector) -> tuple[Vector, Vector, Vector]:
        """Return unit vectors along the line to the wrist, to where the swivel is 0, and where it is 90 deg."""
        line = _unit(to_wrist)
        axis = self.h[0]
        # Where the elbow bends to when the arm stands up, so that the swivel of an upright arm is 0.
        bending = cross(self.h[3], axis)
        instead = _unit(bending) if math.hypot(*bending) > SINGULAR_SINE else across(axis)
        upwards = subtract(axis, scale(dot(axis, line), line))
        sideways = subtract(instead, scale(dot(instead, line), line))
        on_axis = dot(upwards, upwards) < SINGULAR_SINE**2
        ahead = _unit([select(on_axis, x, y) for x, y in zip(sideways, upwards, strict=True)])
        return line, ahead, cross(line, ahead)

    def _upper_arm(self, fourth: Scalar) -> tuple[Vector, Vector, Vector]:
        """Return the line from shoulder to wrist with joints 1 to 3 at 0: direction, itself, and to the elbow.

        A stretched arm has no elbow beside that line; the direction in which it would bend is taken.
        """
        o, h = self.axes.points[3], self.h[3]
        to_wrist = add(rotated(h, fourth, constant(self.wrist - o)), constant(o - self.shoulder))
        line = _unit(to_wrist)
        to_elbow = constant(self.elbow - self.shoulder)
        beside = subtract(to_elbow, scale(dot(to_elbow, line), line))
        bending = cross(h, line)
        straight = dot(beside, beside) < ON_AXIS**2
        return line, to_wrist, [select(straight, x, y) for x, y in zip(bending, beside, strict=True)]

    def _upper_arm_frame(self, fourth: Scalar) -> Matrix:
        """Return, as columns, the line to the wrist, the direction of the elbow and that at right angles to both."""
        line, _, beside = self._upper_arm(fourth)
        ahead = _unit(beside)
        return transpose([line, ahead, cross(line, ahead)])


@attrs.frozen(kw_only=True, eq=False)
class Locked(Redundant):
    """An arm whose first or last joint is held, and the closed form of the others.

    Attributes:
        joint: the number of the joint that is held, from 1.
        rest: the closed form of the others, with that joint at 0.
        kind: R or P, of that joint.
        point: (3,) on its axis, seen from the base, or of the last joint from the tool, all joints at 0 [m].
        direction: (3,) of its axis, likewise.
    """

    joint: int
    rest: ClosedForm
    kind: str
    point: Array
    direction: Array

    def parameter_of(self, q: Vector) -> Scalar:
        """Return the position of the joint that is held."""
        return q[self.joint - 1]

    def solve_at(self, R_BT: Matrix, p_BT: Vector, near: Vector, signs: Sequence[Sign], parameter: Scalar) -> Solved:
        """Return one branch with the joint at a position."""
        axis, o = constant(self.direction), constant(self.point)
        others = [x for i, x in enumerate(near, 1) if i != self.joint]
        # The displacement about the joint, undone.
        if self.kind == "P":
            R_back, p_back = _IDENTITY, scale(-parameter, axis)
        else:
            R_back = turned_back(axis, parameter, _IDENTITY)
            p_back = subtract(o, apply(R_back, o))
        if self.joint == 1:
            R, p = product(R_back, R_BT), add(apply(R_back, p_BT), p_back)
        else:
            R, p = product(R_BT, R_back), add(apply(R_BT, p_back), p_BT)
        found = self.rest.solve(R, p, others, signs)
        q = list(found.q)
        q.insert(self.joint - 1, parameter)
        return Solved(q, {self._here(joint): flag for joint, flag in found.free.items()})

    def _here(self, joint: int) -> int:
        """Return the number that a joint of the others has in the whole arm."""
        return joint + (joint >= self.joint)

    def label(self, branch: int, q: Array) -> str:
        """Name a branch as the arm without that joint does."""
        if isinstance(self.rest, OfAxes) and self.rest.arm_end is None:
            return label_of([self._here(joint) for joint in self.rest.deciding], self.signs[branch])
        return self.rest.label(branch, np.delete(q, self.joint - 1))


_IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def _unit(v: Vector) -> Vector:
    """Return a vector scaled to length 1; one of length 0 stays."""
    square = dot(v, v)
    return scale(1.0 / sqrt(select(square < 1e-300, 1.0, square)), v)
