"""The study of the Stanford arm's torques as ``armwright study`` shows it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs

from armwright.cli.study_tables import study_table
from armwright.study.stanford_torque import (
    coefficient_table,
    figure,
    form_table,
    joint_table,
    load_table,
    torques,
)

if TYPE_CHECKING:
    from rich.table import Table


def tables() -> dict[str, Any]:
    """Return the tables as plain data."""
    return {
        "constants": [attrs.asdict(row) for row in coefficient_table()],
        "load": [attrs.asdict(row) for row in load_table()],
        "form of D11": [attrs.asdict(row) for row in form_table()],
        "joints": [attrs.asdict(row) for row in joint_table(torques())],
    }


def figures() -> dict[str, str]:
    """Return figures 3 to 11 by the name of their file."""
    from armwright.report.figures import curves

    found = torques()
    files = {}
    for number in range(3, 12):
        one = figure(found, number)
        title = f"Figure {number}: {one.title}"
        files[f"figure{number:02d}.svg"] = curves(title, one.t, one.curves, x_label="time, s", y_label=one.unit)
    return files


def printed(found: Mapping[str, Any]) -> "Iterator[Table]":
    """Give the tables as a terminal shows them."""
    columns = ("constant", "printed", "computed", "unit", "verdict", "remark")
    yield study_table("Bejczy's model, appendix III", columns, map(_constant, found["constants"]))
    yield study_table("Link 6 with the largest load, appendix II", columns, map(_constant, found["load"]))
    forms = ((row["form"], f"{row['residual']:.4f}", f"{row['share'] * 100:.0f} %") for row in found["form of D11"])
    yield study_table("How well a form of D11 can fit", ("form", "residual, kg m²", "unexplained"), forms)
    joints = (
        (
            str(row["joint"]),
            f"{row['peak']:.2f}",
            f"{row['peak_loaded']:.2f}",
            f"{row['limit']:g} {row['unit']}",
            f"{row['bejczy'] * 100:.0f} %",
            f"{row['load'] * 100:.0f} %",
        )
        for row in found["joints"]
    )
    heads = ("joint", "peak", "peak, loaded", "motor", "Bejczy off by", "load changes")
    yield study_table("Efforts over the motion of figures 3 to 5", heads, joints)


def _constant(row: Mapping[str, Any]) -> Sequence[str]:
    return row["name"], f"{row['printed']:g}", f"{row['computed']:.4g}", row["unit"], row["verdict"], row["note"]
