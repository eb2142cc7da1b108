"""An arm of the catalogue with the calibration of one robot."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.universal_robots.calibration_conf import read_calibration_conf
from armwright.arm.universal_robots.joint_frames import joint_transforms, with_near_frames
from armwright.arm.universal_robots.kinematics_yaml import read_kinematics_yaml
from armwright.arm.universal_robots.structure import require_structure
from armwright.errors import FileFormatError
from armwright.files.inputs import file_path

# No robot leaves the factory farther from its model [m] and [rad].
_FARTHEST, _MOST_TURNED = 0.02, 0.05


def calibrated_arm(nominal: Arm, path: Path | str) -> tuple[Arm, list[str]]:
    """Return an arm of Universal Robots as one robot is built, and notes on its file.

    Its frames stay next to those of the model, so masses, solids and limits hold as they are.

    Args:
        nominal: the model, such as ``load_arm("ur5")``.
        path: the robot's ``calibration.conf``, or its kinematics for ROS, a name that ends in ``.yaml``.

    Raises:
        FileFormatError: the file cannot be read, or is that of another model.
        UnsupportedArmError: the model is of another structure.
        InvalidValueError: the model has no table, and the file holds differences from it.
    """
    path = file_path(path)
    require_structure(nominal)
    if path.suffix.lower() in {".yaml", ".yml"}:
        frames, notes = read_kinematics_yaml(path)
        transforms = np.array([*frames, np.eye(4)])
    else:
        rows, notes = read_calibration_conf(path, nominal)
        transforms = np.array([np.eye(4), *rows])
    arm = with_near_frames(nominal, transforms)
    for i, (X, target) in enumerate(zip(joint_transforms(arm), joint_transforms(nominal), strict=True)):
        away, turned = np.linalg.norm(X[:3, 3] - target[:3, 3]), np.abs(X[:3, :3] - target[:3, :3]).max()
        if away > _FARTHEST or turned > _MOST_TURNED:
            message = (
                f"the frame behind {nominal.joint_label(i)} is {away * 1e3:.0f} mm and {turned:.2f} rad from that of "
                f"'{nominal.name}', more than in any robot of this model; is it the file of another one?"
            )
            raise FileFormatError(path, None, "", message)
    title = f"{nominal.title or nominal.name}, calibrated by {path.name}"
    return attrs.evolve(arm, title=title, uncertainty=None), notes
