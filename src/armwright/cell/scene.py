"""What stands and lies in a cell: furniture, parts with their markers, grippers and cameras."""

from __future__ import annotations

from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.spatial.lens import Lens
from armwright.spatial.poses import one_pose
from armwright.spatial.shapes import Box, Shape

GripperKind: TypeAlias = Literal["fingers", "suction"]
SightKind: TypeAlias = Literal["part", "marker"]

# The name of the body of a table, and of the camera of a cell with one.
TABLE, CAMERA = "TABLE", "CAMERA"
# The time constant of contacts with what stands [s].
USUAL_CONTACT_TIME = 0.02


@attrs.frozen(kw_only=True, eq=False)
class Fixture:
    """A body that stands where it is.

    Attributes:
        name: in messages, such as ``NEST``.
        shape: its solid.
        pose: (4, 4) of the solid in the world.
        friction: coefficient of Coulomb friction of its surface.
        contact_time: time constant of contacts with it in a cell with physics; the shorter, the harder it is [s].
        on: the frame of the cell with which it stands elsewhere in a world; WORLD where it stands where it is.
    """

    name: str
    shape: Shape
    pose: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    friction: float = 0.8
    contact_time: float = USUAL_CONTACT_TIME
    on: str = WORLD


@attrs.frozen(kw_only=True, eq=False)
class Marker:
    """A square marker of the dictionary 4X4_50 of ArUco, on a part or in the world.

    Attributes:
        number: which one of the dictionary.
        size: length of the sides of its black square [m].
        pose: (4, 4) on the part or in the world: its centre, x to the right and y up as it is looked at, z out of it.
    """

    number: int
    size: float
    pose: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)


@attrs.frozen(kw_only=True)
class Spread:
    """How the pose of a part at the start, or of a frame, is drawn, evenly.

    Attributes:
        position: to either side along x and along y of the world [m].
        yaw: to either side about z of the world [rad].
        tilt: to either side about a horizontal axis of any direction [rad].
    """

    position: float = 0.0
    yaw: float = 0.0
    tilt: float = 0.0


@attrs.frozen(kw_only=True, eq=False)
class Part:
    """A rigid body that grippers hold and move.

    Attributes:
        name: as of a frame, in upper case.
        shape: its solid.
        mass: [kg].
        friction: coefficient of Coulomb friction of its surface.
        pose: (4, 4) of the solid in the world at the start.
        on: the frame on which it goes along, which moves by itself; WORLD where it stands.
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
    on: str = WORLD
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


@attrs.frozen(kw_only=True, eq=False)
class Camera:
    """A camera that takes pictures.

    Attributes:
        name: in messages, such as ``TOP``.
        lens: size of its pictures, focal lengths and distortion.
        pose: (4, 4) in the world, or in the tool frame of the arm that carries it: x to the right in the picture, y
            down, z forward.
        on: the arm that carries it; None where it stands.
        noise: standard deviation of its pixels, of 255.
        light: part of the light that it gets, from 0 (darkness) to 1.
    """

    name: str
    lens: Lens
    pose: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    on: str | None = None
    noise: float = 0.0
    light: float = 1.0


@attrs.frozen(kw_only=True, eq=False)
class Sight:
    """What a camera searches for when a program reads a frame.

    Attributes:
        kind: whether the frame is on a part or at a marker of the scene.
        name: of the part or of the marker.
        camera: that takes the picture; None where the cell has no camera that takes pictures.
        height: at which the part stands or the marker lies [m]; None where nothing is known of that.
        relation: (4, 4) pose of the frame on the part or at the marker.
    """

    kind: SightKind
    name: str
    camera: str | None
    height: float | None
    relation: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)


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
