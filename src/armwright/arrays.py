"""Converters of arrays, which check shape and values, copy to float64 and make read-only; and the cores for them."""

import math
import operator
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from decimal import Decimal
from numbers import Real
from typing import Any, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.errors import InvalidValueError, KindError, ShapeError, shown

Array: TypeAlias = npt.NDArray[np.float64]
ArrayLike: TypeAlias = npt.ArrayLike
# Numbers of rows, from 0 or 1.
Numbers: TypeAlias = npt.NDArray[np.intp]
Flags: TypeAlias = npt.NDArray[np.bool_]

# Larger than any quantity of a robot; products of three such numbers are still finite.
LARGEST = 1e100
# No angle is larger: less than ten digits of its sine would be right.
LARGEST_ANGLE = 1e12
_ANY = sys.float_info.max


def floats(value: ArrayLike, what: str, largest: float = _ANY) -> Array:
    """Return a fresh float64 copy of ``value``.

    Args:
        value: numbers of any shape.
        what: their name in a message.
        largest: bound of their absolute values; ``LARGEST`` for numbers that are multiplied.

    Raises:
        KindError: the value is not real numbers: texts, booleans, complex numbers, None.
        ShapeError: its rows differ in length.
        InvalidValueError: a number is NaN, infinite, or too large.
    """
    array = _plain(value, what)
    if array.size and not np.abs(array).max() <= largest:  # not fulfilled by NaN
        index = tuple(int(i) for i in np.argwhere(~(np.abs(array) <= largest))[0])
        wrong, where = array[index], f" at {shown(index)}" if index else ""
        if np.isfinite(wrong):
            raise InvalidValueError(f"{what}: expected numbers no larger than {largest:g}, got {wrong:g}{where}")
        raise InvalidValueError(f"{what}: every number must be finite, got {wrong}{where}")
    return array


def number(value: float, what: str) -> float:
    """Return a real number as a float; it may be NaN or infinite.

    Raises:
        KindError: the value is not a real number.
        InvalidValueError: the number is larger than any float.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if not _is_real(value):
        raise KindError(f"{what}: expected a number, got {shown(value)}")
    try:
        return float(value)
    except OverflowError as error:
        raise InvalidValueError(
            f"{what}: expected a number no larger than {_ANY:.3g}, got one of many digits"
        ) from error


def positive(value: float, what: str, unit: str = "") -> float:
    """Return a number above 0 as a float; messages name its unit, if it has one.

    Raises:
        KindError: the value is not a real number.
        InvalidValueError: it is not above 0, or larger than any of a robot.
    """
    result = number(value, what)
    if not result > 0:
        raise InvalidValueError(f"{what}: expected more than {f'0 {unit}'.strip()}, got {result}")
    return _within_largest(result, what, unit)


def not_negative(value: float, what: str, unit: str = "") -> float:
    """Return a number of 0 or above as a float; messages name its unit, if it has one.

    Raises:
        KindError: the value is not a real number.
        InvalidValueError: it is below 0, or larger than any of a robot.
    """
    result = number(value, what)
    if not result >= 0:
        raise InvalidValueError(f"{what}: expected {f'0 {unit}'.strip()} or more, got {result}")
    return _within_largest(result, what, unit)


def in_range(value: float, bounds: tuple[float, float], what: str, unit: str = "") -> float:
    """Return a number within bounds as a float; messages name its unit, if it has one.

    Args:
        value: the number.
        bounds: the smallest and the largest that are allowed.
        what: its name in a message.
        unit: of the number and the bounds.

    Raises:
        KindError: the value is not a real number.
        InvalidValueError: it is out of the bounds.
    """
    result, (low, high) = number(value, what), bounds
    if not low <= result <= high:  # not fulfilled by NaN
        expected, got = f"{low:g} to {high:g} {unit}".strip(), f"{result:g} {unit}".strip()
        raise InvalidValueError(f"{what}: expected {expected}, got {got}")
    return result


def _within_largest(value: float, what: str, unit: str) -> float:
    if value > LARGEST:
        raise InvalidValueError(f"{what}: expected no more than {f'{LARGEST:g} {unit}'.strip()}, got {value}")
    return value


def integer(value: int, what: str, *, least: int) -> int:
    """Return an integer.

    Raises:
        KindError: the value is not an integer.
        InvalidValueError: the integer is below ``least``.
    """
    try:
        result = operator.index(value)
    except TypeError as error:
        raise KindError(f"{what}: expected an integer, got {shown(value)}") from error
    if isinstance(value, bool):
        raise KindError(f"{what}: expected an integer, got {value}")
    if result < least:
        raise InvalidValueError(f"{what}: expected an integer of at least {least}, got {result}")
    return result


def finite_or_none(value: float) -> float | None:
    """Return a number as JSON holds it: None where it is infinite or NaN."""
    return float(value) if math.isfinite(value) else None


def evenly_spread(count: int, most: int, what: str = "most") -> Numbers:
    """Return numbers of rows, at most so many of ``count``, evenly spread, the first and the last among them.

    Args:
        count: of the rows.
        most: how many numbers at most, 2 at least.
        what: name of ``most`` in a message.

    Raises:
        KindError: ``most`` is not an integer.
        InvalidValueError: it is below 2.
    """
    return np.linspace(0, count - 1, min(count, integer(most, what, least=2))).round().astype(np.intp)


def of_shape(value: ArrayLike, shape: tuple[int, ...], what: str, largest: float = _ANY) -> Array:
    """Return a read-only float64 copy of ``value``, whose last axes must have ``shape``; see ``floats``.

    Raises:
        KindError: the value is not real numbers.
        ShapeError: the last axes are not ``shape``.
        InvalidValueError: a number is NaN or infinite.
    """
    array = floats(value, what, largest)
    if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
        raise ShapeError(f"{what}: expected a shape ending in {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


def exact_shape(value: ArrayLike, shape: tuple[int, ...], what: str, largest: float = _ANY) -> Array:
    """Return a read-only float64 copy of ``value``, which must have ``shape``; see ``floats``.

    Raises:
        KindError: the value is not real numbers.
        ShapeError: the shape is another.
        InvalidValueError: a number is NaN or infinite.
    """
    array = of_shape(value, shape, what, largest)
    if array.shape != shape:
        raise ShapeError(f"{what}: expected shape {shape}, got {array.shape}")
    return array


def joint_array(q: ArrayLike, joints: int, what: str = "q") -> Array:
    """Return ``q`` as read-only float64 of shape (..., n).

    Args:
        q: (..., n) a number per joint, with any leading axes.
        joints: n.
        what: name of the array in a message.

    Raises:
        KindError: the value is not real numbers.
        ShapeError: the last axis is not n long.
        InvalidValueError: a number is NaN, infinite, or larger than any of a robot.
    """
    array = floats(q, what, LARGEST)
    if array.ndim == 0 or array.shape[-1] != joints:
        raise ShapeError(f"{what}: expected {joints} numbers on the last axis, one per joint, got shape {array.shape}")
    array.setflags(write=False)
    return array


def one_per_joint(q: ArrayLike, joints: int, what: str = "q") -> Array:
    """Return ``q`` as read-only float64 of shape (n,); see ``joint_array``.

    Raises:
        ShapeError: the shape is another.
    """
    array = joint_array(q, joints, what)
    if array.ndim != 1:
        raise ShapeError(f"{what}: expected shape ({joints},), got {array.shape}")
    return array


def one_or_each(value: ArrayLike, count: int, what: str, of: str, largest: float = LARGEST) -> Array:
    """Return ``count`` numbers (count,), one for each ``of``; a single number stands for all of them.

    Raises:
        KindError: the value is not real numbers.
        ShapeError: it is neither one number nor (count,).
        InvalidValueError: a number is NaN or larger than ``largest``.
    """
    array = floats(value, what, largest)
    if array.shape not in ((), (count,)):
        raise ShapeError(f"{what}: expected one number, or {count}, one per {of}, got shape {array.shape}")
    return np.array(np.broadcast_to(array, (count,)))


def broadcast_rows(title: str, *arrays: Array) -> list[Array]:
    """Return arrays (..., k), each with its own k, broadcast to the same leading axes.

    Raises:
        ShapeError: the leading axes do not broadcast together; the message begins with ``title``.
    """
    lead = leading_axes(title, arrays, [array.shape[:-1] for array in arrays])
    return [np.broadcast_to(array, (*lead, array.shape[-1])) for array in arrays]


def leading_axes(title: str, arrays: Sequence[Array], leads: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    """Return the shape to which the leading axes ``leads`` of arrays broadcast.

    Raises:
        ShapeError: they do not broadcast together; the message begins with ``title`` and has the shapes of the arrays.
    """
    try:
        return np.broadcast_shapes(*leads)
    except ValueError as error:
        got = ", ".join(str(array.shape) for array in arrays)
        raise ShapeError(f"{title}: leading axes must broadcast together, got {got}") from error


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a read-only copy: the converter of fields of results, which need no check."""
    copy = np.array(array)
    copy.setflags(write=False)
    return copy


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_core() -> AbstractContextManager[Any]:
    """Restrict linear algebra to a single core, which is faster for small matrices.

    This needs threadpoolctl, which comes with scikit-learn; without it nothing changes.
    """
    try:
        from threadpoolctl import threadpool_limits  # noqa: PLC0415 - not part of the core
    except ImportError:
        return nullcontext()
    limits: AbstractContextManager[Any] = threadpool_limits(1)
    return limits


def array_key(array: Array) -> tuple[tuple[int, ...], bytes]:
    """Return a key by which equal arrays compare and hash as equal."""
    return array.shape, (array + 0.0).tobytes()  # -0.0 + 0.0 is 0.0


def reduce_by_fields(value: Any) -> tuple[Callable[..., Any], tuple[type, Mapping[str, Any]]]:
    """Reduce a value of an attrs class to its fields for ``copy`` and ``pickle``: its ``__reduce__``.

    NumPy makes copies of read-only arrays writable; a value that is rebuilt from its fields has read-only arrays.
    """
    return _built, (type(value), {field.alias: getattr(value, field.name) for field in attrs.fields(type(value))})


def _built(kind: Callable[..., Any], fields: Mapping[str, Any]) -> Any:
    return kind(**fields)


def _plain(value: ArrayLike, what: str) -> Array:
    """Return real numbers of any kind as float64."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise InvalidValueError(f"{what}: masked entries have no value; fill them or remove them")
    try:
        array = np.array(value, order="C")  # the memory layout must not affect results
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{what}: expected numbers in rows of one length, got {shown(value)}") from error
    if array.dtype == np.float64:
        return array
    if array.dtype.kind not in "fiu" and not (array.dtype == object and all(map(_is_real, array.flat))):
        raise KindError(f"{what}: expected numbers, got {shown(value)}")
    try:
        with np.errstate(over="ignore"):  # infinite numbers are refused
            return array.astype(np.float64)
    except (OverflowError, TypeError, ValueError) as error:
        raise InvalidValueError(f"{what}: expected numbers no larger than {_ANY:.3g}, got {shown(value)}") from error


def _is_real(entry: object) -> bool:
    """Whether an object is a real number, such as a fraction, and not a boolean."""
    return type(entry) is float or (isinstance(entry, Real | Decimal) and not isinstance(entry, bool))
