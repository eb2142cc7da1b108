"""The command ``armwright debug`` on a terminal, as a user types into it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from armwright.cli.app import app
from armwright.program.vm import excerpt

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
BENCH, STANFORD = EXAMPLES / "bench.rlo", EXAMPLES / "stanford_cell.toml"


def debug(*commands: str, program: Path = BENCH, cell: Path = STANFORD) -> tuple[int, list[str]]:
    """Type commands into a debugger; return its exit status and what it says, without its prompts."""
    done = subprocess.run(
        [sys.executable, "-m", "armwright", "debug", str(program), "--cell", str(cell)],
        input="".join(f"{one}\n" for one in commands),
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "NO_COLOR": "1"},
        timeout=300,
    )
    assert done.stderr == ""
    return done.returncode, done.stdout.replace("(rlo) ", "").splitlines()


def test_steps_and_values() -> None:
    """Each step shows the line that it ends at; values are worked out, changed, and forgotten on the way back."""
    status, said = debug("n", "", "b 11", "c", "p DIST(obj1, apf1)", "set obj2 = obj1 * t1", "where", "back", "q")

    assert status == 0
    assert said[:4] == [
        "    0.000 s  program, line 5",
        "    5      station = (1,0,0, 0,1,0, 0,0,1, 0.45,0,0) ;",
        "    0.000 s  program, line 6",
        "    6      obj1    = (1,0,0, 0,-1,0, 0,0,-1, 0.40,0.15,0.05) ;",
    ]
    assert "breakpoint 1 in line 11" in said
    assert "    0.000 s  program, line 11: breakpoint" in said
    assert "0.1  SCALAR" in said
    assert "(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.15)" in said
    assert "*1  program, line 11: move ARM-1 to obj1 with approach = apf1 ," in said
    assert said[-2:] == ["    0.000 s  program, line 10", "   10      affix apf1 to obj1 at t1 ;"]


def test_inputs_by_hand(tmp_path: Path) -> None:
    """An input is switched while the program stands still, and the program goes on with it."""
    program = tmp_path / "door.rlo"
    text = "BEGIN\n  PAUSE 1 ;\n  WAIT UNTIL NOT INPUT(door_closed) WITHIN 2 ;\n  PRINT(TIME)\nEND.\n"
    program.write_text(text, encoding="utf-8")
    status, said = debug(
        "n",
        "set input(Door_Closed) = off",
        "set ANALOG(oil) = 12.5",
        "p INPUT(door_closed)",
        "set INPUT(door_close) = 1",
        "set INPUT(door_closed) = 2",
        "set INPUT(door_closed) = soon",
        "set ANALOG(oil) = nan",
        "c",
        program=program,
        cell=EXAMPLES / "press_cell.toml",
    )

    assert status == 0
    assert {"false", "12.5", "false  condition"} < set(said)
    assert any("has no input DOOR_CLOSE; did you mean DOOR_CLOSED?" in line for line in said)
    assert any("is digital: expected 0 or 1, got 2" in line for line in said)
    assert "expected TRUE, FALSE or a number, got `soon`" in said
    assert any("expected a finite number, got nan" in line for line in said)
    assert any('PRINT "1"' in line for line in said)


def test_whole_words() -> None:
    """Who types the words of other debuggers gets what their letters give."""
    letters = debug("n", "s", "b 11", "c", "p DIST(obj1, apf1)", "t 3", "g", "x 1", "q")
    words = debug(
        "next", "step", "break 11", "continue", "print DIST(obj1, apf1)", "tick 3", "stage", "delete 1", "quit"
    )

    assert words == letters
    assert "breakpoint 1 in line 11" in words[1]


def test_stages_ticks_and_the_end() -> None:
    """Stages and ticks of a MOVE can be stepped through, a frame watched, and a finished program taken back."""
    _, said = debug("b 11", "c", "g", "t 5", "d apf1", "x 1", "c", "frames", "c", "back", "q")

    assert "    0.000 s  program, line 11: ARM_1 begins PTP apf1" in said
    assert "    0.005 s  program, line 11" in said
    assert any(line.endswith("line 14: apf1 begins to move with ARM_1") for line in said)
    assert any(line.startswith("      apf1  (") for line in said), "apf1 hangs on obj1, which hangs on the arm"
    assert any(line.endswith("the program has ended; `back` still undoes its statements") for line in said)
    assert said[-1] == "   15  end."


def test_slips_of_the_user() -> None:
    """What the debugger does not understand it says, and goes on."""
    status, said = debug("jump", "b soon", "b 99", "p nobody", "x 7", "set 1 = 2", "th 3", "help", "q")

    assert status == 0
    assert "unknown command `jump`; `help` lists the commands" in said
    assert "expected an integer, got `soon`" in said
    assert "no statement begins on this line or below" in said
    assert any(line.startswith("`nobody` is not declared") for line in said)
    assert "there is no breakpoint 7" in said
    assert "cannot assign to `1`" in said
    assert "expected the number of a process, 1 to 1, got 3" in said
    assert any(line.startswith("n         next statement") for line in said)


def test_a_program_that_goes_wrong(tmp_path: Path) -> None:
    """An error is shown with its line, and the program stands in front of it."""
    program = tmp_path / "wrong.rlo"
    program.write_text("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  PRINT(1 / n)\nEND.\n")
    status, said = debug("c", "p n", "c", "q", program=program)

    assert status == 3
    assert "error[E240]: 1 cannot be divided by 0" in said
    assert "    0.000 s  program, line 4: 1 cannot be divided by 0" in said
    assert "0  SCALAR" in said


def test_the_status_of_where_a_program_stands(tmp_path: Path) -> None:
    """Who leaves a program in front of its failure ends with the failure's status; who mends it does not."""
    program = tmp_path / "wrong.rlo"
    program.write_text("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  PRINT(1 / n)\nEND.\n")

    assert debug("c", program=program)[0] == 3
    assert debug("c", "c", "back", "q", program=program)[0] == 0
    assert debug("c", "set n = 1", "c", program=program)[0] == 0


def test_many_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many lines that come at once the first and the last are shown, and how many there are between."""
    program = tmp_path / "many.rlo"
    program.write_text('VAR i : SCALAR ;\nBEGIN\n  FOR i = 1 TO 20000 DO PRINT("again") ;\nEND.\n')
    monkeypatch.setattr(excerpt, "MAX_TERMINAL_LINES", 4)

    done = CliRunner().invoke(app, ["debug", str(program), "--cell", str(STANFORD)], input="c\nq\n")

    said = done.output.splitlines()
    left_out = [int(one.split()[2].replace(",", "")) for one in said if one.startswith("... and ")]
    assert done.exit_code == 0
    assert "more; `armwright run -o FOLDER` writes all to events.jsonl" in done.output
    # The end of the program is a line, too, and may be among those left out.
    assert 0 <= sum('PRINT "again"' in one for one in said) + sum(left_out) - 20_000 <= 1


def test_a_program_that_cannot_run(tmp_path: Path) -> None:
    """A program with errors is not debugged; its messages are printed and the status is 1."""
    program = tmp_path / "wrong.rlo"
    program.write_text("BEGIN\n  OPNE ARM_1\nEND.\n")
    status, said = debug(program=program)

    assert status == 1
    assert said[0] == "error[E105]: unknown statement `OPNE`"


def test_numbers_of_any_length() -> None:
    """A number of thousands of digits is none, and the session goes on; a mark of byte order is no command."""
    digits = "9" * 5000
    status, said = debug(f"\ufefft {digits}", f"b {digits}", f"x {digits}", f"th {digits}", "p 6 * 7", "q")

    assert status == 0
    assert [line[:26] for line in said[-5:-1]] == ["expected an integer, got `"] * 4
    assert said[-1].startswith("42")
