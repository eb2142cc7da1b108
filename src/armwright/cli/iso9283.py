"""``armwright iso9283``: what measured poses and paths say of a robot, by the definitions of ISO 9283."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.failures import outcome
from armwright.cli.numbers import Named, named_numbers
from armwright.cli.options import Json, Quiet
from armwright.cli.output import command_line, json_text, plain_console, print_json, print_table
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of
from armwright.errors import CheckFailedError, TooFewError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from armwright.accuracy.assessment import Assessment
    from armwright.accuracy.characteristics import Measure
    from armwright.accuracy.measurement_file import AnyTest


def iso9283(  # noqa: PLR0917 - Typer reads one parameter per option
    files: Annotated[
        list[Path], typer.Argument(help="Measurements, CSV (docs/iso9283.md); several may belong together.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for report.html, measures.json and the figures (SVG).")
    ] = None,
    few: Annotated[
        bool, typer.Option("--few", help="Take fewer cycles than the standard asks for, and say so.")
    ] = False,
    band_mm: Annotated[
        float | None,
        typer.Option(help="What counts as reached; RP of the same pose without it.", show_default=False),
    ] = None,
    corners_mm: Annotated[float, typer.Option(help="How near to a corner AT and RT are not taken.")] = 0.0,
    limit: Annotated[
        list[str] | None,
        typer.Option(help="What a measure should keep: RP=0.05mm; may be repeated.", show_default=False),
    ] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Print the measures of ISO 9283 that measured poses and paths allow, with the cycles of each.

    Accuracy and repeatability of poses (AP, RP, vAP), of distances (AD, RD) and of paths (AT, RT, AV, RV, FV), coming
    to rest (t, OV, TP), corners (CR, CO), drift, exchangeability, compliance and weaving. A test with fewer cycles than
    the standard asks for is refused unless --few is given. A measure that exceeds its --limit ends the command with
    exit status 5, after everything is printed and written.

    **Example:** `armwright iso9283 examples/measured_poses.csv -o out/iso9283`
    """
    from armwright.accuracy.measurement_file import read_measurements

    _refuse_no_lengths(band_mm, corners_mm)
    bounds = _bounds(limit or [])
    for path in files:
        warn_of_stray(path)
    tests = read_measurements(files, columns=columns_of(columns), skip_incomplete=skip_incomplete)
    found = _assessed(tests, bounds, few=few, band_mm=band_mm, corners_mm=corners_mm)
    plain = _plain(found)
    if output is not None:
        write_results(output, _files(found, files, plain))
    exceeded = CheckFailedError(_exceeded(found.exceeded)) if found.exceeded else None
    if as_json:
        print_json({**outcome(exceeded), **plain})
    elif not quiet:
        _print(found)
        if output is not None:
            print(f"report: {output / 'report.html'}")
    if exceeded is not None:
        raise exceeded


def _exceeded(measures: "Sequence[Measure]") -> str:
    """Say which measures exceed their limits, and by how much."""
    from armwright.report.accuracy_page import shown_measure

    told = []
    for one in measures:
        seen = shown_measure(one)
        unit = seen.unit
        of = f"{one.test} {one.name}{f', {one.condition}' if one.condition else ''}"
        told.append(f"{one.symbol} of {of} is {seen.value} {unit}, and at most {seen.limit} {seen.unit} is allowed")
    return f"limit exceeded: {'; '.join(told)}"


def _refuse_no_lengths(band_mm: float | None, corners_mm: float) -> None:
    """Refuse a band or a distance from corners that is none."""
    for name, value, valid in (
        ("--band-mm", band_mm, band_mm is None or 0 < band_mm < float("inf")),
        ("--corners-mm", corners_mm, 0 <= corners_mm < float("inf")),
    ):
        if not valid:
            raise typer.BadParameter(f"expected a number above 0, got {value:g}", param_hint=name)


def _assessed(
    tests: "Sequence[AnyTest]", bounds: "Mapping[str, Named]", *, few: bool, band_mm: float | None, corners_mm: float
) -> "Assessment":
    """Work out all measures and compare them with their limits."""
    from armwright.accuracy.assessment import assess

    try:
        found = assess(tests, few=few, band=None if band_mm is None else band_mm * 1e-3, corners=corners_mm * 1e-3)
        return found.within({symbol: _in_si(found, *bound) for symbol, bound in bounds.items()})
    except TooFewError as error:
        raise TooFewError(str(error).replace("few=True takes", "--few takes")) from error


def _bounds(texts: list[str]) -> dict[str, Named]:
    """Read limits such as ``RP=0.05mm``, by symbol."""
    expected = "a symbol and a number with its unit, RP=0.05mm"
    bounds = named_numbers(texts, None, expected, "--limit")
    for text, bound in zip(texts, bounds.values(), strict=True):
        if not 0 <= bound.value < float("inf"):
            raise typer.BadParameter(f"expected {expected}, got {text}", param_hint="--limit")
    return bounds


def _in_si(found: "Assessment", symbol: str, value: float, unit: str) -> float:
    """Return a limit in SI units."""
    from armwright.errors import one_of
    from armwright.report.accuracy_page import unit_scale

    units = {one.symbol: one.unit for one in found.measures}
    shown, scale = unit_scale(units[one_of("measure", symbol, units)])
    if unit != shown:
        raise typer.BadParameter(
            f"{symbol} is in {shown}: {symbol}={value:g}{shown}, got '{unit}'", param_hint="--limit"
        )
    return value / scale


def _plain(found: "Assessment") -> dict[str, Any]:
    """Return an assessment as plain data in SI units; what is infinite is none."""
    from math import isfinite

    import attrs

    from armwright.report.accuracy_page import notes_of

    measures = [
        {**attrs.asdict(one), "value": one.value if isfinite(one.value) else None, "few": one.few, "holds": one.holds}
        for one in found.measures
    ]
    return {"standard": "ISO 9283:1998", "planar": found.planar, "notes": notes_of(found), "measures": measures}


def _files(found: "Assessment", files: list[Path], plain: dict[str, Any]) -> dict[str, str]:
    """Return the files of an assessment by name."""
    from armwright.report.accuracy_figures import drawings
    from armwright.report.accuracy_page import accuracy_page

    drawn = drawings(found)
    title = f"ISO 9283: {', '.join(path.name for path in files)}"
    return {
        "measures.json": json_text(plain) + "\n",
        "report.html": accuracy_page(found, drawn, title=title, command=command_line()),
        **{f"{one.name}.svg": one.svg for one in drawn},
    }


def _print(found: "Assessment") -> None:
    from itertools import groupby

    from rich import box
    from rich.table import Table

    from armwright.report.accuracy_page import notes_of

    console = plain_console()
    bounded = any(one.limit is not None for one in found.measures)
    for (test, name, condition), measures in groupby(found.measures, lambda one: (one.test, one.name, one.condition)):
        title = f"{test} {name}{f', {condition}' if condition else ''}"
        table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
        table.add_column("symbol", min_width=6)
        table.add_column("measure", min_width=27, overflow="fold")
        table.add_column("value", min_width=10, justify="right", no_wrap=True)
        table.add_column("unit", min_width=4)
        table.add_column("n", min_width=2, justify="right")
        if bounded:
            table.add_column("limit", justify="right")
        table.add_column("remark", overflow="fold")
        for one in measures:
            table.add_row(*_row(one, bounded=bounded))
        print_table(console, table)
    for note in notes_of(found):
        console.print(note)


def _row(one: "Measure", *, bounded: bool) -> "list[Any]":
    from rich.text import Text

    from armwright.report.accuracy_page import shown_measure

    seen = shown_measure(one)
    verdict = Text(seen.verdict, style="bold red" if seen.verdict == "exceeds" else "")
    note = Text(" ").join(part for part in (verdict, Text(one.note)) if part)
    # What stands below its whole needs no words: AP_x below AP.
    what = "" if "_" in one.symbol else one.what
    return [one.symbol, what, seen.value, seen.unit, seen.cycles, *([seen.limit] if bounded else []), note]
