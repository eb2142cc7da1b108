"""The study of the five-bar with play as ``armwright study`` shows it."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from armwright.cli.progress import parts
from armwright.cli.study_tables import study_table
from armwright.study import five_bar_clearance as study

if TYPE_CHECKING:
    from rich.table import Table


@cache
def _learnt() -> study.Learnt:
    """Simulate and learn, with a bar when a person watches."""
    with parts() as told:
        return study.learnt(told)


@cache
def _estimates() -> list[study.EstimateRow]:
    return study.estimate_table(_learnt())


def tables() -> dict[str, Any]:
    """Return the tables as plain data, by their numbers in the thesis."""
    estimates = _estimates()
    return {
        "5.3": [row._asdict() for row in study.repeat_table()],
        "5.4": [row._asdict() for row in study.feature_table()],
        "5.5-5.8": [row._asdict() | {"mean": row.mean} for row in estimates],
        "5.10": [row._asdict() for row in study.target_table(estimates)],
        "5.11": {
            "printed": study.PRINTED_NODES,
            "ours": (study.corrected(estimates, "intercept").nodes * 1e3).tolist(),
        },
        "5.12": [row._asdict() for row in study.correction_table(estimates)],
    }


def figures() -> dict[str, str | bytes]:
    """Return the thesis' figures by the name of their file."""
    from armwright.cli.study_five_bar_figures import drawn

    return drawn(_learnt(), _estimates())


def printed(found: Mapping[str, Any]) -> "Iterator[Table]":
    """Give the tables as a terminal shows them."""
    yield study_table(
        "Table 5.3: repeatability of 30 cycles [mm]; ours with leaning in the friction cone and encoder noise",
        ("arm", "c2", "c3", "c4", "printed", "ours"),
        (
            (row["arm"], *(f"{c:.3f}" for c in row["clearances"]), f"{row['printed']:.3f}", f"{row['ours']:.3f}")
            for row in found["5.3"]
        ),
    )
    yield study_table(
        "Table 5.4: features of arm A: slope mm/s, intercept mm, amplitude mm",
        ("path", "", "slope", "intercept", "amplitude"),
        (
            (row["path"] if kind == "printed" else "", label, *(f"{x:.4f}" for x in row[kind]))
            for row in found["5.4"]
            for kind, label in (
                ("printed", "printed"),
                ("centre", "ours, speed of centres"),
                ("surface", "ours, speed of surfaces"),
            )
        ),
    )
    yield study_table(
        "Tables 5.5 to 5.8: estimated clearances [mm] and how near they come",
        ("arm", "by", "", "c2", "c3", "c4", "mean"),
        (line for row in found["5.5-5.8"] for line in _estimate_lines(row)),
    )
    for title, key in (
        ("Table 5.10: errors at the targets [mm]", "5.10"),
        ("Table 5.12: errors of arm A at the targets, path corrected [mm]", "5.12"),
    ):
        yield study_table(
            title,
            ("arm", "case", "", "Q1", "Q2", "Q3", "mean"),
            (line for row in found[key] for line in _target_lines(row)),
        )
    nodes = (
        (f"p{2 * i + 1}", *(f"{x:.3f}" for x in theirs), *(f"{x:.3f}" for x in ours))
        for i, (theirs, ours) in enumerate(zip(found["5.11"]["printed"], found["5.11"]["ours"], strict=True))
    )
    yield study_table("Table 5.11: nodes of the corrected path [mm]", ("node", "printed x", "y", "ours x", "y"), nodes)


def _estimate_lines(row: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    name = "amplitude" if row["way"] == "amp_dc" else row["way"]
    theirs = row["printed"]
    if theirs is not None:
        yield row["arm"], name, "printed", *(f"{x:.3f}" for x in theirs), f"{row['printed_mean']:.2f} %"
    yield (
        "" if theirs else row["arm"],
        "" if theirs else name,
        "ours",
        *(f"{x:.4f}" for x in row["ours"]),
        f"{row['mean']:.2f} %",
    )


def _target_lines(row: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for label, values in (("printed", row["printed"]), ("ours", row["ours"])):
        if values is not None:
            first = label == "printed" or row["printed"] is None
            mean = sum(values) / len(values)
            yield (
                row["arm"] if first else "",
                row["case"] if first else "",
                label,
                *(f"{x:.4f}" for x in values),
                f"{mean:.4f}",
            )
