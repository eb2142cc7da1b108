"""What commands print, and the numbers they are given."""

import io
import json
import sys

import pytest
import typer
from rich.console import Console

from armwright.cli.numbers import named_numbers, numbers, within
from armwright.cli.output import command_line, print_json, print_result_table
from armwright.files.result_table import ResultTable

TEXT = {"name": "Gelenk für die Hand", "µm": [1.5, None]}


@pytest.mark.parametrize("encoding", ["utf-8", "ascii", "latin-1"])
def test_json_everywhere(monkeypatch: pytest.MonkeyPatch, encoding: str) -> None:
    """JSON can be read back whatever letters the output knows."""
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding=encoding, errors="backslashreplace"))
    print_json(TEXT)
    sys.stdout.flush()

    assert json.loads(written.getvalue().decode(encoding)) == TEXT
    assert ("für" in written.getvalue().decode(encoding)) == (encoding == "utf-8")


def test_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command is told so that it can be given again, blanks and quotes kept."""
    monkeypatch.setattr(sys, "argv", ["/somewhere/__main__.py", "run", "my program.rlo", "-o", "it's"])

    assert command_line() == """armwright run 'my program.rlo' -o 'it'"'"'s'"""


@pytest.mark.parametrize("width", [12, 25, 60])
def test_numbers_stay_whole(width: int) -> None:
    """On a narrow terminal a table is folded between words, and every number and every word stands in one piece."""
    console = Console(file=io.StringIO(), width=width, markup=False, highlight=False)
    row = ("left shoulder", "123456789.5", "± 97.25")
    heads = ("joint", "N m", "of its limit")
    print_result_table(console, ResultTable(title="", heads=heads, rows=[row], numbers=(1, 2)))

    shown = console.file.getvalue()
    words = ("joint", "left", "shoulder", "123456789.5", "97.25", "limit")
    assert set(words) <= set(shown.split())
    assert ("left shoulder" in shown) == (width == 60)


def test_words_left_numbers_right() -> None:
    """Words begin at the left, numbers end at the right."""
    console = Console(file=io.StringIO(), width=80, markup=False, highlight=False)
    rows = [("A", "1.5"), ("station", "10.25")]
    print_result_table(console, ResultTable(title="", heads=("pose", "mm"), rows=rows, numbers=(1,)))

    rows = [line.rstrip() for line in console.file.getvalue().splitlines() if "." in line]
    assert [row.split() for row in rows] == [["A", "1.5"], ["station", "10.25"]]
    assert len({len(row) for row in rows}) == 1
    assert len({row.index(row.split()[0]) for row in rows}) == 1


def test_named_numbers() -> None:
    """A number with a name has a unit that may be left out, blanks do no harm, and an exponent may be small."""
    texts = ["J2=0.3", "J3 = -1.5 mm", "J4=1e-3mm", "J5=.5", "J6=2E+1"]

    found = named_numbers(texts, ("", "mm"), "a pin", "--clearance")

    assert list(found.values()) == [
        ("J2", 0.3, ""),
        ("J3", -1.5, "mm"),
        ("J4", 1e-3, "mm"),
        ("J5", 0.5, ""),
        ("J6", 20.0, ""),
    ]
    assert named_numbers(["AV=1mm/s"], None, "a limit", "--limit")["AV"].unit == "mm/s"


@pytest.mark.parametrize("text", ["J2", "J2=", "=0.3", "J2=thick", "J2=0.3cm", "J2=nan", "J2=0.3=0.4", "J2=1_0"])
def test_what_is_no_named_number(text: str) -> None:
    """What is something else is refused, with what was expected."""
    with pytest.raises(typer.BadParameter, match=f"expected a pin and its clearance, got {text}$"):
        named_numbers([text], ("", "mm"), "a pin and its clearance", "--clearance")


def test_many_digits_that_are_no_number() -> None:
    """A hundred thousand digits with a sign behind them are refused in the time of their length, not its square."""
    with pytest.raises(typer.BadParameter, match="expected a pin"):
        named_numbers([f"J2={'1' * 100_000}!"], ("", "mm"), "a pin", "--clearance")


def test_a_name_that_is_given_twice() -> None:
    """Of two numbers of one name none is dropped without a word."""
    with pytest.raises(typer.BadParameter, match="J2 occurs twice"):
        named_numbers(["J2=0.3", "J3=0.3", "J2=0.4"], ("", "mm"), "a pin", "--clearance")


def test_bounds() -> None:
    """A number within its bounds, ends included, is taken; any other is refused with the bounds."""
    assert [within(x, (0.1, 10), "--servo-ms") for x in (0.1, 1, 10)] == [0.1, 1, 10]
    for value in (0.09, 10.1, float("nan")):
        with pytest.raises(typer.BadParameter, match=f"expected 0.1 to 10, got {value:g}"):
            within(value, (0.1, 10), "--servo-ms")


def test_lists() -> None:
    """Numbers stand apart by commas or blanks, and there must be as many as joints."""
    assert numbers("1, 2.5 -3", 3, "-q") == [1.0, 2.5, -3.0]
    with pytest.raises(typer.BadParameter, match="expected 2 finite numbers, got 3"):
        numbers("1,2,3", 2, "-q")
