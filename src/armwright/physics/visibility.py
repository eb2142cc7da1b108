"""Why a camera does not see a marker: known from the world, not from the picture."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.cell.scene import Camera
from armwright.mujoco_library import load_mujoco
from armwright.physics.markers import marker_corners
from armwright.physics.pictures import DRAWN_GROUPS, Picture, camera_pose
from armwright.spatial.poses import homogeneous, inverse

# Where nine of ten pixels of a marker are below this, it is dark, of 255.
_DARK = 30.0
# Sides of a marker that is found [px], and the flattest angle under which it is looked at, as the sine of it.
_SMALLEST, _FLATTEST = 12.0, 0.26
# Points of a marker that are looked at, along each side, and what is in front of them by more than this [m].
_POINTS, _BEFORE = 7, 1e-3


def why_unseen(model: Any, data: Any, camera: Camera, picture: Picture, *, marker: str, size: float) -> str:
    """Return why a marker is not found in a picture, as what follows "the camera does not see it: ".

    Args:
        model: the MjModel.
        data: the MjData, in the state in which the picture was taken.
        camera: that took it.
        picture: the picture.
        marker: name of its site in the model.
        size: length of the sides of its black square [m].
    """
    X_WC, site = camera_pose(data, camera.name), data.site(marker)
    X_CM = inverse(X_WC) @ homogeneous(site.xmat.reshape(3, 3), site.xpos)
    corners = marker_corners(size) @ X_CM[:3, :3].T + X_CM[:3, 3]
    elevation = -float(X_CM[:3, 2] @ X_CM[:3, 3]) / float(np.linalg.norm(X_CM[:3, 3]))
    if (corners[:, 2] <= 0).all():
        return "it is behind the camera"
    if not _within(camera, corners):
        return "it is not wholly in the picture"
    if elevation <= 0:
        return "it faces away from the camera"
    if hidden := _hidden_by(model, data, X_WC, corners):
        return f"{hidden} is in front of it"
    return _indistinct(camera, picture, corners, elevation)


def _indistinct(camera: Camera, picture: Picture, corners: Array, elevation: float) -> str:
    """Return what a marker lacks that nothing hides.

    Args:
        camera: that took the picture.
        picture: with the marker.
        corners: (4, 3) of the marker in the frame of the camera.
        elevation: sine of the angle under which it is looked at.
    """
    if elevation < _FLATTEST:
        return f"it is looked at under an angle of only {np.degrees(np.arcsin(elevation)):.0f} degrees"
    pixels = camera.lens.project(corners)
    (left, top), (right, bottom) = pixels.min(axis=0).astype(int), pixels.max(axis=0).astype(int) + 1
    if np.quantile(picture[top:bottom, left:right], 0.9) < _DARK:
        return "it is dark"
    side = float(np.linalg.norm(pixels - np.roll(pixels, 1, axis=0), axis=1).min())
    if side < _SMALLEST:
        return f"it is too small in the picture, with a side of {side:.0f} pixels"
    return "it is not told from what is around it"


def _within(camera: Camera, corners: Array) -> bool:
    """Whether points (4, 3) in the frame of a camera are in its picture."""
    if (corners[:, 2] <= 0).any():
        return False
    least, most = camera.lens.field()
    directions = corners[:, :2] / corners[:, 2:]
    if not ((directions > least) & (directions < most)).all():
        # There a lens that distorts may show something else.
        return False
    pixels = camera.lens.project(corners)
    return bool(((pixels > 0) & (pixels < (camera.lens.width - 1, camera.lens.height - 1))).all())


def _hidden_by(model: Any, data: Any, X_WC: Array, corners: Array) -> str:
    """Return the name of the body that is in front of most points of a marker; an empty text where none is.

    Args:
        model: the MjModel.
        data: the MjData.
        X_WC: (4, 4) pose of the camera in the world.
        corners: (4, 3) of the marker in the frame of the camera.
    """
    mujoco = load_mujoco()
    s, t = (grid.ravel()[:, None] for grid in np.meshgrid(*[np.linspace(0, 1, _POINTS)] * 2))
    points = corners[0] + s * (corners[1] - corners[0]) + t * (corners[3] - corners[0])
    distances = np.linalg.norm(points, axis=1)
    rays = np.ascontiguousarray(points @ X_WC[:3, :3].T / distances[:, None])
    hit, far = np.full(len(rays), -1, dtype=np.int32), np.zeros(len(rays))
    eye = np.ascontiguousarray(X_WC[:3, 3])
    groups = DRAWN_GROUPS
    mujoco.mj_multiRay(model, data, eye, rays.ravel(), groups, 1, -1, hit, far, None, len(rays), float(distances.max()))
    before = (hit >= 0) & (far >= 0) & (far < distances - _BEFORE)
    bodies = Counter(int(model.geom_bodyid[geometry]) for geometry in hit[before].tolist())
    if not bodies:
        return ""
    body = bodies.most_common(1)[0][0]
    if body:
        return str(model.body(body).name)
    # What belongs to no body stands: there the geometry has the name.
    first = next(geometry for geometry in hit[before].tolist() if model.geom_bodyid[geometry] == 0)
    return str(model.geom(first).name) or "something"
