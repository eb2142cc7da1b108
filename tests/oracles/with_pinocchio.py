"""The same arm in Pinocchio, built from the meaning of the Denavit-Hartenberg numbers and not from our code."""

import numpy as np
import pinocchio as pin

from armwright.arm.model import Arm


def _turn_z(angle: float) -> pin.SE3:
    return pin.SE3(pin.AngleAxis(angle, np.array((0.0, 0.0, 1.0))).matrix(), np.zeros(3))


def _turn_x(angle: float) -> pin.SE3:
    return pin.SE3(pin.AngleAxis(angle, np.array((1.0, 0.0, 0.0))).matrix(), np.zeros(3))


def _shift(x: float, z: float) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array((x, 0.0, z)))


def pinocchio_model(arm: Arm) -> tuple[pin.Model, pin.Data, int]:
    """Model, data and the id of the tool frame."""
    model = pin.Model()
    parent, place = 0, pin.SE3(arm.base)
    for i, (joint, link) in enumerate(zip(arm.joints, arm.links, strict=True)):
        kind = pin.JointModelRZ() if joint.revolute else pin.JointModelPZ()
        parent = model.addJoint(parent, kind, place, f"joint {i + 1}")
        place = _turn_z(joint.theta) * _shift(0.0, joint.d) * _shift(joint.a, 0.0) * _turn_x(joint.alpha)
        model.appendBodyToJoint(parent, pin.Inertia(link.mass, link.com, link.inertia), place)
    tool = model.addFrame(pin.Frame("tool", parent, place * pin.SE3(arm.tool), pin.FrameType.OP_FRAME))
    model.gravity.linear = arm.gravity.copy()
    return model, model.createData(), tool
