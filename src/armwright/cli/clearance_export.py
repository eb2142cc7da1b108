"""``armwright clearance export``: a linkage as a model of another simulator."""

from pathlib import Path
from typing import Annotated, Literal

from typer import Option

from armwright.cli.linkages import Clearances, LinkageName, SpeedRpm, TipPathName, path_of, with_clearances
from armwright.cli.options import usage_error
from armwright.cli.results import write_results


def export(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    output: Annotated[Path, Option("-o", "--output", help="Folder for the script and its data.")],
    path: TipPathName = None,
    speed_rpm: SpeedRpm = None,
    revolutions: Annotated[float, Option(help="Number of revolutions of the drive.")] = 1.0,
    clearance: Clearances = None,
    format: Annotated[  # noqa: A002 - named like the option
        Literal["exudyn", "mjcf"], Option("--format", help="Of Exudyn, with clearance, or of MuJoCo, without.")
    ] = "exudyn",
    step: Annotated[float, Option(help="Step of both simulations, in s.")] = 1e-5,
) -> None:
    """Write a linkage and its path as a model of an independent simulator, and a script that runs as it is.

    exudyn: with clearance, for Exudyn (`pip install exudyn`): run_linkage.py, its data, and the tip as armwright
    simulates it.

    mjcf: with closed pins, for MuJoCo (`pip install mujoco`): linkage.xml, the efforts of its drives, the tip as the
    linkage without clearance moves it, and run_linkage.py.

    Each script prints how far both tips are apart.

    **Example:** `armwright clearance export five-bar --path y1 -o out/exudyn`

    **Example:** `armwright clearance export slider-crank --speed-rpm 300 --format mjcf -o out/mjcf`
    """
    from armwright.clearance.exudyn.export import IMPACT_LAW, exudyn_files
    from armwright.clearance.mjcf.export import mjcf_files
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.scenario import prepare_scenario
    from armwright.clearance.settings import Settings

    if format == "mjcf" and clearance:
        raise usage_error("--clearance", "expected none with --format mjcf, where all pins are closed")
    model = with_clearances(load_linkage(linkage), clearance or [])
    way = path_of(model, path, speed_rpm, revolutions)
    settings = Settings(step=step, sample=max(step, min(1e-3, way.duration / 100)), impact=IMPACT_LAW)
    files = mjcf_files if format == "mjcf" else exudyn_files
    write_results(output, files(prepare_scenario(model, way, settings)))
    print(f"script: {output / 'run_linkage.py'}")
