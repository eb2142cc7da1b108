"""``armwright check``: what the translator has to say about a program, and what it makes of it."""

import enum
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.output import print_json
from armwright.cli.programs import Std, Strict
from armwright.errors import ExitStatus, FileFormatError
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program import Compilation


_SUFFIX = ".rlo"


class Emit(enum.StrEnum):
    """A stage of the translation that can be looked at."""

    CODE = "code"
    TREE = "tree"
    TOKENS = "tokens"


class Format(enum.StrEnum):
    """How diagnostics are printed."""

    TEXT = "text"
    JSON = "json"
    SARIF = "sarif"


def check(  # noqa: PLR0917 - Typer reads one parameter per option
    programs: Annotated[
        list[Path], typer.Argument(help="The programs, in RLO; of a folder all in it that end in .rlo.")
    ],
    cell: Annotated[
        Path | None,
        typer.Option("--cell", help="The cell they will run in; frames, arms and devices are then checked too."),
    ] = None,
    emit: Annotated[Emit | None, typer.Option(help="Print this instead; diagnostics go to the error output.")] = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    output_format: Annotated[Format, typer.Option("--format", help="How to print diagnostics.")] = Format.TEXT,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Check RLO programs without running them.

    Exit status 0: all can run (there may be warnings); 1: one or more have errors.

    **Example:** `armwright check examples/stacking.rlo --cell examples/stanford_cell.toml --emit code`
    """
    from armwright.cli.programs import given_cell
    from armwright.program import compile as compile_program

    paths, given = _found(programs), given_cell(cell)
    compiled = [compile_program(path, given, strict=strict, std=std) for path in paths]
    if as_json or output_format is Format.JSON:
        several = [_as_data(one, emit) for one in compiled]
        print_json(several[0] if len(several) == 1 else _together(several, paths))
    elif output_format is Format.SARIF:
        from armwright.program.diagnostics.sarif import sarif_of

        pairs = zip(compiled, paths, strict=True)
        print_json(sarif_of([(one.diagnostics, one.source, path.as_posix()) for one, path in pairs]))
    else:
        for one in compiled:
            _print(one, emit)
        if len(compiled) > 1:
            print(_counted(compiled), file=sys.stderr if emit else sys.stdout)
    if any(one.code is None for one in compiled):
        raise typer.Exit(ExitStatus.PROGRAM_ERRORS)


def _found(given: list[Path]) -> list[Path]:
    """Return the programs that are asked for, each once: of a folder all in it and in its folders.

    Raises:
        FileFormatError: a folder has none.
    """
    paths: dict[Path, None] = {}
    for path in given:
        inside = _inside(path) if path.is_dir() else [path]
        if not inside:
            raise FileFormatError(str(path), None, "", f"there is no program in this folder; expected files *{_SUFFIX}")
        paths |= dict.fromkeys(inside)
    return list(paths)


def _inside(folder: Path) -> list[Path]:
    """Return the programs in a folder and in its folders; a pipe that nobody named is none.

    Raises:
        FileFormatError: one of them cannot be read.
    """

    def refuse(error: OSError) -> None:
        raise FileFormatError(str(error.filename), None, "", f"cannot be read: {error.strerror}") from error

    every = (Path(at, name) for at, _, names in os.walk(folder, onerror=refuse) for name in names)
    return sorted(one for one in every if one.suffix == _SUFFIX and one.is_file())


def _print(compiled: "Compilation", emit: Emit | None) -> None:
    from armwright.cli.programs import print_diagnostics

    for line in _emitted(compiled, emit) if emit else ():
        print(line)
    if not emit or compiled.diagnostics:
        print_diagnostics(compiled.diagnostics, compiled.source, to_errors=emit is not None)


def _counted(compiled: "list[Compilation]") -> str:
    """Return the last line of a report on several programs."""
    from armwright.program.language.diagnostic import counts_text

    errors = sum(one.is_error for program in compiled for one in program.diagnostics)
    warnings = sum(len(program.diagnostics) for program in compiled) - errors
    return f"{len(compiled)} programs: {counts_text(errors, warnings)}"


def _together(several: list[dict[str, Any]], paths: list[Path]) -> dict[str, Any]:
    """Return what is wrong with several programs as plain data, each with its path."""
    return {
        "exit_status": max(one["exit_status"] for one in several),
        "errors": sum(one["errors"] for one in several),
        "warnings": sum(one["warnings"] for one in several),
        "programs": [{"path": path.as_posix(), **one} for one, path in zip(several, paths, strict=True)],
    }


def _emitted(compiled: "Compilation", emit: Emit) -> Iterator[str]:
    """Return a stage of the translation as lines; no lines of code for a program with errors."""
    from armwright.program.bytecode.instructions import listing
    from armwright.program.syntax.tree import dump

    source = compiled.source
    if emit is Emit.CODE:
        yield from listing(compiled.code).splitlines() if compiled.code else ()
    elif emit is Emit.TREE:
        yield from dump(compiled.tree)
    else:
        for token in compiled.tokens:
            place = f"{source.line(token.start)}:{source.column(token.start)}"
            yield f"{place:>8}  {token.kind.value:<11}  {token.text}".rstrip()


def _as_data(compiled: "Compilation", emit: Emit | None) -> dict[str, Any]:
    from armwright.cli.programs import diagnostics_data
    from armwright.program.bytecode.instructions import shown_operands

    data = diagnostics_data(compiled)
    if emit is Emit.CODE and compiled.code:
        code = compiled.code
        data["constants"] = list(code.constants)
        data["code"] = [
            {
                "op": step.op.value,
                "operands": list(shown_operands(code, step)),
                "at": [code.line(step), code.source.column(step.span.start)],
                **({"comment": step.comment} if step.comment else {}),
            }
            for step in code.instructions
        ]
    elif emit:
        data[emit.value] = list(_emitted(compiled, emit))
    return data
