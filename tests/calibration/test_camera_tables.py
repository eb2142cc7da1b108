"""Tables of corners and joint positions, and files with a lens, are read or refused with the line that is wrong."""

from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.board import Board, BoardView, board_views
from armwright.calibration.camera_tables import corners_text, read_corners, read_lens, read_picture_joints
from armwright.errors import FileFormatError, InvalidValueError, TooFewError
from armwright.files.limits import raised

BOARD = Board(columns=4, rows=4, square=0.1)
SIZE = 400, 300


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_corners_round_trip(rng: np.random.Generator, tmp_path: Path) -> None:
    """Corners that are written are read as they were, to a thousandth of a pixel, whatever pictures are called."""
    pixels = BOARD.points[:, :2] * 600 + 20
    names = ("a.png", 'of "us", b', "ö")
    views = [BoardView(name=name, corners=np.arange(9), pixels=pixels + rng.uniform(0, 9, 2)) for name in names]
    path = written(tmp_path / "corners.csv", corners_text(board_views(BOARD, SIZE, views)))

    back = read_corners(path, BOARD, SIZE)

    assert back.names == names
    for one, other in zip(back.views, views, strict=True):
        np.testing.assert_array_equal(one.corners, other.corners)
        np.testing.assert_allclose(one.pixels, other.pixels, atol=1e-3)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("a,0.5,1,1", r"corners.csv:2: corner: expected the number of a corner, 0 or more, and its pixel, got \[0.5"),
        ("a,1e300,1,1", "corners.csv:2: corner"),
        ("a,-1,1,1", "corners.csv:2: corner: expected the number of a corner"),
        ("a,0,nan,1", "corners.csv:2: x_px"),
        ("a,0,1", "corners.csv:2"),
    ],
)
def test_wrong_corners(tmp_path: Path, rows: str, message: str) -> None:
    """A corner has a whole number and a finite pixel."""
    with pytest.raises(FileFormatError, match=message):
        read_corners(written(tmp_path / "corners.csv", f"picture,corner,x_px,y_px\n{rows}\n"), BOARD, SIZE)


def test_other_columns_and_too_many_pictures(tmp_path: Path) -> None:
    """A table without corners is refused, one of another board too, and pictures beyond the limit."""
    with pytest.raises(FileFormatError, match="corner: no such column"):
        read_corners(written(tmp_path / "a.csv", "picture,x_px,y_px\na,1,1\n"), BOARD, SIZE)
    with pytest.raises(InvalidValueError, match="a: expected corners from 0 to 8 of a board of 4 x 4 squares, got 9"):
        read_corners(written(tmp_path / "b.csv", "picture,corner,x_px,y_px\na,9,1,1\n"), BOARD, SIZE)
    many = "picture,corner,x_px,y_px\n" + "".join(f"p{i},0,1,1\n" for i in range(5))
    with raised(pictures=4), pytest.raises(FileFormatError, match="too many: 5; the limit is 4"):
        read_corners(written(tmp_path / "c.csv", many), BOARD, SIZE)


def test_joint_positions_of_pictures(tmp_path: Path) -> None:
    """Pictures have the names of their files, with or without folder and ending, in any order."""
    arm = load_arm("stanford")
    head = "picture,joint_1_deg,joint_2_deg,joint_3_mm,joint_4_deg,joint_5_deg,joint_6_deg"
    path = written(tmp_path / "joints.csv", f"{head}\nrun/b.png,0,90,100,0,0,0\na,10,0,200,0,0,0\n")

    joints = read_picture_joints(path, arm)
    present, q = joints.of(["a.PNG", "c.png", "b.png"])

    assert present == [0, 2]
    np.testing.assert_allclose(q[:, :3], [[np.radians(10), 0, 0.2], [0, np.pi / 2, 0.1]])
    with pytest.raises(TooFewError, match=r"no row is of picture c.png; there are rows of run/b.png, a"):
        joints.of(["c.png"])
    twice = written(tmp_path / "twice.csv", f"{head}\na,0,0,0,0,0,0\na.png,0,0,0,0,0,0\n")
    with pytest.raises(FileFormatError, match=r"expected one row of each picture; a.png is in line 2"):
        read_picture_joints(twice, arm)
    with pytest.raises(FileFormatError, match="no such column; stanford has 6 joints, and the file has 1"):
        read_picture_joints(written(tmp_path / "few.csv", "picture,joint_1_deg\na,0\n"), arm)


def test_a_lens_in_a_file(tmp_path: Path) -> None:
    """The lens of a camera of a cell file is read, whatever else the camera has."""
    lines = "[cameras.eye]\nwidth = 640\nheight = 480\nfocal = [600.0, 601.0]\ncentre = [320.0, 240.0]\n"
    lens = read_lens(written(tmp_path / "a.toml", lines + "distortion = [0.1, 0, 0, 0, 0]\npose = [1]\n"))

    np.testing.assert_array_equal(lens.matrix, [[600, 0, 320], [0, 601, 240], [0, 0, 1]])
    np.testing.assert_array_equal(lens.distortion, [0.1, 0, 0, 0, 0])
    for text, message in (
        ("", "cameras: missing, expected a table"),
        (lines + "[cameras.other]\n", "cameras: expected one camera, got 2"),
        (lines.replace("600.0", "-1"), "cameras, eye, focal: expected numbers above 0"),
        (lines.replace("600.0", "1e99"), "cameras, eye, focal: expected numbers no larger than 1e"),
        (lines.replace("640", "0"), "cameras, eye, width: expected 1 to 100000, got 0"),
        (lines.replace("width = 640\n", ""), "cameras, eye, width: missing"),
    ):
        with pytest.raises(FileFormatError, match=message):
            read_lens(written(tmp_path / "b.toml", text))
