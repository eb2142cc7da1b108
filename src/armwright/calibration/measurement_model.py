"""What is unknown of an arm and of what it was measured against, and by how much readings miss what they should be.

Beside the errors of the arm there are those of where further frames stand, six each; of planes that were touched, a
shift and two tilts each; and of anchors, three coordinates each.
"""

from collections.abc import Iterator
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, Flags
from armwright.calibration.chain import Chain, ToolPoses
from armwright.calibration.readings import Numbers, Readings
from armwright.errors import ShapeError
from armwright.spatial.rotations import rotation_vector

_SIX = ("x", "y", "z", "rx", "ry", "rz")
_TILTS = ("z", "rx", "ry")


class Plane(NamedTuple):
    """A plane in the measuring frame, roughly.

    Attributes:
        point: (3,) a point of it [m].
        axes: (3, 3) a frame, in columns, whose third axis is normal to it.
    """

    point: Array
    axes: Array


class Residuals(NamedTuple):
    """Equations of readings: what each number that was measured is off by.

    Attributes:
        off: (r,) what the arm has, less what was measured [m], or small turns [rad].
        by: (r, k) derivative by the errors.
        of: (r,) number of the reading.
        turning: (r,) which are turns.
    """

    off: Array
    by: Array
    of: Numbers
    turning: Flags


class PoseError(NamedTuple):
    """By how much readings miss.

    Attributes:
        distance: (m,) length of what is missed [m].
        turn: (m,) angle of what is missed [rad]; NaN of readings that tell no turn.
    """

    distance: Array
    turn: Array


@attrs.frozen(kw_only=True, eq=False)
class MeasurementModel:
    """An arm and what it was measured against.

    Attributes:
        chain: the arm.
        frames: (4, 4) where each frame stands in the measuring frame, roughly; the first is that frame.
        planes: that were touched, roughly.
        anchors: (3,) where each anchor is in the measuring frame, roughly [m].
        frame_names: of the frames.
        plane_names: of the planes.
        anchor_names: of the anchors.
    """

    chain: Chain
    frames: tuple[Array, ...] = attrs.field(factory=lambda: (np.eye(4),))
    planes: tuple[Plane, ...] = ()
    anchors: tuple[Array, ...] = ()
    frame_names: tuple[str, ...] = ("",)
    plane_names: tuple[str, ...] = ()
    anchor_names: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The errors, in order: those of the arm come first."""
        return (
            *self.chain.names,
            *(f"frame.{name}.{part}" for name in self.frame_names[1:] for part in _SIX),
            *(f"plane.{name}.{part}" for name in self.plane_names for part in _TILTS),
            *(f"anchor.{name}.{part}" for name in self.anchor_names for part in "xyz"),
        )

    @property
    def is_length(self) -> Array:
        """(k,) whether each error is a length, not an angle."""
        rest = [not name.rpartition(".")[2].startswith("r") for name in self.names[len(self.chain.names) :]]
        return np.array([*self.chain.is_length, *rest], dtype=np.bool_)

    @property
    def surroundings(self) -> range:
        """Numbers of the errors that are not the arm's."""
        return range(len(self.chain.names), len(self.names))

    def rows(self, readings: Readings, errors: ArrayLike | None = None) -> Residuals:
        """Return the equations of readings.

        Args:
            readings: m of them.
            errors: (k,) of the arm and its surroundings; none when left out.

        Raises:
            ShapeError: there are not as many errors.
        """
        x = np.zeros(len(self.names)) if errors is None else np.asarray(errors, dtype=np.float64)
        if x.shape != (len(self.names),):
            raise ShapeError(f"errors: expected {len(self.names)} of them, got shape {x.shape}")
        reached = self.chain.reach(readings.q, x[: len(self.chain.names)])
        parts = [
            *self._of_frames(readings, reached, x),
            *self._of_planes(readings, reached, x),
            *self._of_anchors(readings, reached, x),
            *self._of_ways(readings, reached, x),
        ]
        return Residuals(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def off(self, readings: Readings, errors: ArrayLike | None = None) -> PoseError:
        """Return by how much readings miss."""
        rows = self.rows(readings, errors)
        square = rows.off**2
        distance, turn = (
            np.sqrt(np.bincount(rows.of[which], square[which], len(readings)))
            for which in (~rows.turning, rows.turning)
        )
        # The rows of a turn are twice the sine of half of it, along three axes.
        turn = 2 * np.arcsin(np.minimum(turn / 2, 1.0))
        return PoseError(distance, np.where(readings.with_rotation, turn, np.nan))

    # ---- the kinds of readings -----------------------------------------------------------------------------------

    def _wide(self, own: Array, first: int = 0, more: Array | None = None) -> Array:
        """Return derivatives (r, k) by all errors from those of the arm and of some that begin at a number."""
        by = np.zeros((len(own), len(self.names)))
        by[:, : own.shape[1]] = own
        if more is not None:
            by[:, first : first + more.shape[1]] = more
        return by

    def _of_frames(self, readings: Readings, reached: ToolPoses, x: Array) -> Iterator[Residuals]:
        own = len(self.chain.names)
        for i, X in enumerate(self.frames):
            first = own + 6 * (i - 1)
            which = np.flatnonzero(readings.with_point & (readings.frame == i))
            told = readings.points[which]
            turned, place, axes = _six(X, x[first : first + 6] if i else np.zeros(6))
            seen = told @ turned.T + place
            by = reached.by_position[which]
            levers = np.concatenate(
                [np.tile(X[:3, :3], (len(which), 1, 1)), np.cross(axes.T, (seen - place)[:, None]).swapaxes(1, 2)],
                axis=2,
            )
            more = (-levers).reshape(-1, 6) if i else None
            yield Residuals(
                (reached.position[which] - seen).ravel(),
                self._wide(by.reshape(-1, by.shape[2]), first, more),
                np.repeat(which, 3),
                np.zeros(3 * len(which), dtype=np.bool_),
            )
            which = which[readings.with_rotation[which]]
            if not len(which):
                continue
            apart, by_turn = _apart(reached.rotation[which], turned @ readings.rotations[which])
            by = by_turn @ reached.by_turn[which]
            turns = np.concatenate([np.zeros((3, 3)), axes], axis=1)
            more = (-by_turn.swapaxes(1, 2) @ turns).reshape(-1, 6) if i else None
            yield Residuals(
                apart.ravel(),
                self._wide(by.reshape(-1, by.shape[2]), first, more),
                np.repeat(which, 3),
                np.ones(3 * len(which), dtype=np.bool_),
            )

    def _of_planes(self, readings: Readings, reached: ToolPoses, x: Array) -> Iterator[Residuals]:
        first = len(self.chain.names) + 6 * (len(self.frames) - 1)
        for i, plane in enumerate(self.planes):
            which = np.flatnonzero(readings.plane == i)
            shift, a, b = x[first : first + 3]
            # Tilted by a about its x and by b about its y, as tangents.
            local = np.array([b, -a, 1.0])
            length = np.linalg.norm(local)
            normal = plane.axes @ local / length
            away = reached.position[which] - plane.point
            height = away @ normal
            slopes = plane.axes.T @ (np.eye(3) - np.outer(normal, normal)) / length
            more = np.stack([-np.ones(len(which)), -(away @ slopes[1]), away @ slopes[0]], axis=1)
            by = np.einsum("i,mik->mk", normal, reached.by_position[which])
            yield Residuals(height - shift, self._wide(by, first, more), which, np.zeros(len(which), dtype=np.bool_))
            first += 3

    def _of_anchors(self, readings: Readings, reached: ToolPoses, x: Array) -> Iterator[Residuals]:
        first = len(self.chain.names) + 6 * (len(self.frames) - 1) + 3 * len(self.planes)
        for i, anchor in enumerate(self.anchors):
            which = np.flatnonzero(readings.anchor == i)
            away = reached.position[which] - anchor - x[first : first + 3]
            distance = np.linalg.norm(away, axis=1)
            along = away / np.maximum(distance, 1e-12)[:, None]
            by = np.einsum("mi,mik->mk", along, reached.by_position[which])
            yield Residuals(
                distance - readings.distances[which],
                self._wide(by, first, -along),
                which,
                np.zeros(len(which), dtype=np.bool_),
            )
            first += 3

    def _of_ways(self, readings: Readings, reached: ToolPoses, x: Array) -> Iterator[Residuals]:
        which = np.flatnonzero(np.isfinite(readings.other[:, 0]))
        there = self.chain.reach(readings.other[which], x[: len(self.chain.names)])
        away = reached.position[which] - there.position
        distance = np.linalg.norm(away, axis=1)
        along = away / np.maximum(distance, 1e-12)[:, None]
        by = np.einsum("mi,mik->mk", along, reached.by_position[which] - there.by_position)
        yield Residuals(
            distance - readings.distances[which], self._wide(by), which, np.zeros(len(which), dtype=np.bool_)
        )


def _apart(R: Array, goals: Array) -> tuple[Array, Array]:
    """Return by what rotations are turned from goals, both (m, 3, 3), and the derivative of that by a small turn of R.

    It is the axis of the turn by twice the sine of half its angle, (m, 3): the turn itself where that is small, and
    largest where R stands the other way round. The derivative (m, 3, 3), transposed and negative, is that by a small
    turn of the goal.
    """
    w = rotation_vector(R @ goals.swapaxes(1, 2))
    half = np.linalg.norm(w, axis=1)[:, None] / 2
    vector = w * np.sinc(half / np.pi) / 2  # of the quaternion
    x, y, z = vector.T
    c = np.cos(half[:, 0])
    by = np.stack([c, z, -y, -z, c, x, y, -x, c], axis=1).reshape(-1, 3, 3)
    return 2 * vector, by


def _six(X: Array, six: Array) -> tuple[Array, Array, Array]:
    """Return rotation and place of a frame that is shifted and turned by six errors, and its axes of turning."""
    cosine, sine = np.cos(six[3:]), np.sin(six[3:])
    Rx = np.array([[1, 0, 0], [0, cosine[0], -sine[0]], [0, sine[0], cosine[0]]])
    Ry = np.array([[cosine[1], 0, sine[1]], [0, 1, 0], [-sine[1], 0, cosine[1]]])
    Rz = np.array([[cosine[2], -sine[2], 0], [sine[2], cosine[2], 0], [0, 0, 1]])
    R = X[:3, :3]
    axes = np.stack([R[:, 0], R @ Rx[:, 1], R @ Rx @ Ry[:, 2]], axis=1)
    return R @ Rx @ Ry @ Rz, X[:3, 3] + R @ six[:3], axes
