"""The command ``armwright fmt``, as a user calls it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from armwright.cli.source_files import read_source
from armwright.errors import OutputError
from armwright.files.output import write_back
from cli_calls import armwright, fed_to

WRITTEN = "begin open arm-1 ; { now } grasp end.\n"
LAID_OUT = "BEGIN\n  OPEN ARM_1 ;  { now }\n  GRASP\nEND.\n"


def fmt(
    *arguments: str | Path, typed: str | bytes = "", folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Call the command where nobody watches."""
    return armwright("fmt", *arguments, columns=100, cwd=folder, fed=typed)


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Return a program that is not laid out."""
    path = tmp_path / "arm.rlo"
    path.write_text(WRITTEN)
    return path


def test_in_place(written: Path) -> None:
    """A program is laid out where it is, and then left as it is."""
    first, second = fmt(written), fmt(written)

    assert written.read_text() == LAID_OUT
    assert (first.returncode, first.stdout) == (0, f"formatted: {written}\n")
    assert (second.returncode, second.stdout) == (0, f"unchanged: {written}\n")
    assert [path.name for path in written.parent.iterdir()] == ["arm.rlo"]


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_ends_of_lines(written: Path, mark: bytes, end: bytes) -> None:
    """Lines go on to end as they did, and a mark of byte order stays, whether fmt or fix has changed them."""
    written.write_bytes(mark + b"begin open arm-1 ;\n{ now } grasp\nend.\n".replace(b"\n", end))

    write_back(written, read_source(written).text, LAID_OUT)

    assert written.read_bytes() == mark + LAID_OUT.encode().replace(b"\n", end)
    assert read_source(written).text == LAID_OUT


def test_check(written: Path) -> None:
    """With --check nothing is written, and the exit status tells whether something would have been."""
    result = fmt(written, "--check")
    assert (result.returncode, result.stdout) == (5, f"would change: {written}\n")
    assert written.read_text() == WRITTEN

    written.write_text(LAID_OUT)
    assert fmt(written, "--check").returncode == 0


def test_diff(written: Path) -> None:
    """With --diff what would change is shown and nothing is written."""
    result = fmt(written, "--diff")

    assert result.returncode == 0
    assert result.stdout.splitlines() == [
        f"--- {written}",
        f"+++ {written} (changed)",
        "@@ -1,2 +1,5 @@",
        "-begin open arm-1 ; { now } grasp end.",
        *(f"+{line}" for line in LAID_OUT.splitlines()),
        " ",
    ]
    assert written.read_text() == WRITTEN


def test_stdout_and_numbers(written: Path) -> None:
    """With --stdout the program is printed; lines are numbered if wanted."""
    result = fmt(written, "--stdout", "--numbers", "100")

    assert result.stdout.splitlines() == [
        "100  BEGIN",
        "200    OPEN ARM_1 ;  { now }",
        "300    GRASP",
        "400  END.",
    ]
    assert written.read_text() == WRITTEN


def test_standard_input() -> None:
    """``-`` reads what is typed and prints it."""
    assert fmt("-", typed=WRITTEN).stdout == LAID_OUT
    assert fmt("-", "--check", typed=WRITTEN).returncode == 5
    assert fmt("-", "--check", typed=LAID_OUT).returncode == 0


def test_changed_meanwhile(written: Path) -> None:
    """What somebody writes into a program while it is laid out is not lost."""
    source = read_source(written)
    written.write_text(f"{WRITTEN}{{ mine }}")

    with pytest.raises(OutputError, match="it has changed since it was read; nothing was written"):
        write_back(written, source.text, LAID_OUT)
    assert written.read_text().endswith("{ mine }")


def test_descriptor_of_a_file(written: Path) -> None:
    """The standard input is printed by its other name, too, and the file behind it stays as it is."""
    with written.open("rb") as file:
        command = [sys.executable, "-m", "armwright", "fmt", "/dev/stdin"]
        done = subprocess.run(command, stdin=file, capture_output=True, check=True, timeout=300)

    assert done.stdout.decode() == LAID_OUT
    assert written.read_text() == WRITTEN


def test_what_is_piped_in(tmp_path: Path) -> None:
    """A pipe is not written back to: what becomes of its program is printed, and stands in the document."""
    assert fed_to("fmt", "pipe", tmp_path, piped=WRITTEN).stdout == LAID_OUT
    assert json.loads(fed_to("fmt", "pipe", tmp_path, "--json", piped=WRITTEN).stdout)[0]["text"] == LAID_OUT
    assert fed_to("fmt", "pipe", tmp_path, "--check", piped=WRITTEN).returncode == 5


def test_standard_input_that_is_no_text() -> None:
    """Bytes that are no text are refused with their line."""
    result = fmt("-", typed=b"BEGIN\n\xff END.")

    assert result.returncode == 4
    reason = "not UTF-8 text: byte 0xff is invalid; save it as UTF-8"
    assert result.stderr == f"armwright: standard input:2: {reason}\n"


def test_wrong_program(written: Path) -> None:
    """A program with a slip of syntax is left alone and told of; the others are laid out all the same."""
    wrong, missing = written.with_name("wrong.rlo"), written.with_name("missing.rlo")
    wrong.write_text("begin\ngrasp grasp\nend.")
    result = fmt(wrong, missing, written)

    assert result.returncode == 4
    first, second = result.stderr.splitlines()
    assert first == f"armwright: {wrong}:2:6: cannot be formatted: missing `;` between two statements (E104)"
    assert second.startswith(f"armwright: {missing}: no such file")
    assert wrong.read_text() == "begin\ngrasp grasp\nend."
    assert written.read_text() == LAID_OUT


def test_links_and_rights(written: Path) -> None:
    """A link stays a link, and who may write a file may go on."""
    written.chmod(0o640)
    link = written.with_name("link.rlo")
    link.symlink_to(written)
    fmt(link)

    assert link.is_symlink()
    assert written.read_text() == LAID_OUT
    assert written.stat().st_mode & 0o777 == 0o640


def test_old_standard(written: Path) -> None:
    """What is a name in RLO-83 is one only with --std=83."""
    written.write_text("var on : frame; begin read visions(ON) end.")

    assert "E107" in fmt(written).stderr
    assert fmt(written, "--std", "83", "--stdout").stdout.splitlines()[2] == "  READ VISIONS (on)"


def test_json(written: Path) -> None:
    """As JSON, each program has its row."""
    wrong = written.with_name("wrong.rlo")
    wrong.write_text("begin grasp")
    result = fmt(written, wrong, "--check", "--json")
    right, bad = json.loads(result.stdout)

    assert result.returncode == 5
    assert right == {"program": str(written), "exit_status": 5, "changed": True}
    assert bad["program"] == str(wrong)
    assert "the program has no END" in bad["error"]["message"]


def test_help() -> None:
    """The help has an example."""
    result = fmt("--help")

    assert result.returncode == 0
    assert "armwright fmt examples/peg.rlo --diff" in result.stdout
