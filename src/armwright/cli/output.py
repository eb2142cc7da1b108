"""Output of the commands: JSON, tables, and the command line for the record."""

import json
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from armwright.cli.terminal import console

if TYPE_CHECKING:
    from pathlib import Path

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


def print_result(
    result: "Result",
    *,
    as_json: bool,
    quiet: bool = False,
    output: "Path | None" = None,
    file: str = "report.html",
    head: Mapping[str, Any] | None = None,
    wrap: bool = True,
) -> None:
    """Print a result as JSON, or its tables, without empty ones, with its notes and the path of its report.

    Args:
        result: the result.
        as_json: whether it is printed as JSON.
        quiet: print nothing, unless as JSON.
        output: folder of its files; None if they are not written.
        file: name of the file whose path is printed.
        head: data that precede those of the result in JSON.
        wrap: whether the notes are broken into lines of the width of the terminal.
    """
    if as_json:
        print_json({**(head or {}), **result.as_data()})
    elif not quiet:
        console = plain_console()
        for shown in result.tables():
            if shown.rows:
                _print_result_table(console, shown)
        for note in result.notes:
            console.print(note, soft_wrap=not wrap)
        if output is not None:
            print(f"{file.partition('.')[0]}: {output / file}")


def _print_result_table(console: "Console", result: "ResultTable") -> None:
    from rich.text import Text

    words = [i for i in range(len(result.heads)) if i not in result.numbers]
    rows = [
        [Text(text, style="bold red" if (i, k) in result.exceeded else "") for k, text in enumerate(row)]
        for i, row in enumerate(result.rows)
    ]
    shown = table(result.heads, rows, title=result.title or None, words=words)
    for row, mark in zip(shown.rows, result.marks, strict=False):
        row.style = "bold red" if mark == "over" else None
    for i in result.section_ends:
        shown.rows[i].end_section = True
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
