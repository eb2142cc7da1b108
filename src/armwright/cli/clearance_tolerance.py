"""``armwright clearance tolerance``: what the tolerances of a linkage's dimensions do to its resting tip."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Argument, Option

from armwright.cli.linkages import LinkageName, poses_of
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import write_results
from armwright.cli.shell_completion import paths
from armwright.cli.sweeps import SampleScheduler, SampleWorkers, sampling
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, table_file

if TYPE_CHECKING:
    from armwright.arrays import Array
    from armwright.clearance.linkage import Linkage


def tolerance(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    tolerances: Annotated[
        Path | None, Argument(metavar="FILE", help="TOML file of tolerances (docs/clearance.md).", show_default=False)
    ] = None,
    pose: Annotated[
        list[str] | None,
        Option(help="Position of the tip as X,Y in mm, or the angle of the only drive in deg; may be repeated."),
    ] = None,
    path: Annotated[
        str | None,
        Option(
            help="Path with the poses: x1 to x10, y1 to y14, pick-and-place; turn for a single drive.",
            autocompletion=paths,
        ),
    ] = None,
    poses: Annotated[int, Option(min=2, max=1000, help="Number of poses along the path.")] = 21,
    csv: Annotated[Path | None, Option(help="Table of poses: x, y of the tip, or angle of the only drive.")] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    corrected: Annotated[
        bool,
        Option("--corrected", help="The path is corrected for mean clearances: only deviations from these count."),
    ] = False,
    limit: Annotated[float | None, Option(help="Limit of the error of the tip in mm; asks for probabilities.")] = None,
    allocate: Annotated[
        Literal["worst-case", "statistical"] | None,
        Option(help="Find the tolerances of least cost that keep --limit, by this rule."),
    ] = None,
    samples: Annotated[int, Option(min=1, max=100_000, help="Number of random linkages, in full equilibrium.")] = 200,
    seed: Annotated[int, Option(min=0, help="Seed of the random linkages.")] = 0,
    uniform: Annotated[
        bool, Option("--uniform", help="Deviations of the random linkages are uniform within tolerances, not normal.")
    ] = False,
    workers: SampleWorkers = None,
    scheduler: SampleScheduler = None,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Print how far tolerances of a linkage move its resting tip, with probabilities, and what to tighten or relax.

    The poses are positions of the tip (--pose), those of a path (--path) or of a table (--csv). Drives are locked, and
    every journal rests against its bearing. The command prints the shift by mean clearances, the longest error with all
    dimensions at the ends of their tolerances, the statistical error, each dimension's share, and with --limit the
    probability that the error is longer, at a pose and anywhere on the path. With -o it writes report.html,
    tolerance.json and figures (SVG). With --workers the random linkages are a sweep; with -o it can be resumed.

    **Example:** `armwright clearance tolerance five-bar examples/five_bar_tolerances.toml --path y1 --limit 0.1`
    """
    from armwright.clearance.reader import load_linkage
    from armwright.reliability.linkage_tolerances import read_linkage_tolerances
    from armwright.reliability.tip_errors import assess_linkage_tolerances
    from armwright.report.tolerance_files import tolerance_files

    if limit is not None and not 0 < limit < math.inf:
        raise usage_error("--limit", f"expected a number above 0, got {limit:g}")
    if allocate is not None and limit is None:
        raise usage_error("--allocate", "tolerances of least cost keep a limit; specify --limit MM")
    nominal = load_linkage(linkage)
    if tolerances is None:
        raise usage_error(
            "FILE",
            f"expected a file of tolerances: a linkage such as {nominal.name} has none of its own; "
            "examples/five_bar_tolerances.toml is one",
        )
    model, widths = read_linkage_tolerances(tolerances, nominal)
    places = _poses(model, pose or [], path, poses, table_file(csv, columns, skip_incomplete=skip_incomplete))
    with sampling("random linkages", workers, scheduler, output, quiet=quiet or as_json) as (progress, machines):
        assessment = assess_linkage_tolerances(
            model,
            places,
            widths,
            corrected=corrected,
            limit=None if limit is None else limit * 1e-3,
            allocation=allocate,
            samples=samples,
            seed=seed,
            uniform=uniform,
            machines=machines,
            progress=progress,
        )
    if output is not None:
        write_results(output, tolerance_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, quiet=quiet, output=output)


def _poses(model: "Linkage", single: list[str], path: str | None, count: int, file: TableFile | None) -> "Array":
    """Return the poses of the one option that has them, in SI units."""
    from armwright.clearance.poses import poses_on_path, read_poses

    if bool(single) + (path is not None) + (file is not None) != 1:
        raise usage_error("--pose", "expected the poses, as --pose X,Y, --path NAME or --csv FILE")
    if path is not None:
        return poses_on_path(model, path, count)
    if file is not None:
        return read_poses(file.path, model, columns=file.columns, skip_incomplete=file.skip_incomplete)
    return poses_of(model, single)
