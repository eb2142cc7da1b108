"""``armwright clearance vibration``: how a linkage with joint clearance rattles on its paths and after them."""

from typing import Annotated

from typer import Option

from armwright.cli.linkages import (
    ClearanceOfAll,
    Clearances,
    ContactLawName,
    ControlName,
    Friction,
    FrictionLawName,
    FrictionVelocity,
    IntegratorName,
    LinkageName,
    SpeedRpm,
    Step,
    Threshold,
    path_of,
    settings_of,
    with_clearances,
)
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import counting
from armwright.cli.results import write_results
from armwright.cli.shell_completion import listed_in, paths


def vibration(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    path: Annotated[
        list[str] | None,
        Option(help="Path for the tip; may be repeated. The default is all 24 test paths.", autocompletion=paths),
    ] = None,
    speed_rpm: SpeedRpm = None,
    by: Annotated[
        str,
        Option(
            help="Quantity by which paths are ranked: loss, motion-rms, dwell-rms, force, impacts, flight ...",
            autocompletion=listed_in("armwright.clearance.vibration.assessment", "QUANTITIES"),
        ),
    ] = "loss",
    dwell_ms: Annotated[float, Option(help="How long the tip is watched after a path, with locked drives.")] = 50.0,
    aim: Annotated[
        bool, Option("--aim", help="Search the move law of the path with the least loss in impacts, and correct it.")
    ] = False,
    goal_mm: Annotated[float, Option(help="With --aim: largest mean distance of the tip from its goal, in mm.")] = 0.05,
    clearance: Clearances = None,
    clearance_mm: ClearanceOfAll = None,
    friction: Friction = None,
    friction_law: FrictionLawName = "linear",
    friction_velocity: FrictionVelocity = "surface",
    threshold_mm_s: Threshold = 1.0,
    law: ContactLawName = "lankarani-nikravesh",
    integrator: IntegratorName = "rk4",
    step: Step = 1e-5,
    control: ControlName = "effort",
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure how the tip of a linkage shakes on its paths and after them, and how its pins rattle.

    Each number is a mean over 16 indistinguishable runs, with its spread. Several paths are ranked, and those that
    cannot be told from their neighbours are marked. Of a single path the natural frequencies of the linkage on its
    contacts are printed too. With -o, report.html shows the ranking, or the mode shapes in motion.

    **Example:** `armwright clearance vibration five-bar --path y1 -o out/rattling`

    **Example:** `armwright clearance vibration five-bar --path x4 --aim`
    """
    import attrs
    import numpy as np

    from armwright.clearance.paths import TEST_PATHS
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.vibration.assessment import assess_rattling
    from armwright.clearance.vibration.move_law import aim_for_least_loss
    from armwright.report.rattling_files import rattling_files

    model = with_clearances(load_linkage(linkage), clearance or [], clearance_mm)
    names: list[str | None] = [*(path or ([] if speed_rpm is not None else TEST_PATHS))] or [None]
    if len(set(names)) < len(names):
        raise usage_error("--path", "expected each path once")
    if aim and len(names) > 1:
        raise usage_error("--aim", f"expected a single --path, got {len(names)} paths")
    followed = [path_of(model, name, speed_rpm, 1.0) for name in names]
    clearances = np.array(list(model.clearances.values()))
    settings = settings_of(
        friction_velocity,
        threshold_mm_s,
        law=friction_law,
        step=step,
        integrator=integrator,
        control=control,
        impact=law,
    )
    dwell, hidden = dwell_ms * 1e-3, quiet or as_json
    with counting("paths", quiet=hidden) as progress:
        assessment = assess_rattling(
            model, followed, clearances, settings, friction=friction, dwell=dwell, quantity=by, progress=progress
        )
    if aim:
        with counting("move laws", quiet=hidden) as progress:
            found = aim_for_least_loss(
                model,
                followed[0].name,
                clearances,
                settings,
                friction=friction,
                limit=goal_mm * 1e-3,
                dwell=dwell,
                progress=progress,
            )
        assessment = attrs.evolve(assessment, aim=found)
    if output is not None:
        write_results(output, rattling_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, quiet=quiet, output=output)
