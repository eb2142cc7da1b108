"""The study of the calibrated three-joint arm: the thesis, section 2.3, table 2.4."""

import math
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import attrs

from armwright.files.result_table import ResultTable
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, bar_chart
from armwright.study.dh_calibration import NOISE, PRINTED_POINTS, ParameterRow, Row, parameter_table, verification_table


@attrs.frozen(kw_only=True, eq=False)
class DhCalibration:
    """A three-joint arm that touches a board of 33 points in three orientations.

    Attributes:
        verification: errors at the verification points, printed and simulated.
        parameters: errors of the arm: true, by the thesis' fit, by a complete model.
    """

    verification: list[Row]
    parameters: list[ParameterRow]

    title: ClassVar[str] = "calibration of a three-joint arm (thesis, section 2.3)"
    notes: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> "DhCalibration":  # noqa: ARG003 - takes seconds
        """Run the study."""
        return cls(verification=verification_table(), parameters=parameter_table())

    def as_data(self) -> dict[str, Any]:
        """Return the tables as plain data."""
        return {
            "2.4": [row._asdict() | {"mean": row.mean} for row in self.verification],
            "parameters": [row._asdict() for row in self.parameters],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables, printed beside simulated."""
        nominal = self.verification[0]
        yield ResultTable(
            title=f"Table 2.4: errors at six verification points [mm]; ours simulated, cameras with {NOISE * 1e3:g} mm",
            heads=("fit", "", *(f"P{i}" for i in range(1, 7)), "mean", "better"),
            rows=(line for row in self.verification for line in _verification(row, nominal)),
        )
        yield ResultTable(
            title="Errors of the arm: true, by the thesis' fit on the flat board, by the complete model on all three",
            heads=("error", "unit", "true", "thesis", "ours", "±"),
            rows=map(_parameter, self.parameters),
        )

    def headline(self) -> Iterator[Tile]:
        """Give the mean error of the nominal arm, of the thesis' best fit, and of the complete model."""
        nominal, *fits = self.verification
        yield Tile(f"{nominal.mean:.1f} mm", "mean error at six points, nominal arm (simulated)")
        for model in ("thesis", "complete"):
            best = min((row for row in fits if row.model == model), key=lambda row: row.mean)
            name = "the thesis' fit" if model == "thesis" else "the complete model"
            yield Tile(f"{best.mean:.3g} mm", f"with {name}, {best.points}")
        printed = min(sum(row.printed) / len(row.printed) for row in fits if row.printed)
        yield Tile(f"{printed:.1f} mm", "printed: best fit of the thesis, on its own arm")

    def figures(self) -> list[Drawing]:
        """Return a picture of the errors at the verification points."""
        names = [f"{x}, {y}, {z}" for x, y, z in PRINTED_POINTS]
        values = {
            f"{row.model}, {row.points} boards" if row.model == "complete" else row.model: row.ours
            for row in self.verification
            if row.points in ("none", "flat", "all three")
        }
        title = "Errors at the verification points: nominal arm, the thesis' fit, the complete model"
        svg = bar_chart(title, names, values, y_label="error, mm", logarithmic=True)
        return [Drawing("verification", title, svg)]


def _verification(row: Row, nominal: Row) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a fit: the numbers of the thesis, and ours."""
    name = row.model if row is nominal else f"{row.model}, {row.points}"
    for label, values, before in (("printed", row.printed, nominal.printed), ("ours", row.ours, nominal.ours)):
        if values is None or before is None:
            continue
        mean = sum(values) / len(values)
        better = 100 * (1 - mean / (sum(before) / len(before)))
        yield (
            name if label == "printed" or row.printed is None else "",
            label,
            *(f"{x:.3g}" for x in values),
            f"{mean:.3g}",
            f"{better:.0f} %" if row is not nominal else "",
        )


def _parameter(row: ParameterRow) -> tuple[str, ...]:
    part = row.name.partition(".")[2]
    scale, unit = (1e3, "mm") if part in ("d", "a", "x", "y", "z") else (180 / math.pi, "deg")

    def shown(x: float | None, spec: str, absent: str = "") -> str:
        return absent if x is None else format(x * scale, spec)

    true, thesis, ours = shown(row.true, "+z.3f"), shown(row.thesis, "+z.3f"), shown(row.ours, "+z.3f", "fixed")
    return row.name, unit, true, thesis, ours, shown(row.standard_error, ".3f")
