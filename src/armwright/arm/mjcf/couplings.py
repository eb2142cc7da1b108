"""What moves joints of a model of MuJoCo together: equalities and tendons."""

from __future__ import annotations

from typing import Any

from armwright.mujoco_library import load_mujoco


def couplings(model: Any) -> dict[int, str]:
    """Return what couples joints to something else, in words, by the numbers of the joints."""
    mujoco = load_mujoco()
    coupled: dict[int, str] = {}
    tendons = [_joints_of_tendon(mujoco, model, i) for i in range(model.ntendon)]
    for number, joints in enumerate(tendons):
        for joint in joints:
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
