"""Where the bodies of a linkage are and how they move, over abstract scalars: positions, speeds, partial derivatives.

The coordinates are angles of bodies against the ground, slides along guides, the positions of free centres, and the
displacements of elastic rods. So the velocity of a point is linear in the speeds, with the partial derivatives of its
position; the rest of its acceleration, which is there while no speed changes, is its bias.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from armwright.clearance.elastic_rod import Rod, Section
from armwright.clearance.linkage import GROUND, Body, BodyPoint, Guide, Linkage, Pin, round_to_right_angle
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

    def perpendicular(self) -> Vec2:
        """Return the vector rotated by a right angle, counter-clockwise."""
        return Vec2(-self.y, self.x)


NOWHERE = Vec2(0.0, 0.0)


def dot(row: Sequence[Scalar], column: Sequence[Scalar]) -> Scalar:
    """Return the sum of the products of the numbers of two rows, as far as both have them."""
    return sum((x * y for x, y in zip(row, column, strict=False)), 0.0)


class Point(NamedTuple):
    """A point that moves with the linkage.

    Attributes:
        position: of the point.
        partials: of its position by the coordinates that move it, by their numbers.
        velocity: its own.
        bias: its acceleration while no speed changes.
    """

    position: Vec2
    partials: dict[int, Vec2]
    velocity: Vec2
    bias: Vec2


class Frame(NamedTuple):
    """A body that moves with the linkage.

    Attributes:
        axis: its direction.
        angle_partials: partial derivatives of its angle, by the numbers of the coordinates that rotate it.
        spin: its angular velocity.
        origin: the point from which its own points are measured.
    """

    axis: Vec2
    angle_partials: dict[int, float]
    spin: Scalar
    origin: Point

    def point(self, along: float, across: float) -> Point:
        """Return a point of the body, given in its own axes."""
        return self.shifted(self.origin, self.arm(along, across))

    def arm(self, along: float, across: float) -> Vec2:
        """Return a vector of the body in the axes of the ground."""
        return self.axis.times(along).plus(self.axis.perpendicular().times(across))

    def shifted(self, point: Point, arm: Vec2) -> Point:
        """Return the point of the body that lies by ``arm`` beside another of its points."""
        across = arm.perpendicular()
        partials = dict(point.partials)
        for number, weight in self.angle_partials.items():
            partials[number] = partials.get(number, NOWHERE).plus(across.times(weight))
        if isinstance(self.spin, float) and self.spin == 0:
            return Point(point.position.plus(arm), partials, point.velocity, point.bias)
        velocity = point.velocity.plus(across.times(self.spin))
        bias = point.bias.minus(arm.times(self.spin * self.spin))
        return Point(point.position.plus(arm), partials, velocity, bias)


class PlacedRod(NamedTuple):
    """A rod that moves with the linkage, bends and stretches.

    Attributes:
        rod: its shapes, masses and springs.
        frame: of its body, with its axis from the first end of the rod to the other.
        end: the first end.
        numbers: of its own coordinates: bends and stretch.
        values: of these [m].
        speeds: their speeds [m/s].
    """

    rod: Rod
    frame: Frame
    end: Point
    numbers: list[int]
    values: list[Scalar]
    speeds: list[Scalar]

    def point(self, section: Section) -> Point:
        """Return the middle of a section."""
        if section.along == 0:
            return self.end
        *bends, stretch = self.values
        *bend_speeds, stretch_speed = self.speeds
        shortenings = [dot(row, bends) for row in section.shortening]
        ahead = section.along + section.stretch * stretch - 0.5 * dot(bends, shortenings)
        ahead_speed = section.stretch * stretch_speed - dot(bend_speeds, shortenings)
        shortening_rates = [dot(row, bend_speeds) for row in section.shortening]
        aside_speed = dot(section.bends, bend_speeds)
        along, across = self.frame.axis, self.frame.axis.perpendicular()
        rigid = self.frame.shifted(self.end, along.times(ahead).plus(across.times(dot(section.bends, bends))))
        partials = dict(rigid.partials)
        for number, bend, shortening in zip(self.numbers, section.bends, shortenings, strict=False):
            partials[number] = across.times(bend).minus(along.times(shortening))
        partials[self.numbers[-1]] = along.times(section.stretch)
        relative = along.times(ahead_speed).plus(across.times(aside_speed))
        bias = relative.perpendicular().times(2.0 * self.frame.spin)
        bias = bias.minus(along.times(dot(bend_speeds, shortening_rates)))
        return Point(rigid.position, partials, rigid.velocity.plus(relative), rigid.bias.plus(bias))

    def rotated(self, frame: Frame, section: Section) -> Frame:
        """Return a frame of the body that rotates with a section."""
        slopes = dict(zip(self.numbers, section.slopes, strict=False))
        spin = frame.spin + dot(section.slopes, self.speeds)
        return frame._replace(angle_partials=frame.angle_partials | slopes, spin=spin)


class Placement:
    """All bodies of a linkage in one configuration."""

    def __init__(self, linkage: Linkage, q: Sequence[Scalar], qd: Sequence[Scalar]) -> None:
        """Determine the poses of the bodies, each after the body that carries it.

        Args:
            linkage: what moves.
            q: its coordinates [rad, m]; those of rods may be left out, which then are straight and rigid.
            qd: their speeds [rad/s, m/s].
        """
        self.linkage, self.q, self.qd = linkage, q, qd
        self.rods: dict[str, PlacedRod] = {}
        still = Point(NOWHERE, {}, NOWHERE, NOWHERE)
        self.frames = {GROUND: Frame(Vec2(1.0, 0.0), {}, 0.0, still)}
        self._points: dict[BodyPoint, Point] = {}
        rigid = len(linkage.rigid_coordinates)
        rods, numbers = linkage.rods if len(q) > rigid else {}, iter(range(rigid, len(q)))
        number = 0
        for body in linkage.bodies:
            joint = linkage.joint(body.name)
            if isinstance(joint, Pin):
                frame = self._rotating(number, q, qd)
                joint_point = self.point(joint.on)
                number += 1
            elif isinstance(joint, Guide):
                frame, joint_point = self._sliding(joint, number, q, qd)
                number += 1
            else:
                frame = self._rotating(number + 2, q, qd)
                joint_point = Point(
                    Vec2(q[number], q[number + 1]),
                    {number: Vec2(1.0, 0.0), number + 1: Vec2(0.0, 1.0)},
                    Vec2(qd[number], qd[number + 1]),
                    NOWHERE,
                )
                number += 3
            own_point = body.centre if joint is None else body.points[joint.point]
            origin = frame.shifted(joint_point, frame.arm(*map(float, own_point)).times(-1.0))
            self.frames[body.name] = frame._replace(origin=origin)
            if body.name in rods:
                self.rods[body.name] = self._place_rod(rods[body.name], body, numbers)

    def point(self, point: BodyPoint) -> Point:
        """Return a point of a body."""
        if point not in self._points:
            along, across = map(float, self.linkage.point(point))
            if point.body in self.rods:
                self._points[point] = self.rods[point.body].point(self._section(point))
            else:
                self._points[point] = self.frames[point.body].point(along, across)
        return self._points[point]

    def section(self, point: BodyPoint) -> Frame:
        """Return the frame of a body, or of the section of a rod, at a point; its axis is that of the body."""
        frame = self.frames[point.body]
        return self.rods[point.body].rotated(frame, self._section(point)) if point.body in self.rods else frame

    def masses(self, body: Body) -> Iterator[tuple[float, Point]]:
        """Give the masses of a body, each in a point: all in its centre, or those of a rod."""
        placed = self.rods.get(body.name)
        if placed is None:
            yield body.mass, self.centre(body)
        else:
            yield from ((mass, placed.point(section)) for mass, section in placed.rod.masses)

    def inertia(self, body: Body) -> float:
        """Return the inertia of a body about its centre, as far as it is not that of its masses [kg m²]."""
        return 0.0 if body.name in self.rods else body.inertia

    def centre(self, body: Body) -> Point:
        """Return the centre of mass of a body; of a rod, that when it is straight."""
        return self.frames[body.name].point(*map(float, body.centre))

    def _section(self, point: BodyPoint) -> Section:
        return self.rods[point.body].rod.section_at(self.linkage.point(point))

    def _place_rod(self, rod: Rod, body: Body, numbers: Iterator[int]) -> PlacedRod:
        """Return a rod with its own coordinates, those of the next numbers."""
        frame = self.frames[body.name]
        chosen = [next(numbers) for _ in rod.stiffness]
        return PlacedRod(
            rod=rod,
            frame=frame._replace(axis=_rotate(frame.axis, rod.direction)),
            end=frame.point(*rod.start),
            numbers=chosen,
            values=[self.q[i] for i in chosen],
            speeds=[self.qd[i] for i in chosen],
        )

    def _rotating(self, number: int, q: Sequence[Scalar], qd: Sequence[Scalar]) -> Frame:
        axis = _rotate(Vec2(cos(q[number]), sin(q[number])), self.linkage.zero)
        return Frame(axis, {number: 1.0}, qd[number], Point(NOWHERE, {}, NOWHERE, NOWHERE))

    def _sliding(self, guide: Guide, number: int, q: Sequence[Scalar], qd: Sequence[Scalar]) -> tuple[Frame, Point]:
        """Return the frame of a body that slides along a guide, and its point on the line."""
        carrier, line = self.frames[guide.on.body], self.point(guide.on)
        along = _rotate(carrier.axis, guide.direction)
        frame = carrier._replace(axis=_rotate(carrier.axis, guide.angle))
        point = carrier.shifted(line, along.times(q[number]))
        point.partials[number] = along
        velocity = point.velocity.plus(along.times(qd[number]))
        bias = point.bias.plus(along.perpendicular().times(2.0 * carrier.spin * qd[number]))
        return frame, point._replace(velocity=velocity, bias=bias)


def _rotate(axis: Vec2, angle: float) -> Vec2:
    return axis.times(round_to_right_angle(math.cos(angle))).plus(
        axis.perpendicular().times(round_to_right_angle(math.sin(angle)))
    )
