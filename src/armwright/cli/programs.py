"""Options, cells and diagnostics that the commands for programs share."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer
from typer import Argument, Option

from armwright.errors import ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.cell.hardware import HardwareFactory
    from armwright.cell.model import Cell
    from armwright.program import Compilation, Source
    from armwright.program.api import LoadedProgram
    from armwright.program.language.diagnostic import Diagnostic

ProgramFiles: TypeAlias = Annotated[
    list[Path], Argument(metavar="PROGRAM", help="Programs in RLO; `-` reads from the standard input.")
]
ProgramFile: TypeAlias = Annotated[Path, Argument(help="Program in RLO.")]
CellFile: TypeAlias = Annotated[
    Path | None,
    Option("--cell", help="Cell in which the program runs, TOML or JSON; the default is what the program IMPORTs."),
]
CheckedCell: TypeAlias = Annotated[
    Path | None,
    Option("--cell", help="Cell in which the programs will run; frames, arms and devices are then checked too."),
]
Std: TypeAlias = Annotated[Standard, Option(help="Version of the language: RLO-2, or only the RLO-83 of the report.")]
Physics: TypeAlias = Annotated[
    bool, Option("--physics", help="Simulate the cell with servos, contact, grippers and falling parts.")
]
Seed: TypeAlias = Annotated[
    int, Option(min=0, max=2**63 - 1, help="Seed of what is random in a cell with physics: parts, sensors, cameras.")
]
ProgramArguments: TypeAlias = Annotated[
    list[str] | None,
    Option("--arg", metavar="NAME=VALUE", help="Value of a constant of the program (CONST), in place of its own."),
]
Strict: TypeAlias = Annotated[bool, Option("--strict", help="Treat an implied AFFIX (W201) as an error.")]


def hardware_factory(*, physics: bool, seed: int) -> "HardwareFactory":
    """Return how cells are set up to run programs: with physics, or as their files state."""
    from functools import partial

    from armwright.physics.kinematic_cell import kinematic_cell

    if not physics:
        return kinematic_cell
    from armwright.physics.world import PhysicsCell

    return partial(PhysicsCell, seed=seed)


def read_cell_option(path: Path | None) -> "Cell | None":
    """Return the cell of the option ``--cell``; None without the option.

    Raises:
        FileFormatError: the file cannot be read, or is invalid.
    """
    from armwright.cell.reader import read_cell

    return None if path is None else read_cell(path)


def read_arguments(texts: Iterable[str] | None) -> dict[str, str]:
    """Return the values of the options ``--arg`` by the names of constants.

    Raises:
        BadParameter: a text is not of the form NAME=VALUE, or a name occurs twice.
    """
    from armwright.cli.options import usage_error

    values: dict[str, str] = {}
    for text in texts or ():
        name, sign, value = text.partition("=")
        if not sign or not name.strip():
            raise usage_error("--arg", f"expected NAME=VALUE, such as pitch=20, got {text!r}")
        if name.strip() in values:
            raise usage_error("--arg", f"{name.strip()} is given twice")
        values[name.strip()] = value.strip()
    return values


def load_program(
    path: Path,
    cell: Path | None,
    *,
    strict: bool,
    std: Standard,
    as_json: bool = False,
    to_errors: bool = False,
    arguments: "Mapping[str, str] | None" = None,
) -> "LoadedProgram":
    """Return the code of a program with its cell; the diagnostics of a program with errors are printed.

    Raises:
        Exit: the program has errors.
        FileFormatError: a file cannot be read, or is invalid.
    """
    from armwright.cli.output import print_json
    from armwright.program.api import ProgramError, load

    try:
        return load(path, read_cell_option(cell), strict=strict, std=std, arguments=arguments)
    except ProgramError as error:
        compiled = error.compilation
        if as_json:
            print_json(diagnostics_data(compiled))
        else:
            print_diagnostics(compiled.diagnostics, compiled.source, to_errors=to_errors)
        raise typer.Exit(error.exit_status) from None


def print_diagnostics(diagnostics: "Iterable[Diagnostic]", source: "Source", *, to_errors: bool = False) -> None:
    """Print diagnostics with the lines of their locations, in colour on a terminal."""
    import sys

    from armwright.cli.terminal import console
    from armwright.program.diagnostics.render import render, render_rich

    shown = console(stderr=to_errors)
    if shown.is_terminal:
        shown.print(render_rich(diagnostics, source), soft_wrap=True, end="")
    else:
        print(render(diagnostics, source), end="", file=sys.stderr if to_errors else sys.stdout)


def error_data(diagnostics: "Iterable[Diagnostic]", source: "Source") -> dict[str, Any]:
    """Return the first error of a program, with its exit status, in the form of ``--json``."""
    first = next((diagnostic for diagnostic in diagnostics if diagnostic.is_error), None)
    if first is None:
        return {"exit_status": int(ExitStatus.DONE)}
    error = {
        "class": "ProgramError",
        "code": first.code,
        "message": first.message,
        "file": source.name_at(first.span.start),
        "line": source.line(first.span.start),
    }
    return {"exit_status": int(ExitStatus.PROGRAM_ERRORS), "error": error}


def diagnostics_data(compiled: "Compilation") -> dict[str, Any]:
    """Return the diagnostics of a program as plain data."""
    from armwright.program.language.diagnostic import to_json

    errors = sum(diagnostic.is_error for diagnostic in compiled.diagnostics)
    return {
        **error_data(compiled.diagnostics, compiled.source),
        "program": compiled.source.name,
        "errors": errors,
        "warnings": len(compiled.diagnostics) - errors,
        "diagnostics": [to_json(diagnostic, compiled.source) for diagnostic in compiled.diagnostics],
    }
