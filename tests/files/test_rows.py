"""Tables in CSV: rows with their lines."""

from collections.abc import Callable
from pathlib import Path

import pytest

from armwright.errors import FileFormatError
from armwright.files.rows import Cells, number_in_cell, of_one_width, read_rows, text_cell

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(text: str) -> Path:
        path = tmp_path / "table.csv"
        path.write_bytes(text.encode())
        return path

    return written


def test_rows(write: Write) -> None:
    """Rows know their lines; blanks around cells, empty lines, a mark of byte order and ends of lines are nothing."""
    head, rows = read_rows(write('\ufeffa, b\r\n\r\n1 ,"2,5"\r\n,\r\n3,4\r\n'))

    assert head == Cells(1, ("a", "b"))
    assert [*rows] == [Cells(3, ("1", "2,5")), Cells(5, ("3", "4"))]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "table.csv: the file is empty; its first line should name the columns"),
        ("\n,,\n", "table.csv: the file is empty"),
        ("a,b\n\n", "table.csv: no rows below the names of the columns"),
        (
            "\na;b\n1;2\n",
            "table.csv:2: columns are separated by semicolons; expected commas between columns and points",
        ),
        ("a\tb\n1\t2\n", "table.csv:1: columns are separated by tabs"),
        (f"a,b\n1,2\n{'1' * 200_000},2\n", "table.csv:3: not valid CSV: field larger than field limit"),
    ],
    ids=["empty", "blank", "no rows", "semicolons", "tabs", "endless"],
)
def test_no_table(text: str, message: str, write: Write) -> None:
    """What is no table is refused with file and line."""
    with pytest.raises(FileFormatError) as caught:
        [*read_rows(write(text))[1]]

    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (("1", "5", "2"), "t.csv:7: expected 2 values, as there are columns, got 3; is there a comma in a number?"),
        (("1",), "t.csv:7: expected 2 values, as there are columns, got 1"),
    ],
)
def test_widths(cells: tuple[str, ...], message: str) -> None:
    """A row has as many cells as there are columns."""
    head = Cells(1, ("a", "b"))
    assert [*of_one_width("t.csv", head, [Cells(2, ("1", "2"))])] == [Cells(2, ("1", "2"))]

    with pytest.raises(FileFormatError) as caught:
        [*of_one_width("t.csv", head, [Cells(2, ("1", "2")), Cells(7, cells)])]

    assert str(caught.value) == message


def test_number() -> None:
    """A number is read as Python reads it."""
    assert number_in_cell("t.csv", 3, "x_mm", "-1.5e-3") == -0.0015


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "t.csv:3: x_mm: empty; expected a number"),
        ("abc", "t.csv:3: x_mm: expected a number, got 'abc'"),
        ("1,5", "t.csv:3: x_mm: expected a number, got '1,5'; write a decimal point"),
        ("nan", "t.csv:3: x_mm: every number must be finite and no larger than 1e+100, got nan"),
        ("1e101", "t.csv:3: x_mm: every number must be finite and no larger than 1e+100, got 1e101"),
    ],
)
def test_no_number(text: str, message: str) -> None:
    """What is no number is refused with file, line and column."""
    with pytest.raises(FileFormatError) as caught:
        number_in_cell("t.csv", 3, "x_mm", text)

    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("J2.force_N", "J2.force_N"),
        ("=1+1", "'=1+1"),
        (" @SUM(A1)", "' @SUM(A1)"),
        ("a,b", '"a,b"'),
        ('say "so"', '"say ""so"""'),
        ("two\nlines", "two lines"),
    ],
)
def test_a_text_is_one_cell(text: str, cell: str) -> None:
    """A name in the head of a table stays one cell on one line, and no spreadsheet computes it."""
    assert text_cell(text) == cell
