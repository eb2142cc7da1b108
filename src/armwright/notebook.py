"""How objects show themselves in a notebook: tables and lines of HTML, with every text escaped."""

from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice

# More rows than this are counted, not shown.
_MAX_ROWS = 100


def html_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str | float]]) -> str:
    """Return a table with a caption; numbers with six digits, of very many rows the first."""
    every = iter(rows)
    shown = ["".join(f"<td>{_text(cell)}</td>" for cell in row) for row in islice(every, _MAX_ROWS)]
    if more := sum(1 for _ in every):
        shown.append(f'<td colspan="{len(columns)}">and {more} more</td>')
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(f"<tr>{cells}</tr>" for cells in shown)
    return f"<table><caption>{escape(title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def html_lines(text: str) -> str:
    """Return lines of text as paragraphs."""
    return "".join(f"<p>{escape(line)}</p>" for line in text.splitlines())


def _text(cell: str | float) -> str:
    return escape(cell if isinstance(cell, str) else f"{cell:.6g}")
