"""The arm: an immutable chain of joints and links in the standard Denavit-Hartenberg convention.

Link i is moved by joint i about or along the axis z of frame i-1:

    A_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)

A revolute joint adds its position to ``theta``, a prismatic one to ``d``. Where the four numbers would put a frame far
away, as for axes that are nearly parallel, a fixed transform F stands among them: Rz(theta) Tz(d) F Tx(a) Rx(alpha).
All quantities are SI and radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sized
from functools import cached_property
from typing import Any, Literal, TypeAlias, TypeVar, get_args

import attrs
import numpy as np

from armwright.arm.collision_pairs import CollisionPairs, of_its_bodies
from armwright.arm.coupling import Coupling
from armwright.arm.documents import SourceDocument
from armwright.arm.drive import Motor, Spring, check_numbers
from armwright.arm.limits import JointLimits, Limits
from armwright.arm.tensors import ROUNDING, impossible_moments, moments_message
from armwright.arm.uncertainty import Uncertainty
from armwright.arm.units import PRISMATIC, REVOLUTE, JointUnits
from armwright.arrays import (
    LARGEST,
    LARGEST_ANGLE,
    Array,
    ArrayLike,
    Flags,
    array_key,
    exact_shape,
    read_only,
    reduce_by_fields,
)
from armwright.errors import InvalidValueError, KindError, ShapeError, counted, shown
from armwright.notebook import html_table
from armwright.spatial.poses import one_pose
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.spatial.shapes import Solid

JointKind: TypeAlias = Literal["revolute", "prismatic"]
# Who says which way an arm's gravity points: nobody, its file or its maker, the root of a URDF file, or the cell it
# stands in.
GravityFrom: TypeAlias = Literal["standard", "stated", "root", "world"]
_Part = TypeVar("_Part")

# Standard gravity [m/s²], ISO 80000-3.
STANDARD_GRAVITY = 9.80665
# What an arm that stands upright feels of it, along the axes of its base, or the world [m/s²].
UPRIGHT_GRAVITY = read_only(np.array((0.0, 0.0, -STANDARD_GRAVITY)))


def _com(value: ArrayLike) -> Array:
    return exact_shape(value, (3,), "com", LARGEST)


def _gravity(value: ArrayLike) -> Array:
    return exact_shape(value, (3,), "gravity", LARGEST)


def _base(value: ArrayLike) -> Array:
    return one_pose(value, "base")


def _tool(value: ArrayLike) -> Array:
    return one_pose(value, "tool")


def _fixed(value: ArrayLike | None) -> Array | None:
    return None if value is None else one_pose(value, "fixed")


def _content(value: Array | None) -> object:
    return None if value is None else array_key(value)


def _inertia(value: ArrayLike) -> Array:
    tensor = exact_shape(value, (3, 3), "inertia", LARGEST)
    if not np.allclose(tensor, tensor.T, rtol=0, atol=ROUNDING * max(1.0, np.abs(tensor).max())):
        raise InvalidValueError(f"inertia: expected a symmetric tensor, got {tensor.tolist()}")
    return read_only((tensor + tensor.T) / 2)  # to the last bit, so that six numbers tell it


@attrs.frozen(kw_only=True)
class Joint:
    """One joint and the fixed geometry of the link it moves.

    Attributes:
        kind: ``revolute`` or ``prismatic``.
        theta: fixed part of the angle about z [rad]; the offset of a revolute joint.
        d: fixed part of the shift along z [m]; the offset of a prismatic joint.
        a: shift along x [m].
        alpha: twist about x [rad].
        fixed: (4, 4) transform behind the shift along z and before that along x; None for a row of four numbers.
        limits: what the joint may do.
        spring: what pulls it to a position; one of stiffness 0 where there is none.
        name: as its file calls it; empty where it has none.
    """

    kind: JointKind
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    fixed: Array | None = attrs.field(default=None, converter=_fixed, eq=_content)
    limits: Limits = attrs.field(factory=Limits)
    spring: Spring = attrs.field(factory=Spring)
    name: str = ""

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse a kind of joint that there is not, and geometry that is no number."""
        if not isinstance(self.kind, str) or self.kind not in get_args(JointKind):
            raise InvalidValueError(f"joint: expected kind revolute or prismatic, got {shown(self.kind)}")
        if not isinstance(self.limits, Limits):
            raise KindError(f"joint: expected limits to be Limits, got {shown(self.limits)}")
        if not isinstance(self.spring, Spring):
            raise KindError(f"joint: expected spring to be a Spring, got {shown(self.spring)}")
        check_numbers(self, "joint", ("d", "a"), "finite")
        check_numbers(self, "joint", ("theta", "alpha"), "finite", LARGEST_ANGLE)

    @property
    def revolute(self) -> bool:
        """Whether the joint rotates."""
        return self.kind == "revolute"

    @property
    def units(self) -> JointUnits:
        """The units of its position, its effort and its drive."""
        return REVOLUTE if self.revolute else PRISMATIC

    @property
    def behind(self) -> Array:
        """Pose (4, 4) of frame i behind the rotation about z and the shift along it: F Tx(a) Rx(alpha)."""
        c, s = exact_cosine(self.alpha), exact_sine(self.alpha)
        X = np.array(((1.0, 0.0, 0.0, self.a), (0.0, c, -s, 0.0), (0.0, s, c, 0.0), (0.0, 0.0, 0.0, 1.0)))
        return X if self.fixed is None else np.asarray(self.fixed @ X)

    def span(self, slide: float = 0.0) -> float:
        """Return how far apart the frames before and behind may be, the joint so far out [m]."""
        along = abs(self.d) + slide
        return math.hypot(self.a, along) if self.fixed is None else along + float(np.linalg.norm(self.behind[:3, 3]))


def _solids(value: Iterable[Solid]) -> tuple[Solid, ...]:
    return _parts(value, Solid, "solids")


@attrs.frozen(kw_only=True)
class Link:
    """The body that a joint moves, described in the frame of the link.

    Attributes:
        mass: [kg]; 0 for a body that weighs nothing beside the others, such as that of a joint between two links.
        com: (3,) centre of mass [m].
        inertia: (3, 3) tensor about the centre of mass, axes of the link frame [kg m²].
        complete: whether all moments are known; then the tensor must be one that a body can have.
        unknown: why nothing is known of mass and inertia, which are 0 then; empty where they are known. Dynamics of
            an arm with such a link is refused.
        name: as its file calls it; empty where it has none.
        solids: what of it meets other bodies, in the frame of the link; none where nothing is known.
    """

    mass: float = 0.0
    com: Array = attrs.field(factory=lambda: np.zeros(3), converter=_com, eq=array_key)
    inertia: Array = attrs.field(factory=lambda: np.zeros((3, 3)), converter=_inertia, eq=array_key)
    complete: bool = attrs.field(default=True, eq=False)
    unknown: str = ""
    name: str = ""
    solids: tuple[Solid, ...] = attrs.field(default=(), converter=_solids, eq=False)

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse a negative mass, and a tensor that no body has."""
        check_numbers(self, "link", ("mass",), "0 or more")
        moments = impossible_moments(self.mass, self.com, self.inertia) if self.complete else None
        if moments is not None:
            raise InvalidValueError(
                f"link of {self.mass:g} kg with the inertia {self.inertia.tolist()}: {moments_message(moments)}. "
                "Specify the tensor about the centre of mass, not about the origin of the frame, and check its units "
                "and the signs of its products; complete=False accepts a tensor of which not all moments are known"
            )


def _parts(value: Iterable[_Part], part_class: type[_Part], what: str) -> tuple[_Part, ...]:
    """Return parts of an arm as a tuple, all of which must be of one class."""
    try:
        parts = tuple(value)
    except TypeError as error:
        raise KindError(f"{what}: expected a list of {part_class.__name__}, got {shown(value)}") from error
    for i, part in enumerate(parts, 1):
        if not isinstance(part, part_class):
            raise KindError(f"{what}: expected each to be a {part_class.__name__}, got {shown(part)} as number {i}")
    return parts


def _joints(value: Iterable[Joint]) -> tuple[Joint, ...]:
    return _parts(value, Joint, "joints")


def _links(value: Iterable[Link]) -> tuple[Link, ...]:
    return _parts(value, Link, "links")


def _motors(value: Iterable[Motor]) -> tuple[Motor, ...]:
    return _parts(value, Motor, "motors")


def _documents(value: Iterable[SourceDocument]) -> tuple[SourceDocument, ...]:
    return _parts(value, SourceDocument, "documents")


def _same_length(arm: Arm, attribute: attrs.Attribute[Any], value: Sized) -> None:
    if len(value) != len(arm.joints):
        raise ShapeError(f"arm '{arm.name}': {len(arm.joints)} joints but {len(value)} {attribute.name}")


def _coupling(value: Coupling | None) -> Coupling | None:
    """Return what couples the drives; None where each moves its own joint alone, as if nothing were said."""
    if not isinstance(value, Coupling):
        return value
    return None if np.array_equal(value.matrix, np.eye(len(value.matrix))) else value


def _of_its_joints(arm: Arm, _: attrs.Attribute[Any], value: Coupling | None) -> None:
    if value is None:
        return
    if not isinstance(value, Coupling):
        raise KindError(f"arm '{arm.name}': expected coupling to be a Coupling or None, got {shown(value)}")
    if len(value.matrix) != len(arm.joints):
        raise ShapeError(
            f"arm '{arm.name}': {len(arm.joints)} joints but a coupling of {len(value.matrix)}; expected a row and a "
            "column for each joint"
        )


@attrs.frozen(kw_only=True, repr=False, cache_hash=True)
class Arm:
    """A serial arm of n joints. Equal arms hash equal, so an arm can be a key.

    Attributes:
        name: short name, as in the catalogue.
        title: one line on what it is.
        joints: n joints from the base to the hand.
        links: n links, in the same order.
        motors: n drives, in the same order.
        coupling: how the drives move the joints; None where each moves its own joint alone.
        base: (4, 4) pose of Denavit-Hartenberg frame 0 in the base frame of the arm.
        tool: (4, 4) pose of the tool in the frame of the last link.
        gravity: (3,) acceleration of free fall in the base frame [m/s²].
        gravity_from: who says so: ``standard`` where nobody does, ``stated`` by its file or whoever built it, ``root``
            where it points down in the root link of a URDF file, ``world`` in a cell.
        reach: greatest distance of the hand from the base axis that the report's speed rule divides by [m].
        tool_speed: speed of the hand at full reach [m/s].
        base_solids: what of the base meets other bodies, in the base frame.
        collisions: pairs of its bodies that are checked for collisions, or not, whatever the rule says.
        base_link: what the base frame is called in its file; empty where it has no name.
        tool_link: what the tool is called.
        source: where the numbers come from.
        uncertainty: how well they are known, if they were measured.
        documents: the documents that the numbers were read in, and which of them each gives.
    """

    name: str
    title: str = ""
    joints: tuple[Joint, ...] = attrs.field(converter=_joints)
    links: tuple[Link, ...] = attrs.field(
        default=attrs.Factory(lambda self: (Link(),) * len(self.joints), takes_self=True),
        converter=_links,
        validator=_same_length,
    )
    motors: tuple[Motor, ...] = attrs.field(
        default=attrs.Factory(lambda self: (Motor(),) * len(self.joints), takes_self=True),
        converter=_motors,
        validator=_same_length,
    )
    coupling: Coupling | None = attrs.field(default=None, converter=_coupling, validator=_of_its_joints)
    base: Array = attrs.field(factory=lambda: np.eye(4), converter=_base, eq=array_key)
    tool: Array = attrs.field(factory=lambda: np.eye(4), converter=_tool, eq=array_key)
    gravity: Array = attrs.field(factory=lambda: UPRIGHT_GRAVITY, converter=_gravity, eq=array_key)
    gravity_from: GravityFrom = attrs.field(default="standard", eq=False)
    reach: float = math.inf
    tool_speed: float = math.inf
    base_solids: tuple[Solid, ...] = attrs.field(default=(), converter=_solids, eq=False)
    collisions: CollisionPairs = attrs.field(factory=CollisionPairs, eq=False, validator=of_its_bodies)
    base_link: str = ""
    tool_link: str = ""
    source: str = ""
    uncertainty: Uncertainty | None = None
    documents: tuple[SourceDocument, ...] = attrs.field(default=(), converter=_documents, eq=False)

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse an arm without joints, and a hand that goes nowhere."""
        if not self.joints:
            raise ShapeError(f"arm '{self.name}': expected at least one joint")
        check_numbers(self, f"arm '{self.name}'", ("reach", "tool_speed"), "above 0")
        if self.gravity_from not in get_args(GravityFrom):
            known, got = ", ".join(get_args(GravityFrom)), shown(self.gravity_from)
            raise InvalidValueError(f"arm '{self.name}': expected gravity_from to be one of {known}, got {got}")
        if self.gravity_from == "standard" and not np.array_equal(self.gravity, UPRIGHT_GRAVITY):
            object.__setattr__(self, "gravity_from", "stated")

    def __repr__(self) -> str:
        """Say which arm it is; its tables are in its attributes, and in ``armwright show``."""
        kinds = "".join("R" if joint.revolute else "P" for joint in self.joints)
        return f"<Arm '{self.name}': {counted(self.n, 'joint')}, {kinds}>"

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    def joint_label(self, joint: int) -> str:
        """Return how messages call a joint, from 0: by its number, and its name where it has one."""
        name = self.joints[joint].name
        return f"joint {joint + 1} ('{name}')" if name else f"joint {joint + 1}"

    @cached_property
    def limits(self) -> JointLimits:
        """The limits of all joints, each (n,)."""
        values = np.array([attrs.astuple(joint.limits) for joint in self.joints]).T
        return JointLimits(**dict(zip(attrs.fields_dict(Limits), values, strict=True)))

    @cached_property
    def all_limits(self) -> JointLimits:
        """The limits of all joints, and behind them of all drives where coupled drives have limits of their own.

        Each is (n,) or (2 n,); number k belongs to joint k % n or its drive.
        """
        if self.coupling is None or not self.coupling.limits:
            return self.limits
        own, of_drives = self.limits, self.coupling.drive_limits
        names = attrs.fields_dict(JointLimits)
        return JointLimits(**{x: np.concatenate([getattr(own, x), getattr(of_drives, x)]) for x in names})

    @cached_property
    def revolute(self) -> Flags:
        """Which joints rotate, (n,)."""
        return read_only(np.array([joint.revolute for joint in self.joints]))

    @property
    def massless(self) -> bool:
        """Whether no link has a mass or an inertia, so that efforts say nothing of the arm."""
        return not any(link.mass or link.inertia.any() for link in self.links)

    def motor_values(self, name: str) -> Array:
        """Return one of the numbers of all motors, (n,), by its name in ``Motor``."""
        return np.array([getattr(motor, name) for motor in self.motors])

    def _repr_html_(self) -> str:
        """Show the joints, their Denavit-Hartenberg parameters and their limits as a table."""
        columns = ("", "joint", "kind", "theta", "d", "a", "alpha", "lower", "upper", "speed", "acceleration", "effort")
        rows = []
        for position, joint in enumerate(self.joints, 1):
            limits = attrs.astuple(joint.limits)
            own = ("",) * 4 if joint.fixed is not None else (joint.theta, joint.d, joint.a, joint.alpha)
            rows.append((str(position), joint.name, str(joint.kind), *own, *limits))
        return html_table(f"{self.name}: {self.title} (SI units, angles in rad)", columns, rows)
