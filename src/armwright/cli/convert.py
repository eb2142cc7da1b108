"""``armwright convert``: convert an arm or a cell from one file format to another, or an assembly to frames."""

import enum
import math
import sys
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from typer import Argument, Option

from armwright.cli.options import Json, usage_error
from armwright.cli.output import print_json
from armwright.cli.package_option import Packages, package_folders
from armwright.errors import counted

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arm.tree.kinematic_tree import Tree


class Format(enum.StrEnum):
    """What an arm can be written as."""

    URDF = "urdf"
    MJCF = "mjcf"
    TOML = "toml"
    UR_CALIBRATION = "ur-calibration"
    ROS2_KINEMATICS = "ros2-kinematics"


SUFFIXES = {
    Format.URDF: ".urdf",
    Format.MJCF: ".xml",
    Format.TOML: ".toml",
    Format.UR_CALIBRATION: ".conf",
    Format.ROS2_KINEMATICS: ".yaml",
}


class Converted(NamedTuple):
    """What is to be written.

    Attributes:
        name: of the arm or the cell.
        text: of the file.
        counts: what is in it.
        notes: sentences on what was read otherwise.
        lost: sentences on what the format cannot represent.
    """

    name: str
    text: str
    counts: dict[str, int]
    notes: list[str]
    lost: list[str]


def convert(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: Annotated[str, Argument(help="Arm from the catalogue, or the path of a file of an arm or a cell.")],
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            help="File to write: .urdf, .xml for MJCF, .toml for an arm file; .conf or .yaml for a calibration.",
        ),
    ] = None,
    to: Annotated[
        Format | None, Option(help="Format to write; without -o it is printed. The default is that of the file's name.")
    ] = None,
    base: Annotated[str | None, Option(help="Base link of a URDF file, or body of an MJCF file.")] = None,
    tip: Annotated[str | None, Option(help="Tool link of a URDF file, or body or site of an MJCF file.")] = None,
    lock: Annotated[
        str | None,
        Option(help="Joints of such a file to lock, at 0 or a position in degrees or mm, as in J1,J2=30."),
    ] = None,
    package: Packages = None,
    calibration: Annotated[
        Path | None,
        Option(help="Calibration of a robot to apply: calibration.conf of Universal Robots, or its .yaml for ROS 2."),
    ] = None,
    model: Annotated[
        str | None, Option(help="Model from which calibration.conf differs; the default with --calibration is the arm.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write an arm as URDF, as MJCF or as an arm file, or a cell as MJCF, and report what the format cannot represent.

    Of an assembly in STEP or glTF, write the frames of its named components, for IMPORT. With --calibration, an arm of
    Universal Robots gets the geometry of one robot, which can also be written: -o calibration.conf, -o kinematics.yaml.

    **Example:** `armwright convert puma560 -o puma560.urdf`
    """
    from armwright.cell.assembly import is_assembly

    if is_assembly(Path(arm)):
        from armwright.cli.convert_assembly import convert_assembly

        if output is None:
            raise usage_error("-o", "missing; specify the file for the frames of the assembly, such as frames.toml")
        convert_assembly(Path(arm), output, as_json=as_json)
        return
    from armwright.files.output import write_file

    to = _format(output, to)
    if output is None and as_json:
        raise usage_error("--json", "expected -o and the name of a file to write")
    if output is not None and output.exists() and Path(arm).exists() and output.samefile(arm):
        raise usage_error("-o", "expected another file than the input, which may hold more than an arm")
    if _is_cell(arm):
        done = _converted_cell(arm, to, calibration)
    else:
        model_name = model or (None if calibration is None else arm)
        done = _converted_arm(to, _calibrated(_read(arm, base, tip, lock, package), calibration), model_name)
    if output is None:
        print(done.text, end="")
        for sentence in (*done.notes, *done.lost):
            print(sentence, file=sys.stderr)
        return
    write_file(output, done.text)
    if as_json:
        print_json({"written": str(output), "name": done.name, **done.counts, "notes": done.notes, "lost": done.lost})
        return
    print(f"{done.name}: {', '.join(counted(n, key[:-1]) for key, n in done.counts.items())} written to {output}")
    for sentence in (*done.notes, *done.lost):
        print(f"  {sentence}")


def _format(output: Path | None, to: Format | None) -> Format:
    """Return the format to write: the one that is named, or that of the name of the file."""
    if to is not None:
        return to
    if output is None:
        raise usage_error("-o", "missing; specify the file to write, or the format as --to, which is printed then")
    for kind, suffix in SUFFIXES.items():
        if output.suffix.lower() == suffix:
            return kind
    raise usage_error("-o", f"expected a name that ends in .urdf, .xml, .toml, .conf or .yaml, got {output}")


def _is_cell(path: str) -> bool:
    """Whether a file is that of a cell: TOML or JSON with arms."""
    from armwright.files.document import Document

    return path.lower().endswith((".toml", ".json")) and "arms" in Document.read(Path(path)).root


def _converted_cell(path: str, to: Format, calibration: Path | None) -> Converted:
    from armwright.cell.reader import read_cell
    from armwright.physics.mjcf import cell_mjcf

    if calibration is not None:
        raise usage_error("--calibration", f"expected an arm, got the cell '{path}'")
    if to is not Format.MJCF:
        raise usage_error("--to", f"'{path}' is a cell; expected mjcf, as the other formats hold a single arm")
    cell = read_cell(path)
    file = cell_mjcf(cell)
    counts = {"arms": len(cell.arms), "fixtures": len(cell.fixtures), "parts": len(cell.parts)}
    return Converted(cell.name, file.text, counts, [], list(file.lost))


def _calibrated(reading: "tuple[Arm, list[str]]", calibration: Path | None) -> "tuple[Arm, list[str]]":
    """Return an arm with the calibration of one robot, and further notes."""
    if calibration is None:
        return reading
    from armwright.arm.universal_robots.calibrated_arm import calibrated_arm

    arm, notes = calibrated_arm(reading[0], calibration)
    return arm, [*reading[1], *notes]


def _converted_arm(to: Format, reading: "tuple[Arm, list[str]]", model_name: str | None) -> Converted:
    from armwright.arm.urdf.writer import lost_in_urdf, urdf_text
    from armwright.arm.write import toml_text, without_meshes

    model, notes = reading
    if to in {Format.UR_CALIBRATION, Format.ROS2_KINEMATICS}:
        text, lost = _calibration_text(to, model, model_name)
    elif to is Format.MJCF:
        from armwright.physics.mjcf import arm_mjcf

        file = arm_mjcf(model)
        text, lost = file.text, list(file.lost)
    elif to is Format.URDF:
        text, lost = urdf_text(model), lost_in_urdf(model)
    else:
        kept, lost = without_meshes(model)
        text = toml_text(kept)
    return Converted(model.name, text, {"joints": model.n}, notes, lost)


def _calibration_text(to: Format, arm: "Arm", model_name: str | None) -> tuple[str, list[str]]:
    """Return an arm as a calibration of Universal Robots, and what is not in it."""
    from armwright.arm.load import load_arm
    from armwright.arm.universal_robots.calibration_conf import calibration_conf
    from armwright.arm.universal_robots.kinematics_yaml import kinematics_yaml

    lost = ["poses of base and tool, limits, masses and solids are not in a calibration"]
    if to is Format.ROS2_KINEMATICS:
        return kinematics_yaml(arm), lost
    if model_name is None:
        raise usage_error("--model", "missing; specify the arm from which calibration.conf differs, such as ur5")
    return calibration_conf(arm, load_arm(model_name)), lost


def _rest_of_cell(arm: "Arm") -> list[str]:
    """Return a note on what an arm of a cell in MJCF leaves out: links of cells are named after their arm."""
    owner, slash, link = arm.base_link.partition("/")
    if not slash or link != "base" or not owner.startswith("ARM_"):
        return []
    return [f"the file is a cell, of which {owner} alone is read; armwright.physics.read_cell_mjcf reads all of it"]


def _locked_positions(text: str | None, slides: Callable[[], Collection[str]]) -> "dict[str, float]":
    """Read the positions of locked joints, in degrees or millimetres, and return them in SI units.

    Args:
        text: such as J1,J2=30.
        slides: return the names of the joints that slide.
    """
    parts = [item.rpartition("=") if "=" in item else (item, "", "0") for item in (text or "").split(",") if item]
    sliding = slides() if text else ()
    locked = {}
    for name, _, value in parts:
        try:
            position = float(value)
        except ValueError:
            raise usage_error("--lock", f"expected J1,J2=30, got {value!r} for {name}") from None
        if name in locked:
            raise usage_error("--lock", f"{name} occurs twice; expected each joint once")
        locked[name] = position * 1e-3 if name in sliding else math.radians(position)
    return locked


def _read(
    name: str, base: str | None, tip: str | None, lock: str | None, package: list[str] | None
) -> "tuple[Arm, list[str]]":
    """Return an arm, and notes on what its file states otherwise."""
    from armwright.arm.load import load_arm

    path, kind = Path(name), name.lower().rpartition(".")[2]
    if kind in {"urdf", "xml"}:
        from armwright.arm.mjcf.reader import read_mjcf, read_tree
        from armwright.arm.urdf.reader import read_urdf
        from armwright.arm.urdf.robot import read_robot

        def slides() -> list[str]:
            tree: Tree = read_robot(path) if kind == "urdf" else read_tree(path)
            return [joint.name for joint in tree.parent_joints.values() if joint.prismatic]

        locked = _locked_positions(lock, slides)
        if kind == "urdf":
            reading = read_urdf(name, base=base, tip=tip, lock=locked, packages=package_folders(package))
        elif package:
            raise usage_error("--package", f"expected a URDF file, whose meshes are in packages, got '{name}'")
        else:
            reading = read_mjcf(name, base=base, tip=tip, lock=locked)
        return reading.arm, [*reading.notes, *_rest_of_cell(reading.arm)]
    for option, value in (("--base", base), ("--tip", tip), ("--lock", lock), ("--package", package)):
        if value:
            message = f"expected a URDF or MJCF file, whose links and joints have names, got '{name}'"
            raise usage_error(option, message)
    return load_arm(name), []
