"""Simulated lives of a linkage, maintained after a strategy: what a plan is worth.

The simulated linkage is not the one that the plan believes in: its journals lie where the full equilibrium puts them,
its forces and sliding distances are those of all its clearances together, its wear comes in random grains, and friction
holds each journal somewhere else at every visit.

Source:
    Spec of the life, 5.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Numbers, integer
from armwright.clearance.ideal import IdealMotion, close_pins, inverse_dynamics, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.maintenance.belief import Belief
from armwright.clearance.maintenance.maintained_linkage import MaintainedLinkage, Places
from armwright.clearance.maintenance.readings import read_offsets
from armwright.clearance.maintenance.strategy import NextStop, Planner
from armwright.clearance.plane_vectors import rotate
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import force_magnitudes
from armwright.clearance.wear.contact_history import leaning_slips, pin_angles
from armwright.errors import InvalidValueError

# Between two stops the error is looked at after so many numbers of strokes, each time of so many visits.
_LOOKS, _VISITS = 4, 8
# Equilibrium and forces depend a little on each other.
_ROUNDS = 3
# Of the posterior of the wear coefficients.
_LEVEL = 0.9
_MOST_LIVES = 10_000
# Scatters, and grains [m], that are no larger make no difference.
_NONE = 1e-12
# After so many stops they help no longer: then they are at least intervals apart.
_MANY = 30
# What is so near to the horizon is at it, but for rounding.
_END = 1 - 1e-9


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
    seed: int = 0,
    interval: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[SimulatedLife]:
    """Return lives whose true clearances and wear coefficients are drawn from what is known at their start.

    Args:
        planner: whose corrections and changes are made.
        start: what is known.
        count: of the lives.
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
    truth = _Population(machine, start, count, truth_rng)
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


def leaning_tips(  # noqa: PLR0917 - the arrays of an equilibrium
    machine: MaintainedLinkage, places: Places, drives: Array, clearances: Array, tilts: Array, guess: Array
) -> Array:
    """Return (v, ..., m, 2) where the full equilibrium puts the tip [m].

    Args:
        machine: the linkage.
        places: m of them.
        drives: (..., m, d) coordinates of the drives.
        clearances: (..., p) [m].
        tilts: (v, ..., m, p) by which friction turns the journals from the direction of their forces [rad].
        guess: (..., m, n) coordinates near the equilibrium.
    """
    q, gaps = _lean(machine.linkage, places, drives, clearances, guess)
    turned = rotate(np.broadcast_to(gaps, (*tilts.shape, 2)), tilts)
    return tip_position(machine.linkage, close_pins(machine.linkage, q, drives=drives, gaps=turned))


def coupled_rates(machine: MaintainedLinkage, clearances: Array) -> Array:
    """Return (..., p) growth by stroke and wear coefficient with all clearances (..., p) as they are [N/m].

    Forces and sliding distances are those of the equilibrium; only the width of the worn arcs is that of the table.
    """
    linkage, time, motion = machine.linkage, machine.stroke.time, machine.stroke.motion
    drives = motion.q[:, list(linkage.driven)]
    guess = np.broadcast_to(motion.q, (*clearances.shape[:-1], *motion.q.shape))
    q, gaps = _lean(linkage, motion, drives, clearances, guess)
    qd, qdd = np.broadcast_to(motion.qd, q.shape), np.broadcast_to(motion.qdd, q.shape)
    forces = np.linalg.norm(inverse_dynamics(linkage, q, qd, qdd)[1], axis=-1)
    slips = leaning_slips(linkage, time, gaps, pin_angles(linkage, motion.q, motion.qd))
    return np.asarray(np.trapezoid(forces * np.abs(slips), time, axis=-2) * machine.depth_by_work)


# ---- inside --------------------------------------------------------------------------------------------------------


class _Population:
    """Linkages that wear, as nobody knows them."""

    def __init__(self, machine: MaintainedLinkage, start: Belief, count: int, rng: np.random.Generator) -> None:
        drawn = rng.integers(len(start.clearances), size=count)
        self._machine, self._prior, self._rng = machine, start.prior, rng
        self.clearances, self.logs = start.clearances[drawn], start.logs[drawn]
        self._rates = coupled_rates(machine, self.clearances)

    def change(self, rows: Numbers, pins: tuple[int, ...]) -> None:
        """Put new bearings into pins of some linkages."""
        for pin in pins:
            new = self._prior.new_bearing(pin, self.logs[rows], self._rng)
            self.clearances[rows, pin], self.logs[rows, pin] = new

    def run(self, rows: Numbers, lives: list[SimulatedLife], ends: Array, limit: float) -> Array:
        """Wear some linkages until their numbers of strokes, and return the shares of these beyond a limit."""
        machine, rng = self._machine, self._rng
        begins = np.array([life.now for life in lives])
        parts = (np.arange(_LOOKS) + rng.random((len(rows), _LOOKS))) / _LOOKS
        moments = np.concatenate([parts, np.ones((len(rows), 1))], axis=1) * (ends - begins)[:, None]
        clearances = self._wear(rows, moments)[:, :-1]
        times = begins[:, None] + moments[:, :-1]
        believed = np.array([life.next_stop.corrections.at(t) for life, t in zip(lives, times, strict=True)])
        shifts = np.einsum("mip,lnp->lnmi", machine.shift_by_clearance(), believed)
        q = _commanded(machine, shifts)
        tilts = machine.cone * rng.uniform(-1.0, 1.0, (_VISITS, *q.shape[:-1], clearances.shape[-1]))
        drives = q[..., list(machine.linkage.driven)]
        errors = leaning_tips(machine, machine.watched, drives, clearances, tilts, q) - machine.watched.tip
        return np.asarray((np.linalg.norm(errors, axis=-1).max(axis=-1) > limit).mean(axis=(0, 2)))

    def read(self, rows: Numbers, readings: int, noise: float) -> Array:
        """Return (l, k, 2) the mean offsets of the tips of some linkages at the poses of a check [m]."""
        machine, rng, poses = self._machine, self._rng, self._machine.poses
        guess = np.broadcast_to(poses.q, (len(rows), *poses.q.shape))
        drives = guess[..., list(machine.linkage.driven)]
        tilts = machine.cone * rng.uniform(-1.0, 1.0, (readings, *guess.shape[:-1], self.clearances.shape[1]))
        tips = leaning_tips(machine, poses, drives, self.clearances[rows], tilts, guess) - poses.tip
        return np.asarray((tips + noise * rng.standard_normal(tips.shape)).mean(axis=0))

    def _wear(self, rows: Numbers, moments: Array) -> Array:
        """Let clearances grow by grains of wear, and return (l, n, p) them after strokes (l, n)."""
        k, now, end = np.exp(self.logs[rows]), self.clearances[rows], moments[:, -1:]
        # The rates change little until the end, and about evenly.
        first, last = coupled_rates(self._machine, np.stack([now, now + end * k * self._rates[rows]]))
        self._rates[rows] = last
        part, slope = (moments / end)[..., None], (last - first)[:, None]
        mean = np.diff(moments[..., None] * k[:, None] * (first[:, None] + slope * part / 2), axis=1, prepend=0.0)
        grain, scatter = self._prior.grain, self._prior.scatter
        if scatter > _NONE:
            # Of the whole interval, with a mean of one.
            mean *= self._rng.gamma(scatter**-2, scatter**2, (len(rows), 1, mean.shape[-1]))
        grown = self._rng.gamma(mean / grain, grain) if grain > _NONE else mean
        history: Array = now[:, None] + grown.cumsum(axis=1)
        self.clearances[rows] = history[:, -1]
        return history


def _check(
    planner: Planner, truth: _Population, rows: Numbers, lives: list[SimulatedLife], rng: np.random.Generator
) -> None:
    """Measure some linkages, update what is known of them, and change bearings where that is due."""
    if not lives:
        return
    machine, strategy = planner.machine, planner.strategy
    offsets = truth.read(rows, strategy.readings, strategy.noise)
    before = np.array([life.belief.at(life.now, rng).clearances.mean(axis=0) for life in lives])
    readings = np.full(len(machine.poses.q), strategy.readings)
    measured = read_offsets(machine, machine.poses, offsets, readings, strategy.noise, before)
    for row, life, one in zip(rows, lives, measured, strict=True):
        belief = life.belief.updated(life.now, one, rng)
        low, high = np.log(belief.interval(_LEVEL)[1])
        life.covered = tuple(((low < truth.logs[row]) & (truth.logs[row] < high)).tolist())
        life.belief, changed, life.next_stop = planner.changes(belief, rng)
        truth.change(np.array([row]), changed)
        life.stops.append(Stop(life.now, changed))


def _commanded(machine: MaintainedLinkage, shifts: Array) -> Array:
    """Return (..., m, n) coordinates of the corrected command: moved against shifts (..., m, 2) of the tip."""
    linkage, places = machine.linkage, machine.watched
    guess = np.broadcast_to(places.q, (*shifts.shape[:-1], places.q.shape[-1]))
    if machine.by_tip:
        return close_pins(linkage, guess, tip=places.tip - shifts)
    moved = np.einsum("mdi,...mi->...md", machine.drives_by_shift, shifts)
    return close_pins(linkage, guess, drives=places.q[:, list(linkage.driven)] - moved)


def _lean(
    linkage: Linkage, motion: Places | IdealMotion, drives: Array, clearances: Array, guess: Array
) -> tuple[Array, Array]:
    """Return coordinates (..., m, n) and gaps (..., m, p, 2) of journals with clearances (..., p) at their walls."""
    c = clearances[..., None, :]
    stiffness = contact_stiffness(linkage, c)
    q = guess
    for _ in range(_ROUNDS):
        qd, qdd = np.broadcast_to(motion.qd, q.shape), np.broadcast_to(motion.qdd, q.shape)
        reactions = inverse_dynamics(linkage, q, qd, qdd)[1]
        size = force_magnitudes(linkage, reactions)
        gaps = reactions * ((c + (size / stiffness) ** (2 / 3)) / size)[..., None]
        q = close_pins(linkage, q, drives=drives, gaps=gaps)
    return q, gaps
