"""Which errors of an arm a measurement identifies, and which are redundant with others.

The columns of the Jacobian are orthogonalised one after the other, in an order of preference (Gram and Schmidt, with
column selection). An error is fitted where its column has so much that is independent of those before it that the noise
leaves it a standard error of a millimetre or a few milliradians. All others are fixed at 0, and named with the errors
that they are collinear with.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array

# An error is fitted where its standard error would be below this [m], [rad].
MAX_STANDARD_ERROR = (2e-3, 5e-3)
# A column of which a smaller part is independent of the others is collinear with them but for rounding.
_ROUNDING = 1e-9
# How many collinear errors are named, and from what share on.
_MAX_NAMED, _SMALLEST_SHARE = 3, 0.05


class FixedParameter(NamedTuple):
    """An error that is not fitted.

    Attributes:
        name: of the error.
        reason: in words.
        collinear: the errors whose mixture has the same effect, with their factors [1, m/rad or rad/m].
    """

    name: str
    reason: str
    collinear: tuple[tuple[str, float], ...]


@attrs.frozen(kw_only=True, eq=False)
class Identifiability:
    """Which errors of an arm a measurement identifies.

    Attributes:
        names: of all k errors.
        fitted: numbers of those that are fitted.
        fixed: those that are not, and why.
        singular_values: of the scaled Jacobian of all k, largest first; how many are not small is the rank, the number
            of identifiable combinations.
    """

    names: tuple[str, ...]
    fitted: tuple[int, ...]
    fixed: tuple[FixedParameter, ...]
    singular_values: Array


def select_identifiable(
    names: Sequence[str],
    jacobian: Array,
    is_length: Array,
    noise: float,
    *,
    first: Sequence[int] = (),
    allowed: Collection[int] | None = None,
    max_standard_error: Array | None = None,
) -> Identifiability:
    """Return which errors can be fitted.

    Args:
        names: of k errors, in the order of preference.
        jacobian: (r, k) of the measured numbers by the errors, [m] by [m] or [rad].
        is_length: (k,) which errors are lengths.
        noise: standard deviation of a measured number [m].
        first: numbers of errors that come before all others.
        allowed: numbers of those that may be fitted; all when left out.
        max_standard_error: (k,) with which an error is fitted [m], [rad]; 2 mm or 5 mrad when left out.
    """
    if max_standard_error is None:
        max_standard_error = np.where(is_length, *MAX_STANDARD_ERROR)
    # R of a QR decomposition has the same lengths and angles between columns, and few rows.
    A: Array = np.asarray(np.linalg.qr(jacobian * max_standard_error, mode="r"), dtype=np.float64)
    basis: list[Array] = []
    fitted, dependent = [], []
    for i in (*first, *(i for i in range(len(names)) if i not in first)):
        if allowed is not None and i not in allowed:
            continue
        column = A[:, i].copy()
        # Twice, so that rounding leaves nothing of the others in it.
        for _ in range(2):
            for direction in basis:
                column -= direction * (direction @ column)
        independent, size = float(np.linalg.norm(column)), float(np.linalg.norm(A[:, i]))
        if independent > max(noise, _ROUNDING * max(size, 1e-6)):
            basis.append(column / independent)
            fitted.append(i)
        else:
            dependent.append(i)
    return Identifiability(
        names=tuple(names),
        fitted=tuple(sorted(fitted)),
        fixed=tuple(_fixed_parameter(names, A, max_standard_error, fitted, i) for i in dependent),
        singular_values=np.asarray(np.linalg.svd(A, compute_uv=False), dtype=np.float64),
    )


def is_overdetermined(numbers: int, errors: int) -> bool:
    """Whether more numbers were measured than errors are fitted, without which there is no estimate of the noise."""
    return numbers > errors


def preferred_parameters(names: Sequence[str]) -> list[int]:
    """Return the numbers of those errors that are fitted before all others: base, tool, joint offsets.

    The tool comes before the last joint, which moves it as the tool's own errors do but for one direction.
    """
    return [i for part in ("base.", "tool.", ".theta") for i, name in enumerate(names) if part in name]


def _fixed_parameter(
    names: Sequence[str], A: Array, scales: Array, fitted: Sequence[int], number: int
) -> FixedParameter:
    """Return why an error is not fitted."""
    size = float(np.linalg.norm(A[:, number]))
    if size <= _ROUNDING * float(np.linalg.norm(A, axis=0).max(initial=1e-300)):
        return FixedParameter(names[number], "unobservable: it does not move the tool in any of the poses", ())
    mixture, *_ = np.linalg.lstsq(A[:, fitted], A[:, number], rcond=None)
    independent = float(np.linalg.norm(A[:, number] - A[:, fitted] @ mixture)) / size
    share = np.abs(mixture) * np.linalg.norm(A[:, fitted], axis=0) / size
    largest = [j for j in np.argsort(-share)[:_MAX_NAMED] if share[j] > _SMALLEST_SHARE]
    collinear = tuple((names[fitted[j]], float(mixture[j] * scales[fitted[j]] / scales[number])) for j in largest)
    others = " and ".join(name for name, _ in collinear)
    if independent >= 1e-6:
        return FixedParameter(names[number], f"nearly collinear with {others} in these poses", collinear)
    what = f"a combination of {others}" if len(collinear) > 1 else others
    return FixedParameter(names[number], f"redundant: it has the same effect as {what}", collinear)
