"""``armwright check``: what the translator has to say about a program, and what it makes of it."""

import enum
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.printing import print_json
from armwright.cli.programs import ProgramFile, Std, Strict
from armwright.errors import ExitStatus
from armwright.program.text.words import Standard

if TYPE_CHECKING:
    from armwright.program import Compilation


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
    program: ProgramFile,
    cell: Annotated[
        Path | None,
        typer.Option("--cell", help="The cell it will run in; frames, arms and devices are then checked too."),
    ] = None,
    emit: Annotated[
        Emit | None, typer.Option(help="Print this instead; diagnostics go to the error output.", show_default=False)
    ] = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    output_format: Annotated[Format, typer.Option("--format", help="How to print diagnostics.")] = Format.TEXT,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Check an RLO program without running it.

    Exit status 0: it can run (there may be warnings); 1: it has errors.

    **Example:** `armwright check examples/stacking.rlo --cell examples/stanford_cell.toml --emit code`
    """
    from armwright.cli.programs import given_cell, in_its_cell, print_diagnostics

    compiled, _ = in_its_cell(program, given_cell(cell), strict=strict, std=std)
    if as_json or output_format is Format.JSON:
        print_json(_as_data(compiled, emit))
    elif output_format is Format.SARIF:
        from armwright.program.messages.sarif import to_sarif

        log = to_sarif(compiled.diagnostics, compiled.source, program.as_posix())
        print_json(log)
    else:
        for line in _emitted(compiled, emit) if emit else ():
            print(line)
        if not emit or compiled.diagnostics:
            print_diagnostics(compiled.diagnostics, compiled.source, to_errors=emit is not None)
    if compiled.code is None:
        raise typer.Exit(ExitStatus.PROGRAM_ERRORS)


def _emitted(compiled: "Compilation", emit: Emit) -> Iterator[str]:
    """Return a stage of the translation as lines; no lines of code for a program with errors."""
    from armwright.program.intermediate.code import listing
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
    from armwright.program.intermediate.code import shown_operands

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
