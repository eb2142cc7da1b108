"""``armwright clearance compare``: the errors of two linkages with clearance over their workspace."""

from typing import Annotated

from typer import Argument, Option

from armwright.cli.linkages import LinkageName, with_clearances
from armwright.cli.options import Json, OutputFolder
from armwright.cli.output import command_line, print_result
from armwright.cli.results import write_results


def compare(  # noqa: PLR0917 - Typer reads one parameter per option
    first: LinkageName,
    second: Annotated[str, Argument(help="The other one: a name in the catalogue, or path of a TOML file.")],
    clearance: Annotated[
        list[str] | None, Option(help="Radial clearance of a pin of the first in mm, as in J2=0.5; may be repeated.")
    ] = None,
    other_clearance: Annotated[
        list[str] | None, Option(help="Radial clearance of a pin of the second in mm; may be repeated.")
    ] = None,
    cells: Annotated[int, Option(help="Number of cells of the map along its longer side, at most 200.")] = 40,
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Compare the errors of two five-bars at rest over the workspace.

    Both are driven as the first would be without clearance; the second may have other lengths too. The command prints
    mean and largest errors with what friction leaves open; with -o, report.html shows a map of each, and of their
    difference.

    **Example:** `armwright clearance compare five-bar five-bar --other-clearance J3=0.1 -o out/compared`
    """
    from armwright.clearance.error_map import compare_linkages
    from armwright.clearance.reader import load_linkage
    from armwright.report.compare_files import compare_files

    models = (
        with_clearances(load_linkage(first), clearance or []),
        with_clearances(load_linkage(second), other_clearance or []),
    )
    compared = compare_linkages(*models, cells=cells)
    if output is not None:
        write_results(output, compare_files(compared, command=command_line()))
    print_result(compared, as_json=as_json, output=output)
