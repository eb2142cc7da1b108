"""Contacts that a MOVE is meant to make: which pairs of bodies may touch, when, and how deep.

- The fingers of an arm may touch the part that its MOVE goes to, and the part that they have just released until they
  are clear of it.
- A held part may touch what stands, to 0.5 mm, on the first and last 10 mm of each stage: what it is taken from and
  set down on.
- The tool and what it holds may touch anything in a MOVE that a force ends, and in the next one until it is clear.
- What the fingers hold belongs to the gripper; parts rest on what they stand on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, Flags, Numbers
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.trajectory import Trajectory
from armwright.physics.cell_bodies import Body
from armwright.physics.clearance import ClearanceChecker, Closest, Window
from armwright.physics.placed_bodies import Role
from armwright.physics.planned_move import PlannedMove

# How deep a held part may touch what it stands on, and on which length of the path [m].
REST_DEPTH, REST_LENGTH = 0.5e-3, 0.01
# Fingers are clear of a part when they are so far from it [m].
_CLEAR = 1e-3
# Points on each stage at which the length of the path, and whether fingers are clear, are looked at.
_SAMPLES = 201
# A held part that is so near to something at the start or the end of a stage stands on it there [m].
_STANDS = 1e-3
# Moments that are looked at together.
_BLOCK = 32


class Surroundings(NamedTuple):
    """The bodies around an arm that is to move, and what the others do meanwhile.

    Attributes:
        checker: of the pairs.
        motions: of all arms.
        bodies: with what each is.
        pairs: of their numbers, each with one at least that the arm carries.
        beside: by arm, the parts that its fingers may touch.
    """

    checker: ClearanceChecker
    motions: Mapping[str, Trajectory]
    bodies: Sequence[tuple[Body, Role]]
    pairs: Sequence[tuple[int, int]]
    beside: Mapping[str, frozenset[str]]


class WantedContacts:
    """Which pairs of bodies count on a MOVE, from when to when, with what margins.

    Attributes:
        move: the MOVE.
        surroundings: what is around its arm.
        starts: when each stage begins [s].
    """

    def __init__(self, move: PlannedMove, surroundings: Surroundings, arm: Arm) -> None:
        """See which contacts are wanted.

        Args:
            move: the MOVE.
            surroundings: what is around its arm.
            arm: the model of that arm.
        """
        self.move, self.surroundings, self._arm = move, surroundings, arm
        self._checker, self._motions, self._bodies, self._pairs, beside = surroundings
        ends = np.cumsum([0.0, *(stage.duration for stage in move.stages)])
        self.starts, self._end = ends[:-1].tolist(), float(ends[-1])
        arms = [(self._bodies[i][0].arm, self._bodies[j][0].arm) for i, j in self._pairs]
        self._own = np.array([one == other for one, other in arms], dtype=bool)
        # The pairs of which the other body moves by itself.
        self._of_two = np.array([one != other and None not in (one, other) for one, other in arms], dtype=bool)
        self._rests = np.zeros(len(arms), dtype=bool)
        self._free_until = np.full(len(arms), -np.inf)
        self._sort(beside)

    def _sort(self, beside: Mapping[str, frozenset[str]]) -> None:
        """See of every pair until when it is free, and whether it is of a held part and of what stands."""
        move = self.move
        until_clear: dict[str, list[int]] = {}
        for number, (i, j) in enumerate(self._pairs):
            if self._own[number]:
                continue
            own, other = (i, j) if self._bodies[i][0].arm == move.arm else (j, i)
            (_, role), (body, facing) = self._bodies[own], self._bodies[other]
            self._rests[number] = role.part is not None and body.arm is None
            holds = role.in_hand or role.part is not None
            met_by = beside.get(str(facing.arm), frozenset()) if facing.grips else frozenset()
            if holds and move.on_force:
                self._free_until[number] = np.inf
            elif role.grips and facing.part in beside.get(move.arm, ()) and facing.part != move.goal_part:
                until_clear.setdefault(str(facing.part), []).append(number)
            elif (role.grips and facing.part is not None and facing.part == move.goal_part) or role.part in met_by:
                self._free_until[number] = np.inf
            elif holds and move.after_force:
                until_clear.setdefault(f"{other}", []).append(number)
        for numbers in until_clear.values():
            self._free_until[numbers] = self._clear_time(np.array(numbers, dtype=np.intp))

    def _clear_time(self, numbers: Numbers) -> float:
        """Return when pairs are clear of each other for the first time [s]; infinity where they never are."""
        times = np.concatenate([np.linspace(0.0, stage.duration, _SAMPLES) for stage in self.move.stages])
        times += np.repeat(self.starts, _SAMPLES)
        for first in range(0, len(times), _BLOCK):
            block = times[first : first + _BLOCK]
            distances = self._checker.distances_at(self._motions, block, numbers, 2 * _CLEAR)
            clear = np.flatnonzero((distances > _CLEAR).all(axis=1))
            if len(clear):
                return float(block[clear[0]])
        return np.inf

    @cached_property
    def windows(self) -> list[Window]:
        """What is looked at, one after the other; then the other arms until they are at rest."""
        total = max(motion.duration for motion in self._motions.values())
        zones = self._rest_zones()
        edges = {0.0, *self.starts, self._end, total, *(edge for zone in zones for edge in zone)}
        edges.update(time for time in self._free_until.tolist() if 0.0 < time < total)
        times = sorted(edges)
        windows = []
        for start, end in zip(times, times[1:] or times, strict=False):
            counts: Flags = self._free_until <= start
            if start >= self._end and self._end < total:
                counts = counts & self._of_two
            in_zone = any(zone[0] <= start and end <= zone[1] for zone in zones)
            margins = np.where(self._rests & in_zone, -REST_DEPTH, 0.0)
            windows.append(Window(start, end, np.flatnonzero(counts), margins[counts]))
        return windows

    def _rest_zones(self) -> list[tuple[float, float]]:
        """Return the intervals of time in which the tool is near the start or the end of a stage."""
        if not self._rests.any():
            return []
        zones = []
        for start, stage in zip(self.starts, self.move.stages, strict=True):
            times = np.linspace(0.0, stage.duration, _SAMPLES)
            points = forward(self._arm, stage(times))[:, :3, 3]
            lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
            near = times[lengths <= REST_LENGTH], times[lengths[-1] - lengths <= REST_LENGTH]
            zones += [(start + float(near[0][0]), start + float(near[0][-1]))]
            zones += [(start + float(near[1][0]), start + float(near[1][-1]))]
        return zones

    def first_contact(self) -> Closest | None:
        """Return where bodies meet for the first time that may not; None where none do."""
        return self._checker.first_contact(self._motions, windows=self.windows)

    def margins_at(self, time: float) -> Array:
        """Return the margins of all pairs at a time [m], the smallest where it changes; minus infinity for none."""
        margins = np.full(len(self._pairs), np.inf)
        for window in self.windows:
            if window.start <= time <= window.end:
                here = np.full(len(self._pairs), -np.inf)
                here[window.pairs] = window.margins
                margins = np.minimum(margins, here)
        return margins

    def margin_at_start(self, number: int) -> float:
        """Return the margin of a pair when the MOVE begins [m]; minus infinity where it may touch."""
        first = self.windows[0]
        places = np.flatnonzero(first.pairs == number)
        return float(first.margins[places[0]]) if len(places) else -np.inf

    def stage_at(self, time: float) -> int:
        """Return the stage at a time [s]; the last one after the end."""
        return max(int(np.searchsorted(self.starts, time, side="right")) - 1, 0)

    def clearance_windows(self, stage: int) -> list[Window]:
        """Return what the clearance of a stage is found on: other bodies, but not what a held part stands on."""
        start, end = self.starts[stage], self.starts[stage] + self.move.stages[stage].duration
        counts = ~self._own
        resting = np.flatnonzero(self._rests)
        if len(resting):
            ends = self._checker.distances_at(self._motions, np.array([start, end]), resting, 2 * _STANDS)
            counts[resting[(ends <= _STANDS).any(axis=0)]] = False
        return [
            window._replace(pairs=kept, margins=np.zeros(len(kept)))
            for window in self.windows
            if start <= window.start and window.end <= end and window.end > window.start
            for kept in [window.pairs[counts[window.pairs]]]
        ]
