"""What commands print: JSON, the command line, tables."""

import io
import json
import sys

import pytest
from rich.console import Console

from armwright.cli.output import command_line, print_json, print_result_table
from armwright.files.result_table import ResultTable

TEXT = {"name": "Gelenk für die Hand", "µm": [1.5, None]}


@pytest.mark.parametrize("encoding", ["utf-8", "ascii", "latin-1"])
def test_json_in_any_encoding(monkeypatch: pytest.MonkeyPatch, encoding: str) -> None:
    """JSON can be read back whatever letters the output knows."""
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding=encoding, errors="backslashreplace"))
    print_json(TEXT)
    sys.stdout.flush()

    assert json.loads(written.getvalue().decode(encoding)) == TEXT
    assert ("für" in written.getvalue().decode(encoding)) == (encoding == "utf-8")


def test_command_line_can_be_given_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command is told so that it can be given again, blanks and quotes kept."""
    monkeypatch.setattr(sys, "argv", ["/somewhere/__main__.py", "run", "my program.rlo", "-o", "it's"])

    assert command_line() == """armwright run 'my program.rlo' -o 'it'"'"'s'"""


@pytest.mark.parametrize("width", [12, 25, 60])
def test_narrow_tables_fold_between_words(width: int) -> None:
    """On a narrow terminal a table is folded between words, and every number and every word stands in one piece."""
    console = Console(file=io.StringIO(), width=width, markup=False, highlight=False)
    row = ("left shoulder", "123456789.5", "± 97.25")
    heads = ("joint", "N m", "of its limit")
    print_result_table(console, ResultTable(title="", heads=heads, rows=[row], numbers=(1, 2)))

    shown = console.file.getvalue()
    words = ("joint", "left", "shoulder", "123456789.5", "97.25", "limit")
    assert set(words) <= set(shown.split())
    assert ("left shoulder" in shown) == (width == 60)


def test_words_are_left_and_numbers_right_aligned() -> None:
    """Words begin at the left, numbers end at the right."""
    console = Console(file=io.StringIO(), width=80, markup=False, highlight=False)
    rows = [("A", "1.5"), ("station", "10.25")]
    print_result_table(console, ResultTable(title="", heads=("pose", "mm"), rows=rows, numbers=(1,)))

    rows = [line.rstrip() for line in console.file.getvalue().splitlines() if "." in line]
    assert [row.split() for row in rows] == [["A", "1.5"], ["station", "10.25"]]
    assert len({len(row) for row in rows}) == 1
    assert len({row.index(row.split()[0]) for row in rows}) == 1
