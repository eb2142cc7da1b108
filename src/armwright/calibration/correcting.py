"""The arm with its errors taken in: an arm that every other part of the package can use."""

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, Element
from armwright.calibration.fitting import Calibration
from armwright.errors import InvalidValueError
from armwright.spatial.poses import pose
from armwright.spatial.rotations import rotation_from_vector

# The numbers of a link in the Denavit-Hartenberg convention.
_NUMBERS = ("theta", "d", "a", "alpha")


def corrected_arm(calibration: Calibration) -> Arm:
    """Return the arm with the errors that were found, its base in the frame of the measurements.

    Raises:
        InvalidValueError: a turn about y was fitted, which a Denavit-Hartenberg table cannot hold without axes that
            meet a kilometre away; calibrate ``without=("beta",)``.
    """
    chain, arm = calibration.chain, calibration.chain.arm
    by_name = dict(zip(chain.names, calibration.errors.tolist(), strict=True))
    tilted = [name for name, value in by_name.items() if name.endswith(".beta") and value]
    if tilted:
        raise InvalidValueError(
            f"{arm.name}: {', '.join(tilted)} turns about y, which a Denavit-Hartenberg table has no number for; "
            f'calibrate without=("beta",)'
        )
    joints = [
        attrs.evolve(joint, **{key: getattr(joint, key) + by_name[f"joint{i}.{key}"] for key in _NUMBERS})
        for i, joint in enumerate(arm.joints, 1)
    ]
    base = chain.base @ _pose_of(chain, by_name, "base") @ arm.base
    return attrs.evolve(
        arm,
        joints=tuple(joints),
        base=base,
        tool=arm.tool @ _pose_of(chain, by_name, "tool"),
        title=f"{arm.title or arm.name}, calibrated",
    )


def _pose_of(chain: Chain, by_name: dict[str, float], part: str) -> Array:
    """Return the pose that the six errors of a part make."""
    X = np.eye(4)
    for element in chain.elements:
        if element.name.startswith(f"{part}."):
            X = X @ _moved(element, by_name[element.name])
    return X


def _moved(element: Element, by: float) -> Array:
    along = by * np.eye(3)[element.axis]
    return pose(np.eye(3), along) if element.kind == "shift" else pose(rotation_from_vector(along), np.zeros(3))
