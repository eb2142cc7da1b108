"""Boards that cameras are calibrated with, and where their corners are seen in pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, integer, positive, read_only
from armwright.errors import InvalidValueError, ShapeError, TooFewError, counted

Numbers: TypeAlias = npt.NDArray[np.int64]

# Of a dictionary of markers, as OpenCV calls it behind DICT_.
USUAL_DICTIONARY = "4X4_50"
# A board has no more squares along a side.
_MAX_SQUARES = 100
# A picture with fewer corners is left out: a pose takes three, and the rest shows whether they fit.
MIN_CORNERS = 6
# Corners are on one line if the board is wider than this only along it [squares].
_MIN_WIDTH = 0.4


def _count(value: int) -> int:
    result = integer(value, "squares along a side of the board", least=3)
    if result > _MAX_SQUARES:
        raise InvalidValueError(f"squares along a side of the board: expected at most {_MAX_SQUARES}, got {result}")
    return result


def _square(value: float) -> float:
    return positive(value, "square of the board", "m")


@attrs.frozen(kw_only=True)
class Board:
    """A chessboard, or with markers in its white squares a ChArUco board.

    The frame of the board has its origin in the outer corner of the first square, x along the first row, y along the
    first column, z into the board. The first square of a chessboard is black. Corners are numbered along the rows.

    Attributes:
        columns: squares in a row.
        rows: squares in a column.
        square: length of the side of a square [m].
        marker: length of the side of a marker [m]; None for a chessboard.
        dictionary: of the markers, such as ``4X4_50``.
    """

    columns: int = attrs.field(converter=_count)
    rows: int = attrs.field(converter=_count)
    square: float = attrs.field(converter=_square)
    marker: float | None = None
    dictionary: str = USUAL_DICTIONARY

    def __attrs_post_init__(self) -> None:
        """Refuse a marker that is no smaller than a square."""
        if self.marker is not None and not 0 < self.marker < self.square:
            raise InvalidValueError(
                f"marker of the board: expected a length between 0 and the square, {self.square:g} m, got "
                f"{self.marker:g} m"
            )

    @property
    def points(self) -> Array:
        """(c, 3) the inner corners in the frame of the board [m]."""
        y, x = np.mgrid[1 : self.rows, 1 : self.columns]
        return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1) * self.square

    @property
    def looks_the_same_upside_down(self) -> bool:
        """Whether half a revolution changes nothing that a camera sees."""
        return self.marker is None and (self.columns + self.rows) % 2 == 0


@attrs.frozen(kw_only=True, eq=False)
class BoardView:
    """What one picture shows of a board.

    Attributes:
        name: of the picture.
        corners: (c,) numbers of the corners that are seen.
        pixels: (c, 2) where they are seen, the centre of the first pixel at (0, 0).
    """

    name: str
    corners: Numbers = attrs.field(converter=read_only)
    pixels: Array = attrs.field(converter=read_only)

    def __attrs_post_init__(self) -> None:
        """Refuse corners that are not as many as their pixels."""
        if self.pixels.shape != (len(self.corners), 2):
            raise ShapeError(
                f"{self.name}: expected {counted(len(self.corners), 'pixel')} for as many corners, got an array of "
                f"shape {self.pixels.shape}"
            )


@attrs.frozen(kw_only=True, eq=False)
class BoardViews:
    """Pictures of one board by one camera.

    Attributes:
        board: the board.
        width: of the pictures [px].
        height: of the pictures [px].
        views: what each shows.
        left_out: pictures that do not count, with the reason.
    """

    board: Board
    width: int
    height: int
    views: tuple[BoardView, ...]
    left_out: dict[str, str] = attrs.field(factory=dict)

    def __len__(self) -> int:
        """Return how many pictures count."""
        return len(self.views)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the pictures."""
        return tuple(view.name for view in self.views)

    @property
    def sizes(self) -> list[int]:
        """How many corners each picture has."""
        return [len(view.corners) for view in self.views]

    @property
    def picture(self) -> Numbers:
        """(c,) of each corner, the number of its picture."""
        return np.repeat(np.arange(len(self.views)), self.sizes)

    @property
    def points(self) -> Array:
        """(c, 3) of each corner, its point of the board [m]."""
        return np.asarray(self.board.points[np.concatenate([view.corners for view in self.views])])

    @property
    def pixels(self) -> Array:
        """(c, 2) where each corner is seen."""
        return np.asarray(np.concatenate([view.pixels for view in self.views]))

    def take(self, numbers: Sequence[int]) -> BoardViews:
        """Return some of the pictures, by their numbers from 0."""
        return attrs.evolve(self, views=tuple(self.views[i] for i in numbers))


def board_views(
    board: Board,
    size: tuple[int, int],
    views: Sequence[BoardView],
    *,
    least: int = 3,
    left_out: Mapping[str, str] | None = None,
) -> BoardViews:
    """Return the pictures that show enough of a board; the others are left out by name.

    Args:
        board: that they show.
        size: width and height of the pictures [px].
        views: of the pictures.
        least: how many pictures are needed.
        left_out: other pictures, which do not show it, with the reason.

    Raises:
        InvalidValueError: a corner is none of the board, twice in a picture, or outside of the picture; two pictures
            have one name; a picture shows the board from behind.
        TooFewError: too few pictures show enough corners.
    """
    width, height = size
    kept, left_out = list[BoardView](), dict(left_out or {})
    for view in views:
        if view.name in (*left_out, *(other.name for other in kept)):
            raise InvalidValueError(f"expected one picture of each name, got several of {view.name}")
        _check_corners(board, width, height, view)
        if reason := _insufficient(board, view):
            left_out[view.name] = reason
        elif _area_scale(board, view) < 0:
            raise InvalidValueError(
                f"{view.name}: the corners are in the order of a mirror image, as if the board were seen from behind; "
                "expected x along its rows to the right and y along its columns down, seen from the front"
            )
        else:
            kept.append(view)
    if len(kept) < least:
        reasons = "".join(f"; {name}: {reason}" for name, reason in left_out.items())
        raise TooFewError(
            f"expected {least} pictures or more that show {MIN_CORNERS} corners of the board, got {len(kept)}{reasons}"
        )
    return BoardViews(board=board, width=width, height=height, views=tuple(kept), left_out=left_out)


def _check_corners(board: Board, width: int, height: int, view: BoardView) -> None:
    count = (board.columns - 1) * (board.rows - 1)
    if len(view.corners) and not (view.corners.min() >= 0 and view.corners.max() < count):
        wrong = int(view.corners[(view.corners < 0) | (view.corners >= count)][0])
        raise InvalidValueError(
            f"{view.name}: expected corners from 0 to {count - 1} of a board of {board.columns} x {board.rows} "
            f"squares, got {wrong}"
        )
    numbers, counts = np.unique(view.corners, return_counts=True)
    if (counts > 1).any():
        raise InvalidValueError(f"{view.name}: corner {numbers[counts > 1][0]} is there more than once")
    outside = ((view.pixels < -0.5) | (view.pixels > np.subtract([width, height], 0.5))).any(axis=1)
    if outside.any():
        x, y = view.pixels[outside][0]
        raise InvalidValueError(
            f"{view.name}: corner {view.corners[outside][0]} at ({x:.1f}, {y:.1f}) is outside of a picture of {width} "
            f"x {height} pixels"
        )


def _insufficient(board: Board, view: BoardView) -> str:
    """Return why a picture shows too little of the board; empty if it shows enough."""
    if len(view.corners) < MIN_CORNERS:
        return f"{counted(len(view.corners), 'corner')}, expected {MIN_CORNERS} or more"
    flat = board.points[view.corners, :2]
    widths = np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False) / np.sqrt(len(flat))
    return "" if widths[1] > _MIN_WIDTH * board.square else "all its corners are on one line"


def _area_scale(board: Board, view: BoardView) -> float:
    """Return how areas of the board grow in the picture; it is negative in a mirror image."""
    flat = np.column_stack([board.points[view.corners, :2], np.ones(len(view.corners))])
    affine = np.linalg.pinv(flat) @ view.pixels
    return float(np.linalg.det(affine[:2]))
