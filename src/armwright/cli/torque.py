"""``armwright torque``: what a motion takes, and why."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.load import Load
from armwright.cli.options import ArmName, Json
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, table_file

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array
    from armwright.dynamics.equation_of_motion import Terms

# Rows of a file that are worked out at once: many, as that takes no longer than one, but not all of a long file.
_BLOCK = 1000


def torque(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    q: Annotated[str | None, typer.Option("-q", help="Joint positions in degrees and mm: 10,20,30.")] = None,
    qd: Annotated[str | None, typer.Option(help="Joint speeds in degrees/s and mm/s; 0 when left out.")] = None,
    qdd: Annotated[str | None, typer.Option(help="Joint accelerations in degrees/s² and mm/s²; likewise.")] = None,
    csv: Annotated[Path | None, typer.Option("--csv", help="Table of q, qd and qdd, such as motion.csv.")] = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    load: Load = None,
    wrench: Annotated[
        str | None,
        typer.Option(
            "--wrench",
            help="Force and moment on the tool from outside, along base axes: FX,FY,FZ,MX,MY,MZ in N and N m.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the efforts of a motion, in all and by cause, as the report's main program did.

    Torques in N m, forces of slides in N, positive in the direction of the joint.

    **Example:** `armwright torque stanford-jpl -q 0,90,500,0,45,0 --qdd 60,0,0,0,0,0 --load 1.8,0,0,50`
    """
    import json

    from armwright.arm.load import load_arm
    from armwright.arm.model import Link
    from armwright.cli.load import load_in_hand
    from armwright.cli.numbers import numbers
    from armwright.dynamics.equation_of_motion import terms

    model = load_arm(arm)
    held = Link() if load is None else load_in_hand(load)
    push = None if wrench is None else numbers(wrench, 6, "--wrench")
    motion = _motion(model, (q, qd, qdd), table_file(csv, columns, skip_incomplete=skip_incomplete))
    for first in range(0, len(motion[0]), _BLOCK):
        found = terms(model, *(values[first : first + _BLOCK] for values in motion), load=held, wrench=push)
        causes = _causes(found)
        for row in range(len(found.total)):
            efforts = {name: values[row].tolist() for name, values in causes.items()}
            if as_json:
                print(json.dumps({"total": efforts.pop("total"), **efforts}))
            else:
                _print(model, efforts)


def _motion(model: "Arm", values: tuple[str | None, str | None, str | None], file: TableFile | None) -> "list[Array]":
    from armwright.cli.joints import joint_values, rows

    q, qd, qdd = values
    if (q is None) == (file is None):
        raise typer.BadParameter("give the motion, either as -q, --qd and --qdd or as --csv FILE", param_hint="-q")
    if file is not None:
        if qd is not None or qdd is not None:
            raise typer.BadParameter("a file has its own speeds and accelerations", param_hint="--csv")
        return rows(model, file, ("q", "qd", "qdd"))
    still = ",".join(["0"] * model.n)
    texts = (("-q", q), ("--qd", qd), ("--qdd", qdd))
    return [joint_values(model, still if text is None else text, option)[None] for option, text in texts]


def _causes(found: "Terms") -> "dict[str, Array]":
    """Return the terms joint by joint, (rows, n) each, sums over the other joints taken."""
    return {
        "own inertia": found.own,
        "coupling": found.coupling.sum(axis=-1),
        "motor inertia": found.motor,
        "centrifugal": found.centrifugal.sum(axis=-1),
        "Coriolis": found.coriolis.sum(axis=(-2, -1)),
        "gravity": found.gravity,
        "viscous friction": found.viscous,
        "dry friction": found.dry,
        "load": found.load,
        "wrench": found.outside,
        "total": found.total,
    }


def _print(model: "Arm", efforts: dict[str, list[float]]) -> None:
    names = [f"joint {i + 1}, {'N m' if joint.revolute else 'N'}" for i, joint in enumerate(model.joints)]
    width = max(map(len, names)) + 2
    print(f"{'':<18}" + "".join(f"{name:>{width}}" for name in names))
    for cause, values in efforts.items():
        print(f"{cause:<18}" + "".join(f"{round(value, 4) + 0.0:>{width}.4f}" for value in values))
