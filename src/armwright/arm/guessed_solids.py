"""What an arm may look like of which only the joints are known: capsules along its Denavit-Hartenberg steps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Capsule, Solid, Sphere

# The radius of the first link by the length of the arm, and of the last by that of the first.
_RADIUS, _LAST = 0.05, 0.5
# A step shorter than this part of the radius is within the solids beside it.
_SHORT = 0.1


def guessed_radii(arm: Arm) -> Array:
    """Return the radius of the capsules of each link, (n,) [m]: they become thinner towards the tool."""
    length = sum(joint.span() for joint in arm.joints) + float(np.linalg.norm(arm.tool[:3, 3]))
    return _RADIUS * length * np.linspace(1.0, _LAST, arm.n)


def guessed_solids(arm: Arm, gripper: float = 0.0) -> tuple[tuple[Solid, ...], ...]:
    """Return capsules for each link, in its frame.

    A link begins on the axis of its joint, at the end of the shift along it, and ends at the origin of its frame; a
    slide begins where it is at its lower limit.

    Args:
        arm: the arm.
        gripper: how far the solids of a gripper reach from the tool point back along a [m]; the last link ends there.
    """
    radii = guessed_radii(arm)
    return tuple(
        tuple(_along(arm, i, float(radii[i]), gripper)) or _ball(arm, i, float(radii[i]), gripper) for i in range(arm.n)
    )


def _ball(arm: Arm, i: int, radius: float, gripper: float) -> tuple[Solid, ...]:
    """Return the ball of a link without length; none where a gripper is there instead."""
    return () if i + 1 == arm.n and gripper else (Solid(shape=Sphere(radius=radius)),)


def _along(arm: Arm, i: int, radius: float, gripper: float) -> list[Solid]:
    """Return the capsules along the steps of one row of the table, in the frame of the link."""
    joint = arm.joints[i]
    behind = np.linalg.inv(joint.behind)
    # The link moves with the joint: seen from it, the axis is fixed. Frame i-1 is d behind along the axis, at most.
    foot = behind[:3, 3]
    shift = joint.d if joint.revolute else joint.d + float(np.clip(joint.limits.lower, -10.0, 10.0))
    corners = [foot - behind[:3, 2] * shift, foot, np.zeros(3)]
    steps = list(pairwise(corners))
    if i + 1 == arm.n and gripper:
        steps = [_before(arm.tool, gripper + radius, a, b) for a, b in steps]
    return [_capsule(a, b, radius) for a, b in steps if np.linalg.norm(b - a) > _SHORT * radius]


def _before(tool: Array, room: float, a: Array, b: Array) -> tuple[Array, Array]:
    """Return what of the line from one point to another is at least so far before the tool point [m]."""
    ahead, towards = ((tool[:3, 3] - end) @ tool[:3, 2] - room for end in (a, b))
    if ahead <= 0:
        return a, a
    return a, b if towards >= 0 else a + (b - a) * ahead / (ahead - towards)


def _capsule(a: Array, b: Array, radius: float) -> Solid:
    """Return the capsule from one point to another."""
    along = b - a
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z], axis=1)
    return Solid(shape=Capsule(radius=radius, length=length), pose=homogeneous(R, (a + b) / 2))
