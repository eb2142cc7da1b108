"""Tables in CSV: rows with their lines."""

from collections.abc import Callable
from pathlib import Path

import pytest

from armwright.errors import FileFormatError
from armwright.files.rows import CsvRow, NumberFormat, read_rows, text_cell

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
    head, rows, separator = read_rows(write('\ufeffa, b\r\n\r\n1 ,"2,5"\r\n,\r\n3,4\r\n'))

    assert (head, separator) == (CsvRow(1, ("a", "b")), ",")
    assert [*rows] == [CsvRow(3, ("1", "2,5")), CsvRow(5, ("3", "4"))]


@pytest.mark.parametrize(
    ("text", "separator"),
    [
        ('\n;;\nx;y\n"1;5";2\n', ";"),
        ("\n\nx\ty\n1;5\t2\n", "\t"),
        ('\n\n"x [mm], of the flange";y\n1;2\n', ";"),
        ("\n\nx; of the flange,y,z\n1,2,3\n", ","),
        ("\n\nx\n1\n", ","),
    ],
)
def test_separators(text: str, separator: str, write: Write) -> None:
    """Columns are parted by whichever of comma, semicolon and tab makes most of them of the first line."""
    head, rows, found = read_rows(write(text))

    assert found == separator
    assert head.line == 3
    assert {len(row.cells) for row in rows} == {len(head.cells)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "table.csv: the file is empty; expected column names in its first line"),
        ("\n,,\n", "table.csv: the file is empty"),
        ("a,b\n\n", "table.csv: no rows after the column names"),
        ('\n,,\n;;;\n"",\n', "table.csv: the file is empty"),
        (f"a,b\n1,2\n{'1' * 200_000},2\n", "table.csv:3: not valid CSV: field larger than field limit"),
    ],
    ids=["empty", "blank", "no rows", "blank in any way", "endless"],
)
def test_no_table(text: str, message: str, write: Write) -> None:
    """What is no table is refused with file and line."""
    with pytest.raises(FileFormatError) as caught:
        [*read_rows(write(text))[1]]

    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "a,b\n1,2\n\n1,5,2",
            "table.csv:4: expected 2 values, one per column, got 3; does a number contain a comma?",
        ),
        ("a;b\n1;2\n\n1;5;2", "table.csv:4: expected 2 values, one per column, got 3"),
        ("a,b\n1\n", "table.csv:2: expected 2 values, one per column, got 1"),
    ],
)
def test_widths(text: str, message: str, write: Write) -> None:
    """A row has as many cells as there are columns."""
    path = write(text)
    with pytest.raises(FileFormatError) as caught:
        [*read_rows(path).rows]

    assert str(caught.value).replace(str(path), path.name) == message


def number(text: str, separator: str = ",") -> float:
    return NumberFormat(Path("t.csv"), separator).number(3, "x_mm", text)


def test_number() -> None:
    """A number is read as every reader of CSV reads it; between semicolons or tabs it may have a decimal comma."""
    assert number("-1.5e-3") == -0.0015
    assert number("-1.5e-3", ";") == -0.0015
    assert number("-1,5e-3", ";") == -0.0015
    assert number("12,25", "\t") == 12.25


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("abc", "t.csv:3: x_mm: expected a number, got 'abc'"),
        ("1,5", "t.csv:3: x_mm: expected a number, got '1,5'; write a decimal point"),
        ("1_0", "t.csv:3: x_mm: expected a number, got '1_0'"),
        ("\u0661\u0660", "t.csv:3: x_mm: expected a number, got '\u0661\u0660'"),
        ("nan", "t.csv:3: x_mm: every number must be finite and no larger than 1e+100, got nan"),
        ("1e101", "t.csv:3: x_mm: every number must be finite and no larger than 1e+100, got 1e101"),
    ],
)
def test_no_number(text: str, message: str) -> None:
    """What is no number is refused with file, line and column."""
    with pytest.raises(FileFormatError) as caught:
        number(text)

    assert str(caught.value) == message


@pytest.mark.parametrize(("first", "second"), [("1,5", "2.5"), ("1.234", "2,5")])
def test_thousands(first: str, second: str) -> None:
    """A file with commas and points in its numbers has thousands in it, or numbers a thousand times too large."""
    written = NumberFormat(Path("t.csv"), ";")
    written.number(3, "x_mm", first)

    with pytest.raises(FileFormatError, match=r"t\.csv:4: x_mm: expected a decimal (comma|point), as in line 3, got"):
        written.number(4, "x_mm", second)
    with pytest.raises(FileFormatError, match=r"expected a number, got '1\.234,5'"):
        number("1.234,5", ";")


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
