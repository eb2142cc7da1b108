"""The terms of the equation of motion: the effort of each joint by its causes."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arm.model import Arm, Link
from armwright.arrays import Array, ArrayLike, read_only, reduce_by_fields
from armwright.dynamics.arguments import batch, stack_matrix
from armwright.dynamics.drives import drive_rates, drives_at_joints, joint_friction_law
from armwright.dynamics.lagrange_euler import (
    gravity_coefficients,
    inertia_coefficients,
    pose_derivatives,
    speed_coefficients,
)
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.payloads import payload
from armwright.dynamics.springs import spring_efforts
from armwright.errors import KindError, shown
from armwright.kinematics.forward_kinematics import stack
from armwright.tracing.scalar import Scalar

_NO_LOAD = Link()


@attrs.frozen(kw_only=True, eq=False)
class Terms:
    """Efforts at n joints by their cause, [N m] or [N], positive in the direction of q.

    The first n-axis is always the joint that bears the effort.

    Attributes:
        own: (..., n) links, by the acceleration of the joint itself.
        coupling: (..., n, n) links, by the acceleration of another joint; 0 on the diagonal.
        motor: (..., n) rotor inertia.
        centrifugal: (..., n, n) by the squared speed of a joint.
        coriolis: (..., n, n, n) by the product of the speeds of two joints j < k, both orders together; 0 elsewhere.
        gravity: (..., n) weight of the links.
        viscous: (..., n) friction that grows with speed.
        dry: (..., n) Coulomb and Stribeck friction of moving joints; 0 at rest, where it depends on the other efforts.
        smooth: (..., n) offset of the friction, and friction that grows with the cube root of speed.
        spring: (..., n) springs at the joints.
        load: (..., n) by a load on the tool: its inertia, its speed and its weight.
        outside: (..., n) by a wrench on the tool.

    Source:
        TR-83-008, the program of appendix IV.
    """

    own: Array = attrs.field(converter=read_only)
    coupling: Array = attrs.field(converter=read_only)
    motor: Array = attrs.field(converter=read_only)
    centrifugal: Array = attrs.field(converter=read_only)
    coriolis: Array = attrs.field(converter=read_only)
    gravity: Array = attrs.field(converter=read_only)
    viscous: Array = attrs.field(converter=read_only)
    dry: Array = attrs.field(converter=read_only)
    smooth: Array = attrs.field(converter=read_only)
    spring: Array = attrs.field(converter=read_only)
    load: Array = attrs.field(converter=read_only)
    outside: Array = attrs.field(converter=read_only)

    __reduce__ = reduce_by_fields

    @property
    def by_acceleration(self) -> Array:
        """Efforts by accelerations, rotors included (..., n): ACCF of the report's program."""
        return np.asarray(self.own + self.coupling.sum(axis=-1) + self.motor)

    @property
    def by_speed(self) -> Array:
        """Centrifugal and Coriolis efforts (..., n): COR of the report's program."""
        return np.asarray(self.centrifugal.sum(axis=-1) + self.coriolis.sum(axis=(-2, -1)))

    @property
    def friction(self) -> Array:
        """Friction of all kinds, (..., n)."""
        return self.viscous + self.dry + self.smooth

    @property
    def total(self) -> Array:
        """All efforts, (..., n): F of the report's program, where it has the causes."""
        links = self.by_acceleration + self.by_speed + self.gravity
        return links + self.friction + self.load + self.outside + self.spring


def terms(
    arm: Arm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, load: Link = _NO_LOAD, wrench: ArrayLike | None = None
) -> Terms:
    """Return the efforts of one configuration or of many, by their cause.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.
        load: a body fixed at the tool, described in the tool frame.
        wrench: (..., 6) force [N] and moment [N m] acting on the tool from outside, at the tool point, along
            base axes; none when left out.

    Returns:
        The terms; their total equals ``inverse_dynamics`` of the arm with the load.

    Raises:
        KindError: ``arm`` is no arm, ``load`` no link, or an array something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (12)-(16) and subroutine GLAGRA, which adds them up as ACCF, COR and G.
    """
    if not isinstance(load, Link):
        raise KindError(f"load: expected a Link, got {shown(load)}")
    lead, (q_, qd_, qdd_), push = batch(arm, wrench=wrench, q=q, qd=qd, qdd=qdd)
    n = arm.n
    still = [0.0] * n
    # Loads and wrenches on the tool act through links without mass.
    bare = attrs.evolve(arm, links=[_NO_LOAD] * n)
    derivatives = pose_derivatives(arm, q_)
    D = inertia_coefficients(derivatives)
    h = speed_coefficients(derivatives)
    motors = list(zip(arm.motors, drive_rates(arm, qd_), drive_rates(arm, qdd_), strict=True))
    laws = [(joint_friction_law(motor), speed) for motor, speed, _ in motors]

    def at_joints(efforts: list[Scalar]) -> Array:
        return stack(drives_at_joints(arm, efforts), lead)

    pairs = [
        [[2.0 * h[i][j][k] * (qd_[j] * qd_[k]) if j < k else 0.0 for k in range(n)] for j in range(n)] for i in range(n)
    ]
    return Terms(
        own=stack([D[i][i] * qdd_[i] for i in range(n)], lead),
        coupling=stack_matrix([[D[i][j] * qdd_[j] if j != i else 0.0 for j in range(n)] for i in range(n)], lead),
        motor=at_joints([motor.inertia * acceleration for motor, _, acceleration in motors]),
        centrifugal=stack_matrix([[h[i][j][j] * (qd_[j] * qd_[j]) for j in range(n)] for i in range(n)], lead),
        coriolis=stack([x for plane in pairs for row in plane for x in row], lead).reshape(*lead, n, n, n),
        gravity=stack(gravity_coefficients(arm, derivatives), lead),
        viscous=at_joints([motor.viscous * speed for motor, speed, _ in motors]),
        dry=at_joints([law.dry(speed, speed) for law, speed in laws]),
        smooth=at_joints([law.smooth(speed) for law, speed in laws]),
        spring=stack([0.0 if effort is None else effort for effort in spring_efforts(arm, q_)], lead),
        load=stack(newton_euler(payload(bare, load.mass, load.com, load.inertia), q_, qd_, qdd_), lead),
        outside=stack(newton_euler(bare, q_, still, still, push), lead),
    )
