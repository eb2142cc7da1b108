"""``armwright export``: write a program, or its motion, for a real controller."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from armwright.cli.options import Json, QuietButWarnings, usage_error
from armwright.cli.output import print_json
from armwright.cli.programs import (
    CellFile,
    ProgramArguments,
    ProgramFile,
    Std,
    Strict,
    load_program,
    print_diagnostics,
    read_arguments,
)
from armwright.cli.results import warn_of_stray, write_results
from armwright.export.targets import Mode, Target
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.export import ExportedProgram, ExportError
    from armwright.program import Recording, RunError, Source


def export(  # noqa: PLR0917 - Typer reads one parameter per option
    target: Annotated[
        Target,
        Argument(help="Controller: ros2 (JointTrajectory), csv (counts of drives), urscript, krl, rapid or fanuc."),
    ],
    program: ProgramFile,
    cell: CellFile = None,
    mode: Annotated[
        Mode | None,
        Option(
            help="What is exported: program, with its control flow, which is the default where the controller has a "
            "language that can say it; or plan, the motion of the program as it runs in the cell."
        ),
    ] = None,
    output: Annotated[Path | None, Option("-o", "--output", help="Folder for the files of the controller.")] = None,
    arg: ProgramArguments = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    as_json: Json = False,
    quiet: QuietButWarnings = False,
) -> None:
    """Run an RLO program in a simulated cell, and write it, or its motion, for a real controller, with its proof.

    A program is written with its loops, choices, procedures, frames and inputs; --mode plan writes what it did in the
    cell. The checker of each language runs the written file on the model of the arm and compares targets,
    configurations, straight lines, speeds, outputs and texts with the run; proof.json has what was compared and what
    is approximated. A statement that the controller cannot repeat is rejected with its line and the reason, and
    nothing is written. Without -o, only the proof is printed. The languages need the extra export.

    **Example:** `armwright export urscript examples/bench.rlo --cell examples/ur5_cell.toml -o out/ur5`
    """
    from armwright.export import ExportError, export_compiled, export_run
    from armwright.export.api import usual_mode
    from armwright.program.vm.interpreter import interpret
    from armwright.program.vm.machine import RunError

    warn_of_stray(program)
    arguments = read_arguments(arg)
    loaded = load_program(program, cell, strict=strict, std=std, as_json=as_json, arguments=arguments)
    if loaded.cell is None:
        raise usage_error("--cell", f"missing: {program} needs a cell to run in, and IMPORTs none")
    try:
        recording = interpret(loaded.code, loaded.cell, loaded.hardware(loaded.cell))
        if mode is None and loaded.compiled is not None:
            mode = usual_mode(target)
        if mode != "program":
            exported = export_run(target, recording, program.stem)
        elif loaded.compiled is None:
            raise usage_error("--mode", f"program: {program} holds intermediate code, without the text of the program")
        else:
            exported = export_compiled(target, loaded.compiled, recording, program.stem)
    except (RunError, ExportError) as error:
        _refuse(error, loaded.code.source, as_json=as_json)
        raise typer.Exit(error.exit_status) from None
    if output is not None:
        write_results(output, exported.files)
    if loaded.diagnostics and not as_json:
        print_diagnostics(loaded.diagnostics, loaded.code.source, to_errors=True)
    _show(exported, recording, output, as_json=as_json, quiet=quiet)


def _show(
    exported: "ExportedProgram", recording: "Recording", output: Path | None, *, as_json: bool, quiet: bool
) -> None:
    """Print the proof, and where the files are."""
    if as_json:
        folder = {} if output is None else {"output": str(output), "files": sorted(exported.files)}
        print_json({"exit_status": 0, **exported.proof.as_data(), "duration": recording.duration, **folder})
        return
    if quiet:
        return
    is_program = exported.proof.mode == "program"
    what = f"the program, run for {recording.duration:.6g} s" if is_program else f"{recording.duration:.6g} s of motion"
    print(f"{exported.target}: {what} in {recording.cell.name}, proved:")
    for line in exported.proof.lines():
        print(f"  {line}")
    if output is not None:
        for name in exported.files:
            print(f"wrote {output / name}")


def _refuse(error: "ExportError | RunError", source: "Source", *, as_json: bool) -> None:
    """Print why there is no export."""
    from armwright.program.language.diagnostic import to_json

    diagnostic = error.diagnostic
    if not as_json:
        print_diagnostics([diagnostic], source)
        print(f"armwright: {source.name}: nothing was exported", file=sys.stderr)
        return
    details = {"class": type(error).__name__, "code": diagnostic.code, "message": diagnostic.message}
    place = {"file": source.name_at(diagnostic.span.start), "line": source.line(diagnostic.span.start)}
    data = {"exit_status": int(error.exit_status), "error": {**details, **place}}
    print_json({**data, "diagnostics": [to_json(diagnostic, source)]})
