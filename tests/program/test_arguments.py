"""Arguments of programs: values for constants from outside, of the same types."""

from pathlib import Path

import pytest

from armwright.errors import InvalidValueError, UnknownNameError
from armwright.program import Source, compile as translate, run
from armwright.program.semantics.arguments import Arguments
from cli_calls import armwright
from program.running import CORPUS, cell_of, printed

TEXT = """UNITS MM ;
CONST pace = 80 ; half = pace / 2 ; gap = 2cm ; quick = FALSE ; title = "tray" ; up = XYZ(0,0,1) ;
BEGIN PRINT(pace, half, gap, quick, title, Z(up)) END.
"""


def shown(arguments: Arguments | None = None) -> str:
    return printed(run(Source("t.rlo", TEXT), cell_of("cell1"), arguments=arguments))[0]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({}, "80 40 20 false tray 1"),
        ({"pace": "50"}, "50 25 20 false tray 1"),
        ({"PACE": 50.5, "Quick": True}, "50.5 25.25 20 true tray 1"),
        ({"gap": "-1.5cm", "quick": "true", "title": "box 3"}, "80 40 -15 true box 3 1"),
        ({"title": ""}, "80 40 20 false  1"),
    ],
)
def test_values(arguments: Arguments, expected: str) -> None:
    """A constant has the value that is given for it, and so have those that are computed from it."""
    assert shown(arguments) == expected


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"pace": "fast"}, "argument pace: expected a number, such as 80 or 25.4mm, got 'fast'"),
        ({"pace": "1 + 1"}, "expected a number"),
        ({"pace": True}, "expected a number"),
        ({"quick": "1"}, "argument quick: expected TRUE or FALSE, got '1'"),
        ({"title": 3.0}, "argument title: expected one line of at most 1000 characters, got 3.0"),
        ({"title": "x" * 1001}, "expected one line of at most 1000 characters"),
        ({"title": "a\nEND"}, r"expected one line of at most 1000 characters, got 'a\nEND'"),
        ({"up": "1"}, "argument up: the constant is a TRANS; only numbers, conditions and texts can be given"),
        ({"pace": "1", "PACE": "2"}, "argument PACE: two values are given for this constant"),
    ],
)
def test_wrong_values(arguments: Arguments, says: str) -> None:
    """A value of another type is refused before the program is compiled."""
    with pytest.raises(InvalidValueError) as raised:
        shown(arguments)

    assert says in str(raised.value)


def test_unknown_name() -> None:
    """An argument for which the program has no constant is refused, with the nearest name."""
    with pytest.raises(UnknownNameError, match=r"pcae.*Did you mean 'pace'"):
        shown({"pcae": 1.0})


def test_arguments_of_a_compiled_program() -> None:
    """What is compiled has its constants already."""
    with pytest.raises(InvalidValueError, match="pass the arguments to `compile`"):
        run(translate(Source("t.rlo", TEXT), cell_of("cell1")), arguments={"pace": 1.0})


def test_command_line(tmp_path: Path) -> None:
    """The command line gives values as NAME=VALUE, once or more."""
    program = tmp_path / "p.rlo"
    program.write_text(TEXT, encoding="utf-8")
    cell = str(CORPUS / "cell1.json")
    done = armwright("run", program, "--cell", cell, "--arg", "pace=30", "--arg", "title=a = b", columns=200)
    wrong = armwright("run", program, "--cell", cell, "--arg", "pace")

    assert "30 15 20 false a = b 1" in done.stdout
    assert wrong.returncode == 2
    assert "expected NAME=VALUE, such as pitch=20, got 'pace'" in wrong.stderr
