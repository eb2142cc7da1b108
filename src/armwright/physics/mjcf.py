"""Arms and cells as MJCF files, the format of MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from armwright.arm.losses import lost_beside_joints, lost_of_joint
from armwright.arm.mjcf.drives import NO_LIMIT
from armwright.arm.model import Arm
from armwright.arm.names import distinct_names, refuse_names_beyond_xml
from armwright.arm.positions import known_arm
from armwright.cell.model import Cell
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.mujoco_library import load_mujoco
from armwright.physics.cell_bodies import arm_bodies, has_solids
from armwright.physics.mjcf_text import spec_text
from armwright.physics.plant import PlantArm, add_arm, arm_indices, new_world
from armwright.physics.world_model import world_spec

# Of the world of an arm alone [s].
_TIMESTEP = 1e-3
# An arm alone does not meet itself, but what a file includes it for: geoms as MuJoCo has them if nothing is said.
_ARM_BITS = {"contype": 2, "conaffinity": 1}
# Configurations at which the mass matrices of the arm and of the file are compared.
_COMPARED, _SEED = 32, 1
# The keyframe of a cell at its start.
START = "start"


@attrs.frozen(kw_only=True)
class MjcfFile:
    """An arm or a cell as MJCF.

    Attributes:
        text: of the file, with what it has lost in comments.
        lost: what MJCF cannot represent, in sentences; none where nothing is lost.
    """

    text: str
    lost: tuple[str, ...]


def arm_mjcf(arm: Arm) -> MjcfFile:
    """Return an arm as an MJCF file.

    The bodies are ``base``, ``link1`` to ``linkn`` and ``tool``, the joints ``joint1`` to ``jointn``, unless the arm
    has names of its own; motors are named after joints.

    Raises:
        KindError: it is no arm.
        InvalidValueError: a name has characters that XML cannot hold.
        UnsupportedArmError: masses are unknown, or a joint moves no mass; the link is named.
    """
    refuse_names_beyond_xml(known_arm(arm))
    spec = new_world(arm.gravity, _TIMESTEP)
    # Solids that are guessed are not written.
    bodies = [body for body in arm_bodies("arm", arm) if has_solids(arm) or body.link == 0]
    plant = add_arm(spec, "arm", arm, np.eye(4), bodies, **_ARM_BITS)
    _set_one_sided_limits(spec, plant)
    lost = _lost_of_arm(arm, spec, plant)
    text = spec_text(spec, arm.name, _comment(lost), _Names(plant).rename)
    return MjcfFile(text=text, lost=tuple(lost))


def cell_mjcf(cell: Cell) -> MjcfFile:
    """Return a cell as an MJCF file: the world of the cell with physics, its parts at their poses without spread.

    Raises:
        InvalidValueError: a name has characters that XML cannot hold.
        UnsupportedArmError: masses of an arm are unknown.
    """
    for cell_arm in cell.arms.values():
        refuse_names_beyond_xml(cell_arm.arm)
    # Cameras and markers are pictures.
    spec, plants = world_spec(attrs.evolve(cell, cameras={}), cell.parts)
    lost: list[str] = []
    for plant in plants:
        _set_one_sided_limits(spec, plant)
        lost += [f"{plant.name}: {sentence}" for sentence in _lost_of_arm(plant.arm, spec, plant)]
    _add_start(spec, cell)
    lost += _lost_of_cell(cell)
    return MjcfFile(text=spec_text(spec, cell.name, _comment(lost)), lost=tuple(lost))


class _Names:
    """The names in the file of an arm alone."""

    def __init__(self, plant: PlantArm) -> None:
        arm, numbers = plant.arm, range(1, plant.arm.n + 1)
        own = [arm.base_link, *(link.name for link in arm.links), arm.tool_link]
        bodies = distinct_names(own, ["base", *(f"link{i}" for i in numbers), "tool"])
        joints = distinct_names([joint.name for joint in arm.joints], [f"joint{i}" for i in numbers])
        olds = ["base", *(f"link{i}" for i in numbers), "tool"]
        self._prefix = f"{plant.name}/"
        self._names = {("body", old): new for old, new in zip(olds, bodies, strict=True)}
        self._names |= {("joint", f"joint{i}"): new for i, new in zip(numbers, joints, strict=True)}
        self._names |= {("actuator", f"motor{i}"): new for i, new in zip(numbers, joints, strict=True)}
        self._names["site", "tool"] = bodies[-1]

    def rename(self, kind: str, name: str) -> str:
        """Return what something is called in the file."""
        name = name.removeprefix(self._prefix)
        return self._names.get((kind, name), name)


def _set_one_sided_limits(spec: Any, plant: PlantArm) -> None:
    """Limit joints that have one end: MuJoCo has a range of two, or none."""
    mujoco = load_mujoco()
    for i, joint in enumerate(plant.arm.joints, 1):
        ends = joint.limits.lower, joint.limits.upper
        if sum(map(math.isfinite, ends)) == 1:
            limited = spec.joint(f"{plant.name}/joint{i}")
            limited.limited = mujoco.mjtLimited.mjLIMITED_TRUE
            limited.range = np.clip(ends, -NO_LIMIT, NO_LIMIT)


def _add_start(spec: Any, cell: Cell) -> None:
    """Add a keyframe of the cell at its start: arms where they stand, fingers open."""
    model = spec.compile()
    q, control = np.array(model.qpos0), np.zeros(model.nu)
    for name, cell_arm in cell.arms.items():
        q[arm_indices(model, name, cell_arm.arm.n).positions] = cell_arm.start
        gripper = cell_arm.gripper_or_usual
        for side in ("left", "right") if gripper.kind == "fingers" else ():
            q[model.joint(f"{name}/{side}").qposadr[0]] = gripper.opening / 2
            control[model.actuator(f"{name}/{side}").id] = gripper.opening / 2
    spec.add_key(name=START, qpos=q, ctrl=control)


def _lost_of_arm(arm: Arm, spec: Any, plant: PlantArm) -> list[str]:
    """Say what of an arm is lost."""
    lost: list[str] = []
    for i, joint in enumerate(arm.joints):
        lost += lost_of_joint(arm, i)
        if math.isfinite(joint.limits.speed):
            speed = f"{joint.limits.speed:g} {joint.units.position}/s"
            lost.append(f"{arm.joint_label(i)}: the maximum speed, {speed}, is not in the file")
    if arm.coupling is not None and arm.coupling.limits:
        lost.append("of the limits of the drives, those of speed and acceleration are not in the file")
    lost += lost_beside_joints(arm)
    changed = [inertia for inertia in plant.inertias if inertia.changed]
    for inertia in changed:
        moments, padded = (", ".join(f"{x:.3g}" for x in values) for values in (inertia.moments, inertia.padded))
        mass = float(spec.body(inertia.body).mass)
        lost.append(
            f"{_short(inertia.body)}: no body has a mass of {inertia.mass:g} kg and principal moments of {moments} "
            f"kg m²; in the file they are {mass:g} kg and {padded} kg m²"
        )
    if changed:
        error = _mass_matrix_error(arm, spec, plant.name)
        names = ", ".join(_short(inertia.body) for inertia in changed)
        lost.append(
            f"the mass matrix of the file differs by up to {error:.2g} of its largest entry in {_COMPARED} random "
            f"configurations, because of {names}"
        )
    return lost


def _short(body: str) -> str:
    """Return the name of a body without that of its arm."""
    return body.rpartition("/")[2]


def _mass_matrix_error(arm: Arm, spec: Any, name: str) -> float:
    """Return the largest difference of the mass matrices of an arm and of the file, by the largest entry."""
    mujoco = load_mujoco()
    model = spec.compile()
    data, indices = mujoco.MjData(model), arm_indices(model, name, arm.n)
    rng, worst = np.random.default_rng(_SEED), 0.0
    for _ in range(_COMPARED):
        q = rng.uniform(np.clip(arm.limits.lower, -math.pi, None), np.clip(arm.limits.upper, None, math.pi))
        data.qpos[indices.positions] = q
        mujoco.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        exact = mass_matrix(arm, q)
        written = M[np.ix_(indices.speeds, indices.speeds)]
        worst = max(worst, float(np.abs(written - exact).max() / np.abs(exact).max()))
    return worst


def _lost_of_cell(cell: Cell) -> list[str]:
    """Say what of a cell is lost, beside its arms."""
    kinds: Mapping[str, object] = {
        "the frames": cell.frames,
        "the answers of the camera": cell.visions or cell.seen_parts,
        "the cameras and markers": cell.cameras or cell.markers,
        "the devices": cell.devices,
    }
    lost = [f"{name} are not in the file" for name, content in kinds.items() if content]
    lost += [
        f"{name}: the grasp pose, the marker, the spread and the symmetry of the part are not in the file"
        for name, part in cell.parts.items()
        if part.marker is not None
        or part.spread.position
        or part.spread.yaw
        or part.symmetry > 1
        or not np.array_equal(part.grasp, np.eye(4))
    ]
    lost += [
        f"{name}: the force of its suction is not in the file"
        for name, arm in cell.arms.items()
        if arm.gripper is not None and arm.gripper.kind == "suction"
    ]
    lost.append(
        "the times of grippers and cameras, the servos, the sensors and the tolerances of motions are not in the file"
    )
    return lost


def _comment(lost: list[str]) -> list[str]:
    return ["Written by armwright.", *(f"Not represented: {sentence}." for sentence in lost)]
