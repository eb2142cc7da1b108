"""How many strokes a wearing linkage lives until its tip passes a limit, and how well that is known."""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np

from armwright.arrays import Array, finite_or_none
from armwright.reliability.linkage_wear import Measure, WearingLinkage
from armwright.reliability.weighted_draws import WeightedDraws

# Of lives, what these parts of linkages do not reach: 0.1 is the B10 life, 0.5 the B50 life.
PARTS = (0.05, 0.1, 0.5, 0.95)
# Points of curves over the strokes; beyond the quantile of this part there are few lives.
_CURVE, _LAST = 60, 0.95
# The tenth of the wear coefficients that wear slowest, and that which wears fastest: about the 5 and 95 % quantiles.
_TENTH = 0.1


@attrs.frozen(kw_only=True, eq=False)
class LinkageLife:
    """Lives of random linkages until a measure of the tip passes a limit.

    Attributes:
        wearing: the linkage, with m pins.
        measure: ``error`` of the tip at the worst pose, or its ``RP``.
        limit: of it [m].
        draws: n linkages.
        strokes: (n,) until the limit; infinite where it is never passed, 0 of a new linkage beyond it.
    """

    wearing: WearingLinkage
    measure: Measure
    limit: float
    draws: WeightedDraws
    strokes: Array

    @classmethod
    def of(cls, wearing: WearingLinkage, measure: Measure, limit: float, draws: WeightedDraws) -> LinkageLife:
        """Return the lives of drawn linkages."""
        strokes = wearing.lives(measure, limit, draws.z)
        return cls(wearing=wearing, measure=measure, limit=limit, draws=draws, strokes=strokes)

    def quantile(self, part: float) -> float:
        """Return the strokes that this part of the linkages does not reach."""
        return float(self.draws.quantile(self.strokes, part))

    def probability(self, strokes: float) -> tuple[float, float]:
        """Return the probability of a life of no more than some strokes, and its standard error."""
        return self.draws.probability(np.asarray(self.strokes <= strokes))

    def interval(self, part: float) -> tuple[float, float]:
        """Return the 90 % interval of a quantile of lives, where the wear coefficient is one number that is not known.

        Its ends are the quantiles among linkages whose wear coefficient is at its 95 and its 5 % quantile. Where every
        pin has its own, these are the quantiles of what the coefficients together make of lives.
        """
        found = sorted(float(rows.quantile(strokes, part)) for strokes, rows in self._ends)
        return found[0], found[-1]

    def curve(self) -> tuple[Array, Array, Array]:
        """Return strokes (c,), the probability of a life of no more (c,), and its band (2, c); see ``interval``."""
        end = self.quantile(_LAST)
        finite = self.strokes[np.isfinite(self.strokes)]
        if not np.isfinite(end):
            end = float(finite.max()) if len(finite) else 1.0
        strokes = np.linspace(0.0, max(1.2 * end, 1.0), _CURVE)
        band = [_cumulative(lives, rows.weights, strokes) for lives, rows in self._ends]
        ends = np.stack([np.min(band, axis=0), np.max(band, axis=0)])
        return strokes, _cumulative(self.strokes, self.draws.weights, strokes), ends

    def values(self, strokes: Array, parts: tuple[float, ...] = (0.05, 0.5, 0.95)) -> Array:
        """Return (q, c) what parts of the linkages do not exceed of the measure after strokes (c,) [m]."""
        rows = self.draws.first_set
        found = [
            rows.quantile(self.wearing.measure(self.measure, rows.z, np.full(len(rows.z), count)).max(axis=1), parts)
            for count in strokes.tolist()
        ]
        return np.array(found).T

    def pin_parts(self) -> Array:
        """Return (m,) the mean part of the wear of each pin in the growth of the error where it passes the limit."""
        lived = np.isfinite(self.strokes) & (self.strokes > 0)
        if not lived.any():
            return np.zeros(len(self.wearing.linkage.pins))
        parts = self.wearing.pin_parts(self.draws.z[lived], self.strokes[lived])
        weights = self.draws.weights[lived]
        return np.asarray(weights @ parts / weights.sum())

    @cached_property
    def _ends(self) -> list[tuple[Array, WeightedDraws]]:
        """Lives and draws of linkages that wear as fast as the 95 % quantile of wear coefficients, and as the 5 % one.

        They are those of the fastest and the slowest tenth, with wear coefficients moved to the middle of it: strokes
        times wear coefficients decide what is worn.
        """
        lived = np.isfinite(self.strokes) & (self.strokes > 0)
        if not self.wearing.spread or not lived.any():
            return [(self.strokes, self.draws)]
        first = len(self.wearing.random.names)
        numbers, slopes = self.draws.z[:, first:], np.array([-self.wearing.spread])
        if self.wearing.each:
            # Clearances count too: after measurements they and the wear coefficients depend on each other.
            design = np.concatenate([np.ones((len(numbers), 1)), self.draws.z], axis=1)[lived]
            weights = np.sqrt(self.draws.weights[lived])
            found = np.linalg.lstsq(design * weights[:, None], np.log(self.strokes[lived]) * weights, rcond=None)[0]
            slopes = found[1 + first :]
        logs = numbers @ slopes
        order = np.argsort(logs, kind="stable")
        total = np.cumsum(self.draws.weights[order])
        ends = []
        for where in (order[total <= _TENTH], order[total > 1 - _TENTH]):
            rows = self.draws.among(where)
            ends.append((self.strokes[where] * np.exp(rows.quantile(logs[where], 0.5) - logs[where]), rows))
        return ends

    def as_data(self) -> dict[str, object]:
        """Return the lives as plain data in SI units; what never ends is None."""
        strokes, probability, band = self.curve()
        return {
            "measure": self.measure,
            "limit": self.limit,
            "strokes": {
                f"{part:g}": {
                    "value": finite_or_none(self.quantile(part)),
                    "interval": [finite_or_none(end) for end in self.interval(part)],
                    "sampling_error": finite_or_none(self.draws.quantile_error(self.strokes, part)),
                }
                for part in PARTS
            },
            "pins": dict(zip(self.wearing.linkage.clearances, self.pin_parts().tolist(), strict=True)),
            "curve": {
                "strokes": strokes.tolist(),
                "probability": probability.tolist(),
                "low": band[0].tolist(),
                "high": band[1].tolist(),
            },
        }


def _cumulative(values: Array, weights: Array, at: Array) -> Array:
    """Return (c,) the weighted part of some values that is not above numbers (c,)."""
    order = np.argsort(values, kind="stable")
    total = np.concatenate([[0.0], np.cumsum(weights[order])])
    return np.asarray(total[np.searchsorted(values[order], at, side="right")] / total[-1])
