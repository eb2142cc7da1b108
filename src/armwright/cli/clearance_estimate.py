"""``armwright clearance estimate``: the clearances that measurements determine, and how well."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from armwright.cli.linkages import LinkageName
from armwright.cli.options import Json, OutputFolder, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of


def estimate(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    measured: Annotated[Path, Argument(help="CSV of the tip at rest, or on paths (docs/clearance.md).")],
    sweep: Annotated[
        Path | None, Option(help="Folder of `clearance sweep` with the same paths; for measurements on paths.")
    ] = None,
    noise_um: Annotated[
        float | None,
        Option(help="Standard deviation of a measured coordinate; by default that of repeated readings."),
    ] = None,
    friction: Annotated[
        float | None,
        Option(
            help="At rest: coefficient of friction, which holds journals anywhere in their friction cones; the default "
            "is that of the linkage, and 0 leaves it out."
        ),
    ] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Estimate the clearances of a linkage from readings of its tip at rest, or from its motion on paths.

    At rest a few poses suffice and no simulation is needed. On paths a sweep of simulations relates error curves to
    clearances. The result is a distribution: mean, 90 % interval, correlation, and which parameters are not
    identifiable. Where no clearances explain the data none are reported, and the exit status is 3. With -o the command
    writes summary.json, clearances.svg and a page, report.html.

    **Example:** `armwright clearance estimate five-bar examples/five_bar_rest.csv`
    """
    from armwright.clearance.estimation.assessment import assess_paths, assess_rest
    from armwright.clearance.estimation.measurement_file import RestMeasurement, read_clearance_measurements
    from armwright.clearance.reader import load_linkage
    from armwright.cli.results import warn_of_stray, write_results
    from armwright.errors import InvalidValueError

    warn_of_stray(measured)
    model = load_linkage(linkage)
    measurement = read_clearance_measurements(measured, columns=columns_of(columns), skip_incomplete=skip_incomplete)
    noise = None if noise_um is None else noise_um * 1e-6
    if isinstance(measurement, RestMeasurement):
        assessment = assess_rest(model, measurement, noise, friction=friction)
    elif friction is not None:
        raise usage_error("--friction", "expected readings at rest; on paths friction is that of the sweep")
    elif sweep is None:
        raise usage_error("--sweep", "measurements on paths need a sweep to compare with: `armwright clearance sweep`")
    elif noise is None:
        raise InvalidValueError("--noise-um: expected the standard deviation of a measured coordinate, above 0")
    else:
        with waiting(f"learning from the simulations in {sweep}") as progress:
            assessment = assess_paths(model, measurement, sweep, noise, progress)
    if output is not None:
        from armwright.report.clearance_study_pages import estimate_files

        write_results(output, estimate_files(assessment, name=model.name, command=command_line()))
    print_result(assessment, as_json=as_json, output=output)
