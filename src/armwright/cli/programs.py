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
    from armwright.program.semantics.cell_symbols import ReadImport

# The text form of intermediate code.
CODE_SUFFIX = ".rlc"

ProgramFile: TypeAlias = Annotated[Path, typer.Argument(help="The program, in RLO.", show_default=False)]
CellFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--cell", help="The cell it runs in, TOML or JSON; else what the program IMPORTs.", show_default=False
    ),
]
Std: TypeAlias = Annotated[Standard, typer.Option(help="The language: RLO-2, or the RLO-83 of the report alone.")]
Strict: TypeAlias = Annotated[bool, typer.Option("--strict", help="Treat an implied AFFIX (W201) as an error.")]


def translate_file(
    path: Path,
    cell: "Cell | None" = None,
    *,
    strict: bool = False,
    std: Standard = Standard.RLO_2,
    source: "Source | None" = None,
) -> "Compilation":
    """Read and translate a program.

    Args:
        path: of the program, UTF-8 text.
        cell: what it will act on.
        strict: whether an AFFIX that is only implied is an error.
        std: the language.
        source: what is to be there, and need not be read.

    Raises:
        FileFormatError: the file cannot be read, or is not text.
    """
    from armwright.files.reading import read_program
    from armwright.program import Source, known_cell
    from armwright.program import compile as translate

    source = source or Source(path.name, read_program(path))
    known = known_cell(cell) if cell else None
    return translate(source, known, strict=strict, std=std, read_import=import_reader(path.parent))


def given_cell(path: Path | None) -> "Cell | None":
    """Return the cell of the option ``--cell``, if it is given.

    Raises:
        FileFormatError: it cannot be read, or says what cannot be.
    """
    from armwright.cell.reader import read_cell

    return None if path is None else read_cell(path)


def import_reader(folder: Path) -> "ReadImport":
    """Return what reads the files that a program of this folder IMPORTs."""
    from armwright.program.semantics.cell_symbols import Imported

    def read(name: str) -> Imported:
        from armwright.cell.reader import read_cell
        from armwright.files.reading import regular

        cell = read_cell(regular(folder / name), arms_needed=False)
        return Imported(frames={frame: node.parent for frame, node in cell.frames.items()}, cell=cell)

    return read


def in_its_cell(
    path: Path, cell: "Cell | None", *, strict: bool, std: Standard, source: "Source | None" = None
) -> "tuple[Compilation, Cell | None]":
    """Translate a program for its cell: the one given, or else the first it IMPORTs that has arms.

    Returns:
        The translation, and the cell with all frames that the program imports; None where there is no cell.
    """
    compiled = translate_file(path, cell, strict=strict, std=std, source=source)
    if cell is None:
        cell = next((one.cell for one in compiled.imports if one.cell and one.cell.arms), None)
    return compiled, None if cell is None else with_imports(cell, compiled)


def imported_files(program: Path, compiled: "Compilation") -> tuple[Path, ...]:
    """Return the files that a program imports."""
    from armwright.program.syntax import tree

    imports = (node for node in compiled.tree.headers if isinstance(node, tree.Import))
    return tuple(program.parent / node.path.value for node in imports)


def with_imports(cell: "Cell", compiled: "Compilation") -> "Cell":
    """Return a cell with the frames that a program imports; a frame of the cell itself stays as it is."""
    import attrs

    frames = dict(cell.frames)
    for imported in compiled.imports:
        if imported.cell is not None:
            frames = {**imported.cell.frames, **frames}
    return attrs.evolve(cell, frames=frames)


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
