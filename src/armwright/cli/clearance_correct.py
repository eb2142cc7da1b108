"""``armwright clearance correct``: a path told so that the tip comes to the right places in spite of play."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.linkages import FrictionVelocity, LinkageName, Threshold, settings_of, with_clearances
from armwright.cli.options import JsonSummary, Quiet
from armwright.cli.output import json_text, plain_console, print_json, print_table, table
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.shell_completion import paths

if TYPE_CHECKING:
    from armwright.arrays import Array
    from armwright.clearance.correction import Correction
    from armwright.clearance.linkage import Linkage
    from armwright.clearance.simulation import Simulation

# So many linkages stand for what is known of one; the least play of any [m].
_DRAWS, _SMALLEST = 32, 1e-6
# No clearance, and no coefficient of friction, is larger; more is in another unit, or of another file.
_LARGEST = 10.0


def correct(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    path: Annotated[
        str, typer.Option(help="pick-and-place, or a test path x1 to x10, y1 to y14.", autocompletion=paths)
    ] = "pick-and-place",
    clearance: Annotated[
        list[str] | None,
        typer.Option(help="Of one pin in mm, as estimated: J2=0.34; may be repeated.", show_default=False),
    ] = None,
    estimate: Annotated[
        Path | None,
        typer.Option(help="What `clearance estimate --json` printed: then the mean error over what is known goes."),
    ] = None,
    knots: Annotated[int, typer.Option(help="Places at which a whole path is moved, at most 1000.")] = 20,
    rounds: Annotated[int, typer.Option(help="How often the path is moved, at most 100 times.")] = 3,
    friction_velocity: FrictionVelocity = "surface",
    threshold_mm_s: Threshold = 1.0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for path.csv, summary.json and paths.svg.")
    ] = None,
    as_json: JsonSummary = False,
    quiet: Quiet = False,
) -> None:
    """Move a path against the error that play makes, until the tip comes to where it is wanted.

    Of pick-and-place the three nodes are moved; of another path the whole, smoothly. Each round simulates sixteen runs
    that nobody can tell apart, or 32 of an estimate, and takes their mean error away; the path of the best round is
    told, and what is left of the error with its spread over the runs.

    **Example:** `armwright clearance correct five-bar --clearance J2=0.328 --clearance J3=0.171 --clearance J4=0.483`
    """
    import numpy as np

    from armwright.clearance.correction import correct_nodes, correct_path
    from armwright.clearance.paths import PICK_AND_PLACE, PickAndPlace, named_path
    from armwright.clearance.predictability import with_outlook
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.scenario import prepare
    from armwright.clearance.simulation import simulate

    model = with_clearances(load_linkage(linkage), clearance or [])
    settings = settings_of(friction_velocity, threshold_mm_s)
    if estimate is not None and clearance:
        raise typer.BadParameter("the clearances are either given or those of --estimate", param_hint="--clearance")
    clearances = np.array(list(model.clearances.values())) if estimate is None else _drawn(model, estimate)

    def told(mean: float) -> None:
        if not (quiet or as_json):
            print(f"mean error {mean * 1e3:.5f} mm")

    if path == PICK_AND_PLACE:
        found = correct_nodes(model, PickAndPlace(), clearances, settings, rounds=rounds, progress=told)
    else:
        found = correct_path(model, named_path(path), clearances, settings, knots=knots, rounds=rounds, progress=told)
    summary = _summary(model, path, found, clearances)
    usual = np.array(list(summary["clearances"].values()))
    run, outlook = with_outlook(prepare(model, found.path, settings), usual)
    summary["predictable_until"] = outlook.until
    if output is not None:
        before = simulate(prepare(model, named_path(path), settings), usual)
        write_results(output, _files(model, path, {"path as it is": before, "path corrected": run}, summary))
    if as_json:
        print_json(summary)
    elif not quiet:
        _print(summary)
        if output is not None:
            print(f"path: {output / 'path.csv'}")


def _summary(model: "Linkage", path: str, found: "Correction", clearances: "Array") -> dict[str, Any]:
    import numpy as np

    usual = np.atleast_2d(clearances).mean(axis=0)
    return {
        "linkage": model.name,
        "path": path,
        "clearances": dict(zip(model.clearances, usual.tolist(), strict=True)),
        "times": list(found.path.targets),
        "nodes": found.nodes.tolist(),
        "before": found.before.mean(axis=0).tolist(),
        "before_spread": found.before.std(axis=0, ddof=1).tolist(),
        "after": found.after.mean(axis=0).tolist(),
        "after_spread": found.after.std(axis=0, ddof=1).tolist(),
        "runs": len(found.after),
        "of": "with clearances drawn from the estimate"
        if clearances.ndim > 1
        else "whose clearances nobody can tell apart",
        "mean errors": list(found.history),
        "round": found.best,
    }


def _drawn(model: "Linkage", estimate: Path) -> "Array":
    """Return (32, p) clearances drawn from an estimate.

    Raises:
        FileFormatError: the file is not what `clearance estimate --json` prints, or of another linkage.
        ContradictionError: what was measured contradicts the model.
        TooFewError: a clearance is not identified.
    """
    import json

    import numpy as np

    from armwright.clearance.estimation.misfit import refuse_contradiction
    from armwright.errors import FileFormatError, TooFewError
    from armwright.files.inputs import read_text

    warn_of_stray(estimate)
    text = read_text(estimate)
    try:
        told = json.loads(text)
        misfit, told_of = float(told["misfit"]), {key: one["identifiable"] for key, one in told["parameters"].items()}
        parameters, correlation = told["parameters"], np.array(told["correlation"], dtype=np.float64)
        mean, deviation = (np.array([one[key] for one in parameters.values()]) for key in ("mean", "deviation"))
        names = list(parameters)
        picked = [names.index(name) for name in model.clearances]
        _refuse_impossible(np.array([mean, deviation]))
        covariance = correlation * np.outer(deviation, deviation)
        drawn = np.random.default_rng(0).multivariate_normal(mean, covariance, _DRAWS, check_valid="raise")[:, picked]
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError, np.linalg.LinAlgError) as error:
        text = f"expected what `armwright clearance estimate --json` prints for {model.name}"
        raise FileFormatError(estimate, None, "", text) from error
    refuse_contradiction(misfit, [], [])
    unknown = [name for name in model.clearances if not told_of[name]]
    if unknown:
        raise TooFewError(
            f"{estimate}: the measurement does not tell {', '.join(unknown)}; a path cannot be corrected for what is "
            f"not known: measure more poses or paths, or give --clearance"
        )
    # Contact needs some play.
    return np.maximum(drawn, _SMALLEST)


def _refuse_impossible(numbers: "Array") -> None:
    """Refuse numbers that no clearance and no coefficient of friction has; what is NaN is none, either.

    Raises:
        ValueError: there are such.
    """
    if not (abs(numbers) <= _LARGEST).all():
        raise ValueError


def _files(
    model: "Linkage", name: str, runs: dict[str, "Simulation"], summary: dict[str, Any]
) -> dict[str, str | bytes]:
    """Return by name what is written: the path of the last run, the numbers, and a figure of what all runs took."""
    import numpy as np

    from armwright.clearance.paths import named_path
    from armwright.report.clearance_figures import paths

    path = list(runs.values())[-1].scenario.path
    times = np.linspace(0.0, path.duration, 1001)
    told, wanted = path.at(times), named_path(name)
    rows = np.column_stack([times, told.at * 1e3, told.velocity * 1e3, told.acceleration * 1e3])
    head = "t_s,x_mm,y_mm,vx_mm_per_s,vy_mm_per_s,ax_mm_per_s2,ay_mm_per_s2"
    text = "\n".join([head, *(",".join(f"{x:z.9g}" for x in row) for row in rows)]) + "\n"
    line = wanted.at(times).at * 1e3
    panels = {title: {"wanted": line, "taken": run.tip * 1e3} for title, run in runs.items()}
    targets = wanted.at(np.array(wanted.targets)).at * 1e3
    return {
        "path.csv": text,
        "summary.json": json_text(summary) + "\n",
        "paths.svg": paths(f"{model.name}, {name}: with play", panels, targets),
    }


def _print(summary: dict[str, Any]) -> None:
    columns = (summary[name] for name in ("before", "before_spread", "after", "after_spread"))
    rows = (
        (f"{t:.4g}", *(f"{x * 1e3:z.4f}" for x in node), *(f"{x * 1e3:.4f}" for x in errors))
        for t, node, *errors in zip(summary["times"], summary["nodes"], *columns, strict=True)
    )
    heads = ("at s", "told x mm", "y mm", "error before mm", "± mm", "after mm", "± mm")
    print_table(plain_console(), table(heads, rows, words=()))
    print(f"errors are means over {summary['runs']} runs {summary['of']}, ± their standard deviation")
    late = [t for t in summary["times"] if t > summary["predictable_until"] + 1e-9]
    if late:
        print(
            f"predictable until t = {summary['predictable_until']:.4g} s: at the {len(late)} later times the mean "
            f"error over these runs is corrected, and a single run is off by their spread"
        )
