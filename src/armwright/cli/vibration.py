"""``armwright vibration``: natural frequencies, compliance and deflection of an arm with flexible gears."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from armwright.cli.gear_options import Damping, Stiffness, with_gears_of
from armwright.cli.numbers import numbers, within
from armwright.cli.options import ArmName, Configuration, Json, OutputFolder, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, columns_of
from armwright.cli.tool_options import Load, read_payload

# Bounds of the components of a force [N].
_FORCE = (-1e6, 1e6)


def vibration(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    motion: Annotated[Path | None, Argument(help="Table of q, qd and qdd, such as motion.csv, instead of -q.")] = None,
    q: Configuration = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    stiffness: Stiffness = None,
    damping: Damping = None,
    load: Load = None,
    force: Annotated[str | None, Option(help="Force on the tool along base axes: FX,FY,FZ in N.")] = None,
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Print natural frequencies of an arm on the springs of its gears, and how far its tool yields.

    The stiffness of the gears is that of the arm file, or --stiffness. Of a motion the command also prints the
    deflection of the tool by its efforts. With -o it writes report.html, vibration.json and figures (SVG).

    **Example:** `armwright vibration ur5 -q 0,-60,60,-90,-90,0 --stiffness 2e4,2e4,2e4,5e3,5e3,5e3`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values, rows
    from armwright.dynamics.payloads import payload
    from armwright.dynamics.vibration import assess_vibration
    from armwright.report.vibration_files import vibration_files

    model = with_gears_of(load_arm(arm), stiffness, damping)
    if (q is None) == (motion is None):
        raise usage_error("-q", "expected the configurations, either one as -q or a motion as a table")
    if load is not None:
        body = read_payload(load)
        model = payload(model, body.mass, body.com, body.inertia)
    if motion is not None:
        table = TableFile(motion, columns_of(columns), skip_incomplete)
        values = rows(model, table, ("q", "qd", "qdd"))
    else:
        values = [joint_values(model, q or "", "-q")]
    push = [0.0] * 3 if force is None else [within(x, _FORCE, "--force") for x in numbers(force, 3, "--force")]
    assessment = assess_vibration(model, *values, force=push)
    if output is not None:
        write_results(output, vibration_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, output=output)
