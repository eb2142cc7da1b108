"""Guessed solids of an arm of which only the joints are known: capsules along its Denavit-Hartenberg steps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_with_z
from armwright.spatial.shapes import Capsule, Solid, Sphere

# The radius of the first link by the length of the arm, and of the last by that of the first.
_RADIUS, _LAST = 0.05, 0.5
# A step shorter than this part of the radius is within the solids beside it.
_SHORT = 0.1


def guessed_radii(arm: Arm) -> Array:
    """Return the radius of the capsules of each link, (n,) [m]: they become thinner towards the tool."""
    length = sum(joint.span() for joint in arm.joints) + float(np.linalg.norm(arm.tool[:3, 3]))
    return _RADIUS * length * np.linspace(1.0, _LAST, arm.n)


def guessed_solids(arm: Arm) -> tuple[tuple[Solid, ...], ...]:
    """Return capsules for each link, in its frame.

    A link begins on the axis of its joint, at the end of the shift along it, and ends at the origin of its frame; a
    slide begins where it is at its lower limit.
    """
    radii = guessed_radii(arm)
    return tuple(tuple(_along(arm, i, float(radii[i]))) or (_ball(float(radii[i])),) for i in range(arm.n))


def _along(arm: Arm, i: int, radius: float) -> list[Solid]:
    """Return the capsules along the steps of one row of the table, in the frame of the link."""
    joint = arm.joints[i]
    behind = np.linalg.inv(joint.behind)
    # The link moves with the joint: seen from it, the axis is fixed. Frame i-1 is d behind along the axis, at most.
    foot = behind[:3, 3]
    shift = joint.d if joint.revolute else joint.d + float(np.clip(joint.limits.lower, -10.0, 10.0))
    corners = [foot - behind[:3, 2] * shift, foot, np.zeros(3)]
    return [_capsule(a, b, radius) for a, b in pairwise(corners) if np.linalg.norm(b - a) > _SHORT * radius]


def _capsule(a: Array, b: Array, radius: float) -> Solid:
    """Return the capsule from one point to another."""
    along = b - a
    length = float(np.linalg.norm(along))
    pose = homogeneous(rotation_with_z(along / length), (a + b) / 2)
    return Solid(shape=Capsule(radius=radius, length=length), pose=pose, guessed=True)


def _ball(radius: float) -> Solid:
    return Solid(shape=Sphere(radius=radius), guessed=True)
