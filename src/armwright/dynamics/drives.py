"""The drives of the joints: rotor inertia, viscous and Coulomb friction, over abstract scalars."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.arguments import Scalars
from armwright.tracing.scalar import Scalar, select
from armwright.tracing.scan import scan


class _Drive(NamedTuple):
    """The numbers of a motor.

    Attributes:
        inertia: of the rotor.
        viscous: viscous friction by the velocity.
        forward: Coulomb friction while the joint moves in the direction of q, above 0.
        backward: that against it, below 0.
    """

    inertia: float
    viscous: float
    forward: float
    backward: float


def with_drives(arm: Arm, efforts: Scalars, qd: Scalars, qdd: Scalars) -> list[Scalar]:
    """Return efforts and what the drives themselves require beside them: rotor inertia and friction."""
    return scan(_with_drive, (), _drives(arm), efforts, qd, qdd)[1]


def less_friction(arm: Arm, qd: Scalars, tau: Scalars) -> list[Scalar]:
    """Return the efforts less the friction of the moving drives."""
    return scan(_less_friction, (), _drives(arm), qd, tau)[1]


def joint_coulomb_friction(motor: Motor, velocity: Scalar) -> Scalar:
    """Return the Coulomb friction of a moving joint, 0 at rest."""
    return _coulomb(motor.coulomb_forward, -motor.coulomb_backward, velocity)


def coulomb_friction(arm: Arm, qd: Array) -> Array:
    """Return the Coulomb friction of moving joints, 0 of a joint at rest.

    Args:
        arm: the arm, with n joints.
        qd: (..., n) joint velocities.

    Returns:
        (..., n) the efforts that overcome it [N m] or [N], positive in the direction of q.
    """
    return np.asarray(_coulomb(arm.motor_values("coulomb_forward"), -arm.motor_values("coulomb_backward"), qd))


def _drive(motor: Motor) -> _Drive:
    return _Drive(motor.inertia, motor.viscous, motor.coulomb_forward, -motor.coulomb_backward)


def _drives(arm: Arm) -> list[_Drive]:
    return [_drive(motor) for motor in arm.motors]


def _with_drive(
    _: tuple[()], drive: _Drive, effort: Scalar, velocity: Scalar, acceleration: Scalar
) -> tuple[tuple[()], Scalar]:
    inertial, viscous = drive.inertia * acceleration, drive.viscous * velocity
    return (), effort + (inertial + viscous + _coulomb(drive.forward, drive.backward, velocity))


def _less_friction(_: tuple[()], drive: _Drive, velocity: Scalar, effort: Scalar) -> tuple[tuple[()], Scalar]:
    return (), effort - drive.viscous * velocity - _coulomb(drive.forward, drive.backward, velocity)


def _coulomb(forward: Scalar, backward: Scalar, velocity: Scalar) -> Scalar:
    return select(velocity > 0, forward, select(velocity < 0, backward, 0.0))
