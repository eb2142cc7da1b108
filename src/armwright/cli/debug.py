"""``armwright debug``: run a program step by step, in an editor or on the terminal."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument

from armwright.cli.options import usage_error
from armwright.cli.programs import (
    CellFile,
    Physics,
    ProgramArguments,
    Seed,
    Std,
    Strict,
    hardware_factory,
    print_diagnostics,
    read_arguments,
    read_cell_option,
)
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.api import LoadedProgram
    from armwright.program.debugger.dap_session import LaunchRequest
    from armwright.program.vm.recording import Recording


def debug(  # noqa: PLR0917 - Typer reads one parameter per option
    program: Annotated[
        Path | None, Argument(help="The program; without it, an editor is served over standard input and output.")
    ] = None,
    cell: CellFile = None,
    arg: ProgramArguments = None,
    physics: Physics = False,
    seed: Seed = 0,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
) -> None:
    """Run an RLO program step by step, forwards and backwards.

    With a program, the debugger runs on the terminal; `help` lists its commands. Without a program, it serves an editor
    by the Debug Adapter Protocol over standard input and output; the editor's launch configuration has the keys
    program, cell, arguments, physics, seed, std, strict, stopOnEntry and output.

    **Example:** `armwright debug examples/stacking.rlo --cell examples/stanford_cell.toml`
    """
    if program is None:
        for option, value in (("--cell", cell), ("--arg", arg)):
            if value:
                raise usage_error(option, "expected a program; an editor has this in its launch configuration")
        _serve()
        return
    from armwright.cli.debug_terminal import Terminal
    from armwright.program import ProgramError
    from armwright.program.debugger.dap_session import LaunchRequest, MissingCellError

    launch = LaunchRequest(
        program=program,
        cell=cell,
        std=std,
        output=None,
        stop_on_entry=True,
        no_debug=False,
        strict=strict,
        physics=physics,
        seed=seed,
        arguments=read_arguments(arg),
    )
    try:
        loaded = load(launch)
    except ProgramError as error:
        print_diagnostics(error.compilation.diagnostics, error.compilation.source)
        raise typer.Exit(error.exit_status) from None
    except MissingCellError as error:
        print(error)
        raise typer.Exit(error.exit_status) from None
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
    """Return the compiled program of a session with its cell; without one, the only cell beside the program is used.

    Raises:
        ProgramError: the program has errors.
        MissingCellError: the program has no cell to run in.
        UnknownNameError: an argument is for no constant of the program.
        InvalidValueError: an argument is not of the type of its constant.
        FileFormatError: a file cannot be read.
    """
    import attrs

    from armwright.files.inputs import read_program
    from armwright.program import api
    from armwright.program.debugger.dap_session import MissingCellError
    from armwright.program.language_server.cell_lookup import CellCache

    path, cell = launch.program, read_cell_option(launch.cell)
    is_code_file = path.suffix == api.CODE_SUFFIX
    if cell is None and not is_code_file:
        nearby = CellCache().find_cell(path.parent, read_program(path), None)
        cell = None if nearby is None else nearby.cell
    loaded = api.load(path, cell, strict=launch.strict, std=launch.std, arguments=launch.arguments)
    if loaded.cell is None:
        reason = "" if is_code_file else ": it IMPORTs none, and its folder does not have exactly one"
        raise MissingCellError(f"{path.name} needs a cell to run in{reason}")
    return attrs.evolve(loaded, hardware=hardware_factory(physics=launch.physics, seed=launch.seed))


def save(launch: "LaunchRequest", loaded: "LoadedProgram", recording: "Recording") -> str:
    """Write the results of a run as ``armwright run -o`` does; return a line with the path of the report.

    Raises:
        OutputError: the folder cannot be written.
    """
    from armwright.program.vm.interpreter import run_diagnostics
    from armwright.report.run_files import RunInputs, write_run

    assert launch.output is not None  # noqa: S101 - the session calls this only with an output
    origin = RunInputs(
        program=launch.program,
        cell=launch.cell,
        imports=loaded.imports,
        command="armwright debug",
        options={
            "std": launch.std.value,
            "strict": launch.strict,
            **({"arguments": dict(launch.arguments)} if launch.arguments else {}),
        },
    )
    write_run(launch.output, recording, (*loaded.diagnostics, *run_diagnostics(recording)), origin)
    return f"report{' up to the failure' if recording.failure else ''}: {launch.output / 'report.html'}"
