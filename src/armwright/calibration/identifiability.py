"""Which errors of an arm a measurement tells, and which it cannot tell from others.

One error after the other is taken, in an order of preference, as long as it moves the tool in a way that those taken
before do not, and by so much that the noise of the measurement leaves it known to a millimetre or a few milliradians.
What is left over is held at 0 and named, with the errors that do the same.
"""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array

# An error is told when its standard deviation would be below this [m], [rad].
MAX_STANDARD_ERROR_LENGTH, MAX_STANDARD_ERROR_ANGLE = 2e-3, 5e-3
# Columns that lie in the others but for this part are rounding.
_ROUNDING = 1e-9
# How many others are named that do the same, and from what part on.
_NAMED, _SMALLEST_PART = 3, 0.05


class FixedParameter(NamedTuple):
    """An error that is not fitted.

    Attributes:
        name: of the error.
        why: in words.
        same: those that do the same, with how much of each [1, m/rad or rad/m].
    """

    name: str
    why: str
    same: tuple[tuple[str, float], ...]


@attrs.frozen(kw_only=True, eq=False)
class Identifiability:
    """What a measurement tells of an arm.

    Attributes:
        names: of all k errors.
        kept: numbers of those that are fitted.
        held: those that are not, and why.
        singular_values: of the scaled equations of all k, largest first; how many are not small is how many
            mixtures of errors the measurement tells.
    """

    names: tuple[str, ...]
    kept: tuple[int, ...]
    held: tuple[FixedParameter, ...]
    singular_values: Array


def select_identifiable(
    names: Sequence[str],
    jacobian: Array,
    is_length: Array,
    noise: float,
    *,
    first: Sequence[int] = (),
    allowed: Collection[int] | None = None,
    known: Array | None = None,
) -> Identifiability:
    """Return which errors can be fitted.

    Args:
        names: of k errors, in the order of preference.
        jacobian: (r, k) of the measured numbers by the errors, [m] by [m] or [rad].
        is_length: (k,) which errors are lengths.
        noise: standard deviation of a measured number [m].
        first: numbers of errors that come before all others.
        allowed: numbers of those that may be fitted; all when left out.
        known: (k,) how well each should be known at least [m], [rad]; to 2 mm or 5 mrad when left out.
    """
    if known is None:
        known = np.where(is_length, MAX_STANDARD_ERROR_LENGTH, MAX_STANDARD_ERROR_ANGLE)
    # The triangle has the same lengths and angles between columns, and few rows.
    A: Array = np.asarray(np.linalg.qr(jacobian * known, mode="r"), dtype=np.float64)
    order = [*first, *(i for i in range(len(names)) if i not in first)]
    basis: list[Array] = []
    kept, left = [], []
    for i in order:
        if allowed is not None and i not in allowed:
            continue
        column = A[:, i].copy()
        # Twice, so that rounding leaves nothing of the others in it.
        for _ in range(2):
            for one in basis:
                column -= one * (one @ column)
        rest, size = float(np.linalg.norm(column)), float(np.linalg.norm(A[:, i]))
        if rest > max(noise, _ROUNDING * max(size, 1e-6)):
            basis.append(column / rest)
            kept.append(i)
        else:
            left.append(i)
    held = tuple(_held(names, A, known, kept, i) for i in left)
    values = np.linalg.svd(A, compute_uv=False)
    return Identifiability(
        names=tuple(names), kept=tuple(sorted(kept)), held=held, singular_values=np.asarray(values, dtype=np.float64)
    )


def is_overdetermined(numbers: int, errors: int) -> bool:
    """Whether so many measured numbers are enough for so many errors: one more, or nothing tells noise from them."""
    return numbers > errors


def preferred_parameters(names: Sequence[str]) -> list[int]:
    """Return the numbers of those errors that are taken before all others: base, tool, joint offsets.

    The tool comes before the last joint, which moves it as the tool's own errors do but for one direction.
    """
    return [i for part in ("base.", "tool.", ".theta") for i, name in enumerate(names) if part in name]


def _held(names: Sequence[str], A: Array, known: Array, kept: Sequence[int], number: int) -> FixedParameter:
    """Return why an error is held."""
    size = float(np.linalg.norm(A[:, number]))
    if size <= _ROUNDING * float(np.linalg.norm(A, axis=0).max(initial=1e-300)):
        return FixedParameter(names[number], "it does not move the tool in any of the poses", ())
    mix, *_ = np.linalg.lstsq(A[:, kept], A[:, number], rcond=None)
    left = float(np.linalg.norm(A[:, number] - A[:, kept] @ mix)) / size
    part = np.abs(mix) * np.linalg.norm(A[:, kept], axis=0) / size
    best = [j for j in np.argsort(-part)[:_NAMED] if part[j] > _SMALLEST_PART]
    same = tuple((names[kept[j]], float(mix[j] * known[kept[j]] / known[number])) for j in best)
    others = " and ".join(name for name, _ in same)
    if left < 1e-6:
        return FixedParameter(
            names[number],
            f"it does just what {others} do together" if len(same) > 1 else f"it does just what {others} does",
            same,
        )
    return FixedParameter(names[number], f"these poses hardly tell it from {others}", same)
