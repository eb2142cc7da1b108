"""Planar linkages: bodies, ideal joints that connect them to trees, pins with clearance that close the loops.

Lengths are in metres, angles in radians, counter-clockwise positive. The axis of a body at angle θ points along
(cos(θ + zero), sin(θ + zero)); with ``zero`` = -π/2 angles are measured from the downward vertical. The axis of the
ground points along x.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, in_range, not_negative, number, of_shape, positive
from armwright.clearance.elastic_rod import Elasticity, Rod, RodBody, rod_of_body
from armwright.errors import ArmwrightError, InvalidValueError, UnknownNameError, one_of

# The name of the fixed body.
GROUND = "ground"
# Of the thesis [m/s²]; the standard's 9.80665 changes nothing to four digits.
GRAVITY = (0.0, -9.81)
# Radii of journals [mm].
_RADII = (1e-3, 1e5)

DriveKind: TypeAlias = Literal["effort", "motion"]


def _vector2(value: ArrayLike) -> Array:
    return exact_shape(value, (2,), "point", LARGEST)


def _points(value: Mapping[str, ArrayLike]) -> dict[str, Array]:
    return {name: exact_shape(point, (2,), f"point {name}", LARGEST) for name, point in value.items()}


def _as_tuple(value: Iterable[Any]) -> tuple[Any, ...]:
    return tuple(value)


class BodyPoint(NamedTuple):
    """A point of a body, written ``body:point``."""

    body: str
    point: str

    def __str__(self) -> str:
        """Return the point as a file writes it."""
        return f"{self.body}:{self.point}"


@attrs.frozen(kw_only=True, eq=False)
class Body:
    """A rigid body, or an elastic one.

    Attributes:
        name: of the body.
        mass: [kg].
        inertia: about its centre of mass [kg m²].
        centre: (2,) centre of mass, along the axis of the body and across it [m].
        points: (2,) points of it by name, in the same axes [m].
        elastic: what bends and stretches; None for a rigid body.
    """

    name: str
    mass: float = 0.0
    inertia: float = 0.0
    centre: Array = attrs.field(converter=_vector2, default=(0.0, 0.0))
    points: Mapping[str, Array] = attrs.field(converter=_points, factory=dict)
    elastic: Elasticity | None = None

    def __attrs_post_init__(self) -> None:
        """Check mass and inertia."""
        not_negative(self.mass, f"body {self.name}: mass")
        not_negative(self.inertia, f"body {self.name}: inertia")


@attrs.frozen(kw_only=True)
class Pin:
    """An ideal pin: a point of a body stays on a point of another.

    Attributes:
        body: the body that it carries.
        point: the point of that body.
        on: the point of the other body.
    """

    body: str
    point: str
    on: BodyPoint


@attrs.frozen(kw_only=True)
class Guide:
    """An ideal guide: a body slides along a line of another, without rotating on it.

    Attributes:
        body: the body that slides.
        point: the point of it that stays on the line.
        on: a point of the other body, on the line.
        direction: of the line, from the axis of the body that has it [rad].
        angle: of the body's axis, from the same axis [rad].
    """

    body: str
    point: str
    on: BodyPoint
    direction: float = 0.0
    angle: float = 0.0


@attrs.frozen(kw_only=True)
class ClearancePin:
    """A pin with clearance: its journal is smaller than its bearing.

    Attributes:
        name: of the pin.
        bearing: the middle of the hole.
        journal: the middle of the shaft in it.
        clearance: radius of the bearing minus that of the journal [m].
        journal_radius: [m].
    """

    name: str
    bearing: BodyPoint
    journal: BodyPoint
    clearance: float
    journal_radius: float

    def __attrs_post_init__(self) -> None:
        """Check the radii."""
        not_negative(self.clearance, f"pin {self.name}: clearance")
        positive(self.journal_radius, f"pin {self.name}: journal radius")
        in_range(self.journal_radius * 1e3, _RADII, f"pin {self.name}: journal radius", "mm")


@attrs.frozen(kw_only=True)
class Drive:
    """A motor at the ideal joint of a body.

    Attributes:
        body: the body that it moves against the body that carries it.
        kind: ``effort`` when a torque or force is given, ``motion`` when the motion is.
    """

    body: str
    kind: DriveKind = "effort"


@attrs.frozen(kw_only=True, eq=False)
class Load:
    """A constant force on a point.

    Attributes:
        point: on which the force acts.
        force: (2,) in the axes of the ground [N].
    """

    point: BodyPoint
    force: Array = attrs.field(converter=_vector2)


@attrs.frozen(kw_only=True)
class Material:
    """What bearings and journals are made of.

    Attributes:
        young: modulus of elasticity [Pa].
        poisson: ratio.
        restitution: of an impact, 0 to 1.
        friction: coefficient of dry sliding.
    """

    young: float = 207e9
    poisson: float = 0.3
    restitution: float = 0.9
    friction: float = 0.05

    def __attrs_post_init__(self) -> None:
        """Check the ranges."""
        positive(self.young, "young")
        not_negative(self.friction, "friction")
        if not -1 < number(self.poisson, "poisson") <= 0.5:
            raise InvalidValueError(f"poisson: expected a ratio above -1, at most 0.5, got {self.poisson:g}")
        if not 0 < number(self.restitution, "restitution") <= 1:
            raise InvalidValueError(f"restitution: expected a number above 0, at most 1, got {self.restitution:g}")


class Coordinate(NamedTuple):
    """One number of a configuration.

    It is an ``angle``, a ``slide`` along a guide, ``x`` or ``y`` of a centre, or one of ``Elasticity.kinds``.
    """

    body: str
    kind: str

    def __str__(self) -> str:
        """Return the name under which it is shown."""
        return f"{self.body}.{self.kind}"


# The coordinates of a body by its ideal joint.
_JOINT_COORDINATES: Mapping[type, tuple[str, ...]] = {
    Pin: ("angle",),
    Guide: ("slide",),
    type(None): ("x", "y", "angle"),
}


@attrs.frozen(kw_only=True, eq=False)
class Linkage:
    """A planar linkage.

    Attributes:
        name: of the linkage.
        bodies: all but the ground; each after the one that carries it.
        ground: the fixed body.
        joints: ideal ones; at most one for each body, none for a body that only pins with clearance hold.
        pins: those with clearance.
        drives: the motors.
        loads: constant forces.
        tip: the point that is to follow a path.
        gravity: (2,) [m/s²].
        zero: direction of a body's axis at angle 0 [rad].
        material: of bearings and journals.
        assembly: roughly where the bodies are, by name: angles [rad], slides along guides [m]; this chooses among
            several assemblies of the linkage.
    """

    name: str
    bodies: tuple[Body, ...] = attrs.field(converter=_as_tuple)
    ground: Body
    joints: tuple[Pin | Guide, ...] = attrs.field(converter=_as_tuple)
    pins: tuple[ClearancePin, ...] = attrs.field(converter=_as_tuple)
    drives: tuple[Drive, ...] = attrs.field(converter=_as_tuple)
    loads: tuple[Load, ...] = attrs.field(converter=_as_tuple, default=())
    tip: BodyPoint
    gravity: Array = attrs.field(converter=_vector2, default=GRAVITY)
    zero: float = 0.0
    material: Material = attrs.field(factory=Material)
    assembly: Mapping[str, float] = attrs.field(factory=dict)

    def __attrs_post_init__(self) -> None:
        """Check that everything named is there and that the ideal joints make trees."""
        names = [GROUND, *(body.name for body in self.bodies)]
        _check_unique("body", names)
        _check_unique("pin", [pin.name for pin in self.pins])
        _check_unique("joint of body", [joint.body for joint in self.joints])
        _check_unique("drive of body", [drive.body for drive in self.drives])
        known = {GROUND}
        for body in self.bodies:
            joint = self.joint(body.name)
            if joint is not None and joint.on.body not in known:
                one_of("body", joint.on.body, names)
                raise InvalidValueError(
                    f"body {body.name} is carried by {joint.on.body}, which must be named before it"
                )
            if body.mass == 0 or (body.inertia == 0 and not isinstance(joint, Guide)):
                raise InvalidValueError(f"body {body.name}: mass and inertia must be above 0")
            known.add(body.name)
        for joint in self.joints:
            self.point(BodyPoint(one_of("body", joint.body, names[1:]), joint.point))
        for point in (
            *(joint.on for joint in self.joints),
            *(load.point for load in self.loads),
            *(end for pin in self.pins for end in (pin.bearing, pin.journal)),
            self.tip,
        ):
            self.point(point)
        for drive in self.drives:
            if self.joint(drive.body) is None:
                raise InvalidValueError(f"drive of {drive.body}: the body has no ideal joint that it could drive")
            one_of("kind of drive", drive.kind, ("effort", "motion"))
            self._check_prescribed(drive)
        for name in self.assembly:
            one_of("body", name, names[1:])
        self._check_rods()

    def joint(self, body: str) -> Pin | Guide | None:
        """Return the ideal joint that carries a body; None for a free one."""
        return next((joint for joint in self.joints if joint.body == body), None)

    def body(self, name: str) -> Body:
        """Return a body, or the ground.

        Raises:
            UnknownNameError: there is none of that name.
        """
        bodies = {GROUND: self.ground, **{body.name: body for body in self.bodies}}
        return bodies[one_of("body", name, bodies)]

    def point(self, point: BodyPoint) -> Array:
        """Return (2,) the position of a point in the axes of its body [m].

        Raises:
            UnknownNameError: there is no such body or no such point on it.
        """
        points = self.body(point.body).points
        if point.point not in points:
            raise UnknownNameError(f"point of {point.body}", point.point, points)
        return points[point.point]

    @property
    def rods(self) -> dict[str, Rod]:
        """The elastic bodies.

        Raises:
            InvalidValueError: a body cannot be the elastic rod that it is said to be.
        """
        driven, rods = [drive.body for drive in self.drives], {}
        for body in self.bodies:
            if body.elastic is not None:
                joint, numbers = self.joint(body.name), RodBody(body.mass, body.inertia, *body.centre.tolist())
                held = None if joint is None else joint.point
                try:
                    rods[body.name] = rod_of_body(body.elastic, numbers, body.points, held, clamped=body.name in driven)
                except ArmwrightError as error:
                    raise InvalidValueError(f"elastic body {body.name}: {error}") from error
        return rods

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The coordinates of a configuration, in order: those of the bodies as rigid ones, then those of the rods."""
        elastic = [Coordinate(body.name, kind) for body in self.bodies if body.elastic for kind in body.elastic.kinds]
        return (*self.rigid_coordinates, *elastic)

    @property
    def rigid_coordinates(self) -> tuple[Coordinate, ...]:
        """The coordinates of a configuration whose rods are straight."""
        bodies = [(body.name, _JOINT_COORDINATES[type(self.joint(body.name))]) for body in self.bodies]
        return tuple(Coordinate(body, kind) for body, kinds in bodies for kind in kinds)

    @property
    def driven(self) -> tuple[int, ...]:
        """The numbers of the driven coordinates, in the order of the drives."""
        numbers = {body: i for i, (body, kind) in enumerate(self.coordinates) if kind in ("angle", "slide")}
        return tuple(numbers[drive.body] for drive in self.drives)

    @property
    def clearances(self) -> dict[str, float]:
        """The clearance of each pin [m]."""
        return {pin.name: pin.clearance for pin in self.pins}

    def clearance_array(self, clearances: ArrayLike | None) -> Array:
        """Return clearances (..., p) as an array; those of the pins where none are given [m].

        Raises:
            ShapeError: they are not one per pin.
        """
        own = self.clearances
        values = list(own.values()) if clearances is None else clearances
        return of_shape(values, (len(own),), f"clearances of {', '.join(own) or 'no pins'}")

    def with_clearances(self, clearances: Mapping[str, float]) -> Linkage:
        """Return the same linkage with other clearances at some pins [m].

        Raises:
            UnknownNameError: there is no such pin.
            InvalidValueError: a clearance is negative.
        """
        for name in clearances:
            one_of("pin", name, self.clearances)
        pins = tuple(attrs.evolve(pin, clearance=clearances.get(pin.name, pin.clearance)) for pin in self.pins)
        return attrs.evolve(self, pins=pins)

    def as_data(self) -> dict[str, Any]:
        """Return the linkage as JSON holds it."""
        data: dict[str, Any] = json.loads(json.dumps(attrs.asdict(self), default=np.ndarray.tolist))
        for body in (data["ground"], *data["bodies"]):
            if body["elastic"] is None:
                del body["elastic"]
        return data

    def rotation_carrier(self, body: str) -> str | None:
        """Return the body whose angle the drive of a body acts against; None where its joint is no pin.

        A body that slides on a guide rotates with the body that carries the guide.
        """
        joint = self.joint(body)
        if not isinstance(joint, Pin):
            return None
        carrier = joint.on.body
        while isinstance(guide := self.joint(carrier), Guide):
            carrier = guide.on.body
        return carrier

    def _check_prescribed(self, drive: Drive) -> None:
        """Refuse a prescribed motion of a body on a pin whose carrier has no prescribed motion."""
        carrier = self.rotation_carrier(drive.body) if drive.kind == "motion" else None
        prescribed = [drive.body for drive in self.drives if drive.kind == "motion"]
        if carrier not in (None, GROUND, *prescribed):
            raise InvalidValueError(
                f"drive of {drive.body}: its motion can be given only if that of {carrier} is, which carries it"
            )

    def _check_rods(self) -> None:
        """Refuse elastic bodies that are no beams, and guides and prescribed motions on them."""
        rods = self.rods
        for joint in self.joints:
            if isinstance(joint, Guide) and {joint.body, joint.on.body} & rods.keys():
                raise InvalidValueError(
                    f"guide of {joint.body}: expected rigid bodies on both sides of a guide; pins join elastic ones"
                )
        for drive in self.drives:
            if drive.kind == "motion" and self.rotation_carrier(drive.body) in rods:
                raise InvalidValueError(
                    f"drive of {drive.body}: its motion cannot be given against an elastic body; expected kind effort"
                )


def _check_unique(kind: str, names: list[str]) -> None:
    """Refuse a name that occurs twice."""
    for i, name in enumerate(names):
        if name in names[:i]:
            raise InvalidValueError(f"{kind} '{name}' is defined twice")


def round_to_right_angle(x: float) -> float:
    """Return a sine or cosine, exactly 0 or ±1 at the multiples of a right angle."""
    near = float(round(x))
    return near if math.isclose(x, near, abs_tol=1e-12) else x
