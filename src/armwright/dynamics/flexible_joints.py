"""Arms whose gears are springs: modes of vibration, compliance of the tool, deflection under load.

The motor of a joint is at theta, its link at q, and the gear between them transmits K (theta - q) + D (theta' - q').
The links move by M(q) q'' + c(q, q') + g(q) = K (theta - q) + D (theta' - q'), where M is that of the links without
rotors. Where a gear is rigid, its motor holds the link.

Source:
    Spong (1987), "Modeling and control of elastic joint robots".
"""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, single_configuration
from armwright.arrays import LARGEST, Array, ArrayLike, Flags, one_or_each
from armwright.dynamics.accelerations import without_drives
from armwright.dynamics.arguments import weighed
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import IncapableArmError, InvalidValueError, UnsupportedArmError
from armwright.kinematics.jacobians import jacobian

_HERTZ = 1 / (2 * np.pi)
# No gear that carries an arm is deflected farther by its weight [rad], [m].
_SOFT = 1.0
# Where the links stand is found to this, in at most so many rounds [rad], [m].
_FOUND, _ROUNDS = 1e-13, 100


class Modes(NamedTuple):
    """The vibrations of an arm whose motors stand.

    Attributes:
        frequencies: (..., k) of the undamped vibrations, lowest first, one for each flexible gear [Hz].
        damping: (..., k) damping ratio of each, by its own share of the damping of the gears.
        shapes: (..., n, k) how far the joints move in each; normalized to shapesᵀ M shapes = 1.
    """

    frequencies: Array
    damping: Array
    shapes: Array


def with_gears(arm: Arm, stiffness: ArrayLike, damping: ArrayLike = 0.0) -> Arm:
    """Return an arm with other gears.

    Args:
        arm: with n joints.
        stiffness: (n,) or one for all, infinite for a rigid gear [N m/rad] or [N/m].
        damping: (n,) or one for all [N m s/rad] or [N s/m].

    Raises:
        ShapeError: the numbers are not n.
        InvalidValueError: a stiffness is not above 0, or a damping below 0.
    """
    n = known_arm(arm).n
    # What checks the numbers refuses infinite ones.
    array = np.asarray(stiffness)
    finite = np.where(np.isinf(array) & (array > 0), LARGEST, array) if array.dtype.kind in "iuf" else stiffness
    K = one_or_each(finite, n, "stiffness", "joint")
    K[K == LARGEST] = np.inf
    D = one_or_each(damping, n, "damping", "joint")
    gears = zip(arm.motors, K.tolist(), D.tolist(), strict=True)
    return attrs.evolve(arm, motors=[attrs.evolve(m, stiffness=k, damping=d) for m, k, d in gears])


def flexible_gears(arm: Arm) -> Flags:
    """Return which joints have gears that are springs, (n,).

    Raises:
        KindError: it is no arm.
        UnsupportedArmError: none has, the mass of a link is unknown, or drives are coupled.
    """
    if weighed(arm).coupling is not None:
        raise UnsupportedArmError(f"arm '{arm.name}' has coupled drives; flexible gears need a drive for each joint")
    flexible = np.isfinite(arm.motor_values("stiffness"))
    if not flexible.any():
        raise UnsupportedArmError(
            f"arm '{arm.name}': no gear is flexible; specify stiffness_Nm_per_rad in [joint.motor] of its file, or "
            "--stiffness"
        )
    return flexible


def modes(arm: Arm, q: ArrayLike) -> Modes:
    """Return the modes of vibration: K v = omega² M(q) v.

    Springs at the joints stiffen those with flexible gears. Weight, which also pulls a swinging arm back or topples it,
    is left out: it is small beside gears.

    Args:
        arm: with n joints.
        q: (..., n) positions of the links [rad] or [m].

    Raises:
        ShapeError: ``q`` does not fit the arm.
        InvalidValueError: a number is NaN or infinite, or a mode moves no mass.
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
    """
    flexible = flexible_gears(arm)
    M = mass_matrix(arm, q, drives=False)[..., flexible, :][..., flexible]
    try:
        L = np.linalg.cholesky(M)
    except np.linalg.LinAlgError as error:
        raise InvalidValueError(
            f"arm '{arm.name}': a joint with a flexible gear moves no mass, and would vibrate infinitely fast; give "
            "its link a mass and an inertia, or leave its gear rigid"
        ) from error
    inverse = np.linalg.inv(L)
    K, D = joint_stiffness(arm)[flexible], arm.motor_values("damping")[flexible]
    # Singular values keep the digits of the lowest frequency, which eigenvalues, their squares, would lose.
    _, omega, V = np.linalg.svd(np.sqrt(K)[:, None] * np.swapaxes(inverse, -1, -2))
    omega, V = omega[..., ::-1], np.swapaxes(V, -1, -2)[..., ::-1]
    v = np.swapaxes(inverse, -1, -2) @ V
    shapes = np.zeros((*M.shape[:-2], arm.n, len(K)))
    shapes[..., flexible, :] = v
    damping = np.einsum("...ik,i,...ik->...k", v, D, v) / (2 * omega)
    return Modes(omega * _HERTZ, damping, shapes)


def tool_compliance(arm: Arm, q: ArrayLike) -> Array:
    """Return how far the tool yields to a wrench while the motors stand: J K⁻¹ Jᵀ.

    Args:
        arm: with n joints.
        q: (..., n) positions of the links [rad] or [m].

    Returns:
        (..., 6, 6) displacement and rotation vector by force and moment at the tool point, base axes [m/N], [rad/N],
        [m/(N m)], [rad/(N m)].

    Raises:
        ShapeError: ``q`` does not fit the arm.
        UnsupportedArmError: no gear is flexible, or drives are coupled.
    """
    flexible_gears(arm)
    J = jacobian(arm, q)
    return np.asarray(J / joint_stiffness(arm) @ np.swapaxes(J, -1, -2))


def gear_efforts(arm: Arm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, wrench: ArrayLike | None = None) -> Array:
    """Return what the gears transmit to the links of a motion: M q'' + c + g, and the springs at the joints.

    Args:
        arm: with n joints.
        q: (..., n) positions of the links [rad] or [m].
        qd: (..., n) velocities.
        qdd: (..., n) accelerations.
        wrench: (..., 6) force and moment on the tool, along base axes; none when left out.

    Returns:
        (..., n) efforts [N m] or [N]; the motors take rotors and friction beside.

    Raises:
        ShapeError: arrays do not fit the arm or each other.
        UnsupportedArmError: the mass of a link is unknown.
    """
    return inverse_dynamics(without_drives(weighed(arm)), q, qd, qdd, wrench=wrench)


def deflection(
    arm: Arm, q: ArrayLike, qd: ArrayLike | None = None, qdd: ArrayLike | None = None, wrench: ArrayLike | None = None
) -> Array:
    """Return how far the links lag behind the motors of a motion, q - theta = -K⁻¹ (M q'' + c + g).

    Args:
        arm: with n joints.
        q: (..., n) positions of the links [rad] or [m].
        qd: (..., n) velocities; at rest when left out.
        qdd: (..., n) accelerations; none when left out.
        wrench: (..., 6) force and moment on the tool, along base axes; none when left out.

    Returns:
        (..., n) [rad] or [m]; 0 where a gear is rigid. ``jacobian`` times it is the displacement of the tool.

    Raises:
        ShapeError: arrays do not fit the arm or each other.
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
    """
    flexible_gears(arm)
    still = np.zeros_like(np.asarray(q, dtype=np.float64))
    tau = gear_efforts(arm, q, still if qd is None else qd, still if qdd is None else qdd, wrench)
    return np.asarray(-tau / arm.motor_values("stiffness"))


def links_at_rest(arm: Arm, theta: ArrayLike) -> Array:
    """Return where the links stand on their gears when the motors stand: theta = q + K⁻¹ g(q).

    Args:
        arm: with n joints.
        theta: (n,) positions of the motors [rad] or [m].

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
        IncapableArmError: the gears do not carry the weight.
    """
    theta = q = single_configuration(arm, theta)
    for _ in range(_ROUNDS):
        q, last = theta + deflection(arm, q), q
        if np.abs(q - last).max() < _FOUND * max(1.0, np.abs(q).max()):
            return q
        if np.abs(q - theta).max() > _SOFT:
            break
    raise IncapableArmError(
        f"arm '{arm.name}': its gears are so soft that its weight bends them without end; check their stiffness"
    )


def joint_stiffness(arm: Arm) -> Array:
    """Return the stiffness of gears and springs at the joints together, (n,), infinite where a gear is rigid."""
    return np.asarray(arm.motor_values("stiffness") + [joint.spring.stiffness for joint in arm.joints])
