"""Files of the stiffness of an arm's joints about three axes, TOML: what ``armwright calibrate --beyond`` identifies.

``[joint.2]`` has ``x_Nm_per_rad``, ``y_Nm_per_rad`` and ``z_Nm_per_rad``, of prismatic joints ``z_N_per_m``. An axis
without a stiffness is rigid.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.files.document import Document

# Bounds of a stiffness [N m/rad], [N/m]: a joint below yields anywhere, one above is rigid.
LEAST_STIFFNESS, LARGEST_STIFFNESS = 1e-3, 1e15


def read_stiffness(path: Path | str, arm: Arm) -> Array:
    """Read a file of stiffness.

    Args:
        path: a TOML file.
        arm: with n joints.

    Returns:
        (n, 3) compliance about x, y and z of the frame of each joint, 0 where it is rigid [rad/(N m)], [m/N].

    Raises:
        FileFormatError: the file is missing or malformed, names what the arm has not, or has no stiffness.
    """
    root = Document.read(Path(path)).root
    joints = root.table("joint")
    compliance = np.zeros((arm.n, 3))
    for i in range(arm.n):
        own = joints.table(str(i + 1))
        for axis, key in enumerate(_keys(arm, i)):
            if key in own:
                compliance[i, axis] = 1 / own.number(key, 0.0, lower=LEAST_STIFFNESS, upper=LARGEST_STIFFNESS)
        own.allow(*_keys(arm, i))
        own.refuse_unknown_keys()
    joints.refuse_unknown_keys()
    root.refuse_unknown_keys()
    if not compliance.any():
        raise root.error(None, "expected a stiffness, such as z_Nm_per_rad = 2e4 in [joint.2]")
    return compliance


def stiffness_text(arm: Arm, compliance: Array) -> str:
    """Return the text of a file of stiffness, without the axes whose compliance is not above 0.

    Args:
        arm: with n joints.
        compliance: (n, 3) of its joints [rad/(N m)], [m/N].
    """
    return "\n".join(_lines(arm, compliance)) + "\n"


def _keys(arm: Arm, joint: int) -> tuple[str, str, str]:
    return "x_Nm_per_rad", "y_Nm_per_rad", "z_Nm_per_rad" if arm.joints[joint].revolute else "z_N_per_m"


def _lines(arm: Arm, compliance: Array) -> Iterator[str]:
    yield f"# Stiffness of the joints of {arm.name} about the axes of their frames; docs/calibration.md"
    for i in range(arm.n):
        found = {key: 1 / c for key, c in zip(_keys(arm, i), compliance[i].tolist(), strict=True) if c > 0}
        if found:
            yield f"\n[joint.{i + 1}]"
            yield from (f"{key} = {value:.6g}" for key, value in found.items())
