"""The cell as its file tells it: arms on their bases, frames, what the camera will see, devices, obstacles."""

from __future__ import annotations

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

# A path that turns its corners without a stop has to round them, and it is gross motion.
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
        contact_height: height of a plane that gives way to whatever comes down on it [m]; None where there is none.
        contact_stiffness: how the force of that plane grows with the depth to which it is pressed in [N/m].
        contact_deepest: how deep an arm may press into it [m].
        vision_time: how long the camera takes for an answer [s].
        deviation: allowed distance from straight lines [m].
        corner: how far a path past several frames may be from the straight legs between them [m]; 20 deviations when
            left out, see ``corner_room``.
        period: of the servo [s].
        around: how to go round what stops a straight line, by ``via`` poses or ``damped`` rates; None to stop there.
    """

    name: str
    arms: Mapping[str, CellArm]
    gravity: Array = attrs.field(factory=lambda: UPRIGHT_GRAVITY, converter=_gravity)
    frames: Mapping[str, Node] = attrs.field(factory=dict)
    visions: Mapping[str, tuple[Array, ...]] = attrs.field(factory=dict)
    camera: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    camera_repeats: bool = False
    devices: frozenset[str] | None = None
    contact_height: float | None = None
    contact_stiffness: float = 2e4
    contact_deepest: float = 5e-3
    vision_time: float = 0.1
    deviation: float = 1e-3
    corner: float | None = None
    period: float = 1e-3
    around: Around | None = None

    def __attrs_post_init__(self) -> None:
        """Let every arm feel the gravity of the cell, and warn of one that states another."""
        stand = {
            name: attrs.evolve(one, arm=in_world(one.arm, one.base, self.gravity, name=f"cell '{self.name}', {name}"))
            for name, one in self.arms.items()
        }
        object.__setattr__(self, "arms", stand)

    @property
    def corner_room(self) -> float:
        """How far a path past several frames may be from the straight legs between them [m]."""
        return _CORNER_DEVIATIONS * self.deviation if self.corner is None else self.corner

    def tree(self) -> FrameTree:
        """Return the frame tree at the start: bases and hands of the arms, STATION, and the frames of the file.

        Between WORLD and the hand of an arm stands its base, so that a robot that is moved changes one line.
        """
        nodes = {"STATION": Node(parent=WORLD, relation=np.eye(4)), **self.frames}
        for name, arm in self.arms.items():
            nodes[base_name(name)] = Node(parent=WORLD, relation=arm.base)
            nodes[name] = Node(parent=base_name(name), relation=forward(arm.arm, arm.start))
        return FrameTree(nodes)
