"""The articulated-body algorithm of forward dynamics: passes outward, inward and outward again.

Each link with all links beyond it, their joints free to move, reacts to a force at its own joint like a body whose
inertia depends on the direction. That inertia, and the force without acceleration, are passed inward from the last
link; accelerations are passed back outward. Accelerations here are those of material points, not spatial ones, so
linear speeds never appear.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.arguments import NO_WRENCH, Scalars
from armwright.dynamics.joint_frames import JointStep, joint_body, joint_steps
from armwright.dynamics.newton_euler import base_frame_acceleration, tool_wrench
from armwright.tracing.scalar import Scalar, reciprocal
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, scale, transpose


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

    Attributes:
        inertia: rotor included.
        size: the sum over all three axes, the reference for rounding.
    """

    inertia: Scalar
    size: Scalar


class JointResponse(NamedTuple):
    """The results of the inward pass for a joint, which the outward pass uses.

    Attributes:
        n: moment for a unit acceleration of the joint.
        f: force for it.
        pivot: their component along the joint, rotor included.
        effort: the effort that remains for acceleration.
        coriolis: velocity-product acceleration of the link at the joint; angular, of a slide linear.
        centripetal: acceleration of the joint point about that of the joint before, along the axes of that.
    """

    n: Vector
    f: Vector
    pivot: Pivot
    effort: Scalar
    coriolis: Vector
    centripetal: Vector


def articulated_body(
    arm: Arm, q: Scalars, qd: Scalars, tau: Scalars, wrench: Scalars = NO_WRENCH
) -> tuple[list[Scalar], list[Pivot]]:
    """Return the accelerations that efforts cause, over abstract scalars, in time proportional to n.

    Rotor inertia counts; friction does not: subtract it from ``tau`` before.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint speeds.
        tau: n efforts.
        wrench: force and moment that act on the tool from outside, at the tool point, along base axes.

    Returns:
        n accelerations, and n pivots. Where a pivot is 0 the joint moves no inertia, and the
        accelerations are meaningless.

    Source:
        Featherstone (2008), section 7.3, with the accelerations of points as in Luh, Walker & Paul (1980).
    """
    steps = joint_steps(arm, q)
    velocities = _angular_velocities(arm, steps, qd)
    f, n = tool_wrench(arm, q, wrench)
    body = Articulated(J=_zeros(), H=_zeros(), M=_zeros(), n0=n, f0=f)
    responses: list[JointResponse] = []
    for i in reversed(range(arm.n)):
        joint, step, (before, w) = arm.joints[i], steps[i], velocities[i]
        body = _combined(_link_inertia(joint, arm.links[i], w), body)
        coriolis = scale(1.0 if joint.revolute else 2.0, [w[1] * qd[i], -(w[0] * qd[i]), 0.0])
        centripetal = cross(before, cross(before, step.lever))
        response = _joint_response(body, joint, arm.motors[i].inertia, tau[i], (coriolis, centripetal))
        body = _at_previous_joint(_through_joint(body, joint, response), step, centripetal)
        responses.append(response)
    responses.reverse()
    return _outward(arm, steps, responses), [response.pivot for response in responses]


def _zeros() -> Matrix:
    return [[0.0, 0.0, 0.0] for _ in range(3)]


def _angular_velocities(arm: Arm, steps: Sequence[JointStep], qd: Scalars) -> list[tuple[Vector, Vector]]:
    """Return for each joint the angular velocity of the link before it, and of its own, along the axes of each."""
    w: Vector = [0.0, 0.0, 0.0]
    velocities = []
    for joint, step, speed in zip(arm.joints, steps, qd, strict=True):
        before, w = w, step.inward_axes(w)
        if joint.revolute:
            w = [w[0], w[1], w[2] + speed]
        velocities.append((before, w))
    return velocities


def _link_inertia(joint: Joint, link: Link, w: Vector) -> Articulated:
    """Return a rigid link with the angular velocity w, about its joint point."""
    mass, (x, y, z), spread = joint_body(joint, link)
    trace = spread[0][0] + spread[1][1] + spread[2][2]
    tensor = [[(trace if i == j else 0.0) - spread[i][j] for j in range(3)] for i in range(3)]
    return Articulated(
        J=tensor,
        H=[[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]],
        M=[[mass if i == j else 0.0 for j in range(3)] for i in range(3)],
        n0=cross(w, apply(tensor, w)),
        f0=cross(w, cross(w, [x, y, z])),
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
    there, back = [cross(p, row) for row in H], [cross(p, row) for row in shifted]
    return Articulated(
        J=_mirrored([[J[i][j] + there[i][j] + back[j][i] for j in range(3)] for i in range(3)]),
        H=shifted,
        M=_mirrored(M),
        n0=n0,
        f0=f0,
    )


def _mirrored(matrix: Matrix) -> Matrix:
    """Return the symmetric matrix of an upper half."""
    return [[matrix[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)]


def _joint_response(
    body: Articulated, joint: Joint, rotor: float, tau: Scalar, biases: tuple[Vector, Vector]
) -> JointResponse:
    """Return the response of a body, about the joint point, to joint i, which is the z axis."""
    if joint.revolute:
        n, f, own, bias = [row[2] for row in body.J], body.H[2], body.J, body.n0[2]
    else:
        n, f, own, bias = [row[2] for row in body.H], body.M[2], body.M, body.f0[2]
    pivot = Pivot(inertia=own[2][2] + rotor, size=own[0][0] + own[1][1] + own[2][2] + rotor)
    return JointResponse(n, f, pivot, tau - bias, *biases)


def _through_joint(body: Articulated, joint: Joint, response: JointResponse) -> Articulated:
    """Return the apparent inertia of the body through joint i, which is free to move."""
    mobility = reciprocal(response.pivot.inertia)
    n, f = scale(mobility, response.n), scale(mobility, response.f)
    J = [[body.J[i][j] - n[min(i, j)] * response.n[max(i, j)] for j in range(3)] for i in range(3)]
    M = [[body.M[i][j] - f[min(i, j)] * response.f[max(i, j)] for j in range(3)] for i in range(3)]
    H = [[body.H[i][j] - n[i] * response.f[j] for j in range(3)] for i in range(3)]
    moment, force = (J, transpose(H)) if joint.revolute else (H, M)
    return Articulated(
        J=J,
        H=H,
        M=M,
        n0=add(body.n0, apply(moment, response.coriolis), scale(response.effort, n)),
        f0=add(body.f0, apply(force, response.coriolis), scale(response.effort, f)),
    )


def _outward(arm: Arm, steps: Sequence[JointStep], responses: Sequence[JointResponse]) -> list[Scalar]:
    w_dot: Vector = [0.0, 0.0, 0.0]
    v_dot = base_frame_acceleration(arm)
    accelerations: list[Scalar] = []
    for joint, step, response in zip(arm.joints, steps, responses, strict=True):
        v_dot = step.inward_axes(add(v_dot, cross(w_dot, step.lever), response.centripetal))
        w_dot = step.inward_axes(w_dot)
        if joint.revolute:
            w_dot = add(w_dot, response.coriolis)
        else:
            v_dot = add(v_dot, response.coriolis)
        net = response.effort - dot(response.n, w_dot) - dot(response.f, v_dot)
        acceleration = reciprocal(response.pivot.inertia) * net
        accelerations.append(acceleration)
        along = [0.0, 0.0, acceleration]
        if joint.revolute:
            w_dot = add(w_dot, along)
        else:
            v_dot = add(v_dot, along)
    return accelerations
