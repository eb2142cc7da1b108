"""What the commands for programs share: reading and translating them, their cells, and showing diagnostics."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from armwright.errors import ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.cell.model import Cell
    from armwright.program import Compilation, Source
    from armwright.program.language.diagnostic import Diagnostic

# The text form of intermediate code.
CODE_SUFFIX = ".rlc"

ProgramFile: TypeAlias = Annotated[Path, typer.Argument(help="The program, in RLO.")]
CellFile: TypeAlias = Annotated[
    Path | None, typer.Option("--cell", help="The cell it runs in, TOML or JSON; else what the program IMPORTs.")
]
Std: TypeAlias = Annotated[Standard, typer.Option(help="The language: RLO-2, or the RLO-83 of the report alone.")]
Strict: TypeAlias = Annotated[bool, typer.Option("--strict", help="Treat an implied AFFIX (W201) as an error.")]


def given_cell(path: Path | None) -> "Cell | None":
    """Return the cell of the option ``--cell``, if it is given.

    Raises:
        FileFormatError: it cannot be read, or says what cannot be.
    """
    from armwright.cell.reader import read_cell

    return None if path is None else read_cell(path)


def imported_files(program: Path, compiled: "Compilation") -> tuple[Path, ...]:
    """Return the files that a program imports."""
    from armwright.program.syntax import tree

    imports = (node for node in compiled.tree.headers if isinstance(node, tree.Import))
    return tuple(program.parent / node.path.value for node in imports)


def print_diagnostics(diagnostics: "Iterable[Diagnostic]", source: "Source", *, to_errors: bool = False) -> None:
    """Print diagnostics with the lines they are about, in colour when a person watches."""
    import sys

    from armwright.cli.terminal import console
    from armwright.program.diagnostics.render import render, render_rich

    shown = console(stderr=to_errors)
    if shown.is_terminal:
        shown.print(render_rich(diagnostics, source), soft_wrap=True, end="")
    else:
        print(render(diagnostics, source), end="", file=sys.stderr if to_errors else sys.stdout)


def error_data(diagnostics: "Iterable[Diagnostic]", source: "Source") -> dict[str, Any]:
    """Return the first error of a program, with its exit status, as errors are told under ``--json``."""
    first = next((one for one in diagnostics if one.is_error), None)
    if first is None:
        return {"exit_status": int(ExitStatus.DONE)}
    error = {
        "class": "ProgramError",
        "code": first.code,
        "message": first.message,
        "file": source.name,
        "line": source.line(first.span.start),
    }
    return {"exit_status": int(ExitStatus.PROGRAM_ERRORS), "error": error}


def diagnostics_data(compiled: "Compilation") -> dict[str, Any]:
    """Return what is wrong with a program as plain data."""
    from armwright.program.language.diagnostic import to_json

    errors = sum(one.is_error for one in compiled.diagnostics)
    return {
        **error_data(compiled.diagnostics, compiled.source),
        "program": compiled.source.name,
        "errors": errors,
        "warnings": len(compiled.diagnostics) - errors,
        "diagnostics": [to_json(one, compiled.source) for one in compiled.diagnostics],
    }
