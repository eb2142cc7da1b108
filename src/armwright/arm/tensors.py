"""Inertia tensors: which a body can have."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array

# Inertia tensors are computed from typed numbers; this much is rounding, more is a mistake.
ROUNDING = 1e-9
# Published tensors are measured and rounded: the triangle inequality may be broken by this part of the trace. The worst
# of the catalogue is link 3 of the PUMA 560, 0.066 + 0.0125 against 0.086 kg m², which is 0.046 of its trace.
_TENSOR_ROUNDING = 0.05


def impossible_moments(mass: float, com: Array, inertia: Array) -> Array | None:
    """Return the principal moments of a tensor that no body has, or None where a body can have it.

    A body has no negative moment, and none larger than the other two together. A tensor with a single moment is let
    pass: the other two are not known, and left 0.

    Args:
        mass: [kg].
        com: (3,) centre of mass [m].
        inertia: (3, 3) tensor about it [kg m²].

    Returns:
        (3,) moments, smallest first [kg m²], or None.
    """
    moments = np.asarray(np.linalg.eigvalsh(inertia), dtype=np.float64)
    slack = _TENSOR_ROUNDING * np.abs(moments).sum() + ROUNDING * mass * float(com @ com)
    single = np.count_nonzero(np.abs(moments) > slack) == 1
    negative, exceeds = moments[0] < -slack, moments[2] > moments[0] + moments[1] + slack
    return moments if negative or (exceeds and not single) else None


def moments_message(moments: Array) -> str:
    """Return what is wrong with principal moments (3,) about the centre of mass that no body has [kg m²]."""
    values = ", ".join(f"{moment:.3g}" for moment in moments)
    return (
        f"a body cannot have the principal moments {values} kg m² about its centre of mass: none may be negative, or "
        "exceed the sum of the other two"
    )
