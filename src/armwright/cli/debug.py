"""``armwright debug``: a program step by step, in an editor or on the terminal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.programs import CODE_SUFFIX, CellFile, Std, Strict
from armwright.errors import ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.debugger.dap_session import Launch, Loaded
    from armwright.program.vm.recording import Recording


def debug(
    program: Annotated[
        Path | None, typer.Argument(help="The program; without one, editors are served over stdio.")
    ] = None,
    cell: CellFile = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
) -> None:
    """Run an RLO program step by step, forwards and back.

    With a program it is a debugger on the terminal; `help` lists its commands. Without one it speaks the Debug
    Adapter Protocol over stdin and stdout, for editors: their launch names program, cell, std,
    strict, stopOnEntry and output.

    **Example:** `armwright debug examples/stacking.rlo --cell examples/stanford_cell.toml`
    """
    if program is None:
        if cell is not None:
            raise typer.BadParameter("an editor names the cell in its launch", param_hint="--cell")
        _serve()
        return
    from armwright.cli.debug_terminal import Terminal
    from armwright.program.debugger.dap_session import Launch, LoadError

    launch = Launch(program=program, cell=cell, std=std, output=None, stop_on_entry=True, no_debug=False, strict=strict)
    try:
        loaded = load(launch)
    except LoadError as error:
        print(error.page, end="")
        raise typer.Exit(error.status) from None
    if status := Terminal(loaded).run():
        raise typer.Exit(status)


def _serve() -> None:
    """Speak the protocol; whatever else is printed must not get into it."""
    import os
    import sys

    from armwright.program.debugger.dap_server import serve

    # Unbuffered, and apart from sys.stdin: a thread may still be reading when the interpreter ends.
    incoming = os.fdopen(os.dup(0), "rb", buffering=0)
    outgoing = os.fdopen(os.dup(1), "wb")
    sys.stdout = sys.stderr
    serve(incoming, outgoing, load, save)


def load(launch: "Launch") -> "Loaded":
    """Return the program of a session, with its cell.

    Raises:
        LoadError: it has errors, or no cell to run in.
        FileFormatError: a file cannot be read.
    """
    from armwright.cli.programs import given_cell, imported_files
    from armwright.files.inputs import read_program
    from armwright.program import compile as compile_program
    from armwright.program.bytecode.assembler import assemble
    from armwright.program.debugger.dap_session import Loaded, LoadError
    from armwright.program.diagnostics.render import render
    from armwright.program.language.diagnostic import count_line
    from armwright.program.language_server.cell_lookup import Cells

    given = given_cell(launch.cell)
    if launch.program.suffix == CODE_SUFFIX:
        if given is None:
            message = f"{launch.program.name} needs a cell to run in"
            raise LoadError(message, f"{message}\n", ExitStatus.USAGE)
        return Loaded(code=assemble(read_program(launch.program), str(launch.program)), cell=given, is_listed=True)
    if given is None:
        around = Cells().around(launch.program.parent, read_program(launch.program), None).file
        given = None if around is None else around.cell
    compiled = compile_program(launch.program, given, strict=launch.strict, std=launch.std)
    place = compiled.cell
    if compiled.code is None:
        raise LoadError(
            count_line(compiled.diagnostics, compiled.source), render(compiled.diagnostics, compiled.source)
        )
    if place is None:
        message = f"{launch.program.name} needs a cell to run in: it IMPORTs none, and beside it there is not just one"
        raise LoadError(message, f"{message}\n", ExitStatus.USAGE)
    imports = imported_files(launch.program, compiled)
    return Loaded(code=compiled.code, cell=place, diagnostics=compiled.diagnostics, imports=imports)


def save(launch: "Launch", loaded: "Loaded", recording: "Recording") -> str:
    """Write what a run leaves, as ``armwright run -o`` does; return a line that says where.

    Raises:
        OutputError: the folder cannot be written.
    """
    from armwright.files.output import write_folder
    from armwright.program.vm.interpreter import warnings
    from armwright.report.files import Origin, result_files, run_record

    assert launch.output is not None  # noqa: S101 - asked for only then
    origin = Origin(
        program=launch.program,
        cell=launch.cell,
        imports=loaded.imports,
        command="armwright debug",
        options={"std": launch.std.value, "strict": launch.strict},
    )
    failed = () if recording.failure is None else (recording.failure.diagnostic,)
    diagnostics = (*loaded.diagnostics, *warnings(recording), *failed)
    made = (recording, loaded.code, diagnostics, origin)
    write_folder(launch.output, result_files(*made), run_record(*made))
    return f"report{' up to the failure' if failed else ''}: {launch.output / 'report.html'}"
