"""Shares of the efforts: those by gravity alone, and those by the velocities alone."""

from __future__ import annotations

from collections.abc import Sequence

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import batch
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.springs import with_springs
from armwright.kinematics.forward_kinematics import stack
from armwright.tracing.scalar import Scalar


def gravity_shares(arm: Arm, q: Sequence[Scalar]) -> list[Scalar]:
    """Return the efforts that hold an arm at rest against gravity and its springs, over abstract scalars."""
    still = [0.0] * arm.n
    return with_springs(arm, newton_euler(arm, q, still, still), q)


def speed_shares(arm: Arm, q: Sequence[Scalar], qd: Sequence[Scalar]) -> list[Scalar]:
    """Return the centrifugal and Coriolis efforts, over abstract scalars: those of an arm that falls freely."""
    return newton_euler(arm, q, qd, [0.0] * arm.n, base_acceleration=arm.gravity.tolist())


def gravity_efforts(arm: Arm, q: ArrayLike) -> Array:
    """Return the efforts that hold the arm against gravity and the springs at its joints.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].

    Returns:
        G: (..., n) torques [N m] or forces [N], positive in the direction of q.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (16), by (17)-(25) at rest.
    """
    lead, (q_,), _ = batch(arm, q=q)
    return stack(gravity_shares(arm, q_), lead)


def coriolis_efforts(arm: Arm, q: ArrayLike, qd: ArrayLike) -> Array:
    """Return the centrifugal and Coriolis efforts, which grow with the square of the velocities.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.

    Returns:
        H: (..., n) torques [N m] or forces [N], positive in the direction of q.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (15), by (17)-(25) without acceleration and gravity.
    """
    lead, (q_, qd_), _ = batch(arm, q=q, qd=qd)
    return stack(speed_shares(arm, q_, qd_), lead)
