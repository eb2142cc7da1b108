"""Energy of a moving arm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import batch
from armwright.dynamics.drives import drive_rates
from armwright.dynamics.springs import spring_energy
from armwright.kinematics.forward_kinematics import link_frames, link_transform
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Vector, add, apply, cross, dot, transpose


def link_kinetic_energy(arm: Arm, q: Sequence[Scalar], qd: Sequence[Scalar]) -> Scalar:
    """Return the kinetic energy of the links alone, link by link, over abstract scalars.

    Source:
        König's theorem: that of the mass at its centre, and that of the rotation about it.
    """
    w: Vector = [0.0, 0.0, 0.0]
    v: Vector = [0.0, 0.0, 0.0]
    energy: Scalar = 0.0
    for joint, link, position, speed in zip(arm.joints, arm.links, q, qd, strict=True):
        Rt = transpose(link_transform(joint, position)[0])
        rate = [0.0, 0.0, speed]
        if joint.revolute:
            w, v = apply(Rt, add(w, rate)), apply(Rt, v)
        else:
            w, v = apply(Rt, w), apply(Rt, add(v, rate))
        v = add(v, cross(w, _lever(joint, position)))
        v_com = add(v, cross(w, link.com.tolist()))
        energy = energy + 0.5 * (link.mass * dot(v_com, v_com) + dot(w, apply(link.inertia.tolist(), w)))
    return energy


def _lever(joint: Joint, q: Scalar) -> Vector:
    """Return the vector from the origin of frame i-1 to that of frame i, in frame i.

    It is Rᵀp of the link transform, in which the angle about z cancels.
    """
    d = joint.d if joint.revolute else joint.d + q
    if joint.fixed is not None:
        X = joint.behind
        return apply(X[:3, :3].T.tolist(), add(X[:3, 3].tolist(), [0.0, 0.0, d]))
    return [joint.a, exact_sine(joint.alpha) * d, exact_cosine(joint.alpha) * d]


def rotor_energy(arm: Arm, qd: Sequence[Scalar]) -> Scalar:
    """Return the kinetic energy of the rotors, over abstract scalars."""
    rotors = zip(arm.motors, drive_rates(arm, qd), strict=True)
    return sum((0.5 * motor.inertia * speed * speed for motor, speed in rotors), start=0.0)


def link_potential_energy(arm: Arm, q: Sequence[Scalar]) -> Scalar:
    """Return the potential energy of the links, over abstract scalars; that of a mass at the base origin is 0.

    Source:
        TR-83-008 eq. (10).
    """
    energy: Scalar = 0.0
    for (R, p), link in zip(link_frames(arm, q)[1:], arm.links, strict=True):
        energy = energy - link.mass * dot(arm.gravity.tolist(), add(p, apply(R, link.com.tolist())))
    return energy


def kinetic_energy(arm: Arm, q: ArrayLike, qd: ArrayLike, *, drives: bool = True) -> Array:
    """Return the kinetic energy.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        drives: whether the rotors count.

    Returns:
        (...) energy [J].

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (8).
    """
    lead, (q_, qd_), _ = batch(arm, q=q, qd=qd)
    energy = link_kinetic_energy(arm, q_, qd_)
    if drives:
        energy = energy + rotor_energy(arm, qd_)
    return np.array(np.broadcast_to(energy, lead), dtype=np.float64)


def potential_energy(arm: Arm, q: ArrayLike) -> Array:
    """Return the potential energy in the field of gravity and in springs; that of a mass at the base origin is 0.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].

    Returns:
        (...) energy [J].

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (10).
    """
    lead, (q_,), _ = batch(arm, q=q)
    energy = link_potential_energy(arm, q_) + spring_energy(arm, q_)
    return np.array(np.broadcast_to(energy, lead), dtype=np.float64)
