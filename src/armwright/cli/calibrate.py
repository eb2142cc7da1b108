"""``armwright calibrate``: a better arm from measured points."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from armwright.calibration.measurements import Measurements
    from armwright.report.calibrated import Calibrated


def calibrate(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: Annotated[str, typer.Argument(help="Name in the catalogue, an arm file or a URDF.", show_default=False)],
    measured: Annotated[
        Path, typer.Argument(help="CSV of joints and measured points (docs/calibration.md).", show_default=False)
    ],
    units: Annotated[
        str | None, typer.Option(help="Of a file whose header has none: mm,deg.", show_default=False)
    ] = None,
    tool_mm: Annotated[
        str | None, typer.Option(help="The measured point in the frame of the hand: 0,0,31.", show_default=False)
    ] = None,
    folds: Annotated[int, typer.Option(help="Parts in which points are held out to see how good it is.")] = 5,
    seed: Annotated[int, typer.Option(help="Of the parts.")] = 0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the arm (TOML, URDF), errors, report and figures.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON, in SI units.")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but errors.")] = False,
) -> None:
    """Find the errors of an arm from points that its tool was measured at, and write the corrected arm.

    Prints which errors were found and how well, which cannot be told and why, and how far held-out points are off
    before and after. The corrected arm has a Denavit-Hartenberg table like the one given.

    **Example:** `armwright calibrate ur5 examples/ur5_points.csv -o out/calibrated`
    """
    import json

    from armwright.arm.load import load_arm
    from armwright.calibration.measurements import read_measurements
    from armwright.files.output import write_folder
    from armwright.report.calibrated import as_data, calibrated, calibrated_files

    model = load_arm(arm)
    if tool_mm is not None:
        model = _with_tool(model, tool_mm)
    points = read_measurements(measured, model, units=_units(units))
    found = _found(model, points, folds, seed, calibrated, watched=not (quiet or as_json))
    if output is not None:
        write_folder(output, calibrated_files(found, title=f"{model.name}, {measured.name}"))
    if as_json:
        print(json.dumps(as_data(found), indent=2))
    elif not quiet:
        _print(found)
        if output is not None:
            print(f"report: {output / 'report.html'}")


def _with_tool(model: Any, text: str) -> Any:
    """Return an arm whose tool is a point of its hand."""
    import attrs
    import numpy as np

    from armwright.spatial.poses import pose

    try:
        place = [float(x) * 1e-3 for x in text.split(",")]
    except ValueError:
        place = []
    if len(place) != 3 or not all(map(math.isfinite, place)):
        raise typer.BadParameter(f"expected three numbers such as 0,0,31, got {text}", param_hint="--tool-mm")
    return attrs.evolve(model, tool=pose(np.eye(3), place))


def _units(text: str | None) -> tuple[str, str] | None:
    if text is None:
        return None
    parts = tuple(part.strip() for part in text.split(","))
    if len(parts) != 2:
        raise typer.BadParameter(f"expected a length and an angle such as mm,deg, got {text}", param_hint="--units")
    return parts[0], parts[1]


def _found(model: Any, points: "Measurements", folds: int, seed: int, work: Any, *, watched: bool) -> "Calibrated":
    """Calibrate, with a word on the screen while a person waits."""
    from contextlib import nullcontext

    from rich.console import Console

    console = Console(stderr=True)
    status = console.status("calibrating") if watched and console.is_terminal else None
    with status or nullcontext():
        result: Calibrated = work(
            model, points, folds=folds, seed=seed, progress=status.update if status is not None else None
        )
    return result


def _print(found: "Calibrated") -> None:
    from rich.console import Console

    from armwright.cli.study_tables import study_table
    from armwright.report.calibrated import distances, shown_errors

    console = Console(markup=False, highlight=False)
    console.print(
        study_table(f"{found.arm.name}: errors found", ("error", "value", "±", "unit"), shown_errors(found.full))
    )
    held = ((one.name, one.why) for one in found.full.held)
    console.print(study_table("Not fitted", ("error", "why"), held))
    rows = ((name, f"{x.mean() * 1e3:.4f}", f"{x.max() * 1e3:.4f}") for name, x in distances(found).items())
    console.print(study_table("Distance of the points", ("", "mean mm", "largest mm"), rows))
    for note in found.notes:
        console.print(note)
