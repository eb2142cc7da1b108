"""The measurement model: residuals of readings and their Jacobian by the unknown errors of arm and setup.

Beside the errors of the arm, the setup has unknowns: six for each further frame, a shift and two tilts for each plane
that was touched, and three coordinates for each anchor.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, Flags
from armwright.calibration.chain import Chain, ToolPoses
from armwright.calibration.readings import Numbers, Readings
from armwright.errors import ShapeError
from armwright.spatial.rotations import rotation_vector

_FRAME_ERRORS = ("x", "y", "z", "rx", "ry", "rz")
_PLANE_ERRORS = ("z", "rx", "ry")


class Plane(NamedTuple):
    """The approximate position and orientation of a plane in the measuring frame.

    Attributes:
        point: (3,) a point of it [m].
        axes: (3, 3) a frame, in columns, whose third axis is normal to it.
    """

    point: Array
    axes: Array


class Residuals(NamedTuple):
    """Residuals of readings: the value of the model minus the measured value, one row for each number.

    Attributes:
        values: (r,) lengths [m] or small rotations [rad].
        jacobian: (r, k) derivative by the k errors.
        reading: (r,) number of the reading.
        is_rotation: (r,) which are rotations.
    """

    values: Array
    jacobian: Array
    reading: Numbers
    is_rotation: Flags


class PoseError(NamedTuple):
    """The size of the residuals of each reading.

    Attributes:
        distance: (m,) norm of the residuals that are lengths [m].
        angle: (m,) of the residual rotation [rad]; NaN for readings without a rotation.
    """

    distance: Array
    angle: Array


@attrs.frozen(kw_only=True, eq=False)
class MeasurementModel:
    """An arm with errors, and the setup that it was measured in.

    Attributes:
        chain: the arm.
        frames: by name the (4, 4) approximate pose of each frame in the measuring frame; the first is that frame.
        planes: that were touched, by name.
        anchors: by name the (3,) approximate position of each anchor in the measuring frame [m].
    """

    chain: Chain
    frames: Mapping[str, Array] = attrs.field(factory=lambda: {"": np.eye(4)})
    planes: Mapping[str, Plane] = attrs.field(factory=dict)
    anchors: Mapping[str, Array] = attrs.field(factory=dict)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The errors, in order: those of the arm come first."""
        return (
            *self.chain.names,
            *(f"frame.{name}.{part}" for name in [*self.frames][1:] for part in _FRAME_ERRORS),
            *(f"plane.{name}.{part}" for name in self.planes for part in _PLANE_ERRORS),
            *(f"anchor.{name}.{part}" for name in self.anchors for part in "xyz"),
        )

    @property
    def is_length(self) -> Array:
        """(k,) whether each error is a length, not an angle."""
        setup = [not name.rpartition(".")[2].startswith("r") for name in self.names[len(self.chain.names) :]]
        return np.array([*self.chain.is_length, *setup], dtype=np.bool_)

    def residuals(self, readings: Readings, errors: ArrayLike | None = None) -> Residuals:
        """Return the residuals of readings and their Jacobian.

        Args:
            readings: m of them.
            errors: (k,) of arm and setup; zero when left out.

        Raises:
            ShapeError: there are not as many errors.
        """
        x = np.zeros(len(self.names)) if errors is None else np.asarray(errors, dtype=np.float64)
        if x.shape != (len(self.names),):
            raise ShapeError(f"errors: expected {len(self.names)} of them, got shape {x.shape}")
        tool = self.chain.forward(readings.q, x[: len(self.chain.names)], payload=readings.payload)
        parts = [
            *self._pose_residuals(readings, tool, x),
            *self._plane_residuals(readings, tool, x),
            *self._anchor_residuals(readings, tool, x),
            *self._displacement_residuals(readings, tool, x),
        ]
        return Residuals(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def pose_errors(self, readings: Readings, errors: ArrayLike | None = None) -> PoseError:
        """Return the size of the residuals of each reading."""
        residuals = self.residuals(readings, errors)
        square = residuals.values**2
        distance, chord = (
            np.sqrt(np.bincount(residuals.reading[rows], square[rows], len(readings)))
            for rows in (~residuals.is_rotation, residuals.is_rotation)
        )
        # The residuals of a rotation are twice the sine of half its angle, along three axes.
        angle = 2 * np.arcsin(np.minimum(chord / 2, 1.0))
        return PoseError(distance, np.where(readings.with_rotation, angle, np.nan))

    # ---- one kind of reading each --------------------------------------------------------------------------------

    def _pose_residuals(self, readings: Readings, tool: ToolPoses, x: Array) -> Iterator[Residuals]:
        """Give the residuals of points and rotations, frame by frame."""
        for i, X in enumerate(self.frames.values()):
            first = len(self.chain.names) + 6 * (i - 1)
            rows = np.flatnonzero(readings.with_point & (readings.frame == i))
            R, origin, axes = _displace_frame(X, x[first : first + 6] if i else np.zeros(6))
            measured = readings.points[rows] @ R.T + origin
            J = tool.position_jacobian[rows]
            levers = np.concatenate(
                [np.tile(X[:3, :3], (len(rows), 1, 1)), np.cross(axes.T, (measured - origin)[:, None]).swapaxes(1, 2)],
                axis=2,
            )
            yield self._residuals(rows, tool.position[rows] - measured, J, first, -levers if i else None)
            rows = rows[readings.with_rotation[rows]]
            if len(rows):
                values, slope = _rotation_residual(tool.rotation[rows], R @ readings.rotations[rows])
                J = slope @ tool.rotation_jacobian[rows]
                setup = -slope.swapaxes(1, 2) @ np.concatenate([np.zeros((3, 3)), axes], axis=1)
                yield self._residuals(rows, values, J, first, setup if i else None, is_rotation=True)

    def _plane_residuals(self, readings: Readings, tool: ToolPoses, x: Array) -> Iterator[Residuals]:
        """Give the heights of the tool over the planes that it touched."""
        first = len(self.chain.names) + 6 * (len(self.frames) - 1)
        for i, plane in enumerate(self.planes.values()):
            rows = np.flatnonzero(readings.plane == i)
            shift, a, b = x[first : first + 3]
            # Tilted by a about its x and by b about its y, as tangents.
            local = np.array([b, -a, 1.0])
            length = np.linalg.norm(local)
            normal = plane.axes @ local / length
            offset = tool.position[rows] - plane.point
            slopes = plane.axes.T @ (np.eye(3) - np.outer(normal, normal)) / length
            setup = np.stack([-np.ones(len(rows)), -(offset @ slopes[1]), offset @ slopes[0]], axis=1)
            J = np.einsum("i,mik->mk", normal, tool.position_jacobian[rows])
            yield self._residuals(rows, offset @ normal - shift, J, first, setup)
            first += 3

    def _anchor_residuals(self, readings: Readings, tool: ToolPoses, x: Array) -> Iterator[Residuals]:
        """Give the distances from anchors."""
        first = len(self.chain.names) + 6 * (len(self.frames) - 1) + 3 * len(self.planes)
        for i, anchor in enumerate(self.anchors.values()):
            rows = np.flatnonzero(readings.anchor == i)
            distance, direction = _length_and_direction(tool.position[rows] - anchor - x[first : first + 3])
            J = np.einsum("mi,mik->mk", direction, tool.position_jacobian[rows])
            yield self._residuals(rows, distance - readings.distances[rows], J, first, -direction)
            first += 3

    def _displacement_residuals(self, readings: Readings, tool: ToolPoses, x: Array) -> Iterator[Residuals]:
        """Give the distances between the positions of the tool in two configurations."""
        rows = np.flatnonzero(np.isfinite(readings.other[:, 0]))
        if not len(rows):
            return
        other = self.chain.forward(readings.other[rows], x[: len(self.chain.names)], payload=readings.payload[rows])
        distance, direction = _length_and_direction(tool.position[rows] - other.position)
        J = np.einsum("mi,mik->mk", direction, tool.position_jacobian[rows] - other.position_jacobian)
        yield self._residuals(rows, distance - readings.distances[rows], J)

    def _residuals(
        self,
        rows: Numbers,
        values: Array,
        arm: Array,
        first: int = 0,
        setup: Array | None = None,
        *,
        is_rotation: bool = False,
    ) -> Residuals:
        """Return residuals of some readings, a number or a vector each.

        Args:
            rows: (m,) numbers of the readings.
            values: (m,) or (m, 3) their residuals.
            arm: (..., a) derivative of these by the errors of the arm.
            first: number of the first of some errors of the setup.
            setup: (..., s) derivative by these.
            is_rotation: whether they are rotations.
        """
        J = np.zeros((*values.shape, len(self.names)))
        J[..., : arm.shape[-1]] = arm
        if setup is not None:
            J[..., first : first + setup.shape[-1]] = setup
        reading = np.broadcast_to(rows.reshape(-1, *[1] * (values.ndim - 1)), values.shape)
        return Residuals(
            values.ravel(), J.reshape(-1, len(self.names)), reading.ravel(), np.full(values.size, is_rotation)
        )


def _length_and_direction(vectors: Array) -> tuple[Array, Array]:
    """Return lengths (m,) and directions (m, 3) of vectors (m, 3)."""
    length = np.linalg.norm(vectors, axis=1)
    return length, vectors / np.maximum(length, 1e-12)[:, None]


def _rotation_residual(R: Array, goals: Array) -> tuple[Array, Array]:
    """Return the residual rotation from goals to R, both (m, 3, 3), and its derivative by a small rotation of R.

    The residual (m, 3) is the axis of the rotation times twice the sine of half its angle: the rotation vector itself
    where that is small, and largest at half a turn. The derivative is (m, 3, 3); transposed and negative, it is that by
    a small rotation of the goal.
    """
    w = rotation_vector(R @ goals.swapaxes(1, 2))
    half = np.linalg.norm(w, axis=1)[:, None] / 2
    vector = w * np.sinc(half / np.pi) / 2  # of the quaternion
    x, y, z = vector.T
    c = np.cos(half[:, 0])
    slope = np.stack([c, z, -y, -z, c, x, y, -x, c], axis=1).reshape(-1, 3, 3)
    return 2 * vector, slope


def _displace_frame(X: Array, errors: Array) -> tuple[Array, Array, Array]:
    """Return rotation and origin of a frame that is displaced by six errors, and the axes of its three rotations."""
    cosine, sine = np.cos(errors[3:]), np.sin(errors[3:])
    Rx = np.array([[1, 0, 0], [0, cosine[0], -sine[0]], [0, sine[0], cosine[0]]])
    Ry = np.array([[cosine[1], 0, sine[1]], [0, 1, 0], [-sine[1], 0, cosine[1]]])
    Rz = np.array([[cosine[2], -sine[2], 0], [sine[2], cosine[2], 0], [0, 0, 1]])
    R = X[:3, :3]
    axes = np.stack([R[:, 0], R @ Rx[:, 1], R @ Rx @ Ry[:, 2]], axis=1)
    return R @ Rx @ Ry @ Rz, X[:3, 3] + R @ errors[:3], axes
