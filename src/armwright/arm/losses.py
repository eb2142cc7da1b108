"""What of an arm neither URDF nor MJCF can hold, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

from armwright.arm.drive import Motor
from armwright.arm.model import Arm


def mean_dry_friction(motor: Motor) -> float:
    """Return the Coulomb friction of a drive as one number for both directions, [N m] or [N]."""
    return (motor.coulomb_forward + motor.coulomb_backward) / 2


def lost_of_joint(arm: Arm, index: int) -> Iterator[str]:
    """Say what of one joint, from 0, and its drive is lost."""
    label, joint, motor = arm.joint_label(index), arm.joints[index], arm.motors[index]
    units = joint.units
    if motor.gear_ratio != 1:
        yield f"{label}: the gear ratio {motor.gear_ratio:g} is not in the file"
    if motor.coulomb_forward != motor.coulomb_backward:
        forward, backward, mean = motor.coulomb_forward, motor.coulomb_backward, mean_dry_friction(motor)
        yield (
            f"{label}: Coulomb friction of {forward:g} {units.effort} forward and {backward:g} {units.effort} backward "
            f"is {mean:g} {units.effort} in both directions in the file"
        )
    if math.isfinite(motor.stiffness):
        yield f"{label}: the stiffness of its gear, {motor.stiffness:g} {units.stiffness}, is not in the file"
    terms = {"offset": motor.offset, "Stribeck term": motor.stribeck, "cube-root term": motor.cube_root}
    for name, value in terms.items():
        if value:
            yield f"{label}: the {name} of the friction, {value:g} {units.effort}, is not in the file"
    if math.isfinite(joint.limits.acceleration):
        largest = f"{joint.limits.acceleration:g} {units.position}/s²"
        yield f"{label}: the maximum acceleration, {largest}, is not in the file"


def lost_beside_joints(arm: Arm) -> list[str]:
    """Say what is lost of an arm beside its joints and links."""
    lost = []
    for name, value, unit in (("reach", arm.reach, "m"), ("hand speed", arm.tool_speed, "m/s")):
        if math.isfinite(value):
            lost.append(f"the {name} of {value:g} {unit} is not in the file")
    if arm.uncertainty is not None:
        lost.append("the uncertainty of its dimensions is not in the file")
    return lost + [f"the {name} is not in the file" for name in ("title", "source") if getattr(arm, name)]
