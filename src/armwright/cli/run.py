"""``armwright run``: run a program in a simulated cell and report its results."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import typer
from typer import Option

from armwright.cli.numbers import within
from armwright.cli.options import Json, Log, OutputFolder, QuietButWarnings, check_log, usage_error
from armwright.cli.output import command_line, print_json, print_result, print_result_table
from armwright.cli.programs import (
    CellFile,
    Physics,
    ProgramArguments,
    ProgramFile,
    Seed,
    Std,
    Strict,
    hardware_factory,
    load_program,
    print_diagnostics,
    read_arguments,
)
from armwright.cli.progress import waiting
from armwright.cli.trials import MAX_TRIALS, SingleTrial, TrialVerdict, check_trial_options, run_trials
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from collections.abc import Sequence

    from armwright.cell.hardware import HardwareFactory
    from armwright.cell.model import Cell
    from armwright.program.bytecode.instructions import Code
    from armwright.program.language.diagnostic import Diagnostic
    from armwright.program.vm.machine import Limits, RunError
    from armwright.program.vm.recording import Recording
    from armwright.report.log_files import LogFormat
    from armwright.report.run_files import RunInputs


# The kind of detour where the arm cannot follow a straight line.
Around: TypeAlias = Literal["via", "damped", "none"]


def run(  # noqa: PLR0917 - Typer reads one parameter per option
    program: ProgramFile,
    cell: CellFile = None,
    arg: ProgramArguments = None,
    output: OutputFolder = None,
    servo_ms: Annotated[
        float | None, Option(help="Servo period in ms; the default is that of the cell file, or 1.")
    ] = None,
    deviation_mm: Annotated[
        float | None,
        Option(help="Largest path deviation of straight lines in mm; the default is that of the cell file, or 1."),
    ] = None,
    around: Annotated[
        Around | None,
        Option(help="Replace an infeasible straight line: via, by a detour; damped, by damped least squares; none."),
    ] = None,
    plan: Annotated[
        bool | None,
        Option(
            "--plan/--no-plan",
            help="Plan a path past other bodies where a point-to-point motion would run into one (extra planning).",
        ),
    ] = None,
    physics: Physics = False,
    seed: Seed = 0,
    trials: Annotated[
        int | None,
        Option(min=1, max=MAX_TRIALS, help="Number of trials drawn from [trials] of the cell file, with --physics."),
    ] = None,
    trial: Annotated[
        int | None, Option(min=1, max=MAX_TRIALS, help="Number of the only trial to run, with all its files.")
    ] = None,
    workers: Annotated[
        int | None, Option(min=1, help="Number of processes for --trials; the default is the number of cores.")
    ] = None,
    scheduler: Annotated[
        str | None, Option(help="Address of a Dask scheduler for --trials, as in tcp://10.0.0.1:8786.")
    ] = None,
    log: Log = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    max_steps: Annotated[
        int, Option(min=1, help="Largest number of steps that a program may execute without advancing the clock.")
    ] = 1_000_000,
    max_time: Annotated[
        float, Option(min=0.0, max=1e9, help="Largest duration of the run on the clock of the cell, in s.")
    ] = 3600.0,
    most_rows: Annotated[
        int,
        Option("--motion-rows", min=2, help="Largest number of rows of motion.csv; omitted rows are reported."),
    ] = 1_000_000,
    as_json: Json = False,
    quiet: QuietButWarnings = False,
) -> None:
    """Run an RLO program in a simulated cell.

    With -o the command writes motion.csv (every servo tick, SI), events.jsonl (every effect with its source line),
    frames.json (the final frame tree), run.json (inputs, versions, summary) and report.html, a page that opens from the
    disk and shows the arm moving; with --log a log of it all for viewers of robot data. With --around, the tool detours
    where a straight line meets a singularity or a limit; a warning has the location, the cause, and the cost in mm,
    mrad and s. With --physics, servos move the arms, fingers hold by friction, and parts fall; measured.csv has what
    the servos measured. With --trials, many cases of the cell are drawn, and the share of success is reported, with the
    causes of failure; --trial repeats one of them.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """
    from armwright.cli.results import warn_of_stray
    from armwright.program.vm.machine import Limits, RunError
    from armwright.report.run_files import RunInputs

    check_log(log, output if trials is None else None)
    warn_of_stray(program)
    arguments = read_arguments(arg)
    loaded = load_program(program, cell, strict=strict, std=std, as_json=as_json, arguments=arguments)
    if loaded.cell is None:
        needs = "needs a cell to run in, and IMPORTs none; try examples/stanford_cell.toml"
        raise usage_error("--cell", f"missing: {program} {needs}")
    used_cell = _adjust_cell(loaded.cell, servo_ms, deviation_mm, around, plan=plan)
    limits = Limits(steps=max_steps, time=max_time)
    options = {
        "servo_ms": used_cell.period * 1e3,
        "deviation_mm": used_cell.deviation * 1e3,
        "corner_mm": used_cell.corner_deviation * 1e3,
        "around": used_cell.around or "none",
        "plan": used_cell.plan,
        "std": std.value,
        "strict": strict,
        **({"physics": True, "seed": seed} if physics else {}),
        **({} if trial is None else {"trial": trial}),
        **({"arguments": arguments} if arguments else {}),
    }
    inputs = RunInputs(
        program=program,
        cell=cell,
        imports=loaded.imports,
        command=command_line(),
        options=options,
        motion_rows=most_rows,
    )
    if trials is not None or trial is not None:
        check_trial_options(used_cell, trials, trial, physics=physics)
    if trials is not None:
        from armwright.sweep.machines import Machines

        summary = run_trials(
            loaded.code,
            used_cell,
            inputs,
            limits,
            Machines(workers=workers, scheduler=scheduler),
            seed=seed,
            count=trials,
            output=output,
            watched=not (quiet or as_json),
        )
        print_result(summary, as_json=as_json, quiet=quiet, output=output)
        return
    hardware, single = hardware_factory(physics=physics, seed=seed), None
    if trial is not None:
        single = SingleTrial(used_cell, seed, trial)
        hardware, used_cell = single.hardware, single.case.cell
    error: RunError | None = None
    try:
        recording = _interpret(loaded.code, hardware, used_cell, limits, watched=not (quiet or as_json))
    except RunError as stopped:
        if stopped.recording is None:
            raise
        error, recording = stopped, stopped.recording()
    verdict = None if single is None else single.verdict(recording.duration, error)
    _finish(
        recording, loaded.diagnostics, inputs, output, error, log=log, verdict=verdict, as_json=as_json, quiet=quiet
    )


def _finish(
    recording: "Recording",
    compiler_diagnostics: "Sequence[Diagnostic]",
    inputs: "RunInputs",
    output: Path | None,
    error: "RunError | None",
    *,
    log: "LogFormat | None",
    verdict: "TrialVerdict | None",
    as_json: bool,
    quiet: bool,
) -> None:
    """Write and print the results of a run, also of one that failed."""
    from armwright.cli.terminal import console
    from armwright.program.vm.excerpt import EVENT_LOG_HINT, NO_EVENT_LOG_HINT
    from armwright.program.vm.interpreter import run_diagnostics
    from armwright.report.run_files import omission_notes, write_run
    from armwright.report.run_summary import RunSummary, frame_table

    diagnostics = (*compiler_diagnostics, *run_diagnostics(recording))
    hint = EVENT_LOG_HINT if output else NO_EVENT_LOG_HINT
    result = RunSummary(recording=recording, diagnostics=diagnostics, hint=hint)
    notes = omission_notes(recording, inputs.motion_rows) if output is not None else ()
    if output is not None:
        write_run(output, recording, diagnostics, inputs, log)
    if as_json:
        folder = {"output": str(output)} if output else {}
        frames = {"time": error.time, "frames": _frame_positions(error)} if error else {}
        tried = {} if verdict is None else {"trial": verdict.as_data()}
        print_json({**result.as_data(), **folder, "left_out": notes, **frames, **tried})
    else:
        if diagnostics:
            print_diagnostics(diagnostics, recording.code.source)
        for note in notes:
            print(f"armwright: {note}", file=sys.stderr)
        print_result(result, as_json=False, quiet=quiet)
        if error is not None:
            print_result_table(console(stderr=True), frame_table(error, recording.code))
        if verdict is not None and not quiet:
            print(verdict.text)
        if output is not None and (error is not None or not quiet):
            # On a line of its own and not wrapped, so that it can be clicked or copied.
            print(f"report{' up to the failure' if error else ''}: {output / 'report.html'}")
    if error is not None:
        raise typer.Exit(error.exit_status)


def _adjust_cell(
    cell: "Cell", servo_ms: float | None, deviation_mm: float | None, around: Around | None, *, plan: bool | None
) -> "Cell":
    import attrs

    from armwright.cell.reader import DETOURS, DEVIATION_MM, SERVO_MS

    period = cell.period if servo_ms is None else within(servo_ms, SERVO_MS, "--servo-ms") * 1e-3
    deviation = cell.deviation
    if deviation_mm is not None:
        deviation = within(deviation_mm, DEVIATION_MM, "--deviation-mm") * 1e-3
    detour = cell.around if around is None else DETOURS[around]
    return attrs.evolve(
        cell, period=period, deviation=deviation, around=detour, plan=cell.plan if plan is None else plan
    )


def _interpret(
    code: "Code", hardware: "HardwareFactory", cell: "Cell", limits: "Limits", *, watched: bool
) -> "Recording":
    """Run a program in a simulated cell, with a status line of the current statement on a terminal."""
    from armwright.program.vm.interpreter import interpret

    simulator = hardware(cell)
    with waiting("", quiet=not watched) as update:
        if update is None:
            return interpret(code, cell, simulator, limits=limits)

        def show(now: float, line: int) -> None:
            # Brackets in source lines are not markup.
            text = code.source.line_text(line).strip()[:60].replace("[", "\\[")
            update(f"{now:9.3f} s  line {line:<5} {text}")

        return interpret(code, cell, simulator, show, limits=limits)


def _frame_positions(error: "RunError") -> dict[str, list[float] | None]:
    """Return the positions of all frames in the world [m] when a program failed; None for a frame without a value."""
    tree = error.tree
    return {name: tree.world(name)[:3, 3].tolist() if tree.has_value(name) else None for name in tree}
