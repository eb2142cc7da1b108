"""Tables and files about a camera: detected corners, joint positions of pictures, and the lens.

Corners: one row for each, ``picture, corner, x_px, y_px``. Joint positions: one row for each picture, ``picture,
joint_1_deg, joint_2_deg, ...``; pictures are called by the names of their files, with or without the ending.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.board import Board, BoardView, BoardViews, board_views
from armwright.calibration.columns import position_columns
from armwright.errors import FileFormatError, TooFewError, closest
from armwright.files.column_names import NUMBER, Column, Schema
from armwright.files.document import Document, Table
from armwright.files.limits import limit, limit_message
from armwright.files.pictures import ENDINGS
from armwright.files.unit_table import read_header
from armwright.spatial.lens import Lens

_CORNER_COLUMNS = Schema(
    columns=(
        Column(name="picture", synonyms=("name", "file", "image")),
        Column(name="corner", quantity=NUMBER, synonyms=("id",)),
        Column(name="x_px", quantity=NUMBER, synonyms=("u", "u_px", "x")),
        Column(name="y_px", quantity=NUMBER, synonyms=("v", "v_px", "y")),
    )
)
# The largest number of corners of a board and of its coordinates that is looked at.
_LARGEST = 1e6
_MAX_SIDE = 100_000
_MAX_NAMED = 8


class PictureJoints(NamedTuple):
    """Joint positions by picture.

    Attributes:
        path: of the file.
        names: of the pictures.
        q: (m, n) joint positions [rad] or [m].
    """

    path: Path
    names: tuple[str, ...]
    q: Array

    def of(self, pictures: Sequence[str]) -> tuple[list[int], Array]:
        """Return which of some pictures have joint positions, and these (k, n).

        Raises:
            TooFewError: none has.
        """
        rows = {_stem(name): i for i, name in enumerate(self.names)}
        present = [k for k, name in enumerate(pictures) if _stem(name) in rows]
        if not present:
            near = closest(_stem(pictures[0]), rows)
            hint = f"; did you mean '{near}'?" if near else ""
            listed = ", ".join(self.names[:_MAX_NAMED])
            raise TooFewError(f"{self.path}: no row is of picture {pictures[0]}{hint}; there are rows of {listed}")
        return present, self.q[[rows[_stem(pictures[k])] for k in present]]


def read_corners(path: Path | str, board: Board, size: tuple[int, int], *, least: int = 3) -> BoardViews:
    """Read the corners of a board that were detected in pictures.

    Args:
        path: of the table.
        board: that the pictures show.
        size: width and height of the pictures [px].
        least: how many pictures must show enough corners.

    Raises:
        FileFormatError: the file is missing, or no such table.
        InvalidValueError: a corner is none of the board, twice in a picture, outside of it, or the order is mirrored.
        TooFewError: too few pictures show enough corners.
    """
    header = read_header(path, _CORNER_COLUMNS)
    names = [column.name for column in _CORNER_COLUMNS.columns]
    header.require(names)
    table = header.rows(filled=names)
    numbers = table.numbers(names[1:])
    wrong = np.flatnonzero((np.abs(numbers) > _LARGEST).any(axis=1) | (numbers[:, 0] % 1 != 0) | (numbers[:, 0] < 0))
    if len(wrong):
        row = int(wrong[0])
        message = f"expected the number of a corner, 0 or more, and its pixel, got {numbers[row].tolist()}"
        raise table.error(row, "corner", message)
    rows: dict[str, list[int]] = {}
    for i, name in enumerate(table.words("picture")):
        rows.setdefault(name, []).append(i)
    if len(rows) > limit("pictures"):
        raise FileFormatError(table.path, None, "picture", f"too many: {limit_message('pictures', len(rows))}")
    views = [
        BoardView(name=name, corners=numbers[own, 0].astype(np.int64), pixels=numbers[own, 1:])
        for name, own in rows.items()
    ]
    return board_views(board, size, views, least=least)


def corners_text(views: BoardViews) -> str:
    """Return the corners in pictures as the text of a table, which ``read_corners`` reads."""
    lines = ["picture,corner,x_px,y_px"]
    for view in views.views:
        name = f'"{view.name.replace(chr(34), chr(34) * 2)}"' if set(view.name) & set(',;"\n') else view.name
        lines += [
            f"{name},{corner},{x:.4f},{y:.4f}"
            for corner, (x, y) in zip(view.corners.tolist(), view.pixels.tolist(), strict=True)
        ]
    return "\n".join(lines) + "\n"


def read_picture_joints(
    path: Path | str, arm: Arm, *, units: Mapping[str, str] | None = None, columns: Mapping[str, str] | None = None
) -> PictureJoints:
    """Read the joint positions of an arm at which pictures were taken.

    Args:
        path: of the table.
        arm: with n joints.
        units: for columns whose names have none, by quantity, such as ``{"angle": "deg"}``.
        columns: names of columns, with unit, by those in the file.

    Raises:
        FileFormatError: the file is missing, or no such table; a picture is there twice.
    """
    joints = position_columns(arm)
    names = [column.name for column in joints]
    picture = Column(name="picture", synonyms=("name", "file", "image"))
    header = read_header(path, Schema(columns=(picture, *joints)), columns=columns, units=units or {})
    count = len(header.columns_present(names))
    header.require(["picture", *names], f"{arm.name} has {arm.n} joints, and the file has {count}")
    table = header.rows(filled=["picture", *names])
    seen = dict[str, int]()
    for i, name in enumerate(table.words("picture")):
        if (first := seen.setdefault(_stem(name), i)) != i:
            raise table.error(i, "picture", f"expected one row of each picture; {name} is in line {table.lines[first]}")
    return PictureJoints(table.path, tuple(table.words("picture")), table.numbers(names))


def read_lens(path: Path | str) -> Lens:
    """Read the lens of the only camera of a file with ``[cameras.NAME]``, such as this calibration writes.

    Raises:
        FileFormatError: the file is missing, has no camera or several, or a number of the lens is missing or invalid.
    """
    top = Document.read(path).root
    cameras = top.table("cameras", required=True)
    names = list(cameras)
    if len(names) != 1:
        raise cameras.error(None, f"expected one camera, got {len(names)}")
    return _lens(cameras.table(names[0], required=True))


# ---- inside --------------------------------------------------------------------------------------------------------


def _stem(name: str) -> str:
    """Return the name of a picture without folder and ending."""
    name = name.replace("\\", "/").rpartition("/")[2]
    return name.rpartition(".")[0] if name.lower().endswith(ENDINGS) else name


def _lens(table: Table) -> Lens:
    width, height = (table.number(key, lower=1, upper=_MAX_SIDE) for key in ("width", "height"))
    focal, centre = table.vector("focal_px", 2), table.vector("centre_px", 2)
    if not (focal > 0).all():
        raise table.error("focal_px", f"expected numbers above 0, got {focal.tolist()}")
    distortion = table.vector("distortion", 5, default=[0.0] * 5)
    for key, value, largest in (("focal_px", focal, 1e7), ("centre_px", centre, 1e7), ("distortion", distortion, 1e3)):
        if (np.abs(value) > largest).any():
            raise table.error(key, f"expected numbers no larger than {largest:g}, got {value.tolist()}")
    return Lens(width=int(width), height=int(height), focal=focal, centre=centre, distortion=distortion)
