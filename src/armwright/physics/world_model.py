"""A cell as a MuJoCo world: arms with grippers, what stands, parts that fall."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.scene import USUAL_CONTACT_TIME, Part
from armwright.mujoco_library import load_mujoco
from armwright.physics.cell_bodies import arm_bodies
from armwright.physics.friction import SpeedFriction
from armwright.physics.geoms import add_geom, placement, principal_inertia, quaternion
from armwright.physics.gripper import add_gripper, grip
from armwright.physics.markers import add_marker
from armwright.physics.pictures import add_camera, add_lights
from armwright.physics.plant import PlantArm, add_arm, arm_indices, finish, new_world
from armwright.physics.vision import marker_name
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Solid, centroid, convex_solids, farthest, inertia

# No step of the world is longer [s].
_MAX_STEP = 1e-3
# Parts slower than this are at rest [m/s]: with less care they would stop before they have settled.
_AT_REST = 1e-6
# What meets what: bits of geoms. Arms have one each, from the third on.
_STANDING, _PART = 1, 2
_HAND = 1 << 30
_ALL = (1 << 31) - 1
_MAX_ARMS = 28
# Contacts of parts and furniture: sliding, turning, rolling.
_ROLLING = (0.005, 1e-4)
_CONDIM = 4
# How far below everything that stands the floor lies on which lost parts fall, and its half size [m].
_BELOW, _FLOOR = 0.5, 20.0
# The plate under a plane that yields: light, so that it adds nothing to what presses on it [kg], and damped.
_PLATE_MASS, _PLATE_DAMPING, _PLATE = 0.3, 30.0, np.array([5.0, 5.0, 0.02])
# Between the name of a body and the number of a piece of it.
PIECE = "#"
FLOOR, PLATE = "the floor", "the plane"
# Colours: red, green, blue and opacity.
_ARM, _GRIPPER, _FURNITURE = (0.78, 0.8, 0.83, 1.0), (0.25, 0.27, 0.3, 1.0), (0.62, 0.56, 0.48, 1.0)
_GROUND = (0.35, 0.38, 0.41, 1.0)
_PARTS = ((0.85, 0.5, 0.2, 1.0), (0.25, 0.5, 0.75, 1.0), (0.4, 0.6, 0.3, 1.0), (0.7, 0.35, 0.5, 1.0))


@attrs.frozen(kw_only=True, eq=False)
class WorldModel:
    """A compiled world.

    Attributes:
        cell: what it is the world of.
        model: the MjModel.
        substeps: of the world in one period of the servo.
        frictions: of arms whose friction changes with the speed.
        parts: the parts as they are in it.
        plate: whether a plane that yields is in it.
    """

    cell: Cell
    model: Any
    substeps: int
    frictions: tuple[SpeedFriction, ...]
    parts: Mapping[str, Part]
    plate: bool

    def step(self, data: Any) -> None:
        """Let one period of the servo go by."""
        import mujoco  # noqa: PLC0415 - loaded before; to look for it at every tick costs as much as the gripper

        if not self.frictions:
            mujoco.mj_step(self.model, data, self.substeps)
            return
        for _ in range(self.substeps):
            for friction in self.frictions:
                friction.set(self.model, data)
            mujoco.mj_step(self.model, data)


def world_model(cell: Cell, parts: Mapping[str, Part]) -> WorldModel:
    """Return the world of a cell.

    Args:
        cell: the cell.
        parts: its parts as they are in this world: where they stand, what they weigh.

    Raises:
        UnsupportedArmError: masses of an arm are unknown.
    """
    mujoco = load_mujoco()
    spec, plants = world_spec(cell, parts)
    substeps = round(cell.period / spec.option.timestep)
    plate = cell.contact.height is not None
    model = finish(spec, plants)
    # Parts at rest are left out of the equations until something touches them; arms never are.
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    model.opt.sleep_tolerance = _AT_REST
    frictions = [SpeedFriction(arm.arm, arm_indices(model, arm.name, arm.arm.n)) for arm in plants]
    return WorldModel(
        cell=cell,
        model=model,
        substeps=substeps,
        frictions=tuple(friction for friction in frictions if friction.is_there),
        parts=parts,
        plate=plate,
    )


def world_spec(cell: Cell, parts: Mapping[str, Part]) -> tuple[Any, tuple[PlantArm, ...]]:
    """Return the world of a cell as a specification that has not been compiled yet, and its arms.

    Arguments and errors are those of ``world_model``.
    """
    assert len(cell.arms) <= _MAX_ARMS  # noqa: S101 - a limit of cell files
    substeps = math.ceil(cell.period / _MAX_STEP - 1e-9)
    spec = new_world(cell.gravity, cell.period / substeps)
    plants = []
    for number, (name, cell_arm) in enumerate(cell.arms.items()):
        bit = 4 << number
        # An arm does not meet itself: that is looked for before it moves.
        affinity = _ALL - bit - _HAND
        bits = {"contype": bit, "conaffinity": affinity, "rgba": _ARM}
        arm = cell_arm.plant or cell_arm.arm
        gripper = cell_arm.gripper_or_usual
        plant = add_arm(spec, name, arm, cell_arm.base, arm_bodies(name, arm, gripper), **bits)
        hand = {"contype": bit | _HAND, "conaffinity": affinity, "rgba": _GRIPPER}
        add_gripper(spec, name, plant.tool, gripper, **hand)
        plants.append(plant)
    _add_standing(spec, cell)
    _add_floor(spec, cell, parts)
    for number, part in enumerate(parts.values()):
        _add_part(spec, part, _PARTS[number % len(_PARTS)])
    for name, cell_arm in cell.arms.items():
        for label in (label for part in parts.values() for label, _ in _pieces(part.name, Solid(shape=part.shape))):
            grip(spec, name, cell_arm.gripper_or_usual, label)
    _add_plate(spec, cell)
    _add_cameras(spec, cell, {plant.name: plant.tool for plant in plants})
    return spec, tuple(plants)


def _pieces(name: str, solid: Solid) -> list[tuple[str, Solid]]:
    """Return the convex pieces of a solid, by names that begin with its own."""
    pieces = convex_solids([solid])
    return [(f"{name}{PIECE}{number}" if number else name, piece) for number, piece in enumerate(pieces)]


def _surface(friction: float) -> dict[str, Any]:
    return {"friction": (friction, *_ROLLING), "condim": _CONDIM}


def _furniture(friction: float, contact_time: float = USUAL_CONTACT_TIME) -> dict[str, Any]:
    """Return the options of what stands: softer than pads, whose own stiffness would make every touch a blow."""
    return {**_surface(friction), "priority": 2, "solref": (contact_time, 1.0)}


def _add_standing(spec: Any, cell: Cell) -> None:
    for name, fixture in cell.fixtures.items():
        solid = Solid(shape=fixture.shape, pose=fixture.pose)
        bits = {"contype": _STANDING, "conaffinity": _ALL}
        surface = _furniture(fixture.friction, fixture.contact_time)
        for label, piece in _pieces(name, solid):
            add_geom(spec, spec.worldbody, label, piece, rgba=_FURNITURE, **bits, **surface)


def _add_floor(spec: Any, cell: Cell, parts: Mapping[str, Part]) -> None:
    """Add a floor on which parts fall that have been lost; nothing else meets it."""
    mujoco = load_mujoco()
    things = [(fixture.pose, fixture.shape) for fixture in cell.fixtures.values()]
    things += [(part.pose, part.shape) for part in parts.values()]
    lowest = min([float(X[2, 3]) - farthest(shape) for X, shape in things], default=0.0)
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(_FLOOR, _FLOOR, 0.1),
        pos=(0.0, 0.0, min(0.0, lowest) - _BELOW),
        rgba=_GROUND,
        contype=0,
        conaffinity=_PART,
        **_surface(1.0),
    )


def _add_cameras(spec: Any, cell: Cell, tools: Mapping[str, Any]) -> None:
    """Add the cameras of a cell, light, and the markers that they search for."""
    if not cell.cameras:
        return
    add_lights(spec)
    for camera in cell.cameras.values():
        add_camera(spec.worldbody if camera.on is None else tools[camera.on], camera)
    for name, marker in cell.markers.items():
        add_marker(spec, spec.worldbody, marker, marker_name(name))
    for name, part in cell.parts.items():
        if part.marker is not None:
            add_marker(spec, spec.body(name), part.marker, marker_name(name))


def _add_part(spec: Any, part: Part, colour: tuple[float, ...]) -> None:
    body = spec.worldbody.add_body(name=part.name, **placement(part.pose))
    body.add_freejoint(name=part.name)
    moments, axes = principal_inertia(inertia(part.shape))
    body.explicitinertial, body.mass, body.inertia = True, part.mass, part.mass * moments
    body.ipos, body.iquat = centroid(part.shape), quaternion(axes)
    bits = {"contype": _PART, "conaffinity": _ALL}
    for label, piece in _pieces(part.name, Solid(shape=part.shape)):
        add_geom(spec, body, label, piece, mass=0.0, rgba=colour, **bits, **_surface(part.friction))


def _add_plate(spec: Any, cell: Cell) -> None:
    """Add the plane of contact of the cell, if there is one: a light plate on a spring."""
    mujoco = load_mujoco()
    plane = cell.contact
    if plane.height is None:
        return
    plate = spec.worldbody.add_body(name=PLATE, pos=(0.0, 0.0, plane.height), gravcomp=1.0)
    plate.explicitinertial, plate.mass, plate.inertia, plate.ipos = True, _PLATE_MASS, np.ones(3), np.zeros(3)
    plate.add_joint(
        name=PLATE,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=(0.0, 0.0, 1.0),
        stiffness=[plane.stiffness, 0.0, 0.0],
        damping=[_PLATE_DAMPING, 0.0, 0.0],
    )
    plate.add_geom(
        name=PLATE,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=_PLATE,
        pos=(0.0, 0.0, -_PLATE[2]),
        mass=0.0,
        # Links of an arm may stand in the plane; what it holds and holds with may not.
        rgba=_FURNITURE,
        contype=0,
        conaffinity=_PART | _HAND,
        **{**_furniture(0.8), "priority": 4},
    )


def part_pose(data: Any, name: str) -> Array:
    """Return the pose (4, 4) of a part in the world."""
    X = np.eye(4)
    body = data.body(name)
    X[:3, :3], X[:3, 3] = body.xmat.reshape(3, 3), body.xpos
    return X


def part_velocity(data: Any, name: str) -> Array:
    """Return the velocity (6,) of a part: of its origin along the axes of the world, and angular about its own axes."""
    return np.array(data.joint(name).qvel)


def tool_pose(data: Any, arm: str) -> Array:
    """Return the pose (4, 4) of the tool of an arm in the world."""
    X = np.eye(4)
    site = data.site(f"{arm}/tool")
    X[:3, :3], X[:3, 3] = site.xmat.reshape(3, 3), site.xpos
    return X


def in_hand(data: Any, arm: str, part: str) -> Array:
    """Return the pose (4, 4) of a part seen from the tool of an arm."""
    return np.asarray(inverse(tool_pose(data, arm)) @ part_pose(data, part))
