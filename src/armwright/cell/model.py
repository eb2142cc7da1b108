"""The cell as its file describes it: arms on their bases, frames, what the camera will see, devices, obstacles."""

from collections.abc import Mapping
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.gravity import in_world
from armwright.arm.model import UPRIGHT_GRAVITY, Arm
from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, floats
from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.errors import ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.poses import one_pose

# A path that passes its corners without a stop has to round them, and it is gross motion.
_CORNER_DEVIATIONS = 20.0

Around: TypeAlias = Literal["via", "damped"]


def _configuration(value: ArrayLike) -> Array:
    q = floats(value, "start")
    q.setflags(write=False)
    return q


def _gravity(value: ArrayLike) -> Array:
    return exact_shape(value, (3,), "gravity", LARGEST)


def base_name(arm: str) -> str:
    """Return the name of the frame that the base of an arm is; no program can write it."""
    return f"{arm}.BASE"


@attrs.frozen(kw_only=True, eq=False)
class CellArm:
    """One arm of a cell.

    Attributes:
        arm: the model.
        base: (4, 4) pose of its base frame in the world.
        start: (n,) joint positions at the start.
        open_time: how long the fingers take to open [s].
        grasp_time: how long they take to close [s].
    """

    arm: Arm
    base: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    start: Array = attrs.field(converter=_configuration)
    open_time: float = 0.3
    grasp_time: float = 0.3

    def __attrs_post_init__(self) -> None:
        """Refuse a start that does not fit the arm."""
        if self.start.shape != (self.arm.n,):
            raise ShapeError(f"start: expected {self.arm.n} numbers, one per joint, got shape {self.start.shape}")


@attrs.frozen(kw_only=True)
class ContactPlane:
    """A horizontal plane that is pressed in by whatever comes down on it.

    Attributes:
        height: above the origin of the world [m]; None where there is no plane.
        stiffness: force per depth [N/m].
        deepest: depth to which an arm may press into it [m].
    """

    height: float | None = None
    stiffness: float = 2e4
    deepest: float = 5e-3


@attrs.frozen(kw_only=True, eq=False)
class Cell:
    """A cell. Its arms feel its gravity, whatever they feel outside of it.

    Attributes:
        name: as shown to people.
        arms: by name, such as ``ARM_1``; the gravity of each model is that of the cell, along the axes of its base.
        gravity: (3,) acceleration of free fall along the axes of the world [m/s²].
        frames: by name, in upper case.
        visions: by frame name, what the camera will report, one answer after the other, (4, 4) seen from the camera.
        camera_repeats: whether the camera goes on with its last answer for a frame when there are no more; without it,
            it finds nothing then.
        camera: (4, 4) pose of the camera in the world.
        devices: names of the tools that can be operated; None when the cell does not say, and any will do.
        contact: plane on which arms and what they carry come down.
        vision_time: how long the camera takes for an answer [s].
        deviation: allowed distance from straight lines [m].
        corner: how far a path past several frames may be from the straight legs between them [m]; 20 deviations when
            left out, see ``corner_room``.
        period: of the servo [s].
        around: the kind of detour of a straight line, by ``via`` poses or ``damped`` rates; None to stop there.
    """

    name: str
    arms: Mapping[str, CellArm]
    gravity: Array = attrs.field(factory=lambda: UPRIGHT_GRAVITY, converter=_gravity)
    frames: Mapping[str, Node] = attrs.field(factory=dict)
    visions: Mapping[str, tuple[Array, ...]] = attrs.field(factory=dict)
    camera: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    camera_repeats: bool = False
    devices: frozenset[str] | None = None
    contact: ContactPlane = attrs.field(factory=ContactPlane)
    vision_time: float = 0.1
    deviation: float = 1e-3
    corner: float | None = None
    period: float = 1e-3
    around: Around | None = None

    def __attrs_post_init__(self) -> None:
        """Let every arm feel the gravity of the cell, and warn of one that states another."""
        stand = {
            name: attrs.evolve(arm, arm=in_world(arm.arm, arm.base, self.gravity, name=f"cell '{self.name}', {name}"))
            for name, arm in self.arms.items()
        }
        object.__setattr__(self, "arms", stand)

    @property
    def corner_room(self) -> float:
        """How far a path past several frames may be from the straight legs between them [m]."""
        return _CORNER_DEVIATIONS * self.deviation if self.corner is None else self.corner

    def tree(self) -> FrameTree:
        """Return the frame tree at the start: bases and hands of the arms, STATION, and the frames of the file.

        Between WORLD and the gripper of an arm stands its base, so that a robot that is moved changes one line.
        """
        nodes = {"STATION": Node(parent=WORLD, relation=np.eye(4)), **self.frames}
        for name, arm in self.arms.items():
            nodes[base_name(name)] = Node(parent=WORLD, relation=arm.base)
            nodes[name] = Node(parent=base_name(name), relation=forward(arm.arm, arm.start))
        return FrameTree(nodes)
