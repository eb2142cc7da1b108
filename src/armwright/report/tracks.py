"""Converters of arrays over time, which check that there is a row per instant."""

from collections.abc import Mapping

from armwright.arrays import Array, ArrayLike, of_shape
from armwright.errors import InvalidValueError, ShapeError


def instants(value: ArrayLike) -> Array:
    """Return read-only instants [s], (N,).

    Raises:
        ShapeError: there is more than one axis.
        InvalidValueError: an instant is earlier than the previous one.
    """
    array = _track(value, "instants")
    if (array[1:] < array[:-1]).any():
        raise InvalidValueError("instants: expected each at or after the previous one")
    return array


def numbers(value: ArrayLike) -> Array:
    """Return a number per instant or segment, (N,)."""
    return _track(value, "numbers")


def per_joint(value: ArrayLike) -> Array:
    """Return a number per joint, (N, n)."""
    return _track(value, "joint quantities", 0)


def path(value: ArrayLike) -> Array:
    """Return positions, (N, 3) [m]."""
    return _track(value, "path", 3)


def skeleton(value: ArrayLike) -> Array:
    """Return K positions, (N, K, 3) [m]."""
    return _track(value, "skeleton", 0, 3)


def axes(value: ArrayLike) -> Array:
    """Return points and directions of joint axes, (N, n, 6)."""
    return _track(value, "joint axes", 0, 6)


def rotations(value: ArrayLike) -> Array:
    """Return columns n, o, a, (N, 9)."""
    return _track(value, "hand axes", 9)


def poses(value: ArrayLike) -> Array:
    """Return columns n, o, a, p, (N, 12)."""
    return _track(value, "frame poses", 12)


def check_rows(owner: str, rows: int, tracks: Mapping[str, Array | None]) -> None:
    """Refuse tracks that do not have a row per instant.

    Raises:
        ShapeError: a track is longer or shorter than ``rows``.
    """
    for what, track in tracks.items():
        if track is not None and len(track) != rows:
            raise ShapeError(f"{owner}: {rows} instants but {len(track)} rows of {what}")


def _track(value: ArrayLike, what: str, *row: int) -> Array:
    """Return read-only rows, (N, *row); a 0 in ``row`` stands for any length."""
    array = of_shape(value, (), what)
    if array.ndim != 1 + len(row) or any(want not in (0, got) for want, got in zip(row, array.shape[1:], strict=True)):
        shown = ", ".join(("N", *(str(length or "any") for length in row)))
        raise ShapeError(f"{what}: expected shape ({shown}), one row per instant, got {array.shape}")
    return array
