"""The structure that the calibration files of Universal Robots describe: which arms have it."""

from __future__ import annotations

import math

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.universal_robots.joint_frames import joint_transforms
from armwright.errors import UnsupportedArmError

# By joint, the nominal angle between its axis and the next one [rad]; the last row has none.
_TWISTS = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2)
# A real axis is off by some milliradians.
_TOLERANCE = 0.1


def require_structure(arm: Arm) -> None:
    """Refuse an arm that is not built as those of Universal Robots: UR3 to UR30.

    Raises:
        UnsupportedArmError: it has other joints, or its axes stand otherwise; the first difference is named.
    """
    wanted = "expected six revolute joints, of which 2, 3 and 4 are parallel, as on a UR5"
    prismatic = [arm.joint_label(i) for i, joint in enumerate(arm.joints) if not joint.revolute]
    if arm.n != len(_TWISTS) + 1 or prismatic:
        found = f"{prismatic[0]} is prismatic" if prismatic else f"it has {arm.n} joints"
        raise UnsupportedArmError(f"{arm.name}: {found}; calibration files of Universal Robots {wanted}")
    for i, (twist, X) in enumerate(zip(_TWISTS, joint_transforms(arm), strict=False)):
        axis = (0.0, -math.sin(twist), math.cos(twist))
        angle = math.acos(float(np.clip(X[:3, 2] @ axis, -1.0, 1.0)))
        if angle > _TOLERANCE:
            message = (
                f"the axis behind {arm.joint_label(i)} is {math.degrees(angle):.0f} degrees from where it is there"
            )
            raise UnsupportedArmError(f"{arm.name}: {message}; calibration files of Universal Robots {wanted}")
