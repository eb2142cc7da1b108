"""``armwright clearance plan-checks``: when to measure, correct and change a linkage whose pins wear."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from armwright.cli.linkages import (
    BearingShare,
    Clearances,
    LinkageName,
    SpeedRpm,
    TipPathName,
    WidthMm,
    path_of,
    with_clearances,
)
from armwright.cli.numbers import named_numbers
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import counting
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of

if TYPE_CHECKING:
    from armwright.arrays import Array
    from armwright.clearance.linkage import Linkage

# Of the horizon, for which a check at least should help.
_LEAST_PART = 1 / 50


def plan_checks(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    k: Annotated[float, Option("--k", help="Median of the wear coefficients in mm³/(N m); take a measured one.")],
    limit: Annotated[float, Option(help="Limit of the error along the corrected path in mm.")],
    horizon: Annotated[float, Option(help="Strokes until which is planned, counted from the new linkage.")],
    path: TipPathName = None,
    speed_rpm: SpeedRpm = None,
    alpha: Annotated[float, Option(help="Probability of an error beyond the limit at which a check is due.")] = 0.05,
    k_spread: Annotated[
        float, Option("--k-spread", help="Standard deviation of the logarithm of the wear coefficients of all pins.")
    ] = 0.5,
    pin_spread: Annotated[
        float, Option(help="Standard deviation of the logarithm of that of a single bearing about the others.")
    ] = 0.3,
    pin_factor: Annotated[
        list[str] | None, Option(help="Factor of the wear coefficient of a pin, as in J3=2; may be repeated.")
    ] = None,
    grain_um: Annotated[float, Option(help="Variance of a growth divided by its mean, in um.")] = 0.5,
    scatter: Annotated[
        float, Option(help="Standard deviation of the growth between two checks, as a part of it.")
    ] = 0.05,
    clearance: Clearances = None,
    clearance_sd_mm: Annotated[
        float, Option("--clearance-sd-mm", help="Standard deviation of new clearances in mm.")
    ] = 0.01,
    width_mm: WidthMm = 20.0,
    bearing_share: BearingShare = 0.5,
    noise_um: Annotated[float, Option(help="Standard deviation of one coordinate of a reading in um.")] = 10.0,
    poses: Annotated[int, Option(help="Number of poses of a check, at most 6.")] = 3,
    readings: Annotated[int, Option(help="Readings of each pose, each approached anew, at most 1000.")] = 5,
    change_at: Annotated[
        float | None, Option("--change-at", help="Clearance in mm at which a bearing is changed in any case.")
    ] = None,
    least_interval: Annotated[
        float | None, Option(help="Strokes for which a check should help; a fiftieth of the horizon by default.")
    ] = None,
    measurements: Annotated[
        Path | None, Option(help="CSV of past checks: strokes with readings, or with clearances.")
    ] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    changed: Annotated[
        list[str] | None, Option(help="Strokes after which a bearing was last changed, as in J2=2e6; may be repeated.")
    ] = None,
    strokes_done: Annotated[
        float | None, Option(help="Strokes until now; those of the last check or change by default.")
    ] = None,
    strokes_per_day: Annotated[float | None, Option(help="Strokes in a day, to print days.")] = None,
    lives: Annotated[int, Option(help="Number of simulated lives, 2 to 10000.")] = 20,
    seed: Annotated[int, Option(min=0, help="Seed of all random numbers.")] = 0,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plan when to measure a linkage whose pins wear, when to correct its path, and when to change which bearing.

    A filter tracks clearances and wear coefficients through the past checks. The path is corrected for the clearances
    that are expected; the next check is due when the error passes the limit with the probability alpha, and a bearing
    is changed where a check no longer helps. Simulated lives tell the expected number of stops, the share of strokes
    out of limit, and what checks at equal distances would cost. With -o the command writes report.html, plan.json,
    corrections.csv and figures.

    **Example:** `armwright clearance plan-checks five-bar --path pick-and-place --k 1e-4 --limit 0.1 --horizon 2e7`
    """
    from armwright.clearance.maintenance.assessment import plan_checks as planned
    from armwright.clearance.maintenance.belief import WearPrior
    from armwright.clearance.maintenance.check_file import PastCheck, read_checks
    from armwright.clearance.maintenance.maintained_linkage import maintained_linkage
    from armwright.clearance.maintenance.strategy import Strategy
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.wear.worn_surfaces import WearLaw
    from armwright.report.check_plan_files import check_plan_files

    if strokes_per_day is not None and not 0 < strokes_per_day < float("inf"):
        raise usage_error("--strokes-per-day", f"expected a number above 0, got {strokes_per_day:g}")
    model = with_clearances(load_linkage(linkage), clearance or [])
    checks: tuple[PastCheck, ...] = ()
    if measurements is not None:
        warn_of_stray(measurements)
        checks = read_checks(measurements, model, columns=columns_of(columns), skip_incomplete=skip_incomplete)
    prior = WearPrior(
        clearances=model.clearance_array(None),
        clearance_spread=clearance_sd_mm * 1e-3,
        coefficients=_coefficients(model, k, pin_factor or []),
        spread=k_spread,
        pin_spread=pin_spread,
        grain=grain_um * 1e-6,
        scatter=scatter,
    )
    changes = named_numbers(changed or [], ("",), "a pin and strokes, J2=2e6", "--changed")
    strategy = Strategy(
        limit=limit * 1e-3,
        alpha=alpha,
        horizon=horizon,
        least_interval=horizon * _LEAST_PART if least_interval is None else least_interval,
        change_at=float("inf") if change_at is None else change_at * 1e-3,
        noise=noise_um * 1e-6,
        readings=readings,
    )
    law = WearLaw(coefficient=1.0, width=width_mm * 1e-3, bearing_share=bearing_share)
    stroke = path_of(model, path, speed_rpm, 1.0)
    machine = maintained_linkage(model, stroke, law, exposure=horizon * prior.fastest, poses=poses)
    with counting("lives", quiet=quiet or as_json) as progress:
        plan = planned(
            machine,
            prior,
            strategy,
            checks=checks,
            changed={pin: number.value for pin, number in changes.items()},
            strokes=strokes_done,
            strokes_per_day=strokes_per_day,
            lives=lives,
            seed=seed,
            progress=progress,
        )
    if output is not None:
        write_results(output, check_plan_files(plan, command=command_line()))
    print_result(plan, as_json=as_json, quiet=quiet, output=output)


def _coefficients(model: "Linkage", k: float, factors: list[str]) -> "Array":
    """Return (p,) the median wear coefficients [m²/N] that a coefficient in mm³/(N m) and factors of pins tell."""
    import numpy as np

    from armwright.errors import one_of

    named = named_numbers(factors, ("",), "a pin and a factor, J3=2", "--pin-factor")
    for pin in named:
        one_of("pin", pin, model.clearances)
    return np.array([k * 1e-9 * (named[pin].value if pin in named else 1.0) for pin in model.clearances])
