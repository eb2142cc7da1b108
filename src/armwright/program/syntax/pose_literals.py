"""Twelve numbers as a pose: whether they are one, and what was probably meant where they are not."""

import math
from collections.abc import Sequence

import attrs

from armwright.errors import counted
from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.units import LENGTHS, UnitSystem
from armwright.program.syntax import tree
from armwright.spatial.rotations import nearest_rotation

# A rotation typed with six digits passes; one typed with two or three is repaired; worse is a slip.
EXACT_TOLERANCE = 1e-6
REPAIR_TOLERANCE = 1e-2
# `orthonormality_error` adds this for a mirror image.
_MIRROR_PENALTY = 2.0

# Of numbers written row by row, with the bottom row or without, and of columns with it: where n, o, a, p stand.
_ROW_WISE = (0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11)
_COLUMNS_OF_16 = (0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14)


def check(matrix: tree.Matrix, units: UnitSystem) -> Diagnostic | None:
    """Return what is wrong with a matrix; None if nothing is, or if its rotation is known only at run time.

    Args:
        matrix: of numbers and other expressions.
        units: what the last three count.
    """
    values = [item.value for item in matrix.items if isinstance(item, tree.Number)]
    # A number that was reported before is NaN.
    if any(map(math.isnan, values)):
        return None
    if len(matrix.items) != 12:
        diagnostic = _wrong_number_count(matrix, values)
    else:
        certain = all(isinstance(item, tree.Number) for item in matrix.items[:9])
        error = rotation_error(tuple(values[:9])) if certain else 0.0
        if error <= EXACT_TOLERANCE:
            return None
        diagnostic = _inexact_rotation(matrix, values, error)
    if not diagnostic.is_error:
        return diagnostic
    order = "the numbers are the columns n, o, a, p in this order"
    note = f"{order}: n, o, a are the axes, p is the position in {LENGTHS[units.length]}"
    return attrs.evolve(diagnostic, notes=(note, *diagnostic.notes))


def _inexact_rotation(matrix: tree.Matrix, values: Sequence[float], error: float) -> Diagnostic:
    if error <= REPAIR_TOLERANCE:
        text = "the axes of this matrix are not quite of length 1 and at right angles"
        return _finding(matrix, text, f"off by {error:.1g}; the nearest rotation is taken", "write more digits", "W206")
    if len(values) == 12 and is_rotation([values[index] for index in _ROW_WISE[:9]]):
        return _suggest_order(matrix, _ROW_WISE, "this matrix is written row by row")
    if _MIRROR_PENALTY <= error <= _MIRROR_PENALTY + REPAIR_TOLERANCE:
        text = "this matrix is a mirror image, not a rotation"
        return _finding(matrix, text, "n, o, a are left-handed", "a must be n times o")
    return _finding(matrix, "the first nine numbers are not a rotation", _describe_axis_error(values))


def pose_numbers(matrix: tree.Matrix) -> tuple[float, ...]:
    """Return the twelve numbers of a checked matrix of numbers, the rotation repaired where that was promised."""
    values = tuple(item.value for item in matrix.items if isinstance(item, tree.Number))
    if rotation_error(values[:9]) <= EXACT_TOLERANCE:
        return values
    R = nearest_rotation([values[0:9:3], values[1:9:3], values[2:9:3]])
    return (*R.T.ravel().tolist(), *values[9:])


def rotation_error(axes: tuple[float, ...]) -> float:
    """Return how far n, o, a are from the columns of a rotation, as ``orthonormality_error`` does of arrays.

    A program has thousands of matrices, one at a time: numbers take a tenth of the time of arrays.
    """
    if max(map(abs, axes)) > 2.0:
        return math.inf
    n, o, a = axes[0:3], axes[3:6], axes[6:9]
    lengths = max(abs(_dot(axis, axis) - 1) for axis in (n, o, a))
    angles = max(abs(_dot(n, o)), abs(_dot(o, a)), abs(_dot(n, a)))
    normal = (n[1] * o[2] - n[2] * o[1], n[2] * o[0] - n[0] * o[2], n[0] * o[1] - n[1] * o[0])
    return max(lengths, angles) + (_MIRROR_PENALTY if _dot(normal, a) < 0 else 0.0)


def _dot(x: Sequence[float], y: Sequence[float]) -> float:
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def is_rotation(axes: Sequence[float]) -> bool:
    """Whether n, o, a are near enough to a rotation to have been meant as one."""
    return rotation_error(tuple(axes)) <= REPAIR_TOLERANCE


def _wrong_number_count(matrix: tree.Matrix, values: list[float]) -> Diagnostic:
    count = len(matrix.items)
    if len(values) == count == 16:
        for bottom_row, order, message in (
            (values[12:], _ROW_WISE, "this matrix is written row by row"),
            (values[3::4], _COLUMNS_OF_16, "this matrix includes its bottom row"),
        ):
            if bottom_row == [0, 0, 0, 1] and is_rotation([values[index] for index in order[:9]]):
                return _suggest_order(matrix, order, message)
    return _finding(matrix, f"a matrix has 12 numbers, not {count}", f"{counted(count, 'number')} here")


def _suggest_order(matrix: tree.Matrix, order: Sequence[int], message: str) -> Diagnostic:
    numbers = [item for item in matrix.items if isinstance(item, tree.Number)]
    texts = [numbers[index].text for index in order]
    literal = "(" + ", ".join(",".join(texts[i : i + 3]) for i in range(0, 12, 3)) + ")"
    is_full = len(numbers) == 12
    notes = () if is_full else ("omit the bottom row 0 0 0 1",)
    label = "n, o, a are not a rotation" if is_full else "16 numbers here"
    finding = _finding(matrix, message, label, f"write `{literal}`")
    return attrs.evolve(finding, notes=notes, fixes=(Fix(matrix.span, literal),))


def _finding(matrix: tree.Matrix, message: str, label: str, advice: str = "", code: str = "E206") -> Diagnostic:
    helps = (advice,) if advice else ()
    return Diagnostic(code=code, message=message, span=matrix.span, label=label, helps=helps)


def _describe_axis_error(values: Sequence[float]) -> str:
    """Name the first axis that is not of length 1, or the first two that are not at right angles."""
    axes = {"n": values[0:3], "o": values[3:6], "a": values[6:9]}
    for name, axis in axes.items():
        length = math.hypot(*axis)
        if abs(length - 1) > REPAIR_TOLERANCE / 2:
            return f"{name} has length {length:.4g}, not 1"
    for first, second in (("n", "o"), ("o", "a"), ("n", "a")):
        if abs(_dot(axes[first], axes[second])) > REPAIR_TOLERANCE:
            return f"{first} and {second} are not at right angles"
    return "n, o, a are not at right angles"
