"""The drives of the joints: rotor inertia and the law of friction, over abstract scalars.

Where drives are coupled they have velocities of their own, m' = C⁻¹ q', and what they require of efforts is seen at the
joints as C⁻ᵀ times that. Of a matrix only what is not 0 is computed: a drive that moves its own joint alone costs
nothing more, and has the same bits as without a coupling.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.arguments import Scalars
from armwright.tracing.scalar import Scalar, cbrt, exp, select
from armwright.tracing.scan import scan
from armwright.tracing.vectors import Matrix, add, subtract

# Below this speed friction by the cube root of the speed is in proportion to the speed [rad/s, m/s].
SLOW = 1e-4


class FrictionLaw(NamedTuple):
    """The friction of a drive by its numbers, or of n drives by arrays (n,), as ``Motor`` describes it.

    Velocities and efforts are those of the drives. Where these are coupled, they are others than those of the joints.

    Terms that few arms have are None where there are none: they leave nothing in the code of an arm.

    Attributes:
        viscous: viscous friction by the velocity.
        forward: Coulomb friction while the joint moves in the direction of q, above 0.
        backward: that against it, below 0.
        offset: constant effort.
        stribeck: what is added to the magnitude of Coulomb friction at break-away.
        stribeck_speed: speed at which 1/e of that is left; not 0.
        cube_root: friction by the cube root of the velocity.
    """

    viscous: Scalar
    forward: Scalar
    backward: Scalar
    offset: Scalar | None
    stribeck: Scalar | None
    stribeck_speed: Scalar | None
    cube_root: Scalar | None

    def dry(self, velocity: Scalar, direction: Scalar) -> Scalar:
        """Return Coulomb and Stribeck friction.

        Args:
            velocity: of the joint.
            direction: in which the joint moves, or is about to; its sign counts, and there is none where it is 0.
        """
        return _dry(self.forward, self.backward, direction, self.fading(velocity))

    def fading(self, velocity: Scalar) -> Scalar | None:
        """Return the magnitude of Stribeck friction; None where there is none."""
        if self.stribeck is None:
            return None
        part = velocity / self.stribeck_speed
        return self.stribeck * exp(-(part * part))

    def smooth(self, velocity: Scalar) -> Scalar:
        """Return the offset and the friction by the cube root of the velocity, which have no jump; 0.0 of none."""
        friction: Scalar = 0.0
        if self.cube_root is not None:
            friction = self.cube_root * unit_cube_root_friction(velocity)
        return friction if self.offset is None else friction + self.offset

    def beyond_viscous(self, velocity: Scalar, direction: Scalar) -> Scalar:
        """Return all friction but the viscous one: see ``dry`` and ``smooth``."""
        friction = self.dry(velocity, direction)
        if self.offset is None and self.cube_root is None:
            return friction
        return friction + self.smooth(velocity)


def unit_cube_root_friction(velocity: Scalar) -> Scalar:
    """Return the cube root of a velocity; below ``SLOW`` it is in proportion, so that its slope is finite at rest."""
    return select(abs(velocity) < SLOW, velocity * SLOW ** (-2 / 3), cbrt(velocity))


def drive_rates(arm: Arm, rates: Scalars) -> list[Scalar]:
    """Return the velocities or accelerations of the drives, from those of the joints."""
    if arm.coupling is None:
        return list(rates)
    return [_combined(row, rates) for row in arm.coupling.inverse.tolist()]


def drives_at_joints(arm: Arm, efforts: Scalars) -> list[Scalar]:
    """Return efforts at the drives as the joints see them."""
    if arm.coupling is None:
        return list(efforts)
    return [_combined(row, efforts) for row in arm.coupling.inverse.T.tolist()]


def _combined(weights: Sequence[float], values: Scalars) -> Scalar:
    """Return the sum of weighted values, of which at least one weight is not 0."""
    first, *others = (
        value if weight == 1 else weight * value for weight, value in zip(weights, values, strict=True) if weight
    )
    return sum(others, start=first)


def with_drives(arm: Arm, efforts: Scalars, qd: Scalars, qdd: Scalars) -> list[Scalar]:
    """Return efforts and what the drives themselves require beside them: rotor inertia and friction."""
    if arm.coupling is None:
        return scan(_with_drive, (), _drives(arm), efforts, qd, qdd)[1]
    return add(efforts, _own_at_joints(arm, qd, qdd))


def less_friction(arm: Arm, qd: Scalars, tau: Scalars) -> list[Scalar]:
    """Return the efforts less the friction of the moving drives."""
    if arm.coupling is None:
        return scan(_less_friction, (), _drives(arm), qd, tau)[1]
    return subtract(tau, _own_at_joints(arm, qd, [0.0] * arm.n))


def _own_at_joints(arm: Arm, qd: Scalars, qdd: Scalars) -> list[Scalar]:
    """Return what coupled drives require by themselves, as the joints see it."""
    states = zip(_drives(arm), drive_rates(arm, qd), drive_rates(arm, qdd), strict=True)
    return drives_at_joints(arm, [_own_effort(*state) for state in states])


def with_rotors(arm: Arm, M: Matrix) -> Matrix:
    """Return a mass matrix of links with the inertia of the rotors."""
    if arm.coupling is None:
        return [
            [x + motor.inertia if i == j else x for j, x in enumerate(row)]
            for i, (row, motor) in enumerate(zip(M, arm.motors, strict=True))
        ]
    T = arm.coupling.inverse
    rotors = (T.T @ (arm.motor_values("inertia")[:, None] * T)).tolist()
    return [[x + rotor if rotor else x for x, rotor in zip(*rows, strict=True)] for rows in zip(M, rotors, strict=True)]


def joint_friction_law(motor: Motor) -> FrictionLaw:
    """Return the friction of one joint."""
    return FrictionLaw(
        motor.viscous,
        motor.coulomb_forward,
        -motor.coulomb_backward,
        motor.offset or None,
        motor.stribeck or None,
        motor.stribeck_speed if motor.stribeck else None,
        motor.cube_root or None,
    )


def friction_law(arm: Arm) -> FrictionLaw:
    """Return the friction of all joints of an arm, in arrays (n,)."""

    def where_any(name: str) -> Array | None:
        values = arm.motor_values(name)
        return values if values.any() else None

    stribeck = where_any("stribeck")
    speeds = np.where(arm.motor_values("stribeck") > 0, arm.motor_values("stribeck_speed"), 1.0)
    return FrictionLaw(
        arm.motor_values("viscous"),
        arm.motor_values("coulomb_forward"),
        -arm.motor_values("coulomb_backward"),
        where_any("offset"),
        stribeck,
        None if stribeck is None else speeds,
        where_any("cube_root"),
    )


def coulomb_friction(arm: Arm, qd: Array) -> Array:
    """Return the Coulomb friction of moving drives as the joints see it, 0 of a drive at rest.

    Args:
        arm: the arm, with n joints.
        qd: (..., n) joint velocities.

    Returns:
        (..., n) the efforts that overcome it [N m] or [N], positive in the direction of q.
    """
    speeds = drive_speeds(arm, qd)
    return efforts_at_joints(arm, np.asarray(friction_law(arm)._replace(stribeck=None).dry(speeds, speeds)))


def drive_speeds(arm: Arm, qd: Array) -> Array:
    """Return the speeds (..., n) of the drives, from those of the joints."""
    return qd if arm.coupling is None else arm.coupling.drives(qd)


def efforts_at_joints(arm: Arm, efforts: Array) -> Array:
    """Return efforts (..., n) at the drives as the joints see them."""
    return efforts if arm.coupling is None else arm.coupling.joint_efforts(efforts)


class _Drive(NamedTuple):
    """The inertia of a rotor and the friction of its drive."""

    inertia: float
    friction: FrictionLaw


def _drives(arm: Arm) -> list[_Drive]:
    return [_Drive(motor.inertia, joint_friction_law(motor)) for motor in arm.motors]


def _own_effort(drive: _Drive, velocity: Scalar, acceleration: Scalar) -> Scalar:
    inertial, viscous = drive.inertia * acceleration, drive.friction.viscous * velocity
    return inertial + viscous + drive.friction.beyond_viscous(velocity, velocity)


def _with_drive(
    _: tuple[()], drive: _Drive, effort: Scalar, velocity: Scalar, acceleration: Scalar
) -> tuple[tuple[()], Scalar]:
    return (), effort + _own_effort(drive, velocity, acceleration)


def _less_friction(_: tuple[()], drive: _Drive, velocity: Scalar, effort: Scalar) -> tuple[tuple[()], Scalar]:
    friction = drive.friction
    return (), effort - friction.viscous * velocity - friction.beyond_viscous(velocity, velocity)


def _dry(forward: Scalar, backward: Scalar, direction: Scalar, fading: Scalar | None) -> Scalar:
    if fading is not None:
        forward, backward = forward + fading, backward - fading
    return select(direction > 0, forward, select(direction < 0, backward, 0.0))
