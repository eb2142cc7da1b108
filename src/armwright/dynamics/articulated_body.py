"""The articulated-body algorithm of forward dynamics: passes outward, inward and outward again.

Each link with all links beyond it, their joints free to move, reacts to a force at its own joint like a body whose
inertia depends on the direction. That inertia, and the force without acceleration, are passed inward from the last
link; accelerations are passed back outward. Accelerations here are those of material points, not spatial ones, so
linear speeds never appear.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.arguments import NO_WRENCH, Scalars
from armwright.dynamics.bodies import body_of
from armwright.dynamics.newton_euler import base_frame_acceleration, tool_reaction
from armwright.kinematics.forward_kinematics import link_transform
from armwright.tracing.scalar import Scalar, reciprocal
from armwright.tracing.vectors import Matrix, Vector, add, apply, congruence, cross, dot, product, scale, transpose

_Transform: TypeAlias = tuple[Matrix, Vector]


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
        centripetal: acceleration of the origin of the link's frame about the joint.
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
    transforms = [link_transform(joint, position) for joint, position in zip(arm.joints, q, strict=True)]
    velocities = _angular_velocities(arm, transforms, qd)
    f, n = tool_reaction(arm, q, wrench)
    body = Articulated(J=_zeros(), H=_zeros(), M=_zeros(), n0=n, f0=f)
    responses: list[JointResponse] = []
    for i in reversed(range(arm.n)):
        joint, (before, at_joint, behind) = arm.joints[i], velocities[i]
        body = _combined(_link_inertia(arm.links[i], behind), body)
        centripetal = cross(at_joint, cross(at_joint, transforms[i][1]))
        body = _in_previous_frame(body, transforms[i], centripetal)
        coriolis = scale(1.0 if joint.revolute else 2.0, [before[1] * qd[i], -before[0] * qd[i], 0.0])
        response = _joint_response(body, joint, arm.motors[i].inertia, tau[i], (coriolis, centripetal))
        body = _through_joint(body, joint, response)
        responses.append(response)
    responses.reverse()
    return _outward(arm, transforms, responses), [response.pivot for response in responses]


def _zeros() -> Matrix:
    return [[0.0, 0.0, 0.0] for _ in range(3)]


def _angular_velocities(arm: Arm, transforms: Sequence[_Transform], qd: Scalars) -> list[tuple[Vector, Vector, Vector]]:
    """Return for each joint the angular velocity of frame i-1 and frame i in frame i-1, and of frame i in frame i."""
    w: Vector = [0.0, 0.0, 0.0]
    velocities = []
    for joint, (R, _), speed in zip(arm.joints, transforms, qd, strict=True):
        at_joint = [w[0], w[1], w[2] + speed] if joint.revolute else w
        behind = apply(transpose(R), at_joint)
        velocities.append((w, at_joint, behind))
        w = behind
    return velocities


def _link_inertia(link: Link, w: Vector) -> Articulated:
    """Return a rigid link with the angular velocity w, in its frame."""
    mass, (x, y, z), tensor = body_of(link)
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


def _in_previous_frame(body: Articulated, transform: _Transform, centripetal: Vector) -> Articulated:
    """Return a body of frame i in frame i-1, for accelerations of its point at the origin of frame i-1."""
    R, p = transform
    J, M = congruence(R, body.J), congruence(R, body.M)
    H = product(product(R, body.H), transpose(R))
    f0 = add(apply(R, body.f0), apply(M, centripetal))
    n0 = add(apply(R, body.n0), apply(H, centripetal), cross(p, f0))
    # H and J about the origin of frame i-1: H + [p] M and J - H [p] + [p] (H + [p] M)ᵀ, row by row.
    shifted = [add(row, lever) for row, lever in zip(H, transpose([cross(p, row) for row in M]), strict=True)]
    there, back = [cross(p, row) for row in H], [cross(p, row) for row in shifted]
    upper = [[J[i][j] + there[i][j] + back[j][i] if j >= i else 0.0 for j in range(3)] for i in range(3)]
    J = [[upper[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)]
    return Articulated(J=J, H=shifted, M=M, n0=n0, f0=f0)


def _joint_response(
    body: Articulated, joint: Joint, rotor: float, tau: Scalar, biases: tuple[Vector, Vector]
) -> JointResponse:
    """Return the response of a body in frame i-1 to joint i, which is the z axis."""
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


def _outward(arm: Arm, transforms: Sequence[_Transform], responses: Sequence[JointResponse]) -> list[Scalar]:
    w_dot: Vector = [0.0, 0.0, 0.0]
    v_dot = base_frame_acceleration(arm)
    accelerations: list[Scalar] = []
    for joint, (R, p), response in zip(arm.joints, transforms, responses, strict=True):
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
        v_dot = add(v_dot, cross(w_dot, p), response.centripetal)
        Rt = transpose(R)
        w_dot, v_dot = apply(Rt, w_dot), apply(Rt, v_dot)
    return accelerations
