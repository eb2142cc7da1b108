"""``armwright run``: a program moves an arm, and the user sees what happened."""

import enum
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from armwright.cli.programs import CODE_SUFFIX, CellFile, ProgramFile, Std, Strict
from armwright.program.text.words import Standard

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table
    from rich.text import Text

    from armwright.cell.model import Cell
    from armwright.program import Source
    from armwright.program.intermediate.code import Code
    from armwright.program.messages.diagnostics import Diagnostic
    from armwright.program.running.interpret import Limits, RunError
    from armwright.program.running.recording import Recording, RunStage


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
    servo_ms: Annotated[
        float | None, typer.Option(help="Servo period in ms; the cell file's, or 1.", show_default=False)
    ] = None,
    deviation_mm: Annotated[
        float | None,
        typer.Option(help="Allowed deviation from straight lines; the cell file's, or 1.", show_default=False),
    ] = None,
    around: Annotated[
        Around | None,
        typer.Option(
            help="Go round what stops a straight line: by a pose beside it, or damped rates; the cell file's, or none.",
            show_default=False,
        ),
    ] = None,
    std: Std = Standard.RLO_2,
    strict: Strict = False,
    max_steps: Annotated[
        int, typer.Option(min=1, help="End a program that does so many steps without any time going by.")
    ] = 1_000_000,
    max_time: Annotated[
        float, typer.Option(min=0.0, help="End a program that runs so long on the cell's clock, in s.")
    ] = 3600.0,
    seed: Annotated[int, typer.Option(help="Recorded in run.json; this simulator draws no random numbers.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, in SI units.")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but warnings and errors.")] = False,
) -> None:
    """Run an RLO program in a simulated cell.

    Writes motion.csv (every servo tick, SI), events.jsonl (every effect with its source line), frames.json (the
    final frame tree), run.json (inputs, versions, summary) and report.html, a page that opens from the disk and
    shows the arm moving. With --around, a straight line that meets a singularity or a limit is left and met again; a
    warning says where, why and at what price in mm, mrad and s.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """
    import json

    from armwright.cli.programs import print_diagnostics
    from armwright.errors import FileFormatError
    from armwright.files.output import write_folder
    from armwright.program.running.interpret import Limits, RunError, warnings
    from armwright.report.files import Origin, result_files, summary

    given = None if cell is None else _read(cell)
    code, place, said, imports = _translated(program, given, strict=strict, std=std, as_json=as_json)
    place = _adjusted(place, servo_ms, deviation_mm, around)
    limits = Limits(steps=max_steps, time=max_time)
    try:
        recording = _interpret(code, place, limits, watched=not (quiet or as_json))
    except RunError as error:
        _fail(code.source, [*said, error.diagnostic], error, code, as_json=as_json)
    except (AssertionError, LookupError, TypeError, ValueError) as error:
        if program.suffix != CODE_SUFFIX:
            raise
        text = "its instructions do not fit together: no program is translated to such code"
        raise FileFormatError(program, None, "", text) from error
    diagnostics = (*said, *warnings(recording))
    if output is not None:
        options = {
            "servo_ms": place.period * 1e3,
            "deviation_mm": place.deviation * 1e3,
            "around": place.around or Around.NONE.value,
            "std": std.value,
            "strict": strict,
        }
        origin = Origin(program=program, cell=cell, imports=imports, command=_command(), seed=seed, options=options)
        write_folder(output, result_files(recording, code, diagnostics, origin))
    if diagnostics and not as_json:
        print_diagnostics(diagnostics, code.source)
    if as_json:
        where = {"output": str(output)} if output else {}
        print(json.dumps({**summary(recording, code, diagnostics), **where}, indent=2, ensure_ascii=False))
    elif not quiet:
        _print_summary(recording, code, output)


def _read(path: Path) -> "Cell":
    from armwright.cell.reader import read_cell

    return read_cell(path)


def _translated(
    program: Path, given: "Cell | None", *, strict: bool, std: Standard, as_json: bool
) -> "tuple[Code, Cell, tuple[Diagnostic, ...], tuple[Path, ...]]":
    """Return the code of a program, its cell, what was said of it, and the files that it imports."""
    from armwright.cli.programs import imported_files, in_its_cell
    from armwright.files.document import read_text
    from armwright.program.intermediate.assembly import assemble

    if program.suffix == CODE_SUFFIX:
        if given is None:
            _no_cell(program)
        return assemble(read_text(program), str(program)), given, (), ()
    compiled, place = in_its_cell(program, given, strict=strict, std=std)
    if compiled.code is None:
        _fail(compiled.source, compiled.diagnostics, as_json=as_json)
    if place is None:
        _no_cell(program)
    return compiled.code, place, compiled.diagnostics, imported_files(program, compiled)


def _no_cell(program: Path) -> NoReturn:
    what = f"{program} needs a cell to run in, and IMPORTs none"
    raise typer.BadParameter(f"missing: {what}; try examples/stanford_cell.toml", param_hint="--cell")


def _adjusted(place: "Cell", servo_ms: float | None, deviation_mm: float | None, around: Around | None) -> "Cell":
    import attrs

    from armwright.cell.reader import DEVIATION_MM, SERVO_MS, WAYS_ROUND

    period = place.period if servo_ms is None else _option("--servo-ms", servo_ms, SERVO_MS)
    deviation = place.deviation if deviation_mm is None else _option("--deviation-mm", deviation_mm, DEVIATION_MM)
    way_round = place.around if around is None else WAYS_ROUND[around.value]
    return attrs.evolve(place, period=period, deviation=deviation, around=way_round)


def _option(name: str, value: float, bounds: tuple[float, float]) -> float:
    lower, upper = bounds
    if not lower <= value <= upper:
        raise typer.BadParameter(f"expected {lower:g} to {upper:g}, got {value:g}", param_hint=name)
    return value * 1e-3


def _interpret(code: "Code", place: "Cell", limits: "Limits", *, watched: bool) -> "Recording":
    """Run in the simulator, with the present statement on the screen when a person watches."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn

    from armwright.cell.simulator import Simulator
    from armwright.program.running.interpret import interpret

    simulator = Simulator(place)
    console = Console(stderr=True)
    if not (watched and console.is_terminal):
        return interpret(code, place, simulator, limits=limits)
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), console=console, transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(now: float, line: int) -> None:
            # Source lines may hold what looks like markup.
            words = code.source.line_text(line).strip()[:60].replace("[", "\\[")
            bar.update(task, description=f"{now:9.3f} s  line {line:<5} {words}")

        return interpret(code, place, simulator, show, limits=limits)


def _fail(
    source: "Source",
    diagnostics: "Sequence[Diagnostic]",
    error: "RunError | None" = None,
    code: "Code | None" = None,
    *,
    as_json: bool,
) -> NoReturn:
    """Say why a program did not run, or did not run to its end, and stop with status 1."""
    import json

    from armwright.cli.programs import print_diagnostics
    from armwright.program.messages.diagnostics import to_json

    if as_json:
        data = {"program": source.name, "diagnostics": [to_json(one, source) for one in diagnostics]}
        moment = {"time": error.time, "frames": _places(error)} if error else {}
        print(json.dumps({**data, **moment}, indent=2, ensure_ascii=False))
    else:
        print_diagnostics(diagnostics, source)
        if error and code:
            _print_moment(error, code)
    raise typer.Exit(1)


def _places(error: "RunError") -> dict[str, list[float] | None]:
    """Return where every frame was when a program could not go on, in the world in m; None without a value."""
    tree = error.tree
    return {name: tree.world(name)[:3, 3].tolist() if tree.has_value(name) else None for name in tree}


def _command() -> str:
    import shlex

    return shlex.join(["armwright", *sys.argv[1:]])


def _print_summary(recording: "Recording", code: "Code", output: Path | None) -> None:
    from rich.console import Console

    console = Console(markup=False, highlight=False)
    console.print(_trace_table(recording, code))
    if recording.stages:
        console.print(_stage_table(recording, code))
    for stage in recording.stages:
        if stage.stage.slowed:
            line = code.source.line(stage.span.start)
            console.print(f"line {line}: {stage.stage.kind} to {stage.to[-1]} runs {stage.stage.slowed}")
    moves = sum(effect.kind == "MOVE" for effect in recording.effects)
    console.print(
        f"{code.source.name}: {recording.duration:.3f} s in {recording.cell.name}, {moves} moves, "
        f"{len(recording.stages)} stages, {len(recording.streams[0].t) if recording.streams else 0} servo ticks"
    )
    if output is not None:
        # On a line of its own and never wrapped, so that it can be clicked or copied.
        print(f"report: {output / 'report.html'}")


def _trace_table(recording: "Recording", code: "Code") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("line", justify="right", style="dim")
    table.add_column("s", justify="right")
    table.add_column("what happened", overflow="fold")
    for effect in recording.effects:
        if effect.kind != "PLACE":
            table.add_row(str(code.source.line(effect.span.start)), f"{effect.t0:.3f}", effect.text)
    return table


def _stage_table(recording: "Recording", code: "Code") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("line", "stage", "s", "mm", "off mm", "peak speed", "peak effort"):
        table.add_column(name, justify="left" if name == "stage" else "right", overflow="fold")
    for stage in recording.stages:
        off = "" if stage.stage.deviation is None else f"{stage.stage.deviation * 1e3:.3f}"
        table.add_row(
            str(code.source.line(stage.span.start)),
            f"{stage.arm} {stage.stage.kind} {' '.join(stage.to)}",
            f"{stage.stage.trajectory.duration:.3f}",
            f"{stage.stage.length * 1e3:.0f}",
            off,
            *_peaks(stage, recording),
        )
    return table


def _peaks(stage: "RunStage", recording: "Recording") -> "list[Text]":
    """Say the largest share of a limit and whose it is."""
    from rich.text import Text

    arm = recording.cell.arms[stage.arm].arm
    shares = stage.stage.trajectory.peaks(1) / arm.limit("speed"), stage.peak_effort / arm.limit("effort")
    texts = []
    for share in shares:
        joint = int(share.argmax())
        over = share[joint] > 1 + 1e-9
        texts.append(Text(f"{share[joint] * 100:.0f} % j{joint + 1}", style="bold red" if over else ""))
    return texts


def _print_moment(error: "RunError", code: "Code") -> None:
    """Show where every frame was when a program could not go on."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from armwright.cell.frames import WORLD

    table = Table(title=f"frames at {error.time:.3f} s", box=box.SIMPLE_HEAD, pad_edge=False, title_justify="left")
    table.add_column("frame")
    table.add_column("hangs on")
    table.add_column("x, y, z in the world, mm", justify="right")
    for name in error.tree:
        if name == WORLD or name.endswith(".BASE"):
            continue
        parent = (error.tree.parent(name) or WORLD).removesuffix(".BASE")
        place = "no value yet"
        if error.tree.has_value(name):
            place = ", ".join(f"{x * 1e3:.1f}" for x in error.tree.world(name)[:3, 3])
        table.add_row(code.spelled(name), "its base" if parent == name else code.spelled(parent), place)
    Console(stderr=True, markup=False).print(table)
