"""``armwright plan-poses``: propose configurations at which an arm should be measured."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Option

from armwright.cli.numbers import units_of
from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_result
from armwright.cli.tables import ColumnMap, SkipIncomplete, Units, columns_of
from armwright.cli.tool_options import MeasuredPoint, with_tool

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.calibration.experiment_design import MeasurementPlan


def plan_poses(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    count: Annotated[int, Option("-n", "--count", help="Number of poses.")] = 30,
    index: Annotated[
        Literal["O1", "O2", "O3", "O4", "O5"],
        Option(help="Observability index to maximize: O1 to O5 (docs/calibration.md)."),
    ] = "O1",
    seed: Annotated[int, Option(min=0, help="Seed of the candidates.")] = 0,
    orientations: Annotated[
        bool, Option("--orientations", help="Orientations are measured too, not positions alone.")
    ] = False,
    after: Annotated[Path | None, Option(help="CSV of measurements to which the poses are added.")] = None,
    units: Units = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    tool_mm: MeasuredPoint = None,
    output: Annotated[
        Path | None,
        Option("-o", "--output", help="CSV of the poses, to be completed by measurements for calibrate."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Propose measurement configurations at which the errors of an arm are most observable.

    The configurations are within the limits. The CSV has a column for every joint; add the measured positions of the
    tool as `x_mm, y_mm, z_mm` and calibrate.

    **Example:** `armwright plan-poses puma560 -n 30 -o out/poses.csv`
    """
    from armwright.arm.load import load_arm
    from armwright.calibration.experiment_design import plan_poses as planned
    from armwright.calibration.measurements import read_measurements
    from armwright.cli.results import warn_of_stray
    from armwright.files.output import write_file

    model = with_tool(load_arm(arm), tool_mm)
    measured = None
    if after is not None:
        warn_of_stray(after)
        measured = read_measurements(
            after, model, units=units_of(units), columns=columns_of(columns), skip_incomplete=skip_incomplete
        ).q
    plan = planned(model, count, index=index, seed=seed, rotations=orientations, measured=measured)
    if output is not None:
        write_file(output, _csv(model, plan))
    print_result(plan, as_json=as_json)
    if output is not None and not as_json:
        print(f"poses: {output}")


def _csv(model: "Arm", plan: "MeasurementPlan") -> str:
    from armwright.cli.joints import units

    heads = [f"joint_{i}_{joint.units.display}" for i, joint in enumerate(model.joints, 1)]
    rows = [",".join(f"{x:z.4f}" for x in q / units(model)) for q in plan.q]
    return "\n".join([",".join(heads), *rows]) + "\n"
