"""``armwright life``: how long an arm lives that repeats a motion."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from armwright.cli.options import ArmName, Json, OutputFolder, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of

if TYPE_CHECKING:
    from armwright.arrays import Array
    from armwright.identification.log import Log


def life(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    motion: Annotated[Path, Argument(help="Table or recording of the motion, such as motion.csv of a run.")],
    file: Annotated[Path, Argument(help="TOML file of ratings and plays (docs/reliability.md).")],
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    limit: Annotated[
        float | None, Option(help="Limit of the repeatability RP in mm; asks for the cycles until plays pass it.")
    ] = None,
    dwell: Annotated[float, Option(help="Pause before the motion is repeated, in s.")] = 0.0,
    per_day: Annotated[float | None, Option("--cycles-per-day", help="Cycles in a day.")] = None,
    samples: Annotated[int, Option(min=1, max=100_000, help="Number of random arms.")] = 2000,
    seed: Annotated[int, Option(min=0, help="Seed of the random arms.")] = 0,
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Print how long the reducers, bearings and the repeatability of an arm last that repeats a motion.

    The command computes mean and peak efforts of every joint, compares them with the ratings, and prints the lives that
    nine in ten reach, first to fail in front. With --limit it prints the cycles until growing plays make the
    repeatability too large, at the poses where the arm rests. Without columns of efforts those of the model count.
    With -o it writes report.html, life.json and figures (SVG).

    **Example:** `armwright life puma560 out/run/motion.csv examples/puma_life.toml --limit 0.1 --cycles-per-day 5000`
    """
    from armwright.arm.load import load_arm
    from armwright.identification.reading import read_logs
    from armwright.reliability.arm_life import RepeatedMotion, assess_life
    from armwright.reliability.life_file import read_life_file
    from armwright.report.life_files import life_files

    for option, value in (("--limit", limit), ("--cycles-per-day", per_day)):
        if value is not None and not 0 < value < float("inf"):
            raise usage_error(option, f"expected a number above 0, got {value:g}")
    if not 0 <= dwell < float("inf"):
        raise usage_error("--dwell", f"expected 0 s or more, got {dwell:g}")
    model = load_arm(arm)
    warn_of_stray(motion)
    (log,) = read_logs(
        [motion], model, columns=columns_of(columns), skip_incomplete=skip_incomplete, model_efforts=True
    )
    stated = read_life_file(file, model)
    with waiting("lives", quiet=as_json):
        found = assess_life(
            model,
            RepeatedMotion(t=log.t, q=log.q, qd=_speeds(log), effort=log.effort, dwell=dwell, notes=log.notes),
            stated,
            limit=None if limit is None else limit * 1e-3,
            per_day=per_day,
            samples=samples,
            seed=seed,
        )
    if output is not None:
        write_results(output, life_files(found, command=command_line()))
    print_result(found, as_json=as_json, output=output)


def _speeds(log: "Log") -> "Array":
    """Return the velocities of a log; by differences where they were not measured."""
    import numpy as np

    return np.gradient(log.q, log.t, axis=0) if log.qd is None else log.qd
