"""The mass matrix: the efforts at one joint by the accelerations of another."""

from __future__ import annotations

from collections.abc import Sequence

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import batch, stack_matrix
from armwright.dynamics.bodies import NOTHING, body_of, combined, in_previous_frame
from armwright.kinematics.forward_kinematics import link_transform
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross


def composite_rigid_body(arm: Arm, q: Sequence[Scalar]) -> Matrix:
    """Return the n x n mass matrix of the links alone, over abstract scalars.

    Inward, from the last joint: the links beyond joint i, with their joints locked, are one body. A unit acceleration
    of joint i changes its momentum, and every joint nearer to the base bears its component of that.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.

    Source:
        Walker & Orin (1982), method 3; Featherstone (2008), section 6.2.
    """
    transforms = [link_transform(joint, position) for joint, position in zip(arm.joints, q, strict=True)]
    M: Matrix = [[0.0] * arm.n for _ in range(arm.n)]
    body = NOTHING
    for i in reversed(range(arm.n)):
        # In frame i-1 the joint is the z axis through the origin.
        body = in_previous_frame(combined(body, body_of(arm.links[i])), *transforms[i])
        if arm.joints[i].revolute:
            P: Vector = [-body.moment[1], body.moment[0], 0.0]
            L: Vector = [row[2] for row in body.tensor]
        else:
            P, L = [0.0, 0.0, body.mass], [body.moment[1], -body.moment[0], 0.0]
        for j in reversed(range(i + 1)):
            if j < i:
                R, p = transforms[j]
                P = apply(R, P)
                L = add(apply(R, L), cross(p, P))
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

    Source:
        Walker & Orin (1982), method 3; TR-83-008 eq. (14).
    """
    lead, (q_,), _ = batch(arm, q=q)
    M = composite_rigid_body(arm, q_)
    if drives:
        for i, motor in enumerate(arm.motors):
            M[i][i] = M[i][i] + motor.inertia
    return stack_matrix(M, lead)
