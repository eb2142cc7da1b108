"""How commands end."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from armwright import errors
from armwright.cli import failures
from armwright.errors import ArmwrightError, ExitStatus, FileFormatError
from cli_calls import armwright

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

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
        (("check", "none.rlo", "--format", "json"), 4, "FileFormatError", "none.rlo"),
        (("check", "none.rlo", "--format=json"), 4, "FileFormatError", "none.rlo"),
    ],
)
def test_error_as_json(arguments: tuple[str, ...], status: int, kind: str, message: str) -> None:
    """Under --json an error is a document with its status and class, and nothing else is printed."""
    done = armwright(*arguments, *(() if arguments[-1].endswith("json") else ("--json",)))
    told = json.loads(done.stdout)

    assert (done.returncode, done.stderr) == (status, "")
    assert (told["exit_status"], told["error"]["class"]) == (status, kind)
    assert message in told["error"]["message"]


def test_error_of_the_page(tmp_path: Path) -> None:
    """The document on the page is what its mistake is answered with."""
    told = json.loads(PAGE.partition("```json\n")[2].partition("```")[0])
    place = "[1, 0, 0,  0,-1, 0,  0, 0,-1,   0.45, 0.00, 0.25]"
    (tmp_path / "cell.toml").write_text(f"[arms.ARM_1]\nhand = {place}\n[motion]\nservo_ms = -1\n")
    (tmp_path / "p.rlo").write_text("BEGIN PAUSE 1 END.")

    done = armwright("check", "p.rlo", "--cell", "cell.toml", "--json", cwd=tmp_path)

    assert json.loads(done.stdout) == told


def test_error_of_a_file_as_json() -> None:
    """An error in a file is told with file, line and key of their own."""
    told = failures.failure_data(ExitStatus.FILE, FileFormatError("a.toml", 3, "mass_kg", "bad"), "said")

    assert told == {
        "exit_status": 4,
        "error": {"class": "FileFormatError", "message": "said", "file": "a.toml", "line": 3, "key": "mass_kg"},
    }


@pytest.fixture
def fails(monkeypatch: pytest.MonkeyPatch) -> Callable[[Exception], subprocess.CompletedProcess[str]]:
    """Return what calls a command in which an error arises."""

    def called(error: Exception) -> subprocess.CompletedProcess[str]:
        def broken() -> None:
            raise error

        monkeypatch.setattr("armwright.arm.load.arm_names", broken)
        return armwright("arms")

    return called


def test_our_fault(fails: Callable[[Exception], subprocess.CompletedProcess[str]]) -> None:
    """What nobody foresaw ends with 70 and one sentence with the place and what to do, without a traceback."""
    done = fails(KeyError("q"))

    assert (done.returncode, done.stdout) == (ExitStatus.INTERNAL_ERROR, "")
    assert done.stderr.startswith("armwright: a defect of armwright, not of its inputs: KeyError: 'q' (in broken,")
    assert "please report it" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("error", "status", "message"),
    [
        (EOFError("cut off"), 70, "EOFError: cut off"),
        (MemoryError(), 3, "this needs more memory than is available"),
        (PermissionError(13, "Permission denied", "a"), 4, "cannot read or write 'a': Permission denied"),
    ],
)
def test_errors_of_others(
    fails: Callable[[Exception], subprocess.CompletedProcess[str]], error: Exception, status: int, message: str
) -> None:
    """Errors of Python and of the machine end in one line, too."""
    done = fails(error)

    assert (done.returncode, len(done.stderr.splitlines())) == (status, 1)
    assert message in done.stderr


def test_output_without_room() -> None:
    """A standard output that takes no more is an error of the output."""
    program = "import armwright.cli.app as app, sys; sys.argv = ['armwright', 'arms']; app.main()"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", program], stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=120
        )

    assert (done.returncode, done.stderr) == (4, "armwright: cannot write the output: No space left on device\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals(number: signal.Signals) -> None:
    """A signal ends a command with 128 and its number, and one word."""
    usual = "signal.default_int_handler" if number == signal.SIGINT else "signal.SIG_DFL"
    program = (
        # Whoever runs the tests may ignore it, as nohup does, and commands respect that.
        f"import signal; signal.signal({int(number)}, {usual})\n"
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


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize(
    ("arguments", "status", "output", "errors"),
    [("arms", 0, True, False), ("show pumma560", 2, False, True), ("show pumma560 --json", 2, True, False)],
)
@pytest.mark.drawn(0.25)
def test_closed_streams(closed: str, arguments: str, status: int, output: bool, errors: bool) -> None:  # noqa: FBT001
    """What is said to a closed output is lost; it changes no status, and gets into no other stream."""
    command = f"{sys.executable} -m armwright {arguments} {closed}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)

    assert done.returncode == status
    assert bool(done.stdout) == (output and not re.search(r"(?<!2)>&-", closed))
    assert bool(done.stderr) == (errors and "2>&-" not in closed)
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("typed", "status"),
    [("PRINT (1) ;\n", 0), ("n = ;\n", 1), ("MOVE ARM_1 TO ARM_2 ;\n", 1), (":load none.rlo\n", 4), (":oh\n", 2)],
)
def test_statuses_of_a_session(typed: str, status: int) -> None:
    """A session that is read from a pipe ends with the highest status of its lines, and each line carries its own."""
    done = armwright("repl", "--json", fed=typed)

    assert done.returncode == status, done
    assert max(json.loads(line)["exit_status"] for line in done.stdout.splitlines()) == status


def test_status_of_a_statement_that_cannot_be_done() -> None:
    """A statement without errors that cannot be done is no error of the text."""
    cell = Path(__file__).parents[2] / "examples" / "stanford_cell.toml"
    typed = "VAR far : FRAME ;\nfar = (1,0,0,0,-1,0,0,0,-1,9,0,0.2) ;\nMOVE ARM_1 TO far ;\n"
    done = armwright("repl", "--json", "--cell", cell, fed=typed)

    assert done.returncode == ExitStatus.INFEASIBLE, done
    assert [json.loads(line)["exit_status"] for line in done.stdout.splitlines()] == [0, 0, 3]


def test_rows_carry_their_status(tmp_path: Path) -> None:
    """Where a command takes several files, each of its rows says how it went, and the highest ends the command."""
    (tmp_path / "good.rlo").write_text("BEGIN\n    PAUSE 1\nEND.\n")
    (tmp_path / "bad.rlo").write_text("BEGIN x = END.\n")
    files = ("good.rlo", "bad.rlo", "none.rlo")

    laid_out = armwright("fmt", "--json", "--check", *files, cwd=tmp_path)
    cured = armwright("fix", "--json", *files, cwd=tmp_path)

    rows = json.loads(cured.stdout)
    assert [row["exit_status"] for row in rows] == [0, 1, 4]
    assert [row.get("error", {}).get("class") for row in rows] == [None, "ProgramError", "FileFormatError"]
    assert rows[2]["error"]["file"] == "none.rlo"
    missing = json.loads(laid_out.stdout)[2]
    assert (missing["exit_status"], missing["error"]["class"]) == (4, "FileFormatError")
    assert laid_out.returncode == max(row["exit_status"] for row in json.loads(laid_out.stdout))
    assert cured.returncode == 4


def test_a_debugger_without_a_cell_is_called_wrongly(tmp_path: Path) -> None:
    """A program with errors and a program without a cell end the debugger differently."""
    (tmp_path / "bad.rlo").write_text("BEGIN x = END.\n")
    (tmp_path / "good.rlo").write_text("BEGIN PAUSE 1 END.\n")

    assert armwright("debug", "bad.rlo", cwd=tmp_path).returncode == ExitStatus.PROGRAM_ERRORS
    assert armwright("debug", "good.rlo", cwd=tmp_path).returncode == ExitStatus.USAGE


def test_changed_results_are_told(tmp_path: Path) -> None:
    """Whoever reads a file of results that was changed since it was written is told so."""
    from armwright.files.output import write_folder

    contents = {"points.csv": "a,b\n1,2\n", "told.json": "{}", "p.rlo": "BEGIN x = END.", "poses.toml": "x = 1"}
    write_folder(tmp_path / "out", contents, {"command": "armwright"})
    calls = {
        "points.csv": (("iso9283",), ("calibrate", "puma560"), ("clearance", "estimate", "five-bar")),
        "told.json": (("clearance", "correct", "five-bar", "--estimate"),),
        "p.rlo": (("run",),),
        "poses.toml": (("move", "joint", "puma560"),),
    }
    for name in calls:
        (tmp_path / "out" / name).write_text(contents[name] + " ")
    for name, commands in calls.items():
        for command in commands:
            done = armwright(*command, tmp_path / "out" / name)
            assert "differs from the file that is recorded" in done.stderr, (command, done)


@pytest.mark.parametrize(
    ("arguments", "status"),
    [("fmt -", 1), ("fix -", 1), ("repl", 0), ("repl --json", 0), ("debug", 0), ("lsp", 0)],
)
@pytest.mark.drawn(0.34)
def test_closed_input(arguments: str, status: int) -> None:
    """A closed standard input is an empty one."""
    command = f"{sys.executable} -m armwright {arguments} <&-"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)

    assert done.returncode == status, done.stderr


@pytest.mark.parametrize(
    ("arguments", "status"), [("show nosuch", 2), ("nosuch", 2), ("run", 2), ("check nosuch.rlo", 4), ("arms", 0)]
)
@pytest.mark.drawn(0.34)
def test_full_error_output(arguments: str, status: int) -> None:
    """What the error output cannot take is lost, and the status stays."""
    command = f"{sys.executable} -m armwright {arguments} 2>/dev/full"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)

    assert done.returncode == status


def test_folder_that_has_gone(tmp_path: Path) -> None:
    """An error of the system that names no file is none of the output, and stands in the document."""
    inside = tmp_path / "gone"
    inside.mkdir()
    sweep = "clearance sweep five-bar -n 2 --paths x1 -o o --json"
    command = f"cd {inside} && rmdir {inside} && {sys.executable} -m armwright {sweep}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)

    assert done.returncode == 4
    assert json.loads(done.stdout)["error"]["message"].startswith("cannot read or write the current folder: ")


def test_signal_that_nobody_heard() -> None:
    """A signal that comes while an object is cleared away, where exceptions go nowhere, is sent once more."""
    program = (
        "import os, signal, sys, time\n"
        "from armwright.cli import failures\n"
        "class Gone:\n"
        "    def __del__(self): os.kill(os.getpid(), signal.SIGINT); time.sleep(0.01)\n"
        "def work(**_):\n"
        "    Gone()\n"
        "    time.sleep(60)\n"
        "failures.run_and_exit(work)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=50)

    assert (done.returncode, done.stderr) == (130, "armwright: interrupted; nothing was written\n")
