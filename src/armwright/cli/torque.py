"""``armwright torque``: the efforts of a motion, by cause."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from armwright.cli.options import ArmName, Configuration, Json, usage_error
from armwright.cli.output import print_json_rows
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, table_file
from armwright.cli.tool_options import Load, read_payload

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array
    from armwright.dynamics.equation_of_motion import Terms

# Rows of a table that are computed together: many for speed, but not all of a long table.
_BLOCK = 1000


def torque(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    q: Configuration = None,
    qd: Annotated[str | None, Option(help="Joint velocities in degrees/s and mm/s; the default is 0.")] = None,
    qdd: Annotated[str | None, Option(help="Joint accelerations in degrees/s² and mm/s²; the default is 0.")] = None,
    csv: Annotated[Path | None, Option("--csv", help="Table of q, qd and qdd, such as motion.csv.")] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    load: Load = None,
    wrench: Annotated[
        str | None,
        Option("--wrench", help="External wrench on the tool along base axes: FX,FY,FZ,MX,MY,MZ in N and N m."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the efforts of a motion, in total and by cause, as the report's main program did.

    Efforts are torques in N m, or forces in N for prismatic joints, positive in the direction of the joint.

    **Example:** `armwright torque stanford-jpl -q 0,90,500,0,45,0 --qdd 60,0,0,0,0,0 --load 1.8,0,0,50`
    """
    from armwright.arm.load import load_arm
    from armwright.arm.model import Link
    from armwright.cli.numbers import numbers
    from armwright.dynamics.equation_of_motion import terms

    model = load_arm(arm)
    if model.massless:
        print(f"armwright: note: {model.name} has no masses: its own efforts are zero below", file=sys.stderr)
    body = Link() if load is None else read_payload(load)
    tool_wrench = None if wrench is None else numbers(wrench, 6, "--wrench")
    motion = _motion(model, (q, qd, qdd), table_file(csv, columns, skip_incomplete=skip_incomplete))
    blocks = ([values[first : first + _BLOCK] for values in motion] for first in range(0, len(motion[0]), _BLOCK))
    causes = (_causes(model, terms(model, *block, load=body, wrench=tool_wrench)) for block in blocks)
    rows = (
        {name: values[row].tolist() for name, values in block.items()}
        for block in causes
        for row in range(len(block["total"]))
    )
    if as_json:
        print_json_rows(({"total": efforts.pop("total"), **efforts} for efforts in rows), as_list=csv is not None)
        return
    for efforts in rows:
        _print(model, efforts)


def _motion(model: "Arm", values: tuple[str | None, str | None, str | None], file: TableFile | None) -> "list[Array]":
    from armwright.cli.joints import joint_values, rows

    q, qd, qdd = values
    if (q is None) == (file is None):
        raise usage_error("-q", "expected the motion, either as -q, --qd and --qdd or as --csv FILE")
    if file is not None:
        if qd is not None or qdd is not None:
            raise usage_error(
                "--csv", "expected no --qd and --qdd with a table, which has its own velocities and accelerations"
            )
        return rows(model, file, ("q", "qd", "qdd"))
    still = ",".join(["0"] * model.n)
    texts = (("-q", q), ("--qd", qd), ("--qdd", qdd))
    return [joint_values(model, still if text is None else text, option)[None] for option, text in texts]


def _causes(model: "Arm", terms: "Terms") -> "dict[str, Array]":
    """Return the terms of each joint, (rows, n), as sums over the other joints."""
    # Few arms have more than Coulomb friction.
    others = {"dry friction" if model.motor_values("stribeck").any() else "Coulomb friction": terms.dry}
    if model.motor_values("offset").any() or model.motor_values("cube_root").any():
        others["other friction"] = terms.smooth
    if any(joint.spring.stiffness for joint in model.joints):
        others["springs"] = terms.spring
    drives = {} if model.coupling is None else {"of the drives": model.coupling.drive_efforts(terms.total)}
    return {
        "own inertia": terms.own,
        "coupling": terms.coupling.sum(axis=-1),
        "motor inertia": terms.motor,
        "centrifugal": terms.centrifugal.sum(axis=-1),
        "Coriolis": terms.coriolis.sum(axis=(-2, -1)),
        "gravity": terms.gravity,
        "viscous friction": terms.viscous,
        **others,
        "load": terms.load,
        "wrench": terms.outside,
        "total": terms.total,
        **drives,
    }


def _print(model: "Arm", efforts: dict[str, list[float]]) -> None:
    names = [f"joint {i + 1}, {joint.units.effort}" for i, joint in enumerate(model.joints)]
    width = max(map(len, names)) + 2
    print(f"{'':<18}" + "".join(f"{name:>{width}}" for name in names))
    for cause, values in efforts.items():
        print(f"{cause:<18}" + "".join(f"{round(value, 4) + 0.0:>{width}.4f}" for value in values))
