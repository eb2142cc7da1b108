"""The strategy: when the next check is due, which corrections of the path come before it, and which bearing to change.

The path is corrected for the mean clearances, ahead by half of what they will grow until it is corrected again, which
takes no stop. The error that is left is that of the spread, and of friction; the next check is due when it passes the
limit with the probability alpha. Where a check and a correction no longer help for long, a bearing is changed.

Source:
    Spec of the life, 5.
"""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, in_range, integer, not_negative, positive
from armwright.clearance.maintenance.belief import Belief
from armwright.clearance.maintenance.maintained_linkage import MaintainedLinkage
from armwright.errors import InvalidValueError

# The mean clearances move the tip by at most this part of the limit from where the correction holds it.
_DRIFT_SHARE = 0.2
# Strokes at which the probability is computed, twice: over all, and between the two that it passes alpha.
_COARSE, _FINE = 12, 8
# Corrections in a horizon at most, and strokes at which the mean drift is computed.
_MOST_CORRECTIONS, _DRIFT_POINTS = 500, 40
_HORIZONS = (1.0, 1e15)
_LEAST_ALPHA, _MOST_STOPS, _MOST_READINGS = 1e-3, 1000, 1000


@attrs.frozen(kw_only=True)
class Strategy:
    """What a plan is to achieve, and what a check can do.

    Attributes:
        limit: of the error of the tip along the corrected path [m].
        alpha: probability of an error beyond it at which a check is due.
        horizon: strokes that are planned.
        least_interval: strokes for which a check at least should help; where it does not, a bearing is changed.
        change_at: clearance at which a bearing is changed in any case [m].
        noise: standard deviation of one coordinate of a reading [m].
        readings: of each pose in a check, each approached anew.
    """

    limit: float
    alpha: float
    horizon: float
    least_interval: float
    change_at: float = np.inf
    noise: float = 1e-5
    readings: int = 5

    def __attrs_post_init__(self) -> None:
        """Check the ranges."""
        positive(self.limit, "limit", "m")
        in_range(self.horizon, _HORIZONS, "horizon", "strokes")
        positive(self.least_interval, "least interval", "strokes")
        positive(self.noise, "noise", "m")
        if integer(self.readings, "readings", least=1) > _MOST_READINGS:
            raise InvalidValueError(f"readings: expected 1 to {_MOST_READINGS}, got {self.readings}")
        if self.noise > self.limit * np.sqrt(self.readings):
            raise InvalidValueError(
                f"noise: the mean of {self.readings} readings is known worse than the limit; expected at most "
                f"{self.limit * np.sqrt(self.readings) * 1e6:.3g} um, got {self.noise * 1e6:g} um"
            )
        if not _LEAST_ALPHA <= not_negative(self.alpha, "alpha") <= 0.5:
            raise InvalidValueError(f"alpha: expected {_LEAST_ALPHA:g} to 0.5, got {self.alpha:g}")
        if self.horizon / self.least_interval > _MOST_STOPS:
            raise InvalidValueError(
                f"least interval: expected at least 1/{_MOST_STOPS} of the horizon, "
                f"{self.horizon / _MOST_STOPS:g} strokes, got {self.least_interval:g}"
            )
        if not self.least_interval <= self.horizon:
            raise InvalidValueError(
                f"least interval: expected at most the horizon, {self.horizon:g} strokes, got {self.least_interval:g}"
            )
        if not self.change_at > 0:
            raise InvalidValueError(f"change at: expected a clearance above 0, got {self.change_at * 1e3:g} mm")

    @property
    def soonest(self) -> float:
        """Strokes that lie between two stops at least."""
        return self.least_interval / 10


class Corrections(NamedTuple):
    """Corrected paths, each from its number of strokes to the next.

    Attributes:
        strokes: (j,) increasing.
        clearances: (j, p) for which they are corrected [m].
        taken: (j, m, 2) the shift of the tip that they take away [m].
    """

    strokes: Array
    clearances: Array
    taken: Array

    def at(self, strokes: Array) -> Array:
        """Return (n, m, 2) the shift of the tip that is taken away after strokes (n,)."""
        rows = np.searchsorted(self.strokes, strokes, side="right") - 1
        return np.asarray(self.taken[np.maximum(rows, 0)])


@attrs.frozen(kw_only=True, eq=False)
class NextStop:
    """Until when nothing has to be measured.

    Attributes:
        strokes: at which the next check is due; infinite where none is within the horizon.
        change: strokes at which the first mean clearance reaches that of a change; infinite likewise.
        corrections: until then, and after.
        times: (n,) strokes at which the probability was computed.
        probabilities: (n,) of an error beyond the limit there.
    """

    strokes: float
    change: float
    corrections: Corrections
    times: Array
    probabilities: Array


@attrs.frozen(kw_only=True, eq=False)
class Planner:
    """Plans for one linkage and one strategy, always with the same random numbers.

    Attributes:
        machine: the linkage on its path.
        strategy: to follow.
        growth_noise: (s, p) standard normal numbers.
        tilts: (s, m, p) where in its friction cone each journal is, from -1 to 1.
    """

    machine: MaintainedLinkage
    strategy: Strategy
    growth_noise: Array
    tilts: Array

    @classmethod
    def of(cls, machine: MaintainedLinkage, strategy: Strategy, samples: int = 1000, seed: int = 0) -> Planner:
        """Return the planner for beliefs of so many samples."""
        rng = np.random.default_rng([seed, 1])
        pins = len(machine.linkage.pins)
        return cls(
            machine=machine,
            strategy=strategy,
            growth_noise=rng.standard_normal((samples, pins)),
            tilts=rng.uniform(-1.0, 1.0, (samples, len(machine.watched.q), pins)),
        )

    def corrections(self, belief: Belief) -> Corrections:
        """Return the corrected paths for the mean clearances, from now to the horizon."""
        now, end = belief.strokes, max(self.strategy.horizon, belief.strokes * (1 + 1e-9))
        times = now + np.linspace(0.0, 1.0, _DRIFT_POINTS) ** 2 * (end - now)
        new, means = belief.new.mean(axis=0), belief.growths_after(times, np.zeros_like(belief.growths)).mean(axis=1)
        shifts = self.machine.taken(new, means)
        drift = np.maximum.accumulate(np.linalg.norm(shifts - shifts[0], axis=-1).max(axis=-1))
        step = 2 * _DRIFT_SHARE * self.strategy.limit
        count = min(int(drift[-1] / step) + 1, _MOST_CORRECTIONS)
        # Where the drift stands still its inverse has no value.
        rising = np.append(True, np.diff(drift) > 0)
        starts, middles = (
            np.interp(step * (np.arange(count) + part), drift[rising], times[rising]) for part in (0.0, 0.5)
        )
        growths = np.stack([np.interp(middles, times, column) for column in means.T], axis=-1)
        return Corrections(starts, new + growths, self.machine.taken(new, growths))

    def probabilities(self, belief: Belief, corrections: Corrections, times: Array) -> Array:
        """Return (n,) the probability that a stroke is out of limit anywhere, after strokes (n,)."""
        machine, growths = self.machine, belief.growths_after(times, self.growth_noise)
        # For the mean growths: shifts along are in proportion to each growth, those across alike.
        means = growths.mean(axis=1)
        along, by_clearance, across = machine.shifts.at(means)
        first = machine.shifts.along[0]
        slopes = (along - first) / np.maximum(means, np.finfo(float).tiny)[:, None, None]
        new = belief.new - machine.linkage.clearance_array(None)
        errors = np.einsum("nmip,nsp->imns", slopes, growths, optimize=True)
        errors += np.einsum("nmip,sp->imns", by_clearance, new, optimize=True)
        errors += np.einsum("nmip,smp->imns", across, self.tilts, optimize=True)
        errors += np.einsum("nmi->imn", first.sum(axis=-1) - corrections.at(times))[..., None]
        squares = (errors[0] ** 2 + errors[1] ** 2).max(axis=0)
        return np.asarray((squares > self.strategy.limit**2).mean(axis=1))

    def next_stop(self, belief: Belief) -> NextStop:
        """Return when the next check is due; at the latest when a mean clearance reaches that of a change."""
        strategy, now = self.strategy, belief.strokes
        corrections = self.corrections(belief)
        if now + strategy.soonest >= strategy.horizon:
            return NextStop(
                strokes=np.inf,
                change=np.inf,
                corrections=corrections,
                times=np.array([now]),
                probabilities=np.zeros(1),
            )
        times = now + np.append(0.0, np.geomspace(strategy.soonest, strategy.horizon - now, _COARSE))
        probabilities = self.probabilities(belief, corrections, times)
        over = np.flatnonzero(probabilities >= strategy.alpha)
        due = np.inf
        if len(over) and over[0] == 0:
            due = now
        elif len(over):
            between = np.linspace(times[over[0] - 1], times[over[0]], _FINE + 2)
            finer = np.concatenate(
                [
                    [probabilities[over[0] - 1]],
                    self.probabilities(belief, corrections, between[1:-1]),
                    [probabilities[over[0]]],
                ]
            )
            k = int(np.flatnonzero(finer >= strategy.alpha)[0])
            part = (strategy.alpha - finer[k - 1]) / (finer[k] - finer[k - 1])
            due = float(between[k - 1] + part * (between[k] - between[k - 1]))
            times = np.append(times, between[1:-1])
            probabilities = np.append(probabilities, finer[1:-1])
        order = np.argsort(times)
        change = self._change_due(belief)
        due = min(due, change)
        return NextStop(
            strokes=due if due < strategy.horizon else np.inf,
            change=change,
            corrections=corrections,
            times=times[order],
            probabilities=probabilities[order],
        )

    def changes(self, belief: Belief, rng: np.random.Generator) -> tuple[Belief, tuple[int, ...], NextStop]:
        """Return what is known after the bearings that are due were changed, their numbers, and the next stop."""
        strategy, changed = self.strategy, []
        enough = min(belief.strokes + strategy.least_interval, strategy.horizon)
        beyond = self._means_at(belief, belief.strokes + strategy.least_interval) > strategy.change_at
        for pin in np.flatnonzero(beyond).tolist():
            belief = belief.with_new_bearing(pin, rng)
            changed.append(pin)
        stop = self.next_stop(belief)
        while min(stop.strokes, strategy.horizon) < enough:
            tried = {}
            for pin in set(range(len(beyond))) - set(changed):
                other = belief.with_new_bearing(pin, rng)
                tried[pin] = other, self.next_stop(other)
            # What helps for less than two stops lie apart may be chance.
            least = stop.strokes + strategy.soonest
            better = {pin: result for pin, result in tried.items() if result[1].strokes > least}
            if not better:
                break
            pin = max(better, key=lambda k: better[k][1].strokes)
            belief, stop = better[pin]
            changed.append(pin)
        return belief, tuple(changed), stop

    def _change_due(self, belief: Belief) -> float:
        """Return the strokes after which a mean clearance reaches that at which its bearing is changed."""
        strategy = self.strategy
        if not np.isfinite(strategy.change_at):
            return np.inf
        times = np.linspace(belief.strokes, strategy.horizon, _DRIFT_POINTS)
        means = belief.forecast(times, np.zeros_like(belief.growths)).mean(axis=1).max(axis=-1)
        over = np.flatnonzero(means >= strategy.change_at)
        if not len(over):
            return np.inf
        k = int(over[0])
        if k == 0:
            return belief.strokes
        part = (strategy.change_at - means[k - 1]) / (means[k] - means[k - 1])
        return float(times[k - 1] + part * (times[k] - times[k - 1]))

    def _means_at(self, belief: Belief, strokes: float) -> Array:
        """Return (p,) mean clearances after strokes [m]."""
        return np.asarray(belief.forecast(np.array([strokes]), np.zeros_like(belief.growths))[0].mean(axis=0))
