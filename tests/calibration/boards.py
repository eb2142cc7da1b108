"""Boards that cameras on arms see: where their corners are, and pictures of them, drawn without a renderer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.arm_readings import ArmAccuracy, ArmReadings
from armwright.calibration.board import Board, BoardView, BoardViews, board_views
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import rotation_from_vector

CHARUCO = Board(columns=9, rows=7, square=0.03, marker=0.022)
WIDTH, HEIGHT = 640, 480
# The board faces the camera: its z points away, as the camera's does.
_MIN_FACING = np.cos(np.radians(55))


class Scene(NamedTuple):
    """A camera, an arm and a board, and what they are like in truth.

    Attributes:
        lens: of the camera.
        readings: of the arm, where it says that it is.
        eye_in_hand: whether the camera is on the hand.
        camera: (4, 4) its pose, on the hand or in the base frame.
        board: (4, 4) pose of the board, in the base frame or on the hand.
        seen: (m, 4, 4) poses of the board in the frame of the camera, where the arm truly is.
    """

    lens: Lens
    readings: ArmReadings
    eye_in_hand: bool
    camera: Array
    board: Array
    seen: Array


def random_lens(rng: np.random.Generator) -> Lens:
    """Return a lens of 45 to 65 degrees with a centre and a distortion of its own."""
    focal = rng.uniform(500, 700) * (1 + rng.uniform(-0.01, 0.01, 2))
    centre = np.array([319.5, 239.5]) + rng.uniform(-12, 12, 2)
    distortion = rng.uniform(-1, 1, 5) * [0.15, 0.05, 0.002, 0.002, 0.0]
    return Lens(width=WIDTH, height=HEIGHT, focal=focal, centre=centre, distortion=distortion)


def random_scene(
    rng: np.random.Generator,
    arm: Arm,
    pictures: int,
    *,
    eye_in_hand: bool,
    accuracy: ArmAccuracy,
    board: Board = CHARUCO,
) -> Scene:
    """Return a scene in which the arm moves about a random configuration so that the camera sees the board."""
    lens = random_lens(rng)
    while True:
        q0 = rng.uniform(-2, 2, arm.n)
        camera = homogeneous(rotation_from_vector(rng.uniform(-1.5, 1.5, 3)), rng.uniform(-0.1, 0.1, 3))
        size = np.array([board.columns, board.rows, 0]) * board.square
        middle = homogeneous(rotation_from_vector(rng.uniform(-0.3, 0.3, 3)), [0, 0, rng.uniform(0.4, 0.55)])
        first = middle @ homogeneous(np.eye(3), -size / 2)
        spread = np.where(np.arange(arm.n) < arm.n - 3, 0.12, 0.4)
        hand = forward(arm, q0)
        if eye_in_hand:
            fixed = hand @ camera @ first
        else:
            # The roles of the two are exchanged: the board is on the hand, and the camera beside.
            camera, fixed = hand @ camera @ inverse(first), camera
        q = q0 + rng.standard_normal((2000, arm.n)) * spread
        q = q[_shown(lens, board, _seen(forward(arm, q), camera, fixed, eye_in_hand=eye_in_hand))]
        if len(q) >= pictures:
            break
    readings = ArmReadings(arm=arm, q=q[:pictures], accuracy=accuracy)
    truly = readings.hand(rng.standard_normal((pictures, readings.corrections)))[0]
    return Scene(lens, readings, eye_in_hand, camera, fixed, _seen(truly, camera, fixed, eye_in_hand=eye_in_hand))


def projected(rng: np.random.Generator, scene: Scene, noise: float, board: Board = CHARUCO) -> BoardViews:
    """Return where corners are seen that are in the picture, with noise [px]."""
    views = []
    for k, X in enumerate(scene.seen):
        pixels = scene.lens.project(board.points @ X[:3, :3].T + X[:3, 3]) + noise * rng.standard_normal(
            (len(board.points), 2)
        )
        inside = np.flatnonzero(((pixels > 3) & (pixels < [WIDTH - 4, HEIGHT - 4])).all(axis=1))
        views.append(BoardView(name=f"picture_{k:02d}", corners=inside, pixels=pixels[inside]))
    return board_views(board, (WIDTH, HEIGHT), views)


def _seen(hand: Array, camera: Array, board: Array, *, eye_in_hand: bool) -> Array:
    return inverse(camera) @ (inverse(hand) if eye_in_hand else hand) @ board


def _shown(lens: Lens, board: Board, X: Array) -> Array:
    """Return at which poses of the board, which is not too oblique, most of its corners are in the picture."""
    points = board.points @ np.swapaxes(X[:, :3, :3], 1, 2) + X[:, None, :3, 3]
    possible = (points[..., 2].min(axis=1) > 0.2) & (X[:, 2, 2] > _MIN_FACING)
    pixels = lens.project(np.where(possible[:, None, None], points, [0, 0, 1]))
    inside = ((pixels > 8) & (pixels < [WIDTH - 9, HEIGHT - 9])).all(axis=2)
    return possible & (inside.mean(axis=1) > 0.7)


# ---- pictures ------------------------------------------------------------------------------------------------------

# Samples along each side of a pixel, whose mean is what the pixel sees; and pixels of the printed board per square.
_SAMPLES, _PRINTED = 4, 80
_WHITE, _BLACK, _GREY = 215.0, 35.0, 128.0


def printed(board: Board) -> Array:
    """Return the board as printed, with white paper of one square around it."""
    import cv2

    if board.marker is None:
        y, x = np.mgrid[: board.rows, : board.columns]
        squares = np.where((x + y) % 2 == 0, 0, 255).astype(np.uint8)
        image = np.kron(squares, np.ones((_PRINTED, _PRINTED), dtype=np.uint8))
    else:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}"))
        made = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, dictionary)
        image = made.generateImage((board.columns * _PRINTED, board.rows * _PRINTED))
    padded = np.pad(image, _PRINTED, constant_values=255)
    return _BLACK + (_WHITE - _BLACK) / 255 * padded.astype(np.float32)


def photographed(rng: np.random.Generator, board: Board, lens: Lens, X_CO: Array, noise: float) -> Array:
    """Return the picture (height, width) that a lens makes of a board, with noise of its grey values."""
    import cv2

    rays = _fine_rays(lens)
    # A ray meets the plane of the board where H takes it.
    H = np.linalg.inv(np.column_stack([X_CO[:3, 0], X_CO[:3, 1], X_CO[:3, 3]]))
    meets = rays @ H.T.astype(np.float32)
    scale = _PRINTED / board.square
    # The first sample of the print is in the middle of its first cell.
    x, y = (meets[..., i] / meets[..., 2] * scale + _PRINTED - 0.5 for i in (0, 1))
    fine = cv2.remap(printed(board), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=_GREY)
    picture = cv2.resize(fine, (lens.width, lens.height), interpolation=cv2.INTER_AREA)
    return (picture + noise * rng.standard_normal(picture.shape)).round().clip(0, 255).astype(np.uint8)


_RAYS: dict[int, tuple[Lens, Array]] = {}


def _fine_rays(lens: Lens) -> Array:
    """Return the rays of all samples of a picture, interpolated between those of every eighth pixel."""
    from scipy.interpolate import RectBivariateSpline

    if id(lens) not in _RAYS:
        u, v = np.arange(-8, lens.width + 16, 8.0), np.arange(-8, lens.height + 16, 8.0)
        coarse = lens.rays(np.stack(np.meshgrid(u, v), axis=-1))
        step = (np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5
        fine_u, fine_v = ((np.arange(n)[:, None] + step).ravel() for n in (lens.width, lens.height))
        rays = [RectBivariateSpline(v, u, coarse[..., i])(fine_v, fine_u).astype(np.float32) for i in (0, 1)]
        _RAYS.clear()
        _RAYS[id(lens)] = lens, np.stack([*rays, np.ones_like(rays[0])], axis=-1)
    return _RAYS[id(lens)][1]
