"""The lens from pictures of a board: near the truth, with the standard errors of a computation by hand."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.arm_readings import ArmAccuracy
from armwright.calibration.board import BoardViews
from armwright.calibration.camera_intrinsics import LENS_NUMBERS, calibrate_intrinsics
from armwright.calibration.reprojection import (
    board_pose,
    moved,
    twist_between,
)
from armwright.errors import InvalidValueError, MissingExtraError, TooFewError
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from calibration.boards import CHARUCO, Scene, projected, random_scene

cv2 = pytest.importorskip("cv2")

NOISE = 0.1


@pytest.fixture
def scene(rng: np.random.Generator) -> Scene:
    return random_scene(rng, load_arm("ur5"), 15, eye_in_hand=True, accuracy=ArmAccuracy())


@pytest.fixture
def views(rng: np.random.Generator, scene: Scene) -> BoardViews:
    return projected(rng, scene, NOISE)


def test_standard_errors_are_those_of_the_linear_model(
    rng: np.random.Generator, scene: Scene, views: BoardViews
) -> None:
    """OpenCV's standard errors are those of least squares with derivatives by differences of its own projection."""
    found = calibrate_intrinsics(views)
    values, step, columns = found.lens.numbers, 1e-6, list[np.ndarray]()

    def pixels(numbers: np.ndarray, twists: np.ndarray) -> np.ndarray:
        matrix = np.array([[numbers[0], 0, numbers[2]], [0, numbers[1], numbers[3]], [0, 0, 1]])
        rows = []
        for view, X, twist in zip(found.views.views, found.poses, twists, strict=True):
            Y = moved(X, twist)
            at = cv2.Rodrigues(Y[:3, :3])[0], Y[:3, 3]
            rows.append(cv2.projectPoints(CHARUCO.points[view.corners], *at, matrix, numbers[4:])[0].ravel())
        return np.concatenate(rows)

    still = np.zeros((15, 6))
    for k in range(9 + still.size):
        sides = []
        for sign in (1, -1):
            both = np.concatenate([values, still.ravel()])
            both[k] += sign * step
            sides.append(pixels(both[:9], both[9:].reshape(-1, 6)))
        columns.append((sides[0] - sides[1]) / (2 * step))
    J = np.stack(columns, axis=1)
    by_hand = found.sigma * np.sqrt(np.diag(np.linalg.inv(J.T @ J)))[:9]

    np.testing.assert_allclose(found.standard_errors, by_hand, rtol=0.02)
    assert found.degrees_of_freedom == J.shape[0] - J.shape[1]
    assert abs(found.sigma / NOISE - 1) < 0.1
    assert np.all(np.abs(scene.lens.numbers - found.lens.numbers) < 4.5 * found.standard_errors)
    del rng


@pytest.mark.parametrize("coefficients", [0, 2, 4, 5])
def test_coefficients_that_are_not_fitted_are_zero(rng: np.random.Generator, scene: Scene, coefficients: int) -> None:
    """A lens without distortion is found with any number of coefficients; those that are not fitted stay 0."""
    plain = scene._replace(lens=attrs.evolve(scene.lens, distortion=np.zeros(5)))

    found = calibrate_intrinsics(projected(rng, plain, NOISE), coefficients=coefficients)

    fixed = [i for i in range(len(LENS_NUMBERS)) if i not in found.fitted]
    assert len(fixed) == 5 - coefficients
    assert not found.lens.numbers[fixed].any()
    assert not found.standard_errors[fixed].any()
    errors = np.abs(plain.lens.numbers - found.lens.numbers)[list(found.fitted)]
    assert np.all(errors < 4.5 * found.standard_errors[list(found.fitted)])


def test_wrong_corners_and_pictures_are_left_out(rng: np.random.Generator, scene: Scene, views: BoardViews) -> None:
    """Corners two and eighty pixels off, and a picture whose corners are all over, change nothing."""
    first, second, third, *others = views.views
    pixels, shaken = first.pixels.copy(), second.pixels + 1.5 * rng.standard_normal(second.pixels.shape)
    pixels[[3, 20]] += [2.0, -2.0]
    far = third.pixels.copy()
    far[7] += [80, 0] if far[7, 0] < 320 else [-80, 0]
    changed = zip((first, second, third), (pixels, shaken, far), strict=True)
    wrong = (*(attrs.evolve(view, pixels=moved_pixels) for view, moved_pixels in changed), *others)

    found = calibrate_intrinsics(attrs.evolve(views, views=wrong))

    assert found.wrong_corners == 3
    assert list(found.views.left_out) == [second.name]
    assert "3 corners left out" in " ".join(found.notes)
    assert np.all(np.abs(scene.lens.numbers - found.lens.numbers) < 4.5 * found.standard_errors)


@pytest.mark.parametrize("noise", [0.0, NOISE])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.4, 0.2)], ids=["never", "always alike"])
def test_a_board_that_is_not_tilted_is_refused(
    rng: np.random.Generator, scene: Scene, noise: float, tilt: tuple[float, float]
) -> None:
    """Boards that are parallel in all pictures determine no focal length, however well they fit."""
    poses = [
        homogeneous(
            rotation_from_vector([0, 0, angle]) if not any(tilt) else rotation_from_vector([*tilt, 0]),
            [-0.13 + x, -0.1 + y, z],
        )
        for angle, x, y, z in zip(
            rng.uniform(-0.5, 0.5, 8), *rng.uniform(-0.04, 0.04, (2, 8)), rng.uniform(0.45, 0.6, 8), strict=True
        )
    ]
    lens = attrs.evolve(scene.lens, distortion=np.zeros(5))
    same = projected(rng, scene._replace(lens=lens, seen=np.array(poses)), noise)

    with pytest.raises(InvalidValueError, match=r"8 pictures do not determine the focal length.*Tilt the board"):
        calibrate_intrinsics(same, coefficients=0)


def test_refusals(views: BoardViews, monkeypatch: pytest.MonkeyPatch) -> None:
    """Too few pictures, coefficients that there are not, and a missing OpenCV are told in one line."""
    with pytest.raises(TooFewError, match="expected 3 pictures or more of the board, tilted, got 2"):
        calibrate_intrinsics(views.take([0, 1]))
    with pytest.raises(InvalidValueError, match="expected 0, 2, 4 or 5, got 3"):
        calibrate_intrinsics(views, coefficients=3)
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    with pytest.raises(
        MissingExtraError, match=r"needs opencv-python-headless; install it by: pip install 'armwright\[p"
    ):
        calibrate_intrinsics(views)


def test_the_pose_of_a_board(rng: np.random.Generator, scene: Scene) -> None:
    """The pose from the corners of one picture is exact without noise; its information is that of a twist."""
    lens, X = scene.lens, scene.seen[0]
    pixels = lens.project(CHARUCO.points @ X[:3, :3].T + X[:3, 3])
    found = board_pose(lens, CHARUCO.points, pixels)

    np.testing.assert_allclose(found.pose, X, atol=1e-9)
    twist = rng.uniform(-1e-4, 1e-4, 6)
    Y = moved(X, twist)
    np.testing.assert_allclose(twist_between(X, Y), twist, atol=1e-12)
    change = lens.project(CHARUCO.points @ Y[:3, :3].T + Y[:3, 3]) - pixels
    np.testing.assert_allclose(twist @ found.information @ twist, np.sum(change**2), rtol=5e-3)


def test_numbers_of_a_lens() -> None:
    """The numbers of a lens are in the order of its attributes, and a lens follows from them."""
    lens = Lens(width=10, height=8, focal=(1, 2), centre=(3, 4), distortion=(5, 6, 7, 8, 9))
    np.testing.assert_array_equal(lens.numbers, np.arange(1, 10))
    other = lens.with_numbers(np.arange(2, 11))
    np.testing.assert_array_equal(other.numbers, np.arange(2, 11))
    assert (other.width, other.height) == (10, 8)
