"""Finding a board in pictures, with OpenCV."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.calibration.board import Board, BoardView, BoardViews, board_views
from armwright.errors import FileFormatError, InvalidValueError, TooFewError, UnknownNameError
from armwright.extras import opencv
from armwright.files.inputs import file_path
from armwright.files.limits import limit, limit_message
from armwright.files.pictures import GreyPicture, read_grey_picture

_PREFIX = "DICT_"
# The least length of the side of a picture in which a board may be [px].
_MIN_SIDE = 32
# OpenCV takes some 200 bytes a pixel to look for a chessboard, so it looks in pictures of no more pixels than this.
_MAX_PIXELS = 6_000_000
# Corners found in a smaller picture are looked for within so many of its pixels, until they move by less [px].
_AROUND, _STILL, _MOST_STEPS = 2, 1e-3, 40


def board_finder(board: Board) -> Callable[[str, GreyPicture], BoardView | None]:
    """Return a function that finds a board in the grey values (height, width) of a picture with a name.

    The function returns None for a picture without the board. It raises ``InvalidValueError`` for a mirror image of a
    board with markers.

    Args:
        board: to find.

    Raises:
        UnknownNameError: there is no such dictionary of markers.
        InvalidValueError: the dictionary has too few markers.
        MissingExtraError: OpenCV is not installed.
    """
    cv2 = opencv("calibrating a camera")
    if board.marker is None:
        return lambda name, picture: _find_chessboard(cv2, board, name, picture)
    detector = cv2.aruco.CharucoDetector(_charuco_board(cv2, board))
    return lambda name, picture: _find_charuco(detector, name, picture)


def views_of_pictures(
    paths: Sequence[Path | str], board: Board, *, least: int = 3, progress: Callable[[str], None] | None = None
) -> BoardViews:
    """Read pictures and find a board in them; those that show too little of it are left out by name.

    Args:
        paths: of the pictures, PNG or JPEG.
        board: that they show.
        least: how many pictures must show it.
        progress: called with what is being done.

    Raises:
        FileFormatError: a picture cannot be read, or has another size than the first.
        InvalidValueError: there are more pictures than the limit, or two of one name; a picture is mirrored.
        TooFewError: too few pictures show the board.
        UnknownNameError: there is no such dictionary of markers.
        MissingExtraError: OpenCV is not installed.
    """
    if len(paths) > limit("pictures"):
        raise InvalidValueError(f"too many pictures: {limit_message('pictures', len(paths))}")
    if not paths:
        raise TooFewError(f"expected {least} pictures or more, got none")
    find, views, missing = board_finder(board), list[BoardView](), dict[str, str]()
    size = 0, 0
    for number, path in enumerate(map(file_path, paths), 1):
        if progress is not None:
            progress(f"looking for the board in picture {number} of {len(paths)}")
        picture = read_grey_picture(path)
        height, width = picture.shape
        if number == 1:
            size = width, height
            if min(size) < _MIN_SIDE:
                raise FileFormatError(path, None, "", f"expected a picture of a board, got {width} x {height} pixels")
        elif (width, height) != size:
            first = f"{size[0]} x {size[1]} pixels as in {Path(paths[0]).name}"
            message = f"expected {first}, got {width} x {height}; all pictures must be from one camera at one setting"
            raise FileFormatError(path, None, "", message)
        view = find(path.name, picture)
        if view is None:
            missing[path.name] = "the board is not found"
        else:
            views.append(view)
    if not views:
        raise TooFewError(
            f"the board is not found in any of {len(paths)} pictures; check the numbers of squares (columns x rows, "
            f"{board.columns} x {board.rows}) and {_hint(board)}"
        )
    return board_views(board, size, views, least=least, left_out=missing)


# ---- inside --------------------------------------------------------------------------------------------------------


def _hint(board: Board) -> str:
    if board.marker is None:
        return "whether the whole board is in the pictures, with a white margin"
    return f"the dictionary of the markers, {board.dictionary}"


def _charuco_board(cv2: ModuleType, board: Board) -> Any:
    known = [name.removeprefix(_PREFIX) for name in dir(cv2.aruco) if name.startswith(_PREFIX)]
    name = board.dictionary.upper().removeprefix(_PREFIX)
    # OpenCV has some names in two spellings.
    number = next((getattr(cv2.aruco, f"{_PREFIX}{word}") for word in known if word.upper() == name), None)
    if number is None:
        raise UnknownNameError("dictionary of markers", board.dictionary, {word.upper() for word in known})
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    needed, there = board.columns * board.rows // 2, len(dictionary.bytesList)
    if needed > there:
        raise InvalidValueError(
            f"a board of {board.columns} x {board.rows} squares has {needed} markers, and the dictionary {name} only "
            f"{there}; name a larger one, such as {name.rpartition('_')[0]}_{1000 if needed > 250 else 250}"
        )
    return cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, dictionary)


def _find_charuco(detector: Any, name: str, picture: GreyPicture) -> BoardView | None:
    corners, numbers, *_ = detector.detectBoard(picture)
    if numbers is not None and len(numbers):
        return BoardView(name=name, corners=np.ravel(numbers), pixels=_pixels(corners))
    mirrored = detector.detectBoard(np.ascontiguousarray(picture[:, ::-1]))[1]
    if mirrored is not None and len(mirrored):
        raise InvalidValueError(
            f"{name}: the board is there as a mirror image; the picture was mirrored, or the board was printed so"
        )
    return None


def _find_chessboard(cv2: ModuleType, board: Board, name: str, picture: GreyPicture) -> BoardView | None:
    size = board.columns - 1, board.rows - 1
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    shrink = math.ceil(math.sqrt(picture.size / _MAX_PIXELS))
    height, width = picture.shape
    smaller = width // shrink, height // shrink
    small = picture if shrink == 1 else cv2.resize(picture, smaller, interpolation=cv2.INTER_AREA)
    done, corners = cv2.findChessboardCornersSB(small, size, flags=flags)
    if not done:
        return None
    pixels = _pixels(corners)
    if shrink > 1:
        near = ((pixels + 0.5) * (width / smaller[0], height / smaller[1]) - 0.5).astype(np.float32)
        criteria = cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, _MOST_STEPS, _STILL
        pixels = _pixels(cv2.cornerSubPix(picture, near, (_AROUND * shrink,) * 2, (-1, -1), criteria))
    if not board.looks_the_same_upside_down and _first_square_is_white(board, picture, pixels):
        pixels = pixels[::-1]
    return BoardView(name=name, corners=np.arange(len(pixels)), pixels=pixels)


def _first_square_is_white(board: Board, picture: GreyPicture, pixels: Array) -> bool:
    """Whether the inner squares that should be black are brighter than the others."""
    grid = pixels.reshape(board.rows - 1, board.columns - 1, 2)
    middles = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    x, y = np.rint(middles).astype(np.int64).reshape(-1, 2).T
    grey = picture[y, x].reshape(middles.shape[:2]).astype(np.float64)
    row, column = np.indices(grey.shape)
    return bool(grey[(row + column) % 2 == 0].mean() > grey[(row + column) % 2 == 1].mean())


def _pixels(corners: Any) -> Array:
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2)
