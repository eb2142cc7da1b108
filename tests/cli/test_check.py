"""The command ``armwright check``, as a user calls it."""

import errno
import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from cli_calls import armwright

EXAMPLES = Path(__file__).parents[2] / "examples"
STACKING = EXAMPLES / "stacking.rlo"
CELL = EXAMPLES / "stanford_cell.toml"


def check(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Call the command in a terminal of 100 columns that nobody watches."""
    return armwright("check", *arguments, columns=100)


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    """Return a program with one slip."""
    path = tmp_path / "wrong.rlo"
    path.write_text("VAR f : FRAME ;\nBEGIN\n  READ VISIONS (f) ;\n  MVOE ARM_1 TO f ;\nEND.\n")
    return path


def test_program_that_can_run() -> None:
    """Warnings are shown and leave the exit status at 0."""
    result = check(STACKING, "--cell", CELL)

    assert result.returncode == 0
    assert result.stdout.startswith("warning[L301]")
    assert result.stdout.endswith("stacking.rlo: 1 warning\n")
    assert result.stderr == ""


def test_program_without_a_cell() -> None:
    """Without a cell a frame that gets no value in the program is a warning."""
    result = check(STACKING)

    assert result.returncode == 0
    assert "warning[W204]: frame `STOP` is used before it has a value" in result.stdout


def test_program_that_cannot_run(wrong: Path) -> None:
    """An error is shown with its place and the exit status is 1."""
    result = check(wrong)

    assert result.returncode == 1
    assert result.stdout == (
        "error[E105]: unknown statement `MVOE`\n"
        "  --> wrong.rlo:4:3\n"
        "   |\n"
        " 4 |   MVOE ARM_1 TO f ;\n"
        "   |   ^^^^ not a statement\n"
        "   = help: did you mean `MOVE`?\n"
        "\n"
        "wrong.rlo: 1 error\n"
    )


def test_strict() -> None:
    """With --strict an implied AFFIX keeps the program from running."""
    assert check(EXAMPLES / "bench.rlo", "--cell", CELL).returncode == 0

    result = check(EXAMPLES / "bench.rlo", "--cell", CELL, "--strict")
    assert result.returncode == 1
    assert "error[W201]" in result.stdout


def test_emit_code() -> None:
    """The code goes to the output, the diagnostics out of its way."""
    result = check(STACKING, "--cell", CELL, "--emit", "code")

    assert result.stdout.splitlines()[1] == "0000   3    READV  OBJ1"
    assert "warning" not in result.stdout
    assert "warning[L301]" in result.stderr


def test_emit_tree() -> None:
    """The tree shows statements, and names inside them."""
    lines = check(STACKING, "--emit", "tree").stdout.splitlines()

    assert lines[0] == "Program"
    assert lines[1:4] == ["  headers: Declaration", "    names: Name OBJ1", "    names: Name OBJ2"]
    assert "  statements: Move" in lines
    assert "    moved: ArmName ARM-1" in lines


def test_emit_tokens(wrong: Path) -> None:
    """The tokens of a wrong program can be looked at too."""
    result = check(wrong, "--emit", "tokens")

    assert result.returncode == 1
    assert result.stdout.splitlines()[:3] == [
        "     1:1  keyword      VAR",
        "     1:5  name         f",
        "     1:7  symbol       :",
    ]


def test_emit_code_of_a_wrong_program(wrong: Path) -> None:
    """A program with errors has no code."""
    result = check(wrong, "--emit", "code")

    assert result.returncode == 1
    assert result.stdout == ""
    assert "error[E105]" in result.stderr


def test_json(wrong: Path) -> None:
    """As JSON everything is there for an editor."""
    result = check(wrong, "--json")
    data = json.loads(result.stdout)

    assert result.returncode == 1
    assert (data["program"], data["errors"], data["warnings"]) == ("wrong.rlo", 1, 0)
    (one,) = data["diagnostics"]
    assert (one["code"], one["line"], one["column"]) == ("E105", 4, 3)
    assert one["helps"] == ["did you mean `MOVE`?"]


@pytest.mark.parametrize(("emit", "first"), [("code", "READV"), ("tree", "Program"), ("tokens", "keyword")])
def test_json_with_a_stage(emit: str, first: str) -> None:
    """A stage of the translation comes along in the JSON."""
    data = json.loads(check(STACKING, "--cell", CELL, "--json", "--emit", emit).stdout)

    assert first in json.dumps(data[emit][0])
    if emit == "code":
        assert data["code"][0] == {"op": "READV", "operands": ["OBJ1"], "at": [3, 11]}


def test_no_such_program(tmp_path: Path) -> None:
    """A program that does not exist is a caller's mistake, told in one line."""
    result = check(tmp_path / "nothing.rlo")

    assert result.returncode == 4
    assert result.stderr.startswith("armwright: ")
    assert result.stderr.count("\n") == 1


def test_not_text(tmp_path: Path) -> None:
    """A file that is no text is refused with its line."""
    path = tmp_path / "binary.rlo"
    path.write_bytes(b"BEGIN\n\xff\xfe END.")
    result = check(path)

    assert result.returncode == 4
    assert f"{path}:2: not UTF-8 text" in result.stderr


def test_help() -> None:
    """The help has an example."""
    result = check("--help")

    assert result.returncode == 0
    assert "armwright check examples/stacking.rlo" in result.stdout


def test_several_programs(wrong: Path, tmp_path: Path) -> None:
    """Several files, and all programs in a folder and its folders, are checked one after the other, each once."""
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "good.rlo").write_text("BEGIN PAUSE 1 END.\n")
    result = check(wrong, tmp_path)

    assert result.returncode == 1
    assert [line for line in result.stdout.splitlines() if ".rlo: " in line or "programs" in line] == [
        "wrong.rlo: 1 error",
        "good.rlo: no errors",
        "2 programs: 1 error",
    ]
    data = json.loads(check(tmp_path, "--json").stdout)
    assert (data["errors"], [Path(one["path"]).name for one in data["programs"]]) == (1, ["good.rlo", "wrong.rlo"])
    log = json.loads(check(tmp_path, "--format", "sarif").stdout)
    (found,) = log["runs"][0]["results"]
    assert found["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == wrong.as_posix()


def test_pipe_in_a_folder(tmp_path: Path) -> None:
    """A pipe in a folder, which nobody has named, is no program: reading it might never end."""
    os.mkfifo(tmp_path / "x.rlo")

    assert "there is no program in this folder" in armwright("check", tmp_path).stderr


def test_folder_without_programs(tmp_path: Path) -> None:
    """A folder in which there is no program is told of."""
    result = check(tmp_path)

    assert result.returncode == 4
    assert "there is no program in this folder; expected files *.rlo" in result.stderr


def test_folder_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder inside that may not be looked into is told of: its programs would be taken for checked."""
    closed = tmp_path / "closed"
    closed.mkdir()
    (tmp_path / "bench.rlo").write_text("BEGIN GRASP END.")
    scanned = os.scandir

    def scan(path: str) -> Iterator[os.DirEntry[str]]:
        if Path(path) == closed:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(closed))
        return scanned(path)

    monkeypatch.setattr(os, "scandir", scan)
    result = check(tmp_path)

    assert result.returncode == 4
    assert result.stderr == f"armwright: {closed}: cannot be read: Permission denied\n"


def test_rights_are_asked_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether a file can be read shows when it is read, and is no wrong call."""
    path = tmp_path / "bench.rlo"
    path.write_text("BEGIN PRINT(1) END.")
    monkeypatch.setattr(os, "access", lambda *_: False)

    assert check(path).returncode == 0
