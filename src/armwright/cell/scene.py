"""What stands and lies in a cell: furniture, parts with their markers, and grippers."""

from __future__ import annotations

from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.spatial.poses import one_pose
from armwright.spatial.shapes import Box, Shape

GripperKind: TypeAlias = Literal["fingers", "suction"]

# The name of the body of a table.
TABLE = "TABLE"


@attrs.frozen(kw_only=True, eq=False)
class Fixture:
    """A body that stands where it is.

    Attributes:
        name: in messages, such as ``NEST``.
        shape: its solid.
        pose: (4, 4) of the solid in the world.
        friction: coefficient of Coulomb friction of its surface.
    """

    name: str
    shape: Shape
    pose: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    friction: float = 0.8


@attrs.frozen(kw_only=True, eq=False)
class Marker:
    """A square marker of the dictionary 4X4_50 of ArUco, on a part.

    Attributes:
        number: which one of the dictionary.
        size: length of the sides of its black square [m].
        pose: (4, 4) on the part: its centre, x to the right and y up as it is looked at, z out of it.
    """

    number: int
    size: float
    pose: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)


@attrs.frozen(kw_only=True, eq=False)
class Spread:
    """How the pose of a part at the start is drawn, evenly.

    Attributes:
        position: to either side along x and along y of the world [m].
        yaw: to either side about z of the world [rad].
    """

    position: float = 0.0
    yaw: float = 0.0


@attrs.frozen(kw_only=True, eq=False)
class Part:
    """A rigid body that grippers hold and move.

    Attributes:
        name: as of a frame, in upper case.
        shape: its solid.
        mass: [kg].
        friction: coefficient of Coulomb friction of its surface.
        pose: (4, 4) of the solid in the world at the start.
        spread: how far from there it may be.
        grasp: (4, 4) pose on the part that a tool goes to.
        marker: by which a camera finds it; None where it has none.
        symmetry: after so many equal rotations about z, in a whole one, it is as before.
    """

    name: str
    shape: Shape
    mass: float
    friction: float = 0.8
    pose: Array = attrs.field(converter=one_pose)
    spread: Spread = attrs.field(factory=Spread)
    grasp: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    marker: Marker | None = None
    symmetry: int = 1


@attrs.frozen(kw_only=True)
class Gripper:
    """What an arm holds parts with.

    Attributes:
        kind: two parallel ``fingers`` that open along o of the tool, or ``suction`` along a.
        force: with which each finger presses, or the most that suction holds [N].
        opening: between the open fingers [m].
        friction: coefficient of Coulomb friction of its pads.
    """

    kind: GripperKind = "fingers"
    force: float = 30.0
    opening: float = 0.08
    friction: float = 1.0


def table(z: float, corner: Array, opposite: Array, thickness: float, friction: float) -> Fixture:
    """Return a table.

    Args:
        z: height of its top above the origin of the world [m].
        corner: (2,) x and y of a corner [m].
        opposite: (2,) of the opposite corner [m].
        thickness: of its top [m].
        friction: coefficient of Coulomb friction.
    """
    pose = np.eye(4)
    pose[:3, 3] = *((corner + opposite) / 2), z - thickness / 2
    size = np.array([*np.abs(opposite - corner), thickness])
    return Fixture(name=TABLE, shape=Box(size=size), pose=pose, friction=friction)
