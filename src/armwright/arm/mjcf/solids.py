"""Geoms of a model of MuJoCo as solids."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np

from armwright.arm.mjcf.compiled import is_solid
from armwright.arrays import Array
from armwright.mujoco_library import load_mujoco
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import rotation_from_quaternion
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere


def pose_of(model: Any, kind: str, number: int) -> Array:
    """Return the pose (4, 4) of a body, geom or site in the frame of what carries it, or of a mesh in its geom."""
    position, q = (getattr(model, f"{kind}_{part}")[number] for part in ("pos", "quat"))
    return homogeneous(rotation_from_quaternion(q), position)


def geoms_of(model: Any, body: int) -> list[int]:
    """Return the geoms of a body that meet others, or all where none does: what is drawn is what is known then."""
    first = int(model.body_geomadr[body])
    geoms = list(range(first, first + int(model.body_geomnum[body])))
    return [i for i in geoms if is_solid(model.geom(i))] or geoms


def solids_of(model: Any, body: int, left_out: Container[str] = ()) -> tuple[Solid, ...]:
    """Return the solids of a body, in its frame; planes, ellipsoids and geoms of some names are left out."""
    geoms = (geom for geom in geoms_of(model, body) if model.geom(geom).name not in left_out)
    return tuple(solid for geom in geoms if (solid := solid_of(model, geom)) is not None)


def solid_of(model: Any, geom: int) -> Solid | None:
    """Return a geom as a solid, in the frame of its body; None where it is a plane or an ellipsoid."""
    shape, X = _shape(model, geom), pose_of(model, "geom", geom)
    if isinstance(shape, Mesh):
        # MuJoCo has turned the mesh to its axes of inertia; here it is as in its file.
        X = X @ inverse(pose_of(model, "mesh", model.geom_dataid[geom]))
    return None if shape is None else Solid(shape=shape, pose=X)


def ellipsoids_of(model: Any, body: int) -> list[int]:
    """Return the geoms of a body that meet others and are no solids here."""
    mujoco = load_mujoco()
    return [i for i in geoms_of(model, body) if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_ELLIPSOID]


def _shape(model: Any, geom: int) -> Shape | None:
    mujoco = load_mujoco()
    kinds, (x, y, _) = mujoco.mjtGeom, model.geom_size[geom].tolist()
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case kinds.mjGEOM_BOX:
            return Box(size=2 * model.geom_size[geom])
        case kinds.mjGEOM_SPHERE:
            return Sphere(radius=x)
        case kinds.mjGEOM_CYLINDER:
            return Cylinder(radius=x, length=2 * y)
        case kinds.mjGEOM_CAPSULE:
            return Capsule(radius=x, length=2 * y)
        case kinds.mjGEOM_MESH:
            return _mesh(model, int(model.geom_dataid[geom]))
    return None


def _mesh(model: Any, number: int) -> Mesh:
    vertex, face = int(model.mesh_vertadr[number]), int(model.mesh_faceadr[number])
    X = pose_of(model, "mesh", number)
    vertices = model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[number])].astype(np.float64)
    return Mesh(
        vertices=vertices @ X[:3, :3].T + X[:3, 3],
        faces=model.mesh_face[face : face + int(model.mesh_facenum[number])],
        name=model.mesh(number).name,
    )
