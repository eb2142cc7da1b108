"""``armwright clearance estimate``: the clearances that measurements tell, and how well."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.linkages import LinkageName
from armwright.cli.printing import plain_console, print_json, print_table, table
from armwright.cli.progress import waiting

if TYPE_CHECKING:
    from armwright.clearance.estimating.measured import PathsMeasured, RestMeasured
    from armwright.clearance.estimating.static import Estimate
    from armwright.clearance.linkage import Linkage

# What of an error curve is compared.
_FEATURES = ("slope", "intercept", "amp_dc", "offset_x", "offset_y")
_LEVEL = 0.9


def estimate(
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
    as_json: Annotated[bool, typer.Option("--json", help="Print the estimate as JSON, in SI units.")] = False,
) -> None:
    """Tell the clearances of a linkage from where its tip rests, or from how it follows paths.

    At rest a few poses are enough and no simulation is needed. On paths a sweep of simulations tells what an error
    curve means; the answer is a distribution: mean, 90 % interval, correlation, and which parameters the data do not
    tell. Where no clearances explain the data none are told, and the exit status is 3.

    **Example:** `armwright clearance estimate five-bar examples/five_bar_rest.csv`
    """
    from armwright.clearance.estimating.measured import RestMeasured, read_measured
    from armwright.clearance.reader import load_linkage
    from armwright.cli.results import warn_of_stray

    warn_of_stray(measured)
    model, found = load_linkage(linkage), read_measured(measured)
    noise = None if noise_um is None else noise_um * 1e-6
    told = _at_rest(model, found, noise) if isinstance(found, RestMeasured) else _on_paths(model, found, sweep, noise)
    if as_json:
        print_json(told)
    else:
        _print(told)


def _at_rest(model: "Linkage", measured: "RestMeasured", noise: float | None) -> dict[str, Any]:
    from armwright.clearance.estimating.misfit import widening
    from armwright.errors import InvalidValueError

    if noise is not None and not 0 < noise < math.inf:
        raise InvalidValueError(f"--noise-um: expected a number above 0, got {noise * 1e6:g}")
    found = measured.estimate(model, noise)
    interval, told = found.interval(_LEVEL), found.identifiable(float(found.values.max()))
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
        "notes": [
            f"{len(measured.names)} poses, {sum(measured.readings)} readings; {found.residual * 1e6:.3g} µm are left",
            f"singular values of the equations: {', '.join(f'{x:.3g}' for x in found.singular_values)}",
            *([] if noise or measured.noise else [_no_noise(found)]),
            *_told_of_fit(float(found.misfit), float(widening(found.square, found.spare))),
            *(
                f"{name} is at its bound, 0 mm: the readings would have it below nothing"
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
    told = [f"data as far off as these come by chance in {100 * misfit:.3g} % of cases"]
    if wider > 1:
        told.append(f"more is left than the noise explains: deviations and intervals are {wider:.3g} times as wide")
    return told


def _on_paths(model: "Linkage", measured: "PathsMeasured", folder: Path | None, noise: float | None) -> dict[str, Any]:
    import json

    import numpy as np

    from armwright.clearance.estimating.kriging import learn
    from armwright.clearance.estimating.posterior import posterior
    from armwright.clearance.sweeping import is_sweep_of
    from armwright.errors import InvalidValueError
    from armwright.sweep.results import load

    if folder is None:
        raise typer.BadParameter(
            "measurements on paths need a sweep to compare with: `armwright clearance sweep`", param_hint="--sweep"
        )
    if noise is None or not 0 < noise < math.inf:
        raise InvalidValueError("--noise-um: expected the standard deviation of a measured coordinate, above 0")
    with load(folder) as data:
        if not is_sweep_of(json.loads(data.attrs["settings"]), model):
            raise InvalidValueError(f"{folder}: the sweep is of another linkage than {model.name}; sweep this one")
        names = tuple(f"{path}_{feature}" for path in measured.times for feature in _FEATURES)
        missing = sorted({name.partition("_")[0] for name in names if name not in data})
        if missing:
            raise InvalidValueError(
                f"{folder}: the sweep has no path {', '.join(missing)}; sweep the paths that were measured"
            )
        parameters = tuple(name for name in map(str, data.coords) if name.startswith("c_") or name == "friction")
        points = np.stack([data[name].to_numpy() for name in parameters], axis=-1)
        values = np.stack([np.where(data["status"] == 0, data[name], np.nan) for name in names], axis=-1)
        told = json.loads(data.attrs["design"])["ranges"]
    # The two bounds of a design by chance, or the levels of a full factorial.
    ranges = [(min(told[name]), max(told[name])) for name in parameters] if set(parameters) <= set(told) else None
    with waiting(f"learning from {len(points)} simulations") as told_of:
        surrogate = learn(parameters, points, names, values, ranges=ranges, progress=told_of)
    features = measured.features()
    seen = [float(getattr(features[path], feature)) for path in measured.times for feature in _FEATURES]
    found = posterior(surrogate, seen, measured.noise_of(names, noise)).checked()
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
        "notes": [
            f"{len(names)} features of {len(measured.times)} paths, learnt from {len(points)} simulations",
            *_told_of_fit(found.misfit, found.widening),
            *(
                f"{name.removeprefix('c_')} lies at the end of what was swept, "
                f"{end if name == 'friction' else end * 1e3:g}{'' if name == 'friction' else ' mm'}, or beyond: "
                f"it is not told; sweep further"
                for name, end in found.bounds.items()
            ),
        ],
    }


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
    print_table(
        console, table(("", "mean mm", "± mm", "90 % interval mm", "told", *(f"r {one}" for one in names)), rows)
    )
    for note in told["notes"]:
        console.print(note)
