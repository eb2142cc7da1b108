"""What happened in a world, tick by tick."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import compress, pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.observations import MeasuredStream
from armwright.cell.part_poses import PartTrack
from armwright.physics.servo import ArmServo, Measured, Sent
from armwright.physics.world_model import WorldModel, part_pose

Indices: TypeAlias = npt.NDArray[np.intp]
# Rows that are taken together.
_BLOCK = 1024
# Poses of parts are kept so often [s].
_PARTS = 0.02
_STILL = 1e-5


class _Columns(NamedTuple):
    """Where the fields of ``Measured`` of an arm stand in a row of the log, (n,) each, and its fingers."""

    q: Indices
    qd: Indices
    tau: Indices
    actual: Indices
    fingers: Indices


class Log:
    """What is recorded of a world: at every tick all that moves, and what sensors read where that is something else."""

    def __init__(
        self, cell: Cell, world: WorldModel, arms: Mapping[str, ArmServo], fingers: Mapping[str, Indices]
    ) -> None:
        """Begin with nothing.

        Args:
            cell: the cell.
            world: its world.
            arms: the servos of its arms.
            fingers: where the positions of their fingers stand among those of the world.
        """
        self._cell, self._parts = cell, tuple(world.parts)
        # Of the arrays of the world what belongs to arms, or stands before it.
        kinds = zip(*((*arm.indices[:3], fingers[name]) for name, arm in arms.items()), strict=True)
        positions, speeds, motors, others = (max(int(x.max(initial=-1)) for x in kind) + 1 for kind in kinds)
        positions = max(positions, others)
        ends = np.cumsum([0, positions, speeds, motors]).tolist()
        self._used = slice(positions), slice(speeds), slice(motors)
        self._written = tuple(slice(first, last) for first, last in pairwise(ends))
        self._columns: dict[str, _Columns] = {}
        # Motors of coupled drives are recorded as they pull; what is read is what that is at the joints.
        self._couplings = {name: arm.arm.coupling for name, arm in arms.items() if arm.reads_exactly}
        width = ends[-1]
        for name, arm in arms.items():
            i = arm.indices
            q, qd, tau = i.positions, ends[1] + i.speeds, ends[2] + i.motors
            if not arm.reads_exactly:
                q, qd, tau = (width + np.arange(3 * arm.arm.n)).reshape(3, -1)
                width += 3 * arm.arm.n
            self._columns[name] = _Columns(q, qd, tau, i.positions, fingers[name])
        self._full: list[Array] = []
        self._rows = np.empty((_BLOCK, width))
        self._sent: dict[str, tuple[tuple[int, Sent], ...]] = dict.fromkeys(arms, ())
        self._count = 0
        self._every = max(1, round(_PARTS / cell.period))
        self._tracks: dict[str, list[tuple[float, Array]]] = {
            name: [(0.0, part.pose)] for name, part in world.parts.items()
        }
        # Of each part the body, and its rotation and position where it was recorded last.
        self._bodies = [world.model.body(name).id for name in world.parts]
        poses = [part.pose for part in world.parts.values()]
        self._coordinates = np.array([[*X[:3, :3].ravel(), *X[:3, 3]] for X in poses]).reshape(-1, 12)

    def copy(self) -> Log:
        """Return the same records; what is added to one does not change the other."""
        other = object.__new__(Log)
        other.__dict__.update(self.__dict__)
        other._full, other._rows, other._sent = list(self._full), self._rows.copy(), dict(self._sent)
        other._tracks = {name: list(track) for name, track in self._tracks.items()}
        return other

    def send(self, arm: str, tick: int, sent: Sent) -> None:
        """Record where an arm is sent from a tick on."""
        self._sent[arm] = (*self._sent[arm], (tick, sent))

    def add_reading(self, arm: str, tick: int, q: Array, qd: Array, tau: Array) -> None:
        """Record what the sensors of an arm read at a tick, which does not read exactly."""
        row, columns = self._rows[tick % _BLOCK], self._columns[arm]
        row[columns.q], row[columns.qd], row[columns.tau] = q, qd, tau

    def add(self, tick: int, data: Any) -> None:
        """Record what moves and what drives it at a tick, after what sensors read."""
        row = self._rows[tick % _BLOCK]
        for columns, values, used in zip(self._written, (data.qpos, data.qvel, data.ctrl), self._used, strict=True):
            row[columns] = values[used]
        if tick % _BLOCK == _BLOCK - 1:
            self._full.append(self._rows)
            self._rows = np.empty_like(self._rows)

    def add_parts(self, tick: int, data: Any) -> None:
        """Record where parts are that have moved, after what all servos did at the tick."""
        self._count = tick + 1
        if tick % self._every:
            return
        coordinates = np.concatenate([data.xmat[self._bodies], data.xpos[self._bodies]], axis=1)
        moved = (np.abs(coordinates - self._coordinates) > _STILL).any(axis=1)
        if not np.count_nonzero(moved):
            return
        self._coordinates = np.where(moved[:, None], coordinates, self._coordinates)
        for name in compress(self._parts, moved.tolist()):
            track, before = self._tracks[name], (tick - self._every) * self._cell.period
            if track[-1][0] < before:
                # It stood still until then.
                track.append((before, track[-1][1]))
            track.append((tick * self._cell.period, part_pose(data, name)))

    def at(self, arm: str, tick: int) -> Measured:
        """Return what a servo did at a tick that has been recorded, or at the last one."""
        block, row = divmod(max(0, min(tick, self._count - 1)), _BLOCK)
        # Another thread may fill the latest block meanwhile, and put it behind the others.
        latest, full = self._rows, self._full
        values = full[block][row] if block < len(full) else latest[row]
        measured = Measured(*(values[columns] for columns in self._columns[arm][:-1]))
        return measured._replace(tau=self._at_joints(arm, measured.tau))

    def part_pose(self, part: str, time: float) -> Array:
        """Return the pose (4, 4) of a part in the world at a time [s] that has been recorded."""
        track = self._tracks[part]
        return track[max(0, bisect_right(track, time, key=lambda row: row[0]) - 1)][1]

    def streams(self) -> tuple[MeasuredStream, ...]:
        """Return what was recorded, one stream per arm."""
        rows = np.concatenate([*self._full, self._rows])[: self._count]
        return tuple(self._stream(name, rows) for name in self._cell.arms)

    def _stream(self, name: str, rows: Array) -> MeasuredStream:
        columns, sent = self._columns[name], self._sent[name]
        # A world that has ended is still told where arms are sent.
        changes = [*(min(tick, self._count) for tick, _ in sent), self._count]
        return MeasuredStream(
            arm=name,
            t=np.arange(self._count, dtype=np.float64) * self._cell.period,
            q=rows[:, columns.q],
            qd=rows[:, columns.qd],
            tau=self._at_joints(name, rows[:, columns.tau]),
            sent=np.concatenate([it.positions(*ticks) for (_, it), ticks in zip(sent, pairwise(changes), strict=True)]),
            actual=rows[:, columns.actual],
            opening=rows[:, columns.fingers].sum(axis=1),
        )

    def _at_joints(self, arm: str, tau: Array) -> Array:
        coupling = self._couplings.get(arm)
        return tau if coupling is None else coupling.joint_efforts(tau)

    def tracks(self) -> dict[str, PartTrack]:
        """Return where the parts were."""
        return {name: _part_track(track) for name, track in self._tracks.items()}


def _part_track(rows: Sequence[tuple[float, Array]]) -> PartTrack:
    times, poses = zip(*rows, strict=True)
    return PartTrack(times=times, carriers=(None,) * len(rows), poses=poses)
