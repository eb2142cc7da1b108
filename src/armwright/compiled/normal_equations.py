"""Normal equations of the parameters of the dynamics, added up over any number of samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import LARGEST, Array, ArrayLike, broadcast_rows, exact_shape, joint_array
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.dynamics.identification import base_parameters
from armwright.dynamics.regressors import parameter_count
from armwright.errors import InvalidValueError

# Samples whose regressors exist at a time: 2 MB of them for six joints.
_BLOCK = 512


class NormalEquations(NamedTuple):
    """The normal equations A theta = b of least squares.

    The p parameters are those of ``dynamics.dynamic_parameters``, or of ``dynamics.base_parameters``. Equations of
    several measurements are added.

    Attributes:
        A: (p, p) sum of Yᵀ W Y, symmetric. It is singular for all parameters, as not all can be told apart; for base
            parameters it is not, if the motions excite them all.
        b: (p,) sum of Yᵀ W tau.
    """

    A: Array
    b: Array


def normal_equations(
    arm: Arm | CompiledArm,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    tau: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    base: bool = False,
) -> NormalEquations:
    """Return the normal equations of measured motions, for the parameters of the dynamics.

    The regressors of a block of samples exist at a time, so memory beside the arguments does not grow with the samples.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.
        tau: (..., n) measured efforts [N m] or [N].
        weights: (n,) weight of each joint, 0 or more: the inverse of the variance of its effort; all 1 when left out.
        base: whether the parameters are the base parameters, not all of ``dynamic_parameters``.

    Returns:
        Their matrix and right side.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite, or a weight is below 0.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Khalil & Dombre (2002), chapter 12.
    """
    fast = arm if isinstance(arm, CompiledArm) else compile_arm(arm)
    n = fast.arm.n
    regressor = fast.base_regressor if base else fast.regressor
    W = np.ones(n) if weights is None else exact_shape(weights, (n,), "weights", LARGEST)
    if (W < 0).any():
        raise InvalidValueError(f"weights: expected numbers of 0 or more, got {W.tolist()}")
    named = {"q": q, "qd": qd, "qdd": qdd, "tau": tau}
    rows = broadcast_rows(", ".join(named), *(joint_array(x, n, name) for name, x in named.items()))
    q_, qd_, qdd_, tau_ = (x.reshape(-1, n) for x in rows)
    columns = len(base_parameters(fast.arm).columns) if base else parameter_count(fast.arm)
    A, b = np.zeros((columns, columns)), np.zeros(columns)
    for first in range(0, len(q_), _BLOCK):
        block = slice(first, first + _BLOCK)
        Y = regressor(q_[block], qd_[block], qdd_[block])
        # Y is (samples, n, columns): a row for each joint of each sample.
        weighted = (Y * W[:, None]).reshape(-1, columns)
        A += weighted.T @ Y.reshape(-1, columns)
        b += weighted.T @ tau_[block].reshape(-1)
    return NormalEquations((A + A.T) / 2, b)
