"""What an arm holds parts with, as bodies of a world: two coupled fingers, or a cup of suction.

The fingers open along o of the tool and point along a; the tool point is between their tips. Each presses with a force
that is limited, so what they hold slides when its weight and inertia exceed what Coulomb friction of both can bear.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from armwright.cell.scene import Gripper
from armwright.mujoco_library import load_mujoco
from armwright.physics.geoms import add_geom
from armwright.physics.hand_solids import gripper_solids
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Solid, Sphere

# The lip of a cup, as balls: their number, radius, and distance from its axis [m].
LIP, _LIP_RADIUS, _LIP_DISTANCE = 4, 2e-3, 13e-3
# A cup takes hold of what is so near [m], where so many balls touch a face so flat: by the cosine of its tilt.
_NEAR, LIP_TOUCHES, _FLAT = 1e-3, 3, 0.99
# Fingers weigh next to nothing: the model of the arm has the gripper among its own masses [kg], [kg m²].
_FINGER_MASS, _FINGER_INERTIA = 5e-3, 1e-6
# What the drive of a finger moves, and its damping; gains with which it is positioned.
_DRIVE_INERTIA, _DRIVE_DAMPING, _STIFFNESS, _SPEED_GAIN = 0.1, 20.0, 4000.0, 60.0
# Damping of friction of held parts, by the step of the world.
_FRICTION_DAMPING = 1.9
# So far inside what they hold fingers are sent [m]: the limit of their force decides.
_INSIDE = 0.01
# A soft constraint of one geom with what it touches: rolling and torsional friction are small.
_ROLLING = (0.005, 1e-4)
_STIFF = (0.95, 0.99, 0.001, 0.5, 2.0)
# Contacts of pads with what they do not hold: time constant [s] and damping; from 0 to full stiffness within 3 mm.
_TOUCH, _YIELDING = (5e-3, 1.0), (0.01, 0.9, 0.003, 0.5, 1.0)


def add_gripper(spec: Any, name: str, tool: Any, gripper: Gripper, **geoms: Any) -> None:
    """Add a gripper to the tool of an arm: bodies ``NAME/left`` and ``NAME/right``, or geoms of a cup.

    Args:
        spec: of the world.
        name: of the arm.
        tool: its body.
        gripper: what it holds parts with.
        geoms: options of all geoms.
    """
    pads = {
        "friction": (gripper.friction, *_ROLLING),
        "condim": 4,
        # What they touch but do not hold yields like a spring, so that the force of a contact grows with its depth and
        # is no blow: before what stands, which is stiffer, and behind the plane, which is a spring itself.
        "solref": _TOUCH,
        "solimp": _YIELDING,
        "priority": 3,
    }
    if gripper.kind == "suction":
        _add_cup(spec, name, tool, gripper, geoms | pads)
        return
    left, right, palm = gripper_solids(gripper, 0.0)
    add_geom(spec, tool, f"{name}/palm", Solid(shape=palm.shape, pose=palm.pose), mass=0.0, **geoms)
    for side, sign, pad in (("left", 1.0, left), ("right", -1.0, right)):
        finger = _add_finger(spec, tool, f"{name}/{side}", sign, gripper)
        solid = Solid(shape=pad.shape, pose=pad.pose)
        add_geom(spec, finger, f"{name}/{side} finger", solid, mass=0.0, **geoms | pads)
    _couple(spec, name)


def grip(spec: Any, name: str, gripper: Gripper, part: str) -> None:
    """Let the pads of an arm hold a part by friction that lets it slip as little as can be.

    MuJoCo's contacts leave out the centripetal acceleration of what they carry, so a part that is carried on a curve
    slips at 1 / damping - step / 2 times that acceleration. Friction is damped by nearly 2 / step; beyond that it would
    swing.

    Args:
        spec: of the world, with the gripper and the part in it.
        name: of the arm.
        gripper: its gripper.
        part: name of the part and of its geom.
    """
    step, sliding = spec.option.timestep, gripper.friction
    for pad in pad_names(gripper):
        pair = spec.add_pair(name=f"{name}/{pad} {part}", geomname1=f"{name}/{pad}", geomname2=part)
        pair.condim, pair.friction = 4, (sliding, sliding, _ROLLING[0], _ROLLING[1], _ROLLING[1])
        pair.solref, pair.solimp = (2 * step, 1.0), _STIFF
        pair.solreffriction = (-1.0, -_FRICTION_DAMPING * _STIFF[1] / step)
        pair.gap = 0.0 if gripper.kind == "fingers" else _NEAR


def pad_names(gripper: Gripper) -> list[str]:
    """Return the names of the geoms that touch what a gripper holds."""
    return ["left finger", "right finger"] if gripper.kind == "fingers" else [f"lip{i}" for i in range(LIP)]


def _add_cup(spec: Any, name: str, tool: Any, gripper: Gripper, options: dict[str, Any]) -> None:
    """Add a cup, which stands a little behind its lip."""
    behind = homogeneous(np.eye(3), (0.0, 0.0, -_LIP_RADIUS))
    for it in gripper_solids(gripper, 0.0):
        part = it.name.removeprefix("suction ")
        add_geom(spec, tool, f"{name}/{part}", Solid(shape=it.shape, pose=behind @ it.pose), mass=0.0, **options)
    for i in range(LIP):
        angle = 2 * np.pi * i / LIP
        where = (_LIP_DISTANCE * np.cos(angle), _LIP_DISTANCE * np.sin(angle), -_LIP_RADIUS)
        ball = Solid(shape=Sphere(radius=_LIP_RADIUS), pose=homogeneous(np.eye(3), where))
        # What is in the gap is pulled at, and does not push.
        add_geom(spec, tool, f"{name}/lip{i}", ball, mass=0.0, gap=_NEAR, **options)


def _add_finger(spec: Any, tool: Any, name: str, sign: float, gripper: Gripper) -> Any:
    """Add a finger to a tool, with its slide and its drive, and return its body."""
    mujoco = load_mujoco()
    finger = tool.add_body(name=name, gravcomp=1.0)
    finger.explicitinertial, finger.mass, finger.inertia = True, _FINGER_MASS, (_FINGER_INERTIA,) * 3
    finger.ipos = np.zeros(3)
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
    mujoco = load_mujoco()
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
        sides = () if gripper.kind == "suction" else ("left", "right")
        self._actuators: npt.NDArray[np.intp] = np.array(
            [model.actuator(f"{name}/{side}").id for side in sides], dtype=np.intp
        )
        self._fingers = gripper.kind == "fingers"
        self.positions: npt.NDArray[np.intp] = np.array([], dtype=np.intp)
        if self._fingers:
            self.positions = np.array([model.joint(f"{name}/{side}").qposadr[0] for side in sides])
        lip = () if self._fingers else range(LIP)
        self._lip = np.array([model.geom(f"{name}/lip{i}").id for i in lip], dtype=np.intp)
        self._tool, self._bodies = model.body(f"{name}/tool").id, model.geom_bodyid
        # The body that a cup pulls at; none yet.
        self._pulled = -1
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
        if not self._fingers:
            self._pull(data)
        elif self._tick < self._ticks:
            self._tick += 1
            data.ctrl[self._actuators] = self._from + (self._to - self._from) * self._tick / self._ticks

    def _pull(self, data: Any) -> None:
        """Pull at what the cup lies on with a flat face."""
        if self._pulled >= 0:
            data.xfrc_applied[[self._pulled, self._tool]] = 0.0
        self._pulled = self._under(data) if self._to else -1
        if self._pulled < 0:
            return
        force = -self.gripper.force * data.xmat[self._tool].reshape(3, 3)[:, 2]
        for body, pull in ((self._pulled, force), (self._tool, -force)):
            # Forces are applied at centres of mass.
            lever = data.xpos[self._tool] - data.xipos[body]
            data.xfrc_applied[body] = *pull, *np.cross(lever, pull)

    def _under(self, data: Any) -> int:
        """Return the body on a flat face of which a cup lies; -1 where there is none."""
        pairs = data.contact.geom
        lips = np.isin(pairs, self._lip)
        axis = data.xmat[self._tool].reshape(3, 3)[:, 2]
        flat = lips.any(axis=1) & (np.abs(data.contact.frame[:, :3] @ axis) > _FLAT)
        if int(flat.sum()) < LIP_TOUCHES:
            return -1
        others = self._bodies[np.where(lips[flat, 0], pairs[flat, 1], pairs[flat, 0])]
        return int(others[0]) if (others == others[0]).all() else -1

    def copy(self) -> GripperDrive:
        """Return a drive in the same state."""
        return copy.copy(self)
