"""The arm: an immutable chain of joints and links in the standard Denavit-Hartenberg convention.

Link i is moved by joint i about or along the axis z of frame i-1:

    A_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)

A revolute joint adds its position to ``theta``, a prismatic one to ``d``. All quantities are SI and radians.
"""

import math
from collections.abc import Iterable, Sized
from typing import Any, Literal, TypeAlias, get_args

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, exactly
from armwright.errors import InvalidValueError, ShapeError
from armwright.spatial.poses import one_pose

JointKind: TypeAlias = Literal["revolute", "prismatic"]

# Inertia tensors are computed from typed numbers; this much is rounding, more is a mistake.
_ROUNDING = 1e-9
# Standard gravity [m/s²], ISO 80000-3.
STANDARD_GRAVITY = 9.80665


def _vector(value: ArrayLike) -> Array:
    return exactly(value, (3,), "vector")


def _inertia(value: ArrayLike) -> Array:
    tensor = exactly(value, (3, 3), "inertia")
    if not np.allclose(tensor, tensor.T, rtol=0, atol=_ROUNDING * max(1.0, np.abs(tensor).max())):
        raise InvalidValueError(f"inertia: expected a symmetric tensor, got {tensor.tolist()}")
    return tensor


def exact_cosine(angle: float) -> float:
    """Return cos(angle), exactly 0 or ±1 at the multiples of a right angle.

    Twist angles of real arms are right angles; the zeros they leave are structure, not rounding.
    """
    return _exact(math.cos(angle))


def exact_sine(angle: float) -> float:
    """Return sin(angle), exactly 0 or ±1 at the multiples of a right angle."""
    return _exact(math.sin(angle))


def _exact(value: float) -> float:
    return round(value) + 0.0 if abs(value - round(value)) < 1e-15 else value


@attrs.frozen(kw_only=True)
class Limits:
    """What a joint may do. Positions [rad] or [m]; the others are magnitudes; infinite where nothing is known.

    Attributes:
        lower: smallest position.
        upper: largest position.
        speed: largest speed [rad/s] or [m/s].
        acceleration: largest acceleration [rad/s²] or [m/s²].
        effort: largest torque [N m] or force [N], at the joint.
    """

    lower: float = -math.inf
    upper: float = math.inf
    speed: float = math.inf
    acceleration: float = math.inf
    effort: float = math.inf

    def __attrs_post_init__(self) -> None:
        """Refuse limits that nothing can satisfy."""
        if not self.lower < self.upper:
            raise InvalidValueError(f"limits: lower {self.lower} must be below upper {self.upper}")
        for name in ("speed", "acceleration", "effort"):
            if not getattr(self, name) > 0:
                raise InvalidValueError(f"limits: {name} must be above 0, got {getattr(self, name)}")


@attrs.frozen(kw_only=True)
class Joint:
    """One joint and the fixed geometry of the link it moves.

    Attributes:
        kind: ``revolute`` or ``prismatic``.
        theta: fixed part of the angle about z [rad]; the offset of a revolute joint.
        d: fixed part of the shift along z [m]; the offset of a prismatic joint.
        a: shift along x [m].
        alpha: twist about x [rad].
        limits: what the joint may do.
    """

    kind: JointKind
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    limits: Limits = Limits()

    def __attrs_post_init__(self) -> None:
        """Refuse a kind of joint that there is not, and geometry that is no number."""
        if self.kind not in get_args(JointKind):
            raise InvalidValueError(f"joint: expected kind revolute or prismatic, got {self.kind!r}")
        for name in ("theta", "d", "a", "alpha"):
            if not math.isfinite(getattr(self, name)):
                raise InvalidValueError(f"joint: {name} must be finite, got {getattr(self, name)}")

    @property
    def revolute(self) -> bool:
        """Whether the joint turns."""
        return self.kind == "revolute"

    @property
    def cos_theta(self) -> float:
        """Cosine of the fixed part of the angle, exact at right angles."""
        return exact_cosine(self.theta)

    @property
    def sin_theta(self) -> float:
        """Sine of the fixed part of the angle, exact at right angles."""
        return exact_sine(self.theta)

    @property
    def cos_alpha(self) -> float:
        """Cosine of the twist, exact at right angles."""
        return exact_cosine(self.alpha)

    @property
    def sin_alpha(self) -> float:
        """Sine of the twist, exact at right angles."""
        return exact_sine(self.alpha)


@attrs.frozen(kw_only=True)
class Link:
    """The body that a joint moves, described in the frame of the link.

    Attributes:
        mass: [kg].
        com: (3,) centre of mass [m].
        inertia: (3, 3) tensor about the centre of mass, axes of the link frame [kg m²].
    """

    mass: float = 0.0
    com: Array = attrs.field(factory=lambda: np.zeros(3), converter=_vector, eq=attrs.cmp_using(eq=np.array_equal))
    inertia: Array = attrs.field(
        factory=lambda: np.zeros((3, 3)), converter=_inertia, eq=attrs.cmp_using(eq=np.array_equal)
    )

    def __attrs_post_init__(self) -> None:
        """Refuse a negative mass."""
        if not 0 <= self.mass < math.inf:
            raise InvalidValueError(f"link: mass must be 0 or more, got {self.mass}")


@attrs.frozen(kw_only=True)
class Motor:
    """The drive of a joint, as felt at the joint.

    Attributes:
        inertia: of the rotor and gear at the load side [kg m²], or [kg] for a prismatic joint.
        viscous: friction per speed [N m s] or [N s/m].
        coulomb_forward: magnitude of dry friction while the joint moves in the direction of q [N m] or [N].
        coulomb_backward: the same, against the direction of q.
        gear_ratio: turns of the motor per turn of the joint; for information, ``inertia`` has it already.
    """

    inertia: float = 0.0
    viscous: float = 0.0
    coulomb_forward: float = 0.0
    coulomb_backward: float = 0.0
    gear_ratio: float = 1.0

    def __attrs_post_init__(self) -> None:
        """Refuse drives that give energy for nothing."""
        for name in ("inertia", "viscous", "coulomb_forward", "coulomb_backward"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InvalidValueError(f"motor: {name} must be 0 or more, got {getattr(self, name)}")


def _joints(value: Iterable[Joint]) -> tuple[Joint, ...]:
    return tuple(value)


def _links(value: Iterable[Link]) -> tuple[Link, ...]:
    return tuple(value)


def _motors(value: Iterable[Motor]) -> tuple[Motor, ...]:
    return tuple(value)


def _same_length(arm: "Arm", attribute: "attrs.Attribute[Any]", value: Sized) -> None:
    if len(value) != len(arm.joints):
        raise ShapeError(f"arm '{arm.name}': {len(arm.joints)} joints but {len(value)} {attribute.name}")


@attrs.frozen(kw_only=True)
class Arm:
    """A serial arm of n joints.

    Attributes:
        name: short name, as in the catalogue.
        title: one line on what it is.
        joints: n joints from the base to the hand.
        links: n links, in the same order.
        motors: n drives, in the same order.
        base: (4, 4) pose of Denavit-Hartenberg frame 0 in the base frame of the arm.
        tool: (4, 4) pose of the tool in the frame of the last link.
        gravity: (3,) acceleration of free fall in the base frame [m/s²].
        reach: greatest distance of the hand from the base axis that the report's speed rule divides by [m].
        tool_speed: speed of the hand at full reach [m/s].
        source: where the numbers come from.
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
    base: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose, eq=attrs.cmp_using(eq=np.array_equal))
    tool: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose, eq=attrs.cmp_using(eq=np.array_equal))
    gravity: Array = attrs.field(
        factory=lambda: np.array((0.0, 0.0, -STANDARD_GRAVITY)),
        converter=_vector,
        eq=attrs.cmp_using(eq=np.array_equal),
    )
    reach: float = math.inf
    tool_speed: float = math.inf
    source: str = ""

    def __attrs_post_init__(self) -> None:
        """Refuse an arm without joints."""
        if not self.joints:
            raise ShapeError(f"arm '{self.name}': expected at least one joint")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    def limit(self, name: str) -> Array:
        """Return one limit of every joint, (n,), such as ``limit('speed')``."""
        return np.array([getattr(joint.limits, name) for joint in self.joints])
