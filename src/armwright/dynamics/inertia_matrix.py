"""The mass matrix: the efforts at one joint by the accelerations of another."""

from __future__ import annotations

from collections.abc import Sequence

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import batch, stack_matrix
from armwright.dynamics.joint_frames import JointBody, at_previous_joint, combined, joint_body, joint_steps
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector, add, cross


def composite_rigid_body(arm: Arm, q: Sequence[Scalar]) -> Matrix:
    """Return the n x n mass matrix of the links alone, over abstract scalars.

    Inward, from the last joint: the links beyond joint i, with their joints locked, are one body. A unit acceleration
    of joint i changes its momentum, and every joint nearer to the base bears its component of that.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.

    Returns:
        M, symmetric, without the inertia of rotors.

    Source:
        Walker & Orin (1982), method 3; Featherstone (2008), section 6.2.
    """
    steps = joint_steps(arm, q)
    M: Matrix = [[0.0] * arm.n for _ in range(arm.n)]
    beyond: JointBody | None = None
    for i in reversed(range(arm.n)):
        joint = arm.joints[i]
        body = joint_body(joint, arm.links[i])
        if beyond is not None:
            body = combined(body, at_previous_joint(beyond, steps[i + 1]))
        beyond = body
        # Momentum P and angular momentum L for a unit velocity of the joint, which is the z axis of its joint point.
        if joint.revolute:
            P: Vector = [-body.moment[1], body.moment[0], 0.0]
            L: Vector = [-body.spread[0][2], -body.spread[1][2], body.spread[0][0] + body.spread[1][1]]
        else:
            P, L = [0.0, 0.0, body.mass], [body.moment[1], -body.moment[0], 0.0]
        for j in reversed(range(i + 1)):
            if j < i:
                step = steps[j + 1]
                P, L = step.outward_axes(P), step.outward_axes(L)
                L = add(L, cross(step.lever, P))
            M[i][j] = M[j][i] = L[2] if arm.joints[j].revolute else P[2]
    return M


def mass_matrix(arm: Arm, q: ArrayLike, *, drives: bool = True) -> Array:
    """Return the mass matrix M of the equation of motion: tau = M qdd + h(q, qd).

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        drives: whether rotor inertia counts.

    Returns:
        M: (..., n, n), symmetric; [kg m²], [kg m] or [kg] by the kinds of the two joints.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Walker & Orin (1982), method 3; TR-83-008 eq. (14).
    """
    lead, (q_,), _ = batch(arm, q=q)
    M = composite_rigid_body(arm, q_)
    if drives:
        for i, motor in enumerate(arm.motors):
            M[i][i] = M[i][i] + motor.inertia
    return stack_matrix(M, lead)
