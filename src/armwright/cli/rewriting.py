"""What the commands that change programs share: reading them, showing the difference, writing them back."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armwright.program.text.source import Source

# The program that stands for what is typed or piped in.
INPUT = Path("-")


def read_source(path: Path) -> "Source":
    """Read a program, or the standard input for ``-``.

    Raises:
        FileFormatError: it cannot be read, is larger than the limit, or is not UTF-8 text.
    """
    import sys

    from armwright.files.reading import read_program, read_typed_program
    from armwright.program.text.source import Source

    if path == INPUT:
        return Source("standard input", read_typed_program(sys.stdin.buffer))
    return Source(str(path), read_program(path))


def print_difference(source: "Source", after: str) -> None:
    """Print how a program would change, as ``diff -u`` does, in colour when a person watches."""
    import difflib

    from rich.text import Text

    from armwright.cli.terminal import console as clean_console

    before, new = source.text.split("\n"), after.split("\n")
    console = clean_console()
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

    write_file(path, text)
