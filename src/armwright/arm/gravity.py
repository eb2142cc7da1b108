"""Gravity belongs to the world: what of it an arm feels follows from how its base stands there.

All that weighs an arm asks the arm: ``Arm.gravity`` is the one place, and ``felt_gravity`` the one function that fills
it, for cells, for URDF files and for arms that were calibrated in the frame of an instrument.
"""

from __future__ import annotations

import warnings

import attrs
import numpy as np

from armwright.arm.model import STANDARD_GRAVITY, Arm
from armwright.arrays import Array
from armwright.errors import GravityWarning

# A part of gravity along an axis that is smaller than this is rounding in the turn of a base.
_ROUNDING = 1e-11
# A vector that an arm states is the world's where it differs by less than this part.
_SAME = 1e-9


def felt_gravity(X_WB: Array, gravity: Array) -> Array:
    """Return the acceleration of free fall along the axes of a base.

    Zeros are exact where the base stands at right angles to gravity, so that arms that feel the same have the same
    kernels.

    Args:
        X_WB: (4, 4) pose of the base in the world.
        gravity: (3,) along the axes of the world [m/s²].

    Returns:
        (3,) [m/s²].
    """
    felt = X_WB[:3, :3].T @ gravity
    size = float(np.linalg.norm(gravity))
    felt = np.where(np.abs(felt) <= _ROUNDING * size, 0.0, felt)
    # The only part that is left is all of it.
    return np.copysign(size, felt) * (felt != 0) if np.count_nonzero(felt) == 1 else felt


def in_world(arm: Arm, X_WB: Array, gravity: Array, *, name: str) -> Arm:
    """Return an arm that stands in a world and feels the gravity there.

    Args:
        arm: the arm.
        X_WB: (4, 4) pose of its base in the world.
        gravity: (3,) of the world [m/s²].
        name: how a warning calls the arm.

    Warns:
        GravityWarning: the arm states another gravity than it feels here; it is ignored.
    """
    felt = felt_gravity(X_WB, gravity)
    away = float(np.abs(felt - arm.gravity).max())
    if arm.gravity_from in {"stated", "root"} and away > _SAME * STANDARD_GRAVITY:
        whose = "its file" if arm.gravity_from == "stated" else "the root link of its URDF file"
        warnings.warn(
            f"{name}: '{arm.name}' has the gravity {vector_text(arm.gravity)} of {whose}, which counts outside of "
            f"cells only; here its base feels {vector_text(felt)}, from {vector_text(gravity)} of the cell",
            GravityWarning,
            stacklevel=3,
        )
    return attrs.evolve(arm, gravity=felt, gravity_from="world")


def vector_text(gravity: Array) -> str:
    """Write a gravity for people."""
    return f"({', '.join(f'{x + 0.0:g}' for x in gravity.tolist())}) m/s²"
