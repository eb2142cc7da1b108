"""``armwright singularity``: how near a posture is to one, and what it costs."""

from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json

if TYPE_CHECKING:
    from armwright.arrays import Array


def singularity(
    arm: ArmName,
    configuration: Annotated[str, typer.Option("-q", help="Joint positions in degrees and mm: 10,20,30.")],
    as_json: Json = False,
) -> None:
    """Print the factors of the Jacobian's determinant, which are near zero, and what the hand cannot do there.

    **Example:** `armwright singularity puma560 -q 10,20,30,40,0,50`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.kinematics.singularity_analysis import singularities

    model = load_arm(arm)
    found = singularities(model, joint_values(model, configuration, "-q"))
    if as_json:
        factors = {one.name: {"value": one.value, "scale": one.scale, "near": one.near} for one in found.factors}
        lists = {"singular_values": found.singular_values, "lost": found.lost, "idle": found.idle}
        print_json({"factors": factors, **{name: values.tolist() for name, values in lists.items()}})
        return
    print(f"singular: {', '.join(found.near)}" if found.singular else "not singular")
    for one in found.factors:
        print(f"  {one.name:<18}{one.value:z12.6f}  of {one.scale:.4g}{'  near zero' if one.near else ''}")
    for title, rows in (
        ("the hand cannot make vx vy vz wx wy wz", found.lost),
        ("joints move for nothing", found.idle),
    ):
        if len(rows):
            print(title)
            for row in rows:
                print("  " + _row(row))


def _row(values: "Array") -> str:
    return "  ".join(f"{x:z8.4f}" for x in values)
