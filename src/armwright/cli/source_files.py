"""Reading programs, printing differences and writing programs back, for the commands that change them."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armwright.program.language.source import Source

# The path that denotes the standard input.
INPUT = Path("-")


def read_source(path: Path) -> "Source":
    """Read a program, from the standard input for ``-``.

    Raises:
        FileFormatError: the program cannot be read, is larger than the limit, or is not UTF-8 text.
    """
    import sys

    from armwright.files.inputs import read_program, read_typed_program
    from armwright.program.language.source import Source

    if path == INPUT:
        return Source("standard input", read_typed_program(sys.stdin.buffer))
    return Source(str(path), read_program(path))


def is_stream(path: Path) -> bool:
    """Whether a program comes from the standard input, a pipe or a device, so that its new text is printed."""
    from armwright.files.output import descriptor

    return path == INPUT or descriptor(path) is not None or (path.exists() and not path.is_file())


def print_difference(source: "Source", after: str) -> None:
    """Print the changes of a program as ``diff -u`` does, in colour on a terminal."""
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


def write_back(source: "Source", path: Path, text: str) -> None:
    """Replace the text of a program in its file, completely or not at all; links and permissions are preserved.

    The most frequent line ending of the file is used, and a byte order mark is preserved.

    Args:
        source: the program as it was read.
        path: its file.
        text: its new text.

    Raises:
        FileFormatError: the file cannot be read any more.
        OutputError: the file cannot be written, or has changed since; the message has the reason.
    """
    from codecs import BOM_UTF8

    from armwright.errors import OutputError
    from armwright.files.inputs import decode, read_bytes
    from armwright.files.output import write_file

    data = read_bytes(path, "program_mb")
    if decode(data, path) != source.text:
        raise OutputError(f"cannot write '{path}': it has changed since it was read; nothing was written")
    mark = "\ufeff" if data.startswith(BOM_UTF8) else ""
    end = "\r\n" if 2 * data.count(b"\r\n") > data.count(b"\n") else "\n"
    write_file(path, mark + text.replace("\n", end), back=True)
