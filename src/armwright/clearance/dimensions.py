"""The dimensions of a linkage: numbers that describe it, and the linkage in which some of them are a little other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.equations import drive_weights
from armwright.clearance.linkage import GROUND, BodyPoint, Guide, Linkage
from armwright.errors import one_of

DimensionKind: TypeAlias = Literal["clearance", "length", "zero", "tool", "point", "guide", "mass", "load"]
DimensionUnit: TypeAlias = Literal["m", "rad", "kg", "N"]

# Points of a body that are nearer to one another are one place [m].
_SAME_PLACE = 1e-9
_RIGHT_ANGLE = math.pi / 2


class Dimension(NamedTuple):
    """A number that describes a linkage.

    Attributes:
        name: such as ``J2.clearance``, ``link1.length``, ``link1.zero``, ``tool.along``, ``link1:J2.across``,
            ``ground:J1.x``, ``ram.direction``, ``link1.mass``, ``load1.y``.
        kind: what it is.
        unit: of it.
    """

    name: str
    kind: DimensionKind
    unit: DimensionUnit


class Change(NamedTuple):
    """A dimension and what changes it.

    Attributes:
        dimension: the dimension.
        step: a change by which positions differ exactly as by their derivative: 1 m, or a right angle [rad].
        apply: returns a linkage in which the dimension is larger by a number.
    """

    dimension: Dimension
    step: float
    apply: Callable[[Linkage, float], Linkage]


def dimensions_of(linkage: Linkage) -> tuple[Dimension, ...]:
    """Return all dimensions of a linkage.

    These are the clearance of each pin; the length of each body that has two joint points, which is their distance;
    the zero of each drive; the place of the tool, along and across the axis of its body; each coordinate of each point
    that a joint or pin uses; direction and angle of each guide; the masses; and both components of each load.

    When a length is other, the point by which the body is carried, or else the first, stays where it is on the body.
    """
    return (
        *(Dimension(f"{pin.name}.clearance", "clearance", "m") for pin in linkage.pins),
        *(change.dimension for change in length_changes(linkage)),
        *_zeros(linkage),
        *(Dimension(f"tool.{way}", "tool", "m") for way in ("along", "across")),
        *(change.dimension for change in (*point_changes(linkage), *guide_changes(linkage))),
        *(Dimension(f"{body.name}.mass", "mass", "kg") for body in linkage.bodies),
        *(Dimension(f"load{i}.{axis}", "load", "N") for i, _ in enumerate(linkage.loads, 1) for axis in "xy"),
    )


def deviate(linkage: Linkage, deviations: Mapping[str, float]) -> tuple[Linkage, Array]:
    """Return a linkage whose dimensions deviate.

    Args:
        linkage: the nominal one, with d drives.
        deviations: of dimensions by name [m, rad, kg, N].

    Returns:
        The other linkage, and (d,) what its driven coordinates deviate by [rad, m].

    Raises:
        UnknownNameError: there is no such dimension.
        InvalidValueError: a clearance or a mass becomes negative.
    """
    every = dimensions_of(linkage)
    for name in deviations:
        one_of("dimension", name, [dimension.name for dimension in every])
    other = linkage
    for change in (*length_changes(linkage), *point_changes(linkage), *guide_changes(linkage)):
        if by := deviations.get(change.dimension.name, 0.0):
            other = change.apply(other, by)
    if any(deviations.get(f"tool.{way}", 0.0) for way in ("along", "across")):
        other = _with_tool(other, np.array([deviations.get(f"tool.{way}", 0.0) for way in ("along", "across")]))
    other = attrs.evolve(
        other,
        pins=[
            attrs.evolve(pin, clearance=pin.clearance + deviations.get(f"{pin.name}.clearance", 0.0))
            for pin in other.pins
        ],
        bodies=[attrs.evolve(body, mass=body.mass + deviations.get(f"{body.name}.mass", 0.0)) for body in other.bodies],
        loads=[
            attrs.evolve(load, force=load.force + [deviations.get(f"load{i}.{axis}", 0.0) for axis in "xy"])
            for i, load in enumerate(other.loads, 1)
        ],
    )
    zeros = np.array([deviations.get(dimension.name, 0.0) for dimension in _zeros(linkage)])
    return other, zero_shifts(linkage) @ zeros


def length_changes(linkage: Linkage) -> Iterator[Change]:
    """Give the lengths of bodies, in the order of ``dimensions_of``."""
    points = _joint_points(linkage)
    for body in linkage.bodies:
        own = [body.points[point.point] for point in points if point.body == body.name]
        places = [x for i, x in enumerate(own) if all(np.linalg.norm(x - other) > _SAME_PLACE for other in own[:i])]
        if len(places) == 2:
            way = (places[1] - places[0]) / np.linalg.norm(places[1] - places[0])
            dimension = Dimension(f"{body.name}.length", "length", "m")
            yield Change(dimension, 1.0, _mover(linkage, body.name, places[1], way))


def point_changes(linkage: Linkage) -> Iterator[Change]:
    """Give the coordinates of joint points, in the order of ``dimensions_of``."""
    for point in _joint_points(linkage):
        for name, way in zip("xy" if point.body == GROUND else ("along", "across"), np.eye(2), strict=True):
            dimension = Dimension(f"{point}.{name}", "point", "m")
            yield Change(dimension, 1.0, _mover(linkage, point.body, linkage.point(point), way))


def guide_changes(linkage: Linkage) -> Iterator[Change]:
    """Give the angles of guides, in the order of ``dimensions_of``."""
    for number, joint in enumerate(linkage.joints):
        if isinstance(joint, Guide):
            for field in ("direction", "angle"):
                dimension = Dimension(f"{joint.body}.{field}", "guide", "rad")
                yield Change(dimension, _RIGHT_ANGLE, partial(_turned, number, field))


def zero_shifts(linkage: Linkage) -> Array:
    """Return (d, d) the derivatives of the driven coordinates by the zeros of the drives.

    The zero of a drive is against the body that carries it: a driven carrier passes its own on.
    """
    weights = np.zeros((len(linkage.drives), len(linkage.coordinates)))
    for k, drive in enumerate(linkage.drives):
        for i, weight in drive_weights(linkage, drive.body).items():
            weights[k, i] = weight
    return np.asarray(np.linalg.inv(weights[:, list(linkage.driven)]), dtype=np.float64)


def _zeros(linkage: Linkage) -> Iterator[Dimension]:
    for drive, number in zip(linkage.drives, linkage.driven, strict=True):
        unit: DimensionUnit = "rad" if linkage.coordinates[number].kind == "angle" else "m"
        yield Dimension(f"{drive.body}.zero", "zero", unit)


def _joint_points(linkage: Linkage) -> list[BodyPoint]:
    """Return the points that joints and pins use, body by body, that by which a body is carried first."""
    carried = [BodyPoint(joint.body, joint.point) for joint in linkage.joints]
    ends = [joint.on for joint in linkage.joints]
    ends += [end for pin in linkage.pins for end in (pin.bearing, pin.journal)]
    bodies = [GROUND, *(body.name for body in linkage.bodies)]
    every = [BodyPoint(name, point) for name in bodies for point in linkage.body(name).points]
    used = [point for point in every if point in ends or point in carried]
    return sorted(used, key=lambda point: (bodies.index(point.body), point not in carried))


def _mover(linkage: Linkage, body: str, place: Array, way: Array) -> Callable[[Linkage, float], Linkage]:
    """Return what moves the points of a body that are at one place, by a distance along a unit vector."""
    points = linkage.body(body).points
    return partial(_moved, body, [name for name, x in points.items() if np.linalg.norm(x - place) <= _SAME_PLACE], way)


def _moved(body: str, names: Sequence[str], way: Array, linkage: Linkage, distance: float) -> Linkage:
    points = linkage.body(body).points
    return _with_points(linkage, body, {name: points[name] + distance * way for name in names})


def _with_points(linkage: Linkage, body: str, points: Mapping[str, Array]) -> Linkage:
    """Return a linkage with other points on a body, or with more of them."""
    own = linkage.body(body)
    new = attrs.evolve(own, points={**own.points, **points})
    if body == GROUND:
        return attrs.evolve(linkage, ground=new)
    return attrs.evolve(linkage, bodies=[new if each is own else each for each in linkage.bodies])


def _turned(number: int, field: str, linkage: Linkage, angle: float) -> Linkage:
    joints: list[Any] = list(linkage.joints)
    joints[number] = attrs.evolve(joints[number], **{field: getattr(joints[number], field) + angle})
    return attrs.evolve(linkage, joints=joints)


def _with_tool(linkage: Linkage, shift: Array) -> Linkage:
    """Return a linkage whose tip is elsewhere on its body, while a pin that was there stays."""
    name = linkage.tip.point
    while name in linkage.body(linkage.tip.body).points:
        name += "'"
    other = _with_points(linkage, linkage.tip.body, {name: linkage.point(linkage.tip) + shift})
    return attrs.evolve(other, tip=BodyPoint(linkage.tip.body, name))
