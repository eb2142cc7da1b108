"""The YAML file of ROS 2 with which a robot description of Universal Robots is calibrated: the frames of six joints.

The description reads roll, pitch and yaw as URDF has them: about the fixed axes x, then y, then z. What the driver's
own tool ``ur_calibration`` writes are angles about the moving axes x, then y, then z, though under the same names. Its
files are told apart by their pitch of exactly 0 or pi at upper arm, wrist 2 and wrist 3, which its frames have in that
order alone. They are read as they were meant, so that the tool is where the controller says it is.

Source:
    ``config/*/default_kinematics.yaml`` of Universal_Robots_ROS2_Description; ``ur_calibration/src/calibration.cpp`` of
    Universal_Robots_ROS2_Driver.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.universal_robots.joint_frames import description_frames, joint_transforms, with_table
from armwright.arm.universal_robots.structure import require_structure
from armwright.arrays import Array
from armwright.errors import FileFormatError, closest, shown
from armwright.files.inputs import read_text
from armwright.spatial.euler import from_rpy, to_rpy
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import elementary_rotation

_ROOT, _HASH = "kinematics", "hash"
_LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")
# Links whose pitch is 0 or pi in a file of ur_calibration, and by how much [rad].
_LEVEL_LINKS, _LEVEL = ("upper_arm", "wrist_2", "wrist_3"), 1e-12
# Largest number of the file [m] and [rad].
_LARGEST = 100.0
_LINE = re.compile(r"( *)([^\s:#][^:#]*?) *:(?: +(.*?))? *")


@attrs.frozen
class _Line:
    number: int
    indent: int
    key: str
    value: str


def read_kinematics_yaml(path: Path | str) -> tuple[Array, list[str]]:
    """Read the frames of the joints of one robot.

    The file is YAML of the simple form that these files have: keys and numbers, one on a line.

    Args:
        path: the file.

    Returns:
        (6, 4, 4) pose of each joint in the frame of the joint before, and a note where angles were read as those of
        ``ur_calibration``.

    Raises:
        FileFormatError: it cannot be read, is of another form, or lacks a number.
    """
    numbers = _numbers(path)
    written_by_tool = all(abs(math.sin(numbers[link]["pitch"])) < _LEVEL for link in _LEVEL_LINKS)
    read = _about_moving_axes if written_by_tool else from_rpy
    poses = [
        homogeneous(read(link["roll"], link["pitch"], link["yaw"]), [link[key] for key in "xyz"])
        for link in (numbers[name] for name in _LINKS)
    ]
    as_urdf = [from_rpy(link["roll"], link["pitch"], link["yaw"]) for link in (numbers[name] for name in _LINKS)]
    differ = max(float(np.abs(X[:3, :3] - R).max()) for X, R in zip(poses, as_urdf, strict=True))
    note = (
        f"{path}: roll, pitch and yaw are read as ur_calibration writes them, about moving axes; in a robot "
        f"description of ROS the same numbers rotate a joint by up to {differ * 1e3:.2g} mrad more"
    )
    return np.array(poses), [note] if differ > _LEVEL else []


def kinematics_yaml(arm: Arm) -> str:
    """Return the calibration of an arm as the text of such a file; poses of its base and its tool are not in it.

    Roll, pitch and yaw are those of URDF, as the robot description reads them.

    Raises:
        UnsupportedArmError: the arm is of another structure.
    """
    require_structure(arm)
    lines = [f"{_ROOT}:"]
    frames = description_frames(with_table(arm, joint_transforms(arm)))
    for link, X in zip(_LINKS, frames, strict=True):
        values = [*X[:3, 3].tolist(), *to_rpy(X[:3, :3]).tolist()]
        lines += [f"  {link}:", *(f"    {key}: {value + 0.0!r}" for key, value in zip(_KEYS, values, strict=True))]
    return "\n".join([*lines, f"  {_HASH}: armwright"]) + "\n"


def _about_moving_axes(roll: float, pitch: float, yaw: float) -> Array:
    return elementary_rotation(0, roll) @ elementary_rotation(1, pitch) @ elementary_rotation(2, yaw)


def _numbers(path: Path | str) -> dict[str, dict[str, float]]:
    """Return the numbers of each link."""
    links: dict[str, dict[str, float]] = {}
    root = outer = -1
    for line in _lines(path):
        if root < 0 or line.indent <= root:
            # Other settings beside those of the kinematics are passed over.
            root, outer = (line.indent if line.key == _ROOT else -1), -1
            if root >= 0 and line.value:
                message = f"expected links and their numbers on lines of their own, got {shown(line.value)}"
                raise FileFormatError(path, line.number, line.key, message)
            continue
        if outer in {-1, line.indent}:
            outer = line.indent
            if line.key != _HASH:
                _known(path, line, "", _LINKS)
                if line.key in links or line.value:
                    raise FileFormatError(path, line.number, line.key, "expected this link once, its numbers below it")
                links[line.key] = {}
        elif line.indent > outer and links:
            name = next(reversed(links))
            _known(path, line, f"{name}.", _KEYS)
            links[name][line.key] = _number(path, line, links[name])
        else:
            raise FileFormatError(path, line.number, line.key, f"expected {outer} spaces before a link, as before")
    _require_all(path, links)
    return links


def _require_all(path: Path | str, links: Mapping[str, Mapping[str, float]]) -> None:
    for link in _LINKS:
        if link not in links:
            raise FileFormatError(path, None, f"{_ROOT}.{link}", f"missing; expected the links {', '.join(_LINKS)}")
        for key in _KEYS:
            if key not in links[link]:
                raise FileFormatError(path, None, f"{_ROOT}.{link}.{key}", f"missing; expected {', '.join(_KEYS)}")


def _lines(path: Path | str) -> Iterator[_Line]:
    """Give the keys of the file with their values, comments left out."""
    for number, text in enumerate(read_text(path).split("\n"), 1):
        shorn = re.sub(r"(^|\s)#.*", "", text).rstrip()
        if not shorn or shorn in {"---", "..."} or shorn.startswith("%YAML"):
            continue
        match = _LINE.fullmatch(shorn)
        if match is None:
            raise FileFormatError(path, number, "", f"expected a key and a number, as in 'x: 0.1', got {shown(shorn)}")
        yield _Line(number, len(match[1]), match[2].strip("'\""), match[3] or "")


def _known(path: Path | str, line: _Line, place: str, names: tuple[str, ...]) -> None:
    if line.key not in names:
        near = closest(line.key, names)
        hint = f"; did you mean '{near}'?" if near else ""
        message = f"expected one of {', '.join(names)}{hint}"
        raise FileFormatError(path, line.number, f"{place}{shown(line.key).strip(chr(39))}", message)


def _number(path: Path | str, line: _Line, before: Mapping[str, float]) -> float:
    if line.key in before:
        raise FileFormatError(path, line.number, line.key, "this key occurs twice; expected it once")
    try:
        value = float(line.value)
    except ValueError:
        value = math.nan
    if not abs(value) <= _LARGEST:
        message = f"expected a number up to {_LARGEST:g}, got {shown(line.value)}"
        raise FileFormatError(path, line.number, line.key, message)
    return value
