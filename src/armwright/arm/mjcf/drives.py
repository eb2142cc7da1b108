"""Limits, drives, friction and springs of joints of a model of MuJoCo."""

from __future__ import annotations

import math
from typing import Any

from armwright.arm.drive import Motor, Spring
from armwright.arm.limits import Limits
from armwright.files.limits import limit
from armwright.mujoco_library import load_mujoco

# What MuJoCo takes as the largest number: a limit of this size says that there is none. Our own writer puts it there.
NO_LIMIT = 1e10


def limits_of(model: Any, joint: int, name: str) -> tuple[Limits, list[str]]:
    """Return the limits of a hinge or a slide, and sentences on what was not taken as it stands.

    Args:
        model: of MuJoCo.
        joint: its number.
        name: its name, for the sentences.
    """
    mujoco = load_mujoco()
    ends, notes = (-math.inf, math.inf), []
    if model.jnt_limited[joint]:
        most = limit("revolutions") * math.tau if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE else NO_LIMIT
        lower, upper = (
            end if abs(end) < most else math.copysign(math.inf, end) for end in model.jnt_range[joint].tolist()
        )
        ends = lower, upper
    backward, forward = _efforts(mujoco, model, joint)
    effort = min(-backward, forward)
    if not effort > 0:
        notes.append(f"joint '{name}': its actuators push one way only; its maximum effort is interpreted as unknown")
        effort = math.inf
    elif -backward != forward:
        notes.append(
            f"joint '{name}': efforts from {backward:g} to {forward:g} are limited to {effort:g} in both directions"
        )
    return Limits(lower=ends[0], upper=ends[1], effort=effort if effort < NO_LIMIT else math.inf), notes


def _efforts(mujoco: Any, model: Any, joint: int) -> tuple[float, float]:
    """Return the smallest and the largest effort of all actuators of a joint; infinite where one has no limit."""
    lower = upper = 0.0
    acting = [i for i in range(model.nu) if _acts_on(mujoco, model, i, joint)]
    for i in acting:
        gear = float(model.actuator_gear[i][0])
        ends = sorted(gear * force if gear else 0.0 for force in forces_of(model, i))
        lower, upper = lower + ends[0], upper + ends[1]
    if not acting:
        lower, upper = -math.inf, math.inf
    if model.jnt_actfrclimited[joint]:
        least, most = model.jnt_actfrcrange[joint].tolist()
        lower, upper = max(lower, least), min(upper, most)
    return lower, upper


def _acts_on(mujoco: Any, model: Any, actuator: int, joint: int) -> bool:
    kinds = {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}
    return int(model.actuator_trntype[actuator]) in kinds and int(model.actuator_trnid[actuator][0]) == joint


def forces_of(model: Any, actuator: int) -> tuple[float, float]:
    """Return the smallest and the largest force of an actuator."""
    mujoco = load_mujoco()
    lower, upper = -math.inf, math.inf
    if model.actuator_forcelimited[actuator]:
        lower, upper = model.actuator_forcerange[actuator].tolist()
    direct = (
        model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_NONE
    )
    first = int(model.actuator_ctrladr[actuator])
    if direct and model.actuator_ctrllimited[first]:
        ends = sorted(float(model.actuator_gainprm[actuator][0]) * end for end in model.actuator_ctrlrange[first])
        lower, upper = max(lower, ends[0]), min(upper, ends[1])
    return lower, upper


def motor_of(model: Any, joint: int, name: str) -> tuple[Motor, list[str]]:
    """Return the inertia and the friction of the drive of a joint, and sentences on what an arm does not have.

    Args:
        model: of MuJoCo.
        joint: its number.
        name: its name, for the sentences.
    """
    mujoco = load_mujoco()
    dof = int(model.jnt_dofadr[joint])
    inertia, viscous = float(model.dof_armature[dof]), float(model.dof_damping[dof])
    for i in range(model.nu):
        if _acts_on(mujoco, model, i, joint):
            squared = float(model.actuator_gear[i][0]) ** 2
            inertia += squared * float(model.actuator_armature[i])
            viscous += squared * float(model.actuator_damping[i])
    dry = float(model.dof_frictionloss[dof])
    notes = []
    if model.dof_dampingpoly[dof].any():
        notes.append(f"joint '{name}': of its damping only what is proportional to the speed is read")
    return Motor(inertia=inertia, viscous=viscous, coulomb_forward=dry, coulomb_backward=dry), notes


def spring_of(model: Any, joint: int, name: str) -> tuple[Spring, list[str]]:
    """Return the spring of a hinge or a slide, and sentences on what is not read of it.

    Args:
        model: of MuJoCo.
        joint: its number.
        name: its name, for the sentences.
    """
    stiffness, notes = float(model.jnt_stiffness[joint]), []
    if stiffness < 0:
        notes.append(f"joint '{name}': its spring, which pushes away with {-stiffness:g}, is not read")
        stiffness = 0.0
    if model.jnt_stiffnesspoly[joint].any():
        notes.append(f"joint '{name}': of its spring only the linear part is read")
    rest = float(model.qpos_spring[model.jnt_qposadr[joint]]) if stiffness else 0.0
    return Spring(stiffness=stiffness, rest=rest), notes
