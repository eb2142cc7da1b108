"""``armwright check``: the diagnostics of programs, and the stages of their compilation."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import typer
from typer import Argument, Option

from armwright.cli.options import Json
from armwright.cli.output import print_json
from armwright.cli.programs import CheckedCell, Std, Strict, diagnostics_data, print_diagnostics, read_cell_option
from armwright.errors import ExitStatus, FileFormatError
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program import Compilation


_SUFFIX = ".rlo"


# The stages of the compilation that can be printed.
Stage: TypeAlias = Literal["code", "tree", "tokens"]


def check(  # noqa: PLR0917 - Typer reads one parameter per option
    programs: Annotated[
        list[Path], Argument(help="Programs in RLO, or folders; all files *.rlo of a folder are checked.")
    ],
    cell: CheckedCell = None,
    emit: Annotated[
        Stage | None, Option(help="Stage of the compilation to print; diagnostics then go to the error output.")
    ] = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    output_format: Annotated[
        Literal["text", "json", "sarif"], Option("--format", help="How to print diagnostics.")
    ] = "text",
    as_json: Json = False,
) -> None:
    """Check RLO programs without running them.

    The exit status is 0 if all programs can run (there may be warnings), and 1 if any has errors.

    **Example:** `armwright check examples/stacking.rlo --cell examples/stanford_cell.toml --emit code`
    """
    from armwright.program import compile as compile_program

    paths, option_cell = _program_files(programs), read_cell_option(cell)
    compilations = [compile_program(path, option_cell, strict=strict, std=std) for path in paths]
    if as_json or output_format == "json":
        results = [_as_data(compilation, emit) for compilation in compilations]
        print_json(results[0] if len(results) == 1 else _combine_data(results, paths))
    elif output_format == "sarif":
        from armwright.program.diagnostics.sarif import to_sarif

        pairs = zip(compilations, paths, strict=True)
        print_json(to_sarif([(result.diagnostics, result.source, path.as_posix()) for result, path in pairs]))
    else:
        for compilation in compilations:
            for line in _stage_lines(compilation, emit) if emit else ():
                print(line)
            if not emit or compilation.diagnostics:
                print_diagnostics(compilation.diagnostics, compilation.source, to_errors=emit is not None)
        if len(compilations) > 1:
            print(_totals_line(compilations), file=sys.stderr if emit else sys.stdout)
    if any(compilation.code is None for compilation in compilations):
        raise typer.Exit(ExitStatus.PROGRAM_ERRORS)


def _program_files(arguments: list[Path]) -> list[Path]:
    """Return the programs that the arguments name, each once; a folder stands for all programs below it.

    Raises:
        FileFormatError: a folder has no programs.
    """
    paths: dict[Path, None] = {}
    for path in arguments:
        files = _programs_below(path) if path.is_dir() else [path]
        if not files:
            raise FileFormatError(str(path), None, "", f"there is no program in this folder; expected files *{_SUFFIX}")
        paths |= dict.fromkeys(files)
    return list(paths)


def _programs_below(folder: Path) -> list[Path]:
    """Return the programs in a folder and its subfolders; pipes and devices are passed over.

    Raises:
        FileFormatError: a folder cannot be read.
    """

    def refuse(error: OSError) -> None:
        raise FileFormatError(str(error.filename), None, "", f"cannot be read: {error.strerror}") from error

    files = (Path(parent, name) for parent, _, names in os.walk(folder, onerror=refuse) for name in names)
    return sorted(path for path in files if path.suffix == _SUFFIX and path.is_file())


def _totals_line(compilations: "list[Compilation]") -> str:
    """Return the numbers of errors and warnings of several programs as a line of text."""
    from armwright.program.language.diagnostic import counts_text

    errors = sum(diagnostic.is_error for program in compilations for diagnostic in program.diagnostics)
    warnings = sum(len(program.diagnostics) for program in compilations) - errors
    return f"{len(compilations)} programs: {counts_text(errors, warnings)}"


def _combine_data(results: list[dict[str, Any]], paths: list[Path]) -> dict[str, Any]:
    """Return the diagnostics of several programs as plain data, each program with its path."""
    return {
        "exit_status": max(result["exit_status"] for result in results),
        "errors": sum(result["errors"] for result in results),
        "warnings": sum(result["warnings"] for result in results),
        "programs": [{"path": path.as_posix(), **result} for result, path in zip(results, paths, strict=True)],
    }


def _stage_lines(compilation: "Compilation", emit: Stage) -> Iterator[str]:
    """Return a stage of the compilation as lines; a program with errors has no lines of code."""
    from armwright.program.bytecode.instructions import listing
    from armwright.program.syntax.tree import dump

    source = compilation.source
    if emit == "code":
        yield from listing(compilation.code).splitlines() if compilation.code else ()
    elif emit == "tree":
        yield from dump(compilation.tree)
    else:
        for token in compilation.tokens:
            location = f"{source.line(token.start)}:{source.column(token.start)}"
            yield f"{location:>8}  {token.kind.value:<11}  {token.text}".rstrip()


def _as_data(compilation: "Compilation", emit: Stage | None) -> dict[str, Any]:
    from armwright.program.bytecode.instructions import shown_operands

    data = diagnostics_data(compilation)
    if emit == "code" and compilation.code:
        code = compilation.code
        data["constants"] = list(code.constants)
        data["code"] = [
            {
                "op": step.op.value,
                "operands": list(shown_operands(code, step)),
                "at": [code.line(step), code.source.column(step.span.start)],
                **({"file": code.source.name_at(step.span.start)} if code.source.file_number(step.span.start) else {}),
                **({"comment": step.comment} if step.comment else {}),
            }
            for step in code.instructions
        ]
    elif emit:
        data[emit] = list(_stage_lines(compilation, emit))
    return data
