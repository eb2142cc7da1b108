"""``armwright run``: a program moves an arm, and the user sees what happened."""

import enum
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from armwright.cli.numbers import within
from armwright.cli.options import JsonSummary, QuietButWarnings
from armwright.cli.output import command_line, plain_console, print_json, print_table, table
from armwright.cli.programs import CODE_SUFFIX, CellFile, ProgramFile, Std, Strict, given_cell
from armwright.cli.progress import waiting
from armwright.errors import ExitStatus, counted
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table
    from rich.text import Text

    from armwright.cell.model import Cell
    from armwright.program import Source
    from armwright.program.bytecode.instructions import Code
    from armwright.program.language.diagnostic import Diagnostic
    from armwright.program.vm.interpreter import Limits, RunError
    from armwright.program.vm.recording import Effect, Recording, RunStage
    from armwright.report.files import Origin


class Around(enum.StrEnum):
    """How to go round what stops a straight line."""

    VIA = "via"
    DAMPED = "damped"
    NONE = "none"


def run(  # noqa: PLR0917 - Typer reads one parameter per option
    program: ProgramFile,
    cell: CellFile = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the results; none are kept without it.")
    ] = None,
    servo_ms: Annotated[float | None, typer.Option(help="Servo period in ms; the cell file's, or 1.")] = None,
    deviation_mm: Annotated[
        float | None, typer.Option(help="Allowed deviation from straight lines; the cell file's, or 1.")
    ] = None,
    around: Annotated[
        Around | None,
        typer.Option(
            help="Go round what stops a straight line: by a pose beside it, or damped rates; the cell file's, or none."
        ),
    ] = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    max_steps: Annotated[
        int, typer.Option(min=1, help="End a program that does so many steps without any time going by.")
    ] = 1_000_000,
    max_time: Annotated[
        float, typer.Option(min=0.0, max=1e9, help="End a program that runs so long on the cell's clock, in s.")
    ] = 3600.0,
    most_rows: Annotated[
        int, typer.Option("--motion-rows", min=2, help="Rows that motion.csv may have; what is left out is said.")
    ] = 1_000_000,
    as_json: JsonSummary = False,
    quiet: QuietButWarnings = False,
) -> None:
    """Run an RLO program in a simulated cell.

    Writes motion.csv (every servo tick, SI), events.jsonl (every effect with its source line), frames.json (the
    final frame tree), run.json (inputs, versions, summary) and report.html, a page that opens from the disk and
    shows the arm moving. With --around, a straight line that meets a singularity or a limit is left and met again; a
    warning says where, why and at what price in mm, mrad and s.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """
    from armwright.cli.results import warn_of_stray
    from armwright.program.vm.interpreter import Limits, RunError
    from armwright.report.files import Origin

    warn_of_stray(program)
    given = given_cell(cell)
    code, place, said, imports = _translated(program, given, strict=strict, std=std, as_json=as_json)
    place = _adjusted(place, servo_ms, deviation_mm, around)
    limits = Limits(steps=max_steps, time=max_time)
    error: RunError | None = None
    try:
        recording = _interpret(code, place, limits, watched=not (quiet or as_json))
    except RunError as stopped:
        if stopped.recording is None:
            raise
        error, recording = stopped, stopped.recording()
    options = {
        "servo_ms": place.period * 1e3,
        "deviation_mm": place.deviation * 1e3,
        "corner_mm": place.corner_room * 1e3,
        "around": place.around or Around.NONE.value,
        "std": std.value,
        "strict": strict,
    }
    origin = Origin(
        program=program, cell=cell, imports=imports, command=command_line(), options=options, motion_rows=most_rows
    )
    _finish(recording, code, said, origin, output, error, as_json=as_json, quiet=quiet)


def _finish(  # noqa: PLR0917 - what there is to say, and how
    recording: "Recording",
    code: "Code",
    said: "Sequence[Diagnostic]",
    origin: "Origin",
    output: Path | None,
    error: "RunError | None",
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """Write what a run has left, also one that failed, and say how it went."""
    from armwright.cli.programs import print_diagnostics
    from armwright.cli.results import write_results
    from armwright.program.vm.excerpt import KEPT, NOT_KEPT
    from armwright.program.vm.interpreter import warnings
    from armwright.report.files import ending, left_out, result_files, run_record, summary

    failed = () if error is None else (error.diagnostic,)
    diagnostics = (*said, *warnings(recording), *failed)
    notes = left_out(recording, origin.motion_rows) if output is not None else ()
    if output is not None:
        made = (recording, code, diagnostics, origin)
        write_results(output, result_files(*made), run_record(*made))
    if as_json:
        told = summary(recording, code, diagnostics, KEPT if output else NOT_KEPT)
        folder = {"output": str(output)} if output else {}
        frames = {"time": error.time, "frames": _places(error)} if error else {}
        print_json({**ending(recording, code), **told, **folder, "left_out": notes, **frames})
    else:
        if diagnostics:
            print_diagnostics(diagnostics, code.source)
        for note in notes:
            print(f"armwright: {note}", file=sys.stderr)
        if error is not None:
            if not quiet:
                print_table(plain_console(), _trace_table(recording, code, KEPT if output else NOT_KEPT))
            _print_moment(error, code)
        elif not quiet:
            _print_summary(recording, code, KEPT if output else NOT_KEPT)
        if output is not None and (error is not None or not quiet):
            # On a line of its own and never wrapped, so that it can be clicked or copied.
            print(f"report{' up to the failure' if error else ''}: {output / 'report.html'}")
    if error is not None:
        raise typer.Exit(error.exit_status)


def _translated(
    program: Path, given: "Cell | None", *, strict: bool, std: Standard, as_json: bool
) -> "tuple[Code, Cell, tuple[Diagnostic, ...], tuple[Path, ...]]":
    """Return the code of a program, its cell, what was said of it, and the files that it imports."""
    from armwright.cli.programs import imported_files
    from armwright.files.inputs import read_program
    from armwright.program import compile as compile_program
    from armwright.program.bytecode.assembler import assemble

    if program.suffix == CODE_SUFFIX:
        if given is None:
            _no_cell(program)
        return assemble(read_program(program), str(program)), given, (), ()
    compiled = compile_program(program, given, strict=strict, std=std)
    if compiled.code is None:
        _refuse(compiled.source, compiled.diagnostics, as_json=as_json)
    if compiled.cell is None:
        _no_cell(program)
    return compiled.code, compiled.cell, compiled.diagnostics, imported_files(program, compiled)


def _no_cell(program: Path) -> NoReturn:
    what = f"{program} needs a cell to run in, and IMPORTs none"
    raise typer.BadParameter(f"missing: {what}; try examples/stanford_cell.toml", param_hint="--cell")


def _adjusted(place: "Cell", servo_ms: float | None, deviation_mm: float | None, around: Around | None) -> "Cell":
    import attrs

    from armwright.cell.reader import DEVIATION_MM, SERVO_MS, WAYS_ROUND

    period = place.period if servo_ms is None else within(servo_ms, SERVO_MS, "--servo-ms") * 1e-3
    deviation = place.deviation
    if deviation_mm is not None:
        deviation = within(deviation_mm, DEVIATION_MM, "--deviation-mm") * 1e-3
    way_round = place.around if around is None else WAYS_ROUND[around.value]
    return attrs.evolve(place, period=period, deviation=deviation, around=way_round)


def _interpret(code: "Code", place: "Cell", limits: "Limits", *, watched: bool) -> "Recording":
    """Run in the simulator, with the present statement on the screen when a person watches."""
    from armwright.cell.simulator import Simulator
    from armwright.program.vm.interpreter import interpret

    simulator = Simulator(place)
    with waiting("", quiet=not watched) as told:
        if told is None:
            return interpret(code, place, simulator, limits=limits)

        def show(now: float, line: int) -> None:
            # Source lines may hold what looks like markup.
            words = code.source.line_text(line).strip()[:60].replace("[", "\\[")
            told(f"{now:9.3f} s  line {line:<5} {words}")

        return interpret(code, place, simulator, show, limits=limits)


def _refuse(source: "Source", diagnostics: "Sequence[Diagnostic]", *, as_json: bool) -> NoReturn:
    """Say why a program cannot run, and stop."""
    from armwright.cli.programs import error_data, print_diagnostics
    from armwright.program.language.diagnostic import to_json

    if as_json:
        said = {"program": source.name, "diagnostics": [to_json(one, source) for one in diagnostics]}
        print_json({**error_data(diagnostics, source), **said})
    else:
        print_diagnostics(diagnostics, source)
    raise typer.Exit(ExitStatus.PROGRAM_ERRORS)


def _places(error: "RunError") -> dict[str, list[float] | None]:
    """Return where every frame was when a program could not go on, in the world in m; None without a value."""
    tree = error.tree
    return {name: tree.world(name)[:3, 3].tolist() if tree.has_value(name) else None for name in tree}


def _print_summary(recording: "Recording", code: "Code", where: str) -> None:
    from armwright.program.vm.excerpt import ON_A_TERMINAL, listed

    console = plain_console()
    print_table(console, _trace_table(recording, code, where))
    if recording.stages:
        print_table(console, _stage_table(recording, code, where))
    slowed = [
        f"line {code.source.line(one.span.start)}: {one.stage.kind} to {one.to[-1]} runs {one.stage.slowed}"
        for one in recording.stages
        if one.stage.slowed
    ]
    for text in listed(slowed, ON_A_TERMINAL, where):
        console.print(text)
    moves = sum(effect.kind == "MOVE" for effect in recording.effects)
    console.print(
        f"{code.source.name}: {recording.duration:.3f} s in {recording.cell.name}, {counted(moves, 'move')}, "
        f"{counted(len(recording.stages), 'stage')}, "
        f"{counted(len(recording.streams[0].t) if recording.streams else 0, 'servo tick')}"
    )
    console.print("Collisions are not looked for.")


def _trace_table(recording: "Recording", code: "Code", where: str) -> "Table":
    from rich.text import Text

    from armwright.program.vm.excerpt import ON_A_TERMINAL, excerpt, more, one_line

    several = len(recording.processes) > 1

    def row(one: "Effect") -> "tuple[str | Text, ...]":
        line, end = Text(str(code.source.line(one.span.start)), style="dim"), f"{one.t1:.3f}" if one.t1 > one.t0 else ""
        return (line, f"{one.t0:.3f}", end, *((one.process,) if several else ()), one_line(one.text, where))

    found = excerpt([one for one in recording.effects if one.kind != "PLACE"], ON_A_TERMINAL)
    names = ("line", "from s", "to s", *(("process",) if several else ()), "what happened")
    rest = (*[""] * (len(names) - 1), more(found.left_out, where))
    return table(names, found.mapped(row).joined(rest), words=range(3, len(names)))


def _stage_table(recording: "Recording", code: "Code", where: str) -> "Table":
    from armwright.program.vm.excerpt import ON_A_TERMINAL, excerpt, more

    def row(stage: "RunStage") -> "tuple[str | Text, ...]":
        off = "" if stage.stage.deviation is None else f"{stage.stage.deviation * 1e3:.3f}"
        line = str(code.source.line(stage.span.start))
        what = f"{stage.arm} {stage.stage.kind} {' '.join(stage.to)}{', stopped' if stage.stopped else ''}"
        start, duration, length = f"{stage.t0:.3f}", f"{stage.duration:.3f}", f"{stage.length * 1e3:.0f}"
        return (line, what, start, duration, length, off, *_peaks(stage, recording))

    found = excerpt(recording.stages, ON_A_TERMINAL).mapped(row)
    names = ("line", "stage", "from s", "s", "mm", "off mm", "peak speed", "peak effort")
    return table(names, found.joined(("", more(found.left_out, where), *[""] * 6)), words=(1,))


def _peaks(stage: "RunStage", recording: "Recording") -> "list[Text]":
    """Say the largest share of a limit and whose it is."""
    from rich.text import Text

    arm = recording.cell.arms[stage.arm].arm
    shares = stage.motion.peaks(1) / arm.limits.speed, stage.peak_effort / arm.limits.effort
    texts = []
    for share in shares:
        joint = int(share.argmax())
        over = share[joint] > 1 + 1e-9
        texts.append(Text(f"{share[joint] * 100:.0f} % j{joint + 1}", style="bold red" if over else ""))
    return texts


def _print_moment(error: "RunError", code: "Code") -> None:
    """Show where every frame was when a program could not go on."""
    from armwright.cell.frames import WORLD
    from armwright.cli.terminal import console
    from armwright.program.vm.excerpt import ON_A_TERMINAL, excerpt, more

    def row(name: str) -> tuple[str, ...]:
        parent = (error.tree.parent(name) or WORLD).removesuffix(".BASE")
        place = "no value yet"
        if error.tree.has_value(name):
            place = ", ".join(f"{x * 1e3:z.1f}" for x in error.tree.world(name)[:3, 3])
        return code.spelled(name), "its base" if parent == name else code.spelled(parent), place

    found = excerpt([name for name in error.tree if name != WORLD and not name.endswith(".BASE")], ON_A_TERMINAL)
    rest = (more(found.left_out, "all in frames.json of `-o FOLDER`"), "", "")
    columns = ("frame", "hangs on", "x, y, z in the world, mm")
    shown = table(columns, found.mapped(row).joined(rest), title=f"frames at {error.time:.3f} s", words=(0, 1))
    console(stderr=True).print(shown)
