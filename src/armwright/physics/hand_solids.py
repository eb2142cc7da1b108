"""The shapes of a gripper and of the link before it, where only the opening of the gripper is known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.scene import Gripper
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.shapes import Box, Capsule, Cylinder, Shape, Solid, Sphere

# A finger: along n, along o and along a of the tool, at which it ends [m].
_FINGER = (0.02, 0.01, 0.05)
# The palm behind the fingers: along n and along a [m]; along o it is as wide as the open fingers.
_PALM = (0.04, 0.03)
# A suction cup and the tube behind it: radius and length [m].
_CUP, _TUBE = (0.015, 0.03), (0.02, 0.05)
# The guess of a link that would be shorter than this is none [m].
_SHORTEST = 1e-3


class HandSolid(NamedTuple):
    """A solid of a gripper.

    Attributes:
        name: in messages.
        shape: its form.
        pose: (4, 4) on the tool.
        grips: whether it touches the parts that the gripper holds.
    """

    name: str
    shape: Shape
    pose: Array
    grips: bool


def gripper_solids(gripper: Gripper, opening: float) -> list[HandSolid]:
    """Return the solids of a gripper, the same ones in the same order however far it is open.

    Args:
        gripper: what is known of it.
        opening: between its fingers now [m].
    """
    if gripper.kind == "suction":
        (radius, length), (tube, beyond) = _CUP, _TUBE
        return [
            HandSolid("suction cup", Cylinder(radius=radius, length=length), _offset(0.0, -length / 2), grips=True),
            HandSolid(
                "suction tube", Cylinder(radius=tube, length=beyond), _offset(0.0, -length - beyond / 2), grips=False
            ),
        ]
    _, thickness, length = _FINGER
    aside = (opening + thickness) / 2
    palm = Box(size=(_PALM[0], gripper.opening + 2 * thickness, _PALM[1]))
    return [
        HandSolid("finger", Box(size=_FINGER), _offset(aside, -length / 2), grips=True),
        HandSolid("finger", Box(size=_FINGER), _offset(-aside, -length / 2), grips=True),
        HandSolid("palm", palm, _offset(0.0, -length - _PALM[1] / 2), grips=False),
    ]


def gripper_length(gripper: Gripper | None) -> float:
    """Return how far behind the tool point a gripper begins [m]; 0 without one."""
    if gripper is None:
        return 0.0
    return _CUP[1] + _TUBE[1] if gripper.kind == "suction" else _FINGER[2] + _PALM[1]


def before_hand(solid: Solid, arm: Arm, length: float) -> Solid | None:
    """Return a guessed capsule or sphere of the last link as far as it is behind the gripper; None where nothing is.

    Args:
        solid: in the frame of the last link.
        arm: the arm.
        length: how far behind the tool point the gripper begins [m].
    """
    shape = solid.shape
    if isinstance(shape, Sphere):
        radius, half = shape.radius, 0.0
    elif isinstance(shape, Capsule):
        radius, half = shape.radius, shape.length / 2
    else:
        return solid
    X_TS = inverse(arm.tool) @ solid.pose
    ends = X_TS[:3, 3] + np.outer([-half, half], X_TS[:3, 2])
    # No point of the axis may be nearer to the tool than the radius.
    farthest, heights = -length - radius, ends[:, 2]
    if (heights <= farthest).all():
        return solid
    if (heights > farthest).all():
        return None
    share = (farthest - heights[0]) / (heights[1] - heights[0])
    low, high = (0.0, share) if heights[0] <= farthest else (share, 1.0)
    if (high - low) * 2 * half < _SHORTEST:
        return None
    middle = solid.pose @ homogeneous(np.eye(3), (0.0, 0.0, (low + high - 1.0) * half))
    return Solid(shape=Capsule(radius=radius, length=(high - low) * 2 * half), pose=middle)


def _offset(o: float, a: float) -> Array:
    return homogeneous(np.eye(3), (0.0, o, a))
