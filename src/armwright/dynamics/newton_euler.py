"""Newton-Euler inverse dynamics: the joint efforts that a motion requires."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm, Joint, Motor
from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape
from armwright.dynamics.arguments import NO_WRENCH, Scalars, batch, stack_matrix
from armwright.kinematics.forward_kinematics import link_frames, link_transform, stack
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.tracing.scalar import Scalar, select
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, scale, subtract, transpose

_STILL = (0.0, 0.0, 0.0)


def newton_euler(
    arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars, wrench: Scalars = NO_WRENCH, *, base_acceleration: Scalars = _STILL
) -> list[Scalar]:
    """Return the efforts that the links alone require, over abstract scalars.

    Arguments and sources are those of ``joint_wrenches``. The efforts are the components along or about each joint.
    """
    wrenches = joint_wrenches(arm, q, qd, qdd, wrench, base_acceleration=base_acceleration)
    joints = zip(arm.joints, wrenches, strict=True)
    return [dot(link.moment if joint.revolute else link.force, link.axis) for joint, link in joints]


class JointWrench(NamedTuple):
    """The wrench of link i-1 on link i, over abstract scalars, along the axes of frame i.

    Attributes:
        force: f_i [N].
        moment: n_i, about the origin of frame i-1, on the axis of joint i [N m].
        axis: of joint i, z of frame i-1.
    """

    force: Vector
    moment: Vector
    axis: Vector


def joint_wrenches(
    arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars, wrench: Scalars = NO_WRENCH, *, base_acceleration: Scalars = _STILL
) -> list[JointWrench]:
    """Return the wrench of each link on the next, over abstract scalars.

    Outward, from the base: speeds and accelerations of the links, each in its own frame. Gravity enters as an
    opposite acceleration of the base. Inward, from the tool: forces and moments.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint speeds.
        qdd: n joint accelerations.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.
        base_acceleration: of the base, along its own axes; the base does not rotate. On a base that falls freely, with
            the acceleration ``arm.gravity``, an arm has no weight.

    Source:
        Luh, Walker & Paul (1980); TR-83-008 eq. (17)-(25). The report prints the base acceleration with
        gravity pointing up; here gravity is a vector of the arm.
    """
    v_dot = base_frame_acceleration(arm, base_acceleration)
    w: Vector = [0.0, 0.0, 0.0]
    w_dot: Vector = [0.0, 0.0, 0.0]
    links: list[tuple[Matrix, Vector, Vector, Vector]] = []
    for joint, link, position, speed, acceleration in zip(arm.joints, arm.links, q, qd, qdd, strict=True):
        R, _ = link_transform(joint, position)
        Rt = transpose(R)
        lever = lever_of(joint, position)
        w, w_dot, v_dot = _next_link(joint, Rt, lever, (w, w_dot, v_dot), (speed, acceleration))
        com, inertia = link.com.tolist(), link.inertia.tolist()
        com_acceleration = add(v_dot, cross(w_dot, com), cross(w, cross(w, com)))
        force = scale(link.mass, com_acceleration)
        spin = add(apply(inertia, w_dot), cross(w, apply(inertia, w)))
        links.append((R, lever, force, add(spin, cross(add(lever, com), force))))
    f, n = tool_reaction(arm, q, wrench)
    wrenches: list[JointWrench] = []
    for R, lever, force, moment in reversed(links):
        # f and n act from link i on the next, at the origin of frame i, in frame i.
        n = add(n, cross(lever, f), moment)
        f = add(f, force)
        wrenches.append(JointWrench(f, n, R[2]))
        f, n = apply(R, f), apply(R, n)
    return wrenches[::-1]


def base_frame_acceleration(arm: Arm, base_acceleration: Scalars = _STILL) -> Vector:
    """Return the acceleration of frame 0 in its own axes, with gravity as an opposite acceleration."""
    return apply(arm.base[:3, :3].T.tolist(), subtract(base_acceleration, arm.gravity.tolist()))


def lever_of(joint: Joint, q: Scalar) -> Vector:
    """Return the vector from the origin of frame i-1 to that of frame i, in frame i.

    It is Rᵀp of the link transform, in which the angle about z cancels.
    """
    d = joint.d if joint.revolute else joint.d + q
    if joint.fixed is not None:
        X = joint.behind
        return apply(X[:3, :3].T.tolist(), add(X[:3, 3].tolist(), [0.0, 0.0, d]))
    return [joint.a, exact_sine(joint.alpha) * d, exact_cosine(joint.alpha) * d]


def _next_link(
    joint: Joint, Rt: Matrix, lever: Vector, motion: tuple[Vector, Vector, Vector], rates: tuple[Scalar, Scalar]
) -> tuple[Vector, Vector, Vector]:
    """Carry angular speed, angular acceleration and acceleration of the origin from frame i-1 to frame i."""
    w, w_dot, v_dot = motion
    speed, acceleration = rates
    if joint.revolute:
        z_speed = [0.0, 0.0, speed]
        w_dot = apply(Rt, add(w_dot, [0.0, 0.0, acceleration], cross(w, z_speed)))
        w = apply(Rt, add(w, z_speed))
        v_dot = apply(Rt, v_dot)
    else:
        w, w_dot = apply(Rt, w), apply(Rt, w_dot)
        slide = apply(Rt, [0.0, 0.0, speed])
        v_dot = add(apply(Rt, add(v_dot, [0.0, 0.0, acceleration])), scale(2.0, cross(w, slide)))
    v_dot = add(v_dot, cross(w_dot, lever), cross(w, cross(w, lever)))
    return w, w_dot, v_dot


def tool_reaction(arm: Arm, q: Scalars, wrench: Scalars) -> tuple[Vector, Vector]:
    """Return force and moment of the last link on the surroundings, at its origin, in its frame.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.
    """
    if wrench is NO_WRENCH:
        return [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    R, _ = link_frames(arm, q)[-1]
    Rt = transpose(R)
    force, moment = apply(Rt, wrench[:3]), apply(Rt, wrench[3:])
    f = subtract([0.0, 0.0, 0.0], force)
    n = subtract(cross(arm.tool[:3, 3].tolist(), f), moment)
    return f, n


def drive_effort(motor: Motor, qd: Scalar, qdd: Scalar) -> Scalar:
    """Return the effort of the drive itself: rotor inertia, viscous and dry friction, over abstract scalars."""
    return motor.inertia * qdd + motor.viscous * qd + dry_friction(motor, qd)


def dry_friction(motor: Motor, qd: Scalar) -> Scalar:
    """Return the Coulomb friction of a moving joint, 0 at rest, over abstract scalars."""
    return select(qd > 0, motor.coulomb_forward, select(qd < 0, -motor.coulomb_backward, 0.0))


def coulomb_friction(arm: Arm, qd: Array) -> Array:
    """Return the Coulomb friction of joints (..., n) that move as ``qd`` does, 0 at rest."""
    forward, backward = arm.motor_values("coulomb_forward"), arm.motor_values("coulomb_backward")
    return np.where(qd > 0, forward, np.where(qd < 0, -backward, 0.0))


def inverse_dynamics(
    arm: Arm,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    *,
    wrench: ArrayLike | None = None,
    base_acceleration: ArrayLike = _STILL,
    drives: bool = True,
) -> Array:
    """Return the joint efforts of a motion.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint speeds.
        qdd: (..., n) joint accelerations.
        wrench: (..., 6) force [N] and moment [N m] acting on the tool from outside, at the tool point, along
            base axes; none when left out.
        base_acceleration: (3,) acceleration of the base along its own axes [m/s²], as on a vehicle.
        drives: whether rotor inertia and friction of the drives count.

    Returns:
        tau: (..., n) torques [N m] or forces [N], positive in the direction of q.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.

    Source:
        Luh, Walker & Paul (1980); TR-83-008 eq. (17)-(25).
    """
    lead, (q_, qd_, qdd_), push = batch(arm, wrench=wrench, q=q, qd=qd, qdd=qdd)
    moved = exact_shape(base_acceleration, (3,), "base_acceleration", LARGEST).tolist()
    efforts = newton_euler(arm, q_, qd_, qdd_, push, base_acceleration=moved)
    if drives:
        efforts = [
            effort + drive_effort(motor, speed, acceleration)
            for effort, motor, speed, acceleration in zip(efforts, arm.motors, qd_, qdd_, strict=True)
        ]
    return stack(efforts, lead)


class LinkForces(NamedTuple):
    """The wrenches of each link on the next.

    Attributes:
        force: (..., n, 3) f_i, of link i-1 on link i, along the axes of frame i [N].
        moment: (..., n, 3) n_i, of link i-1 on link i about the origin of frame i-1, along the axes of frame i [N m].
    """

    force: Array
    moment: Array


def link_forces(
    arm: Arm,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    *,
    wrench: ArrayLike | None = None,
    base_acceleration: ArrayLike = _STILL,
) -> LinkForces:
    """Return the forces and moments between the links of an arm in motion, which its bearings carry.

    Their component along or about the axis of a prismatic or revolute joint is the effort of ``inverse_dynamics``
    without the drives.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.
        wrench: (..., 6) force [N] and moment [N m] acting on the tool from outside, at the tool point, along base
            axes; none when left out.
        base_acceleration: (3,) acceleration of the base along its own axes [m/s²], as on a vehicle.

    Returns:
        Forces and moments, (..., n, 3) each.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Luh, Walker & Paul (1980); TR-83-008 eq. (22)-(24).
    """
    lead, (q_, qd_, qdd_), push = batch(arm, wrench=wrench, q=q, qd=qd, qdd=qdd)
    moved = exact_shape(base_acceleration, (3,), "base_acceleration", LARGEST).tolist()
    wrenches = joint_wrenches(arm, q_, qd_, qdd_, push, base_acceleration=moved)
    return LinkForces(*(stack_matrix(parts, lead) for parts in list(zip(*wrenches, strict=True))[:2]))
