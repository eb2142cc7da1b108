"""``armwright singularity``: how near a joint configuration is to a singularity, and its effects."""

from typing import Annotated

from typer import Option

from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json


def singularity(
    arm: ArmName,
    configuration: Annotated[str, Option("-q", help="Joint positions in degrees and mm, as in 10,20,30.")],
    as_json: Json = False,
) -> None:
    """Print the factors of the Jacobian's determinant, those near zero, and the lost directions of the tool.

    **Example:** `armwright singularity puma560 -q 10,20,30,40,0,50`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.kinematics.singularity_analysis import singularities

    model = load_arm(arm)
    analysis = singularities(model, joint_values(model, configuration, "-q"))
    if as_json:
        factors = {f.name: {"value": f.value, "scale": f.scale, "near": f.near} for f in analysis.factors}
        lists = {"singular_values": analysis.singular_values, "lost": analysis.lost, "idle": analysis.idle}
        print_json({"factors": factors, **{name: values.tolist() for name, values in lists.items()}})
        return
    print(f"singular: {', '.join(analysis.near)}" if analysis.singular else "not singular")
    for f in analysis.factors:
        print(f"  {f.name:<18}{f.value:z12.6f}  of {f.scale:.4g}{'  near zero' if f.near else ''}")
    for title, rows in (
        ("tool velocities that cannot be produced, vx vy vz wx wy wz", analysis.lost),
        ("joint velocities without motion of the tool", analysis.idle),
    ):
        if len(rows):
            print(title)
            for row in rows:
                print("  " + "  ".join(f"{x:z8.4f}" for x in row))
