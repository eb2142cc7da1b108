"""``armwright debug``: run a program step by step, in an editor or on the terminal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.programs import CODE_SUFFIX, CellFile, Std, Strict
from armwright.errors import ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.debugger.dap_session import LaunchRequest, LoadedProgram
    from armwright.program.vm.recording import Recording


def debug(
    program: Annotated[
        Path | None, typer.Argument(help="The program; without it, an editor is served over standard input and output.")
    ] = None,
    cell: CellFile = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
) -> None:
    """Run an RLO program step by step, forwards and backwards.

    With a program, the debugger runs on the terminal; `help` lists its commands. Without a program, it serves an editor
    by the Debug Adapter Protocol over standard input and output; the editor's launch configuration has the keys
    program, cell, std, strict, stopOnEntry and output.

    **Example:** `armwright debug examples/stacking.rlo --cell examples/stanford_cell.toml`
    """
    if program is None:
        if cell is not None:
            raise typer.BadParameter(
                "expected a program; an editor names the cell in its launch configuration", param_hint="--cell"
            )
        _serve()
        return
    from armwright.cli.debug_terminal import Terminal
    from armwright.program.debugger.dap_session import LaunchRequest, LoadError

    launch = LaunchRequest(
        program=program, cell=cell, std=std, output=None, stop_on_entry=True, no_debug=False, strict=strict
    )
    try:
        loaded = load(launch)
    except LoadError as error:
        print(error.page, end="")
        raise typer.Exit(error.status) from None
    if status := Terminal(loaded).run():
        raise typer.Exit(status)


def _serve() -> None:
    """Serve an editor by the Debug Adapter Protocol, to which other output must not be added."""
    import os
    import sys

    from armwright.program.debugger.dap_server import serve

    # Unbuffered, and apart from sys.stdin: a thread may still be reading when the interpreter ends.
    incoming = os.fdopen(os.dup(0), "rb", buffering=0)
    outgoing = os.fdopen(os.dup(1), "wb")
    sys.stdout = sys.stderr
    serve(incoming, outgoing, load, save)


def load(launch: "LaunchRequest") -> "LoadedProgram":
    """Return the compiled program of a session with its cell.

    Raises:
        LoadError: the program has errors, or no cell to run in.
        FileFormatError: a file cannot be read.
    """
    from armwright.cli.programs import imported_files, read_cell_option
    from armwright.files.inputs import read_program
    from armwright.program import compile as compile_program
    from armwright.program.bytecode.assembler import assemble
    from armwright.program.debugger.dap_session import LoadedProgram, LoadError
    from armwright.program.diagnostics.render import render
    from armwright.program.language.diagnostic import count_line
    from armwright.program.language_server.cell_lookup import CellCache

    cell = read_cell_option(launch.cell)
    if launch.program.suffix == CODE_SUFFIX:
        if cell is None:
            message = f"{launch.program.name} needs a cell to run in"
            raise LoadError(message, f"{message}\n", ExitStatus.USAGE)
        return LoadedProgram(
            code=assemble(read_program(launch.program), str(launch.program)), cell=cell, is_code_file=True
        )
    if cell is None:
        nearby = CellCache().find_cell(launch.program.parent, read_program(launch.program), None)
        cell = None if nearby is None else nearby.cell
    compiled = compile_program(launch.program, cell, strict=launch.strict, std=launch.std)
    if compiled.code is None:
        raise LoadError(
            count_line(compiled.diagnostics, compiled.source), render(compiled.diagnostics, compiled.source)
        )
    if compiled.cell is None:
        message = (
            f"{launch.program.name} needs a cell to run in: it IMPORTs none, and its folder does not have exactly one"
        )
        raise LoadError(message, f"{message}\n", ExitStatus.USAGE)
    imports = imported_files(launch.program, compiled)
    return LoadedProgram(code=compiled.code, cell=compiled.cell, diagnostics=compiled.diagnostics, imports=imports)


def save(launch: "LaunchRequest", loaded: "LoadedProgram", recording: "Recording") -> str:
    """Write the results of a run as ``armwright run -o`` does; return a line with the path of the report.

    Raises:
        OutputError: the folder cannot be written.
    """
    from armwright.files.output import write_folder
    from armwright.program.vm.interpreter import motion_warnings
    from armwright.report.files import Origin, result_files, run_record

    assert launch.output is not None  # noqa: S101 - the session calls this only with an output
    origin = Origin(
        program=launch.program,
        cell=launch.cell,
        imports=loaded.imports,
        command="armwright debug",
        options={"std": launch.std.value, "strict": launch.strict},
    )
    failed = () if recording.failure is None else (recording.failure.diagnostic,)
    diagnostics = (*loaded.diagnostics, *motion_warnings(recording.stages, recording.cell), *failed)
    results = (recording, diagnostics, origin)
    write_folder(launch.output, result_files(*results), run_record(*results))
    return f"report{' up to the failure' if failed else ''}: {launch.output / 'report.html'}"
