"""Where the bodies of a linkage are and how they move, over abstract scalars: positions, speeds, partial derivatives.

The coordinates are angles of bodies against the ground, slides along guides, and the places of free centres. So the
velocity of a point is linear in the speeds, with the partial derivatives of its position; the rest of its
acceleration, which is there while no speed changes, is its bias.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from armwright.clearance.linkage import GROUND, Body, Guide, Linkage, Pin, Place, exact
from armwright.tracing.scalar import Scalar, cos, sin


class Vec2(NamedTuple):
    """A vector in the plane."""

    x: Scalar
    y: Scalar

    def plus(self, other: Vec2) -> Vec2:
        """Return the sum."""
        return Vec2(self.x + other.x, self.y + other.y)

    def minus(self, other: Vec2) -> Vec2:
        """Return the difference."""
        return Vec2(self.x - other.x, self.y - other.y)

    def times(self, factor: Scalar) -> Vec2:
        """Return a multiple."""
        return Vec2(factor * self.x, factor * self.y)

    def dot(self, other: Vec2) -> Scalar:
        """Return the scalar product."""
        return self.x * other.x + self.y * other.y

    def turned(self) -> Vec2:
        """Return it turned by a right angle, counter-clockwise."""
        return Vec2(-self.y, self.x)


NOWHERE = Vec2(0.0, 0.0)


class Point(NamedTuple):
    """A point that moves with the linkage.

    Attributes:
        at: where it is.
        partials: of its position by the coordinates that move it, by their numbers.
        velocity: its own.
        bias: its acceleration while no speed changes.
    """

    at: Vec2
    partials: dict[int, Vec2]
    velocity: Vec2
    bias: Vec2


class Frame(NamedTuple):
    """A body that moves with the linkage.

    Attributes:
        axis: its direction.
        turns: partial derivatives of its angle, by the numbers of the coordinates that turn it.
        spin: its angular velocity.
        origin: the point from which its own points are measured.
    """

    axis: Vec2
    turns: dict[int, float]
    spin: Scalar
    origin: Point

    def point(self, along: float, across: float) -> Point:
        """Return a point of the body, given in its own axes."""
        return self.shifted(self.origin, self.arm(along, across))

    def arm(self, along: float, across: float) -> Vec2:
        """Return a vector of the body in the axes of the ground."""
        return self.axis.times(along).plus(self.axis.turned().times(across))

    def shifted(self, point: Point, arm: Vec2) -> Point:
        """Return the point of the body that lies by ``arm`` beside another of its points."""
        across = arm.turned()
        partials = dict(point.partials)
        for number, weight in self.turns.items():
            partials[number] = partials.get(number, NOWHERE).plus(across.times(weight))
        if isinstance(self.spin, float) and self.spin == 0:
            return Point(point.at.plus(arm), partials, point.velocity, point.bias)
        velocity = point.velocity.plus(across.times(self.spin))
        bias = point.bias.minus(arm.times(self.spin * self.spin))
        return Point(point.at.plus(arm), partials, velocity, bias)


class Placement:
    """All bodies of a linkage in one configuration."""

    def __init__(self, linkage: Linkage, q: Sequence[Scalar], qd: Sequence[Scalar]) -> None:
        """Place the bodies, each after the one it hangs on.

        Args:
            linkage: what moves.
            q: its coordinates [rad, m].
            qd: their speeds [rad/s, m/s].
        """
        self.linkage, self.q = linkage, q
        still = Point(NOWHERE, {}, NOWHERE, NOWHERE)
        self.frames = {GROUND: Frame(Vec2(1.0, 0.0), {}, 0.0, still)}
        self._points: dict[Place, Point] = {}
        number = 0
        for body in linkage.bodies:
            joint = linkage.joint(body.name)
            if isinstance(joint, Pin):
                frame = self._turning(number, q, qd)
                at = self.point(joint.on)
                number += 1
            elif isinstance(joint, Guide):
                frame, at = self._sliding(joint, number, q, qd)
                number += 1
            else:
                frame = self._turning(number + 2, q, qd)
                at = Point(
                    Vec2(q[number], q[number + 1]),
                    {number: Vec2(1.0, 0.0), number + 1: Vec2(0.0, 1.0)},
                    Vec2(qd[number], qd[number + 1]),
                    NOWHERE,
                )
                number += 3
            held = body.centre if joint is None else body.points[joint.point]
            origin = frame.shifted(at, frame.arm(*map(float, held)).times(-1.0))
            self.frames[body.name] = frame._replace(origin=origin)

    def point(self, place: Place) -> Point:
        """Return a place of a body."""
        if place not in self._points:
            along, across = map(float, self.linkage.point(place))
            self._points[place] = self.frames[place.body].point(along, across)
        return self._points[place]

    def centre(self, body: Body) -> Point:
        """Return the centre of mass of a body."""
        return self.frames[body.name].point(*map(float, body.centre))

    def _turning(self, number: int, q: Sequence[Scalar], qd: Sequence[Scalar]) -> Frame:
        zero = self.linkage.zero
        axis = _turned(Vec2(cos(q[number]), sin(q[number])), zero)
        return Frame(axis, {number: 1.0}, qd[number], Point(NOWHERE, {}, NOWHERE, NOWHERE))

    def _sliding(self, guide: Guide, number: int, q: Sequence[Scalar], qd: Sequence[Scalar]) -> tuple[Frame, Point]:
        """Return the frame of what slides along a guide, and its point on the line."""
        carrier, line = self.frames[guide.on.body], self.point(guide.on)
        along = _turned(carrier.axis, guide.direction)
        frame = carrier._replace(axis=_turned(carrier.axis, guide.angle))
        at = carrier.shifted(line, along.times(q[number]))
        at.partials[number] = along
        velocity = at.velocity.plus(along.times(qd[number]))
        bias = at.bias.plus(along.turned().times(2.0 * carrier.spin * qd[number]))
        return frame, at._replace(velocity=velocity, bias=bias)


def _turned(axis: Vec2, angle: float) -> Vec2:
    return axis.times(exact(math.cos(angle))).plus(axis.turned().times(exact(math.sin(angle))))
