"""``armwright study``: the experiments of the sources, printed numbers beside computed ones."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rich.table import Table

    from armwright.study.stanford_torque import PrintedRow

_STUDIES = {"stanford-torque": "figures 3 to 11 of report TR-83-008, and the constants of Bejczy's model"}


def study(
    name: Annotated[str, typer.Argument(help="Which study: stanford-torque.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the figures (SVG) and the tables (JSON).")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the tables as JSON.")] = False,
) -> None:
    """Run one of the sources' experiments and print its numbers beside ours.

    stanford-torque: the efforts of the Stanford arm over the report's motion by Newton-Euler, by Bejczy's model and
    with the largest load (figures 3 to 11), and every printed constant with a verdict.

    **Example:** `armwright study stanford-torque -o out/stanford-torque`
    """
    import json

    from armwright.errors import UnknownNameError
    from armwright.files.output import write_folder
    from armwright.report.figures import curves
    from armwright.study.stanford_torque import figure, torques

    if name not in _STUDIES:
        raise UnknownNameError("study", name, _STUDIES)
    tables = _tables()
    if output is not None:
        found = torques()
        files = {"tables.json": json.dumps(tables, indent=2, ensure_ascii=False) + "\n"}
        for number in range(3, 12):
            one = figure(found, number)
            title = f"Figure {number}: {one.title}"
            files[f"figure{number:02d}.svg"] = curves(title, one.t, one.curves, x_label="time, s", y_label=one.unit)
        write_folder(output, files)
    if as_json:
        print(json.dumps(tables, indent=2, ensure_ascii=False))
        return
    _print()
    if output is not None:
        print(f"figures: {output}")


def _tables() -> dict[str, Any]:
    import attrs

    from armwright.study.stanford_torque import coefficient_table, form_table, joint_table, load_table, torques

    return {
        "constants": [attrs.asdict(row) for row in coefficient_table()],
        "load": [attrs.asdict(row) for row in load_table()],
        "form of D11": [attrs.asdict(row) for row in form_table()],
        "joints": [attrs.asdict(row) for row in joint_table(torques())],
    }


def _print() -> None:
    from rich.console import Console

    from armwright.study.stanford_torque import coefficient_table, form_table, joint_table, load_table, torques

    console = Console(highlight=False, markup=False)
    columns = ("constant", "printed", "computed", "unit", "verdict", "remark")
    console.print(_table("Bejczy's model, appendix III", columns, map(_printed, coefficient_table())))
    console.print(_table("Link 6 with the largest load, appendix II", columns, map(_printed, load_table())))
    forms = ((row.form, f"{row.residual:.4f}", f"{row.share * 100:.0f} %") for row in form_table())
    console.print(_table("How well a form of D11 can fit", ("form", "residual, kg m²", "unexplained"), forms))
    joints = (
        (
            str(row.joint),
            f"{row.peak:.2f}",
            f"{row.peak_loaded:.2f}",
            f"{row.limit:g} {row.unit}",
            f"{row.bejczy * 100:.0f} %",
            f"{row.load * 100:.0f} %",
        )
        for row in joint_table(torques())
    )
    heads = ("joint", "peak", "peak, loaded", "motor", "Bejczy off by", "load changes")
    console.print(_table("Efforts over the motion of figures 3 to 5", heads, joints))


def _printed(row: "PrintedRow") -> "Sequence[str]":
    return row.name, f"{row.printed:g}", f"{row.computed:.4g}", row.unit, row.verdict, row.note


def _table(title: str, columns: "Sequence[str]", rows: "Iterable[Sequence[str]]") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*row)
    return table
