"""``armwright clearance sweep``: error-curve features of a linkage at many clearances, stored in a folder."""

from pathlib import Path
from typing import Annotated, Literal

from typer import Option

from armwright.cli.linkages import FrictionVelocity, LinkageName, Step, Threshold, settings_of
from armwright.cli.numbers import named_ranges
from armwright.cli.options import Json, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import sweep_bar, waiting
from armwright.cli.sweeps import resumable

_PAGE = "report.html"


def sweep(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    output: Annotated[Path, Option("-o", "--output", help="Folder of the sweep; it must hold nothing else.")],
    paths: Annotated[str, Option(help="Test paths, separated by commas: x1 to x10, y1 to y14.")] = "y1,y3,y7",
    design: Annotated[
        Literal["factorial", "lhs", "sobol"],
        Option(help="Design of the experiment: factorial, lhs (Latin hypercube) or sobol."),
    ] = "sobol",
    from_mm: Annotated[float, Option(help="Smallest radial clearance in mm.")] = 0.1,
    to_mm: Annotated[float, Option(help="Largest radial clearance in mm.")] = 0.5,
    levels: Annotated[
        int, Option(help="Levels of each clearance of a factorial design; 9 levels are the thesis' 729 runs.")
    ] = 9,
    runs: Annotated[int, Option("-n", "--runs", help="Number of linkages for lhs and sobol (a power of two).")] = 128,
    to_friction: Annotated[
        float | None, Option(help="Vary the coefficient of friction too, from 0 to this value.")
    ] = None,
    vary: Annotated[
        list[str] | None,
        Option(
            help="Vary a further parameter, as in payload=0:0.2 (kg at the tip), restitution=0.6:0.95, "
            "torque_scale=0.98:1.02 or friction=0:0.1; may be repeated."
        ),
    ] = None,
    friction_velocity: FrictionVelocity = "surface",
    threshold_mm_s: Threshold = 1.0,
    step: Step = 1e-5,
    replicates: Annotated[
        int,
        Option(
            help="Replicates of each linkage with clearances a nanometre apart, 0 to 15: their spread measures chaos."
        ),
    ] = 3,
    seed: Annotated[int, Option(help="Seed of lhs and sobol.")] = 0,
    workers: Annotated[int | None, Option(help="Number of processes; the default is the number of cores.")] = None,
    scheduler: Annotated[str | None, Option(help="Address of a Dask scheduler, as in tcp://10.0.0.1:8786.")] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a linkage with many clearances on several paths and store the features of its error curves.

    Beside each linkage a few copies are simulated whose clearances differ by a nanometre: the features are means over
    them, with their spread, and the command prints until when the runs are predictions. The same command resumes a
    sweep that was interrupted. `armwright clearance estimate` learns from the folder how the error curves depend on the
    clearances. The folder has a page too, report.html.

    **Example:** `armwright clearance sweep five-bar --design factorial -o out/sweep`

    **Example:** `armwright clearance sweep five-bar --vary payload=0:0.2 -n 256 -o out/payloads`
    """
    import numpy as np

    from armwright.arrays import integer
    from armwright.clearance.feature_sweep import FeatureSweep
    from armwright.clearance.free_parameters import FREE_PARAMETERS
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.sweep_summary import sweep_summary
    from armwright.files.output import write_file
    from armwright.report.clearance_study_pages import sweep_page
    from armwright.sweep.designs import full_factorial, latin_hypercube, sobol
    from armwright.sweep.extras import check_extras
    from armwright.sweep.folder import RESULTS
    from armwright.sweep.runner import run

    check_extras()
    ranges = named_ranges(vary or [], "--vary")
    if to_friction is not None:
        if "friction" in ranges:
            raise usage_error("--to-friction", "expected it or --vary friction, got both")
        ranges["friction"] = (0.0, to_friction)
    task = FeatureSweep(
        linkage=load_linkage(linkage),
        paths=tuple(dict.fromkeys(name.strip() for name in paths.split(","))),
        simulation_settings=settings_of(friction_velocity, threshold_mm_s, step=step),
        free=tuple(ranges),
        replicates=replicates,
    )
    bounds = dict.fromkeys(task.parameters, (from_mm * 1e-3, to_mm * 1e-3)) | ranges
    units = dict.fromkeys(task.parameters, "m") | {name: FREE_PARAMETERS[name].unit for name in ranges}
    integer(levels, "levels", least=2)
    if design == "factorial":
        values = {name: np.linspace(*ends, levels).round(12).tolist() for name, ends in bounds.items()}
        plan = full_factorial(values, units=units)
    else:
        plan = (latin_hypercube if design == "lhs" else sobol)(bounds, runs, seed, units=units)
    # A wrong path, a step too long for the smallest clearance, or a range that does not exist is reported now; and the
    # simulation is compiled once, not by every worker.
    if not (output / RESULTS).exists():
        with waiting(f"{task.linkage.name}: the first run compiles it", quiet=quiet or as_json):
            task(np.stack([plan.points.min(axis=0), plan.points.max(axis=0)]))
    title = f"{len(plan.points)} linkages on {len(task.paths)} paths"
    with sweep_bar(title, quiet=quiet or as_json) as progress, resumable(output, "runs"):
        results = run(task, plan, output, workers=workers, scheduler=scheduler, progress=progress)
    with results:
        summary = sweep_summary(task, results, output)
        page = sweep_page(summary, results, name=task.linkage.name, command=command_line())
    write_file(output / _PAGE, page)
    print_result(summary, as_json=as_json, quiet=quiet, wrap=False)
