"""Simulated lives of a linkage, maintained after a strategy: what a plan is worth.

The simulated linkage is not the one that the plan believes in: its walls wore with other clearances and another wear
coefficient of each pin, its tip is where the full kinematics put it, its wear comes in random grains, and friction
holds each journal somewhere else at every visit.

Source:
    Spec of the life, 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Numbers, integer
from armwright.clearance.ideal import close_pins
from armwright.clearance.maintenance.belief import Belief
from armwright.clearance.maintenance.maintained_linkage import MaintainedLinkage
from armwright.clearance.maintenance.readings import read_offsets, tips_of
from armwright.clearance.maintenance.strategy import NextStop, Planner
from armwright.clearance.maintenance.wear_history import WearHistory, WornGaps
from armwright.errors import InvalidValueError

# Between two stops the error is looked at after so many numbers of strokes, each time of so many visits.
_LOOKS, _VISITS = 4, 8
# Of the posterior of the wear coefficients.
_LEVEL = 0.9
_MOST_LIVES = 10_000
# Scatters, and grains [m], that are no larger make no difference.
_NONE = 1e-12
# After so many stops they help no longer: then they are at least intervals apart.
_MANY = 30
# What is so near to the horizon is at it, but for rounding.
_END = 1 - 1e-9


class SimulatedWear(NamedTuple):
    """A linkage that wears.

    Attributes:
        history: of its walls.
        watched: gaps of its pins where the error of the tip counts.
        poses: gaps of its pins at the poses of a check.
    """

    history: WearHistory
    watched: WornGaps
    poses: WornGaps

    @classmethod
    def of(cls, machine: MaintainedLinkage, clearances: Array, coefficients: Array) -> SimulatedWear:
        """Wear a linkage, as far as the one that it is built like.

        Args:
            machine: that it is built like.
            clearances: (p,) of its new pins [m].
            coefficients: (p,) of their wear [m²/N].
        """
        linkage = machine.linkage.with_clearances(dict(zip(machine.linkage.clearances, clearances, strict=True)))
        history = WearHistory.of(
            attrs.evolve(machine.stroke, linkage=linkage),
            machine.history.law,
            machine.watched,
            exposure=machine.history.exposure,
            factors=coefficients / coefficients.max(),
        )
        return cls(history, history.gaps(machine.watched), history.gaps(machine.poses))


class Stop(NamedTuple):
    """A stop of a simulated life.

    Attributes:
        strokes: at which the arm was stopped.
        changed: numbers of the pins whose bearings were changed.
    """

    strokes: float
    changed: tuple[int, ...]


@attrs.define(kw_only=True, eq=False)
class SimulatedLife:
    """A life over the horizon of its strategy.

    Attributes:
        now: strokes done.
        belief: what its maintenance knows.
        next_stop: what it plans.
        stops: in order.
        corrections: number of corrected paths.
        outside: strokes with an error beyond the limit.
        covered: by pin, whether the interval of its wear coefficient after the last check holds the true one; empty
            where nothing was measured.
    """

    now: float
    belief: Belief
    next_stop: NextStop
    stops: list[Stop]
    corrections: int = 0
    outside: float = 0.0
    covered: tuple[bool, ...] = ()


def simulate_lives(
    planner: Planner,
    start: Belief,
    count: int,
    *,
    wears: Sequence[SimulatedWear],
    seed: int = 0,
    interval: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[SimulatedLife]:
    """Return lives whose true clearances and wear coefficients are drawn from what is known at their start.

    Args:
        planner: whose corrections and changes are made.
        start: what is known.
        count: of the lives.
        wears: of whose walls each life has one.
        seed: of all random numbers; lives of one seed begin alike, whatever their stops.
        interval: strokes between checks, beside those at which a bearing is to be changed; those of the planner when
            left out.
        progress: called with the part of all strokes that is done.

    Raises:
        InvalidValueError: the lives are too many.
    """
    if integer(count, "simulated lives", least=1) > _MOST_LIVES:
        raise InvalidValueError(f"simulated lives: expected at most {_MOST_LIVES}, got {count}")
    machine, strategy = planner.machine, planner.strategy
    truth_rng, filter_rng = np.random.default_rng([seed, 2]).spawn(2)
    truth = _Population(machine, start, count, wears, truth_rng)
    first, changed, stop = planner.changes(start, filter_rng)
    truth.change(np.arange(count), changed)
    stops = [Stop(start.strokes, changed)] if changed else []
    lives = [SimulatedLife(now=start.strokes, belief=first, next_stop=stop, stops=[*stops]) for _ in range(count)]
    rows = np.arange(count)
    while len(rows):
        active = [lives[row] for row in rows]
        due = [
            life.next_stop.strokes if interval is None else min(life.now + interval, life.next_stop.change)
            for life in active
        ]
        spaces = [strategy.soonest if len(life.stops) < _MANY else strategy.least_interval for life in active]
        soonest = np.array([life.now for life in active]) + spaces
        ends = np.minimum(np.maximum(due, soonest), strategy.horizon)
        ends[ends > _END * strategy.horizon] = strategy.horizon
        outside = truth.run(rows, active, ends, strategy.limit)
        for life, end, share in zip(active, ends, outside, strict=True):
            life.corrections += int((life.next_stop.corrections.strokes < end).sum())
            life.outside += share * (end - life.now)
            life.now = float(end)
        rows = rows[ends < strategy.horizon]
        _check(planner, truth, rows, [lives[row] for row in rows], filter_rng)
        if progress is not None:
            progress(float(np.mean([life.now for life in lives])) / strategy.horizon)
    return lives


def draw_wears(planner: Planner, start: Belief, count: int, seed: int) -> list[SimulatedWear]:
    """Return worn linkages whose clearances and wear coefficients are drawn from what is known at their start."""
    rows = np.random.default_rng([seed, 3]).integers(len(start.logs), size=count)
    return [SimulatedWear.of(planner.machine, start.new[row], np.exp(start.logs[row])) for row in rows.tolist()]


# ---- inside --------------------------------------------------------------------------------------------------------


class _Population:
    """Linkages that wear, as nobody knows them."""

    def __init__(
        self,
        machine: MaintainedLinkage,
        start: Belief,
        count: int,
        wears: Sequence[SimulatedWear],
        rng: np.random.Generator,
    ) -> None:
        drawn = rng.integers(len(start.logs), size=count)
        self._machine, self._prior, self._rng, self._wears = machine, start.prior, rng, wears
        self._walls = rng.integers(len(wears), size=count)
        self._new, self._growths, self.logs = start.new[drawn], start.growths[drawn], start.logs[drawn]

    def change(self, rows: Numbers, pins: tuple[int, ...]) -> None:
        """Put new bearings into pins of some linkages."""
        for pin in pins:
            new = self._prior.new_bearing(pin, self.logs[rows], self._rng)
            self._new[rows, pin], self.logs[rows, pin] = new
            self._growths[rows, pin] = 0.0

    def run(self, rows: Numbers, lives: list[SimulatedLife], ends: Array, limit: float) -> Array:
        """Wear some linkages until their numbers of strokes, and return the shares of these beyond a limit."""
        machine, rng = self._machine, self._rng
        begins = np.array([life.now for life in lives])
        parts = (np.arange(_LOOKS) + rng.random((len(rows), _LOOKS))) / _LOOKS
        moments = np.concatenate([parts, np.ones((len(rows), 1))], axis=1) * (ends - begins)[:, None]
        growths = self._wear(rows, moments)[:, :-1]
        times = begins[:, None] + moments[:, :-1]
        taken = np.array([life.next_stop.corrections.at(t) for life, t in zip(lives, times, strict=True)])
        q = _commanded(machine, machine.moves(taken))
        tilts = rng.uniform(-1.0, 1.0, (_VISITS, *q.shape[:-1], growths.shape[-1]))
        errors = np.empty((*tilts.shape[:-1], 2))
        for mine, wear in self._by_walls(rows):
            new = np.broadcast_to(self._new[rows[mine], None], growths[mine].shape)
            gaps = wear.watched.at(new, growths[mine], tilts[:, mine])
            errors[:, mine] = tips_of(machine.linkage, q[mine], gaps) - machine.watched.tip
        return np.asarray((np.linalg.norm(errors, axis=-1).max(axis=-1) > limit).mean(axis=(0, 2)))

    def read(self, rows: Numbers, readings: int, noise: float) -> Array:
        """Return (l, k, 2) the mean offsets of the tips of some linkages at the poses of a check [m]."""
        rng, poses = self._rng, self._machine.poses
        tilts = rng.uniform(-1.0, 1.0, (readings, len(rows), len(poses.q), self.logs.shape[1]))
        tips = np.empty((*tilts.shape[:-1], 2))
        for mine, wear in self._by_walls(rows):
            gaps = wear.poses.at(self._new[rows[mine]], self._growths[rows[mine]], tilts[:, mine])
            tips[:, mine] = tips_of(self._machine.linkage, poses.q, gaps) - poses.tip
        return np.asarray((tips + noise * rng.standard_normal(tips.shape)).mean(axis=0))

    def _wear(self, rows: Numbers, moments: Array) -> Array:
        """Let clearances grow by grains of wear, and return (l, n, p) their growths after strokes (l, n)."""
        now, exposures = self._growths[rows], moments[..., None] * np.exp(self.logs[rows])[:, None]
        mean: Array = np.empty(exposures.shape)
        for mine, wear in self._by_walls(rows):
            mean[mine] = wear.history.table.grown(now[mine][:, None], exposures[mine])
        mean = np.diff(mean, axis=1, prepend=now[:, None])
        grain, scatter = self._prior.grain, self._prior.scatter
        if scatter > _NONE:
            # Of the whole interval, with a mean of one.
            mean *= self._rng.gamma(scatter**-2, scatter**2, (len(rows), 1, mean.shape[-1]))
        grown = self._rng.gamma(mean / grain, grain) if grain > _NONE else mean
        history: Array = now[:, None] + grown.cumsum(axis=1)
        self._growths[rows] = history[:, -1]
        return history

    def _by_walls(self, rows: Numbers) -> Iterator[tuple[Numbers, SimulatedWear]]:
        """Give which of some linkages have the same walls, and these."""
        for k, wear in enumerate(self._wears):
            mine = np.flatnonzero(self._walls[rows] == k)
            if len(mine):
                yield mine, wear


def _check(
    planner: Planner, truth: _Population, rows: Numbers, lives: list[SimulatedLife], rng: np.random.Generator
) -> None:
    """Measure some linkages, update what is known of them, and change bearings where that is due."""
    if not lives:
        return
    machine, strategy = planner.machine, planner.strategy
    offsets = truth.read(rows, strategy.readings, strategy.noise)
    before = [life.belief.at(life.now, rng) for life in lives]
    believed = np.array([b.new.mean(axis=0) for b in before]), np.array([b.growths for b in before])
    readings, gaps = np.full(len(machine.poses.q), strategy.readings), machine.pose_gaps
    measured = read_offsets(machine.linkage, machine.poses, gaps, offsets, readings, strategy.noise, believed)
    for row, life, one in zip(rows, lives, measured, strict=True):
        belief = life.belief.updated(life.now, one, rng)
        low, high = np.log(belief.interval(_LEVEL)[1])
        life.covered = tuple(((low < truth.logs[row]) & (truth.logs[row] < high)).tolist())
        life.belief, changed, life.next_stop = planner.changes(belief, rng)
        truth.change(np.array([row]), changed)
        life.stops.append(Stop(life.now, changed))


def _commanded(machine: MaintainedLinkage, moves: Array) -> Array:
    """Return (..., m, n) coordinates of the corrected command; see ``MaintainedLinkage.moves``."""
    linkage, places = machine.linkage, machine.watched
    guess = np.broadcast_to(places.q, (*moves.shape[:-1], places.q.shape[-1]))
    if machine.by_tip:
        return close_pins(linkage, guess, tip=places.tip + moves)
    return close_pins(linkage, guess, drives=places.q[:, list(linkage.driven)] + moves)
