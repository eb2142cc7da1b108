"""The study of the calibrated three-joint arm as ``armwright study`` shows it."""

import math
from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from armwright.cli.study_tables import study_table
from armwright.study import dh_calibration as study

if TYPE_CHECKING:
    from rich.table import Table


@cache
def _rows() -> list[study.Row]:
    return study.verification_table()


def tables() -> dict[str, Any]:
    """Return the tables as plain data."""
    return {
        "2.4": [row._asdict() | {"mean": row.mean} for row in _rows()],
        "parameters": [
            dict(zip(("name", "true", "thesis", "ours", "deviation"), row, strict=True))
            for row in study.parameter_table()
        ],
    }


def figures() -> dict[str, str | bytes]:
    """Return a picture of the errors at the verification points."""
    from armwright.report.figures import bars

    rows = [row for row in _rows() if row.points in ("none", "flat", "all three")]
    names = [f"{x}, {y}, {z}" for x, y, z in study.PRINTED_POINTS]
    values = {f"{row.model}, {row.points} boards" if row.model == "complete" else row.model: row.ours for row in rows}
    title = "Errors at the verification points: as said, the thesis' fit, the complete model"
    return {"verification.svg": bars(title, names, values, y_label="error, mm", logarithmic=True)}


def printed(found: Mapping[str, Any]) -> "Iterator[Table]":
    """Give the tables as a terminal shows them."""
    yield study_table(
        f"Table 2.4: errors at six verification points [mm]; ours simulated, cameras with {study.NOISE * 1e3:g} mm",
        ("fit", "", *(f"P{i}" for i in range(1, 7)), "mean", "better"),
        (line for row in found["2.4"] for line in _lines(row, found["2.4"][0])),
    )
    yield study_table(
        "Errors of the arm: true, by the thesis' fit on the flat board, by the complete model on all three",
        ("error", "unit", "true", "thesis", "ours", "±"),
        map(_parameter, found["parameters"]),
    )


def _lines(row: Mapping[str, Any], first: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for label, values, before in (("printed", row["printed"], first["printed"]), ("ours", row["ours"], first["ours"])):
        if values is None:
            continue
        mean = sum(values) / len(values)
        top = label == "printed" or row["printed"] is None
        better = 100 * (1 - mean / (sum(before) / len(before)))
        yield (
            (row["model"] if row is first else f"{row['model']}, {row['points']}") if top else "",
            label,
            *(f"{x:.3g}" for x in values),
            f"{mean:.3g}",
            f"{better:.0f} %" if row is not first else "",
        )


def _parameter(row: Mapping[str, Any]) -> tuple[str, ...]:
    part = row["name"].partition(".")[2]
    scale, unit = (1e3, "mm") if part in ("d", "a", "x", "y", "z") else (180 / math.pi, "deg")

    def shown(x: float | None) -> str:
        return "held" if x is None else f"{x * scale:+z.3f}"

    deviation = "" if row["deviation"] is None else f"{row['deviation'] * scale:.3f}"
    thesis = "" if row["thesis"] is None else f"{row['thesis'] * scale:+z.3f}"
    return row["name"], unit, shown(row["true"]), thesis, shown(row["ours"]), deviation
