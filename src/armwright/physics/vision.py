"""What the cameras of a cell answer when a program reads the vision of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import DeviceError
from armwright.cell.model import Cell
from armwright.cell.scene import Camera
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.pictures import Photographer, Picture
from armwright.physics.seeing import find_markers, target_of, target_pose
from armwright.physics.visibility import why_unseen


class Look(NamedTuple):
    """A picture and what was found in it.

    Attributes:
        picture: that it took.
        pose: (4, 4) of the frame in the world; None where it was not found.
        message: why it was not found; empty where it was.
    """

    picture: Picture
    pose: Array | None
    message: str


def marker_name(name: str) -> str:
    """Return the name in a MuJoCo model of the marker of a part or of the scene."""
    return f"{name} marker"


def camera_in_world(cell: Cell, camera: Camera, q: Array | None = None) -> Array:
    """Return the pose (4, 4) of a camera in the world, by what the arm that carries it reads.

    Args:
        cell: the cell.
        camera: one of it.
        q: (n,) joint positions of the arm that carries it.
    """
    if camera.on is None:
        return camera.pose
    assert q is not None  # noqa: S101 - the caller knows the arm
    arm = cell.arms[camera.on]
    return np.asarray(arm.base @ forward(arm.arm, q) @ camera.pose)


def look(  # noqa: PLR0917 - a look depends on all of this
    photographer: Photographer, data: Any, cell: Cell, frame: str, X_WC: Array, seed: int | Sequence[int] = 0
) -> Look:
    """Take a picture of a world and find a frame in it.

    Args:
        photographer: with the cameras of the cell.
        data: the MjData; its markers have the names that ``marker_name`` gives.
        cell: the cell.
        frame: one of its sights.
        X_WC: (4, 4) pose of the camera in the world as far as it is known.
        seed: of the noise of the picture.
    """
    sight = cell.sights[frame]
    camera, target = cell.cameras[str(sight.camera)], target_of(cell, sight)
    picture = photographer.picture(data, camera.name, seed)
    corners = find_markers(picture, camera.lens).get(target.marker.number)
    try:
        if corners is not None:
            return Look(picture, target_pose(corners, camera.lens, X_WC, target) @ sight.relation, "")
    except DeviceError as error:
        return Look(picture, None, str(error))
    name, size = marker_name(target.name), target.marker.size
    why = why_unseen(photographer.model, data, camera, picture, marker=name, size=size)
    what = f"marker {target.marker.number} of {target.name}"
    return Look(picture, None, f"camera {camera.name} does not see {what}: {why}")
