"""``armwright check``: what the translator has to say about a program, and what it makes of it."""

import enum
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from armwright.cell.model import Cell
    from armwright.program import Compilation, Source
    from armwright.program.diagnostics import Diagnostic


class Emit(enum.StrEnum):
    """A stage of the translation that can be looked at."""

    CODE = "code"
    TREE = "tree"
    TOKENS = "tokens"


def check(
    program: Annotated[Path, typer.Argument(help="The program, in RLO.", show_default=False)],
    cell: Annotated[
        Path | None,
        typer.Option("--cell", help="The cell it will run in; frames, arms and devices are then checked too."),
    ] = None,
    emit: Annotated[
        Emit | None, typer.Option(help="Print this instead; diagnostics go to the error output.", show_default=False)
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Treat an implied AFFIX (W201) as an error.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Check an RLO program without running it.

    Exit status 0: it can run (there may be warnings); 1: it cannot.

    **Example:** `armwright check examples/stacking.rlo --cell examples/stanford_cell.toml --emit code`
    """
    import json

    compiled = compile_file(program, _cell(cell), strict=strict)
    if as_json:
        print(json.dumps(_as_data(compiled, emit), indent=2, ensure_ascii=False))
    else:
        for line in _emitted(compiled, emit) if emit else ():
            print(line)
        if not emit or compiled.diagnostics:
            print_diagnostics(compiled.diagnostics, compiled.source, to_errors=emit is not None)
    if compiled.code is None:
        raise typer.Exit(1)


def _cell(path: Path | None) -> "Cell | None":
    if path is None:
        return None
    from armwright.cell.reader import read_cell

    return read_cell(path)


def compile_file(path: Path, cell: "Cell | None" = None, *, strict: bool = False) -> "Compilation":
    """Read and translate a program.

    Args:
        path: of the program, UTF-8 text.
        cell: what it will act on.
        strict: whether an AFFIX that is only implied is an error.

    Raises:
        FileFormatError: the file cannot be read, or is not text.
    """
    from armwright.files.document import read_text
    from armwright.program import Source, known_cell
    from armwright.program import compile as translate

    return translate(Source(path.name, read_text(path)), known_cell(cell) if cell else None, strict=strict)


def print_diagnostics(diagnostics: "Iterable[Diagnostic]", source: "Source", *, to_errors: bool = False) -> None:
    """Print diagnostics with the lines they are about, in colour when a person watches."""
    import sys

    from rich.console import Console

    from armwright.program.rendering import render, render_rich

    console = Console(stderr=to_errors)
    if console.is_terminal:
        console.print(render_rich(diagnostics, source), soft_wrap=True, end="")
    else:
        print(render(diagnostics, source), end="", file=sys.stderr if to_errors else sys.stdout)


def _emitted(compiled: "Compilation", emit: Emit) -> Iterator[str]:
    """Return a stage of the translation as lines; no lines of code for a program with errors."""
    from armwright.program.code import listing
    from armwright.program.tree import dump

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
    from armwright.program.diagnostics import to_json

    errors = sum(one.is_error for one in compiled.diagnostics)
    data: dict[str, Any] = {
        "program": compiled.source.name,
        "errors": errors,
        "warnings": len(compiled.diagnostics) - errors,
        "diagnostics": [to_json(one, compiled.source) for one in compiled.diagnostics],
    }
    if emit is Emit.CODE and compiled.code:
        code = compiled.code
        data["constants"] = list(code.constants)
        data["code"] = [
            {
                "op": step.op.value,
                "operands": list(step.operands),
                "at": [code.line(step), code.source.column(step.span.start)],
                **({"comment": step.comment} if step.comment else {}),
            }
            for step in code.instructions
        ]
    elif emit:
        data[emit.value] = list(_emitted(compiled, emit))
    return data
