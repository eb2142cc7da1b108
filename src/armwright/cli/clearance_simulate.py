"""``armwright clearance simulate``: simulate a linkage with joint clearance along a path."""

from pathlib import Path
from typing import Annotated, Literal

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
    TipPathName,
    path_of,
    settings_of,
    with_clearances,
)
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.results import write_results

# Samples of a run, and the time between two of them at most [s].
_SAMPLES, _SAMPLE = 2500, 1e-4


def simulate(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    path: TipPathName = None,
    speed_rpm: SpeedRpm = None,
    revolutions: Annotated[float, Option(help="Number of revolutions of the drive.")] = 3.0,
    clearance: Clearances = None,
    clearance_mm: ClearanceOfAll = None,
    friction: Friction = None,
    friction_law: FrictionLawName = "linear",
    friction_velocity: FrictionVelocity = "surface",
    threshold_mm_s: Threshold = 1.0,
    law: ContactLawName = "lankarani-nikravesh",
    integrator: IntegratorName = "rk4",
    step: Step = 1e-5,
    locate: Annotated[
        bool,
        Option("--locate", help="Locate the contact events: divide a step where a journal reaches its bearing."),
    ] = False,
    sample: Annotated[float | None, Option(help="Time between samples, in s; the default is 1e-4 or less.")] = None,
    control: ControlName = "effort",
    start: Annotated[
        Literal["rest", "rigid", "centred"],
        Option(help="Initial state: rest on elastic bearings, rest on rigid ones, or centred."),
    ] = "rest",
    worn: Annotated[
        Path | None, Option(help="wear.json of `armwright clearance wear -o`: the pins are as worn as there.")
    ] = None,
    strokes: Annotated[
        float | None, Option(help="With --worn: how many strokes they have made; the default is the last.")
    ] = None,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a linkage with joint clearance whose drives are commanded as if it had none.

    The command prints the path error, a row for every pin, the energy balance, and the time until which the run is a
    prediction. With -o, report.html shows the moving linkage, its journals in their bearings, and error, forces and
    energy over time. The first run of a linkage compiles its equations.

    **Example:** `armwright clearance simulate five-bar --path y1 --clearance J2=0.3 -o out/rattling`

    **Example:** `armwright clearance simulate slider-crank --speed-rpm 5000 --revolutions 2 --step 2e-6`

    **Example:** `armwright clearance simulate five-bar --path y1 --worn out/worn/wear.json --strokes 1e6`
    """
    import numpy as np

    from armwright.clearance.assessment import ClearanceRun
    from armwright.clearance.predictability import simulate_with_predictability
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.scenario import prepare_scenario
    from armwright.clearance.wear.life_file import read_worn_surfaces
    from armwright.clearance.worn_walls import WornWalls

    model = with_clearances(load_linkage(linkage), clearance or [], clearance_mm)
    if strokes is not None and worn is None:
        raise usage_error("--strokes", "expected --worn beside it")
    surfaces, made = (None, None) if worn is None else read_worn_surfaces(worn, model, strokes)
    tip_path = path_of(model, path, speed_rpm, revolutions)
    settings = settings_of(
        friction_velocity,
        threshold_mm_s,
        law=friction_law,
        step=step,
        sample=max(step, min(_SAMPLE, tip_path.duration / _SAMPLES)) if sample is None else sample,
        integrator=integrator,
        control=control,
        impact=law,
        start=start,
        located=locate,
    )
    with waiting(f"{model.name}: the first run compiles it", quiet=quiet or as_json):
        scenario, clearances = prepare_scenario(model, tip_path, settings), np.array(list(model.clearances.values()))
        walls = None if surfaces is None else WornWalls.of(model, surfaces.bearing, surfaces.journal)
        runs = simulate_with_predictability(scenario, clearances, friction=friction, worn=walls)
        run = ClearanceRun.of(*runs, strokes=made)
    if output is not None:
        from armwright.report.clearance_run_files import clearance_run_files

        write_results(output, clearance_run_files(run, command=command_line()))
    if not (as_json or quiet):
        data = run.as_data()
        used = data["settings"]
        print(
            f"{data['linkage']}, {data['path']}: {data['status']} after {data['sound_until']:.4g} s; "
            f"{used['integrator']}, steps of {used['step']:.3g} s, friction {used['friction']:g}"
        )
    print_result(run, as_json=as_json, quiet=quiet, output=output, head={"command": command_line()})
