"""Lagrange-Euler dynamics: derivatives of the energies of the links by the joint positions.

This shares only the link transform with Newton-Euler, so that each is a check on the other. U_ij is
the derivative of the pose of link i by q_j, U_ijk that of U_ij by q_k; with the pseudo-inertia J of each link,

    D_ij  = sum over m of tr(U_mj J_m U_miᵀ)
    h_ijk = sum over m of tr(U_mjk J_m U_miᵀ)
    G_i   = - sum over m of m_m gᵀ U_mi s_m

and the efforts are D qdd + h qd qd + G. Numbers of links and joints run from 0 here.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias, cast

import attrs
import numpy as np

from armwright.arm.model import Arm, Joint, Link
from armwright.arm.positions import positions
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import batch, stack_matrix
from armwright.kinematics.forward_kinematics import link_transform, per_joint, stack
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, add, apply, dot, product

# Three indices: that of the effort, and those of the two speeds.
Tensor: TypeAlias = list[list[list[Scalar]]]

_LAST_ROW = [0.0, 0.0, 0.0, 1.0]


@attrs.frozen(kw_only=True)
class Derivatives:
    """Derivatives of the link poses by the joint positions, over abstract scalars, and their products with inertias.

    Attributes:
        first: ``first[i][j]`` is U_ij, 4 x 4, for j up to i; the pose of a link depends on no joint beyond it.
        second: ``second[i][j, k]`` is U_ijk, 4 x 4, for j up to k up to i; it is the same with j and k exchanged.
        weighted: ``weighted[i][j]`` is U_ij J_i, 4 x 4, with J_i the pseudo-inertia of link i.

    Source:
        TR-83-008 eq. (6), (9); subroutines CALUIJ, CAUIJK and CALHI.
    """

    first: list[list[Matrix]]
    second: list[dict[tuple[int, int], Matrix]]
    weighted: list[list[Matrix]]


def pose_derivatives(arm: Arm, q: Sequence[Scalar]) -> Derivatives:
    """Derive the poses of the links by one and by two joint positions, over abstract scalars.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.

    Source:
        TR-83-008 eq. (12)-(16): U_ij = T_0^j-1 Q_j T_j-1^i, U_ijk = T_0^j-1 Q_j T_j-1^k-1 Q_k T_k-1^i.
    """
    A = [_homogeneous(joint, position) for joint, position in zip(arm.joints, q, strict=True)]
    # T is the pose of the frame before each joint, heads[j] that times Q_j.
    T: Matrix = arm.base.tolist()
    heads: list[Matrix] = []
    for joint, A_j in zip(arm.joints, A, strict=True):
        heads.append(_derived(joint, T))
        T = product(T, A_j)
    first: list[list[Matrix]] = []
    second: list[dict[tuple[int, int], Matrix]] = []
    for i, A_i in enumerate(A):
        # The derivative of link i by a joint before it is that of link i-1, carried on by A_i.
        before, before_twice = (first[i - 1], second[i - 1]) if i else ([], {})
        first.append([*(product(U, A_i) for U in before), product(heads[i], A_i)])
        twice = {pair: product(U, A_i) for pair, U in before_twice.items()}
        for j in range(i + 1):
            U = before[j] if j < i else heads[i]
            twice[j, i] = product(_derived(arm.joints[i], U), A_i)
        second.append(twice)
    inertias = [pseudo_inertia(link) for link in arm.links]
    weighted = [[product(U, J) for U in of_link] for of_link, J in zip(first, inertias, strict=True)]
    return Derivatives(first=first, second=second, weighted=weighted)


def _homogeneous(joint: Joint, q: Scalar) -> Matrix:
    R, p = link_transform(joint, q)
    return [[*row, x] for row, x in zip(R, p, strict=True)] + [_LAST_ROW]


def _derived(joint: Joint, T: Matrix) -> Matrix:
    """Return T Q: this is the derivative by q, as A_i = exp(Q q) times a constant.

    Source:
        TR-83-008, subroutine MULTQK.
    """
    if joint.revolute:
        return [[row[1], -row[0], 0.0, 0.0] for row in T]
    return [[0.0, 0.0, 0.0, row[2]] for row in T]


def pseudo_inertia(link: Link) -> Matrix:
    """Return the 4 x 4 integral of r rᵀ dm over a link, r homogeneous, products of inertia included.

    Source:
        TR-83-008 eq. (9). Its program omits the products of inertia.
    """
    spread = np.eye(3) * link.inertia.trace() / 2 - link.inertia
    s = np.append(link.com, 1.0)
    J = link.mass * np.outer(s, s)
    J[:3, :3] += spread
    return cast("Matrix", J.tolist())


def inertia_coefficients(derivatives: Derivatives) -> Matrix:
    """Return D, n x n, over abstract scalars.

    Source:
        TR-83-008 eq. (14); subroutine CALCIK.
    """
    n = len(derivatives.first)
    D: Matrix = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            D[i][j] = D[j][i] = _sum(_inner(derivatives.first[m][j], derivatives.weighted[m][i]) for m in range(i, n))
    return D


def speed_coefficients(derivatives: Derivatives) -> Tensor:
    """Return h, n x n x n, over abstract scalars: ``h[i][j][k] qd_j qd_k`` is a part of effort i.

    Source:
        TR-83-008 eq. (15); subroutine CALCOR.
    """
    n = len(derivatives.first)
    h: Tensor = [[[0.0] * n for _ in range(n)] for _ in range(n)]
    for i in range(n):
        for k in range(n):
            for j in range(k + 1):
                h[i][j][k] = h[i][k][j] = _sum(
                    _inner(derivatives.second[m][j, k], derivatives.weighted[m][i]) for m in range(max(i, k), n)
                )
    return h


def gravity_coefficients(arm: Arm, derivatives: Derivatives) -> list[Scalar]:
    """Return G, n efforts, over abstract scalars.

    Source:
        TR-83-008 eq. (16); subroutine CALCI.
    """
    n = arm.n
    g, U, links = arm.gravity.tolist(), derivatives.first, arm.links
    s = [[*link.com.tolist(), 1.0] for link in links]
    return [_sum(-links[m].mass * dot(g, apply(U[m][i][:3], s[m])) for m in range(i, n)) for i in range(n)]


def lagrange_euler(arm: Arm, q: Sequence[Scalar], qd: Sequence[Scalar], qdd: Sequence[Scalar]) -> list[Scalar]:
    """Return the efforts that the links alone require, over abstract scalars.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint velocities.
        qdd: n joint accelerations.

    Source:
        TR-83-008 eq. (13), subroutine GLAGRA.
    """
    derivatives = pose_derivatives(arm, q)
    inertial = apply(inertia_coefficients(derivatives), qdd)
    by_speed = [dot(apply(h_i, qd), qd) for h_i in speed_coefficients(derivatives)]
    return add(inertial, by_speed, gravity_coefficients(arm, derivatives))


def _inner(U: Matrix, V: Matrix) -> Scalar:
    """Return tr(U Vᵀ) of two derivatives, whose last rows are 0."""
    return _sum(dot(u, v) for u, v in zip(U[:3], V[:3], strict=True))


def _sum(parts: Iterable[Scalar]) -> Scalar:
    first, *others = parts
    return sum(others, start=first)


def coriolis_tensor(arm: Arm, q: ArrayLike) -> Array:
    """Return the tensor of the centrifugal and Coriolis efforts.

    Its entries are the Christoffel symbols of the mass matrix; they are the same with j and k exchanged.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].

    Returns:
        h: (..., n, n, n); effort i is the sum of h[i, j, k] qd[j] qd[k].

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (15).
    """
    lead, (q_,), _ = batch(arm, q=q)
    h = speed_coefficients(pose_derivatives(arm, q_))
    return stack([x for plane in h for row in plane for x in row], lead).reshape(*lead, arm.n, arm.n, arm.n)


def coriolis_matrix(arm: Arm, q: ArrayLike, qd: ArrayLike) -> Array:
    """Return C(q, qd), with which the centrifugal and Coriolis efforts are C qd.

    Of the many such matrices this is the one of the Christoffel symbols, for which dM/dt - 2 C is skew.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.

    Returns:
        C: (..., n, n).

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (15); Spong, Hutchinson & Vidyasagar (2006), section 7.2.
    """
    lead, (q_, qd_), _ = batch(arm, q=q, qd=qd)
    h = speed_coefficients(pose_derivatives(arm, q_))
    return stack_matrix([apply(h_i, qd_) for h_i in h], lead)


def pose_derivative_matrices(arm: Arm, q: ArrayLike) -> Array:
    """Return the derivatives of the link poses by the joint positions: the matrices U_ij of Lagrange-Euler.

    U_ij is the derivative of the homogeneous pose of frame i in the base frame by joint position j; 0 for j > i.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].

    Returns:
        U: (..., n, n, 4, 4), link i first, then joint j; columns 0-2 [1/rad or 1/m], column 3 [m/rad] or none.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008 eq. (5)-(7).
    """
    q = positions(arm, q)
    lead = q.shape[:-1]
    first = pose_derivatives(arm, per_joint(q)).first
    U = np.zeros((*lead, arm.n, arm.n, 4, 4))
    for i, of_link in enumerate(first):
        for j, matrix in enumerate(of_link):
            U[..., i, j, :, :] = stack_matrix(matrix, lead)
    return U
