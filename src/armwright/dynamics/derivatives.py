"""Derivatives of inverse and forward dynamics, exact: the equations are traced for an arm and differentiated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.accelerations import check_pivots
from armwright.dynamics.arguments import Scalars, batch, stack_matrix
from armwright.dynamics.articulated_body import Pivot
from armwright.dynamics.drives import less_friction, with_drives
from armwright.dynamics.inertia_matrix import inverse_of_mass
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.springs import with_springs
from armwright.tracing.derivatives import jacobian, replaced
from armwright.tracing.evaluation import evaluate
from armwright.tracing.graph import Graph, Traced
from armwright.tracing.vectors import Matrix, apply, mirrored, product, scale, subtract


class EffortDerivatives(NamedTuple):
    """The derivatives of the efforts of inverse dynamics.

    Attributes:
        dq: (..., n, n) of effort i by position j.
        dqd: (..., n, n) of effort i by velocity j.
        M: (..., n, n) of effort i by acceleration j: the mass matrix, rotor inertia included.
    """

    dq: Array
    dqd: Array
    M: Array


class AccelerationDerivatives(NamedTuple):
    """The derivatives of the accelerations of forward dynamics.

    Attributes:
        dq: (..., n, n) of acceleration i by position j.
        dqd: (..., n, n) of acceleration i by velocity j.
        dtau: (..., n, n) of acceleration i by effort j: the inverse of the mass matrix.
    """

    dq: Array
    dqd: Array
    dtau: Array


def inverse_dynamics_derivatives(arm: Arm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> EffortDerivatives:
    """Return the derivatives of the efforts of a motion, drives and springs included.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities. Coulomb friction has the derivative 0, at rest too, where it jumps, and
            Stribeck friction at rest.
        qdd: (..., n) joint accelerations.

    Returns:
        Derivatives by positions, velocities and accelerations, (..., n, n) each.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        The recursion of Luh, Walker & Paul (1980), differentiated automatically.
    """
    lead, scalars, _ = batch(arm, q=q, qd=qd, qdd=qdd)
    return EffortDerivatives(*(stack_matrix(A, lead) for A in _evaluated(_traced_efforts(arm), scalars)))


def forward_dynamics_derivatives(arm: Arm, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> AccelerationDerivatives:
    """Return the derivatives of the accelerations that efforts cause.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities. Coulomb friction has the derivative 0, at rest too, where it jumps, and
            Stribeck friction at rest.
        tau: (..., n) torques [N m] or forces [N], positive in the direction of q.

    Returns:
        Derivatives by positions, velocities and efforts, (..., n, n) each.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: a joint moves no inertia, or the mass of a link is unknown.

    Source:
        Carpentier & Mansard (2018): the derivatives of the efforts at those accelerations, times the inverse of the
        mass matrix.
    """
    lead, scalars, _ = batch(arm, q=q, qd=qd, tau=tau)
    *matrices, inertias, sizes = _evaluated(_traced_accelerations(arm), scalars)
    check_pivots(arm, [Pivot(*pair) for pair in zip(inertias[0], sizes[0], strict=True)])
    return AccelerationDerivatives(*(stack_matrix(A, lead) for A in matrices))


class _TracedMatrices(NamedTuple):
    graph: Graph
    matrices: list[Matrix]


def _evaluated(traced: _TracedMatrices, scalars: Sequence[Scalars]) -> list[Matrix]:
    """Return the matrices of an arm at configurations."""
    flat = evaluate(
        traced.graph, [x for A in traced.matrices for row in A for x in row], [x for row in scalars for x in row]
    )
    values = iter(flat)
    return [[[next(values) for _ in row] for row in A] for A in traced.matrices]


@lru_cache(maxsize=4)  # to trace takes a tenth of a second, and an arm does not change
def _traced_efforts(arm: Arm) -> _TracedMatrices:
    return _traced(arm, effort_partials)


@lru_cache(maxsize=4)
def _traced_accelerations(arm: Arm) -> _TracedMatrices:
    def matrices(arm: Arm, q: list[Traced], qd: list[Traced], tau: list[Traced]) -> list[Matrix]:
        partials, pivots = acceleration_partials(arm, q, qd, tau)
        return [*partials, [[pivot.inertia for pivot in pivots]], [[pivot.size for pivot in pivots]]]

    return _traced(arm, matrices)


def _traced(arm: Arm, equation: Callable[..., Sequence[Matrix]]) -> _TracedMatrices:
    graph = Graph()
    return _TracedMatrices(graph, list(equation(arm, *(graph.inputs(arm.n) for _ in range(3)))))


def effort_partials(
    arm: Arm, q: Sequence[Traced], qd: Sequence[Traced], qdd: Sequence[Traced]
) -> tuple[Matrix, Matrix, Matrix]:
    """Return the derivatives of the efforts by positions and velocities, and the mass matrix, over traced scalars.

    Args:
        arm: the arm, with n joints.
        q: n joint positions, inputs of a graph.
        qd: n joint velocities, as well.
        qdd: n joint accelerations, as well.
    """
    efforts = with_drives(arm, with_springs(arm, newton_euler(arm, q, qd, qdd), q), qd, qdd)
    n = arm.n
    rows = jacobian(efforts, [*q, *qd, *qdd])
    M = mirrored([row[2 * n :] for row in rows])
    return [row[:n] for row in rows], [row[n : 2 * n] for row in rows], M


def acceleration_partials(
    arm: Arm, q: Sequence[Traced], qd: Sequence[Traced], tau: Sequence[Traced]
) -> tuple[tuple[Matrix, Matrix, Matrix], list[Pivot]]:
    """Return the derivatives of the accelerations by positions, velocities and efforts, over traced scalars.

    The efforts are differentiated at constant accelerations, which are inputs at first; the accelerations that the
    efforts cause replace them afterwards.

    Args:
        arm: the arm, with n joints.
        q: n joint positions, inputs of a graph.
        qd: n joint velocities, as well.
        tau: n efforts, as well.

    Returns:
        The derivatives, and n pivots. Where a pivot is 0 the joint moves no inertia, and the derivatives are
        meaningless.
    """
    graph = q[0].graph
    qdd = graph.inputs(arm.n)
    dq, dqd, M = effort_partials(arm, q, qd, qdd)
    inverse, pivots = inverse_of_mass(arm, M)
    bias = with_springs(arm, newton_euler(arm, q, qd, [0.0] * arm.n), q)
    accelerations = apply(inverse, subtract(less_friction(arm, qd, tau), bias))
    by = {x.node: acceleration for x, acceleration in zip(qdd, accelerations, strict=True)}
    at_accelerations = [replaced(row, by, graph) for row in dq]
    opposite = [scale(-1.0, row) for row in inverse]
    return (product(opposite, at_accelerations), product(opposite, dqd), inverse), pivots
