"""The command ``armwright repl``, through a pipe and at a terminal."""

import contextlib
import fcntl
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cli_calls import armwright

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

ROOT = Path(__file__).parents[2]
CELL = ROOT / "tests" / "program" / "corpus" / "cell1.json"
STACKING = ROOT / "examples" / "stacking.rlo"
PLACE = "a = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15, 0.20)"
# A terminal answers at once; this long it may take to start on a busy machine.
PATIENCE = 300.0


def fed(*lines: str, options: tuple[str | Path, ...] = ("--cell", CELL), cwd: Path | None = None) -> tuple[int, str]:
    """Feed lines through a pipe; return exit status and what was said."""
    done = armwright("repl", *options, columns=100, cwd=cwd, fed="".join(f"{line}\n" for line in lines))
    assert "Traceback" not in done.stdout + done.stderr
    return done.returncode, done.stdout + done.stderr


def test_a_conversation() -> None:
    """Without a terminal there are no prompts: values, printed lines and the trace come one below the other."""
    status, said = fed(
        "VAR a : FRAME ; n : SCALAR",
        "n = 2",
        "n * 21",
        PLACE,
        "IF n = 2 THEN",
        '  PRINT("moving")',
        "MOVE ARM_1 TO a",
        ":time",
    )

    assert status == 0
    first, second, third, fourth = said.splitlines()
    assert (first, second) == ("42", "moving")
    assert re.fullmatch(r" +\d\.\d{3}  ARM_1 MOVE: PTP a @100", third)
    assert fourth == f"{third.split()[0]} s"


def test_what_goes_wrong_counts() -> None:
    """An error is told with its line, the lines behind it are taken all the same, and the exit status is 1."""
    status, said = fed("VAR n : SCALAR", "", ":time", "n = m", "n = 3", "n")

    assert status == 1
    assert "error[E202]" in said
    assert "--> session:4:5" in said
    assert said.endswith("3\n")


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (":frame", "error: no command ':frame'. Did you mean ':frames'?"),
        (":undo", "error: there is nothing to undo"),
        (":undo x", "error: expected an integer from 1, got 'x'"),
        (":undo 0", "error: expected an integer from 1, got '0'"),
        (":redo", "error: there is nothing to redo"),
        (":load", "error: :load needs FILE, such as `:load stacking.rlo`"),
        (":load nowhere.rlo", "error: nowhere.rlo: no such file"),
        (":time now", "error: :time takes no argument, got 'now'"),
        (":save /", "error: cannot write '/': it is a folder"),
        (":save /proc/no/where", "error: cannot make '/proc/no'"),
        (":", "error: no command ':'"),
        ("\x00\ufffd\U0001f916", "error[E101]"),
        ("(" * 5000, "error[E119]"),
        ("BEGIN", "error[E115]: BEGIN has no END"),
        ("{ open", "error[E102]: this comment is not closed"),
    ],
)
def test_slips(line: str, text: str) -> None:
    """Every slip has a message and its exit status: of a command, of a file, of the text of a statement."""
    status, said = fed(line)

    a_file = line.startswith((":save /", ":load nowhere"))
    assert status == (4 if a_file else 2 if line.startswith(":") else 1)
    assert text in said


def test_help() -> None:
    """:help tells every command in a line."""
    status, said = fed(":help")

    assert status == 0
    for command in (
        "frames",
        "arms",
        "time",
        "list",
        "undo",
        "redo",
        "load",
        "save",
        "save!",
        "report",
        "help",
        "quit",
    ):
        assert re.search(rf"^  :{command}( \S+)?  +\w", said, re.MULTILINE), command


def test_quit() -> None:
    """Behind :quit nothing is read."""
    assert fed("1", ":quit", "2") == (0, "1\n")


def test_a_program_to_begin_with() -> None:
    """A program given on the command line is done first, and the session goes on from its end."""
    status, said = fed(":undo", ":list", options=(STACKING, "--cell", ROOT / "examples" / "stanford_cell.toml"))

    assert status == 0
    assert "ARM_1 [OBJ1] MOVE: PTP OBJ2 @100" in said
    taken = re.search(r"^undone: (.*)$", said, re.MULTILINE)
    assert taken is not None
    assert taken[1] not in said.partition("taken back")[2].partition("\n")[2]


def test_a_program_with_errors() -> None:
    """Errors of a program given on the command line have its own lines."""
    program = ROOT / "tests" / "program" / "corpus" / "m2.rlo"

    status, said = fed("1 + 1", options=(program, "--cell", CELL))

    assert status == 1
    assert "--> m2.rlo:6:15" in said
    assert said.endswith("2\n")


def test_no_such_file() -> None:
    """A program or a cell that does not exist ends the command with one message."""
    for arguments in (("nowhere.rlo",), ("--cell", "nowhere.toml")):
        done = armwright("repl", *arguments)
        assert done.returncode == 4
        assert done.stderr.startswith("armwright: nowhere")


def test_saving(tmp_path: Path) -> None:
    """A saved session runs to the same end by itself; a file is written over only with an exclamation mark."""
    status, said = fed(
        "VAR a : FRAME ; n : SCALAR",
        PLACE,
        "OPEN ARM_1 ; MOVE ARM_1 TO a ; GRASP",
        "MOVE ARM_1 TO a * XYZ(0, 0, -0.05) STRAIGHTLY",
        ":time",
        f":save {tmp_path / 'new' / 'try it.rlo'}",
        f":save {tmp_path / 'new' / 'try it.rlo'}",
        f":save! {tmp_path / 'new' / 'try it.rlo'}",
    )
    run = armwright("run", tmp_path / "new" / "try it.rlo", "--cell", CELL, "--json")

    assert status == 4
    assert "exists already; `:save! " in said
    assert run.returncode == 0
    clock = re.search(r"^(\d+\.\d{3}) s$", said, re.MULTILINE)
    assert clock is not None
    assert f"{json.loads(run.stdout)['duration']:.3f}" == clock[1]
    remark = (tmp_path / "new" / "try it.rlo").read_text().splitlines()[0]
    assert remark.startswith("// armwright run 'try it.rlo' --cell ")


def test_a_saved_import_finds_its_file(tmp_path: Path) -> None:
    """What a session or a loaded program imports is named in a saved program as seen from its own folder."""
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "cell.json").write_text(CELL.read_text())
    (tmp_path / "cells" / "first.rlo").write_text('IMPORT "cell.json" ;\nBEGIN\n  OPEN ARM_1 ;\nEND.\n')

    status, said = fed(
        ":load cells/first.rlo", "DIST(station, WORLD)", ":save out/second.rlo", options=(), cwd=tmp_path
    )

    assert (status, said.splitlines()[1]) == (0, "0.45")
    assert 'IMPORT "../cells/cell.json" ;' in (tmp_path / "out" / "second.rlo").read_text()
    assert armwright("run", "out/second.rlo", cwd=tmp_path).returncode == 0


def test_a_report(tmp_path: Path) -> None:
    """:report leaves the program and the five files of a run; they tell the same clock as the session."""
    status, said = fed(
        "VAR a : FRAME", PLACE, "MOVE ARM_1 TO a", "VAR late : FRAME ; late = a", ":time", f":report {tmp_path / 'out'}"
    )

    assert status == 0
    assert said.endswith(f"report: {tmp_path / 'out' / 'report.html'}\n")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"session.rlo", "motion.csv", "events.jsonl", "frames.json", "run.json", "report.html"}
    data = json.loads((tmp_path / "out" / "run.json").read_text())
    assert f"{data['duration']:.3f} s" in said.splitlines()
    assert data["trace"] == ["ARM_1 MOVE: PTP a @100"]


def test_a_report_without_arms(tmp_path: Path) -> None:
    """A session without a cell has a report too."""
    status, _ = fed("VAR n : SCALAR", "n = 1", f":report {tmp_path / 'out'}", options=())

    assert status == 0
    assert (tmp_path / "out" / "report.html").stat().st_size


def test_many_lines() -> None:
    """Of the very many lines of a statement the first and the last are shown, and how many there are between."""
    status, said = fed("VAR i : SCALAR", "FOR i = 1 TO 20000 DO PRINT(i)", 'PRINT("' + "x" * 5000 + '")')

    lines = said.splitlines()
    assert status == 0
    assert lines[499:502] == ["500", "... and 19,000 more; `:report DIR` writes all to events.jsonl", "19501"]
    assert len(lines) == 1002
    assert "... and 4,000 more; " in lines[-1]


def test_json() -> None:
    """With --json every input has one line of data, also one with an error."""
    status, said = fed(
        "VAR n : SCALAR", "n = 2", "n", "m", "IF n = 2 THEN", "PRINT(1)", ":undo", ":oh", options=("--json",)
    )

    rows = [json.loads(line) for line in said.splitlines()]
    assert status == 2
    assert [row["exit_status"] for row in rows] == [0, 0, 0, 1, 0, 0, 2]
    assert [row["ok"] for row in rows] == [True, True, True, False, True, True, False]
    assert rows[2]["printed"] == ["2"]
    assert rows[3]["diagnostics"][0]["code"] == "E202"
    assert rows[4]["effects"][0]["kind"] == "PRINT"
    assert rows[5]["lines"] == ["undone: IF n = 2 THEN PRINT(1)"]
    assert (rows[3]["error"]["code"], rows[3]["error"]["line"]) == ("E202", 4)
    assert rows[6]["error"]["class"] == "UnknownNameError"
    assert rows[6]["error"]["message"].startswith("no command ':oh'")


def test_the_old_language() -> None:
    """--std=83 takes nothing of RLO-2."""
    status, said = fed("HALT", options=("--std", "83", "--cell", CELL))

    assert status == 1
    assert "E214" in said


def test_answers_come_at_once() -> None:
    """Whoever feeds a pipe line by line has the answer before the next line."""
    command = [sys.executable, "-m", "armwright", "repl"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as talk:
        assert talk.stdin is not None
        assert talk.stdout is not None
        for number in range(3):
            talk.stdin.write(f"{number} + 1\n")
            talk.stdin.flush()
            assert talk.stdout.readline() == f"{number + 1}\n"
        talk.stdin.close()
        assert talk.wait(PATIENCE) == 0


# ---- at a terminal -------------------------------------------------------------------------------------------------


class Terminal:
    """Somebody who types and reads."""

    def __init__(self, process: subprocess.Popen[bytes], end: int) -> None:
        self.process, self._end = process, end
        self.seen = ""

    def type(self, text: str) -> None:
        """Type some characters, no sooner than a person can: a terminal that is being set up drops some."""
        time.sleep(0.05)
        os.write(self._end, text.encode())

    def interrupt(self) -> None:
        """Press Ctrl-C, no sooner than a person can who has seen what there is to see."""
        time.sleep(0.5)
        os.write(self._end, b"\x03")

    def until(self, text: str) -> str:
        """Read until a text appears; return what came up to its end, without colours."""
        limit = time.monotonic() + PATIENCE
        while text not in self.seen:
            assert time.monotonic() < limit, f"waited for {text!r}, saw {self.seen!r}"
            ready, _, _ = select.select([self._end], [], [], 1.0)
            if ready:
                try:
                    came = os.read(self._end, 4096).decode(errors="replace")
                except OSError:
                    came = ""
                assert came, f"ended while waiting for {text!r}: {self.seen!r}"
                self.seen += re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]|\x07", "", came)
        before, _, self.seen = self.seen.partition(text)
        return before + text


@contextlib.contextmanager
def terminal(cache: Path, *options: str | Path, cwd: Path | None = None) -> Iterator[Terminal]:
    """Open a session at a terminal of its own."""
    ours, theirs = pty.openpty()
    settings = {
        key: value for key, value in os.environ.items() if key not in ("ARMWRIGHT_CACHE", "NO_COLOR", "INPUTRC")
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "armwright", "repl", *map(str, options)],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        cwd=cwd,
        env={**settings, "XDG_CACHE_HOME": str(cache), "TERM": "xterm", "COLUMNS": "200", "INPUTRC": os.devnull},
        start_new_session=True,
        # Ctrl-C reaches those whose own terminal it is.
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # noqa: PLW1509 - the tests have one thread
    )
    os.close(theirs)
    try:
        yield Terminal(process, ours)
    finally:
        process.kill()
        process.wait()
        os.close(ours)


def test_prompts(tmp_path: Path) -> None:
    """At a terminal there is a greeting, a prompt with the number of the line, and another where more must come."""
    with terminal(tmp_path) as screen:
        assert "RLO-2 without arms" in screen.until("rlo 1> ")
        screen.type("VAR n : SCALAR\n")
        screen.until("rlo 2> ")
        screen.type("BEGIN n = 5 ;\n")
        screen.until("... 3> ")
        screen.type("PRINT(n) END\n")
        assert "\n5\r\n" in screen.until("rlo 4> ")
        screen.type("\x04")
        assert screen.process.wait(PATIENCE) == 0


def test_completion(tmp_path: Path) -> None:
    """The tab key completes words as the line writes them, names as they are spelled, commands and files."""
    (tmp_path / "peg_in_hole.rlo").write_text("BEGIN\n  PRINT(12345)\nEND.\n")
    with terminal(tmp_path, cwd=tmp_path) as screen:
        screen.until("rlo 1> ")
        screen.type("VAR Gripper_place : SCA\t\n")
        assert "SCALAR" in screen.until("rlo 2> ")
        screen.type("gri\t = 7\n")
        assert "Gripper_place" in screen.until("rlo 3> ")
        screen.type("prin\t(Gri\t)\n")
        assert "\n7\r\n" in screen.until("rlo 4> ")
        screen.type(":ti\t\n")
        assert "0.000 s" in screen.until("rlo 5> ")
        screen.type(":load ./pe\t\n")
        assert "\n12345\r\n" in screen.until("rlo 9> ")


def test_ctrl_c(tmp_path: Path) -> None:
    """Ctrl-C abandons a line, and a statement that runs: the session goes on as it was before."""
    with terminal(tmp_path) as screen:
        screen.until("rlo 1> ")
        screen.type("VAR n : SCALAR ; n = 1\n")
        screen.until("rlo 2> ")
        screen.type("n = 77")
        screen.until("n = 77")
        screen.interrupt()
        screen.until("rlo 2> ")
        screen.type("BEGIN\n")
        screen.until("... 3> ")
        screen.interrupt()
        screen.until("rlo 3> ")
        screen.type("WHILE 1 = 1 DO n = n + 1\n")
        screen.interrupt()
        assert "interrupted; the current statement was undone" in screen.until("rlo 4> ")
        screen.type("n\n")
        assert "\n1\r\n" in screen.until("rlo 5> ")
        assert screen.process.poll() is None


def test_history(tmp_path: Path) -> None:
    """The arrow keys bring back lines of an earlier session, kept in the user's cache folder."""
    with terminal(tmp_path) as screen:
        screen.until("rlo 1> ")
        screen.type("17 * 3\n")
        screen.until("51")
        screen.until("rlo 2> ")
        screen.type(":quit\n")
        assert screen.process.wait(PATIENCE) == 0
    assert "17 * 3" in (tmp_path / "armwright" / "repl_history").read_text()

    with terminal(tmp_path) as screen:
        screen.until("rlo 1> ")
        screen.type("\x1b[A\x1b[A + 1\n")
        assert "\n52\r\n" in screen.until("rlo 2> ")


def test_a_history_that_cannot_be_kept(tmp_path: Path) -> None:
    """Where the cache folder cannot be written, a session ends as well as any."""
    (tmp_path / "armwright").write_text("a file where the folder should be")

    with terminal(tmp_path) as screen:
        screen.until("rlo 1> ")
        screen.type("1 + 1\n")
        screen.until("rlo 2> ")
        screen.type("\x04")
        assert screen.process.wait(PATIENCE) == 0


def test_ctrl_c_in_a_pipe() -> None:
    """Without a terminal Ctrl-C ends the command as it ends any other."""
    with subprocess.Popen(
        [sys.executable, "-m", "armwright", "repl"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as talk:
        assert talk.stdin is not None
        assert talk.stdout is not None
        talk.stdin.write("1\n")
        talk.stdin.flush()
        assert talk.stdout.readline() == "1\n"
        talk.send_signal(signal.SIGINT)
        assert talk.wait(PATIENCE) == 130


def test_paths_that_cannot_be(tmp_path: Path) -> None:
    """A path with a zero byte or of a name too long is told of, and the session goes on."""
    wrong = ("x\0y", "n" * 300)
    status, said = fed(
        *(f":{word} {path}" for path in wrong for word in ("save", "save!", "report")), "42", cwd=tmp_path
    )

    assert status == 4
    assert said.count("; nothing was written") == 6
    assert said.endswith("42\n")
    assert list(tmp_path.iterdir()) == []


def test_a_report_that_is_refused(tmp_path: Path) -> None:
    """Where a file of the user's stands in the way of a report, nothing of it is written."""
    (tmp_path / "report.html").write_text("mine")

    status, said = fed(
        f":report {tmp_path}", f":report {tmp_path / 'report.html' / 'below'}", f":report {tmp_path}/a/b"
    )

    assert status == 4
    assert said.count("nothing was written") == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "report.html"]
    assert (tmp_path / "a" / "b" / "session.rlo").exists()


def test_a_line_without_end() -> None:
    """A line is no longer than a program; a mark of byte order before the first is none of its letters."""
    status, said = fed("\ufeff6 * 7", "1" * 1_000_001)

    assert status == 4
    assert said.splitlines()[0] == "42"
    assert "standard input: a line is too long" in said
