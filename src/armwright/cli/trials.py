"""The trials of ``armwright run --physics``: many drawn cases of a cell, or one of them again."""

from contextlib import closing
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from armwright.cli.options import usage_error
from armwright.cli.output import command_line
from armwright.cli.progress import sweep_bar
from armwright.cli.results import write_results

if TYPE_CHECKING:
    from collections.abc import Callable

    from armwright.cell.model import Cell
    from armwright.physics.trials import Verdict
    from armwright.physics.world import PhysicsCell
    from armwright.program.bytecode.instructions import Code
    from armwright.program.vm.machine import Limits, RunError
    from armwright.program.vm.trials import ProgramTrials
    from armwright.report.run_files import RunInputs
    from armwright.report.trials_summary import Trial, TrialsSummary
    from armwright.sweep.designs import Design
    from armwright.sweep.progress import Progress

# More trials than this are a slip.
MAX_TRIALS = 100_000
# The folder of the sweep, in that of the results, and how many blocks it has at most.
_FOLDER, _MAX_BLOCKS = "trials", 1000


def check_trial_options(cell: "Cell", trials: int | None, number: int | None, *, physics: bool) -> None:
    """Refuse options that do not go together, and a cell that says nothing of success.

    Raises:
        BadParameter: they do not.
    """
    option = "--trial" if trials is None else "--trials"
    if trials is not None and number is not None:
        raise usage_error("--trial", "expected either --trials or --trial, which repeats one of them")
    if not physics:
        raise usage_error(option, "trials are of a cell with physics: add --physics")
    if not cell.trials.goals:
        example = 'goal = { BLOCK = { at = "SLOT", mm = 2, deg = 3 } }'
        raise usage_error(
            option, f"cell '{cell.name}' does not say what success is; add to [trials] of its file: {example}"
        )


class TrialVerdict(NamedTuple):
    """The verdict on one trial, and its number."""

    number: int
    verdict: "Verdict"

    @property
    def text(self) -> str:
        """The verdict as a line."""
        it = self.verdict
        placed = f"{it.distance * 1e3:.3g} mm and {degrees(it.angle):.3g} deg from its goal"
        return f"trial {self.number}: " + (f"{it.cause}: {it.message}" if it.cause else f"succeeds, {placed}")

    def as_data(self) -> dict[str, Any]:
        """Return the verdict as plain data."""
        it = self.verdict
        return {
            "number": self.number,
            "success": not it.cause,
            "cause": it.cause or None,
            "message": it.message or None,
            "error_mm": it.distance * 1e3,
            "error_deg": degrees(it.angle),
        }


class SingleTrial:
    """One trial of a cell, which is run as any program is."""

    def __init__(self, cell: "Cell", seed: int, number: int) -> None:
        """Draw it."""
        from armwright.physics.trials import draw_case

        self._number, self.case = number, draw_case(cell, seed, number)
        self._world = self.case.world()

    def hardware(self, _: "Cell") -> "PhysicsCell":
        """Return the world of the trial."""
        return self._world

    def verdict(self, duration: float, error: "RunError | None") -> TrialVerdict:
        """Return the verdict on the world of a program that ended after some time [s], by itself or by an error."""
        from armwright.program.vm.trials import judge_run

        return TrialVerdict(self._number, judge_run(self._world, self.case, duration, error))


class Machines(NamedTuple):
    """What runs trials: some processes of this machine, as many as cores where there is no number, or a scheduler."""

    workers: int | None
    scheduler: str | None


def run_trials(
    code: "Code",
    cell: "Cell",
    inputs: "RunInputs",
    limits: "Limits",
    machines: Machines,
    *,
    seed: int,
    count: int,
    output: Path | None,
    watched: bool,
) -> "TrialsSummary":
    """Run trials of a program, write their files, and return their summary.

    With a folder, every finished trial is stored in it, and the same command resumes trials that were interrupted.
    """
    from armwright.program.vm.trials import ProgramTrials
    from armwright.report.run_files import input_hashes
    from armwright.report.trials_files import trials_files
    from armwright.report.trials_summary import TrialsSummary

    identity = {"options": inputs.options, "inputs": input_hashes(inputs)}
    task = ProgramTrials(code=code, cell=cell, seed=seed, limits=limits, identity=identity)
    with sweep_bar(f"{count} trials", quiet=not watched) as progress:
        trials = evaluate_trials(task, count, output, machines, progress)
    summary = TrialsSummary(program=inputs.program.name, cell=cell.name, seed=seed, trials=trials)
    if output is not None:
        write_results(output, trials_files(summary, command=command_line()))
    return summary


def evaluate_trials(
    task: "ProgramTrials",
    count: int,
    output: Path | None,
    machines: Machines,
    progress: "Callable[[Progress], None] | None" = None,
) -> "tuple[Trial, ...]":
    """Run trials 1 to ``count``: on the cores of the machine, or in this process without the extra ``sweep``."""
    import numpy as np

    from armwright.errors import MissingExtraError
    from armwright.report.trials_summary import trial
    from armwright.sweep.designs import Design
    from armwright.sweep.extras import check_extras

    design = Design(names=("trial",), points=np.arange(1.0, count + 1.0)[:, None])
    try:
        check_extras()
    except MissingExtraError:
        columns = _evaluate_here(task, design, progress)
    else:
        columns = _evaluate_in_sweep(task, design, output, machines, progress)
    return tuple(
        trial(number, message, dict(zip(task.outputs, numbers, strict=True)))
        for number, (message, *numbers) in enumerate(zip(*columns, strict=True), 1)
    )


def _evaluate_in_sweep(
    task: "ProgramTrials",
    design: "Design",
    output: Path | None,
    machines: Machines,
    progress: "Callable[[Progress], None] | None",
) -> list[list[Any]]:
    """Return the messages and the outputs of all trials; with a folder finished ones are kept in it."""
    import tempfile

    from armwright.sweep.runner import run

    with tempfile.TemporaryDirectory() as passing:
        folder = Path(passing, _FOLDER) if output is None else output / _FOLDER
        try:
            results = run(
                task,
                design,
                folder,
                block=-(-len(design) // _MAX_BLOCKS),
                workers=machines.workers,
                scheduler=machines.scheduler,
                progress=progress,
            )
        except BaseException as error:
            if output is not None:
                error.add_note(f"finished trials are stored in '{folder}'; the same command resumes them")
            raise
        with closing(results):
            messages = [
                text.decode() if isinstance(text, bytes) else text for text in results["message"].to_numpy().tolist()
            ]
            return [messages, *(results[name].to_numpy().tolist() for name in task.outputs)]


def _evaluate_here(
    task: "ProgramTrials", design: "Design", progress: "Callable[[Progress], None] | None"
) -> list[list[Any]]:
    """Return the same, trial by trial in this process; nothing is kept of those that are interrupted."""
    import time

    import attrs
    import numpy as np

    from armwright.sweep.progress import Progress
    from armwright.sweep.task import evaluate

    began, now, done = time.monotonic(), Progress(runs=len(design)), []
    for point in design.points:
        done.append(evaluate(task, point[None]))
        now = attrs.evolve(now.with_runs(done[-1]["status"]), seconds=time.monotonic() - began)
        if progress is not None:
            progress(now)
    return [np.concatenate([row[name] for row in done]).tolist() for name in ("message", *task.outputs)]
