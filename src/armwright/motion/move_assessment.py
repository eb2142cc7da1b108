"""The assessment of a planned move: its poses, their times and deviations, and how far limits are utilized."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.files.result_table import ResultTable
from armwright.motion.certificate import LimitName
from armwright.motion.limit_utilization import ROUNDING, limit_use
from armwright.motion.moves import Move
from armwright.motion.smooth_move import SmoothMove


@attrs.frozen(kw_only=True, eq=False)
class MoveAssessment:
    """A planned move with the names of its poses.

    Attributes:
        move: the move.
        names: names of the poses.
        smooth: how it leaves little vibration; None where nothing was asked for.
        uses: the utilization of each limit by every joint, (n,).
    """

    move: Move
    names: tuple[str, ...]
    smooth: SmoothMove | None = None
    uses: dict[LimitName, Array] = attrs.field(init=False)

    @uses.default
    def _uses(self) -> dict[LimitName, Array]:
        uses = limit_use(self.move.arm, self.move.trajectory)
        # Without masses the efforts are none of the arm.
        return {name: use for name, use in uses.items() if name != "effort" or not self.move.arm.massless}

    @property
    def notes(self) -> tuple[str, ...]:
        """The duration and the branches, the certificate, and the detours."""
        move = self.move
        notes = [f"{move.arm.name}: {move.trajectory.duration:.3f} s, {move.label}"]
        if move.arm.massless:
            notes.append(f"the masses of {move.arm.name} are unknown, and so are its efforts")
        if move.certificate:
            notes.append(f"certificate {move.certificate}")
        if self.smooth is not None:
            notes += self.smooth.notes
        for start, end, detour in zip(self.names, self.names[1:], move.detours, strict=False):
            bypass = f"line infeasible, {detour.obstacle}; detour by {detour.method}"
            notes.append(f"{start} to {end}: {'a line' if detour.method == 'line' else bypass}: {detour.price}")
        return tuple(notes)

    def _passages(self) -> Iterator[tuple[str, float, list[float], float]]:
        """Yield of every pose its name, the time, the joint positions and the distance at which it is passed."""
        columns = (self.move.times, self.move.configurations, self.move.passing_distances)
        return zip(self.names, *(column.tolist() for column in columns), strict=True)

    def as_data(self) -> dict[str, Any]:
        """Return the assessment as plain data in SI units."""
        move = self.move
        return {
            "arm": move.arm.name,
            "duration": move.trajectory.duration,
            "branch": move.label,
            "poses": [dict(zip(("name", "time", "q", "deviation"), each, strict=True)) for each in self._passages()],
            "certificate": None if move.certificate is None else move.certificate.as_data(),
            "vibration": None if self.smooth is None else self.smooth.as_data(),
            "of_limits": {name: use.tolist() for name, use in self.uses.items()},
            "segments": [
                {
                    "method": detour.method,
                    "obstacle": None if detour.obstacle is None else str(detour.obstacle),
                    "position_deviation": detour.price.distance,
                    "rotation_deviation": detour.price.rotation,
                    "extra_time": detour.price.time,
                }
                for detour in move.detours
            ],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the table of the poses [deg, mm], followed by the utilization of the limits."""
        move = self.move
        units = [joint.units for joint in move.arm.joints]
        heads = ["pose", "s", *(f"j{i} {unit.display}" for i, unit in enumerate(units, 1))]
        rows = []
        for name, t, q, distance in self._passages():
            values = [f"{x / unit.scale:z.1f}" for x, unit in zip(q, units, strict=True)]
            rows.append([name, f"{t:.3f}", *values, *([f"{distance * 1e3:.1f}"] if move.tool_path else [])])
        if move.tool_path:
            heads.append("deviation mm")
        for limit, use in self.uses.items():
            rows.append([limit, "", *(f"{part:.0%}" for part in use), *([""] if move.tool_path else [])])
        exceeded = [
            (len(self.names) + i, 2 + joint)
            for i, use in enumerate(self.uses.values())
            for joint in np.flatnonzero(use > 1 + ROUNDING).tolist()
        ]
        *first, last = self.uses
        yield ResultTable(
            title="",
            heads=heads,
            rows=rows,
            numbers=range(1, len(heads)),
            exceeded=exceeded,
            section_ends=(len(self.names) - 1,),
            remark=f"{', '.join(first)} and {last} in percent of their limits",
        )
        if self.smooth is not None:
            yield self.smooth.table()
