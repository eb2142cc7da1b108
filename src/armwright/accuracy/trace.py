"""Measured positions and traces: checked, copied and read-only."""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, floats, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, ShapeError

# Three angles have names; a measurement may hold fewer.
ANGLES = ("a", "b", "c")


def as_positions(value: ArrayLike, what: str = "positions") -> Array:
    """Return measured positions as read-only float64.

    Args:
        value: (n, 2) in a plane or (n, 3) in space [m].
        what: how they are called in a message.

    Raises:
        KindError: the value is something else than real numbers.
        ShapeError: it is no table of two or three columns, or has no rows.
        InvalidValueError: a number is NaN, infinite, or larger than any of a robot.
    """
    array = floats(value, what, LARGEST)
    if array.ndim != 2 or array.shape[1] not in {2, 3} or not len(array):
        raise ShapeError(f"{what}: expected shape (n, 2) in a plane or (n, 3) in space, got {array.shape}")
    return read_only(array)


def as_position(value: ArrayLike, size: int, what: str = "commanded position") -> Array:
    """Return one position of ``size`` numbers [m].

    Raises:
        ShapeError: it has another shape.
    """
    array = floats(value, what, LARGEST)
    if array.shape != (size,):
        raise ShapeError(f"{what}: expected {size} numbers, as for the measured positions, got shape {array.shape}")
    return read_only(array)


def as_angles(value: ArrayLike | None, rows: int, what: str = "angles") -> Array:
    """Return measured angles as read-only float64 (n, k) [rad], k from 0 to 3; none where there is nothing.

    Raises:
        ShapeError: they are not one row per position, or more than three.
    """
    array = np.empty((rows, 0)) if value is None else floats(value, what, LARGEST)
    if array.ndim != 2 or len(array) != rows or array.shape[1] > len(ANGLES):
        raise ShapeError(f"{what}: expected shape ({rows}, k) with k up to 3, one row per position, got {array.shape}")
    return read_only(array)


def as_commanded_angles(value: ArrayLike | None, count: int) -> Array:
    """Return the commanded angles (k,) of a pose [rad]; none where there is nothing.

    Raises:
        ShapeError: they are not ``count``, the number of measured angles.
    """
    angles = np.empty(0) if value is None else floats(value, "commanded angles")
    if angles.shape != (count,):
        raise ShapeError(f"commanded angles: expected {count} numbers, as many as were measured, got {angles.shape}")
    return angles


def refuse_mixed_dimensions(parts: Sequence[Array], what: str) -> None:
    """Refuse parts of a test that have different numbers of columns.

    Raises:
        ShapeError: they have.
    """
    sizes = sorted({part.shape[1] for part in parts})
    if len(sizes) > 1:
        raise ShapeError(f"{what}: all parts of a test must have the same columns, got {' and '.join(map(str, sizes))}")


def _trace_positions(value: ArrayLike) -> Array:
    return as_positions(value, "trace: positions")


def _trace_angles(value: ArrayLike) -> Array:
    return read_only(floats(value, "trace: angles", LARGEST))


def _trace_times(value: ArrayLike) -> Array:
    t = floats(value, "trace: times", LARGEST)
    if t.ndim != 1:
        raise ShapeError(f"trace: times: expected shape (n,), got {t.shape}")
    later = np.diff(t) > 0
    if not later.all():
        before, after = t[int(np.argmin(later)) :][:2]
        raise InvalidValueError(f"trace: times: each must be later than the one before, got {after:g} after {before:g}")
    return read_only(t)


@attrs.frozen(kw_only=True, eq=False)
class Trace:
    """One measured run, sample by sample, or a commanded path, corner by corner.

    Attributes:
        positions: (n, 2) or (n, 3) [m], two of them at least.
        times: (n,) rising [s]; None where the measure needs none.
        angles: (n, k) about a, b, c [rad], k from 1 to 3; None where none were measured.
    """

    positions: Array = attrs.field(converter=_trace_positions)
    times: Array | None = attrs.field(default=None, converter=attrs.converters.optional(_trace_times))
    angles: Array | None = attrs.field(default=None, converter=attrs.converters.optional(_trace_angles))

    def __attrs_post_init__(self) -> None:
        """Refuse times and angles that do not have one row per sample."""
        rows = len(self.positions)
        if rows < 2:
            raise ShapeError(f"trace: expected at least two samples, got {rows}")
        if self.times is not None and len(self.times) != rows:
            raise ShapeError(f"trace: {rows} positions but {len(self.times)} times")
        as_angles(self.angles, rows, "trace: angles")

    __reduce__ = reduce_by_fields

    @property
    def size(self) -> int:
        """2 in a plane, 3 in space."""
        return int(self.positions.shape[1])

    def timed(self, what: str) -> Array:
        """Return the times (n,) [s].

        Raises:
            InvalidValueError: there are none.
        """
        if self.times is None:
            raise InvalidValueError(f"{what}: this measure needs the time of every sample")
        return self.times


def unwrap_angles(angles: Array | None, rows: int) -> Array:
    """Return angles (n, k) along a trace without jumps of a revolution, so that they can be interpolated."""
    return np.empty((rows, 0)) if angles is None else np.asarray(np.unwrap(angles, axis=0))


def frozen_array(value: ArrayLike) -> Array:
    """Return a read-only copy: the converter of fields of results."""
    return read_only(np.asarray(value, dtype=np.float64))
