"""How well a configuration can move the tool: measures of the Jacobian that are 0 where a direction is lost."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import positions
from armwright.arrays import LARGEST, Array, ArrayLike, number
from armwright.errors import InvalidValueError, one_of
from armwright.kinematics.jacobians import jacobian

Measure: TypeAlias = Literal["yoshikawa", "smallest", "inverse-condition"]
Motion: TypeAlias = Literal["all", "linear", "angular"]

_ROWS: dict[str, slice] = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}


def manipulability(
    arm: Arm, q: ArrayLike, measure: Measure = "yoshikawa", motion: Motion = "all", length: float = 1.0
) -> Array:
    """Return how well the tool can be moved.

    Metres and radians are compared through ``length``: the angular rows of the Jacobian are multiplied by it, so that
    a rotation counts as the displacement of a point that far from the axis. The measures are taken of min(rows, n)
    singular values, so an arm with fewer joints than rows is measured within what it can do at all; with as many joints
    as rows or more the first is Yoshikawa's sqrt(det(J Jᵀ)).

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        measure: ``yoshikawa``, the product of the singular values; ``smallest``, the smallest of them: the speed of
            the tool in its worst direction for joint speeds of length 1; ``inverse-condition``, the smallest over the
            largest, 0 to 1.
        motion: ``all`` six rows, the ``linear`` three or the ``angular`` three.
        length: what a rotation by one radian is worth [m].

    Returns:
        (...) the measure, 0 or more.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        UnknownNameError: there is no such measure or motion.
        InvalidValueError: a number is NaN or infinite, or ``length`` is not above 0.

    Source:
        Yoshikawa (1985); Klein & Blaho (1987) for the other two.
    """
    one_of("measure", measure, get_args(Measure))
    rows = _ROWS[one_of("motion", motion, _ROWS)]
    J = scaled_rows(jacobian(arm, positions(arm, q)), length)[..., rows, :]
    sigma = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    if measure == "yoshikawa":
        return np.asarray(np.prod(sigma, axis=-1))
    if measure == "smallest":
        return np.asarray(sigma[..., -1])
    largest = np.asarray(sigma[..., 0])
    return np.asarray(sigma[..., -1] / np.where(largest > 0, largest, 1.0))


def scaled_rows(J: Array, length: float) -> Array:
    """Return the Jacobian (..., 6, n) with its angular rows in metres: multiplied by ``length`` [m].

    Raises:
        KindError: ``length`` is no number.
        InvalidValueError: it is not above 0.
    """
    length = number(length, "length")
    if not 0 < length <= LARGEST:
        raise InvalidValueError(
            f"length: expected a characteristic length above 0 (the length equivalent to one radian), got {length}"
        )
    return np.asarray(J * np.repeat((1.0, length), 3)[:, None])
