"""Forward dynamics: joint accelerations from efforts, by two algorithms that share only the link transform."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import NO_WRENCH, Scalars, batch, stack_matrix
from armwright.dynamics.articulated_body import Pivot, articulated_body
from armwright.dynamics.drives import less_friction, with_rotors
from armwright.dynamics.inertia_matrix import composite_rigid_body, inverse_of_mass
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.springs import less_springs
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import stack
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import apply, subtract

# An inertia this small beside the others of its kind is zero but for rounding.
NEGLIGIBLE = 1e-12


def forward_dynamics(
    arm: Arm, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, wrench: ArrayLike | None = None, drives: bool = True
) -> Array:
    """Return the joint accelerations that efforts cause, by the articulated-body algorithm.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        tau: (..., n) torques [N m] or forces [N], positive in the direction of q.
        wrench: (..., 6) force [N] and moment [N m] acting on the tool from outside, at the tool point, along
            base axes; none when left out.
        drives: whether rotor inertia and friction of the drives count. Coulomb friction of a joint at rest does not:
            whether it holds depends on all other joints; ``simulate`` determines that.

    Returns:
        qdd: (..., n) joint accelerations.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: a joint moves no inertia.

    Source:
        Featherstone (2008), section 7.3.
    """
    lead, (q_, qd_, tau_), push = batch(arm, wrench=wrench, q=q, qd=qd, tau=tau)
    model = arm if drives else without_drives(arm)
    driving = less_springs(model, less_friction(model, qd_, tau_), q_)
    if not lead:
        # A division by zero must raise no error here: the check of the pivots reports it.
        q_, qd_, driving = ([np.array(x) for x in scalars] for scalars in (q_, qd_, driving))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        accelerations, pivots = driven_accelerations(model, q_, qd_, driving, push)
    check_pivots(model, pivots)
    return stack(accelerations, lead)


def driven_accelerations(
    arm: Arm, q: Scalars, qd: Scalars, driving: Scalars, wrench: Scalars = NO_WRENCH
) -> tuple[list[Scalar], list[Pivot]]:
    """Return the accelerations that efforts cause, less those of friction and springs, over abstract scalars.

    The articulated-body algorithm has each rotor at its joint. Rotors of coupled drives are turned by several joints;
    there the mass matrix is factorized.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint velocities.
        driving: n efforts.
        wrench: as in ``articulated_body``.

    Returns:
        n accelerations, and n pivots, as of ``articulated_body``.
    """
    if arm.coupling is None:
        return articulated_body(arm, q, qd, driving, wrench)
    inverse, pivots = inverse_of_mass(arm, with_rotors(arm, composite_rigid_body(arm, q)))
    return apply(inverse, subtract(driving, newton_euler(arm, q, qd, [0.0] * arm.n, wrench))), pivots


def toacc(
    arm: Arm, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, wrench: ArrayLike | None = None, drives: bool = True
) -> Array:
    """Return the joint accelerations that efforts cause, by n + 1 calls of Newton-Euler and a system of equations.

    A unit acceleration of one joint at a time yields the columns of the mass matrix; a call without accelerations
    yields the efforts that velocities and gravity require.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        tau: (..., n) torques [N m] or forces [N], positive in the direction of q.
        wrench: (..., 6) force [N] and moment [N m] acting on the tool from outside, at the tool point, along
            base axes; none when left out.
        drives: as in ``forward_dynamics``.

    Returns:
        qdd: (..., n) joint accelerations.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: a joint moves no inertia.

    Source:
        TR-83-008, appendix V, subroutine TOACC; Walker & Orin (1982), method 1.
    """
    lead, (q_, qd_, tau_), push = batch(arm, wrench=wrench, q=q, qd=qd, tau=tau)
    model = arm if drives else without_drives(arm)
    D = stack_matrix(unit_accelerations(model, q_), lead)
    bias = newton_euler(model, q_, qd_, [0.0] * arm.n, push)
    driving = less_springs(model, less_friction(model, qd_, tau_), q_)
    net = stack([a - b for a, b in zip(driving, bias, strict=True)], lead)
    check_pivots(model, eliminated(model, D))
    return np.asarray(np.linalg.solve(D, net[..., None])[..., 0], dtype=np.float64)


def unit_accelerations(arm: Arm, q: Sequence[Scalar]) -> list[list[Scalar]]:
    """Return the mass matrix by n calls of Newton-Euler, rotor inertia included, over abstract scalars.

    Source:
        TR-83-008, subroutine TOACC, loop 10.
    """
    still = [0.0] * arm.n
    columns = []
    for i in range(arm.n):
        unit = [1.0 if j == i else 0.0 for j in range(arm.n)]
        columns.append(newton_euler(arm, q, still, unit, base_acceleration=arm.gravity.tolist()))
    return with_rotors(arm, [list(row) for row in zip(*columns, strict=True)])


def eliminated(arm: Arm, M: Array) -> list[Pivot]:
    """Return the pivots of a mass matrix (..., n, n), eliminated from the last joint inward.

    They are the inertias about or along each joint while all joints beyond it are free.
    """
    M = M.copy()
    diagonal = np.diagonal(M, axis1=-2, axis2=-1).copy()
    pivots: list[Pivot] = []
    for i in reversed(range(arm.n)):
        # Moments of inertia are compared with moments of inertia, masses with masses.
        size = diagonal[..., arm.revolute == arm.revolute[i]].max(axis=-1)
        pivots.append(Pivot(inertia=M[..., i, i].copy(), size=size))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            M[..., :i, :i] -= M[..., :i, i, None] * M[..., i, None, :i] / M[..., i, i, None, None]
    return pivots[::-1]


def check_pivots(arm: Arm, pivots: Sequence[Pivot]) -> None:
    """Refuse an arm of which a joint moves no inertia.

    Raises:
        UnsupportedArmError: a pivot is 0 but for rounding, or NaN; the joint nearest to the tool is named.
    """
    for i in reversed(range(arm.n)):
        if not np.all(np.asarray(pivots[i].inertia) > NEGLIGIBLE * np.asarray(pivots[i].size)):
            what, amount = ("about", "moment of inertia") if arm.joints[i].revolute else ("along", "mass")
            raise UnsupportedArmError(
                f"arm '{arm.name}': the acceleration of {arm.joint_label(i)} is undefined: what it moves has no "
                f"inertia {what} its axis while the distal joints are free. Give its link a {amount} or its motor an "
                "inertia."
            )


def without_drives(arm: Arm) -> Arm:
    """Return an arm whose drives neither weigh nor rub."""
    return attrs.evolve(arm, motors=[Motor()] * arm.n, coupling=None)
