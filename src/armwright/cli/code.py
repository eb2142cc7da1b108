"""``armwright code``: the intermediate code of a program, as a listing or as assembly text."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from armwright.cli.programs import CellFile, Std, Strict, load_program, print_diagnostics
from armwright.program.language.words import Standard


def code(  # noqa: PLR0917 - Typer reads one parameter per option
    program: Annotated[Path, Argument(help="Program in RLO, or intermediate code (.rlc).")],
    cell: CellFile = None,
    output: Annotated[
        Path | None,
        Option("-o", "--output", help="File for the complete code (.rlc), which can be edited and run."),
    ] = None,
    full: Annotated[bool, Option("--full", help="Print the complete code, not only a listing.")] = False,
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

    loaded = load_program(program, cell, strict=strict, std=std, to_errors=True)
    if loaded.diagnostics:
        print_diagnostics(loaded.diagnostics, loaded.code.source, to_errors=True)
    if output is not None:
        write_file(output, assembly(loaded.code))
        print(f"code: {output}")
    else:
        print_verbatim(assembly(loaded.code) if full else listing(loaded.code))
