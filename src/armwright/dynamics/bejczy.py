"""Bejczy's model of the Stanford arm at JPL: the effort of each joint by its own acceleration and gravity alone.

Report TR-83-008 prints the model in its appendix III with errors. The form here is corrected; ``PRINTED`` has the
report's constants, ``fitted`` determines those of an arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import attrs
import numpy as np

from armwright.arm.model import STANDARD_GRAVITY, Arm
from armwright.arm.positions import known_arm, positions
from armwright.arrays import Array, ArrayLike, broadcast_rows, joint_array
from armwright.dynamics.bodies import body_of, shifted
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import ShapeError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import per_joint, stack
from armwright.tracing.scalar import Scalar, cos, sin

_KINDS = [True, True, False, True, True, True]  # which joints of a Stanford arm are revolute


@attrs.frozen(kw_only=True)
class Coefficients:
    """The constants of the model.

    The report's b4 occurs in three terms, which need two numbers: it is split into ``b4`` and ``slide``.

    Attributes:
        b1: of D11 [kg m²].
        b2: of D11, with the square of sin q2 [kg m²].
        b3: of D11 and D22, with q3 [kg m].
        b4: of D11 and D22, with the square of q3: the mass that the slide carries [kg].
        b5: of D11 and D22, with q3 and cos q5 [kg m].
        slide: D33: b4 and the rotor of joint 3 [kg].
        b13: of D22 [kg m²].
        b14: of D44 [kg m²].
        b15: of D44, with the square of sin q5 [kg m²].
        b17: of D55 [kg m²].
        b18: of D55, by the gripper [kg m²].
        b19: of D66, by the rotor [kg m²].
        b20: of D66, by the gripper [kg m²].
        k1: of G2 [kg m].
        k2: of G2 and G3: the mass that the slide carries [kg].
        k3: of G2, G4 and G5: the first moment of the bodies on the wrist [kg m].
    """

    b1: float
    b2: float
    b3: float
    b4: float
    b5: float
    slide: float
    b13: float
    b14: float
    b15: float
    b17: float
    b18: float
    b19: float
    b20: float
    k1: float
    k2: float
    k3: float


PRINTED = Coefficients(
    b1=1.423, b2=2.51, b3=-5.49, b4=7.257, b5=0.232, slide=7.257, b13=4.72, b14=0.107, b15=0.015,
    b17=0.099, b18=0.013, b19=0.02, b20=0.013, k1=-2.788, k2=7.257, k3=0.116,
)  # fmt: skip


def bejczy_inertias(c: Coefficients, q: Sequence[Scalar]) -> list[Scalar]:
    """Return the inertia of each of the six joints, over abstract scalars.

    Source:
        TR-83-008, appendix III; Bejczy (1974). The report lacks the square of sin q2 in D11.
    """
    s2, s5, c5, q3 = sin(q[1]), sin(q[4]), cos(q[4]), q[2]
    boom = (c.b3 + c.b5 * c5) * q3 + c.b4 * q3 * q3
    D11, D22, D44 = c.b1 + s2 * s2 * (c.b2 + boom), c.b13 + boom, c.b14 + c.b15 * s5 * s5
    return [D11, D22, c.slide, D44, c.b17 + c.b18, c.b19 + c.b20]


def bejczy_gravity(c: Coefficients, q: Sequence[Scalar], gravity: float) -> list[Scalar]:
    """Return the efforts that hold the six joints against gravity, over abstract scalars.

    Args:
        c: the constants.
        q: six joint positions.
        gravity: acceleration of free fall along the base axis, upward [m/s²]: negative for an upright arm.

    Source:
        TR-83-008, appendix III, with gravity as there: g above 0 points up.
    """
    s2, c2, s4, c4, s5, c5 = sin(q[1]), cos(q[1]), sin(q[3]), cos(q[3]), sin(q[4]), cos(q[4])
    wrist = gravity * c.k3
    return [
        0.0,
        gravity * (c.k1 + c.k2 * q[2]) * s2 + wrist * (s2 * c5 + c2 * s4 * s5),
        -gravity * c.k2 * c2,
        wrist * s2 * c4 * s5,
        wrist * (s2 * s4 * c5 + c2 * s5),
        0.0,
    ]


def bejczy_efforts(
    q: ArrayLike, qdd: ArrayLike, coefficients: Coefficients = PRINTED, *, gravity: float = -STANDARD_GRAVITY
) -> Array:
    """Return the joint efforts by Bejczy's model.

    Args:
        q: (..., 6) joint positions [rad], the third [m].
        qdd: (..., 6) joint accelerations, of the same shape.
        coefficients: constants of the model.
        gravity: acceleration of free fall along the base axis, upward [m/s²]: negative for an upright arm.

    Returns:
        tau: (..., 6) torques [N m], the third a force [N].

    Raises:
        KindError: an array is something else than real numbers.
        ShapeError: a last axis is not 6 long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.

    Source:
        TR-83-008, appendix III; Bejczy (1974).
    """
    configurations, accelerations = broadcast_rows("q, qdd", joint_array(q, 6), joint_array(qdd, 6, "qdd"))
    lead = configurations.shape[:-1]
    q_, qdd_ = per_joint(configurations), per_joint(accelerations)
    holding = bejczy_gravity(coefficients, q_, gravity)
    moving = [D * a for D, a in zip(bejczy_inertias(coefficients, q_), qdd_, strict=True)]
    return stack([a + b for a, b in zip(moving, holding, strict=True)], lead)


def fitted(arm: Arm, q: ArrayLike) -> Coefficients:
    """Return the constants with which the model is nearest to an arm, by least squares over configurations.

    The mass that the slide carries, b4 and k2, is that of its links; the other constants are fitted to the diagonal
    of the mass matrix and to gravity. D55 determines only the sum of b17 and b18: b18 is the inertia of the gripper
    about the wrist, as in the report; likewise b19 is the rotor, and b20 the remainder.

    Args:
        arm: an upright Stanford arm, rotors included.
        q: (m, 6) configurations to fit to.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: ``q`` is not (m, 6), or has fewer configurations than there are constants.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the arm has other joints than a Stanford arm.
    """
    if [joint.revolute for joint in known_arm(arm).joints] != _KINDS:
        raise UnsupportedArmError(
            f"arm '{arm.name}' is not a Stanford arm: expected six joints, of which only the third is prismatic"
        )
    q = positions(arm, q)
    if q.ndim != 2 or len(q) < len(attrs.fields(Coefficients)):
        raise ShapeError(f"q: expected (m, 6) configurations, at least as many as constants to fit, got {q.shape}")
    D = np.diagonal(mass_matrix(arm, q), axis1=-2, axis2=-1).T
    G = gravity_efforts(arm, q).T / arm.gravity[2]
    carried = sum(link.mass for link in arm.links[2:])
    s2, s4, s5 = np.sin(q[:, (1, 3, 4)]).T
    c2, c4, c5 = np.cos(q[:, (1, 3, 4)]).T
    q3, ones, zeros = q[:, 2], np.ones(len(q)), np.zeros(len(q))
    swing = s2 * s2
    b1, b2, b3, b5, b13 = _least_squares(
        [(ones, zeros), (swing, zeros), (swing * q3, q3), (swing * q3 * c5, q3 * c5), (zeros, ones)],
        (D[0] - carried * swing * q3**2, D[1] - carried * q3**2),
    )
    b14, b15 = _least_squares([(ones,), (s5 * s5,)], (D[3],))
    k1, k3 = _least_squares(
        [(s2, zeros, zeros), (s2 * c5 + c2 * s4 * s5, s2 * c4 * s5, s2 * s4 * c5 + c2 * s5)],
        (G[1] - carried * q3 * s2, G[3], G[4]),
    )
    about_wrist = shifted(body_of(arm.links[5]), [0.0, 0.0, arm.joints[5].d]).tensor[0][0]
    rotor = arm.motors[5].inertia
    return Coefficients(
        b1=b1, b2=b2, b3=b3, b4=carried, b5=b5, slide=float(D[2].mean()), b13=b13, b14=b14, b15=b15,
        b17=float(D[4].mean()) - about_wrist, b18=about_wrist, b19=rotor, b20=float(D[5].mean()) - rotor,
        k1=k1, k2=carried, k3=k3,
    )  # fmt: skip


def _least_squares(columns: Sequence[Sequence[Array]], values: Sequence[Array]) -> list[float]:
    """Return the constants of several systems of equations, solved together."""
    A = np.stack([np.concatenate(column) for column in columns], axis=1)
    return cast("list[float]", np.linalg.lstsq(A, np.concatenate(values), rcond=None)[0].tolist())
