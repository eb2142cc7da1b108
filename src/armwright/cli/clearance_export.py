"""``armwright clearance export``: a linkage with clearance as a model of another simulator."""

from pathlib import Path
from typing import Annotated

from typer import Option

from armwright.cli.linkages import LinkageName, path_of, with_clearances
from armwright.cli.results import write_results
from armwright.cli.shell_completion import paths


def export(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    output: Annotated[Path, Option("-o", "--output", help="Folder for the script and its data.")],
    path: Annotated[
        str | None,
        Option(help="Path for the tip: x1 to x10, y1 to y14, or pick-and-place.", autocompletion=paths),
    ] = None,
    speed_rpm: Annotated[float | None, Option(help="Speed of a linkage with one drive, in rev/min.")] = None,
    revolutions: Annotated[float, Option(help="Number of revolutions of the drive.")] = 1.0,
    clearance: Annotated[
        list[str] | None, Option(help="Radial clearance of a pin in mm, as in J2=0.3; may be repeated.")
    ] = None,
    step: Annotated[float, Option(help="Step of both simulations, in s.")] = 1e-5,
) -> None:
    """Write a linkage with clearance and its path as a script of Exudyn, an independent simulator.

    The folder has run_linkage.py, which runs as it is where Exudyn is installed (`pip install exudyn`), its data, and
    the tip as armwright simulates it; the script prints how far both are apart.

    **Example:** `armwright clearance export five-bar --path y1 -o out/exudyn`
    """
    from armwright.clearance.exudyn.export import IMPACT_LAW, exudyn_files
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.scenario import prepare_scenario
    from armwright.clearance.settings import Settings

    model = with_clearances(load_linkage(linkage), clearance or [])
    way = path_of(model, path, speed_rpm, revolutions)
    settings = Settings(step=step, sample=max(step, min(1e-3, way.duration / 100)), impact=IMPACT_LAW)
    write_results(output, exudyn_files(prepare_scenario(model, way, settings)))
    print(f"script: {output / 'run_linkage.py'}")
