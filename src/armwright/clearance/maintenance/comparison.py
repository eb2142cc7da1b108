"""Ways of maintenance compared by simulated lives: after a plan, and with checks at equal distances."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.maintenance.belief import Belief
from armwright.clearance.maintenance.simulated_lives import SimulatedLife, draw_wears, simulate_lives
from armwright.clearance.maintenance.strategy import Planner

# Checks in a horizon with which a plan is compared, fewest first.
FIXED_CHECKS = (0, 1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24)


@attrs.frozen(kw_only=True, eq=False)
class Maintained:
    """What simulated lives from now on came to, maintained in one way.

    Attributes:
        checks: in the horizon at equal distances; None for the plan.
        lives: simulated.
        strokes: of each.
    """

    checks: int | None
    lives: Sequence[SimulatedLife]
    strokes: float

    @property
    def stops(self) -> Array:
        """(l,) number of stops of each life."""
        return np.array([float(len(life.stops)) for life in self.lives])

    @property
    def outside(self) -> Array:
        """(l,) share of strokes out of limit of each life."""
        return np.array([life.outside / self.strokes for life in self.lives])

    @property
    def corrections(self) -> Array:
        """(l,) number of corrected paths of each life."""
        return np.array([float(life.corrections) for life in self.lives])

    @property
    def changes(self) -> Array:
        """(l,) number of changed bearings of each life."""
        return np.array([float(sum(len(stop.changed) for stop in life.stops)) for life in self.lives])

    @property
    def covered(self) -> float | None:
        """Share of the intervals of wear coefficients that hold the true ones; None where nothing was measured."""
        held = [one for life in self.lives for one in life.covered]
        return float(np.mean(held)) if held else None

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "checks": self.checks,
            "interval": None if self.checks is None else self.strokes / (self.checks + 1),
            **{
                name: {"mean": float(values.mean()), "standard_error": standard_error(values)}
                for name, values in (
                    ("stops", self.stops),
                    ("corrections", self.corrections),
                    ("changes", self.changes),
                    ("outside", self.outside),
                )
            },
            "covered": self.covered,
        }


def compare_ways(
    planner: Planner, belief: Belief, count: int, seed: int, progress: Callable[[int, int], None] | None
) -> Iterator[Maintained]:
    """Give lives maintained after the plan, then with checks at equal distances, until these are as safe.

    Args:
        planner: of the linkage.
        belief: what is known now.
        count: of the lives of each way.
        seed: of all random numbers; all ways meet the same linkages.
        progress: called with the number of simulated hundredths, and of all.
    """
    wears = draw_wears(planner, belief, math.ceil(math.sqrt(count)), seed)
    left, total = planner.strategy.horizon - belief.strokes, 100 * (1 + len(FIXED_CHECKS))

    def maintained(number: int | None, turn: int) -> Maintained:
        def advance(part: float) -> None:
            if progress is not None:
                progress(100 * turn + round(100 * part), total)

        interval = None if number is None else left / (number + 1)
        lives = simulate_lives(planner, belief, count, wears=wears, seed=seed, interval=interval, progress=advance)
        return Maintained(checks=number, lives=lives, strokes=left)

    plan = maintained(None, 0)
    yield plan
    # Far fewer checks than those of the plan are not as safe, wherever they are.
    fewest = max(0.0, np.floor(plan.stops.mean() - plan.changes.mean() - 1))
    for turn, number in enumerate(FIXED_CHECKS, 1):
        if number >= fewest:
            fixed = maintained(number, turn)
            yield fixed
            if fixed.outside.mean() <= plan.outside.mean():
                return


def standard_error(values: Array) -> float:
    """Return the standard error of the mean of values (l,)."""
    return float(values.std(ddof=1) / np.sqrt(len(values)))
