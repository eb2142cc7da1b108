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
from armwright.spatial.shapes import Shape, Solid

# Distances between convex solids are found by iteration, to this [m].
TOLERANCE = 1e-6


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

    def set_pose(self, number: int, X: Array) -> None:
        """Put a solid at a pose (4, 4)."""
        inner = self._inner[number]
        if inner is not None:
            X = X @ inner
        self._data.geom_xpos[number] = X[:3, 3]
        self._data.geom_xmat[number] = X[:3, :3].reshape(9)

    def between(self, a: int, b: int, within: float) -> float:
        """Return the distance of two solids [m]; ``within`` where they are at least that far apart."""
        return float(self._mujoco.mj_geomDistance(self._model, self._data, a, b, within, None))

    def nearest(self, a: int, b: int, within: float) -> Nearest:
        """Return the distance of two solids that are no farther apart than ``within``, and where that is."""
        ends = np.zeros(6)
        distance = float(self._mujoco.mj_geomDistance(self._model, self._data, a, b, within, ends))
        return Nearest(distance, ends.reshape(2, 3))


def _inner_pose(model: Any, number: int) -> Array | None:
    """Return the pose (4, 4) of the geometry of a solid in its own frame; None where they are one."""
    position, quaternion = model.geom_pos[number], model.geom_quat[number]
    if not position.any() and np.array_equal(quaternion, (1.0, 0.0, 0.0, 0.0)):
        return None
    return homogeneous(rotation_from_quaternion(quaternion), position)
