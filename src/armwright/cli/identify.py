"""``armwright identify``: identify masses, inertias and friction of an arm from logs of its motions."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Argument, Option

from armwright.cli.options import ArmName, Json, OutputFolder, Quiet, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import waiting
from armwright.cli.results import warn_of_stray, write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, columns_of
from armwright.cli.tool_options import Load, read_payload

if TYPE_CHECKING:
    from armwright.arm.model import Arm, Link
    from armwright.arrays import Array
    from armwright.identification.log import Log


def identify(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    logs: Annotated[
        list[Path],
        Argument(help="Logs of positions and efforts or currents: CSV, MCAP, .db3 or bags (docs/identification.md)."),
    ],
    check: Annotated[
        list[Path] | None, Option("--check", help="Log that is held out, to validate with; may be repeated.")
    ] = None,
    hold_out: Annotated[
        Literal["none", "blocks", "last"],
        Option(help="Hold out a quarter of every log to validate with: blocks in time, or its end."),
    ] = "none",
    gains: Annotated[
        str | None, Option(help="Effort at each joint per ampere, as in 14.9,13.3,11.1,10.6,11.0,11.5.")
    ] = None,
    loaded: Annotated[
        list[Path] | None,
        Option("--loaded", help="Log of currents with a known load (--load), from which the gains are found."),
    ] = None,
    load: Load = None,
    load_mass: Annotated[
        float | None, Option("--load-mass", help="Mass in kg of the known load, where no more is known of it.")
    ] = None,
    payload: Annotated[
        bool, Option("--payload", help="Identify the load on a known arm alone, in the tool frame.")
    ] = False,
    cutoff_hz: Annotated[
        float | None, Option("--cutoff-hz", min=0.01, help="Cut-off of the filter; chosen when left out.")
    ] = None,
    folds: Annotated[int, Option(min=2, max=50, help="Folds by which filter, friction and prior are chosen.")] = 5,
    topic: Annotated[str | None, Option(help="Topic of the joint states in MCAP files and bags.")] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Identify masses, inertias and friction of an arm from logs of its motions.

    The command chooses the filter, the law of friction and the weight of the drawing by held-out blocks, fits the base
    parameters with their errors, and finds the links nearest to the drawing that bodies can be (extra
    `identification`). It prints held-out errors, what is hardly known and which motion would tell. With -o it writes
    the arm (TOML, URDF), all numbers, a report and figures.

    **Example:** `armwright identify puma560 examples/puma_log.csv --hold-out blocks -o out/identified`
    """
    from armwright.arm.load import load_arm
    from armwright.arrays import one_core
    from armwright.export.conventions import find_convention
    from armwright.identification.identify import hold_out as held_out, identify as identified
    from armwright.identification.payload import identify_payload
    from armwright.identification.reading import read_logs
    from armwright.report.identification_files import identification_files, payload_files

    model = load_arm(arm)
    scale = _gains(model, gains)
    convention = find_convention(model, None)
    read = partial(
        read_logs,
        arm=model,
        columns=columns_of(columns),
        skip_incomplete=skip_incomplete,
        topic=topic,
        joint_names=convention.ros_joints if convention is not None and len(convention.ros_joints) == model.n else (),
    )
    for path in (*logs, *(check or ()), *(loaded or ())):
        warn_of_stray(path)
    if loaded:
        currents, with_load = (read(paths, gains=[1.0] * model.n) for paths in (logs, loaded))
        known = _known_load(load, load_mass)
        scale = _found_gains(model, currents, with_load, known, mass_alone=load_mass is not None)
    readings = read(logs, gains=scale)
    validation = read(check, gains=scale) if check else []
    title = f"{model.name}, {', '.join(path.name for path in logs)}"
    with waiting("identifying", quiet=quiet or as_json) as progress, one_core():
        if payload:
            load_found = identify_payload(model, readings)
        else:
            if hold_out != "none":
                parts = [held_out(log, hold_out) for log in readings]
                readings = [log for kept, _ in parts for log in kept]
                validation += [log for _, held in parts for log in held]
            found = identified(model, readings, check=validation, cutoff=cutoff_hz, folds=folds, progress=progress)
    if payload:
        if output is not None:
            write_results(output, payload_files(load_found))
        print_result(load_found, as_json=as_json, quiet=quiet, output=output, file="payload.json")
        return
    if output is not None:
        write_results(output, identification_files(found, title=title, command=command_line()))
    print_result(found, as_json=as_json, quiet=quiet, output=output)


def _gains(model: "Arm", text: str | None) -> "list[float] | Array | None":
    from armwright.cli.numbers import numbers

    return None if text is None else numbers(text, model.n, "--gains")


def _known_load(load: str | None, mass: float | None) -> "Link":
    from armwright.arm.model import Link

    if (load is None) == (mass is None):
        raise usage_error("--loaded", "expected the known load: --load MASS,X,Y,Z or --load-mass KG, and one of them")
    return read_payload(load) if load is not None else Link(mass=mass or 0.0)


def _found_gains(
    model: "Arm", unloaded: "list[Log]", loaded: "list[Log]", load: "Link", *, mass_alone: bool
) -> "Array":
    """Return the gains that follow from a known load, and print them."""
    import sys

    from armwright.identification.gains import drive_gains
    from armwright.identification.model import DynamicModel

    found = drive_gains(DynamicModel(arm=model), unloaded, loaded, load, mass_alone=mass_alone)
    told = ", ".join(f"{x:.4g} ± {error:.2g}" for x, error in zip(found.values, found.errors, strict=True))
    print(f"armwright: gains by the known load, effort per ampere: {told}", file=sys.stderr)
    return found.values
