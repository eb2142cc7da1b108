"""``armwright convert``: an arm from one file format to another."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.options import ArmName
from armwright.cli.output import print_json
from armwright.errors import counted

if TYPE_CHECKING:
    from armwright.arm.model import Arm


def convert(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    output: Annotated[Path, typer.Option("-o", "--output", help="File to write: .urdf, or .toml for an arm file.")],
    base: Annotated[str | None, typer.Option(help="Of a URDF file: the link that stands still.")] = None,
    tip: Annotated[str | None, typer.Option(help="Of a URDF file: the link that is the tool.")] = None,
    lock: Annotated[
        str | None,
        typer.Option(
            help="Of a URDF file: joints to hold, as those of a gripper, at 0 or elsewhere: J1,J2=30 (degrees, or mm)."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> None:
    """Write an arm as URDF or as an arm file, and say what the file cannot hold.

    **Example:** `armwright convert puma560 -o puma560.urdf`
    """
    from armwright.arm.urdf.writer import lost_in_urdf, urdf_text
    from armwright.arm.write import toml_text
    from armwright.files.output import write_file

    kind = output.suffix.lower()
    if kind not in {".urdf", ".toml"}:
        raise typer.BadParameter(f"expected a name that ends in .urdf or .toml, got {output}", param_hint="-o")
    if output.exists() and Path(arm).exists() and output.samefile(arm):
        raise typer.BadParameter("this is the file that is read; it may hold more than an arm", param_hint="-o")
    model, notes = _read(arm, base, tip, lock)
    lost = lost_in_urdf(model) if kind == ".urdf" else []
    write_file(output, urdf_text(model) if kind == ".urdf" else toml_text(model))
    if as_json:
        said = {"written": str(output), "name": model.name, "joints": model.n, "notes": notes, "lost": lost}
        print_json(said)
        return
    print(f"{model.name}: {counted(model.n, 'joint')} written to {output}")
    for sentence in (*notes, *lost):
        print(f"  {sentence}")


def _held(path: str, text: str | None) -> "dict[str, float]":
    """Read where joints of a file are held, in degrees or millimetres, as SI."""
    from armwright.arm.urdf.robot import read_robot

    parts = [one.rpartition("=") if "=" in one else (one, "", "0") for one in (text or "").split(",") if one]
    kinds = {joint.name: joint.kind for joint in read_robot(Path(path)).above.values()} if text else {}
    held = {}
    for name, _, value in parts:
        try:
            position = float(value)
        except ValueError:
            raise typer.BadParameter(f"expected J1,J2=30, got {value!r} for {name}", param_hint="--lock") from None
        if name in held:
            raise typer.BadParameter(f"{name} is given twice; expected each joint once", param_hint="--lock")
        held[name] = position * 1e-3 if kinds.get(name) == "prismatic" else math.radians(position)
    return held


def _read(name: str, base: str | None, tip: str | None, lock: str | None) -> "tuple[Arm, list[str]]":
    """Return an arm, and what was not taken as it stands in its file."""
    from armwright.arm.load import load_arm
    from armwright.arm.urdf.reader import read_urdf

    if name.lower().endswith(".urdf"):
        reading = read_urdf(name, base=base, tip=tip, lock=_held(name, lock))
        return reading.arm, list(reading.notes)
    for option, value in (("--base", base), ("--tip", tip), ("--lock", lock)):
        if value:
            raise typer.BadParameter(f"only URDF files have links and joints to name, not '{name}'", param_hint=option)
    return load_arm(name), []
