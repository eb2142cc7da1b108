"""Reading programs, printing differences and writing programs back, for the commands that change them."""

import difflib
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import typer

from armwright.cli.failures import outcome
from armwright.cli.output import print_json
from armwright.cli.terminal import console
from armwright.errors import ArmwrightError, ExitStatus
from armwright.files.inputs import read_program, read_typed_program
from armwright.files.output import descriptor
from armwright.program.language.source import Source

# The path that denotes the standard input.
INPUT = Path("-")


def read_source(path: Path) -> Source:
    """Read a program, from the standard input for ``-``.

    Raises:
        FileFormatError: the program cannot be read, is larger than the limit, or is not UTF-8 text.
    """
    if path == INPUT:
        return Source("standard input", read_typed_program(sys.stdin.buffer))
    return Source(str(path), read_program(path))


def is_stream(path: Path) -> bool:
    """Whether a program comes from the standard input, a pipe or a device, so that its new text is printed."""
    return path == INPUT or descriptor(path) is not None or (path.exists() and not path.is_file())


def rewrite_all(programs: Iterable[Path], rewrite: Callable[[Path, dict[str, Any]], None], *, as_json: bool) -> None:
    """Rewrite programs one by one; a failure is reported, and does not keep the next ones from being rewritten.

    Args:
        programs: paths of the programs.
        rewrite: rewrites the program at a path, and adds its results to a row of the JSON document.
        as_json: whether the rows are printed as JSON.

    Raises:
        Exit: the exit status of a program is not 0; it has the highest of all.
    """
    rows: list[dict[str, Any]] = []
    for path in programs:
        row: dict[str, Any] = {"program": str(path), "exit_status": ExitStatus.DONE}
        rows.append(row)
        try:
            rewrite(path, row)
        except ArmwrightError as error:
            row |= outcome(error)
            if not as_json:
                print(f"armwright: {error}", file=sys.stderr)
    if as_json:
        print_json(rows)
    if status := max(row["exit_status"] for row in rows):
        raise typer.Exit(status)


def print_difference(source: Source, after: str) -> None:
    """Print the changes of a program as ``diff -u`` does, in colour on a terminal."""
    before, new = source.text.split("\n"), after.split("\n")
    terminal = console()
    styles = {"+": "green", "-": "red", "@": "cyan"}
    for line in difflib.unified_diff(before, new, source.name, f"{source.name} (changed)", lineterm=""):
        if terminal.is_terminal:
            terminal.print(line, style=styles.get(line[0]), soft_wrap=True)
        else:
            print(line)
