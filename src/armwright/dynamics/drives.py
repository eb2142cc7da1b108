"""The drives of the joints: rotor inertia, viscous and dry friction, over abstract scalars."""

from __future__ import annotations

from typing import NamedTuple

from armwright.arm.model import Arm, Motor
from armwright.dynamics.arguments import Scalars
from armwright.tracing.scalar import Scalar, select
from armwright.tracing.scan import scan


class _Drive(NamedTuple):
    """The numbers of a motor; dry friction in either direction has its sign."""

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


def dry_friction(motor: Motor, qd: Scalar) -> Scalar:
    """Return the Coulomb friction of a moving joint, 0 at rest."""
    return _dry(_drive(motor), qd)


def _drive(motor: Motor) -> _Drive:
    return _Drive(motor.inertia, motor.viscous, motor.coulomb_forward, -motor.coulomb_backward)


def _drives(arm: Arm) -> list[_Drive]:
    return [_drive(motor) for motor in arm.motors]


def _with_drive(
    _: tuple[()], drive: _Drive, effort: Scalar, speed: Scalar, acceleration: Scalar
) -> tuple[tuple[()], Scalar]:
    own = drive.inertia * acceleration + drive.viscous * speed + _dry(drive, speed)
    return (), effort + own


def _less_friction(_: tuple[()], drive: _Drive, speed: Scalar, effort: Scalar) -> tuple[tuple[()], Scalar]:
    return (), effort - drive.viscous * speed - _dry(drive, speed)


def _dry(drive: _Drive, speed: Scalar) -> Scalar:
    return select(speed > 0, drive.forward, select(speed < 0, drive.backward, 0.0))
