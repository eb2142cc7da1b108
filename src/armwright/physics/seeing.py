"""What is found in pictures: the corners of markers, and the poses of what they are on."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import DeviceError
from armwright.cell.model import Cell
from armwright.cell.scene import Marker, Sight
from armwright.errors import InvalidValueError
from armwright.extras import opencv
from armwright.physics.markers import CELLS, PURPOSE, dictionary, marker_corners
from armwright.physics.pictures import Picture
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous, inverse_pose
from armwright.spatial.rotations import elementary_rotation, rotation_vector
from armwright.spatial.shapes import support

# Edges are measured so far to either side, in pixels and in cells of the pattern, at so many points across it.
_ACROSS, _ACROSS_CELLS, _POINTS = 1.5, 0.5, 17
# The part of an edge that is left out at each end, where the other edges are.
_LEFT_OUT = 0.12
_REFINEMENTS = 3
# Less between black and white is no edge, of 255.
_LEAST_CONTRAST = 5.0
# A marker is not at the height where it is looked for if it is so much larger or smaller than there, and is tilted if
# its corners are so far from those of a square.
_WRONG_SIZE, _WRONG_SHAPE = 0.03, 0.05
# Rays that meet a horizontal plane under a flatter angle do not say where, as the sine of it.
_FLAT = 0.02
# The second pose of a square must fit so much worse for the first to be believed.
_TOLD_APART = 2.0


@attrs.frozen(kw_only=True, eq=False)
class Target:
    """What is searched for in a picture.

    Attributes:
        name: in messages.
        marker: on it, its pose in the frame of the target.
        start: (4, 4) pose in the world from which the orientation is known but for a rotation about the vertical.
        height: of the origin of the target above the origin of the world [m]; None where neither that nor the
            orientation is known.
        symmetry: after so many equal rotations about its z axis, in a whole one, it is as before.
    """

    name: str
    marker: Marker
    start: Array
    height: float | None
    symmetry: int = 1


def target_of(cell: Cell, sight: Sight) -> Target:
    """Return what is searched for in a picture for a sight of a cell.

    Raises:
        InvalidValueError: the part has no marker.
    """
    if sight.kind == "marker":
        start = cell.markers[sight.name].pose
        marker = attrs.evolve(cell.markers[sight.name], pose=np.eye(4))
        return Target(name=sight.name, marker=marker, start=start, height=sight.height)
    part = cell.parts[sight.name]
    if part.marker is None:
        raise InvalidValueError(f"a camera cannot find {part.name}: it has no marker; expected one in its part table")
    # The part stands on its lowest point.
    height = None if sight.height is None else sight.height + support(part.shape, -part.pose[2, :3])
    return Target(name=part.name, marker=part.marker, start=part.pose, height=height, symmetry=part.symmetry)


def find_markers(picture: Picture, lens: Lens) -> dict[int, Array]:
    """Return the corners (4, 2) of the markers in a picture by their numbers [px], in the order of ``marker_corners``.

    Raises:
        MissingExtraError: OpenCV is missing.
    """
    cv2 = opencv(PURPOSE)
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    found, numbers, _ = cv2.aruco.ArucoDetector(dictionary(), cv2.aruco.DetectorParameters()).detectMarkers(grey)
    brightness = grey.astype(np.float64)
    result: dict[int, Array] = {}
    for corners, number in zip(found, [] if numbers is None else np.ravel(numbers).tolist(), strict=True):
        refined = _refined(brightness, np.asarray(corners, dtype=np.float64).reshape(4, 2), lens)
        if refined is not None:
            result[number] = refined
    return result


def _refined(brightness: Array, corners: Array, lens: Lens) -> Array | None:
    """Return the corners of a marker where lines along its edges meet; None where it has no edges there.

    A straight edge is a line in directions, but a curve in the picture of a lens that distorts.
    """
    for _ in range(_REFINEMENTS):
        lines = [_edge(brightness, corners[i], corners[(i + 1) % 4], lens) for i in range(4)]
        rows = np.array([line for line in lines if line is not None])
        if len(rows) < 4:
            return None
        meeting = [np.linalg.solve(rows[[i - 1, i], :2], rows[[i - 1, i], 2]) for i in range(4)]
        corners = lens.project(np.column_stack([meeting, np.ones(4)]))
    return corners


def _edge(brightness: Array, start: Array, end: Array, lens: Lens) -> Array | None:
    """Return the line n x + m y = d, (3,), of directions with z = 1 along an edge from black to white; None if none.

    Across the edge, the brightness missing from white gives how far the black reaches, however blurred the edge is.
    """
    length = float(np.linalg.norm(end - start))
    outwards = np.array([end[1] - start[1], start[0] - end[0]]) / length
    half = min(_ACROSS, _ACROSS_CELLS * length / CELLS)
    across = np.linspace(-half, half, _POINTS)
    along = np.linspace(_LEFT_OUT, 1 - _LEFT_OUT, max(8, round(2 * length)))
    base = start + along[:, None] * (end - start)
    profiles = _interpolated(brightness, base[:, None] + across[:, None] * outwards)
    black, white = profiles[:, :2].mean(), profiles[:, -2:].mean()
    if white - black < _LEAST_CONTRAST:
        return None
    dark = (white - profiles) / (white - black)
    reaching = -half + np.trapezoid(dark, across, axis=1)
    points = lens.rays(base + reaching[:, None] * outwards)[:, :2]
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle)[2][1]
    return np.array([*normal, normal @ middle])


def _interpolated(brightness: Array, pixels: Array) -> Array:
    """Return the brightness between pixels (..., 2)."""
    height, width = brightness.shape
    x, y = np.clip(pixels[..., 0], 0, width - 1), np.clip(pixels[..., 1], 0, height - 1)
    i, j = np.minimum(x.astype(np.intp), width - 2), np.minimum(y.astype(np.intp), height - 2)
    u, v = x - i, y - j
    upper = brightness[j, i] * (1 - u) + brightness[j, i + 1] * u
    lower = brightness[j + 1, i] * (1 - u) + brightness[j + 1, i + 1] * u
    return np.asarray(upper * (1 - v) + lower * v)


def target_pose(corners: Array, lens: Lens, X_WC: Array, target: Target) -> Array:
    """Return the pose (4, 4) of a target in the world.

    Args:
        corners: (4, 2) of its marker in a picture [px].
        lens: of the camera.
        X_WC: (4, 4) pose of the camera in the world.
        target: what the marker is on.

    Raises:
        DeviceError: the marker is at another height than expected, or its pose cannot be distinguished from another.
    """
    rays = lens.rays(corners)
    if target.height is None:
        X = _free_pose(rays, X_WC, target) @ inverse_pose(target.marker.pose)
    else:
        X = _standing_pose(rays @ X_WC[:3, :3].T, X_WC[:3, 3], target, target.height)
    return _folded(X, target)


def _standing_pose(rays: Array, eye: Array, target: Target, height: float) -> Array:
    """Return the pose of a target of which the height is known, and the orientation but for the yaw.

    Each corner is at a known height, where its ray is there: that leaves a shift and a rotation in the plane.

    Args:
        rays: (4, 3) directions to the corners of the marker in the world.
        eye: (3,) position of the camera.
        target: what is searched for.
        height: of its origin [m].
    """
    name, number = target.name, target.marker.number
    marker = target.marker.pose
    arms = (marker_corners(target.marker.size) @ marker[:3, :3].T + marker[:3, 3]) @ target.start[:3, :3].T
    heights = height + arms[:, 2]
    if (np.abs(rays[:, 2]) < _FLAT * np.linalg.norm(rays, axis=1)).any():
        raise DeviceError(f"marker {number} of {name} is seen, but from too flat an angle to compute its position")
    seen = eye[:2] + ((heights - eye[2]) / rays[:, 2])[:, None] * rays[:, :2]
    here, there = arms[:, :2] - arms[:, :2].mean(axis=0), seen - seen.mean(axis=0)
    cosine, sine = (here * there).sum(), (here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]).sum()
    R = elementary_rotation(2, float(np.arctan2(sine, cosine)))
    larger = float(np.hypot(cosine, sine) / (here**2).sum())
    if np.linalg.norm(there - larger * here @ R[:2, :2].T) > _WRONG_SHAPE * np.linalg.norm(there):
        raise DeviceError(f"marker {number} of {name} is seen, but tilted: {name} does not stand as at the start")
    if not abs(larger - 1) < _WRONG_SIZE:
        # What is nearer to the camera looks larger.
        offset = (1 - 1 / larger) * float(eye[2] - heights.mean()) * 1e3
        raise DeviceError(
            f"marker {number} of {name} is seen, but at another height: it looks {abs(offset):.0f} mm "
            f"{'higher' if offset > 0 else 'lower'} than in the vision of {name}"
        )
    return homogeneous(R @ target.start[:3, :3], (*(seen.mean(axis=0) - R[:2, :2] @ arms[:, :2].mean(axis=0)), height))


def _free_pose(rays: Array, X_WC: Array, target: Target) -> Array:
    """Return the pose of the marker of a target in the world of which nothing is known.

    Raises:
        DeviceError: another pose gives nearly the same picture.

    Source:
        Collins & Bartoli (2014), Infinitesimal plane-based pose estimation.
    """
    cv2 = opencv(PURPOSE)
    size, seen = target.marker.size, np.ascontiguousarray(rays[:, :2])
    flat = marker_corners(size) * (1, 1, 0)
    _, rotations, positions, errors = cv2.solvePnPGeneric(flat, seen, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    first, second = np.ravel(errors)[:2]
    if second < _TOLD_APART * first:
        raise DeviceError(
            f"marker {target.marker.number} of {target.name} is seen, but two orientations of it cannot be "
            "distinguished: look from a smaller distance, more from the side, or at something that stands at a "
            "known height"
        )
    rotation, position = cv2.solvePnPRefineLM(flat, seen, np.eye(3), None, rotations[0], positions[0])
    X_CM = homogeneous(cv2.Rodrigues(rotation)[0], np.ravel(position))
    # The pattern is on the front of the label.
    return np.asarray(X_WC @ X_CM @ homogeneous(np.eye(3), -marker_corners(size)[0] * (0, 0, 1)))


def _folded(X: Array, target: Target) -> Array:
    """Return the pose of a target with that of its equal orientations that is nearest to the one at the start."""
    turns = 2 * np.pi / target.symmetry * np.arange(target.symmetry)
    equal = [X @ homogeneous(elementary_rotation(2, float(turn)), np.zeros(3)) for turn in turns]
    angles = [np.linalg.norm(rotation_vector(target.start[:3, :3].T @ Y[:3, :3])) for Y in equal]
    # Of two that are as near, the first stays the first, whatever the rounding.
    return equal[int(np.argmin(np.round(angles, 6)))]
