"""The summary of a sweep: until when its runs are predictions, and which features are dominated by random variation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.feature_sweep import FeatureSweep, is_random
from armwright.clearance.features import Features
from armwright.clearance.paths import thesis_path
from armwright.files.result_table import ResultTable

if TYPE_CHECKING:
    from xarray import Dataset


@attrs.frozen(kw_only=True)
class SweepSummary:
    """The summary of a sweep of simulations.

    Attributes:
        runs: number of linkages.
        failed: number of linkages whose simulation diverged.
        paths: names of the test paths.
        folder: folder of the sweep.
        chaos: by path, until when half of the runs and all runs are predictions [s], the duration [s], and the
            features that random variation dominates.
    """

    runs: int
    failed: int
    paths: tuple[str, ...]
    folder: Path
    chaos: Mapping[str, Mapping[str, Any]]

    @property
    def notes(self) -> tuple[str, ...]:
        """The number of runs, and for each path until when they are predictions."""
        failures = f", {self.failed} of them failed" if self.failed else ""
        notes = [f"{self.runs} linkages on {', '.join(self.paths)}{failures}: {self.folder}"]
        for path, limits in self.chaos.items():
            random = f"; dominated by random variation: {', '.join(limits['chance'])}" if limits["chance"] else ""
            notes.append(
                f"{path}: predictable until t = {limits['until']:.4g} s in half of the runs, "
                f"{limits['earliest']:.4g} s in all, of {limits['duration']:.4g} s{random}"
            )
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return the summary as plain data in SI units."""
        return {**attrs.asdict(self), "paths": list(self.paths), "folder": str(self.folder)}

    def tables(self) -> Iterator[ResultTable]:
        """Yield no tables: the notes contain everything."""
        return iter(())


def sweep_summary(task: FeatureSweep, results: Dataset, folder: Path) -> SweepSummary:
    """Return the summary of the results of a sweep in a folder."""
    done = results["status"].to_numpy() == 0
    paths = task.paths if task.replicates and done.any() else ()

    def numbers(name: str) -> Array:
        return np.asarray(results[name].to_numpy()[done])

    chaos = {
        path: {
            "until": float(np.median(numbers(f"{path}_until"))),
            "earliest": float(numbers(f"{path}_until").min()),
            "duration": thesis_path(path).duration,
            "chance": [
                name
                for name in Features._fields
                if is_random(numbers(f"{path}_{name}"), numbers(f"{path}_{name}_spread"), task.replicates + 1)
            ],
        }
        for path in paths
    }
    return SweepSummary(runs=len(done), failed=int((~done).sum()), paths=task.paths, folder=folder, chaos=chaos)
