"""``armwright arms``: the catalogue of arms."""

from typing import Annotated

from typer import Option

from armwright.cli.options import Json
from armwright.cli.output import print_json

# Words that end a line of names sooner than the screen does.
_WIDTH = 80


def arms(
    sources: Annotated[
        bool, Option("--sources", help="List the documents that the numbers of each arm were read in.")
    ] = False,
    as_json: Json = False,
) -> None:
    """List the arms of the catalogue.

    Below the list are the arms whose geometry a second document confirms. With --sources, list the documents instead,
    each with its revision and what it gives.

    **Example:** `armwright arms`
    """
    import attrs

    from armwright.arm.documents import document_lines, gives_geometry
    from armwright.arm.load import arm_summaries

    summaries = arm_summaries()
    if as_json:
        print_json([attrs.asdict(summary) for summary in summaries])
        return
    if sources:
        for summary in summaries:
            print(f"{summary.name}: {summary.title}")
            for line in document_lines(summary.documents):
                print(f"  {line}")
        return
    width = max(len(summary.name) for summary in summaries)
    print(f"{'name':<{width}}  joints  title")
    for summary in summaries:
        print(f"{summary.name:<{width}}  {summary.joints:>6}  {summary.title}")
    confirmed = [each.name for each in summaries if sum(map(gives_geometry, each.documents)) > 1]
    print()
    print(_filled(f"Geometry of two documents: {', '.join(confirmed)}."))
    print("All documents: armwright arms --sources")


def _filled(text: str) -> str:
    import textwrap

    return textwrap.fill(text, _WIDTH, break_on_hyphens=False)
