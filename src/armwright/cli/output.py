"""Output of the commands: JSON, tables, and the command line for the record."""

import itertools
import json
import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from armwright.cli.terminal import console

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

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


def print_json_rows(rows: Iterable[Any], *, as_list: bool) -> None:
    """Print rows of results as a JSON list with a line for each, as they are computed; otherwise the only row alone."""
    if not as_list:
        print(json.dumps(*rows))
        return
    opening = "["
    for row in rows:
        print(f"{opening}{json.dumps(row)}", end="")
        opening = ",\n "
    print("]")


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
        terminal = console()
        for shown in result.tables():
            if shown.rows:
                print_result_table(terminal, shown)
        for note in result.notes:
            terminal.print(note, soft_wrap=not wrap)
        if output is not None:
            print(f"{file.partition('.')[0]}: {output / file}")


def print_result_table(console: "Console", result: "ResultTable") -> None:
    """Print a table; on a narrow terminal its cells are folded between words, but never within a number.

    A wider table exceeds the width of the terminal, which then breaks the lines; in a file they stay unbroken.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=result.title or None, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False
    )
    for index, head in enumerate(result.heads):
        table.add_column(head, justify="right" if index in result.numbers else "left", overflow="fold")
    for i, (row, mark) in enumerate(itertools.zip_longest(result.rows, result.marks)):
        cells = [Text(text, style="bold red" if (i, k) in result.exceeded else "") for k, text in enumerate(row)]
        table.add_row(*cells, style="bold red" if mark == "over" else None, end_section=i in result.section_ends)
    room = console.options.update(max_width=_WIDEST)
    for column in table.columns:
        column.min_width = max(console.measure(text, options=room).minimum for text in (column.header, *column.cells))
    console.print(table, crop=False)
    if result.remark:
        console.print(result.remark)
