"""Markers in a MuJoCo world: flat squares with a pattern of the dictionary 4X4_50 of ArUco."""

from __future__ import annotations

from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.cell.scene import Marker
from armwright.extras import opencv
from armwright.mujoco_library import load_mujoco
from armwright.physics.geoms import placement

# What needs OpenCV, in messages.
PURPOSE = "seeing markers"
# The sides of the black square in cells of the pattern, and of the white margin around it.
CELLS, _MARGIN = 6, 1
# Pixels of a texture per cell.
_PIXELS = 40
# Thickness of the label that a marker is printed on [m]: more than the depths of pictures can tell apart.
THICKNESS = 1e-4
# The group of what is drawn but touches nothing, and that of what is not drawn.
_DRAWN, _INVISIBLE = 2, 5


def dictionary() -> Any:
    """Return the dictionary of markers.

    Raises:
        MissingExtraError: OpenCV is missing.
    """
    cv2 = opencv(PURPOSE)
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)


def marker_corners(size: float) -> Array:
    """Return the corners (4, 3) of the black square in the frame of a marker, in the order in which they are found.

    Seen from the front: top left, top right, bottom right, bottom left; on the front of the label.

    Args:
        size: length of the sides of the square [m].
    """
    side = size / 2
    return np.array(
        [(-side, side, THICKNESS), (side, side, THICKNESS), (side, -side, THICKNESS), (-side, -side, THICKNESS)]
    )


def add_marker(spec: Any, body: Any, marker: Marker, name: str) -> None:
    """Stick a marker to a body of a MuJoCo specification: a label without mass that touches nothing.

    A site of the same name has the pose of the marker.

    Args:
        spec: the MjSpec.
        body: of it; its frame is the one that the pose of the marker is in.
        marker: the marker.
        name: of the texture, the material, the mesh, the geometry and the site.

    Raises:
        MissingExtraError: OpenCV is missing.
    """
    mujoco = load_mujoco()
    cells = CELLS + 2 * _MARGIN
    pixels = np.full((cells * _PIXELS, cells * _PIXELS), 255, dtype=np.uint8)
    inner = slice(_MARGIN * _PIXELS, -_MARGIN * _PIXELS)
    pixels[inner, inner] = opencv(PURPOSE).aruco.generateImageMarker(dictionary(), marker.number, CELLS * _PIXELS)
    kinds = mujoco.mjtTexture
    texture = spec.add_texture(name=name, type=kinds.mjTEXTURE_2D, width=len(pixels), height=len(pixels), nchannel=3)
    texture.data = np.repeat(pixels[:, :, None], 3, axis=2).tobytes()
    material = spec.add_material(name=name, specular=0, shininess=0, emission=0.1)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name

    # A texture lies on a flat mesh as it is; on a box it would be wrapped around.
    corners = marker_corners(marker.size * cells / CELLS)
    vertices = np.concatenate([corners, corners * (1, 1, 0)])
    front, back = [(0, 3, 2), (0, 2, 1)], [(4, 5, 6), (4, 6, 7)]
    rim = [face for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)) for face in ((i, j, j + 4), (i, j + 4, i + 4))]
    spec.add_mesh(
        name=name,
        uservert=vertices.ravel(),
        userface=np.array(front + back + rim, dtype=np.int32).ravel(),
        usertexcoord=np.array([(0, 0), (1, 0), (1, 1), (0, 1)] * 2, dtype=np.float64).ravel(),
    )
    pose = placement(marker.pose)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=name,
        contype=0,
        conaffinity=0,
        mass=0,
        group=_DRAWN,
        **pose,
    )
    body.add_site(name=name, group=_INVISIBLE, **pose)
