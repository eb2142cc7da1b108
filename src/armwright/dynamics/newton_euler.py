"""Newton-Euler inverse dynamics: the joint efforts that a motion requires."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from armwright.arm.model import Arm
from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape
from armwright.dynamics.arguments import NO_WRENCH, Scalars, batch, stack_matrix
from armwright.dynamics.drives import with_drives
from armwright.dynamics.joint_frames import JointBody, JointStep, joint_body, joint_steps, lever_behind
from armwright.dynamics.springs import with_springs
from armwright.kinematics.forward_kinematics import stack
from armwright.tracing.scalar import Scalar
from armwright.tracing.scan import scan
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, scale, subtract, transpose

_STILL = (0.0, 0.0, 0.0)


def newton_euler(
    arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars, wrench: Scalars = NO_WRENCH, *, base_acceleration: Scalars = _STILL
) -> list[Scalar]:
    """Return the efforts that the links alone require, over abstract scalars, without drives and springs.

    Arguments and sources are those of ``joint_wrenches``. The effort at a joint is the component of the moment about
    its axis if it is revolute, of the force along its axis if it is prismatic.
    """
    joints = _wrenches(arm, q, qd, qdd, wrench, base_acceleration=base_acceleration)
    return [effort for _, _, effort in joints]


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

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint velocities.
        qdd: n joint accelerations.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.
        base_acceleration: of the base, along its own axes; the base does not rotate. On a base that falls freely, with
            the acceleration ``arm.gravity``, an arm has no weight.

    Returns:
        n wrenches.

    Source:
        Luh, Walker & Paul (1980); TR-83-008 eq. (17)-(25). The report prints the base acceleration with
        gravity pointing up; here gravity is a vector of the arm.
    """
    wrenches = []
    about_joint_points = _wrenches(arm, q, qd, qdd, wrench, base_acceleration=base_acceleration)
    for joint, position, (f, n, _) in zip(arm.joints, q, about_joint_points, strict=True):
        # The joint point of a prismatic joint has moved away from the origin of frame i-1.
        moment = n if joint.revolute else add(n, cross([0.0, 0.0, joint.d + position], f))
        to_frame = transpose(joint.behind[:3, :3].tolist())
        wrenches.append(JointWrench(apply(to_frame, f), apply(to_frame, moment), [row[2] for row in to_frame]))
    return wrenches


def _wrenches(
    arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars, wrench: Scalars, *, base_acceleration: Scalars
) -> list[tuple[Vector, Vector, Scalar]]:
    """Return the force and the moment of link i-1 on link i and the effort, for each joint i.

    The moment is about the joint point, and both are along the axes of the joint: see ``joint_frames``.

    Outward, from the base: angular velocity, angular acceleration and acceleration of each joint point, in the axes
    that rotate with the joint, of which z is its own. Gravity enters as an opposite acceleration of the base. Inward,
    from the tool: forces and moments.

    Arguments are those of ``joint_wrenches``.

    Source:
        Luh, Walker & Paul (1980), about joint points instead of centres of mass, in the axes behind the rotation of a
        joint and before its twist, in which a link is constant: Khalil & Kleinfinger (1987).
    """
    steps = joint_steps(arm, q)
    bodies = [joint_body(joint, link) for joint, link in zip(arm.joints, arm.links, strict=True)]
    _, links = scan(_outward, _base_motion(arm, base_acceleration), steps, bodies, qd, qdd)
    return scan(_inward, tool_wrench(arm, steps, wrench), steps, links, reverse=True)[1]


def _outward(
    motion: JointMotion, step: JointStep, body: JointBody, velocity: Scalar, acceleration: Scalar
) -> tuple[JointMotion, tuple[Vector, Vector]]:
    """Return the motion of a link, from that of the link before, and the force and moment that accelerate it."""
    motion = _next_motion(motion, step, velocity, acceleration)
    return motion, _link_wrench(body, motion.U, motion.v_dot)


def _inward(
    beyond: tuple[Vector, Vector], step: JointStep, link: tuple[Vector, Vector]
) -> tuple[tuple[Vector, Vector], tuple[Vector, Vector, Scalar]]:
    """Return force and moment at the joint before a link, and at its own with its effort, from those beyond."""
    f, n = (add(x, own) for x, own in zip(beyond, link, strict=True))
    force, moment = step.outward_axes(f), step.outward_axes(n)
    return (force, add(moment, cross(step.lever, force))), (f, n, (n if step.revolute else f)[2])


class JointMotion(NamedTuple):
    """The motion of a link, along the axes of its joint, over abstract scalars.

    Attributes:
        w: angular velocity.
        w_dot: angular acceleration.
        v_dot: acceleration of the joint point; gravity enters as an opposite acceleration.
        U: a point of the link at r from the joint point has the acceleration U r relative to that.
    """

    w: Vector
    w_dot: Vector
    v_dot: Vector
    U: Matrix


def joint_motions(arm: Arm, steps: Sequence[JointStep], qd: Scalars, qdd: Scalars) -> list[JointMotion]:
    """Return the motion of each link, from the base outward.

    Args:
        arm: the arm, with n joints.
        steps: the steps from joint to joint.
        qd: n joint velocities.
        qdd: n joint accelerations.
    """

    def step_outward(motion: JointMotion, *of_joint: Any) -> tuple[JointMotion, JointMotion]:
        motion = _next_motion(motion, *of_joint)
        return motion, motion

    return scan(step_outward, _base_motion(arm, _STILL), steps, qd, qdd)[1]


def _base_motion(arm: Arm, base_acceleration: Scalars) -> JointMotion:
    still = [0.0, 0.0, 0.0]
    return JointMotion(still, still, base_frame_acceleration(arm, base_acceleration), [list(still) for _ in range(3)])


def _next_motion(motion: JointMotion, step: JointStep, velocity: Scalar, acceleration: Scalar) -> JointMotion:
    """Return the motion of a link, from that of the link before."""
    v_dot = step.inward_axes(add(motion.v_dot, apply(motion.U, step.lever)))
    w, w_dot = step.inward_axes(motion.w), step.inward_axes(motion.w_dot)
    if step.revolute:
        w_dot = add(w_dot, [w[1] * velocity, -(w[0] * velocity), acceleration])
        w = [w[0], w[1], w[2] + velocity]
    else:
        # The Coriolis acceleration of a prismatic joint.
        twice = velocity + velocity
        v_dot = add(v_dot, [w[1] * twice, -(w[0] * twice), acceleration])
    return JointMotion(w, w_dot, v_dot, point_accelerations(w, w_dot))


def point_accelerations(w: Vector, w_dot: Vector) -> Matrix:
    """Return U: a point of a body at r from its origin has the acceleration U r relative to that."""
    xx, yy, zz = (x * x for x in w)
    xy, xz, yz = w[0] * w[1], w[0] * w[2], w[1] * w[2]
    return [
        [-(yy + zz), xy - w_dot[2], xz + w_dot[1]],
        [xy + w_dot[2], -(xx + zz), yz - w_dot[0]],
        [xz - w_dot[1], yz + w_dot[0], -(xx + yy)],
    ]


def _link_wrench(body: JointBody, U: Matrix, v_dot: Vector) -> tuple[Vector, Vector]:
    """Return force and moment that accelerate a link, about its joint point."""
    force = add(scale(body.mass, v_dot), apply(U, body.moment))
    moment = []
    for b, c in ((1, 2), (2, 0), (0, 1)):
        # The integral of r x (U r) over the mass is the antisymmetric part of U times the integral of r rᵀ.
        relative = dot(U[c], body.spread[b]) - dot(U[b], body.spread[c])
        moment.append(relative + body.moment[b] * v_dot[c] - body.moment[c] * v_dot[b])
    return force, moment


def base_frame_acceleration(arm: Arm, base_acceleration: Scalars = _STILL) -> Vector:
    """Return the acceleration of frame 0 in its own axes, with gravity as an opposite acceleration."""
    return apply(arm.base[:3, :3].T.tolist(), subtract(base_acceleration, arm.gravity.tolist()))


def tool_wrench(arm: Arm, steps: Sequence[JointStep], wrench: Scalars) -> tuple[Vector, Vector]:
    """Return force and moment of the last link on the surroundings, about the point and along the axes of its joint.

    Args:
        arm: the arm, with n joints.
        steps: from joint to joint.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.
    """
    if wrench is NO_WRENCH:
        return [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    to_base = transpose(arm.base[:3, :3].tolist())
    outside = apply(to_base, wrench[:3]), apply(to_base, wrench[3:])
    (force, moment), _ = scan(_along_next_axes, outside, steps)
    joint = arm.joints[-1]
    lever = add(lever_behind(joint), (joint.behind[:3, :3] @ arm.tool[:3, 3]).tolist())
    f = subtract([0.0, 0.0, 0.0], force)
    return f, subtract(cross(lever, f), moment)


def _along_next_axes(vectors: tuple[Vector, Vector], step: JointStep) -> tuple[tuple[Vector, Vector], tuple[()]]:
    a, b = vectors
    return (step.inward_axes(a), step.inward_axes(b)), ()


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
    """Return the joint efforts of a motion, those of springs at the joints included.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.
        wrench: (..., 6) force [N] and moment [N m] acting on the tool from outside, at the tool point, along
            base axes; none when left out.
        base_acceleration: (3,) acceleration of the base along its own axes [m/s²], as on a vehicle.
        drives: whether rotor inertia and friction of the drives count.

    Returns:
        tau: (..., n) torques [N m] or forces [N] at the joints, positive in the direction of q. Coupled drives give
        ``arm.coupling.drive_efforts(tau)``.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Luh, Walker & Paul (1980); TR-83-008 eq. (17)-(25).
    """
    lead, (q_, qd_, qdd_), on_tool = batch(arm, wrench=wrench, q=q, qd=qd, qdd=qdd)
    of_base = exact_shape(base_acceleration, (3,), "base_acceleration", LARGEST).tolist()
    efforts = with_springs(arm, newton_euler(arm, q_, qd_, qdd_, on_tool, base_acceleration=of_base), q_)
    if drives:
        efforts = with_drives(arm, efforts, qd_, qdd_)
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
    lead, (q_, qd_, qdd_), on_tool = batch(arm, wrench=wrench, q=q, qd=qd, qdd=qdd)
    of_base = exact_shape(base_acceleration, (3,), "base_acceleration", LARGEST).tolist()
    wrenches = joint_wrenches(arm, q_, qd_, qdd_, on_tool, base_acceleration=of_base)
    return LinkForces(*(stack_matrix(parts, lead) for parts in list(zip(*wrenches, strict=True))[:2]))
