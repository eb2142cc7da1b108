"""Where the parts of a cell are believed to be: in the world, on a frame that moves, or held by an arm."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from armwright.arrays import Array, read_only
from armwright.cell.model import Cell
from armwright.cell.scene import Part
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Shape, support

# Fingers hold a part that they close on from no other side than the one its grasp pose is for.
_COS_MAX_TILT = np.cos(np.radians(45.0))


@attrs.frozen(kw_only=True, eq=False)
class PartTrack:
    """Where one part was during a run.

    Attributes:
        times: from when on each of the following holds [s], from 0.
        carriers: the arm that holds the part, or the frame that moves it; None where it lies in the world.
        poses: (4, 4) of the part relative to the tool or the frame; in the world where nothing carries it.
    """

    times: tuple[float, ...]
    carriers: tuple[str | None, ...]
    poses: tuple[Array, ...]

    def at(self, time: float) -> tuple[str | None, Array]:
        """Return what carries the part at a time [s], or None, and its pose on that or in the world."""
        index = max(int(np.searchsorted(self.times, time, side="right")) - 1, 0)
        return self.carriers[index], self.poses[index]


class PartPoses:
    """Where the parts of a cell are, and how far the grippers are open.

    Fingers that close hold the part whose grasp pose is nearest to the tool, if it is no farther away than half the
    opening of the gripper and its approach direction differs by no more than 45 degrees from that of the tool. The part
    then moves with the tool, and stays where it is when they open.
    """

    def __init__(self, cell: Cell) -> None:
        """Put the parts where the cell has them at the start, and open all grippers."""
        self._cell = cell
        self._tracks = {name: _track_at_start(cell, part) for name, part in cell.parts.items()}
        self._openings = {name: arm.gripper_or_usual.opening for name, arm in cell.arms.items()}

    @classmethod
    def arranged(
        cls, cell: Cell, parts: Mapping[str, tuple[str | None, Array]], openings: Mapping[str, float]
    ) -> PartPoses:
        """Return parts that are where they are said to be.

        Args:
            cell: the cell.
            parts: for each part the arm that holds it, and its pose (4, 4) on that hand; None and in the world.
            openings: distance between the fingers of each arm [m].
        """
        other = cls(cell)
        other._tracks = {name: _first_track(arm, X) for name, (arm, X) in parts.items()}
        other._openings = dict(openings)
        return other

    @classmethod
    def standing(cls, cell: Cell) -> PartPoses:
        """Return parts that all stand where they are at the start, as if no frame moved."""
        other = cls(cell)
        other._tracks = {name: _first_track(None, part.pose) for name, part in cell.parts.items()}
        return other

    def copy(self) -> PartPoses:
        """Return the same state; changes of one of them do not change the other."""
        other = PartPoses(self._cell)
        other._tracks, other._openings = dict(self._tracks), dict(self._openings)
        return other

    @property
    def tracks(self) -> Mapping[str, PartTrack]:
        """Where each part has been so far, by name."""
        return dict(self._tracks)

    def carrier(self, part: str) -> str | None:
        """Return the arm that holds a part, or the frame that moves it; None where nothing does."""
        return self._tracks[part].carriers[-1]

    def pose(self, part: str) -> Array:
        """Return the pose (4, 4) of a part on the tool or the frame that carries it; in the world where none does."""
        return self._tracks[part].poses[-1]

    def in_world(self, part: str, carriers: Mapping[str, Array]) -> Array:
        """Return the pose (4, 4) of a part in the world.

        Args:
            part: its name.
            carriers: (4, 4) pose of each tool, and of each frame that moves, in the world.
        """
        carrier = self.carrier(part)
        return self.pose(part) if carrier is None else carriers[carrier] @ self.pose(part)

    def held_by(self, arm: str) -> tuple[str, ...]:
        """Return the parts that an arm holds."""
        return tuple(part for part in self._tracks if self.carrier(part) == arm)

    def opening(self, arm: str) -> float:
        """Return the distance between the fingers of an arm [m]."""
        return self._openings[arm]

    def graspable(self, arm: str, tool: Array, carriers: Mapping[str, Array]) -> str | None:
        """Return the part that the fingers of an arm would hold if they closed at a pose; None where there is none.

        Args:
            arm: its name.
            tool: (4, 4) pose of its tool in the world.
            carriers: (4, 4) pose of each tool, and of each frame that moves, in the world.
        """
        within, nearest = self._cell.arms[arm].gripper_or_usual.opening / 2, None
        for name, part in self._cell.parts.items():
            grasp = self.in_world(name, carriers) @ part.grasp
            distance = float(np.linalg.norm(grasp[:3, 3] - tool[:3, 3]))
            if distance <= within and grasp[:3, 2] @ tool[:3, 2] >= _COS_MAX_TILT:
                within, nearest = distance, name
        return nearest

    def close(self, arm: str, carriers: Mapping[str, Array], now: float, width: float | None = None) -> str | None:
        """Let the fingers of an arm close; return the part that they hold from now on, or None.

        Args:
            arm: its name.
            carriers: (4, 4) pose of each tool, and of each frame that moves, in the world.
            now: the time [s].
            width: to which they close where nothing is between them [m]; 0 when left out.
        """
        part = self.graspable(arm, carriers[arm], carriers)
        self._openings[arm] = min(width or 0.0, self._cell.arms[arm].gripper_or_usual.opening)
        if part is not None:
            X_HP = inverse(carriers[arm]) @ self.in_world(part, carriers)
            self._put(part, arm, X_HP, now)
            self._openings[arm] = width_across(self._cell.parts[part].shape, X_HP)
        return part

    def open(self, arm: str, carriers: Mapping[str, Array], now: float, width: float | None = None) -> tuple[str, ...]:
        """Let the fingers of an arm open; return the parts that it has released, which stay where they are.

        Args:
            arm: its name.
            carriers: (4, 4) pose of each tool, and of each frame that moves, in the world.
            now: the time [s].
            width: to which they open [m]; as far as they can when left out.
        """
        parts = self.held_by(arm)
        for part in parts:
            self._put(part, None, self.in_world(part, carriers), now)
        opening = self._cell.arms[arm].gripper_or_usual.opening
        self._openings[arm] = opening if width is None else min(width, opening)
        return parts

    def see(self, part: str, pose: Array, now: float) -> None:
        """Take note that a part which no arm holds stands at a pose (4, 4) in the world."""
        if self.carrier(part) not in self._cell.arms:
            self._put(part, None, pose, now)

    def _put(self, part: str, carrier: str | None, pose: Array, now: float) -> None:
        track = self._tracks[part]
        # Of the same moment the last counts.
        kept = len(track.times) if track.times[-1] < now else len(track.times) - 1
        self._tracks[part] = PartTrack(
            times=(*track.times[:kept], now),
            carriers=(*track.carriers[:kept], carrier),
            poses=(*track.poses[:kept], read_only(pose)),
        )


def _track_at_start(cell: Cell, part: Part) -> PartTrack:
    frame = cell.moving_frames.get(part.on)
    return _first_track(None, part.pose) if frame is None else _first_track(part.on, inverse(frame.pose) @ part.pose)


def _first_track(carrier: str | None, pose: Array) -> PartTrack:
    return PartTrack(times=(0.0,), carriers=(carrier,), poses=(read_only(pose),))


def width_across(shape: Shape, X_HP: Array) -> float:
    """Return how far apart the fingers are that hold a solid at a pose (4, 4) on the tool [m].

    Both fingers are as far from the middle as its farther side.
    """
    across = X_HP[:3, :3].T[:, 1]
    return 2 * max(float(X_HP[1, 3]) + support(shape, across), support(shape, -across) - float(X_HP[1, 3]))
