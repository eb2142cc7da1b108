"""The study of the five-bar with joint clearance: the thesis, tables 5.3 to 5.12, figures 4.6 to 5.13."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar

import attrs

from armwright.clearance.correction import Correction
from armwright.files.result_table import ResultTable
from armwright.report.elements import Tile
from armwright.report.figures import Drawing
from armwright.study import five_bar_clearance as study
from armwright.study.five_bar_figures import figures


@attrs.frozen(kw_only=True, eq=False)
class FiveBarClearance:
    """A parallel arm with clearance in three pins: error curves, their features, clearances estimated from them.

    Attributes:
        swept: the features of 729 linkages, and a model of them.
        repeatability: table 5.3.
        features: table 5.4.
        estimates: tables 5.5 to 5.8.
        targets: table 5.10.
        corrected: the corrected path of table 5.11.
        corrections: table 5.12.
    """

    swept: study.SweepResult
    repeatability: list[study.RepeatRow]
    features: list[study.FeatureRow]
    estimates: list[study.EstimateRow]
    targets: list[study.TargetRow]
    corrected: Correction
    corrections: list[study.TargetRow]

    title: ClassVar[str] = "a parallel arm with clearance in three joints (thesis, tables 5.3 to 5.12)"
    notes: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> "FiveBarClearance":
        """Run the study, which takes a minute."""
        swept = study.run_sweep(progress)
        estimates = study.estimate_table(swept)
        return cls(
            swept=swept,
            repeatability=study.repeat_table(),
            features=study.feature_table(),
            estimates=estimates,
            targets=study.target_table(estimates),
            corrected=study.corrected(estimates, "intercept"),
            corrections=study.correction_table(estimates),
        )

    def as_data(self) -> dict[str, Any]:
        """Return the tables as plain data, by their numbers in the thesis."""
        return {
            "5.3": [row._asdict() for row in self.repeatability],
            "5.4": [row._asdict() for row in self.features],
            "5.5-5.8": [row._asdict() | {"mean": row.mean} for row in self.estimates],
            "5.10": [row._asdict() for row in self.targets],
            "5.11": {"printed": study.PRINTED_NODES, "ours": (self.corrected.nodes * 1e3).tolist()},
            "5.12": [row._asdict() for row in self.corrections],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables, printed beside computed."""
        yield ResultTable(
            title="Table 5.3: repeatability of 30 cycles [mm]; ours leaning in the friction cone and encoder noise",
            heads=("arm", "c2", "c3", "c4", "printed", "ours"),
            rows=[(row.arm, *_fixed((*row.clearances, row.printed, row.ours), 3)) for row in self.repeatability],
        )
        yield ResultTable(
            title="Table 5.4: features of arm A: slope mm/s, intercept mm, amplitude mm",
            heads=("path", "", "slope", "intercept", "amplitude"),
            rows=[
                (path, label, *_fixed(values, 4))
                for row in self.features
                for path, label, values in (
                    (row.path, "printed", row.printed),
                    ("", "ours, speed of centres", row.centre),
                    ("", "ours, speed of surfaces", row.surface),
                )
            ],
        )
        yield ResultTable(
            title="Tables 5.5 to 5.8: estimated clearances [mm] and their accuracy",
            heads=("arm", "method", "", "c2", "c3", "c4", "mean"),
            rows=[line for row in self.estimates for line in _estimate(row)],
        )
        for title, rows in (
            ("Table 5.10: errors at the targets [mm]", self.targets),
            ("Table 5.12: errors of arm A at the targets, path corrected [mm]", self.corrections),
        ):
            yield ResultTable(
                title=title,
                heads=("arm", "case", "", "Q1", "Q2", "Q3", "mean"),
                rows=[line for row in rows for line in _target(row)],
            )
        nodes = zip(("p1", "p3", "p5"), study.PRINTED_NODES, (self.corrected.nodes * 1e3).tolist(), strict=True)
        yield ResultTable(
            title="Table 5.11: nodes of the corrected path [mm]",
            heads=("node", "printed x", "y", "ours x", "y"),
            rows=[(node, *_fixed((*printed, *ours), 3)) for node, printed, ours in nodes],
        )

    def headline(self) -> Iterator[Tile]:
        """Give the accuracy of the clearances estimated best, and the errors of arm A before and after a correction."""
        own = [row for row in self.estimates if row.arm == "A"]
        best = max(own, key=lambda row: row.mean)
        printed = max(row.printed_mean for row in own if row.printed_mean is not None)
        yield Tile(
            f"{best.mean:.2f} %", f"accuracy of the clearances of arm A, by {_method(best)}; printed {printed:.2f} %"
        )
        for row in self.corrections[:2]:
            mean = sum(row.ours) / len(row.ours)
            was = f"; printed {sum(row.printed) / len(row.printed):.3f} mm" if row.printed else ""
            yield Tile(f"{mean:.4f} mm", f"mean error of arm A at the targets, {row.case}{was}")
        yield Tile(str(len(self.swept.points)), "linkages simulated on three paths")

    def figures(self) -> list[Drawing]:
        """Return the thesis' figures."""
        return figures(self.swept, self.corrected)


def _fixed(values: Iterable[float], digits: int) -> Iterator[str]:
    return (f"{x:.{digits}f}" for x in values)


def _method(row: study.EstimateRow) -> str:
    return "amplitude" if row.method == "amp_dc" else row.method


def _estimate(row: study.EstimateRow) -> Iterator[tuple[str, ...]]:
    names = row.arm, _method(row)
    if row.printed is not None:
        yield *names, "printed", *_fixed(row.printed, 3), f"{row.printed_mean:.2f} %"
        names = "", ""
    yield *names, "ours", *_fixed(row.ours, 4), f"{row.mean:.2f} %"


def _target(row: study.TargetRow) -> Iterator[tuple[str, ...]]:
    names = row.arm, row.case
    for label, values in (("printed", row.printed), ("ours", row.ours)):
        if values is not None:
            yield *names, label, *_fixed((*values, sum(values) / len(values)), 4)
            names = "", ""
