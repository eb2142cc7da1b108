"""The articulated-body algorithm of forward dynamics: passes outward, inward and outward again.

Each link with all links beyond it, their joints free to move, reacts to a force at its own joint like a body whose
inertia depends on the direction. That inertia, and the force without acceleration, are passed inward from the last
link; accelerations are passed back outward. Accelerations here are those of material points, not spatial ones, so
linear velocities never appear.
"""

from __future__ import annotations

from typing import NamedTuple

from armwright.arm.drive import Motor
from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.arguments import NO_WRENCH, Scalars
from armwright.dynamics.joint_frames import JointStep, joint_body, joint_steps
from armwright.dynamics.newton_euler import base_frame_acceleration, tool_wrench
from armwright.tracing.scalar import Scalar, reciprocal
from armwright.tracing.scan import scan
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, mirrored, scale, transpose


class Articulated(NamedTuple):
    """A link with all links beyond it, expressed in a frame: the wrench at the origin that accelerates it.

    Moment n = J w_dot + H v_dot + n0 and force f = Hᵀ w_dot + M v_dot + f0; J and M are symmetric.
    """

    J: Matrix
    H: Matrix
    M: Matrix
    n0: Vector
    f0: Vector


class Pivot(NamedTuple):
    """The inertia about or along a joint while all joints beyond it are free.

    It is the diagonal element D of the factors M = Lᵀ D L of the mass matrix, and of the articulated-body inertia.

    Attributes:
        inertia: rotor included.
        size: the sum over all three axes, the reference for rounding.
    """

    inertia: Scalar
    size: Scalar


class LinkVelocity(NamedTuple):
    """The velocity of a link, and the accelerations that come of velocities alone.

    Attributes:
        w: angular velocity, along the axes of the joint.
        coriolis: what the velocity of the joint adds to the acceleration of the link: angular of a revolute joint,
            linear of a prismatic one.
        centripetal: acceleration of the joint point about that of the joint before, along the axes of that.
    """

    w: Vector
    coriolis: Vector
    centripetal: Vector


class JointResponse(NamedTuple):
    """The results of the inward pass for a joint, which the outward pass uses.

    Attributes:
        n: moment for a unit acceleration of the joint.
        f: force for it.
        pivot: their component along the joint, rotor included.
        mobility: the acceleration for a unit of effort.
        effort: the effort that remains for acceleration.
    """

    n: Vector
    f: Vector
    pivot: Pivot
    mobility: Scalar
    effort: Scalar


def articulated_body(
    arm: Arm, q: Scalars, qd: Scalars, tau: Scalars, wrench: Scalars = NO_WRENCH
) -> tuple[list[Scalar], list[Pivot]]:
    """Return the accelerations that efforts cause, over abstract scalars, in time proportional to n.

    Rotor inertia counts, of drives that are not coupled; friction does not: subtract it from ``tau`` before.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint velocities.
        tau: n efforts.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.

    Returns:
        n accelerations, and n pivots. Where a pivot is 0 the joint moves no inertia, and the
        accelerations are meaningless.

    Source:
        Featherstone (2008), section 7.3, with the accelerations of points as in Luh, Walker & Paul (1980).
    """
    steps = joint_steps(arm, q)
    links = [_rigid_link(*of_joint) for of_joint in zip(arm.joints, arm.links, arm.motors, strict=True)]
    _, velocities = scan(_velocity, [0.0, 0.0, 0.0], steps, qd)
    f, n = tool_wrench(arm, steps, wrench)
    beyond = Articulated(J=_zeros(), H=_zeros(), M=_zeros(), n0=n, f0=f)
    _, responses = scan(_inward, beyond, steps, links, velocities, tau, reverse=True)
    base = [0.0, 0.0, 0.0], base_frame_acceleration(arm)
    _, accelerations = scan(_outward, base, steps, velocities, responses)
    return accelerations, [response.pivot for response in responses]


class _RigidLink(NamedTuple):
    """A link about its joint point: inertia, mass times centre of mass, and mass; and the rotor of its joint."""

    inertia: Matrix
    moment: Vector
    mass: float
    rotor: float


def _rigid_link(joint: Joint, link: Link, motor: Motor) -> _RigidLink:
    mass, moment, spread = joint_body(joint, link)
    trace = spread[0][0] + spread[1][1] + spread[2][2]
    inertia = [[(trace if i == j else 0.0) - spread[i][j] for j in range(3)] for i in range(3)]
    return _RigidLink(inertia, moment, mass, motor.inertia)


def _zeros() -> Matrix:
    return [[0.0, 0.0, 0.0] for _ in range(3)]


def _velocity(before: Vector, step: JointStep, velocity: Scalar) -> tuple[Vector, LinkVelocity]:
    """Return the velocity of a link, from the angular velocity of the link before."""
    w = step.inward_axes(before)
    coriolis = scale(1.0 if step.revolute else 2.0, [w[1] * velocity, -(w[0] * velocity), 0.0])
    if step.revolute:
        w = [w[0], w[1], w[2] + velocity]
    return w, LinkVelocity(w, coriolis, cross(before, cross(before, step.lever)))


def _inward(
    beyond: Articulated, step: JointStep, link: _RigidLink, velocity: LinkVelocity, tau: Scalar
) -> tuple[Articulated, JointResponse]:
    """Return how a link and all beyond it react at the joint before, and the response at its own."""
    body = _combined(_link_inertia(link, velocity.w), beyond)
    response = _joint_response(body, step, link.rotor, tau)
    through = _through_joint(body, step, response, velocity.coriolis)
    return _at_previous_joint(through, step, velocity.centripetal), response


def _link_inertia(link: _RigidLink, w: Vector) -> Articulated:
    """Return a rigid link with the angular velocity w, about its joint point."""
    x, y, z = link.moment
    return Articulated(
        J=link.inertia,
        H=[[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]],
        M=[[link.mass if i == j else 0.0 for j in range(3)] for i in range(3)],
        n0=cross(w, apply(link.inertia, w)),
        f0=cross(w, cross(w, link.moment)),
    )


def _combined(a: Articulated, b: Articulated) -> Articulated:
    J, H, M = ([add(x, y) for x, y in zip(A, B, strict=True)] for A, B in ((a.J, b.J), (a.H, b.H), (a.M, b.M)))
    return Articulated(J=J, H=H, M=M, n0=add(a.n0, b.n0), f0=add(a.f0, b.f0))


def _at_previous_joint(body: Articulated, step: JointStep, centripetal: Vector) -> Articulated:
    """Return a body about a joint point about that of the joint before, along the axes of that."""
    p = step.lever
    J, H, M = (step.outward_matrix(matrix) for matrix in (body.J, body.H, body.M))
    f0 = add(step.outward_axes(body.f0), apply(M, centripetal))
    n0 = add(step.outward_axes(body.n0), apply(H, centripetal), cross(p, f0))
    # H and J about the point before: H + [p] M and J - H [p] + [p] (H + [p] M)ᵀ, row by row.
    shifted = [add(row, lever) for row, lever in zip(H, transpose([cross(p, row) for row in M]), strict=True)]
    left, right = [cross(p, row) for row in H], [cross(p, row) for row in shifted]
    return Articulated(
        J=mirrored([[J[i][j] + left[i][j] + right[j][i] for j in range(3)] for i in range(3)]),
        H=shifted,
        M=mirrored(M),
        n0=n0,
        f0=f0,
    )


def _joint_response(body: Articulated, step: JointStep, rotor: float, tau: Scalar) -> JointResponse:
    """Return the response of a body, about the joint point, to its joint, which is the z axis."""
    if step.revolute:
        n, f, inertia, bias = [row[2] for row in body.J], body.H[2], body.J, body.n0[2]
    else:
        n, f, inertia, bias = [row[2] for row in body.H], body.M[2], body.M, body.f0[2]
    pivot = Pivot(inertia=inertia[2][2] + rotor, size=inertia[0][0] + inertia[1][1] + inertia[2][2] + rotor)
    return JointResponse(n, f, pivot, reciprocal(pivot.inertia), tau - bias)


def _through_joint(body: Articulated, step: JointStep, response: JointResponse, coriolis: Vector) -> Articulated:
    """Return the apparent inertia of the body through its joint, which is free to move."""
    n, f = scale(response.mobility, response.n), scale(response.mobility, response.f)
    J = [[body.J[i][j] - n[min(i, j)] * response.n[max(i, j)] for j in range(3)] for i in range(3)]
    M = [[body.M[i][j] - f[min(i, j)] * response.f[max(i, j)] for j in range(3)] for i in range(3)]
    H = [[body.H[i][j] - n[i] * response.f[j] for j in range(3)] for i in range(3)]
    moment, force = (J, transpose(H)) if step.revolute else (H, M)
    return Articulated(
        J=J,
        H=H,
        M=M,
        n0=add(body.n0, apply(moment, coriolis), scale(response.effort, n)),
        f0=add(body.f0, apply(force, coriolis), scale(response.effort, f)),
    )


def _outward(
    before: tuple[Vector, Vector], step: JointStep, velocity: LinkVelocity, response: JointResponse
) -> tuple[tuple[Vector, Vector], Scalar]:
    """Return the accelerations of a link, from those of the link before, and the acceleration of its joint."""
    w_dot, v_dot = before
    v_dot = step.inward_axes(add(v_dot, cross(w_dot, step.lever), velocity.centripetal))
    w_dot = step.inward_axes(w_dot)
    if step.revolute:
        w_dot = add(w_dot, velocity.coriolis)
    else:
        v_dot = add(v_dot, velocity.coriolis)
    acceleration = response.mobility * (response.effort - dot(response.n, w_dot) - dot(response.f, v_dot))
    along = [0.0, 0.0, acceleration]
    if step.revolute:
        return (add(w_dot, along), v_dot), acceleration
    return (w_dot, add(v_dot, along)), acceleration
