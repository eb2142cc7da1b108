"""What commands print: JSON, tables, and the command line that was given."""

import json
import sys
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from armwright.cli.terminal import console

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from armwright.files.result_table import Result, ResultTable

# Of a table that is measured: more than any has [columns].
_WIDEST = 10_000


def command_line() -> str:
    """Return the command as it was given, for the record."""
    import shlex

    return shlex.join(["armwright", *sys.argv[1:]])


def json_text(data: Any) -> str:
    """Return data as people read JSON, without an end of line."""
    return json.dumps(data, indent=2, ensure_ascii=False)


def print_json(data: Any) -> None:
    """Print data as JSON; where the output knows no other letters, in ASCII."""
    every_letter = (sys.stdout.encoding or "").lower().startswith("utf")
    print(json_text(data) if every_letter else json.dumps(data, indent=2))


def plain_console() -> "Console":
    """Return a console that takes every text as it is."""
    return console(highlight=False)


def print_result(result: "Result") -> None:
    """Print the tables of a result, and its notes below."""
    console = plain_console()
    print_result_tables(console, result.tables())
    for note in result.notes:
        console.print(note)


def print_result_tables(console: "Console", tables: "Iterable[ResultTable]") -> None:
    """Print tables of results, those without rows left out."""
    for result in tables:
        if result.rows:
            words = [i for i in range(len(result.heads)) if i not in result.numbers]
            shown = table(result.heads, result.rows, title=result.title or None, words=words)
            for row, mark in zip(shown.rows, result.marks, strict=False):
                row.style = "bold red" if mark == "over" else None
            print_table(console, shown)
            if result.remark:
                console.print(result.remark)


def print_table(console: "Console", shown: "Table") -> None:
    """Print a table, its cells folded between words where the terminal is narrow, but never within a number.

    A table that is wider all the same runs over the edge, where a terminal breaks the line and a file does not.
    """
    room = console.options.update(max_width=_WIDEST)
    for column in shown.columns:
        longest = max(console.measure(text, options=room).minimum for text in (column.header, *column.cells))
        column.min_width = max(longest, column.min_width or 0)
    console.print(shown, crop=False)


def table(
    columns: Sequence[str],
    rows: "Iterable[Sequence[str | Text]]" = (),
    *,
    title: str | None = None,
    words: Collection[int] = (0,),
) -> "Table":
    """Return a table for a terminal, to be printed by ``print_table``.

    Args:
        columns: their names.
        rows: texts of each row.
        title: above it, at the left.
        words: columns of words, from 0; the others hold numbers and end at the right.
    """
    from rich import box
    from rich.table import Table

    found = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for place, name in enumerate(columns):
        found.add_column(name, justify="left" if place in words else "right", overflow="fold")
    for row in rows:
        found.add_row(*row)
    return found
