"""``armwright tolerance``: what the tolerances of an arm's dimensions do to its accuracy."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Argument, Option

from armwright.cli.options import ArmName, Configuration, Json, OutputFolder, Rows, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.results import write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, table_file

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array


def tolerance(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    tolerances: Annotated[Path, Argument(help="TOML file of tolerances (docs/reliability.md).")],
    q: Configuration = None,
    csv: Rows = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    limit: Annotated[
        float | None, Option(help="Limit of the error of the tool's position in mm; asks for probabilities.")
    ] = None,
    allocate: Annotated[
        Literal["worst-case", "statistical"] | None,
        Option(help="Find the tolerances of least cost that keep --limit, by this rule."),
    ] = None,
    samples: Annotated[
        int, Option(min=1, max=100_000, help="Number of random arms, with their full kinematics.")
    ] = 1000,
    seed: Annotated[int, Option(min=0, help="Seed of the random arms.")] = 0,
    uniform: Annotated[
        bool, Option("--uniform", help="Deviations of the random arms are uniform within tolerances, not normal.")
    ] = False,
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Print how far tolerances of an arm's dimensions move its tool, with probabilities, and what to tighten or relax.

    The poses are a configuration (-q) or a table of them (--csv), such as motion.csv; of a longer one 200 rows are
    taken, evenly spread. The command prints the longest error with all dimensions at the ends of their tolerances, the
    statistical error, each dimension's share, and with --limit the probability that the error is longer, at a pose and
    anywhere on the path. With -o it writes report.html, tolerance.json and figures (SVG).

    **Example:** `armwright tolerance puma560 examples/puma_tolerances.toml -q 10,-20,30,0,40,0 --limit 0.5`
    """
    from armwright.arm.load import load_arm
    from armwright.reliability.arm_errors import assess_tolerances
    from armwright.reliability.tolerances import read_tolerances
    from armwright.report.tolerance_files import tolerance_files

    if limit is not None and not 0 < limit < float("inf"):
        raise usage_error("--limit", f"expected a number above 0, got {limit:g}")
    if allocate is not None and limit is None:
        raise usage_error("--allocate", "tolerances of least cost keep a limit; specify --limit MM")
    model = load_arm(arm)
    poses = _poses(model, q, table_file(csv, columns, skip_incomplete=skip_incomplete))
    with waiting("longest errors", quiet=as_json) as progress:
        assessment = assess_tolerances(
            model,
            poses,
            read_tolerances(tolerances, model),
            limit=None if limit is None else limit * 1e-3,
            allocation=allocate,
            samples=samples,
            seed=seed,
            uniform=uniform,
            progress=progress,
        )
    if output is not None:
        write_results(output, tolerance_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, output=output)


def _poses(model: "Arm", q: str | None, file: TableFile | None) -> "Array":
    from armwright.cli.joints import joint_values, rows

    if (q is None) == (file is None):
        raise usage_error("-q", "expected the poses, either one as -q or a table of them as --csv FILE")
    if file is not None:
        return rows(model, file, ("q",))[0]
    return joint_values(model, q or "", "-q")[None]
