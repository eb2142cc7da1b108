"""The same arm in Pinocchio, built from the meaning of the Denavit-Hartenberg numbers and not from our code."""

import numpy as np
import pinocchio as pin

from armwright.arm.model import Arm, Link
from armwright.arrays import Array


def _turn_z(angle: float) -> pin.SE3:
    return pin.SE3(pin.AngleAxis(angle, np.array((0.0, 0.0, 1.0))).matrix(), np.zeros(3))


def _turn_x(angle: float) -> pin.SE3:
    return pin.SE3(pin.AngleAxis(angle, np.array((1.0, 0.0, 0.0))).matrix(), np.zeros(3))


def _shift(x: float, z: float) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array((x, 0.0, z)))


def pinocchio_model(arm: Arm, *, carried: bool = False) -> tuple[pin.Model, pin.Data, int]:
    """Model, data and the id of the tool frame; links alone, without drives.

    A carried arm stands on a base that moves along three axes: the first three joints of the model.
    """
    model = pin.Model()
    parent, place = 0, pin.SE3(arm.base)
    if carried:
        parent = model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "carrier")
    for i, (joint, link) in enumerate(zip(arm.joints, arm.links, strict=True)):
        kind = pin.JointModelRZ() if joint.revolute else pin.JointModelPZ()
        parent = model.addJoint(parent, kind, place, f"joint {i + 1}")
        fixed = pin.SE3.Identity() if joint.fixed is None else pin.SE3(joint.fixed)
        place = _turn_z(joint.theta) * _shift(0.0, joint.d) * fixed * _shift(joint.a, 0.0) * _turn_x(joint.alpha)
        model.appendBodyToJoint(parent, pin.Inertia(link.mass, link.com, link.inertia), place)
    tool = model.addFrame(pin.Frame("tool", parent, place * pin.SE3(arm.tool), pin.FrameType.OP_FRAME))
    model.gravity.linear = arm.gravity.copy()
    return model, model.createData(), tool


def with_rotors(model: pin.Model, arm: Arm) -> tuple[pin.Model, pin.Data]:
    """The model with the inertia of the motors; friction Pinocchio's algorithms leave to the caller."""
    driven = pin.Model(model)
    driven.armature = np.array([motor.inertia for motor in arm.motors])
    return driven, driven.createData()


def with_load(model: pin.Model, tool: int, load: Link) -> tuple[pin.Model, pin.Data]:
    """The model with a body fixed at its tool."""
    loaded = pin.Model(model)
    frame = loaded.frames[tool]
    body = pin.Inertia(load.mass, load.com, load.inertia).se3Action(frame.placement)
    loaded.inertias[frame.parentJoint] = loaded.inertias[frame.parentJoint] + body
    return loaded, loaded.createData()


def pushed(model: pin.Model, data: pin.Data, tool: int, q: Array, wrench: Array) -> list[pin.Force]:
    """The outside forces on all joints of a model whose tool is pushed by a wrench along base axes."""
    pin.framesForwardKinematics(model, data, q)
    frame = model.frames[tool]
    at_tool = pin.SE3(np.eye(3), data.oMf[tool].translation)
    force = data.oMi[frame.parentJoint].actInv(at_tool.act(pin.Force(wrench[:3], wrench[3:])))
    return [force if joint == frame.parentJoint else pin.Force.Zero() for joint in range(model.njoints)]
