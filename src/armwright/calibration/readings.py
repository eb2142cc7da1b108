"""What was measured of an arm: points, poses, planes that were touched, distances.

A reading is a joint configuration and what was measured in it: the position of the tool, or its pose; contact with a
plane; or the distance from a fixed anchor, or from the position of the tool in another configuration. Points may refer
to several frames, such as those of a board that was set up three times; the poses of these frames are estimated too.
"""

from __future__ import annotations

from typing import TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, ArrayLike, Flags, floats, read_only
from armwright.errors import InvalidValueError, ShapeError
from armwright.spatial.rotations import orthonormality_error

Numbers: TypeAlias = npt.NDArray[np.intp]

# Rotations that are written with four digits.
_WRITTEN = 1e-3


def _no_numbers(m: int, *shape: int) -> Array:
    return np.full((m, *shape), np.nan)


def _told(array: Array) -> Array:
    """Return a copy that cannot be written to; of what no reading tells there is one NaN, which takes no room."""
    return np.broadcast_to(np.nan, array.shape) if np.isnan(array).all() else read_only(array)


@attrs.frozen(kw_only=True, eq=False)
class Readings:
    """Measurements of an arm of n joints, m of them. What a reading does not tell is NaN, or -1.

    Attributes:
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) where the tool was [m].
        rotations: (m, 3, 3) how it was turned.
        frame: (m,) number of the frame in which that is told; the first is that of the measurements.
        plane: (m,) number of the plane that was touched.
        distances: (m,) from an anchor, or from where the tool was in another configuration [m].
        anchor: (m,) number of the anchor.
        other: (m, n) the other configuration [rad] or [m].
        frames: names of the frames.
        planes: names of the planes.
        anchors: names of the anchors.
    """

    q: Array = attrs.field(converter=read_only)
    points: Array = attrs.field(converter=_told)
    rotations: Array = attrs.field(converter=_told)
    frame: Numbers = attrs.field(converter=read_only)
    plane: Numbers = attrs.field(converter=read_only)
    distances: Array = attrs.field(converter=_told)
    anchor: Numbers = attrs.field(converter=read_only)
    other: Array = attrs.field(converter=_told)
    frames: tuple[str, ...] = ()
    planes: tuple[str, ...] = ()
    anchors: tuple[str, ...] = ()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.q)

    def take(self, which: Flags | Numbers) -> Readings:
        """Return some of them."""
        rows = {
            key: getattr(self, key)[which]
            for key in ("q", "points", "rotations", "frame", "plane", "distances", "anchor", "other")
        }
        return attrs.evolve(self, **rows)

    @property
    def with_point(self) -> Flags:
        """(m,) which tell a point."""
        return np.isfinite(self.points[:, 0])

    @property
    def with_rotation(self) -> Flags:
        """(m,) which tell a rotation."""
        return np.isfinite(self.rotations[:, 0, 0])

    @property
    def with_distance(self) -> Flags:
        """(m,) which tell a distance."""
        return np.isfinite(self.distances)


def readings(
    q: ArrayLike,
    points: ArrayLike | None = None,
    *,
    frame: ArrayLike | None = None,
    plane: ArrayLike | None = None,
    distances: ArrayLike | None = None,
    anchor: ArrayLike | None = None,
    other: ArrayLike | None = None,
) -> Readings:
    """Return readings, one for each posture, that all tell the same kind of thing; ``together`` joins several.

    Args:
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) where the tool was [m], or (m, 4, 4) how it stood.
        frame: (m,) names of the frames in which that is told; one frame for all when left out.
        plane: (m,) names of the planes that the tool touched.
        distances: (m,) how far the tool was from an anchor or another configuration [m].
        anchor: (m,) names of the anchors.
        other: (m, n) the other configurations [rad] or [m].

    Raises:
        ShapeError: they are not as many.
        InvalidValueError: nothing was measured, or a distance from nothing; a pose has no rotation in it.
    """
    places = np.atleast_2d(floats(q, "q"))
    m, n = places.shape
    seen, turned = _no_numbers(m, 3), _no_numbers(m, 3, 3)
    if points is not None:
        given = floats(points, "points")
        given = given[None] if given.shape in {(3,), (4, 4)} else given
        if given.shape == (m, 4, 4):
            seen, turned = given[:, :3, 3], given[:, :3, :3]
            _refuse_no_poses(given)
        elif given.shape == (m, 3):
            seen = given
        else:
            raise ShapeError(f"points: expected ({m}, 3) points or ({m}, 4, 4) poses for as many q, got {given.shape}")
    away = _no_numbers(m) if distances is None else _as_many(floats(distances, "distances"), (m,), "distances")
    if points is None and plane is None and distances is None:
        raise InvalidValueError("expected points, poses, planes or distances, got none of them")
    if (distances is not None) != ((anchor is not None) or (other is not None)) or None not in (anchor, other):
        raise InvalidValueError("distances: tell from which anchor they are, or from which other configuration")
    in_frame, frames = _numbered([""] * m if frame is None and points is not None else frame, m, "frame")
    on_plane, planes = _numbered(plane, m, "plane")
    from_anchor, anchors = _numbered(anchor, m, "anchor")
    return Readings(
        q=places,
        points=seen,
        rotations=turned,
        frame=in_frame,
        plane=on_plane,
        distances=away,
        anchor=from_anchor,
        other=_no_numbers(m, n) if other is None else _as_many(np.atleast_2d(floats(other, "other")), (m, n), "other"),
        frames=frames,
        planes=planes,
        anchors=anchors,
    )


def concatenate(*parts: Readings) -> Readings:
    """Return the readings of several parts as one. Frames, planes and anchors of one name are the same.

    Raises:
        ShapeError: they are of arms with different numbers of joints.
    """
    if len({part.q.shape[1] for part in parts}) != 1:
        raise ShapeError(
            f"readings of arms with {sorted({part.q.shape[1] for part in parts})} joints are not of one arm"
        )

    def joined(key: str) -> Array:
        return np.concatenate([getattr(part, key) for part in parts])

    def renumbered(key: str, many: str) -> tuple[Numbers, tuple[str, ...]]:
        names = tuple(dict.fromkeys(name for part in parts for name in getattr(part, many)))
        return np.concatenate([_placed(getattr(part, key), getattr(part, many), names) for part in parts]), names

    (frame, frames), (plane, planes), (anchor, anchors) = (
        renumbered(key, many) for key, many in (("frame", "frames"), ("plane", "planes"), ("anchor", "anchors"))
    )
    return Readings(
        q=joined("q"),
        points=joined("points"),
        rotations=joined("rotations"),
        frame=frame,
        plane=plane,
        distances=joined("distances"),
        anchor=anchor,
        other=joined("other"),
        frames=frames,
        planes=planes,
        anchors=anchors,
    )


def refuse_not_fitted(fitted: Readings, others: Readings) -> None:
    """Refuse readings whose frame, plane or anchor no reading tells that is fitted: nothing says where it is.

    Raises:
        InvalidValueError: there are some.
    """
    for what, names in (("frame", others.frames), ("plane", others.planes), ("anchor", others.anchors)):
        unknown = sorted(set(getattr(others, what).tolist()) - set(getattr(fitted, what).tolist()) - {-1})
        if unknown:
            raise InvalidValueError(
                f"{what} {names[unknown[0]]}: no reading that is fitted tells where it is, so that the "
                f"{int((getattr(others, what) == unknown[0]).sum())} others in it cannot be held against the arm"
            )


def _refuse_no_poses(given: Array) -> None:
    """Refuse matrices (m, 4, 4) that are no poses: a rotation that is mirrored, scaled, or not one at all."""
    error = orthonormality_error(given[:, :3, :3]) + np.abs(given[:, 3] - (0, 0, 0, 1)).max(axis=1)
    worst = int(np.argmax(error)) if len(error) else 0
    if len(error) and error[worst] > _WRITTEN:
        raise InvalidValueError(
            f"points: expected a rotation, a position and the row 0 0 0 1 in every pose, got {given[worst].tolist()} "
            f"as number {worst + 1}"
        )


def _numbered(names: ArrayLike | None, m: int, what: str) -> tuple[Numbers, tuple[str, ...]]:
    """Return by number which of some names each reading has."""
    if names is None:
        return np.full(m, -1), ()
    given = [str(name) for name in np.atleast_1d(np.asarray(names))]
    if len(given) != m:
        raise ShapeError(f"{what}: expected {m} names for as many q, got {len(given)}")
    order = tuple(dict.fromkeys(given))
    return np.array([order.index(name) for name in given], dtype=np.intp), order


def _placed(numbers: Numbers, names: tuple[str, ...], order: tuple[str, ...]) -> Numbers:
    """Return numbers of names as numbers in another order; -1 stays."""
    table = np.array([*(order.index(name) for name in names), -1], dtype=np.intp)
    return np.asarray(table[numbers], dtype=np.intp)


def _as_many(value: Array, shape: tuple[int, ...], what: str) -> Array:
    if value.shape != shape:
        raise ShapeError(f"{what}: expected {shape} for as many q, got {value.shape}")
    return value
