"""What moves joints of a model of MuJoCo together: equalities and tendons, of which some are coupled drives."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from armwright.arm.coupling import Coupling
from armwright.arm.drive import Motor
from armwright.arm.limits import Limits
from armwright.arm.mjcf.drives import NO_LIMIT, forces_of
from armwright.arm.model import Arm
from armwright.errors import InvalidValueError
from armwright.mujoco_library import load_mujoco

# What armwright calls the tendon of a drive, with the name of the arm before it in the file of a cell.
_DRIVE = re.compile(r"(?:.*/)?drive([1-9]\d{0,3})")


def with_coupling(model: Any, arm: Arm, numbers: Mapping[str, int]) -> Arm:
    """Return an arm with the coupled drives that stand as tendons ``drive1`` and so on in its file.

    Args:
        model: of MuJoCo.
        arm: the arm, with n joints.
        numbers: of joints in the model, by name.

    Raises:
        InvalidValueError: such a tendon has joints that are none of the arm, or the drives have no inverse.
    """
    mujoco = load_mujoco()
    joints = {numbers[joint.name]: i for i, joint in enumerate(arm.joints)}
    tendons = {}
    for number in range(model.ntendon):
        drive, on = _drive_of(model, number), _joints_of_tendon(mujoco, model, number)
        if drive is None or not on & joints.keys():
            continue
        if not on <= joints.keys() or drive >= arm.n:
            raise InvalidValueError(
                f"the tendon '{model.tendon(number).name}' is a drive of joints that are not all moved by the arm"
            )
        tendons[drive] = number
    if not tendons:
        return arm
    T, motors, limits = np.eye(arm.n), list(arm.motors), []
    for drive, joint in enumerate(joints):
        if drive in tendons:
            T[drive] = 0.0
            first = int(model.tendon_adr[tendons[drive]])
            for i in range(first, first + int(model.tendon_num[tendons[drive]])):
                T[drive, joints[int(model.wrap_objid[i])]] = float(model.wrap_prm[i])
            if not np.array_equal(T[drive], np.eye(arm.n)[drive]):
                motors[drive] = _motor_of(model, tendons[drive])
        limits.append(_limits_of(model, joint, tendons.get(drive)))
    own = [
        attrs.evolve(each, limits=attrs.evolve(each.limits, effort=_own_effort(model, joint)))
        for each, joint in zip(arm.joints, joints, strict=True)
    ]
    inverse = Coupling(matrix=T).inverse
    return attrs.evolve(arm, joints=own, motors=motors, coupling=Coupling(matrix=inverse, limits=limits))


def _drive_of(model: Any, tendon: int) -> int | None:
    """Return which drive a tendon is, from 0; None where it is none."""
    found = _DRIVE.fullmatch(model.tendon(tendon).name)
    first, wraps = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    joint = load_mujoco().mjtWrap.mjWRAP_JOINT
    if found is None or any(model.wrap_type[i] != joint for i in range(first, first + wraps)):
        return None
    return int(found[1]) - 1


def _motor_of(model: Any, tendon: int) -> Motor:
    """Return the inertia and the friction of the drive that a tendon is."""
    dry = float(model.tendon_frictionloss[tendon])
    return Motor(
        inertia=float(model.tendon_armature[tendon]),
        viscous=float(np.ravel(model.tendon_damping[tendon])[0]),
        coulomb_forward=dry,
        coulomb_backward=dry,
    )


def _limits_of(model: Any, joint: int, tendon: int | None) -> Limits:
    """Return the limits of a drive: the range of its tendon, and the largest force of its motor."""
    lower, upper = -math.inf, math.inf
    if tendon is not None and model.tendon_limited[tendon]:
        lower, upper = (x if abs(x) < NO_LIMIT else math.copysign(math.inf, x) for x in model.tendon_range[tendon])
    kinds = load_mujoco().mjtTrn
    ends = [(int(kinds.mjTRN_JOINT), joint), (int(kinds.mjTRN_TENDON), tendon)]
    acting = [i for i in range(model.nu) if (int(model.actuator_trntype[i]), int(model.actuator_trnid[i][0])) in ends]
    effort = min((float(forces_of(model, i)[1]) for i in acting), default=math.inf)
    return Limits(lower=float(lower), upper=float(upper), effort=effort if 0 < effort < NO_LIMIT else math.inf)


def _own_effort(model: Any, joint: int) -> float:
    """Return the largest effort of a joint that drives together move."""
    return float(model.jnt_actfrcrange[joint][1]) if model.jnt_actfrclimited[joint] else math.inf


def couplings(model: Any) -> dict[int, str]:
    """Return what couples joints to something else but coupled drives, in words, by the numbers of the joints."""
    mujoco = load_mujoco()
    coupled: dict[int, str] = {}
    tendons = [_joints_of_tendon(mujoco, model, i) for i in range(model.ntendon)]
    for number, joints in enumerate(tendons):
        for joint in joints if _drive_of(model, number) is None else ():
            coupled.setdefault(joint, f"the tendon {_called(model.tendon(number).name, number)} acts on it")
    kinds = mujoco.mjtEq
    for number in range(model.neq):
        if not model.eq_active0[number]:
            continue
        kind, ends = model.eq_type[number], (int(model.eq_obj1id[number]), int(model.eq_obj2id[number]))
        if kind == kinds.mjEQ_JOINT:
            joints = {end for end in ends if end >= 0}
        elif kind == kinds.mjEQ_TENDON:
            joints = {joint for end in ends if end >= 0 for joint in tendons[end]}
        else:
            site = model.eq_objtype[number] == mujoco.mjtObj.mjOBJ_SITE
            joints = _joints_between(model, *(int(model.site_bodyid[end]) if site else end for end in ends))
        for joint in joints:
            coupled.setdefault(joint, f"the equality {_called(model.equality(number).name, number)} acts on it")
    return coupled


def _called(name: str, number: int) -> str:
    return f"'{name}'" if name else f"number {number + 1}"


def _joints_of_tendon(mujoco: Any, model: Any, tendon: int) -> set[int]:
    """Return the joints that a tendon is made of, or that move its sites against one another."""
    joints: set[int] = set()
    before: int | None = None
    first = int(model.tendon_adr[tendon])
    for i in range(first, first + int(model.tendon_num[tendon])):
        kind, number = model.wrap_type[i], int(model.wrap_objid[i])
        if kind == mujoco.mjtWrap.mjWRAP_JOINT:
            joints.add(number)
        elif kind == mujoco.mjtWrap.mjWRAP_SITE:
            body = int(model.site_bodyid[number])
            joints |= set() if before is None else _joints_between(model, before, body)
            before = body
    return joints


def _joints_between(model: Any, body: int, other: int) -> set[int]:
    """Return the joints that move one body against another."""
    return _joints_above(model, body) ^ _joints_above(model, other)


def _joints_above(model: Any, body: int) -> set[int]:
    """Return the joints between a body and the world."""
    joints: set[int] = set()
    while body > 0:
        first = int(model.body_jntadr[body])
        joints |= set(range(first, first + int(model.body_jntnum[body])))
        body = int(model.body_parentid[body])
    return joints
