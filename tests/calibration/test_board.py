"""Boards and where they are seen: geometry as OpenCV has it, found in drawn pictures, refused where they deceive."""

import subprocess
import sys
from pathlib import Path

import attrs
import numpy as np
import pytest
from PIL import Image

from armwright.calibration import board_detection
from armwright.calibration.board import Board, BoardView, board_views
from armwright.calibration.board_detection import board_finder, views_of_pictures
from armwright.errors import FileFormatError, InvalidValueError, TooFewError, UnknownNameError
from armwright.files.limits import raised
from armwright.spatial.lens import Lens, simple_lens
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from calibration.boards import CHARUCO, photographed, random_lens

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

cv2 = pytest.importorskip("cv2")

CHESSBOARD = Board(columns=8, rows=5, square=0.04)
SIZE = 640, 480


def pose(board: Board, rotation: tuple[float, float, float], distance: float) -> np.ndarray:
    """Return the pose of a board whose middle is straight ahead."""
    R = rotation_from_vector(rotation)
    middle = np.array([board.columns, board.rows, 0]) * board.square / 2
    return homogeneous(R, [0, 0, distance] - R @ middle)


def test_corners_are_those_of_opencv() -> None:
    """Corners of a board with markers have the numbers and points that OpenCV gives them."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    other = cv2.aruco.CharucoBoard((9, 7), CHARUCO.square, CHARUCO.marker, dictionary)

    np.testing.assert_allclose(CHARUCO.points, other.getChessboardCorners(), atol=1e-7)


@pytest.mark.parametrize("board", [CHARUCO, CHESSBOARD], ids=["charuco", "chessboard"])
def test_corners_are_found_where_they_are_drawn(rng: np.random.Generator, board: Board) -> None:
    """However the board is turned, each corner is found within a quarter of a pixel, under its own number."""
    find, lens = board_finder(board), random_lens(rng)
    for _ in range(8):
        tilt = rng.uniform(-0.5, 0.5, 2)
        X = pose(board, (0, 0, rng.uniform(-3.1, 3.1)), 0.65) @ homogeneous(rotation_from_vector([*tilt, 0]), [0, 0, 0])
        X[:3, 3] += [0, 0, 0.65] - (X @ [board.columns * board.square / 2, board.rows * board.square / 2, 0, 1])[:3]
        view = find("drawn", photographed(rng, board, lens, X, 2.0))

        assert view is not None
        assert len(view.corners) >= 0.9 * len(board.points)
        expected = lens.project(board.points[view.corners] @ X[:3, :3].T + X[:3, 3])
        errors = np.linalg.norm(view.pixels - expected, axis=1)
        assert np.median(errors) < 0.1
        assert errors.max() < 0.6


@pytest.mark.parametrize("most", [300_000, 100_000])
def test_large_pictures(rng: np.random.Generator, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a picture that is too large for OpenCV corners are found in a smaller one, and are as exact as otherwise."""
    find, lens = board_finder(CHESSBOARD), random_lens(rng)
    errors = []
    for _ in range(8):
        X = pose(CHESSBOARD, (*rng.uniform(-0.3, 0.3, 2), rng.uniform(-3.1, 3.1)), 0.65)
        picture = photographed(rng, CHESSBOARD, lens, X, 2.0)
        expected = lens.project(CHESSBOARD.points @ X[:3, :3].T + X[:3, 3])
        monkeypatch.setattr(board_detection, "_MAX_PIXELS", most)
        view = find("drawn", picture)

        assert view is not None
        np.testing.assert_array_equal(view.corners, np.arange(len(CHESSBOARD.points)))
        errors.append(np.linalg.norm(view.pixels - expected, axis=1))
    assert np.median(errors) < 0.1
    assert np.max(errors) < 0.6


def test_a_picture_of_nothing_takes_little_memory() -> None:
    """Pictures of a modern camera in which there is no board are looked through in some hundred megabytes."""
    script = """import resource, numpy as np
from armwright.calibration.board import Board
from armwright.calibration.board_detection import board_finder
find, before = board_finder(Board(columns=9, rows=7, square=0.03)), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
assert find("black", np.zeros((5000, 6000), np.uint8)) is None
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 1_500_000


def test_a_mirrored_picture_is_refused(rng: np.random.Generator) -> None:
    """A mirror image of markers is told from a picture without a board."""
    picture = photographed(rng, CHARUCO, simple_lens(*SIZE, 0.8), pose(CHARUCO, (0.2, 0.1, 0.3), 0.45), 2.0)
    find = board_finder(CHARUCO)

    with pytest.raises(InvalidValueError, match=r"left.png: the board is there as a mirror image"):
        find("left.png", picture[:, ::-1].copy())
    assert find("empty.png", np.full((480, 640), 128, dtype=np.uint8)) is None


def test_an_order_from_behind_is_refused() -> None:
    """Corners whose rows run to the left while their columns run down are those of a mirror image."""
    lens, X = simple_lens(*SIZE, 0.8), pose(CHESSBOARD, (0.2, 0.1, 0.3), 0.6)
    pixels = lens.project(CHESSBOARD.points @ X[:3, :3].T + X[:3, 3])
    pixels[:, 0] = SIZE[0] - 1 - pixels[:, 0]
    view = BoardView(name="left", corners=np.arange(len(pixels)), pixels=pixels)

    with pytest.raises(InvalidValueError, match="left: the corners are in the order of a mirror image"):
        board_views(CHESSBOARD, SIZE, [view])


def test_boards_that_look_the_same_upside_down() -> None:
    """Half a revolution maps black to black only if both numbers of squares are even, or both odd."""
    assert attrs.evolve(CHESSBOARD, columns=7).looks_the_same_upside_down
    assert not CHESSBOARD.looks_the_same_upside_down
    assert not CHARUCO.looks_the_same_upside_down


def test_views_with_too_little_are_left_out_by_name() -> None:
    """Five corners, or corners on one line, show no pose; a corner outside, twice, or unknown is a mistake."""
    lens, X = simple_lens(*SIZE, 0.8), pose(CHARUCO, (0.3, 0.1, 0.2), 0.5)
    pixels = lens.project(CHARUCO.points @ X[:3, :3].T + X[:3, 3])

    def view(name: str, corners: list[int]) -> BoardView:
        return BoardView(name=name, corners=corners, pixels=pixels[corners])

    good = [view(name, list(range(48))) for name in "abc"]
    views = board_views(CHARUCO, SIZE, [*good, view("few", [0, 1, 2, 9, 10]), view("row", list(range(8)))])
    assert views.names == ("a", "b", "c")
    assert views.left_out == {"few": "5 corners, expected 6 or more", "row": "all its corners are on one line"}
    with pytest.raises(TooFewError, match=r"expected 3 pictures or more .* got 2; few: 5 corners"):
        board_views(CHARUCO, SIZE, [*good[:2], view("few", [0, 1, 2, 9, 10])])
    with pytest.raises(InvalidValueError, match=r"d: corner 3 is there more than once"):
        board_views(CHARUCO, SIZE, [view("d", [3, 3, 4, 5, 6, 7, 8])])
    with pytest.raises(InvalidValueError, match="expected corners from 0 to 47 of a board of 9 x 7 squares, got 48"):
        board_views(CHARUCO, SIZE, [BoardView(name="d", corners=[48], pixels=pixels[:1])])
    with pytest.raises(InvalidValueError, match=r"d: corner 0 at \(700.0, 5.0\) is outside of a picture of 640 x 480"):
        board_views(CHARUCO, SIZE, [BoardView(name="d", corners=[0], pixels=[[700.0, 5.0]])])
    with pytest.raises(InvalidValueError, match="several of a"):
        board_views(CHARUCO, SIZE, [*good, good[0]])


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Four pictures of a board, and one without."""
    rng, folder = np.random.default_rng(1), tmp_path_factory.mktemp("pictures")
    lens = simple_lens(*SIZE, 0.8)
    for k in range(4):
        X = pose(CHARUCO, (0.3 - 0.2 * k, 0.1, 0.2), 0.5)
        Image.fromarray(photographed(rng, CHARUCO, lens, X, 2.0)).save(folder / f"{k}.png")
    Image.fromarray(np.full((480, 640), 128, dtype=np.uint8)).save(folder / "4.png")
    return sorted(folder.iterdir())


def test_pictures_of_a_board(pictures: list[Path]) -> None:
    """Pictures without the board are left out by name."""
    views = views_of_pictures(pictures, CHARUCO)

    assert views.names == ("0.png", "1.png", "2.png", "3.png")
    assert views.left_out == {"4.png": "the board is not found"}
    assert (views.width, views.height) == SIZE


def test_pictures_that_do_not_belong_together(pictures: list[Path], tmp_path: Path) -> None:
    """Another size, another board, too many or too few pictures are refused with a reason."""
    Image.fromarray(np.zeros((100, 200), dtype=np.uint8)).save(tmp_path / "small.png")

    with pytest.raises(FileFormatError, match=r"small.png: expected 640 x 480 pixels as in 0.png, got 200 x 100"):
        views_of_pictures([*pictures, tmp_path / "small.png"], CHARUCO)
    with pytest.raises(TooFewError, match=r"not found in any of 5 pictures; .*columns x rows, 9 x 7.*dictionary"):
        views_of_pictures(pictures, attrs.evolve(CHARUCO, dictionary="6X6_250"))
    with pytest.raises(TooFewError, match=r"expected 3 pictures or more .* got 1; 4.png: the board is not found"):
        views_of_pictures([pictures[0], pictures[4]], CHARUCO)
    with raised(pictures=3), pytest.raises(InvalidValueError, match="too many pictures: 5; the limit is 3"):
        views_of_pictures(pictures, CHARUCO)
    with pytest.raises(TooFewError, match=r"expected 3 pictures or more, got none"):
        views_of_pictures([], CHARUCO)


def test_dictionaries() -> None:
    """An unknown dictionary has the nearest name beside it; one with too few markers for the board is refused."""
    with pytest.raises(UnknownNameError, match=r"no dictionary of markers '4X4_60'. Did you mean '4X4_50'"):
        board_finder(attrs.evolve(CHARUCO, dictionary="4X4_60"))
    with pytest.raises(InvalidValueError, match="12 x 10 squares has 60 markers, and the dictionary 4X4_50 only 50"):
        board_finder(Board(columns=12, rows=10, square=0.02, marker=0.015))


def test_boards_that_there_cannot_be() -> None:
    """Two rows show no tilt, and a marker fits into its square."""
    with pytest.raises(InvalidValueError, match="squares along a side of the board: expected an integer of at least 3"):
        Board(columns=9, rows=2, square=0.03)
    with pytest.raises(InvalidValueError, match="marker of the board: expected a length between 0 and the square"):
        Board(columns=9, rows=7, square=0.03, marker=0.03)
    with pytest.raises(InvalidValueError, match="at most 100, got 101"):
        Board(columns=101, rows=7, square=0.03)


def test_a_lens_of_the_drawn_pictures_is_a_pinhole_without_distortion() -> None:
    """What draws the pictures of these tests agrees with a projection by hand."""
    lens = Lens(width=640, height=480, focal=(600, 600), centre=(319.5, 239.5))
    picture = photographed(np.random.default_rng(0), CHESSBOARD, lens, pose(CHESSBOARD, (0, 0, 0), 0.6), 0.0)

    # Squares of 40 mm at 0.6 m are 40 px wide. The middle of the third row, whose first square is black, is that of
    # the picture, between the pixels 319 and 320.
    edges = np.flatnonzero(np.abs(np.diff(picture[240].astype(int))) > 80)
    np.testing.assert_array_equal(edges, 319 + 40 * np.arange(-4, 4))
