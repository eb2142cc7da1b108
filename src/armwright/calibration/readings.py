"""Readings of an arm: points, poses, planes that were touched, distances.

A reading is a joint configuration and what was measured in it: the position of the tool, or its pose; contact with a
plane; or the distance from a fixed anchor, or from the position of the tool in another configuration. Points may refer
to several frames, such as those of a board that was set up three times; the poses of these frames are estimated too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, ArrayLike, Flags, exact_shape, floats, read_only
from armwright.errors import InvalidValueError, ShapeError
from armwright.spatial.rotations import orthonormality_error

# What is measured in each reading, and its labels, whose names are in the plural.
_MEASURED, _LABELS = ("q", "points", "rotations", "distances", "other", "payload"), ("frame", "plane", "anchor")
Numbers: TypeAlias = npt.NDArray[np.intp]

# Rotations that are written with four digits.
_ROTATION_TOLERANCE = 1e-3


def _nan_or_read_only(array: Array) -> Array:
    """Return a read-only copy; an array of nothing but NaN shares a single NaN in memory."""
    return np.broadcast_to(np.nan, array.shape) if np.isnan(array).all() else read_only(array)


@attrs.frozen(kw_only=True, eq=False)
class Readings:
    """Measurements of an arm of n joints, m of them. What was not measured is NaN, or -1.

    Attributes:
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) positions of the tool [m].
        rotations: (m, 3, 3) its rotations.
        frame: (m,) number of the frame of these; the first is that of the measurements.
        plane: (m,) number of the plane that was touched.
        distances: (m,) from an anchor, or from the tool in another configuration [m].
        anchor: (m,) number of the anchor.
        other: (m, n) the other configuration [rad] or [m].
        payload: (m, 4) mass and centre of mass, in the frame of the tool, of what the tool held [kg], [m].
        frames: names of the frames.
        planes: names of the planes.
        anchors: names of the anchors.
    """

    q: Array = attrs.field(converter=read_only)
    points: Array = attrs.field(converter=_nan_or_read_only)
    rotations: Array = attrs.field(converter=_nan_or_read_only)
    frame: Numbers = attrs.field(converter=read_only)
    plane: Numbers = attrs.field(converter=read_only)
    distances: Array = attrs.field(converter=_nan_or_read_only)
    anchor: Numbers = attrs.field(converter=read_only)
    other: Array = attrs.field(converter=_nan_or_read_only)
    payload: Array = attrs.field(converter=read_only)
    frames: tuple[str, ...] = ()
    planes: tuple[str, ...] = ()
    anchors: tuple[str, ...] = ()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.q)

    def take(self, which: Flags | Numbers) -> Readings:
        """Return some of them."""
        return attrs.evolve(self, **{key: getattr(self, key)[which] for key in (*_MEASURED, *_LABELS)})

    @property
    def with_point(self) -> Flags:
        """(m,) which have a point."""
        return np.isfinite(self.points[:, 0])

    @property
    def with_rotation(self) -> Flags:
        """(m,) which have a rotation."""
        return np.isfinite(self.rotations[:, 0, 0])


def readings(
    q: ArrayLike,
    points: ArrayLike | None = None,
    *,
    frame: ArrayLike | None = None,
    plane: ArrayLike | None = None,
    distances: ArrayLike | None = None,
    anchor: ArrayLike | None = None,
    other: ArrayLike | None = None,
    payload: ArrayLike | None = None,
) -> Readings:
    """Return readings of one kind, one for each joint configuration; ``concatenate`` joins those of several kinds.

    Args:
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) positions of the tool [m], or (m, 4, 4) its poses.
        frame: (m,) names of the frames of these; one frame for all when left out.
        plane: (m,) names of the planes that the tool touched.
        distances: (m,) of the tool from an anchor, or from the tool in another configuration [m].
        anchor: (m,) names of the anchors.
        other: (m, n) the other configurations [rad] or [m].
        payload: (4,) or (m, 4) mass and centre of mass, in the frame of the tool, of what the tool held [kg], [m];
            nothing when left out.

    Raises:
        ShapeError: they are not as many.
        InvalidValueError: nothing was measured, or a distance from nothing; a pose has no rotation in it.
    """
    configurations = np.atleast_2d(floats(q, "q"))
    m, n = configurations.shape
    positions, rotations = np.full((m, 3), np.nan), np.full((m, 3, 3), np.nan)
    lengths, others = np.full(m, np.nan), np.full((m, n), np.nan)
    if points is not None:
        measured = floats(points, "points")
        measured = measured[None] if measured.shape in {(3,), (4, 4)} else measured
        if measured.shape not in {(m, 3), (m, 4, 4)}:
            expected = f"({m}, 3) points or ({m}, 4, 4) poses for as many q"
            raise ShapeError(f"points: expected {expected}, got {measured.shape}")
        positions = measured[:, :3, 3] if measured.ndim == 3 else measured
        if measured.ndim == 3:
            _check_poses(measured)
            rotations = measured[:, :3, :3]
    if points is None and plane is None and distances is None:
        raise InvalidValueError("expected points, poses, planes or distances, got none of them")
    if (distances is None) != (anchor is None and other is None) or None not in (anchor, other):
        expected = "an anchor or another configuration for each, and distances for these"
        raise InvalidValueError(f"distances: expected {expected}")
    if distances is not None:
        lengths = exact_shape(distances, (m,), "distances")
    if other is not None:
        others = exact_shape(np.atleast_2d(floats(other, "other")), (m, n), "other")
    frames = [""] * m if frame is None and points is not None else _label_list(frame, m, "frame")
    labels = number_labels(frame=frames, plane=_label_list(plane, m, "plane"), anchor=_label_list(anchor, m, "anchor"))
    held = np.zeros(4) if payload is None else floats(payload, "payload")
    if held.shape not in {(4,), (m, 4)}:
        raise ShapeError(f"payload: expected shape (4,) or ({m}, 4), got {held.shape}")
    return Readings(
        q=configurations,
        points=positions,
        rotations=rotations,
        distances=lengths,
        other=others,
        payload=np.broadcast_to(held, (m, 4)),
        **labels,
    )


def number_labels(**labels: Sequence[str | None]) -> dict[str, Any]:
    """Return by key the numbers (m,) of labels, -1 for none, and by its plural the different labels in order."""
    columns: dict[str, Any] = {}
    for key, words in labels.items():
        order = {word: i for i, word in enumerate(dict.fromkeys(word for word in words if word is not None))}
        columns[key] = np.array([-1 if word is None else order[word] for word in words], dtype=np.intp)
        columns[f"{key}s"] = tuple(order)
    return columns


def concatenate(*parts: Readings) -> Readings:
    """Return the readings of several parts as one. Frames, planes and anchors of one name are the same.

    Raises:
        ShapeError: they are of arms with different numbers of joints.
    """
    joints = sorted({part.q.shape[1] for part in parts})
    if len(joints) != 1:
        raise ShapeError(f"readings of arms with {joints} joints are not of one arm")
    columns: dict[str, Any] = {key: np.concatenate([getattr(part, key) for part in parts]) for key in _MEASURED}
    for key in _LABELS:
        names = tuple(dict.fromkeys(name for part in parts for name in getattr(part, f"{key}s")))
        columns[key] = np.concatenate([_renumber(getattr(x, key), getattr(x, f"{key}s"), names) for x in parts])
        columns[f"{key}s"] = names
    return Readings(**columns)


def refuse_unlocated(fitted: Readings, others: Readings) -> None:
    """Refuse readings whose frame, plane or anchor is that of no fitted reading: its pose is not estimated.

    Raises:
        InvalidValueError: there are some.
    """
    for what in _LABELS:
        numbers, names = getattr(others, what), getattr(others, f"{what}s")
        unknown = sorted(set(numbers.tolist()) - set(getattr(fitted, what).tolist()) - {-1})
        if unknown:
            raise InvalidValueError(
                f"{what} {names[unknown[0]]}: no fitted reading locates it, so that the "
                f"{int((numbers == unknown[0]).sum())} other readings with it cannot be compared with the arm"
            )


def _check_poses(poses: Array) -> None:
    """Refuse matrices (m, 4, 4) that are no poses: a rotation that is mirrored, scaled, or not one at all."""
    error = orthonormality_error(poses[:, :3, :3]) + np.abs(poses[:, 3] - (0, 0, 0, 1)).max(axis=1)
    worst = int(np.argmax(error)) if len(error) else 0
    if len(error) and error[worst] > _ROTATION_TOLERANCE:
        got = f"{poses[worst].tolist()} as number {worst + 1}"
        raise InvalidValueError(f"points: expected a rotation, a position and the row 0 0 0 1 in every pose, got {got}")


def _label_list(names: ArrayLike | None, m: int, what: str) -> list[str | None]:
    """Return the label of each of m readings; None where the readings have none."""
    labels = [None] * m if names is None else [str(name) for name in np.atleast_1d(np.asarray(names))]
    if len(labels) != m:
        raise ShapeError(f"{what}: expected {m} names for as many q, got {len(labels)}")
    return [*labels]


def _renumber(numbers: Numbers, names: tuple[str, ...], order: tuple[str, ...]) -> Numbers:
    """Return numbers of names as numbers in another order; -1 stays."""
    table = np.array([*(order.index(name) for name in names), -1], dtype=np.intp)
    return np.asarray(table[numbers], dtype=np.intp)
