"""``armwright iso9283``: the performance characteristics of ISO 9283 from measured poses and paths."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from armwright.cli.failures import outcome
from armwright.cli.numbers import Named, named_numbers
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of
from armwright.errors import CheckFailedError, TooFewError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from armwright.accuracy.assessment import Assessment
    from armwright.accuracy.characteristics import Characteristic
    from armwright.accuracy.measurement_file import AnyTest


def iso9283(  # noqa: PLR0917 - Typer reads one parameter per option
    files: Annotated[list[Path], Argument(help="Measurements as CSV (docs/iso9283.md), in one or several files.")],
    output: OutputFolder = None,
    few: Annotated[
        bool, Option("--few", help="Accept fewer cycles than the standard requires; the results are marked.")
    ] = False,
    band_mm: Annotated[
        float | None,
        Option(help="Radius in mm within which a pose counts as attained; the default is RP of the same pose."),
    ] = None,
    corners_mm: Annotated[
        float, Option(help="Distance in mm from a corner within which AT and RT are not evaluated.")
    ] = 0.0,
    limit: Annotated[
        list[str] | None, Option(help="Limit of a characteristic, as in RP=0.05mm; may be repeated.")
    ] = None,
    about: Annotated[
        list[str] | None,
        Option(
            help="Condition of the tests for the report, as in robot='PUMA 560, no. 7'; may be repeated: robot, load, "
            "speed, temperature, instrument, operator, date."
        ),
    ] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Print the performance characteristics of ISO 9283 from measured poses and paths.

    Accuracy and repeatability of poses (AP, RP, vAP), of distances (AD, RD) and of paths (AT, RT, AV, RV, FV),
    stabilization and overshoot (t, OV, TP), corners (CR, CO), drift, exchangeability, compliance and weaving, each with
    its number of cycles. A test with fewer cycles than the standard requires is refused without --few. A characteristic
    that exceeds its --limit ends the command with exit status 5 after everything is printed and written. With -o the
    command writes report.html, measures.json and figures (SVG); conditions that are not stated with --about are lines
    to fill in by hand on the page.

    **Example:** `armwright iso9283 examples/measured_poses.csv -o out/iso9283`
    """
    import attrs

    from armwright.accuracy.measurement_file import read_measurements
    from armwright.report.accuracy_files import accuracy_files

    if band_mm is not None and not 0 < band_mm < float("inf"):
        raise usage_error("--band-mm", f"expected a number above 0, got {band_mm:g}")
    if not 0 <= corners_mm < float("inf"):
        raise usage_error("--corners-mm", f"expected 0 or a number above 0, got {corners_mm:g}")
    bounds, said = _bounds(limit or []), _conditions(about or [])
    for path in files:
        warn_of_stray(path)
    tests = read_measurements(files, columns=columns_of(columns), skip_incomplete=skip_incomplete)
    assessment = _assessed(tests, bounds, few=few, band_mm=band_mm, corners_mm=corners_mm)
    assessment = attrs.evolve(assessment, about=said)
    if output is not None:
        title = f"ISO 9283: {', '.join(path.name for path in files)}"
        write_results(output, accuracy_files(assessment, title=title, command=command_line()))
    exceeded = CheckFailedError(_exceeded(assessment.exceeded)) if assessment.exceeded else None
    print_result(assessment, as_json=as_json, quiet=quiet, output=output, head=outcome(exceeded))
    if exceeded is not None:
        raise exceeded


def _exceeded(measures: "Sequence[Characteristic]") -> str:
    """Return a message with the characteristics that exceed their limits, and by how much."""
    exceeded = []
    for measure in measures:
        unit, condition = measure.displayed_unit, f", {measure.condition}" if measure.condition else ""
        exceeded.append(
            f"{measure.symbol} of {measure.test} {measure.name}{condition} is {measure.displayed_value} {unit}, "
            f"and at most {measure.displayed_limit} {unit} is allowed"
        )
    return f"limit exceeded: {'; '.join(exceeded)}"


def _assessed(
    tests: "Sequence[AnyTest]", bounds: "Mapping[str, Named]", *, few: bool, band_mm: float | None, corners_mm: float
) -> "Assessment":
    """Compute all characteristics and compare them with their limits."""
    from armwright.accuracy.assessment import assess

    try:
        assessment = assess(tests, few=few, band=None if band_mm is None else band_mm * 1e-3, corners=corners_mm * 1e-3)
        return assessment.with_limits({symbol: _in_si(assessment, *bound) for symbol, bound in bounds.items()})
    except TooFewError as error:
        raise TooFewError(str(error).replace("few=True", "--few")) from error


def _bounds(texts: list[str]) -> dict[str, Named]:
    """Read limits such as ``RP=0.05mm``, by symbol."""
    expected = "a symbol and a number with its unit, RP=0.05mm"
    bounds = named_numbers(texts, None, expected, "--limit")
    for text, bound in zip(texts, bounds.values(), strict=True):
        if not 0 <= bound.value < float("inf"):
            raise usage_error("--limit", f"expected {expected}, got {text}")
    return bounds


def _conditions(texts: list[str]) -> dict[str, str]:
    """Read conditions such as ``robot=PUMA 560``, by name."""
    from armwright.accuracy.assessment import CONDITIONS

    said: dict[str, str] = {}
    for text in texts:
        name, mark, words = (part.strip() for part in text.partition("="))
        if not mark or not words or name not in CONDITIONS:
            raise usage_error(
                "--about", f"expected one of {', '.join(CONDITIONS)} with a text, load='2 kg'; got {text}"
            )
        if name in said:
            raise usage_error("--about", f"{name} is said twice")
        said[name] = words
    return said


def _in_si(assessment: "Assessment", symbol: str, value: float, unit: str) -> float:
    """Return a limit in SI units; the unit must be that in which the characteristic is printed."""
    from armwright.errors import one_of

    measures = {measure.symbol: measure for measure in assessment.measures}
    measure = measures[one_of("measure", symbol, measures)]
    shown = measure.displayed_unit
    if unit != shown:
        raise usage_error("--limit", f"{symbol} is in {shown}: {symbol}={value:g}{shown}, got '{unit}'")
    return value / measure.scale
