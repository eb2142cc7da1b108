"""What LOG writes: rows of CSV with the time, which a table reader reads back."""

import csv
import io
from pathlib import Path

import pytest

from armwright.errors import FileFormatError
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.vm.recording import log_csv_lines
from armwright.report.run_files import RunInputs, run_files
from program.running import cell_of, code_of, run

TEXT = """UNITS MM ; VAR n : SCALAR ; ok : BOOLEAN ;
BEGIN
  FOR n = 1 TO 3 DO BEGIN PAUSE 0.5 ; ok = n > 1 ; LOG "Press" (n / 3, ok, "a, b", DIST(ARM_1, ARM_1)) END ;
  LOG "once" (TIME) ; LOG "press" (0, FALSE, TEXT("say", n), n)
END."""


def table(lines: list[str]) -> list[list[str]]:
    return list(csv.reader(io.StringIO("".join(lines))))


def test_rows() -> None:
    """Each row has its time and values to twelve digits; titles are the expressions, quoted where they have a comma."""
    logs = log_csv_lines(run(TEXT).effects)

    assert list(logs) == ["Press", "once"]
    assert table(logs["Press"]) == [
        ["t", "n / 3", "ok", '"a, b"', "DIST(ARM_1, ARM_1)"],
        ["0.5", "0.333333333333", "false", "a, b", "0"],
        ["1", "0.666666666667", "true", "a, b", "0"],
        ["1.5", "1", "true", "a, b", "0"],
        ["1.5", "0", "false", "say 3", "3"],
    ]
    assert table(logs["once"]) == [["t", "TIME"], ["1.5", "1.5"]]


def test_files_of_a_run() -> None:
    """A run with an output folder writes each log to a file of its own."""
    cell = cell_of("cell1")
    inputs = RunInputs(program=Path("p.rlo"), cell=Path("cell.json"), command="run", options={})
    files = run_files(run(TEXT, cell), (), inputs)

    assert {"log-Press.csv", "log-once.csv"} <= set(files)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('LOG    "once"', 'LOG    "../once"', "LOG expects letters, digits, _ and - for its name"),
        ('"once" "TIME"', '"once" "TIME,t"', "LOG expects a title for each of its 1 values"),
    ],
)
def test_damaged_code(old: str, new: str, fault: str) -> None:
    """Code from a file writes no file elsewhere, and no row that its titles do not fit."""
    code = assembly(code_of(TEXT, cell_of("cell1")))
    assert old in code

    with pytest.raises(FileFormatError, match=fault):
        assemble(code.replace(old, new))
