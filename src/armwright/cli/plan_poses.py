"""``armwright plan-poses``: the poses at which an arm should be measured."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.measured_point import MeasuredPoint, with_tool
from armwright.cli.numbers import units_of
from armwright.cli.options import ArmName, Json
from armwright.cli.output import plain_console, print_json, print_table, table
from armwright.cli.shell_completion import one_of
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.calibration.experiment_design import MeasurementPlan


def plan_poses(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    count: Annotated[int, typer.Option("-n", "--count", help="How many poses.")] = 30,
    index: Annotated[
        str,
        typer.Option(
            help="What is to be large: O1 to O5 (docs/calibration.md).",
            autocompletion=one_of("O1", "O2", "O3", "O4", "O5"),
        ),
    ] = "O1",
    seed: Annotated[int, typer.Option(min=0, help="Of the candidates.")] = 0,
    turns: Annotated[bool, typer.Option("--turns", help="Turns are measured too, not places alone.")] = False,
    after: Annotated[
        Path | None, typer.Option(help="CSV of what was measured already: the poses that tell most beside it.")
    ] = None,
    units: Annotated[str | None, typer.Option(help="Of that file, if its header has none: mm,deg.")] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    tool_mm: MeasuredPoint = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="CSV of the poses, to be measured and given to calibrate.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Propose poses inside the limits whose measured points tell most of an arm's errors.

    The CSV has a column for every joint; add `x_mm, y_mm, z_mm`, where the tool was measured, and calibrate.

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
    plan = planned(model, count, index=index, seed=seed, rotations=turns, measured=measured)  # type: ignore[arg-type]
    if output is not None:
        write_file(output, _csv(model, plan))
    if as_json:
        print_json(_as_data(plan))
    else:
        _print(model, plan)
        if output is not None:
            print(f"poses: {output}")


def _as_data(plan: "MeasurementPlan") -> dict[str, Any]:
    return {
        "q": plan.q.tolist(),
        "tells": list(plan.names),
        "observability": plan.observability._asdict(),
        "by chance": plan.random._asdict(),
    }


def _columns(model: "Arm") -> list[tuple[str, float]]:
    """Return the names of the columns and how many of their units are one in SI."""
    import math

    return [
        (f"joint_{i}_deg", 180 / math.pi) if joint.revolute else (f"joint_{i}_mm", 1e3)
        for i, joint in enumerate(model.joints, 1)
    ]


def _csv(model: "Arm", plan: "MeasurementPlan") -> str:
    columns = _columns(model)
    rows = [",".join(f"{x * scale:z.4f}" for x, (_, scale) in zip(q, columns, strict=True)) for q in plan.q]
    return "\n".join([",".join(name for name, _ in columns), *rows]) + "\n"


def _print(model: "Arm", plan: "MeasurementPlan") -> None:
    console = plain_console()
    console.print(f"{len(plan.q)} poses of {model.name} tell {len(plan.names)} errors:")
    console.print(", ".join(plan.names))
    rows = zip(plan.observability._fields, plan.observability, plan.random, strict=True)
    shown = ((name, f"{ours:.4g}", f"{chance:.4g}") for name, ours, chance in rows)
    print_table(console, table(("index", "these poses", "by chance"), shown))
