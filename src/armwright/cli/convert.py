"""``armwright convert``: convert an arm from one file format to another, or an assembly to frames."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from armwright.cli.options import ArmName, Json, usage_error
from armwright.cli.output import print_json
from armwright.cli.package_option import Packages, package_folders
from armwright.errors import counted

if TYPE_CHECKING:
    from armwright.arm.model import Arm


def convert(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    output: Annotated[Path, Option("-o", "--output", help="File to write: .urdf, or .toml for an arm file.")],
    base: Annotated[str | None, Option(help="Base link of a URDF file.")] = None,
    tip: Annotated[str | None, Option(help="Tool link of a URDF file.")] = None,
    lock: Annotated[
        str | None,
        Option(help="Joints of a URDF file to lock, at 0 or a position in degrees or mm, as in J1,J2=30."),
    ] = None,
    package: Packages = None,
    as_json: Json = False,
) -> None:
    """Write an arm as URDF or as an arm file, and report what the format cannot represent.

    Of an assembly in STEP or glTF, write the frames of its named components, for IMPORT.

    **Example:** `armwright convert puma560 -o puma560.urdf`
    """
    from armwright.cell.assembly import is_assembly

    if is_assembly(Path(arm)):
        from armwright.cli.convert_assembly import convert_assembly

        convert_assembly(Path(arm), output, as_json=as_json)
        return
    from armwright.arm.urdf.writer import lost_in_urdf, urdf_text
    from armwright.arm.write import toml_text
    from armwright.files.output import write_file

    kind = output.suffix.lower()
    if kind not in {".urdf", ".toml"}:
        raise usage_error("-o", f"expected a name that ends in .urdf or .toml, got {output}")
    if output.exists() and Path(arm).exists() and output.samefile(arm):
        raise usage_error("-o", "expected another file than the input, which may hold more than an arm")
    model, notes = _read(arm, base, tip, lock, package)
    lost = lost_in_urdf(model) if kind == ".urdf" else []
    write_file(output, urdf_text(model) if kind == ".urdf" else toml_text(model))
    if as_json:
        print_json({"written": str(output), "name": model.name, "joints": model.n, "notes": notes, "lost": lost})
        return
    print(f"{model.name}: {counted(model.n, 'joint')} written to {output}")
    for sentence in (*notes, *lost):
        print(f"  {sentence}")


def _locked_positions(path: str, text: str | None) -> "dict[str, float]":
    """Read the positions of locked joints, in degrees or millimetres, and return them in SI units."""
    from armwright.arm.urdf.robot import read_robot

    parts = [item.rpartition("=") if "=" in item else (item, "", "0") for item in (text or "").split(",") if item]
    kinds = {joint.name: joint.kind for joint in read_robot(Path(path)).parent_joints.values()} if text else {}
    locked = {}
    for name, _, value in parts:
        try:
            position = float(value)
        except ValueError:
            raise usage_error("--lock", f"expected J1,J2=30, got {value!r} for {name}") from None
        if name in locked:
            raise usage_error("--lock", f"{name} occurs twice; expected each joint once")
        locked[name] = position * 1e-3 if kinds.get(name) == "prismatic" else math.radians(position)
    return locked


def _read(
    name: str, base: str | None, tip: str | None, lock: str | None, package: list[str] | None
) -> "tuple[Arm, list[str]]":
    """Return an arm, and notes on what its file states otherwise."""
    from armwright.arm.load import load_arm
    from armwright.arm.urdf.reader import read_urdf

    if name.lower().endswith(".urdf"):
        locked, packages = _locked_positions(name, lock), package_folders(package)
        reading = read_urdf(name, base=base, tip=tip, lock=locked, packages=packages)
        return reading.arm, list(reading.notes)
    for option, value in (("--base", base), ("--tip", tip), ("--lock", lock), ("--package", package)):
        if value:
            raise usage_error(option, f"expected a URDF file, whose links and joints have names, got '{name}'")
    return load_arm(name), []
