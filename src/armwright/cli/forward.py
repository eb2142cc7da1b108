"""``armwright forward`` and ``armwright jacobian``: the pose of the tool and its velocity per joint velocity."""

from typing import TYPE_CHECKING, Annotated, Literal

from typer import Option

from armwright.cli.options import ArmName, Configuration, Json, Rows, usage_error
from armwright.cli.output import print_json_rows
from armwright.cli.tables import ColumnMap, SkipIncomplete, TableFile, table_file

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array


def forward(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    configuration: Configuration = None,
    csv: Rows = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    as_json: Json = False,
) -> None:
    """Print the tool pose for joint positions.

    **Example:** `armwright forward puma560 -q 10,20,30,40,50,60`
    """
    from armwright.arm.load import load_arm
    from armwright.kinematics.forward_kinematics import forward as tool_pose
    from armwright.spatial.poses import to_noap

    model = load_arm(arm)
    rows = configurations(model, configuration, table_file(csv, columns, skip_incomplete=skip_incomplete))
    poses = ((q, tool_pose(model, q)) for q in rows)
    if as_json:
        data = ({"q": q.tolist(), "pose": X.tolist(), "noap": to_noap(X).tolist()} for q, X in poses)
        print_json_rows(data, as_list=csv is not None)
        return
    for _, X in poses:
        print("  ".join(f"{name:>10}" for name in ("n", "o", "a")), f"  {'p mm':>12}")
        for *rotation, position in X[:3].tolist():
            numbers = "  ".join(f"{round(x, 6) + 0.0:10.6f}" for x in rotation)
            print(numbers, f"  {round(position * 1e3, 3) + 0.0:12.3f}")


def jacobian(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    configuration: Configuration = None,
    csv: Rows = None,
    columns: ColumnMap = None,
    skip_incomplete: SkipIncomplete = False,
    frame: Annotated[Literal["base", "tool"], Option(help="Frame of the rows: base or tool.")] = "base",
    as_json: Json = False,
) -> None:
    """Print the Jacobian of the tool point: three linear rows, then three angular, in SI units and radians.

    **Example:** `armwright jacobian stanford -q 0,90,500,0,45,0 --frame tool`
    """
    from armwright.arm.load import load_arm
    from armwright.kinematics.jacobians import jacobian as tool_jacobian

    model = load_arm(arm)
    rows = configurations(model, configuration, table_file(csv, columns, skip_incomplete=skip_incomplete))
    jacobians = ((q, tool_jacobian(model, q, frame)) for q in rows)
    if as_json:
        data = ({"q": q.tolist(), "frame": frame, "jacobian": J.tolist()} for q, J in jacobians)
        print_json_rows(data, as_list=csv is not None)
        return
    heads = (f"j{i} {joint.units.position}/s" for i, joint in enumerate(model.joints, 1))
    head = "  ".join(f"{name:>10}" for name in heads)
    for _, J in jacobians:
        print("  ", head)
        for name, row in zip(("vx", "vy", "vz", "wx", "wy", "wz"), J, strict=True):
            print(name, "  ".join(f"{round(x, 6) + 0.0:10.6f}" for x in row.tolist()))


def configurations(model: "Arm", configuration: str | None, file: TableFile | None) -> "list[Array]":
    """Return the joint configurations of the option or of the rows of a file."""
    from armwright.cli.joints import joint_values, rows

    if (configuration is None) == (file is None):
        raise usage_error("-q", "expected joint positions, either here or as --csv FILE")
    if file is not None:
        return list(rows(model, file, ("q",))[0])
    assert configuration is not None  # noqa: S101 - without a file there is the option
    return [joint_values(model, configuration, "-q")]
