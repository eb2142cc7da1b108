"""``armwright clearance estimate``: the clearances that measurements tell, and how well."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.linkages import LinkageName
from armwright.cli.output import plain_console, print_json, print_table, table
from armwright.cli.progress import waiting
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of

if TYPE_CHECKING:
    from armwright.clearance.estimation.measurement_file import PathsMeasured, RestMeasured
    from armwright.clearance.estimation.on_paths import Learnt
    from armwright.clearance.estimation.static import Estimate
    from armwright.clearance.linkage import Linkage

# What of an error curve is compared.
_FEATURES = ("slope", "intercept", "amp_dc", "offset_x", "offset_y")
_LEVEL = 0.9
# How a fault of the model is told by its unit: times so much, in what, and a usual size of it.
_SHOWN_AS = {"1": (1e2, "%", 10.0), "m": (1e3, "mm", 0.1), "rad": (180 / math.pi, "deg", 0.01)}


def estimate(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    measured: Annotated[
        Path, typer.Argument(help="CSV of a resting tip, or of a tip on paths (docs/clearance.md).", show_default=False)
    ],
    sweep: Annotated[
        Path | None,
        typer.Option(help="Folder of `clearance sweep` with the same paths; for measurements on paths."),
    ] = None,
    noise_um: Annotated[
        float | None,
        typer.Option(help="Standard deviation of a measured coordinate; that of repeated readings without it."),
    ] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the estimate as JSON, in SI units.")] = False,
) -> None:
    """Tell the clearances of a linkage from where its tip rests, or from how it follows paths.

    At rest a few poses are enough and no simulation is needed. On paths a sweep of simulations tells what an error
    curve means; the answer is a distribution: mean, 90 % interval, correlation, and which parameters the data do not
    tell. Where no clearances explain the data none are told, and the exit status is 3.

    **Example:** `armwright clearance estimate five-bar examples/five_bar_rest.csv`
    """
    from armwright.clearance.estimation.measurement_file import RestMeasured, read_measured
    from armwright.clearance.reader import load_linkage
    from armwright.cli.results import warn_of_stray

    warn_of_stray(measured)
    model = load_linkage(linkage)
    found = read_measured(measured, columns=columns_of(columns), skip_incomplete=skip_incomplete)
    noise = None if noise_um is None else noise_um * 1e-6
    told = _at_rest(model, found, noise) if isinstance(found, RestMeasured) else _on_paths(model, found, sweep, noise)
    if as_json:
        print_json(told)
    else:
        _print(told)


def _at_rest(model: "Linkage", measured: "RestMeasured", noise: float | None) -> dict[str, Any]:
    from armwright.clearance.estimation.blind import faults
    from armwright.clearance.estimation.misfit import widening
    from armwright.errors import InvalidValueError

    if noise is not None and not 0 < noise < math.inf:
        raise InvalidValueError(f"--noise-um: expected a number above 0, got {noise * 1e6:g}")
    found = measured.estimate(model, noise)
    interval, told = found.interval(_LEVEL), found.identifiable(float(found.values.max()))
    wrong = faults(model, measured.poses, found, noise_is_known=bool(noise or measured.noise))
    return {
        "by": "rest",
        "parameters": {
            name: {
                "mean": float(found.values[i]),
                "deviation": float(found.deviations[i]),
                "interval": interval[i].tolist(),
                "identifiable": told[i],
            }
            for i, name in enumerate(found.names)
        },
        "correlation": found.correlation.tolist(),
        "misfit": float(found.misfit),
        "widening": float(widening(found.square, found.spare)),
        "wrong_models": [
            {
                "what": one.name,
                "unit": one.unit,
                "refused_from": one.seen if math.isfinite(one.seen) else None,
                "shifts": dict(zip(found.names, one.shifts.tolist(), strict=True)),
            }
            for one in wrong
        ],
        "notes": [
            (
                f"{len(measured.names)} poses, {sum(measured.readings)} readings; "
                f"residual {found.residual * 1e6:.3g} µm (rms)"
            ),
            f"singular values of the equations: {', '.join(f'{x:.3g}' for x in found.singular_values)}",
            *([] if noise or measured.noise else [_no_noise(found)]),
            *_told_of_fit(float(found.misfit), float(widening(found.square, found.spare))),
            *_told_of_friction(model.material.friction, float(found.values.max())),
            *(
                f"{name} cannot be told from 0 mm: it is less than its standard deviation"
                for name, ends in zip(found.names, found.at_bound, strict=True)
                if ends
            ),
        ],
    }


def _no_noise(found: "Estimate") -> str:
    """Say what was taken for the noise where no readings of a pose differ."""
    if math.isfinite(found.freedom):
        return (
            f"no readings of a pose differ and --noise-um is not given: the {found.noise * 1e6:.3g} µm that are left "
            f"are taken for the noise, and whether the model fits cannot be told"
        )
    return f"no readings of a pose differ: a noise of {found.noise * 1e6:.3g} µm was taken for granted"


def _told_of_fit(misfit: float, wider: float) -> list[str]:
    """Say how well the model explains the data."""
    told = [f"where the model holds, residuals are as large or larger in {100 * misfit:.3g} % of cases"]
    if wider > 1:
        told.append(f"residuals are {wider:.3g} times the noise: deviations and intervals are widened by as much")
    return told


def _told_of_friction(friction: float, clearance: float) -> Iterator[str]:
    """Say how far from where it is taken to lie a journal may stay at rest."""
    if friction:
        aside = math.atan(friction) * clearance * 1e6
        yield (
            f"friction ({friction:g}) may hold a journal {aside:.2g} µm to either side of where it is taken to lie; "
            f"the intervals do not include that"
        )


def _on_paths(model: "Linkage", measured: "PathsMeasured", folder: Path | None, noise: float | None) -> dict[str, Any]:
    from armwright.clearance.estimation.on_paths import learnt_from
    from armwright.clearance.estimation.posterior import posterior
    from armwright.errors import InvalidValueError

    if folder is None:
        raise typer.BadParameter(
            "measurements on paths need a sweep to compare with: `armwright clearance sweep`", param_hint="--sweep"
        )
    if noise is None or not 0 < noise < math.inf:
        raise InvalidValueError("--noise-um: expected the standard deviation of a measured coordinate, above 0")
    with waiting(f"learning from the simulations in {folder}") as told_of:
        learnt = learnt_from(folder, model, tuple(measured.times), _FEATURES, told_of)
    names = learnt.surrogate.features
    found = posterior(learnt.surrogate, measured.seen(names), measured.noise_of(names, noise)).checked()
    interval = found.interval(_LEVEL)
    return {
        "by": "paths",
        "parameters": {
            name.removeprefix("c_"): {
                "mean": float(found.mean[i]),
                "deviation": float(found.deviations[i]),
                "interval": interval[i].tolist(),
                "identifiable": found.identifiable[name],
            }
            for i, name in enumerate(found.names)
        },
        "correlation": found.correlation.tolist(),
        "misfit": found.misfit,
        "widening": found.widening,
        "left_out": list(learnt.chance),
        "predictable_until": dict(learnt.until),
        "notes": [
            f"{len(names)} features of {len(measured.times)} paths, learnt from {learnt.runs} simulations",
            *_told_of_chance(learnt),
            *_told_of_fit(found.misfit, found.widening),
            *(
                f"{name.removeprefix('c_')} lies at the end of what was swept, "
                f"{end if name == 'friction' else end * 1e3:g}{'' if name == 'friction' else ' mm'}, or beyond: "
                f"it is not identified; sweep further"
                for name, end in found.bounds.items()
            ),
        ],
    }


def _told_of_chance(learnt: "Learnt") -> list[str]:
    """Say until when the paths are predictions, and which features are left out since they are chance."""
    if not learnt.until:
        return ["the sweep has no runs beside each (--twins 0): what is chance is known from the scatter of its runs"]
    until = ", ".join(f"{path} {t:.3g} s" for path, t in learnt.until.items())
    told = [f"predictable until, in half of the simulations: {until}; what chance does later counts as noise"]
    if learnt.chance:
        told.append(
            f"left out, since runs that nobody can tell apart differ by more than the clearances change them: "
            f"{', '.join(learnt.chance)}"
        )
    return told


def _print(told: Mapping[str, Any]) -> None:
    names = list(told["parameters"])
    rows = []
    for i, (name, one) in enumerate(told["parameters"].items()):
        scale = 1.0 if name == "friction" else 1e3
        low, high = (scale * x for x in one["interval"])
        rows.append(
            (
                "friction, no unit" if name == "friction" else name,
                f"{scale * one['mean']:.4f}",
                f"{scale * one['deviation']:.4f}",
                f"{low:.4f} to {high:.4f}",
                "yes" if one["identifiable"] else "no",
                *(f"{x:+z.2f}" for x in told["correlation"][i]),
            )
        )
    console = plain_console()
    first = "parameter" if "friction" in names else "pin"
    heads = (first, "mean mm", "± mm", "90 % interval mm", "identified", *(f"r {one}" for one in names))
    print_table(console, table(heads, rows))
    for note in told["notes"]:
        console.print(note)
    if told.get("wrong_models"):
        _print_wrong_models(told["wrong_models"])


def _print_wrong_models(wrong: Sequence[Mapping[str, Any]]) -> None:
    """Print which errors of the model the readings would contradict, and what smaller ones do to the estimates."""
    rows = []
    for one in wrong:
        (scale, unit, usual), least = _SHOWN_AS[one["unit"]], one["refused_from"]
        if least is None:
            seen = "never"
        elif one["unit"] == "1" and least > 1:
            # No small change, for which alone all this is worked out.
            seen = "beyond 100 %"
        else:
            seen = f"{least * scale:.2g} {unit}"
        shifts = (f"{x * usual / scale * 1e6:+z.1f}" for x in one["shifts"].values())
        rows.append((one["what"], seen, f"{usual:g} {unit}", *shifts))
    heads = ("error of the model", "refused from", "shift per", *(f"{pin} µm" for pin in wrong[0]["shifts"]))
    console = plain_console()
    print_table(console, table(heads, rows, words=(0,)))
    console.print(
        "Where the model is in error by as much as stands under `refused from`, these readings are refused in 9 of 10 "
        "cases. Smaller errors pass for clearance: they shift the estimates in proportion, and the intervals do not "
        "include that."
    )
