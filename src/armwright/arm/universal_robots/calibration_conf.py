"""``calibration.conf`` of Universal Robots: how the table of one robot differs from that of its model.

Source:
    Files that users have published, and ``ur_calibration/test/calibration_test.cpp`` of Universal_Robots_ROS2_Driver.
"""

from __future__ import annotations

import configparser
import math
from pathlib import Path

import attrs

from armwright.arm.model import Arm
from armwright.arm.universal_robots.joint_frames import joint_transforms, with_table
from armwright.arm.universal_robots.structure import require_structure
from armwright.arrays import Array
from armwright.errors import FileFormatError, InvalidValueError, shown
from armwright.files.inputs import read_text

_SECTION, _JOINTS = "mounting", 6
# By parameter of a row, the largest difference that is read: nearly parallel axes meet hundreds of metres away.
_LARGEST = {"theta": 1e3, "a": 1e3, "d": 1e5, "alpha": 1e3}
_LINEARISED = "2"


def read_calibration_conf(path: Path | str, nominal: Arm) -> tuple[Array, list[str]]:
    """Read how one robot differs from its model.

    Args:
        path: the file, of which the section ``[mounting]`` counts.
        nominal: the model, to whose table the differences are added.

    Returns:
        (6, 4, 4) what follows the rotation of each joint, and notes on the file.

    Raises:
        FileFormatError: it cannot be read; a list is missing, or holds something else than six numbers.
        UnsupportedArmError: the model is of another structure.
        InvalidValueError: the model is no table, so that there is nothing to add the differences to.
    """
    _require_table(nominal)
    parser = configparser.ConfigParser(strict=False, interpolation=None, inline_comment_prefixes=("#", ";"))
    try:
        parser.read_string(read_text(path))
    except configparser.Error as error:
        line = getattr(error, "lineno", None)
        raise FileFormatError(path, line, "", "expected lines such as [mounting] and delta_a = [ 0, 0, 0]") from error
    if not parser.has_section(_SECTION):
        there = ", ".join(f"[{name}]" for name in parser.sections()[:5]) or "none"
        raise FileFormatError(path, None, f"[{_SECTION}]", f"no such section; sections of the file: {there}")
    section = parser[_SECTION]
    deltas = {key: _numbers(path, section, f"delta_{key}", largest) for key, largest in _LARGEST.items()}
    joints = [
        attrs.evolve(joint, **{key: getattr(joint, key) + values[i] for key, values in deltas.items()})
        for i, joint in enumerate(nominal.joints)
    ]
    status = section.get("calibration_status", _LINEARISED).strip()
    note = f"calibration_status is {shown(status)}, and not 2 as of a robot that was calibrated"
    return joint_transforms(attrs.evolve(nominal, joints=joints)), [] if status == _LINEARISED else [note]


def calibration_conf(arm: Arm, nominal: Arm) -> str:
    """Return the calibration of an arm as the text of such a file; poses of its base and its tool are not in it.

    Args:
        arm: the calibrated arm.
        nominal: the model, from whose table the differences are counted.

    Raises:
        UnsupportedArmError: an arm is of another structure.
        InvalidValueError: the model is no table.
    """
    _require_table(nominal)
    require_structure(arm)
    pairs = list(zip(with_table(nominal, joint_transforms(arm)).joints, nominal.joints, strict=True))
    lines = [f"[{_SECTION}]"]
    for key in _LARGEST:
        deltas = [repr(getattr(own, key) - getattr(of_model, key) + 0.0) for own, of_model in pairs]
        lines.append(f"delta_{key} = [ {', '.join(deltas)}]")
    lines.append(f"calibration_status = {_LINEARISED} # 0 == notInitialized / 1 == notLinearised / 2 == Linearised")
    return "\n".join(lines) + "\n"


def _require_table(nominal: Arm) -> None:
    """Refuse a model whose rows are not four numbers each, or that is built otherwise."""
    require_structure(nominal)
    if any(joint.fixed is not None for joint in nominal.joints):
        raise InvalidValueError(
            f"{nominal.name}: its rows are poses; calibration.conf holds differences from the table of a model, so "
            "specify that, such as ur5"
        )


def _numbers(path: Path | str, section: configparser.SectionProxy, key: str, largest: float) -> list[float]:
    """Return the six numbers of a list."""
    if key not in section:
        raise FileFormatError(path, None, key, f"no such key in [{_SECTION}]; expected a list of six numbers")
    text = section[key].strip()
    words = text[1:-1].split(",") if text[:1] == "[" and text[-1:] == "]" else []
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != _JOINTS:
        raise FileFormatError(path, None, key, f"expected a list of six numbers in brackets, got {shown(text)}")
    for number, value in enumerate(values, 1):
        if not (math.isfinite(value) and abs(value) <= largest):
            raise FileFormatError(path, None, key, f"joint {number}: expected up to {largest:g}, got {value:g}")
    return values
