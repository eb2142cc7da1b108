"""The frames of CAD assemblies: one for each component that has a name."""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Collection, Iterator
from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.entries import ARM_NAME
from armwright.cell.frames import WORLD, Node
from armwright.cell.model import Cell
from armwright.errors import FileFormatError, shown
from armwright.files.limits import limit, limit_message
from armwright.spatial.poses import homogeneous, inverse, to_noap
from armwright.spatial.rotations import nearest_rotation, orthonormality_error
from armwright.spatial.shapes import LARGEST_SIZE

# The endings of the names of files that are assemblies.
SUFFIXES = (".step", ".stp", ".gltf", ".glb")
# Names of a program are no longer; of a longer one the end is left, and of a component this much is looked at.
LONGEST_NAME = 31
# Axes of a component, its scale left out, are orthonormal but for rounding in single precision.
_MAX_ROTATION_ERROR = 1e-4
# Places are to a tenth of a micrometre, beyond which the single precision of the file says nothing.
_DIGITS = 7
_NO_LETTER = re.compile(r"[^A-Z0-9]+")


@attrs.frozen(kw_only=True, eq=False)
class AssemblyFrames:
    """The frames of an assembly.

    Attributes:
        frames: by name, in the order of the file, each on the frame of the component that it belongs to.
        renamed: names of components with those around them, as ``Fixture/Pin``, by the name of the frame, where that is
            another than those names in upper case and joined by ``_``.
    """

    frames: dict[str, Node]
    renamed: dict[str, str]


def is_assembly(path: Path) -> bool:
    """Whether a file is an assembly, by the ending of its name."""
    return path.suffix.lower() in SUFFIXES


def read_assembly_frames(path: Path, reserved: Collection[str] = ()) -> AssemblyFrames:
    """Return one frame for each named component of a STEP or glTF file, in metres.

    The name of a frame has the names of the components around it in front, but for that of the whole assembly. Letters
    are put in upper case, others than A to Z and digits become ``_``, a name that occurs again has a number, and of a
    long one the end is left.

    Args:
        path: the file.
        reserved: names in upper case that no frame may have.

    Raises:
        MissingExtraError: it is STEP, and cascadio is not installed.
        FileFormatError: the file cannot be read, has no named component, or one that no frame can be.
    """
    from armwright.spatial.meshes.reader import read_assembly  # noqa: PLC0415 - few programs have assemblies

    components = read_assembly(path).components
    tops = [each for each in components if each.parent is None]
    whole = tops[0] if len(tops) == 1 and any(each.parent is not None for each in components) else None
    frames: dict[str, Node] = {}
    renamed: dict[str, str] = {}
    numbers: dict[str, int] = {}
    # For each component: the names around it with its own, and the frame that its own components are on.
    around: list[tuple[tuple[str, ...], str]] = []
    poses: dict[str, Array] = {WORLD: np.eye(4)}
    for component in components:
        names, parent = around[component.parent] if component.parent is not None else ((), WORLD)
        own = component.name.strip()[:LONGEST_NAME]
        if not own:
            around.append((names, parent))
            continue
        path_names = (*names, own)
        name = _free_name("_".join(map(_word, path_names)), reserved, frames, numbers)
        if name != "_".join(path_names).upper():
            renamed[name] = "/".join(path_names)
        poses[name] = _rigid(path, own, component.pose)
        frames[name] = Node(parent=parent, relation=_rounded(inverse(poses[parent]) @ poses[name]))
        around.append(((), name) if component is whole else (path_names, name))
        if len(frames) > limit("frames"):
            raise FileFormatError(path, None, "", f"too many named components: {limit_message('frames')}")
    if not frames:
        raise FileFormatError(path, None, "", "expected components with names, got none")
    return AssemblyFrames(frames=frames, renamed=renamed)


def assembly_cell(path: Path, reserved: Collection[str] = ()) -> Cell:
    """Return a cell without arms that has the frames of an assembly; see ``read_assembly_frames``."""
    return Cell(name=path.name, arms={}, frames=read_assembly_frames(path, reserved).frames)


def frames_text(assembly: AssemblyFrames, source: str) -> str:
    """Return the frames of an assembly as a cell file without arms.

    Args:
        assembly: the frames.
        source: name of the file that they are from, for its first line.
    """
    return "\n".join(_lines(assembly, source)) + "\n"


def _lines(assembly: AssemblyFrames, source: str) -> Iterator[str]:
    yield f"# The named components of {json.dumps(source)}, in metres."
    yield "[frames]"
    for name, node in assembly.frames.items():
        assert node.relation is not None  # noqa: S101 - every component has a place
        # Digits that rounding has made are left out; -0.0 + 0.0 is 0.0.
        numbers = (to_noap(node.relation).round(9) + 0.0).tolist()
        parent = "" if node.parent == WORLD else f'on = "{node.parent}", '
        note = f"  # {json.dumps(assembly.renamed[name])}" if name in assembly.renamed else ""
        yield f"{name} = {{ {parent}at = {numbers!r} }}{note}"


def _word(name: str) -> str:
    """Return the letters and digits of a name, in upper case, accents left out."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().upper()
    return _NO_LETTER.sub("_", plain).strip("_") or "PART"


def _free_name(name: str, reserved: Collection[str], taken: Collection[str], numbers: dict[str, int]) -> str:
    """Return a name that is valid in a program and not taken; ``numbers`` are the last ones of names that recur."""
    name = name[-LONGEST_NAME:].strip("_")
    if not name[0].isalpha():
        name = f"N_{name}"[:LONGEST_NAME]
    if name == WORLD or ARM_NAME.fullmatch(name) or name in reserved:
        name = f"{name}_FRAME"
    result = name
    while result in taken:
        numbers[name] = numbers.get(name, 1) + 1
        ending = f"_{numbers[name]}"
        result = f"{name[: LONGEST_NAME - len(ending)]}{ending}"
    return result


def _rounded(X: Array) -> Array:
    return homogeneous(nearest_rotation(X[:3, :3].round(_DIGITS)), X[:3, 3].round(_DIGITS))


def _rigid(path: Path, name: str, X: Array) -> Array:
    """Return the pose of a component, its scale left out."""
    lengths = np.linalg.norm(X[:3, :3], axis=0)
    R = X[:3, :3] / np.where(lengths > 0, lengths, 1.0)
    if float(orthonormality_error(R)) > _MAX_ROTATION_ERROR or np.linalg.det(R) < 0:
        raise FileFormatError(path, None, "", f"the component {shown(name)} is mirrored or sheared, as no frame can be")
    if np.abs(X[:3, 3]).max() > LARGEST_SIZE:
        message = f"the component {shown(name)} is farther than {LARGEST_SIZE:g} m away; expected metres"
        raise FileFormatError(path, None, "", message)
    return homogeneous(nearest_rotation(R), X[:3, 3])
