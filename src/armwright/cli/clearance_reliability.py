"""``armwright clearance reliability``: how probable an error of the tip is that is too long, and when it becomes so."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from typer import Option

from armwright.cli.linkages import LinkageName, SpeedRpm, WidthMm, path_of, poses_of, with_clearances
from armwright.cli.numbers import named_numbers
from armwright.cli.options import Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.shell_completion import paths
from armwright.cli.sweeps import SampleScheduler, SampleWorkers, sampling
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of

if TYPE_CHECKING:
    from armwright.clearance.linkage import Linkage
    from armwright.reliability.linkage_assessment import WearStatement
    from armwright.reliability.linkage_errors import RandomClearances

# Units of deviations, of which one need not be written.
_UNITS = ("", "mm", "deg", "kg", "N")


def reliability(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    limit: Annotated[float | None, Option(help="Limit of the error of the tip at rest, in mm.")] = None,
    pose: Annotated[
        list[str] | None,
        Option(help="Position of the tip in mm, as in -180,-600, or the drive in deg or mm; may be repeated."),
    ] = None,
    path: Annotated[
        str | None,
        Option(
            help="Path whose poses count without --pose, and of a stroke: x1 to x10, y1 to y14, pick-and-place.",
            autocompletion=paths,
        ),
    ] = None,
    speed_rpm: SpeedRpm = None,
    poses: Annotated[int, Option(min=2, max=1000, help="Number of poses along the path.")] = 21,
    clearance: Annotated[
        list[str] | None, Option(help="Mean radial clearance of a pin in mm, as in J2=0.34; may be repeated.")
    ] = None,
    sd: Annotated[
        list[str] | None,
        Option(
            "--sd",
            help="Standard deviation, as in J2=0.02 (mm), link2.length=0.01, link1.zero=0.01deg, tool.along=0.1.",
        ),
    ] = None,
    clearance_sd_mm: Annotated[
        float, Option("--clearance-sd-mm", help="Standard deviation of the clearances that --sd does not name, in mm.")
    ] = 0.02,
    estimate: Annotated[
        Path | None, Option(help="Output of `clearance estimate --json`: mean and covariance of the clearances.")
    ] = None,
    lognormal: Annotated[bool, Option("--lognormal", help="Clearances are lognormal, and not normal.")] = False,
    friction: Annotated[
        bool, Option("--friction", help="Friction holds journals anywhere in their friction cones at each pose.")
    ] = False,
    samples: Annotated[
        int | None,
        Option(
            min=2,
            max=1_000_000,
            help="Number of random linkages in complete equilibrium; 2000, or 200 with more than clearances.",
        ),
    ] = None,
    seed: Annotated[int, Option(min=0, help="Seed of all samples.")] = 0,
    k: Annotated[
        float | None, Option("--k", help="Median wear coefficient in mm³/(N m); asks for the life. Needs a path.")
    ] = None,
    k_spread: Annotated[
        float, Option("--k-spread", help="Standard deviation of the logarithm of the wear coefficient.")
    ] = 0.5,
    k_each: Annotated[
        bool, Option("--k-each", help="Every pin has a wear coefficient of its own, independent of the others.")
    ] = False,
    width_mm: WidthMm = 20.0,
    arc_rad: Annotated[
        float | None, Option(help="Arc on which the wear is spread evenly, in rad; without it walls are worn.")
    ] = None,
    steps: Annotated[int, Option(help="Steps of the worn walls, each of at most 4 % of a clearance.")] = 20,
    limit_rp: Annotated[
        float | None, Option("--limit-rp", help="Limit of the repeatability RP of ISO 9283 in mm, for the life.")
    ] = None,
    strokes: Annotated[
        float | None, Option(help="Strokes after which the probability of an error beyond --limit is asked for.")
    ] = None,
    measurements: Annotated[
        Path | None, Option(help="Table of strokes, measure (a pin, AP, RP), value_mm, standard_error_mm.")
    ] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    workers: SampleWorkers = None,
    scheduler: SampleScheduler = None,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Print how probable it is that the error of a linkage's tip passes a limit, new and worn.

    The clearances are random, stated or estimated; all other dimensions may be, too. Printed are the probability
    at the worst pose, by the exact law, at any pose, and of random linkages in complete equilibrium. With --k the pins
    wear: printed are the strokes that 95, 90 (B10), 50 and 5 % reach, with the intervals of the wear coefficient, and
    which pin counts most. Measurements of the worn linkage (--measurements) update both. With -o, report.html shows the
    curves with their bands. With --workers the random linkages are a sweep; with -o it can be resumed.

    **Example:** `armwright clearance reliability five-bar --pose -180,-600 --clearance J2=0.328 --limit 0.9`
    """
    from armwright.clearance.poses import closed_along, closed_at
    from armwright.clearance.reader import load_linkage
    from armwright.reliability.linkage_assessment import assess_linkage
    from armwright.report.reliability_files import reliability_files

    model = with_clearances(load_linkage(linkage), clearance or [])
    if limit is None and k is None:
        raise usage_error("--limit", "expected a limit of the error, --limit MM, or a life, --k with a limit")
    if estimate is not None and (clearance or sd):
        raise usage_error("--estimate", "give either --estimate or --clearance and --sd")
    if strokes is not None and limit is None:
        raise usage_error("--strokes", "expected the limit of the error too, --limit MM")
    named = named_numbers(sd or (), _UNITS, "a dimension and its deviation, J2=0.02 or link1.zero=0.01deg", "--sd")
    way = None if path is None and speed_rpm is None else path_of(model, path, speed_rpm, 1.0)
    if not pose and way is None:
        raise usage_error("--pose", "expected poses, as --pose X,Y, or those of a path, --path")
    wear = None
    if k is not None:
        if way is None:
            raise usage_error("--k", "wear needs the path of a stroke, --path or --speed-rpm")
        limits = {"error": limit, "RP": limit_rp}
        wear = _wear(
            model,
            way,
            k=k * 1e-9,
            spread=k_spread,
            each=k_each,
            width=width_mm * 1e-3,
            arc=arc_rad,
            steps=steps,
            limits={name: value * 1e-3 for name, value in limits.items() if value is not None},
            after=strokes,
            file=measurements,
            columns=columns_of(columns),
            skip_incomplete=skip_incomplete,
        )
    elif measurements is not None or limit_rp is not None or strokes is not None:
        raise usage_error("--k", "strokes, measurements and a limit of RP need the wear coefficient, --k")
    with sampling("random linkages", workers, scheduler, output, quiet=quiet or as_json) as (progress, machines):
        assessment = assess_linkage(
            model,
            closed_along(model, way, poses) if way and not pose else closed_at(model, poses_of(model, pose or [])),
            _clearances(
                model,
                {name: x.value * 1e-3 for name, x in named.items() if name in model.clearances},
                clearance_sd_mm * 1e-3,
                estimate,
                lognormal=lognormal,
            ),
            deviations=_deviations(model, named),
            friction=friction,
            limit=None if limit is None else limit * 1e-3,
            wear=wear,
            samples=samples,
            seed=seed,
            machines=machines,
            progress=progress,
        )
    if output is not None:
        write_results(output, reliability_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, quiet=quiet, output=output)


def _deviations(model: "Linkage", named: dict[str, Any]) -> dict[str, float]:
    """Return standard deviations of what is no clearance [m, rad, kg, N].

    Raises:
        BadParameter: the unit of one is wrong.
    """
    from armwright.clearance.dimensions import dimensions_of
    from armwright.reliability.tolerances import SHOWN

    units = {dimension.name: dimension.unit for dimension in dimensions_of(model)}
    found = {}
    for name, number in named.items():
        scale, unit = SHOWN[units.get(name, "m")]
        if number.unit not in {"", unit}:
            raise usage_error("--sd", f"{name}: expected {unit}, got {number.unit}")
        if name not in model.clearances:
            found[name] = number.value * scale
    return found


def _clearances(
    model: "Linkage", own: dict[str, float], usual: float, estimate: Path | None, *, lognormal: bool
) -> "RandomClearances":
    import numpy as np

    from armwright.arrays import not_negative
    from armwright.clearance.estimation.assessment import read_estimate_moments
    from armwright.reliability.linkage_errors import RandomClearances

    shape: Literal["normal", "lognormal"] = "lognormal" if lognormal else "normal"
    if estimate is not None:
        warn_of_stray(estimate)
        mean, covariance = read_estimate_moments(estimate, model)
        return RandomClearances(mean=mean, covariance=covariance, shape=shape)
    spreads = [not_negative(own.get(name, usual), f"deviation of {name}", "m") for name in model.clearances]
    return RandomClearances(mean=list(model.clearances.values()), covariance=np.diag(np.square(spreads)), shape=shape)


def _wear(
    model: "Linkage", way: Any, *, file: Path | None, columns: Any, skip_incomplete: bool, **stated: Any
) -> "WearStatement":
    from armwright.clearance.wear.worn_surfaces import WearLaw
    from armwright.reliability.linkage_assessment import WearStatement
    from armwright.reliability.wear_measurements import WearMeasurement, read_wear_measurements

    if not stated["limits"]:
        raise usage_error("--limit", "a life needs a limit, --limit or --limit-rp")
    measured: tuple[WearMeasurement, ...] = ()
    if file is not None:
        warn_of_stray(file)
        measured = read_wear_measurements(
            file, tuple(model.clearances), columns=columns, skip_incomplete=skip_incomplete
        )
    law = WearLaw(coefficient=stated.pop("k"), width=stated.pop("width"))
    return WearStatement(path=way, law=law, measured=measured, **stated)
