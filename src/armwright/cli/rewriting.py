"""What the commands that change programs share: reading them, showing the difference, writing them back."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armwright.program.text.source import Source

# The program that stands for what is typed or piped in.
INPUT = Path("-")


def read_program(path: Path) -> "Source":
    """Read a program, or the standard input for ``-``.

    Raises:
        FileFormatError: it cannot be read, or is not UTF-8 text.
    """
    from armwright.files.document import read_text
    from armwright.program.text.source import Source

    return Source("standard input", _typed()) if path == INPUT else Source(str(path), read_text(path))


def _typed() -> str:
    import sys

    from armwright.errors import FileFormatError

    try:
        return sys.stdin.buffer.read().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        byte = error.object[error.start]
        raise FileFormatError(
            "standard input", line, "", f"not UTF-8 text: byte 0x{byte:02x} has no meaning"
        ) from error


def print_difference(source: "Source", after: str) -> None:
    """Print how a program would change, as ``diff -u`` does, in colour when a person watches."""
    import difflib

    from rich.console import Console
    from rich.text import Text

    before, new = source.text.split("\n"), after.split("\n")
    console = Console()
    styles = {"+": "green", "-": "red", "@": "cyan"}
    for line in difflib.unified_diff(before, new, source.name, f"{source.name} (changed)", lineterm=""):
        if console.is_terminal:
            console.print(Text(line, style=styles.get(line[0], "")), soft_wrap=True)
        else:
            print(line)


def write_back(path: Path, text: str) -> None:
    """Write a program where it was read: all of it or nothing; a link stays one, and who may read it may go on.

    Raises:
        OutputError: it cannot be written; the text says why.
    """
    from armwright.files.output import write_file

    file = path.resolve()
    mode = file.stat().st_mode
    write_file(file, text)
    file.chmod(mode)
