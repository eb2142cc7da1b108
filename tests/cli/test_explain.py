"""The command ``armwright explain``, as a user calls it."""

import json
import os
import pty
import subprocess
import sys

import pytest

from armwright.program.diagnostics.index import codes, find_page
from cli_calls import armwright

ENVIRONMENT = {**os.environ, "COLUMNS": "100", "PYTHONUTF8": "1", "TERM": "xterm-256color"}


def explain(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Call the command where nobody watches."""
    return armwright("explain", *arguments, columns=100)


def watched(*arguments: str) -> str:
    """Call the command on a terminal."""
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "armwright", "explain", *arguments],
        stdout=theirs,
        stderr=theirs,
        stdin=theirs,
        env={name: value for name, value in ENVIRONMENT.items() if name != "NO_COLOR"},
    ) as process:
        os.close(theirs)
        shown = b""
        try:
            while piece := os.read(ours, 65536):
                shown += piece
        except OSError:  # how a terminal says that nobody writes to it any more
            pass
        assert process.wait(120) == 0
    os.close(ours)
    return shown.decode()


def test_a_page() -> None:
    """A page is the title, the text, the wrong program with its message, and the right one."""
    result = explain("e0206")

    page = find_page("E206")
    assert result.returncode == 0
    assert result.stdout.startswith(f"E206: {page.title}\n\n")
    assert " ".join(page.text.split()) in " ".join(result.stdout.split())
    for program in (page.wrong, page.right):
        assert "".join(f"    {line}\n" for line in program.splitlines()) in result.stdout
    assert "\nerror[E206]: this matrix is written row by row\n  --> wrong.rlo:3:10\n" in result.stdout
    assert "\x1b" not in result.stdout
    assert max(map(len, result.stdout.partition("\nWrong")[0].splitlines())) <= 80


def test_a_page_of_a_running_program() -> None:
    """A message that only comes while a program runs is shown as well."""
    result = explain("E402")

    assert "// run in one_arm" in result.stdout
    assert "error[E402]: the path to `right` leads joint 3 of ARM_1 beyond its limits" in result.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="a terminal of Unix")
def test_on_a_terminal() -> None:
    """Who watches sees the page in colour, every line of the message whole."""
    shown = watched("E403")

    assert "\x1b[1mE403: a singularity on the path" in shown
    assert "\x1b[94" in shown  # a word of the language
    assert "\x1b[1;31merror[E403]" in shown
    assert "the arm is singular there (wrist)" in shown


def test_all_codes() -> None:
    """Without a code all are listed with their titles."""
    result = explain()

    assert result.returncode == 0
    rows = [line.strip().split(None, 1) for line in result.stdout.splitlines() if line.startswith("  ")]
    assert rows == [[code, find_page(code).title] for code in codes()]


def test_json() -> None:
    """For programs there is JSON, of one page and of the list."""
    page = json.loads(explain("E206", "--json").stdout)
    rows = json.loads(explain("--json").stdout)

    assert {key: page[key] for key in ("code", "wrong", "right")} == {
        "code": "E206",
        "wrong": find_page("E206").wrong,
        "right": find_page("E206").right,
    }
    assert [(one["code"], one["line"]) for one in page["diagnostics"]] == [("E206", 3)]
    assert [row["code"] for row in rows] == list(codes())
    assert rows[0]["range"] == "Syntax"


def test_unknown_code() -> None:
    """A code that does not exist ends with the nearest and status 2."""
    result = explain("E292")

    assert result.returncode == 2
    assert result.stderr.startswith("armwright: no code 'E292'. Did you mean 'E202'? Known: E201,")


def test_help() -> None:
    """The help has an example in it."""
    assert "armwright explain E206" in explain("--help").stdout
