"""How commands end."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from armwright import errors
from armwright.cli import failures
from armwright.errors import ArmwrightError, ExitStatus, FileFormatError
from cli_calls import armwright

PAGE = (Path(__file__).parents[2] / "docs" / "exit_status.md").read_text(encoding="utf-8")
ALL_OWN = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ArmwrightError)]


def test_page_lists_statuses() -> None:
    """The page of exit statuses has those of the enum, by number and name, and no others."""
    listed = re.findall(r"^\| (\d+) \| `(\w+)` \|", PAGE, re.MULTILINE)

    assert [(int(number), name) for number, name in listed] == [(one.value, one.name) for one in ExitStatus]


def test_page_lists_errors() -> None:
    """The page says of every error of the tree with which status it ends a command."""
    listed = dict(re.findall(r"^\| `(\w+Error)` \| (\d+) \|", PAGE, re.MULTILINE))

    assert {name: int(number) for name, number in listed.items()} == {one.__name__: one.exit_status for one in ALL_OWN}


@pytest.mark.parametrize(
    ("arguments", "status", "kind", "message"),
    [
        (("show", "pumma560"), 2, "UnknownNameError", "Did you mean 'puma560'?"),
        (("show",), 2, "MissingParameter", "Missing argument 'arm'."),
        (("forward", "puma560", "-q", "1,2"), 2, "BadParameter", "6"),
        (("inverse", "puma560"), 2, "BadParameter", "--xyz"),
        (("convert", "puma560", "-o", "/proc/no/puma.urdf"), 4, "OutputError", "cannot make '/proc/no'"),
        (("iso9283", "none.csv"), 4, "FileFormatError", "none.csv"),
    ],
)
def test_error_as_json(arguments: tuple[str, ...], status: int, kind: str, message: str) -> None:
    """Under --json an error is a document with its status and class, and nothing else is printed."""
    done = armwright(*arguments, "--json")
    told = json.loads(done.stdout)

    assert (done.returncode, done.stderr) == (status, "")
    assert (told["exit_status"], told["error"]["class"]) == (status, kind)
    assert message in told["error"]["message"]


def test_error_of_a_file_as_json() -> None:
    """An error in a file is told with file, line and key of their own."""
    told = failures.failure_data(ExitStatus.FILE, FileFormatError("a.toml", 3, "mass_kg", "bad"), "said")

    assert told == {
        "exit_status": 4,
        "error": {"class": "FileFormatError", "message": "said", "file": "a.toml", "line": 3, "key": "mass_kg"},
    }


def _fails(error: str, *, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Call a command in which something arises."""
    program = (
        "import sys, armwright.cli.app as app, armwright.arm.load as load\n"
        f"def broken(): raise {error}\n"
        "load.arm_names = broken\n"
        "sys.argv = ['armwright', 'arms']\n"
        "app.main()\n"
    )
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120, env=environment
    )


def test_our_fault() -> None:
    """What nobody foresaw ends with 70 and one sentence with the place and what to do, without a traceback."""
    done = _fails("KeyError('q')")

    assert (done.returncode, done.stdout) == (ExitStatus.INTERNAL_ERROR, "")
    assert done.stderr.startswith("armwright: a defect of armwright, not of what was given: KeyError: 'q' (in broken,")
    assert "please report it" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("error", "status", "message"),
    [
        ("EOFError('cut off')", 70, "EOFError: cut off"),
        ("MemoryError()", 3, "this takes more memory than there is"),
        ("OSError(28, 'No space left on device')", 4, "cannot write the output: No space left on device"),
        ("PermissionError(13, 'Permission denied', 'a')", 4, "cannot read or write 'a': Permission denied"),
    ],
)
def test_errors_of_others(error: str, status: int, message: str) -> None:
    """Errors of Python and of the machine end in one line, too."""
    done = _fails(error)

    assert (done.returncode, len(done.stderr.splitlines())) == (status, 1)
    assert message in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals(number: signal.Signals) -> None:
    """A signal ends a command with 128 and its number, and one word."""
    program = (
        "import os, sys, time, armwright.cli.app as app, armwright.arm.load as load\n"
        f"def struck(): os.kill(os.getpid(), {int(number)}); time.sleep(60)\n"
        "load.arm_names = struck\n"
        "sys.argv = ['armwright', 'arms']\n"
        "app.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120)

    assert (done.returncode, done.stderr) == (128 + number, "armwright: interrupted; nothing was written\n")
    assert ExitStatus(done.returncode)


@pytest.mark.parametrize("arguments", ["show ur5", "show ur5 --json", "arms"])
def test_broken_pipe(arguments: str) -> None:
    """Where nobody reads the output any more, a command ends without a word."""
    command = f"{sys.executable} -m armwright {arguments} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)

    assert (done.returncode, done.stderr) == (ExitStatus.BROKEN_PIPE, "")
