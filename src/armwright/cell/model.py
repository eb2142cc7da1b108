"""The model of a cell: arms on their bases, frames, answers of the camera, devices, contact plane."""

from collections.abc import Collection, Mapping
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.gravity import in_world
from armwright.arm.model import UPRIGHT_GRAVITY, Arm
from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, floats, read_only
from armwright.cell.control import Alarms, ForceSensor, Sensors, Servo
from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.cell.moving_frames import MovingFrame
from armwright.cell.outputs import Controller, Device, Output
from armwright.cell.scene import Camera, Fixture, Gripper, Marker, Part, Sight, Spread
from armwright.cell.signals import Input
from armwright.cell.trials import Trials
from armwright.errors import ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.mode_shaping import ModeShaping
from armwright.spatial.poses import one_pose

# A path that passes its corners without a stop must round them, in gross motion.
_CORNER_DEVIATIONS = 20.0

Around: TypeAlias = Literal["via", "damped"]


def _as_configuration(value: ArrayLike) -> Array:
    return read_only(floats(value, "start"))


def _as_joint_target(value: ArrayLike) -> Array:
    return read_only(floats(value, "q"))


def _as_devices(value: Collection[str] | None) -> Mapping[str, Device] | None:
    return value if value is None or isinstance(value, Mapping) else dict.fromkeys(value, Device())


def _as_gravity(value: ArrayLike) -> Array:
    return exact_shape(value, (3,), "gravity", LARGEST)


def base_name(arm: str) -> str:
    """Return the name of the base frame of an arm, which is not valid in a program."""
    return f"{arm}.BASE"


@attrs.frozen(kw_only=True, eq=False)
class CellArm:
    """An arm of a cell.

    Attributes:
        arm: the model.
        base: (4, 4) pose of its base frame in the world.
        start: (n,) joint positions at the start.
        open_time: time in which the fingers open [s].
        grasp_time: time in which they close [s].
        gripper: what it holds parts with; None where nothing is known of it.
        servo: the controller of its joints, in a cell with physics.
        plant: the arm that stands in such a cell, where it is another than ``arm``, which its controller believes in.
        sensors: what its controller knows of its joints there.
        force_sensor: between the arm and its tool there.
        controller: what is known of its real controller.
        smooth: how a MOVE SMOOTHLY of it is shaped, against vibrations on its flexible gears.
    """

    arm: Arm
    base: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    start: Array = attrs.field(converter=_as_configuration)
    open_time: float = 0.3
    grasp_time: float = 0.3
    gripper: Gripper | None = None
    servo: Servo = attrs.field(factory=Servo)
    plant: Arm | None = None
    sensors: Sensors = attrs.field(factory=Sensors)
    force_sensor: ForceSensor = attrs.field(factory=ForceSensor)
    controller: Controller = attrs.field(factory=Controller)
    smooth: ModeShaping = attrs.field(factory=ModeShaping)

    @property
    def gripper_or_usual(self) -> Gripper:
        """What it holds parts with; the usual one where nothing is known of it."""
        return self.gripper or Gripper()

    def __attrs_post_init__(self) -> None:
        """Refuse a start of another number of joints."""
        if self.start.shape != (self.arm.n,):
            raise ShapeError(f"start: expected {self.arm.n} numbers, one per joint, got shape {self.start.shape}")


@attrs.frozen(kw_only=True, eq=False)
class JointTarget:
    """A configuration of an arm that has a name.

    Attributes:
        arm: name of the arm.
        q: (n,) its joint positions.
    """

    arm: str
    q: Array = attrs.field(converter=_as_joint_target)


@attrs.frozen(kw_only=True)
class ContactPlane:
    """A horizontal elastic plane with which arms and parts come into contact.

    Attributes:
        height: above the origin of the world [m]; None where there is no plane.
        stiffness: force per depth [N/m].
        deepest: depth to which an arm may press into it [m].
    """

    height: float | None = None
    stiffness: float = 2e4
    max_depth: float = 5e-3


@attrs.frozen(kw_only=True, eq=False)
class Cell:
    """A cell. Its gravity acts on its arms, instead of the gravity in their own files.

    Attributes:
        name: its name in messages and results.
        arms: by name, such as ``ARM_1``; the gravity of each model is that of the cell, along the axes of its base.
        gravity: (3,) acceleration of free fall along the axes of the world [m/s²].
        frames: by name, in upper case.
        moving_frames: how those of the frames move that do so by themselves, by name.
        joint_targets: configurations of arms by name, in upper case; no frame has such a name.
        spreads: how far from where programs believe it a frame, and what stands on it, may be in a world, by name.
        fixtures: bodies that stand where they are, by name.
        parts: bodies that grippers hold and move, by name.
        markers: of the scene, by name, with their poses in the world.
        cameras: that take pictures, by name.
        sights: by frame name, what a camera searches for: parts, and markers of the scene.
        visions: other answers of the camera by frame name, in order, (4, 4) relative to the camera.
        camera_repeats: whether the camera repeats its last answer for a frame; otherwise it finds nothing then.
        camera: (4, 4) pose of the camera in the world.
        devices: that can be operated, by name; None allows any name.
        inputs: that programs read, by name, and how each behaves in a simulated cell.
        contact: plane with which arms and what they carry come into contact.
        alarms: what stops a program in this cell with physics.
        vision_time: time that the camera takes for an answer [s].
        deviation: allowed distance from straight lines [m].
        corner: how far a path past several frames may be from the straight legs between them [m]; 20 deviations by
            default, see ``corner_deviation``.
        clearance: distance to other bodies below which a stage of a MOVE gets a warning [m]; 0 for none.
        period: of the servo [s].
        plan: whether a path is planned past other bodies where a point-to-point motion would run into one.
        around: the kind of detour of an infeasible straight line, by ``via`` poses or ``damped`` least squares; None
            for no detour.
        trials: what trials with physics draw, and what they must reach.
    """

    name: str
    arms: Mapping[str, CellArm]
    gravity: Array = attrs.field(factory=lambda: UPRIGHT_GRAVITY, converter=_as_gravity)
    frames: Mapping[str, Node] = attrs.field(factory=dict)
    moving_frames: Mapping[str, MovingFrame] = attrs.field(factory=dict)
    joint_targets: Mapping[str, JointTarget] = attrs.field(factory=dict)
    spreads: Mapping[str, Spread] = attrs.field(factory=dict)
    fixtures: Mapping[str, Fixture] = attrs.field(factory=dict)
    parts: Mapping[str, Part] = attrs.field(factory=dict)
    markers: Mapping[str, Marker] = attrs.field(factory=dict)
    cameras: Mapping[str, Camera] = attrs.field(factory=dict)
    sights: Mapping[str, Sight] = attrs.field(factory=dict)
    visions: Mapping[str, tuple[Array, ...]] = attrs.field(factory=dict)
    camera: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    camera_repeats: bool = False
    devices: Mapping[str, Device] | None = attrs.field(default=None, converter=_as_devices)
    inputs: Mapping[str, Input] = attrs.field(factory=dict)
    contact: ContactPlane = attrs.field(factory=ContactPlane)
    alarms: Alarms = attrs.field(factory=Alarms)
    vision_time: float = 0.1
    deviation: float = 1e-3
    corner: float | None = None
    clearance: float = 0.0
    period: float = 1e-3
    around: Around | None = None
    plan: bool = False
    trials: Trials = attrs.field(factory=Trials)

    def __attrs_post_init__(self) -> None:
        """Give every arm the gravity of the cell, with a warning where its file states another."""
        arms = {
            name: attrs.evolve(arm, arm=in_world(arm.arm, arm.base, self.gravity, name=f"cell '{self.name}', {name}"))
            for name, arm in self.arms.items()
        }
        object.__setattr__(self, "arms", arms)

    def output_of(self, device: str) -> Output | None:
        """Return the output of a controller that switches a device; None where the cell does not know it."""
        known = (self.devices or {}).get(device)
        return None if known is None else known.output

    @property
    def seen_parts(self) -> Mapping[str, str]:
        """By frame name, the part whose grasp pose a camera answers with."""
        return {name: sight.name for name, sight in self.sights.items() if sight.kind == "part"}

    @property
    def corner_deviation(self) -> float:
        """How far a path past several frames may be from the straight legs between them [m]."""
        return _CORNER_DEVIATIONS * self.deviation if self.corner is None else self.corner

    @property
    def seen_frames(self) -> frozenset[str]:
        """The frames that the camera has answers for."""
        return frozenset({*self.visions, *self.sights})

    def moving_poses(self, time: float) -> dict[str, Array]:
        """Return the poses (4, 4) in the world of the frames that move by themselves, by name, at a time [s]."""
        return {name: frame.pose_at(time) for name, frame in self.moving_frames.items()}

    @property
    def collisions_matter(self) -> bool:
        """Whether there is anything in the cell that an arm could run into: fixtures, parts or another arm."""
        return bool(self.fixtures or self.parts) or len(self.arms) > 1

    def tree(self) -> FrameTree:
        """Return the frame tree at the start: bases and hands of the arms, STATION, and the frames of the file.

        Between WORLD and the gripper of an arm is its base, so that moving a robot changes a single frame.
        """
        nodes = {"STATION": Node(parent=WORLD, relation=np.eye(4)), **self.frames}
        for name, arm in self.arms.items():
            nodes[base_name(name)] = Node(parent=WORLD, relation=arm.base)
            nodes[name] = Node(parent=base_name(name), relation=forward(arm.arm, arm.start))
        return FrameTree(nodes)
