"""The trials of ``armwright run --physics``: many drawn cases of a cell, or one of them again."""

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from armwright.cli.options import usage_error
from armwright.cli.output import command_line
from armwright.cli.progress import sweep_bar
from armwright.cli.results import write_results
from armwright.cli.sweeps import resumable

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
    from armwright.sweep.machines import Machines
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


def run_trials(
    code: "Code",
    cell: "Cell",
    inputs: "RunInputs",
    limits: "Limits",
    machines: "Machines",
    *,
    seed: int,
    count: int,
    output: Path | None,
    watched: bool,
) -> "TrialsSummary":
    """Run trials of a program, write their files, and return their summary.

    With a folder, every finished trial is stored in it, and the same command resumes trials that were interrupted.
    """
    import attrs

    from armwright.program.vm.trials import ProgramTrials
    from armwright.report.run_files import input_hashes
    from armwright.report.trials_files import trials_files
    from armwright.report.trials_summary import TrialsSummary

    identity = {"options": inputs.options, "inputs": input_hashes(inputs)}
    task = ProgramTrials(code=code, cell=cell, seed=seed, limits=limits, identity=identity)
    folder = None if output is None else output / _FOLDER
    with sweep_bar(f"{count} trials", quiet=not watched) as progress, resumable(folder, "trials"):
        trials = evaluate_trials(task, count, attrs.evolve(machines, folder=folder, progress=progress))
    summary = TrialsSummary(program=inputs.program.name, cell=cell.name, seed=seed, trials=trials)
    if output is not None:
        write_results(output, trials_files(summary, command=command_line()))
    return summary


def evaluate_trials(task: "ProgramTrials", count: int, machines: "Machines") -> "tuple[Trial, ...]":
    """Run trials 1 to ``count``: on the cores of the machine, or in this process without the extra ``sweep``."""
    import numpy as np

    from armwright.errors import MissingExtraError
    from armwright.report.trials_summary import trial
    from armwright.sweep.designs import Design
    from armwright.sweep.extras import check_extras
    from armwright.sweep.machines import evaluate_on

    design = Design(names=("trial",), points=np.arange(1.0, count + 1.0)[:, None])
    try:
        check_extras()
    except MissingExtraError:
        columns = _evaluate_here(task, design, machines.progress)
    else:
        rows = evaluate_on(machines, task, design, block=-(-count // _MAX_BLOCKS))
        columns = [rows[name].tolist() for name in ("message", *task.outputs)]
    return tuple(
        trial(number, message, dict(zip(task.outputs, numbers, strict=True)))
        for number, (message, *numbers) in enumerate(zip(*columns, strict=True), 1)
    )


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
