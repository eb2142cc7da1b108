"""Output of the commands: JSON, tables, and the command line for the record."""

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

# Width at which tables are measured [columns]; none is wider.
_WIDEST = 10_000


def command_line() -> str:
    """Return the command line of this process as text, for the record."""
    import shlex

    return shlex.join(["armwright", *sys.argv[1:]])


def json_text(data: Any) -> str:
    """Return data as indented JSON, without a final line break."""
    return json.dumps(data, indent=2, ensure_ascii=False)


def print_json(data: Any) -> None:
    """Print data as JSON, in ASCII where the encoding of the output is not a Unicode encoding."""
    is_unicode = (sys.stdout.encoding or "").lower().startswith("utf")
    print(json.dumps(data, indent=2, ensure_ascii=not is_unicode))


def plain_console() -> "Console":
    """Return a console that does not highlight."""
    return console(highlight=False)


def print_result(result: "Result") -> None:
    """Print the tables of a result, and its notes below."""
    console = plain_console()
    print_result_tables(console, result.tables())
    for note in result.notes:
        console.print(note)


def print_result_tables(console: "Console", tables: "Iterable[ResultTable]") -> None:
    """Print tables of results, without empty ones."""
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
    """Print a table; on a narrow terminal its cells are folded between words, but never within a number.

    A wider table exceeds the width of the terminal, which then breaks the lines; in a file they stay unbroken.
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
        columns: names of the columns.
        rows: texts of each row.
        title: title above the table.
        words: indices of columns with words; the others hold numbers and are aligned right.
    """
    from rich import box
    from rich.table import Table

    made = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for index, name in enumerate(columns):
        made.add_column(name, justify="left" if index in words else "right", overflow="fold")
    for row in rows:
        made.add_row(*row)
    return made
