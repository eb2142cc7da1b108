"""``armwright vibration``: natural frequencies, compliance and deflection of an arm with flexible gears."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from armwright.cli.numbers import numbers, within
from armwright.cli.options import ArmName, Configuration, Json, OutputFolder, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, columns_of
from armwright.cli.tool_options import Load, read_payload

if TYPE_CHECKING:
    from armwright.arm.model import Arm

Stiffness = Annotated[
    str | None,
    Option(help="Stiffness of the gears in N m/rad and N/m, one for all or one per joint; inf is rigid."),
]
Damping = Annotated[
    str | None, Option(help="Damping of the gears in N m s/rad and N s/m, one for all or one per joint.")
]

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


def with_gears_of(arm: "Arm", stiffness: str | None, damping: str | None) -> "Arm":
    """Return an arm with the gears that options describe; of those that are left out, with its own."""
    from armwright.dynamics.flexible_joints import with_gears

    if stiffness is None and damping is None:
        return arm
    values = []
    for name, text in (("stiffness", stiffness), ("damping", damping)):
        values.append(arm.motor_values(name).tolist() if text is None else _gears(text, arm.n, f"--{name}"))
    return with_gears(arm, *values)


def _gears(text: str, n: int, option: str) -> list[float]:
    """Read one number for all gears, or one for each; ``inf`` is a rigid gear."""
    from armwright.arm.drive import STIFFNESS

    words = text.replace(",", " ").split()
    if len(words) not in (1, n):
        raise usage_error(option, f"expected one number, or {n}, one per joint, got {len(words)}")
    bounds = STIFFNESS if option == "--stiffness" else (0.0, STIFFNESS[1])
    values = [
        float("inf")
        if word == "inf" and option == "--stiffness"
        else within(numbers(word, 1, option)[0], bounds, option)
        for word in words
    ]
    return values * (n if len(values) == 1 else 1)
