"""``armwright calibrate``: identify the geometric errors of an arm from measured points."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from armwright.cli.failures import outcome
from armwright.cli.numbers import units_of
from armwright.cli.options import ArmName, Json, OutputFolder, Quiet
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, Units, columns_of
from armwright.cli.tool_options import MeasuredPoint, with_tool
from armwright.errors import DoubtfulError


def calibrate(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    measured: Annotated[Path, Argument(help="CSV of joint positions and measured points (docs/calibration.md).")],
    units: Units = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    tool_mm: MeasuredPoint = None,
    folds: Annotated[int, Option(help="Folds of the cross-validation over joint configurations.")] = 5,
    seed: Annotated[int, Option(min=0, help="Seed of the division into folds.")] = 0,
    beyond: Annotated[
        bool,
        Option(
            "--beyond", help="Also try compliance about three axes, transmission error and a model of the residuals."
        ),
    ] = False,
    noise_um: Annotated[
        float | None,
        Option(help="Standard deviation of a measured coordinate; larger residuals are then reported."),
    ] = None,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Identify the geometric errors of an arm from measured points of its tool, and write the corrected arm.

    The measurements may be points, poses, touched planes and distances, alone or together. The command prints the
    identified errors with their standard errors, which errors are not identifiable and why, and the errors at held-out
    configurations before and after. Measurements that contradict the arm end the command with status 3: those of
    another arm at once, doubtful results with the reasons after everything is printed and written. With -o the command
    writes the corrected arm (TOML, URDF, tables), its errors, a report and figures.

    **Example:** `armwright calibrate puma560-seed examples/puma_points.csv -o out/calibrated`
    """
    from armwright.arm.load import load_arm
    from armwright.arrays import one_core
    from armwright.calibration.assessment import assess_calibration
    from armwright.calibration.measurements import read_measurements
    from armwright.report.calibration_files import calibration_files

    model = with_tool(load_arm(arm), tool_mm)
    warn_of_stray(measured)
    measurements = read_measurements(
        measured, model, units=units_of(units), columns=columns_of(columns), skip_incomplete=skip_incomplete
    )
    with waiting("calibrating", quiet=quiet or as_json) as progress, one_core():
        noise = None if noise_um is None else noise_um * 1e-6
        assessment = assess_calibration(
            model, measurements, folds=folds, seed=seed, nongeometric=beyond, noise=noise, progress=progress
        )
    if output is not None:
        title = f"{model.name}, {measured.name}"
        write_results(output, calibration_files(assessment, title=title, command=command_line()))
    reasons = assessment.contradictions
    doubtful = DoubtfulError(f"the measurements contradict the arm: {'; '.join(reasons)}") if reasons else None
    print_result(assessment, as_json=as_json, quiet=quiet, output=output, head=outcome(doubtful))
    if doubtful is not None:
        raise doubtful
