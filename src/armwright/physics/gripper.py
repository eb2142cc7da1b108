"""What an arm holds parts with, as bodies of a world: two coupled fingers, or a cup of suction.

The fingers open along o of the tool and point along a; the tool point is between their tips. Each presses with a force
that is limited, so what they hold slides when its weight and inertia exceed what Coulomb friction of both can bear.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.cell.scene import Gripper
from armwright.physics.geoms import add_geom
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Box, Cylinder, Shape, Solid

# Half lengths of the pads along n, o and a of the tool [m].
_PAD = np.array([0.01, 0.004, 0.015])
# What carries the pads: their height, and that of the palm above the tool point [m].
_BONE_LENGTH, _PALM_HEIGHT, _PALM = 0.07, 0.1, np.array([0.03, 0.0, 0.024])
# A cup of suction: its radius and height [m].
_CUP_RADIUS, _CUP_HEIGHT = 0.015, 0.02
# Fingers weigh next to nothing: the model of the arm has the gripper among its own masses [kg], [kg m²].
_FINGER_MASS, _FINGER_INERTIA = 5e-3, 1e-6
# What the drive of a finger moves, and its damping; gains with which it is positioned.
_DRIVE_INERTIA, _DRIVE_DAMPING, _STIFFNESS, _SPEED_GAIN = 0.1, 20.0, 4000.0, 60.0
# So far inside what they hold fingers are sent [m]: the limit of their force decides.
_INSIDE = 0.01
# A soft constraint of one geom with what it touches: rolling and torsional friction are small.
_ROLLING = (0.005, 1e-4)
_STIFF = (0.95, 0.99, 0.001, 0.5, 2.0)


class GripperSolid(NamedTuple):
    """A solid of a gripper in the frame of the tool, with its fingers open."""

    name: str
    solid: Solid


def gripper_solids(gripper: Gripper) -> list[GripperSolid]:
    """Return the solids of a gripper in the frame of the tool, with its fingers open."""
    if gripper.kind == "suction":
        return [GripperSolid("cup", _at(Cylinder(radius=_CUP_RADIUS, length=_CUP_HEIGHT), 0.0, -_CUP_HEIGHT / 2))]
    solids = [GripperSolid("palm", _palm(gripper))]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shift = homogeneous(np.eye(3), (0.0, sign * gripper.opening / 2, 0.0))
        solids += [GripperSolid(f"{side} finger", solid.moved(shift)) for solid in _finger(sign)]
    return solids


def gripper_length(gripper: Gripper) -> float:
    """Return how far a gripper reaches from the tool point back along a [m]."""
    return _CUP_HEIGHT if gripper.kind == "suction" else _PALM_HEIGHT + float(_PALM[2])


def _at(shape: Shape, y: float, z: float) -> Solid:
    return Solid(shape=shape, pose=homogeneous(np.eye(3), (0.0, y, z)))


def _palm(gripper: Gripper) -> Solid:
    size = np.array([_PALM[0], gripper.opening + 8 * _PAD[1], _PALM[2]])
    return _at(Box(size=size), 0.0, -_PALM_HEIGHT - _PALM[2] / 2)


def _finger(sign: float) -> list[Solid]:
    """Return the pad of a finger, and what carries it."""
    bone = np.array([0.016, 2 * _PAD[1], _BONE_LENGTH])
    return [
        _at(Box(size=2 * _PAD), sign * _PAD[1], -_PAD[2]),
        _at(Box(size=bone), sign * 2 * _PAD[1], -2 * _PAD[2] - _BONE_LENGTH / 2),
    ]


def add_gripper(spec: Any, name: str, tool: Any, gripper: Gripper, timestep: float, **geoms: Any) -> None:
    """Add a gripper to the tool of an arm: bodies ``NAME/left`` and ``NAME/right``, or a geom ``NAME/cup``.

    Args:
        spec: of the world.
        name: of the arm.
        tool: its body.
        gripper: what it holds parts with.
        timestep: of the world [s].
        geoms: options of all geoms.
    """
    pads = {
        "friction": (gripper.friction, *_ROLLING),
        "condim": 4,
        # The stiffest that MuJoCo lets pass: held parts slip by less the stiffer the contact is while a carry turns.
        "solref": (2 * timestep, 1.0),
        "solimp": _STIFF,
    }
    if gripper.kind == "suction":
        _add_cup(spec, name, tool, gripper, geoms | pads)
        return
    add_geom(spec, tool, f"{name}/palm", _palm(gripper), mass=0.0, **geoms)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        finger = _add_finger(spec, tool, f"{name}/{side}", sign, gripper)
        pad, bone = _finger(sign)
        add_geom(spec, finger, f"{name}/{side} pad", pad, **{**geoms, **pads, "priority": 1, "mass": 0.0})
        add_geom(spec, finger, f"{name}/{side} finger", bone, mass=0.0, **geoms)
    _couple(spec, name)


def _add_cup(spec: Any, name: str, tool: Any, gripper: Gripper, options: dict[str, Any]) -> None:
    import mujoco  # noqa: PLC0415 - only cells with several bodies need it

    # A body of its own, which pulls on what it touches.
    body = tool.add_body(name=f"{name}/cup")
    (cup,) = gripper_solids(gripper)
    add_geom(spec, body, f"{name}/cup", cup.solid, mass=0.0, **options)
    pull = spec.add_actuator(name=f"{name}/suction", target=f"{name}/cup", trntype=mujoco.mjtTrn.mjTRN_BODY)
    pull.set_to_adhesion(gain=gripper.force)
    pull.ctrlrange = (0.0, 1.0)


def _add_finger(spec: Any, tool: Any, name: str, sign: float, gripper: Gripper) -> Any:
    """Add a finger to a tool, with its slide and its drive, and return its body."""
    import mujoco  # noqa: PLC0415 - only cells with several bodies need it

    finger = tool.add_body(name=name, gravcomp=1.0)
    finger.explicitinertial, finger.mass, finger.inertia = True, _FINGER_MASS, (_FINGER_INERTIA,) * 3
    slide = finger.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=(0.0, sign, 0.0),
        armature=_DRIVE_INERTIA,
        damping=[_DRIVE_DAMPING, 0.0, 0.0],
    )
    slide.limited, slide.range = mujoco.mjtLimited.mjLIMITED_TRUE, (0.0, gripper.opening / 2)
    drive = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    drive.set_to_position(kp=_STIFFNESS, kv=_SPEED_GAIN)
    drive.forcelimited, drive.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, (-gripper.force, gripper.force)
    return finger


def _couple(spec: Any, name: str) -> None:
    """Let both fingers of an arm be equally far open: without that a part floats between two forces."""
    import mujoco  # noqa: PLC0415 - only cells with several bodies need it

    coupling = spec.add_equality(
        name=f"{name}/fingers",
        type=mujoco.mjtEq.mjEQ_JOINT,
        name1=f"{name}/left",
        name2=f"{name}/right",
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
    )
    coupling.data = [0.0, 1.0] + [0.0] * (len(coupling.data) - 2)
    coupling.solref, coupling.solimp = (4 * spec.option.timestep, 1.0), _STIFF


class GripperDrive:
    """The drive of a gripper in a compiled world: where its fingers are sent, step by step."""

    def __init__(self, model: Any, name: str, gripper: Gripper) -> None:
        """Begin with the fingers open."""
        self.gripper = gripper
        sides = ("suction",) if gripper.kind == "suction" else ("left", "right")
        self._actuators: npt.NDArray[np.intp] = np.array([model.actuator(f"{name}/{side}").id for side in sides])
        self._fingers = gripper.kind == "fingers"
        self.positions: npt.NDArray[np.intp] = np.array([], dtype=np.intp)
        if self._fingers:
            self.positions = np.array([model.joint(f"{name}/{side}").qposadr[0] for side in sides])
        self._addresses: list[int] = self.positions.tolist() if self._fingers else []
        self._from = self._to = gripper.opening / 2 if self._fingers else 0.0
        self._tick, self._ticks = 0, 0

    @property
    def closing(self) -> bool:
        """Whether it holds, or is about to."""
        return self._to < 0 if self._fingers else self._to > 0

    def start(self, data: Any) -> None:
        """Open the fingers of a new world."""
        if self._fingers:
            data.qpos[self.positions] = self._to
        data.ctrl[self._actuators] = self._to

    def send(self, data: Any, *, closed: bool, width: float | None, ticks: int) -> None:
        """Send the fingers to a width within so many steps, or altogether."""
        if self._fingers:
            target = -_INSIDE if closed else self.gripper.opening / 2
            if width is not None:
                target = width / 2 - (_INSIDE if closed else 0.0)
            self._from, self._to = float(data.qpos[self.positions].mean()), target
        else:
            self._from = self._to = 1.0 if closed else 0.0
        self._tick, self._ticks = 0, ticks

    def step(self, data: Any) -> None:
        """Command the next step."""
        if self._tick < self._ticks:
            self._tick += 1
            data.ctrl[self._actuators] = self._from + (self._to - self._from) * self._tick / self._ticks

    def opening(self, data: Any) -> float:
        """Return the distance between the fingers [m]; 0 for suction."""
        return float(sum(data.qpos[position] for position in self._addresses))

    def copy(self) -> GripperDrive:
        """Return a drive in the same state."""
        other = object.__new__(GripperDrive)
        other.__dict__.update(self.__dict__)
        return other

    @property
    def state(self) -> Array:
        """What changes, as numbers."""
        return np.array([self._from, self._to, self._tick, self._ticks])
