"""The drives of a prepared path as a table over time, and CSV text of numbers, for other simulators."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from armwright.arrays import Array
from armwright.clearance.scenario import Scenario

# Both sides of a jump stand so far beside it [s].
_BESIDE = 1e-10


def drive_table(scenario: Scenario, prescribed: Array) -> Array:
    """Return (k, 1 + d) times and efforts of the drives [s, N m, N]; between them they are linear.

    At a jump stands the mean of both sides, between them: an implicit rule that takes the end of one step for the start
    of the next keeps its order so.

    Args:
        scenario: the prepared path, without a controller.
        prescribed: (s + 1, d) at each step what a drive gets whose motion is prescribed, instead of an effort.
    """
    table = scenario.table
    starts = np.concatenate([[0.0], np.cumsum(scenario.lengths)])
    before, after = np.concatenate([table[:1, 0], table[:, 2]]), np.concatenate([table[:, 0], table[-1:, 2]])
    jumps = np.flatnonzero(np.any(before != after, axis=-1))
    times = np.concatenate([starts, starts[jumps] - _BESIDE, starts[jumps] + _BESIDE])
    values = np.concatenate([(before + after) / 2, before[jumps], after[jumps]])
    order = np.argsort(times, kind="stable")
    times, values = times[order], values[order]
    steps = np.arange(scenario.steps + 1) * scenario.h
    for k, drive in enumerate(scenario.linkage.drives):
        if drive.kind == "motion":
            values[:, k] = np.interp(times, steps, prescribed[:, k])
    return np.column_stack([times, values])


def csv_text(heads: Iterable[str], rows: Array) -> str:
    """Return a table as CSV, every number to the last bit; what cannot stand in a head becomes an underscore."""
    cells = ("".join(c if c.isprintable() and c not in ',"' else "_" for c in head) for head in heads)
    lines = [",".join(cells), *(",".join(f"{x:.17g}" for x in row) for row in rows)]
    return "\n".join(lines) + "\n"
