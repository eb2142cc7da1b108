"""The files of a study: its tables as data, its figures, and a page of both."""

import json
from collections.abc import Iterable, Sequence

from armwright.files.result_table import Result
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, Film
from armwright.report.static_page import static_page


def study_files(
    study: Result, numbers: Iterable[Tile], drawn: Sequence[Drawing | Film], *, title: str, command: str
) -> dict[str, str | bytes]:
    """Return the files of a study by name.

    Args:
        study: what it computed.
        numbers: what a reader looks for first.
        drawn: its figures, in the order of the source.
        title: heading of the page.
        command: the command line that made it.
    """
    beside = {"tables.json": "the tables, printed numbers beside computed ones"}
    beside |= {name: one.caption for one in drawn for name in one.files}
    page = static_page(
        title=title,
        command=command,
        sections=[
            Card("Figures", figures(drawn)),
            Card("Tables", tables(study.tables())),
            Card("Files", downloads(beside)),
        ],
        numbers=numbers,
        notes=study.notes,
    )
    return {
        "tables.json": json.dumps(study.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": page,
        **{name: content for one in drawn for name, content in one.files.items()},
    }
