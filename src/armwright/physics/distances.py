"""Distances between solids at given poses, by MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.mujoco_library import load_mujoco
from armwright.physics.geoms import add_geom
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_quaternion
from armwright.spatial.shapes import Box, Capsule, Shape, Solid

# Distances between convex solids are found by iteration, to this [m].
TOLERANCE = 1e-6
# A direction that is no more out of a plane than this is in it.
_PARALLEL = 1e-12


class Nearest(NamedTuple):
    """How far apart two solids are.

    Attributes:
        distance: between them [m]; below 0 where they overlap, by how far one has to be moved.
        points: (2, 3) the nearest points of both [m].
    """

    distance: float
    points: Array


class Distances:
    """Solids whose distances are asked for at changing poses.

    A mesh counts as its convex hull.
    """

    def __init__(self, shapes: Sequence[Shape]) -> None:
        """Take the solids.

        Args:
            shapes: of the solids, in the order of their numbers.
        """
        mujoco = load_mujoco()
        self._mujoco = mujoco
        spec = mujoco.MjSpec()
        spec.option.ccd_tolerance = TOLERANCE
        for i, shape in enumerate(shapes):
            add_geom(spec, spec.worldbody, f"solid{i}", Solid(shape=shape))
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)
        # MuJoCo moves the frame of a mesh into its centre of mass and turns it to its axes of inertia.
        self._inner = [_inner_pose(self._model, i) for i in range(len(shapes))]
        self._capsules = {i: shape for i, shape in enumerate(shapes) if isinstance(shape, Capsule)}
        self._boxes = {i for i, shape in enumerate(shapes) if isinstance(shape, Box)}

    def set_pose(self, number: int, X: Array) -> None:
        """Put a solid at a pose (4, 4)."""
        inner = self._inner[number]
        if inner is not None:
            X = X @ inner
        self._data.geom_xpos[number] = X[:3, 3]
        self._data.geom_xmat[number] = X[:3, :3].reshape(9)

    def between(self, a: int, b: int, within: float) -> float:
        """Return the distance of two solids [m]; ``within`` where they are at least that far apart."""
        impaled = self._impaled(a, b)
        if impaled is not None:
            return impaled.distance
        return float(self._mujoco.mj_geomDistance(self._model, self._data, a, b, within, None))

    def nearest(self, a: int, b: int, within: float) -> Nearest:
        """Return the distance of two solids that are no farther apart than ``within``, and where that is."""
        impaled = self._impaled(a, b)
        if impaled is not None:
            return impaled
        ends = np.zeros(6)
        distance = float(self._mujoco.mj_geomDistance(self._model, self._data, a, b, within, ends))
        return Nearest(distance, ends.reshape(2, 3))

    def _impaled(self, a: int, b: int) -> Nearest | None:
        """Return how a capsule and a box overlap if the axis of the capsule goes through the box; None for all others.

        MuJoCo takes such a pair for apart, by any distance, where the axis goes through the box near one of its edges.
        """
        capsule, box = (a, b) if a in self._capsules else (b, a)
        shape = self._capsules.get(capsule)
        if shape is None or box not in self._boxes:
            return None
        axis, frame = self._data.geom_xmat[capsule][2::3], self._data.geom_xmat[box]
        centre, half = self._data.geom_xpos[capsule], self._model.geom_size[box]
        start = centre - axis * (shape.length / 2)
        hit = self._mujoco.mju_rayGeom(
            self._data.geom_xpos[box], frame, half, start, axis, self._mujoco.mjtGeom.mjGEOM_BOX
        )
        if hit < 0:
            return None
        R = frame.reshape(3, 3)
        along, away = axis @ R, (centre - self._data.geom_xpos[box]) @ R
        first, last = -shape.length / 2, shape.length / 2
        for x, direction, h in zip(away.tolist(), along.tolist(), half.tolist(), strict=True):
            if abs(direction) > _PARALLEL:
                enters, leaves = sorted(((-h - x) / direction, (h - x) / direction))
                first, last = max(first, enters), min(last, leaves)
            elif abs(x) > h:
                return None
        if first > last:
            return None
        point = centre + axis * (first + last) / 2
        depth = shape.radius + _depth(away, along * shape.length / 2, half)
        return Nearest(-depth, np.array((point, point)))


def _depth(away: Array, rod: Array, half: Array) -> float:
    """Return how far a rod in a box has to be moved until it is outside [m].

    Args:
        away: (3,) its middle, in the frame of the box.
        rod: (3,) from its middle to its end.
        half: (3,) half the lengths of the box.

    Source:
        Gottschalk, Lin & Manocha (1996), OBBTree: the directions in which two boxes can be separated.
    """
    normals = np.concatenate([np.eye(3), np.cross(np.eye(3), rod)])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > _PARALLEL] / lengths[lengths > _PARALLEL, None]
    return float((np.abs(normals) @ half + np.abs(normals @ rod) - np.abs(normals @ away)).min())


def _inner_pose(model: Any, number: int) -> Array | None:
    """Return the pose (4, 4) of the geometry of a solid in its own frame; None where they are one."""
    position, quaternion = model.geom_pos[number], model.geom_quat[number]
    if not position.any() and np.array_equal(quaternion, (1.0, 0.0, 0.0, 0.0)):
        return None
    return homogeneous(rotation_from_quaternion(quaternion), position)
