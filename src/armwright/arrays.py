"""Arrays at the door: named converters that check shape and meaning, copy to float64 and make read-only."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.errors import InvalidValueError, ShapeError

Array: TypeAlias = npt.NDArray[np.float64]
ArrayLike: TypeAlias = npt.ArrayLike


def floats(value: ArrayLike, what: str) -> Array:
    """Return a fresh float64 copy of ``value``.

    Raises:
        ShapeError: the value is not an array of numbers.
        InvalidValueError: a number is NaN or infinite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{what}: expected numbers, got {value!r}") from error
    if not np.isfinite(array).all():
        raise InvalidValueError(f"{what}: every number must be finite, got {array[~np.isfinite(array)].flat[0]}")
    return array


def of_shape(value: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    """Return a read-only float64 copy of ``value``, whose last axes must have ``shape``.

    Raises:
        ShapeError: the last axes are not as asked.
    """
    array = floats(value, what)
    if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
        raise ShapeError(f"{what}: expected a shape ending in {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


def exactly(value: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    """Return a read-only float64 copy of ``value``, which must have ``shape``.

    Raises:
        ShapeError: it has another.
    """
    array = of_shape(value, shape, what)
    if array.shape != shape:
        raise ShapeError(f"{what}: expected shape {shape}, got {array.shape}")
    return array


def joint_array(q: ArrayLike, joints: int, what: str = "q") -> Array:
    """Return ``q`` as read-only float64 of shape (..., n).

    Args:
        q: (..., n) one number per joint, leading axes free.
        joints: n.
        what: how the array is called in a message.

    Raises:
        ShapeError: the last axis is not n long.
        InvalidValueError: a number is NaN or infinite.
    """
    array = floats(q, what)
    if array.ndim == 0 or array.shape[-1] != joints:
        raise ShapeError(f"{what}: expected {joints} numbers on the last axis, one per joint, got shape {array.shape}")
    array.setflags(write=False)
    return array
