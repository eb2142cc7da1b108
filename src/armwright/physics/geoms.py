"""Solids as geoms of MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.mujoco_library import load_mujoco
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere

# Of a rotation matrix, that it is the identity.
_ROUNDING = 1e-15


def quaternion(R: Array) -> Array:
    """Return the unit quaternion (4,) wxyz of a rotation (3, 3), as MuJoCo computes it."""
    mujoco = load_mujoco()
    q = np.empty(4)
    mujoco.mju_mat2Quat(q, np.ascontiguousarray(R).reshape(9))
    return q


def principal_inertia(inertia: Array) -> tuple[Array, Array]:
    """Return the principal moments (3,) of a tensor (3, 3), the smallest first, and the rotation (3, 3) to its axes."""
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return moments, axes


def placement(X: Array) -> dict[str, Array]:
    """Return the arguments that put a body, a geom or a site at a pose (4, 4)."""
    turned = np.abs(X[:3, :3] - np.eye(3)).max() > _ROUNDING
    return {"pos": X[:3, 3], **({"quat": quaternion(X[:3, :3])} if turned else {})}


def add_geom(spec: Any, body: Any, name: str, solid: Solid, **options: Any) -> Any:
    """Add a solid to a body of a specification, and return its geom; a mesh collides as its convex hull."""
    mujoco = load_mujoco()
    kinds = mujoco.mjtGeom
    match solid.shape:
        case Box(size=size):
            form = {"type": kinds.mjGEOM_BOX, "size": size / 2}
        case Cylinder(radius=radius, length=length):
            form = {"type": kinds.mjGEOM_CYLINDER, "size": (radius, length / 2, 0.0)}
        case Capsule(radius=radius, length=length):
            form = {"type": kinds.mjGEOM_CAPSULE, "size": (radius, length / 2, 0.0)}
        case Sphere(radius=radius):
            form = {"type": kinds.mjGEOM_SPHERE, "size": (radius, 0.0, 0.0)}
        case Mesh(vertices=vertices, faces=faces):
            mesh = spec.add_mesh(name=name, uservert=vertices.ravel(), userface=faces.ravel())
            # A mesh that is not closed has no volume to weigh; what carries it has its own inertia.
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            form = {"type": kinds.mjGEOM_MESH, "meshname": name}
    return body.add_geom(name=name, **form, **placement(solid.pose), **options)
