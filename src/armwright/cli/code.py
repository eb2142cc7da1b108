"""``armwright code``: the intermediate code of a program, as a listing or as text that can be read back."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.programs import CODE_SUFFIX, CellFile, Std, Strict
from armwright.errors import ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.bytecode.instructions import Code


def code(  # noqa: PLR0917 - Typer reads one parameter per option
    program: Annotated[Path, typer.Argument(help="A program in RLO, or code that was written before (.rlc).")],
    cell: CellFile = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the whole code here, to be read back or run (.rlc).")
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="Print the whole code, not only a listing.")] = False,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
) -> None:
    """Show what a program becomes, or write it out so that it can be changed by hand and run.

    Code that was written before is read, checked and shown the same way: nothing is lost on the way there and back.

    **Example:** `armwright code examples/bench.rlo -o out/bench.rlc`
    """
    from armwright.cli.terminal import print_verbatim
    from armwright.files.output import write_file
    from armwright.program.bytecode.assembler import assembly
    from armwright.program.bytecode.instructions import listing

    found = load_code(program, cell, strict=strict, std=std)
    if output is not None:
        write_file(output, assembly(found))
        print(f"code: {output}")
    else:
        print_verbatim(assembly(found) if full else listing(found))


def load_code(path: Path, cell: Path | None, *, strict: bool, std: Standard) -> "Code":
    """Return the code of a program or of a file of code; diagnostics go to the error output.

    Raises:
        FileFormatError: the file cannot be read, or its code makes no sense.
        typer.Exit: the program has errors.
    """
    from armwright.cli.programs import given_cell, print_diagnostics
    from armwright.files.inputs import read_program
    from armwright.program import compile as compile_program
    from armwright.program.bytecode.assembler import assemble

    if path.suffix == CODE_SUFFIX:
        return assemble(read_program(path), str(path))
    compiled = compile_program(path, given_cell(cell), strict=strict, std=std)
    if compiled.diagnostics:
        print_diagnostics(compiled.diagnostics, compiled.source, to_errors=True)
    if compiled.code is None:
        raise typer.Exit(ExitStatus.PROGRAM_ERRORS)
    return compiled.code
