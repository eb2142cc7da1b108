"""The mass matrix: the efforts at one joint by the accelerations of another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import batch, stack_matrix
from armwright.dynamics.articulated_body import Pivot
from armwright.dynamics.drives import with_rotors
from armwright.dynamics.joint_frames import JointBody, at_previous_joint, combined, joint_body, joint_steps
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector, add, cross, dot

# A configuration in which every arm shows that a joint moves nothing.
_BENT = 0.3
# A joint that moves less inertia than this part of the largest moves nothing.
_NOTHING = 1e-12


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
    return stack_matrix(with_rotors(arm, M) if drives else M, lead)


def massless_joint(arm: Arm) -> int | None:
    """Return the index of a joint that moves no mass, which efforts accelerate without bound; None if there is none.

    Args:
        arm: the arm, with n joints.

    Raises:
        UnsupportedArmError: the mass of a link is unknown.
    """
    moved = np.linalg.eigvalsh(mass_matrix(arm, np.full(arm.n, _BENT)))
    if moved[0] > _NOTHING * max(float(moved[-1]), np.finfo(float).tiny):
        return None
    bodies = zip(arm.links, arm.motors, strict=True)
    return max((i for i, (link, motor) in enumerate(bodies) if not link.mass + motor.inertia), default=arm.n - 1)


def inverse_of_mass(arm: Arm, M: Matrix) -> tuple[Matrix, list[Pivot]]:
    """Return the inverse of a mass matrix by M = Lᵀ D L, and its pivots D, over abstract scalars.

    Elimination goes from the last joint to the first, so that a pivot is the inertia about or along a joint while all
    joints beyond it are free. No row is exchanged: a mass matrix is positive definite.

    Args:
        arm: the arm, with n joints.
        M: n x n, of which the upper half is read.

    Returns:
        The inverse, n x n and symmetric, and n pivots.

    Source:
        Featherstone (2008), chapter 6: the LTDL factorization, here of a matrix without zeros.
    """
    n = arm.n
    rest = [list(row) for row in M]
    L: Matrix = [[0.0] * i for i in range(n)]
    reciprocals: list[Scalar] = [0.0] * n
    for i in reversed(range(n)):
        reciprocals[i] = 1.0 / rest[i][i]
        L[i] = [rest[j][i] * reciprocals[i] for j in range(i)]
        for k in range(i):
            for j in range(k + 1):
                rest[j][k] = rest[j][k] - L[i][j] * rest[k][i]
    # The inverse of L, of which the diagonal is 1.
    X: Matrix = [[*[0.0] * i, 1.0] for i in range(n)]
    for i in range(n):
        for j in range(i):
            X[i][j] = -sum((L[i][k] * X[k][j] for k in range(j + 1, i)), start=L[i][j])
    weighted = [[x * reciprocal for x, reciprocal in zip(row, reciprocals, strict=False)] for row in X]
    lower = [[dot(weighted[i][: j + 1], X[j]) for j in range(i + 1)] for i in range(n)]
    inverse = [[lower[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]
    # Moments of inertia are compared with moments of inertia, masses with masses.
    alike = [[k for k in range(n) if arm.revolute[k] == arm.revolute[i]] for i in range(n)]
    return inverse, [Pivot(rest[i][i], sum(M[k][k] for k in alike[i])) for i in range(n)]
