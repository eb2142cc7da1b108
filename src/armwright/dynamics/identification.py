"""The base parameters of an arm, which its motions identify: linear combinations of its dynamic parameters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import Scalars, batch, stack_matrix, weighed
from armwright.dynamics.regressors import OF_LINK, effort_regressor, joint_parameters, parameter_count
from armwright.tracing.vectors import Matrix

_OF_LINK = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
# States at which the regressor is evaluated to find its structure; each gives an equation per joint.
_STATES = 100
# A column that is no longer than this part of the longest has no effect.
_NO_EFFECT = 1e-12
# A column of which no longer part is orthogonal to others is a combination of them: rounding leaves 1e-13.
_DEPENDENT = 1e-10
# A coefficient of one column in another that is no more than rounding.
_NO_COEFFICIENT = 1e-11


class BaseParameters(NamedTuple):
    """The base parameters of an arm, by the geometry and gravity alone.

    Attributes:
        columns: (b,) which columns of ``regressor`` are independent: those of ``base_regressor``.
        names: of the parameter of each of these columns, such as ``Izz2`` of link 2; others are combined with it.
        combinations: (b, p) base parameters by the p parameters of ``dynamic_parameters``: pi = combinations @ theta.
    """

    columns: tuple[int, ...]
    names: tuple[str, ...]
    combinations: Array


def parameter_names(arm: Arm) -> list[str]:
    """Return the names of the parameters of ``dynamic_parameters``.

    Of link i they are ``mi``, ``mxi``, ``myi``, ``mzi``, ``Ixxi`` and so on, of the drive of joint i ``rotori``,
    ``viscousi``, ``forwardi`` and ``backwardi``, and of one with friction of other kinds or a spring ``offseti``,
    ``stribecki``, ``cube_rooti``, ``stiffnessi`` and ``preloadi``.

    Args:
        arm: the arm.

    Raises:
        KindError: it is no arm.
    """
    groups = (_OF_LINK, joint_parameters(known_arm(arm)))
    return [f"{name}{i + 1}" for names in groups for i in range(arm.n) for name in names]


def base_parameters(arm: Arm) -> BaseParameters:
    """Return the base parameters of an arm: the fewest numbers in which its efforts are linear.

    A parameter whose effect on all efforts is a combination of the effects of others is no base parameter, but part of
    theirs; one without effect is part of none. Parameters of links nearer to the base are kept, and of each link
    rather first and second moments than the mass: the combinations then hold lengths and their squares, as in books.

    Args:
        arm: the arm, with n joints.

    Returns:
        Their columns, names and combinations, the same whenever it is called.

    Raises:
        KindError: ``arm`` is no arm.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Gautier (1991), Numerical calculation of the base inertial parameters of robots.
    """
    parameters = _base_parameters(weighed(arm))
    # The caller may write into its array; that of the cache stays as it is.
    return parameters._replace(combinations=parameters.combinations.copy())


def base_regressor(arm: Arm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
    """Return the columns of the regressor that are independent: tau = Y pi, with the base parameters pi.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.

    Returns:
        Y: (..., n, b), one column for each of the b base parameters of ``base_parameters``.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Khalil & Dombre (2002), chapters 9 and 12.
    """
    lead, scalars, _ = batch(arm, q=q, qd=qd, qdd=qdd)
    return stack_matrix(effort_base_regressor(arm, *scalars), lead)


def effort_base_regressor(arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars) -> Matrix:
    """Return the independent columns of the regressor, n x b, over abstract scalars: see ``effort_regressor``."""
    columns = _base_parameters(arm).columns
    return [[row[k] for k in columns] for row in effort_regressor(arm, q, qd, qdd)]


@lru_cache(maxsize=16)  # takes milliseconds, and an arm does not change
def _base_parameters(arm: Arm) -> BaseParameters:
    n = arm.n
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.uniform(-3, 3, size=(3, n, _STATES))
    # Stribeck friction shows at low speeds only.
    low = arm.motor_values("stribeck_speed")
    qd[low > 0, ::2] *= low[low > 0, None]
    if arm.coupling is not None:
        qd = arm.coupling.matrix @ qd  # these were the speeds of the drives
    Y = stack_matrix(effort_regressor(arm, list(q), list(qd), list(qdd)), (_STATES,))
    order = [*link_order(n), *range(OF_LINK * n, parameter_count(arm))]
    columns, combinations = independent_columns(Y.reshape(-1, parameter_count(arm)), order)
    names = parameter_names(arm)
    return BaseParameters(columns, tuple(names[k] for k in columns), combinations)


def link_order(n: int) -> list[int]:
    """Return the columns of the links in the order in which independent ones are chosen: of each link its mass last."""
    return [OF_LINK * i + k for i in range(n) for k in (*range(1, OF_LINK), 0)]


def independent_columns(Y: Array, order: Sequence[int]) -> tuple[tuple[int, ...], Array]:
    """Return which columns of a matrix are independent, and how the others are combined of them.

    Args:
        Y: (m, p) rows of a regressor at states that show its structure, more than p.
        order: of all columns: of those that depend on each other the first ones are kept.

    Returns:
        The b independent columns, sorted, and the (b, p) combinations of all p: Y = Y[:, columns] combinations.
    """
    lengths = np.linalg.norm(Y, axis=0)
    has_effect = lengths > _NO_EFFECT * lengths.max()
    # The factor R has the same dependences between columns, in as many rows as columns.
    R = np.array(np.linalg.qr(np.where(has_effect, Y / np.where(has_effect, lengths, 1.0), 0.0), mode="r"))
    columns = _independent(R, order)
    coefficients = np.linalg.lstsq(R[:, columns], R, rcond=None)[0]
    coefficients[np.abs(coefficients) < _NO_COEFFICIENT] = 0.0
    coefficients[:, columns] = np.eye(len(columns))
    return tuple(columns), coefficients * lengths / lengths[columns][:, None]


def _independent(R: Array, order: Sequence[int]) -> list[int]:
    """Return which columns, each of length 1 or 0, are no combination of those before them in an order.

    Source:
        Gram-Schmidt orthogonalisation, done twice: Giraud et al. (2005).
    """
    basis = np.zeros((len(R), len(order)))
    columns: list[int] = []
    for k in order:
        rest, known = R[:, k], basis[:, : len(columns)]
        # Twice, as what rounding has left of the first time is not orthogonal.
        for _ in range(2):
            rest = rest - known @ (known.T @ rest)
        length = np.linalg.norm(rest)
        if length > _DEPENDENT:
            basis[:, len(columns)] = rest / length
            columns.append(k)
    return sorted(columns)
