"""The correction of a path as a result: the commanded nodes, and the errors at its targets before and after."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.correction import Correction, correct_nodes, correct_path
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import PICK_AND_PLACE, PickAndPlace, named_path
from armwright.clearance.predictability import simulate_with_predictability
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Simulation
from armwright.files.result_table import ResultTable


@attrs.frozen(kw_only=True, eq=False)
class CorrectionAssessment:
    """A corrected path, simulated with the mean clearances.

    Attributes:
        linkage: that follows it.
        path: name of the original path.
        correction: its correction.
        clearances: (p,) known, or (s, p) samples of their distribution [m].
        run: on the corrected path, with the mean clearances.
        predictable_until: the time until which this run is a prediction [s].
    """

    linkage: Linkage
    path: str
    correction: Correction
    clearances: Array
    run: Simulation
    predictable_until: float

    def as_data(self) -> dict[str, Any]:
        """Return the correction as plain data in SI units."""
        correction = self.correction
        return {
            "linkage": self.linkage.name,
            "path": self.path,
            "clearances": dict(zip(self.linkage.clearances, self.run.clearances.tolist(), strict=True)),
            "times": list(correction.path.targets),
            "nodes": correction.nodes.tolist(),
            "before": correction.before.mean(axis=0).tolist(),
            "before_spread": correction.before.std(axis=0, ddof=1).tolist(),
            "after": correction.after.mean(axis=0).tolist(),
            "after_spread": correction.after.std(axis=0, ddof=1).tolist(),
            "mean_error": correction.mean_error.tolist(),
            "standard_error": correction.standard_error.tolist(),
            "runs": len(correction.after),
            "sampling": "indistinguishable clearances" if self.clearances.ndim == 1 else "clearances of the estimate",
            "mean_errors": list(correction.history),
            "round": correction.best,
            "predictable_until": self.predictable_until,
        }

    @property
    def notes(self) -> list[str]:
        """The meaning of the errors, and until when they are predictions."""
        data = self.as_data()
        notes = [f"errors are means over {data['runs']} runs with {data['sampling']}, ± their standard deviation"]
        correction = self.correction
        left = np.linalg.norm(correction.mean_error, axis=-1) * 1e6
        known = np.linalg.norm(correction.standard_error, axis=-1) * 1e6
        worst = int(left.argmax())
        notes.append(
            f"of the mean error at most {left[worst]:.2g} ± {known[worst]:.2g} µm (standard error) are left, at t = "
            f"{correction.path.targets[worst]:.4g} s"
        )
        late = [t for t in data["times"] if t > self.predictable_until + 1e-9]
        if late:
            notes.append(
                f"predictable until t = {self.predictable_until:.4g} s: at the {len(late)} later times the mean error "
                f"over these runs is corrected, and a single run deviates from it by their spread"
            )
        return notes

    def tables(self) -> Iterator[ResultTable]:
        """Give the nodes and their errors before and after the correction."""
        data = self.as_data()
        columns = (data[name] for name in ("before", "before_spread", "after", "after_spread"))
        yield ResultTable(
            title="",
            heads=("time s", "command x mm", "y mm", "error before mm", "± mm", "after mm", "± mm"),
            rows=[
                (f"{t:.4g}", *(f"{x * 1e3:z.4f}" for x in node), *(f"{x * 1e3:.4f}" for x in errors))
                for t, node, *errors in zip(data["times"], data["nodes"], *columns, strict=True)
            ],
            numbers=range(7),
        )


def assess_correction(
    linkage: Linkage,
    path: str,
    clearances: Array,
    settings: Settings,
    *,
    knots: int = 20,
    rounds: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> CorrectionAssessment:
    """Correct a path by its name, and simulate it with the mean clearances.

    Args:
        linkage: with p pins.
        path: see ``named_path``; of pick-and-place the nodes are moved, of others the entire path.
        clearances: (p,) known, or (s, p) samples of their distribution [m].
        settings: of the simulations.
        knots: of the shift of an entire path.
        rounds: how often the path is moved; when left out, 3 times of pick-and-place and 5 times of others.
        progress: called with the mean error after each simulation [m].

    Raises:
        UnknownNameError: there is no such path.
        InvalidValueError: see ``correct_path``.
    """
    if path == PICK_AND_PLACE:
        correction = correct_nodes(
            linkage, PickAndPlace(), clearances, settings, rounds=3 if rounds is None else rounds, progress=progress
        )
    else:
        goal = named_path(path)
        correction = correct_path(
            linkage, goal, clearances, settings, knots=knots, rounds=5 if rounds is None else rounds, progress=progress
        )
    mean = np.atleast_2d(clearances).mean(axis=0)
    run, predictability = simulate_with_predictability(prepare_scenario(linkage, correction.path, settings), mean)
    return CorrectionAssessment(
        linkage=linkage,
        path=path,
        correction=correction,
        clearances=clearances,
        run=run,
        predictable_until=predictability.until,
    )
