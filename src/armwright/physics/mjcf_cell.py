"""Cells from MJCF files that carry the names of our own: arms, grippers, fixtures, parts and the plane of contact."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arm.mjcf.reader import arm_in, read_tree
from armwright.arm.mjcf.solids import pose_of, solid_of
from armwright.arm.mjcf.tree import WORLD, MjcfTree
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.model import Cell, CellArm, ContactPlane
from armwright.cell.scene import USUAL_CONTACT_TIME, Fixture, Gripper, Part
from armwright.errors import ArmwrightError, FileFormatError
from armwright.files.inputs import file_path
from armwright.mujoco_library import load_mujoco
from armwright.physics.mjcf import START
from armwright.physics.world_model import FLOOR, PIECE, PLATE
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_quaternion

_BASE = re.compile(r"(ARM_(?:0|[1-9][0-9]*))/base", re.ASCII)
_NAME = re.compile(r"[A-Z][A-Z0-9_]*", re.ASCII)
_GRIPPER = re.compile(r"ARM_[0-9]+/[^/]*", re.ASCII)
_FINGERS = ("left", "right")


@attrs.frozen(kw_only=True)
class CellReading:
    """What an MJCF file of a cell gives.

    Attributes:
        cell: the cell.
        notes: sentences on what was not read.
    """

    cell: Cell
    notes: tuple[str, ...]


def read_cell_mjcf(path: Path | str) -> CellReading:
    """Return the cell of an MJCF file as ``armwright convert`` writes it.

    Arms are the chains from a body ARM_1/base to a body ARM_1/tool, with the fingers or the cup there as their gripper;
    fixtures are geoms of the world, and parts free bodies of one geom, under names of frames. Where the file has the
    keyframe ``start``, arms and parts stand as there.

    Raises:
        MissingExtraError: MuJoCo cannot be loaded.
        FileFormatError: the file is missing, broken, has no arm of such a name, or things that no cell has.
    """
    path = file_path(path)
    tree = read_tree(path)
    model = tree.model
    names = [match[1] for link in tree.links if (match := _BASE.fullmatch(link))]
    if not names:
        raise tree.error("expected a body of the name ARM_1/base, as armwright writes them; load_mjcf reads other arms")
    keys = [model.key(i).name for i in range(model.nkey)]
    q = np.array(model.key(START).qpos if START in keys else model.qpos0)
    try:
        fixtures, parts = _fixtures(model), _parts(model, q)
        arms, notes = {}, []
        for name in names:
            arms[name], said = _arm(tree, name, q)
            notes += [f"{name}: {sentence}" for sentence in said if not sentence.startswith("gravity")]
        cell = Cell(
            name=tree.name,
            arms=arms,
            gravity=model.opt.gravity,
            fixtures=fixtures,
            parts=parts,
            contact=_plane(model),
            period=float(model.opt.timestep),
        )
    except FileFormatError:
        raise
    except ArmwrightError as error:
        raise tree.error(str(error)) from error
    cut = {name.partition(PIECE)[0] for i in range(model.ngeom) if PIECE in (name := model.geom(i).name)}
    notes += [f"'{name}' is not read: it is made of several convex pieces" for name in sorted(cut)]
    read = {f"{name}/base" for name in arms} | set(parts) | {PLATE}
    others = [joint.child for joint in tree.child_joints[WORLD] if joint.child not in read]
    notes += [f"the body '{name}' is not read" for name in others]
    return CellReading(cell=cell, notes=tuple(notes))


def _arm(tree: MjcfTree, name: str, q: Array) -> tuple[CellArm, tuple[str, ...]]:
    """Return an arm as it stands, and notes on it; q are the positions of the whole model."""
    model, base, tool = tree.model, f"{name}/base", f"{name}/tool"
    if tool not in tree.links:
        raise tree.error(f"expected a body of the name {tool} at the end of {name}")
    fingers = {f"{name}/{side}" for side in _FINGERS}
    children = {
        link: [joint for joint in joints if joint.child not in fingers] for link, joints in tree.child_joints.items()
    }
    # Solids of links are called NAME/link1/solid1, those of the gripper NAME/palm.
    of_gripper = {each for i in range(model.ngeom) if _GRIPPER.fullmatch(each := model.geom(i).name)}
    alone = attrs.evolve(tree, child_joints=children, no_solids=of_gripper)
    reading = arm_in(alone, base, tool)
    starts = [float(q[model.joint(joint.name).qposadr[0]]) for joint in reading.arm.joints]
    cell_arm = CellArm(
        arm=_with_short_names(reading.arm, name),
        base=pose_of(model, "body", tree.bodies[base] or 0),
        start=np.array(starts),
        gripper=_gripper(tree, name),
    )
    return cell_arm, reading.notes


def _with_short_names(arm: Arm, name: str) -> Arm:
    """Return an arm whose parts are called without its name in front, as it was before."""
    prefix = f"{name}/"
    joints = [attrs.evolve(joint, name=joint.name.removeprefix(prefix)) for joint in arm.joints]
    links = [attrs.evolve(link, name=link.name.removeprefix(prefix)) for link in arm.links]
    return attrs.evolve(
        arm,
        name=name,
        joints=joints,
        links=links,
        base_link=arm.base_link.removeprefix(prefix),
        tool_link=arm.tool_link.removeprefix(prefix),
    )


def _gripper(tree: MjcfTree, name: str) -> Gripper | None:
    """Return what an arm holds parts with; of a cup the file does not know how strong it is."""
    model, left = tree.model, f"{name}/left"
    geoms = {model.geom(i).name for i in range(model.ngeom)}
    if f"{name}/lip0" in geoms:
        return Gripper(kind="suction", friction=float(model.geom(f"{name}/lip0").friction[0]))
    actuators = {model.actuator(i).name for i in range(model.nu)}
    joints = {joint.name for joint in tree.parent_joints.values()}
    if left not in actuators or left not in joints or f"{left} finger" not in geoms:
        return None
    return Gripper(
        force=float(model.actuator(left).forcerange[1]),
        opening=2 * float(model.joint(left).range[1]),
        friction=float(model.geom(f"{left} finger").friction[0]),
    )


def _fixtures(model: Any) -> dict[str, Fixture]:
    """Return the geoms of the world that have names of frames."""
    fixtures = {}
    names = [model.geom(i).name for i in range(int(model.body_geomnum[0]))]
    cut = {name.partition(PIECE)[0] for name in names if PIECE in name}
    for geom, name in enumerate(names):
        solid = solid_of(model, geom)
        if name not in cut and name != FLOOR and solid is not None and _NAME.fullmatch(name):
            # A time constant is above 0; other numbers are a stiffness and a damping.
            time = float(model.geom_solref[geom][0])
            fixtures[name] = Fixture(
                name=name,
                shape=solid.shape,
                pose=solid.pose,
                friction=float(model.geom_friction[geom][0]),
                contact_time=time if time > 0 else USUAL_CONTACT_TIME,
            )
    return fixtures


def _parts(model: Any, q: Array) -> dict[str, Part]:
    """Return the free bodies of one geom that have names of frames, where they stand."""
    mujoco = load_mujoco()
    parts = {}
    for body in range(1, model.nbody):
        name, joint, geom = model.body(body).name, int(model.body_jntadr[body]), int(model.body_geomadr[body])
        free = model.body_jntnum[body] == 1 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        if not (free and model.body_geomnum[body] == 1 and _NAME.fullmatch(name)):
            continue
        solid = solid_of(model, geom)
        if solid is None:
            continue
        first = int(model.jnt_qposadr[joint])
        X = _placed(q[first : first + 7])
        parts[name] = Part(
            name=name,
            shape=solid.shape,
            mass=float(model.body_mass[body]),
            friction=float(model.geom_friction[geom][0]),
            pose=X @ solid.pose,
        )
    return parts


def _placed(q: Array) -> Array:
    """Return the pose (4, 4) that the positions (7,) of a free joint are."""
    return homogeneous(rotation_from_quaternion(q[3:]), q[:3])


def _plane(model: Any) -> ContactPlane:
    """Return the plane of contact, if the file has one."""
    for body in range(1, model.nbody):
        if model.body(body).name == PLATE and model.body_jntnum[body] == 1:
            stiffness = float(model.jnt_stiffness[model.body_jntadr[body]])
            return ContactPlane(height=float(model.body_pos[body][2]), stiffness=stiffness)
    return ContactPlane()
