"""Tables of studies in a terminal."""

from typing import TYPE_CHECKING

from armwright.cli.printing import table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rich.table import Table


def study_table(title: str, columns: "Sequence[str]", rows: "Iterable[Sequence[str]]") -> "Table":
    """Return a table with a heading above it; long texts are folded."""
    return table(columns, rows, title=title, words=range(len(columns)))
