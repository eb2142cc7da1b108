"""Nothing that is shown makes a terminal do something: names, texts and paths come out as letters."""

import io
import json
import os
import pty
import subprocess
import sys
import unicodedata
from pathlib import Path
from typing import Any

import pytest

from armwright.cli.terminal import CleanStream, bound_widths, cleaned, console
from cli_calls import armwright

# Red letters, a title, the bell, a C1 escape, text from right to left, a letter without width, back to the beginning.
HOSTILE = "\x1b[31m\x1b]0;owned\x07\x9b2J\u202eevil\u200b\r\x7f\U000e0041"
ARM = Path(__file__).resolve().parents[2] / "src" / "armwright" / "arm" / "catalogue" / "puma560.toml"
CELL = Path(__file__).resolve().parents[2] / "examples" / "puma_cell.toml"


def called(*arguments: str, cwd: Path, typed: str = "") -> str:
    """Return all that a command puts out."""
    done = armwright(*arguments, cwd=cwd, fed=typed)
    return done.stdout + done.stderr


def hidden(text: str) -> set[str]:
    """Return the letters that a terminal obeys or does not show."""
    return {one for one in text if unicodedata.category(one) in {"Cc", "Cf", "Zl", "Zp"}} - {"\n", "\t"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an arm, a cell, programs and tables that say hostile things."""
    quoted = json.dumps(HOSTILE).replace("\x7f", "\\u007f").replace("\\udb40\\udc41", "\\U000E0041")
    head, document, rest = ARM.read_text(encoding="utf-8").partition("[[document]]")
    arm = [line for line in head.splitlines() if not line.startswith(("name", "title", "source"))]
    arm.append(document + rest)
    (tmp_path / "arm.toml").write_text("\n".join([f"name = {quoted}\ntitle = {quoted}\nsource = {quoted}", *arm]))
    program = f'BEGIN\n  PRINT "{HOSTILE.replace(chr(13), "")}" ;\n  PAUSE 1 ;\nEND.\n'
    (tmp_path / "print.rlo").write_text(program)
    (tmp_path / "wrong.rlo").write_text(f"BEGIN\n  {HOSTILE} = 1 ;\nEND.\n{{ {HOSTILE} }}")
    (tmp_path / "import.rlo").write_text(f'IMPORT "{HOSTILE}" ;\nBEGIN PAUSE 1 END.\n')
    (tmp_path / "cell.toml").write_text(f"[{quoted}]\n")
    (tmp_path / "poses.toml").write_text(f"title = {quoted}\n[[pose]]\n{quoted} = 1\n")
    (tmp_path / "table.csv").write_text(f"{HOSTILE}\n1\n")
    return tmp_path


CALLS: list[tuple[str, ...]] = [
    ("show", HOSTILE),
    ("show", "./arm.toml"),
    ("show", "./arm.toml", "--json"),
    (HOSTILE,),
    ("show", f"--{HOSTILE}"),
    ("--raise", HOSTILE, "arms"),
    ("run", "print.rlo", "--cell", str(CELL)),
    ("run", "print.rlo", "--cell", "cell.toml"),
    ("run", f"{HOSTILE}.rlo", "--cell", str(CELL)),
    ("run", f"{HOSTILE}.rlo", "--cell", str(CELL), "--json"),
    ("check", "wrong.rlo"),
    ("check", "wrong.rlo", "--json"),
    ("check", "import.rlo"),
    ("fix", "wrong.rlo", "--diff"),
    ("fmt", "print.rlo", "--diff"),
    ("code", "print.rlo"),
    ("explain", HOSTILE),
    ("inverse", "./arm.toml", "--xyz", HOSTILE),
    ("forward", "./arm.toml", "-q", HOSTILE),
    ("forward", "./arm.toml", "--csv", "table.csv"),
    ("iso9283", "table.csv"),
    ("calibrate", "puma560", "table.csv"),
    ("move", "joint", "puma560", "poses.toml"),
    ("convert", "./arm.toml", "-o", "out.toml"),
    ("study", HOSTILE),
    ("clearance", "simulate", HOSTILE),
    ("clearance", HOSTILE),
    ("simulate", "puma560", "-q", "0,0,90,0,0,0", "--method", HOSTILE),
]


@pytest.mark.parametrize("arguments", CALLS, ids=lambda call: " ".join(call[:2]).encode("ascii", "ignore").decode())
def test_commands(arguments: tuple[str, ...], folder: Path) -> None:
    """Whatever a hostile name is given for, what is said of it holds letters alone."""
    said = called(*arguments, cwd=folder)

    # What these print may be read by another program: a listing of code shows the texts of the program as they are.
    allowed = hidden(HOSTILE) if arguments[0] == "code" else set()
    assert hidden(said) <= allowed, said
    assert "Traceback" not in said
    if "--json" in arguments:
        json.loads(said)


def test_conversations(folder: Path) -> None:
    """Neither does the interactive language, nor the debugger."""
    typed = f'PRINT "{HOSTILE}" ;\n:load {HOSTILE}\n{HOSTILE}\n'
    said = called("repl", "--cell", str(CELL), cwd=folder, typed=typed)
    assert "evil" in said
    assert not hidden(said), said
    for line in called("repl", "--json", "--cell", str(CELL), cwd=folder, typed=typed).splitlines():
        assert not hidden(line)
        json.loads(line)
    typed = f"list\nnext\nnext\nprint {HOSTILE}\nbreak {HOSTILE}\n{HOSTILE}\ncontinue\nquit\n"
    assert not hidden(called("debug", "print.rlo", "--cell", str(CELL), cwd=folder, typed=typed))


def test_a_terminal(folder: Path) -> None:
    """Where a person watches there are colours, which are ours, and no other escapes."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "armwright", "show", "./arm.toml"],
        cwd=folder,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**{k: v for k, v in os.environ.items() if k != "NO_COLOR"}, "TERM": "xterm-256color", "COLUMNS": "100"},
    )
    os.close(theirs)
    said = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:
            break
        if not piece:
            break
        said += piece
    process.wait(60)
    os.close(ours)

    assert b"\x1b[" in said
    assert b"\x1b]0;" not in said
    assert b"\\u001b" in said
    assert not {one for one in hidden(said.decode()) if one not in "\x1b\r"}


def test_every_character() -> None:
    """All that is control or format is escaped, as JSON escapes it; letters of any script stay."""
    everything = "".join(chr(code) for code in range(0x110000) if not 0xD800 <= code < 0xE000)

    assert hidden(cleaned(everything)) <= set("\u0600\u0601\u0602\u0603\u0604\u0605\u06dd\u070f\u0890\u0891\u08e2") | {
        one for one in everything if unicodedata.category(one) == "Cf" and ord(one) in range(0x11000, 0x14000)
    }
    assert cleaned("Größe 5 µm\t±3°\nπ ≤ 漢字 é") == "Größe 5 µm\t±3°\nπ ≤ 漢字 é"
    assert cleaned(HOSTILE).startswith("\\u001b[31m")
    assert json.loads(cleaned(json.dumps(everything[0x20:], ensure_ascii=False))) == everything[0x20:]


def test_streams() -> None:
    """What is printed is cleaned, what Rich writes to it has been; both come out in their order."""
    kept = io.BytesIO()
    stream: Any = CleanStream(io.TextIOWrapper(kept, encoding="utf-8"))
    print("a\x1b[1m", file=stream)
    console(file=stream, highlight=False, force_terminal=True, color_system="standard").print("b\x1b[2m", style="red")
    print("c", file=stream, flush=True)

    assert kept.getvalue() == b"a\\u001b[1m\n\x1b[31mb\\u001b[2m\x1b[0m\nc\n"


def test_one_way_to_print() -> None:
    """Commands make no console but the one that cleans."""
    folder = Path(__file__).resolve().parents[2] / "src" / "armwright"
    making = {path.name for path in folder.rglob("*.py") if "Console(" in path.read_text(encoding="utf-8")}
    assert making == {"terminal.py"}


@pytest.mark.parametrize("told", ["99999999999", "0", "-1", "wide", "\N{SUPERSCRIPT TWO}", "9" * 5000])
def test_impossible_widths(told: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not the size of a terminal is not taken for one; others stay."""
    monkeypatch.setenv("COLUMNS", told)
    monkeypatch.setenv("TERMINAL_WIDTH", told)
    monkeypatch.setenv("LINES", "40")
    bound_widths()

    assert "COLUMNS" not in os.environ
    assert "TERMINAL_WIDTH" not in os.environ
    assert os.environ["LINES"] == "40"
