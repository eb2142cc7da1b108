"""``armwright deflection``: how far the tool of an arm yields at rest."""

from typing import TYPE_CHECKING, Annotated

from typer import Option

from armwright.cli.gear_options import gear_values
from armwright.cli.numbers import numbers
from armwright.cli.options import ArmName, Configuration, Json, OutputFolder, Rows, usage_error
from armwright.cli.output import command_line, print_result
from armwright.cli.results import write_results
from armwright.cli.tables import ColumnMap, SkipIncomplete, table_file
from armwright.cli.tool_options import Load, read_payload

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array


def deflection(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    q: Configuration = None,
    csv: Rows = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    stiffness: Annotated[
        str | None,
        Option(
            help="Stiffness of the joints: a TOML file about three axes (docs/calibration.md), or numbers about their "
            "own axes in N m/rad and N/m, one for all or one per joint, inf is rigid; that of the gears of the arm "
            "file when left out."
        ),
    ] = None,
    load: Load = None,
    wrench: Annotated[
        str | None,
        Option("--wrench", help="External wrench on the tool along base axes: FX,FY,FZ,MX,MY,MZ in N and N m."),
    ] = None,
    output: OutputFolder = None,
    as_json: Json = False,
) -> None:
    """Print how far the tool of an arm yields at rest by weight and payload, and which joint yields most.

    The configurations are -q or a table (--csv), such as motion.csv. With -o the command writes report.html,
    deflection.json, a figure, and compensated.csv: joint positions with which the tool comes where it is in the rigid
    arm.

    **Example:** `armwright deflection puma560 --stiffness 4e4,3e4,2e4,6e3,5e3,4e3 -q 10,-20,30,0,40,0 --load 2,0,0,60`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values, rows
    from armwright.dynamics.deflection_assessment import assess_deflection
    from armwright.report.deflection_files import deflection_files

    model = load_arm(arm)
    table = table_file(csv, columns, skip_incomplete=skip_incomplete)
    if (q is None) == (table is None):
        raise usage_error("-q", "expected the configurations, either one as -q or a table of them as --csv FILE")
    configurations = rows(model, table, ("q",))[0] if table is not None else joint_values(model, q or "", "-q")
    body = None if load is None else read_payload(load)
    assessment = assess_deflection(
        model,
        _compliance(model, stiffness),
        configurations,
        payload=None if body is None else (body.mass, *body.com),
        wrench=None if wrench is None else numbers(wrench, 6, "--wrench"),
    )
    if output is not None:
        write_results(output, deflection_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, output=output)


def _compliance(arm: "Arm", text: str | None) -> "Array":
    """Return the compliance (n, 3) of the joints of an arm."""
    import numpy as np

    from armwright.arm.load import is_path
    from armwright.dynamics.stiffness_file import read_stiffness

    if text is not None and is_path(text):
        return read_stiffness(text, arm)
    gears = arm.motor_values("stiffness") if text is None else np.array(gear_values(text, arm.n, "--stiffness"))
    if np.all(np.isinf(gears)):
        raise usage_error("--stiffness", f"expected a stiffness: the gears of {arm.name} are rigid")
    compliance = np.zeros((arm.n, 3))
    compliance[:, 2] = 1 / gears
    return compliance
