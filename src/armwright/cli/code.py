"""``armwright code``: the intermediate code of a program, as a listing or as assembly text."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.programs import CODE_SUFFIX, CellFile, Std, Strict
from armwright.errors import ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.bytecode.instructions import Code


def code(  # noqa: PLR0917 - Typer reads one parameter per option
    program: Annotated[Path, typer.Argument(help="Program in RLO, or intermediate code (.rlc).")],
    cell: CellFile = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="File for the complete code (.rlc), which can be edited and run."),
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="Print the complete code, not only a listing.")] = False,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
) -> None:
    """Print the intermediate code of a program, or write it to a file that can be edited and run.

    A file of intermediate code is read, verified and printed likewise; writing and reading it loses nothing.

    **Example:** `armwright code examples/bench.rlo -o out/bench.rlc`
    """
    from armwright.cli.terminal import print_verbatim
    from armwright.files.output import write_file
    from armwright.program.bytecode.assembler import assembly
    from armwright.program.bytecode.instructions import listing

    loaded = load_code(program, cell, strict=strict, std=std)
    if output is not None:
        write_file(output, assembly(loaded))
        print(f"code: {output}")
    else:
        print_verbatim(assembly(loaded) if full else listing(loaded))


def load_code(path: Path, cell: Path | None, *, strict: bool, std: Standard) -> "Code":
    """Return the code of a program or of a file of code; diagnostics go to the error output.

    Raises:
        FileFormatError: the file cannot be read, or its code is invalid.
        typer.Exit: the program has errors.
    """
    from armwright.cli.programs import print_diagnostics, read_cell_option
    from armwright.files.inputs import read_program
    from armwright.program import compile as compile_program
    from armwright.program.bytecode.assembler import assemble

    if path.suffix == CODE_SUFFIX:
        return assemble(read_program(path), str(path))
    compiled = compile_program(path, read_cell_option(cell), strict=strict, std=std)
    if compiled.diagnostics:
        print_diagnostics(compiled.diagnostics, compiled.source, to_errors=True)
    if compiled.code is None:
        raise typer.Exit(ExitStatus.PROGRAM_ERRORS)
    return compiled.code
