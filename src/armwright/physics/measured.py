"""What happened in a world, tick by tick."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.observations import MeasuredStream
from armwright.cell.part_poses import PartTrack
from armwright.physics.servo import Measured, Reference
from armwright.physics.world_model import WorldModel, part_pose

# Rows that are taken together.
_BLOCK = 1024
# Poses of parts are kept so often [s].
_PARTS = 0.02
_STILL = 1e-5


class Log:
    """What is recorded of a world."""

    def __init__(self, cell: Cell, world: WorldModel) -> None:
        """Begin with nothing."""
        self._cell, self._parts = cell, tuple(world.parts)
        self._full: dict[str, list[Array]] = {name: [] for name in cell.arms}
        self._rows = {name: np.empty((_BLOCK, 5 * arm.arm.n + 1)) for name, arm in cell.arms.items()}
        self._count = 0
        self._every = max(1, round(_PARTS / cell.period))
        self._tracks: dict[str, list[tuple[float, Array]]] = {
            name: [(0.0, part.pose)] for name, part in world.parts.items()
        }

    def copy(self) -> Log:
        """Return the same records; what is added to one does not change the other."""
        other = object.__new__(Log)
        other.__dict__.update(self.__dict__)
        other._full = {name: list(blocks) for name, blocks in self._full.items()}
        other._tracks = {name: list(track) for name, track in self._tracks.items()}
        other._rows = {name: rows.copy() for name, rows in self._rows.items()}
        return other

    def add(self, arm: str, tick: int, reference: Reference, measured: Measured, opening: float) -> None:
        """Record what a servo did at a tick."""
        row = self._rows[arm][tick % _BLOCK]
        n = len(measured.q)
        row[:n], row[n : 2 * n], row[2 * n : 3 * n] = measured.q, measured.qd, measured.tau
        row[3 * n : 4 * n], row[4 * n : 5 * n], row[-1] = reference.q, measured.actual, opening
        if tick % _BLOCK == _BLOCK - 1:
            self._full[arm].append(self._rows[arm])
            self._rows[arm] = np.empty_like(self._rows[arm])

    def add_parts(self, tick: int, data: Any) -> None:
        """Record where parts are that have moved, after what all servos did at the tick."""
        self._count = tick + 1
        if tick % self._every:
            return
        for name in self._parts:
            X = part_pose(data, name)
            if np.abs(X - self._tracks[name][-1][1]).max() > _STILL:
                track, before = self._tracks[name], (tick - self._every) * self._cell.period
                if track[-1][0] < before:
                    # It stood still until then.
                    track.append((before, track[-1][1]))
                track.append((tick * self._cell.period, X))

    def at(self, arm: str, tick: int) -> Measured:
        """Return what a servo did at a tick that has been recorded, or at the last one."""
        block, row = divmod(max(0, min(tick, self._count - 1)), _BLOCK)
        # Another thread may fill the latest block meanwhile, and put it behind the others.
        latest, full = self._rows[arm], self._full[arm]
        values = full[block][row] if block < len(full) else latest[row]
        n = (len(values) - 1) // 5
        return Measured(values[:n], values[n : 2 * n], values[2 * n : 3 * n], values[4 * n : 5 * n])

    def part_pose(self, part: str, time: float) -> Array:
        """Return the pose (4, 4) of a part in the world at a time [s] that has been recorded."""
        track = self._tracks[part]
        return track[max(0, bisect_right(track, time, key=lambda row: row[0]) - 1)][1]

    def streams(self) -> tuple[MeasuredStream, ...]:
        """Return what was recorded, one stream per arm."""
        return tuple(self._stream(name) for name in self._cell.arms)

    def _stream(self, name: str) -> MeasuredStream:
        rows = np.concatenate([*self._full[name], self._rows[name]])[: self._count]
        n = (rows.shape[1] - 1) // 5
        return MeasuredStream(
            arm=name,
            t=np.arange(self._count, dtype=np.float64) * self._cell.period,
            q=rows[:, :n],
            qd=rows[:, n : 2 * n],
            tau=rows[:, 2 * n : 3 * n],
            sent=rows[:, 3 * n : 4 * n],
            actual=rows[:, 4 * n : 5 * n],
            opening=rows[:, -1],
        )

    def tracks(self) -> dict[str, PartTrack]:
        """Return where the parts were."""
        return {name: _part_track(track) for name, track in self._tracks.items()}


def _part_track(rows: Sequence[tuple[float, Array]]) -> PartTrack:
    times, poses = zip(*rows, strict=True)
    return PartTrack(times=times, arms=(None,) * len(rows), poses=poses)
