"""The arguments of the functions of dynamics: joint arrays whose leading axes fit together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions
from armwright.arrays import LARGEST, Array, ArrayLike, broadcast_rows, joint_array, of_shape
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import per_joint, stack
from armwright.tracing.scalar import Scalar

# One abstract scalar per joint, or the components of a vector.
Scalars: TypeAlias = Sequence[Scalar]

NO_WRENCH = (0.0,) * 6


class Batch(NamedTuple):
    """Arguments split into scalars, one per joint of each, and the leading axes that all of them share."""

    lead: tuple[int, ...]
    scalars: list[list[Scalar]]
    wrench: Sequence[Scalar]


def batch(arm: Arm, *, wrench: ArrayLike | None = None, **arrays: ArrayLike) -> Batch:
    """Check joint arrays and split them into scalars; the array with the name ``q`` has joint positions.

    Only public functions call this, directly with their arguments: a warning then points to their caller.

    Args:
        arm: the arm, with n joints.
        wrench: (..., 6) on the tool, or None.
        arrays: (..., n) each, by its name in messages.

    Returns:
        The scalars, in the order of the arguments.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n (or 6) long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Warns:
        UnitWarning: the positions seem to be in degrees.
    """
    n = weighed(arm).n
    checked: list[Array] = []
    for name, value in arrays.items():
        checked.append(positions(arm, value, callers=2) if name == "q" else joint_array(value, n, name))
    names = [*arrays]
    if wrench is not None:
        checked.append(of_shape(wrench, (6,), "wrench", LARGEST))
        names.append("wrench")
    rows = broadcast_rows(", ".join(names), *checked)
    scalars = [per_joint(row) for row in rows]
    return Batch(rows[0].shape[:-1], scalars[: len(arrays)], NO_WRENCH if wrench is None else scalars[-1])


def weighed(arm: Arm) -> Arm:
    """Return ``arm`` if its masses and inertias are known, or specified as zero.

    Raises:
        KindError: it is no arm.
        UnsupportedArmError: those of a link are unknown; the link is named.
    """
    for i, link in enumerate(known_arm(arm).links, 1):
        if link.unknown:
            name = f" ('{link.name}')" if link.name else ""
            raise UnsupportedArmError(
                f"arm '{arm.name}': no dynamics, for mass and inertia of link {i}{name} are unknown: {link.unknown}. "
                "Kinematics does not need them"
            )
    return arm


def stack_matrix(rows: Sequence[Sequence[Scalar]], lead: tuple[int, ...]) -> Array:
    """Return a matrix of scalars as an array (..., rows, columns)."""
    flat = stack([x for row in rows for x in row], lead)
    return flat.reshape(*lead, len(rows), len(rows[0]))
