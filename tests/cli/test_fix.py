"""The command ``armwright fix``, as a user calls it."""

import json
import subprocess
from pathlib import Path

import pytest

from cli_calls import armwright, fed_to

EXAMPLES = Path(__file__).parents[2] / "examples"
WRONG = "VAR f : FRAME\nBEGIN\n  READ VISIONS (f) ;\n  MVOE ARM_1 TO f ;\n  OPEN ARM - 1\n  GRASP\nEND\n"
CURED = "VAR f : FRAME;\nBEGIN\n  READ VISIONS (f) ;\n  MVOE ARM_1 TO f ;\n  OPEN ARM_1;\n  GRASP\nEND.\n"


def fix(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Call the command in a terminal of 100 columns that nobody watches."""
    return armwright("fix", *arguments, columns=100)


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    """Return a program with slips, of which one has no certain cure."""
    path = tmp_path / "wrong.rlo"
    path.write_text(WRONG)
    return path


def test_cures_and_what_is_left(wrong: Path) -> None:
    """What is certain is cured in place and told; what is left is shown as check does, and is the exit status."""
    result = fix(wrong)

    assert result.returncode == 1
    assert wrong.read_text() == CURED
    assert result.stdout == (
        f"{wrong}:1:14: missing `;` after the declaration (E104): inserted `;`\n"
        f"{wrong}:5:8: `ARM - 1` is not the name of an arm (E106): replaced `ARM - 1` by `ARM_1`\n"
        f"{wrong}:7:4: the program does not end with `.` (E110): inserted `.`\n"
        f"{wrong}:5:13: missing `;` between two statements (E104): inserted `;`\n"
        f"{wrong}: 4 mistakes corrected\n"
        "error[E105]: unknown statement `MVOE`\n"
        f"  --> {wrong}:4:3\n"
        "   |\n"
        " 4 |   MVOE ARM_1 TO f ;\n"
        "   |   ^^^^ not a statement\n"
        "   = help: did you mean `MOVE`?\n"
        "\n"
        f"{wrong}: 1 error\n"
    )


def test_nothing_left(wrong: Path) -> None:
    """When all is cured, the exit status is 0, and there is nothing to do a second time."""
    wrong.write_text(WRONG.replace("MVOE", "MOVE"))
    first, second = fix(wrong), fix(wrong)

    assert (first.returncode, second.returncode) == (0, 0)
    assert wrong.read_text() == CURED.replace("MVOE", "MOVE")
    assert second.stdout.startswith(f"{wrong}: nothing to correct\n")


@pytest.mark.parametrize("option", ["--diff", "--dry-run"])
def test_diff(wrong: Path, option: str) -> None:
    """With --diff the changes are shown and nothing is written."""
    result = fix(wrong, option)
    lines = result.stdout.splitlines()

    assert wrong.read_text() == WRONG
    assert lines[:5] == [
        f"--- {wrong}",
        f"+++ {wrong} (changed)",
        "@@ -1,8 +1,8 @@",
        "-VAR f : FRAME",
        "+VAR f : FRAME;",
    ]
    assert f"{wrong}: 4 mistakes could be corrected" in lines
    assert result.returncode == 1


def test_several_programs(wrong: Path) -> None:
    """A program that does not exist keeps no other from being cured."""
    missing = wrong.with_name("wrnog.rlo")
    result = fix(missing, wrong)

    assert result.returncode == 4
    assert result.stderr == f"armwright: {missing}: no such file; did you mean '{wrong}'?\n"
    assert wrong.read_text() == CURED


def test_cell(tmp_path: Path) -> None:
    """With a cell, what is left is what is wrong in it."""
    path = tmp_path / "other_arm.rlo"
    path.write_text("BEGIN OPEN ARM_7 END")
    assert fix(path).returncode == 0

    path.write_text("BEGIN OPEN ARM_7 END")
    result = fix(path, "--cell", EXAMPLES / "stanford_cell.toml")
    assert result.returncode == 1
    assert path.read_text() == "BEGIN OPEN ARM_7 END."
    assert "ARM_7" in result.stdout.partition("1 mistake corrected")[2]


def test_json(wrong: Path) -> None:
    """As JSON, what was done and what is left stand side by side."""
    (row,) = json.loads(fix(wrong, "--json").stdout)

    assert row["program"] == str(wrong)
    assert [(one["code"], one["done"]) for one in row["cures"]][1:3] == [
        ("E106", "replaced `ARM - 1` by `ARM_1`"),
        ("E110", "inserted `.`"),
    ]
    assert [one["code"] for one in row["diagnostics"]] == ["E105"]


def test_help() -> None:
    """The help has an example."""
    result = fix("--help")

    assert result.returncode == 0
    assert "armwright fix examples/bench.rlo --diff" in result.stdout


@pytest.mark.parametrize("name", ["-", "pipe"])
def test_what_is_typed_or_piped_in(name: str, tmp_path: Path) -> None:
    """What cannot be written back is printed, and what was done told beside it; no file is made and nobody waits."""
    fed = {"typed": WRONG} if name == "-" else {"piped": WRONG}
    result = fed_to("fix", name, tmp_path, **fed)
    data = fed_to("fix", name, tmp_path, "--json", **fed)

    assert result.stdout == CURED
    assert "(E110): inserted `.`" in result.stderr
    assert "MVOE" in result.stderr
    assert json.loads(data.stdout)[0]["text"] == CURED
    assert (result.returncode, data.returncode) == (1, 1)
    assert {path.name for path in tmp_path.iterdir()} <= {"pipe"}


def test_zero_bytes(tmp_path: Path) -> None:
    """A text in another encoding is that of no program, and nothing is put before it."""
    path = tmp_path / "wide.rlo"
    path.write_bytes(WRONG.encode("utf-16-le"))

    assert fix(path).returncode == 1
    assert path.read_bytes() == WRONG.encode("utf-16-le")
