"""``armwright clearance correct``: a path corrected so that the tip reaches its goals in spite of joint clearance."""

from pathlib import Path
from typing import Annotated

from typer import Option

from armwright.cli.linkages import FrictionVelocity, LinkageName, Threshold, settings_of, with_clearances
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.shell_completion import paths

# Linkages drawn from an estimate.
_DRAWS = 32


def correct(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    path: Annotated[
        str,
        Option(help="Path to correct: pick-and-place, or a test path x1 to x10, y1 to y14.", autocompletion=paths),
    ] = "pick-and-place",
    clearance: Annotated[
        list[str] | None,
        Option(help="Estimated radial clearance of a pin in mm, as in J2=0.34; may be repeated."),
    ] = None,
    estimate: Annotated[
        Path | None, Option(help="Output of `clearance estimate --json`: its mean error is corrected.")
    ] = None,
    knots: Annotated[int, Option(help="Number of points at which an entire path is corrected, at most 1000.")] = 20,
    rounds: Annotated[
        int | None,
        Option(help="Number of iterations, at most 100; by default 3 of pick-and-place and 5 of an entire path."),
    ] = None,
    friction_velocity: FrictionVelocity = "surface",
    threshold_mm_s: Threshold = 1.0,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Move a path against the error that joint clearance causes, until the tip reaches its goals.

    Of pick-and-place the three nodes are moved; any other path is moved as one smooth curve. Each round simulates
    sixteen indistinguishable runs, or 32 linkages drawn from an estimate, and subtracts their mean error; printed are
    the path of the best round, and the remaining error with its spread over the runs. With -o the command writes
    path.csv, summary.json, paths.svg and a page, report.html.

    **Example:** `armwright clearance correct five-bar --clearance J2=0.328 --clearance J3=0.171 --clearance J4=0.483`
    """
    import numpy as np

    from armwright.clearance.correction_assessment import assess_correction
    from armwright.clearance.estimation.assessment import read_estimate
    from armwright.clearance.reader import load_linkage
    from armwright.report.correction_files import correction_files

    model = with_clearances(load_linkage(linkage), clearance or [])
    if estimate is None:
        clearances = np.array(list(model.clearances.values()))
    elif clearance:
        raise usage_error("--clearance", "give either --clearance or --estimate")
    else:
        warn_of_stray(estimate)
        clearances = read_estimate(estimate, model, _DRAWS)

    def print_error(mean: float) -> None:
        if not (quiet or as_json):
            print(f"mean error {mean * 1e3:.5f} mm")

    settings = settings_of(friction_velocity, threshold_mm_s)
    assessment = assess_correction(model, path, clearances, settings, knots=knots, rounds=rounds, progress=print_error)
    if output is not None:
        write_results(output, correction_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, quiet=quiet, output=output, file="path.csv")
