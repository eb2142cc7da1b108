"""Hand-eye calibration: the truth lies within its intervals, an independent solver agrees, bad data are refused."""

import re
import sys

import attrs
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.calibration.arm_readings import ArmAccuracy
from armwright.calibration.board import Board, BoardViews
from armwright.calibration.board_detection import board_finder
from armwright.calibration.camera_intrinsics import calibrate_intrinsics
from armwright.calibration.hand_eye import HandEyeCalibration, calibrate_hand_eye
from armwright.calibration.hand_eye_start import closed_form
from armwright.errors import ContradictionError, InvalidValueError, MissingExtraError, ShapeError, TooFewError
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.poses import homogeneous, inverse
from calibration.boards import CHARUCO, Scene, board_views, photographed, projected, random_scene
from calibration.simulated import random_arm, random_pose
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

cv2 = pytest.importorskip("cv2")

PIXEL_NOISE = 0.1
ARM = load_arm("ur5")
PRECISE = ArmAccuracy(position=1e-10, orientation=1e-10)
SETUPS = pytest.mark.parametrize("eye_in_hand", [True, False], ids=["eye-in-hand", "eye-to-hand"])
# Chance does this to no test.
RARE = 1e-7
# The truth lies within so many of the 95 % intervals; within so many of a few numbers, which depend more on chance.
LEAST, LEAST_OF_GROUP = 0.88, 0.84


def errors(found: HandEyeCalibration, scene: Scene) -> Array:
    """Return truth minus estimate, in the order of the standard errors."""
    rows = []
    for X, truth in ((found.camera, scene.camera), (found.board, scene.board)):
        rows += [truth[:3, 3] - X[:3, 3], Rotation.from_matrix(truth[:3, :3] @ X[:3, :3].T).as_rotvec()]
    numbers = scene.lens.numbers - found.lens.numbers
    return np.concatenate([*rows, numbers[list(found.lens_numbers)]])


@SETUPS
def test_exact_data_give_the_truth(rng: np.random.Generator, *, eye_in_hand: bool) -> None:
    """Without noise the pose of the camera is the true one, of any arm, with revolute and prismatic joints."""
    for arm in (ARM, random_arm(rng, 6, slides=True), random_arm(rng, 7)):
        scene = random_scene(rng, arm, 8, eye_in_hand=eye_in_hand, accuracy=PRECISE)
        scene = scene._replace(readings=attrs.evolve(scene.readings, accuracy=ArmAccuracy()))

        found = calibrate_hand_eye(
            projected(rng, scene, 0.0), scene.readings, lens=scene.lens, eye_in_hand=eye_in_hand, sigma=PIXEL_NOISE
        )

        np.testing.assert_allclose(errors(found, scene), 0, atol=1e-8)
        assert not found.wrong


@SETUPS
def test_closed_form(rng: np.random.Generator, *, eye_in_hand: bool) -> None:
    """Three exact motions about skew axes give the pose of the camera in closed form."""
    scene = random_scene(rng, ARM, 4, eye_in_hand=eye_in_hand, accuracy=PRECISE)
    hand = forward(ARM, scene.readings.q)
    X = closed_form(hand if eye_in_hand else inverse(hand), scene.seen)

    assert X is not None
    np.testing.assert_allclose(X, scene.camera, atol=1e-5)


def cost_by_hand(scene: Scene, views: BoardViews, sigma: float, *, fit_lens: bool) -> tuple[object, Array]:
    """Return weighted residuals as a function of one vector, with OpenCV's projection, and its value at the truth."""
    accuracy, hand = scene.readings.accuracy, forward(scene.readings.arm, scene.readings.q)
    points = CHARUCO.points

    def pose(vector: Array) -> Array:
        return homogeneous(Rotation.from_rotvec(vector[3:]).as_matrix(), vector[:3])

    def vector(X: Array) -> Array:
        return np.concatenate([X[:3, 3], Rotation.from_matrix(X[:3, :3]).as_rotvec()])

    def residuals(x: Array) -> Array:
        camera, board, lens, corrections = pose(x[:6]), pose(x[6:12]), x[12:21], x[21:].reshape(-1, 6)
        matrix = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])
        rows = [corrections.ravel()]
        for view, X_BE, c in zip(views.views, hand, corrections, strict=True):
            moved = X_BE @ pose(np.concatenate([c[:3] * accuracy.position, c[3:] * accuracy.orientation]))
            X = inverse(camera) @ (inverse(moved) if scene.eye_in_hand else moved) @ board
            at = cv2.Rodrigues(X[:3, :3])[0], X[:3, 3]
            pixels = cv2.projectPoints(points[view.corners], *at, matrix, lens[4:])[0][:, 0]
            rows.append((view.pixels - pixels).ravel() / sigma)
        return np.concatenate(rows)

    start = np.concatenate([vector(scene.camera), vector(scene.board), scene.lens.numbers, np.zeros(6 * len(hand))])
    if fit_lens:
        return residuals, start
    held = np.arange(12, 21)
    free = np.setdiff1d(np.arange(len(start)), held)

    def without_lens(x: Array) -> Array:
        full = start.copy()
        full[free] = x
        return residuals(full)

    return without_lens, start[free]


@pytest.mark.parametrize("fit_lens", [True, False], ids=["lens-fitted", "lens-known"])
@SETUPS
def test_scipy_finds_the_same(rng: np.random.Generator, *, eye_in_hand: bool, fit_lens: bool) -> None:
    """SciPy's least squares over rotation vectors and OpenCV's projection end at the same pose and covariance."""
    scene = random_scene(rng, ARM, 7, eye_in_hand=eye_in_hand, accuracy=ArmAccuracy())
    views = projected(rng, scene, PIXEL_NOISE)
    how = {"intrinsics": calibrate_intrinsics(views)} if fit_lens else {"lens": scene.lens}
    found = calibrate_hand_eye(views, scene.readings, eye_in_hand=eye_in_hand, sigma=PIXEL_NOISE, **how)

    function, start = cost_by_hand(scene, views, PIXEL_NOISE, fit_lens=fit_lens)
    other = least_squares(function, start, method="trf", x_scale="jac", xtol=1e-13, ftol=1e-13, gtol=1e-13)
    covariance = np.linalg.inv(other.jac.T @ other.jac)

    deviations = found.standard_errors
    for body, X in ((0, found.camera), (6, found.board)):
        x = other.x[body : body + 6]
        assert np.abs(x[:3] - X[:3, 3]).max() < 0.01 * deviations[body : body + 3].min()
        turned = (Rotation.from_rotvec(x[3:]) * Rotation.from_matrix(X[:3, :3]).inv()).magnitude()
        assert turned < 0.01 * deviations[body + 3 : body + 6].min()
        np.testing.assert_allclose(
            np.sqrt(np.diag(covariance))[body : body + 3], deviations[body : body + 3], rtol=0.01
        )
    if fit_lens:
        np.testing.assert_allclose(np.sqrt(np.diag(covariance))[12:21], deviations[12:], rtol=0.01)


@SETUPS
def test_standard_errors_are_those_of_many_repetitions(sample: Sample, *, eye_in_hand: bool) -> None:
    """Noise that is drawn anew spreads the estimates as their standard errors say."""
    (rng,) = sample.cases(1)
    count = sample.count(300)
    scene = random_scene(rng, ARM, 8, eye_in_hand=eye_in_hand, accuracy=ArmAccuracy())
    hand = scene.readings
    squares, disagreements = np.zeros(12), list[float]()
    for _ in range(count):
        truly = hand.hand(rng.standard_normal((8, 6)))[0]
        seen = inverse(scene.camera) @ (inverse(truly) if eye_in_hand else truly) @ scene.board
        views = projected(rng, scene._replace(seen=seen), PIXEL_NOISE)
        found = calibrate_hand_eye(views, hand, lens=scene.lens, eye_in_hand=eye_in_hand)
        squares += (errors(found, scene) / found.standard_errors) ** 2
        disagreements.append(found.disagreement**2)

    # Sums of squares of standard normal numbers: of each estimate, and 36 of each set.
    assert chi2.ppf(RARE, count) < squares.min()
    assert squares.max() < chi2.isf(RARE, count)
    assert chi2.ppf(RARE, 36 * count) < 36 * sum(disagreements) < chi2.isf(RARE, 36 * count)
    sample.record("spread of hand-eye estimates", count, 0, largest=float((squares / count).max()))


def shares_within(sample: Sample, draw: object, full: int, what: str) -> None:
    """Count how often the truth lies in the intervals of sets that a function draws; in the large sample, judge it."""
    inside = []
    for rng in sample.cases(full):
        eye_in_hand = bool(sample.case % 2)
        scene, views, readings = draw(rng, eye_in_hand)
        intrinsics = calibrate_intrinsics(views)
        numbers = [views.names.index(name) for name in intrinsics.views.names]
        found = calibrate_hand_eye(
            intrinsics.views, readings.take(numbers), intrinsics=intrinsics, eye_in_hand=eye_in_hand
        )
        assert not found.contradictions
        inside.append(np.abs(errors(found, scene)) <= found.half_widths)
    share = np.array(inside)
    groups = {"camera position": share[:, :3], "camera rotation": share[:, 3:6], "board position": share[:, 6:9]}
    groups |= {"board rotation": share[:, 9:12], "lens": share[:, 12:], "all": share}
    means = {name: float(values.mean()) for name, values in groups.items()}
    sample.record(what, len(inside), sum(mean < LEAST_OF_GROUP for mean in means.values()), **means)
    if sample.whole:
        assert means["all"] >= LEAST, means
        assert min(means.values()) >= LEAST_OF_GROUP, means
    else:
        # With few sets, the intervals of a set are off together: a wrong covariance leaves most of them out.
        assert means["all"] > 0.4, means


def test_truth_lies_in_the_intervals_of_projected_sets(sample: Sample) -> None:
    """With distortion, noise of pixels, and arm errors of 0.1 mm and 0.5 mrad or of joints, 95 % hold the truth."""

    def draw(rng: np.random.Generator, eye_in_hand: bool) -> object:  # noqa: FBT001
        accuracy = ArmAccuracy() if rng.random() < 0.6 else ArmAccuracy(joints=np.full(6, 2e-4))
        scene = random_scene(rng, ARM, 15, eye_in_hand=eye_in_hand, accuracy=accuracy)
        return scene, projected(rng, scene, PIXEL_NOISE), scene.readings

    shares_within(sample, draw, 100, "95 % intervals, projected corners")


@pytest.mark.share(0.04)
def test_truth_lies_in_the_intervals_of_rendered_sets(sample: Sample) -> None:
    """The same with pictures: the board is drawn through the lens, with noise of the grey values, and found again."""
    find = board_finder(CHARUCO)

    def draw(rng: np.random.Generator, eye_in_hand: bool) -> object:  # noqa: FBT001
        scene = random_scene(rng, ARM, 15, eye_in_hand=eye_in_hand, accuracy=ArmAccuracy())
        views = [find(f"{k:02d}", photographed(rng, CHARUCO, scene.lens, X, 3.0)) for k, X in enumerate(scene.seen)]
        kept = board_views(CHARUCO, (scene.lens.width, scene.lens.height), [view for view in views if view is not None])
        return scene, kept, scene.readings.take([int(name) for name in kept.names])

    shares_within(sample, draw, 50, "95 % intervals, rendered pictures")


@SETUPS
def test_wrong_pictures_are_named_and_do_not_count(rng: np.random.Generator, *, eye_in_hand: bool) -> None:
    """Joint positions of other pictures, and a joint that is half a degree off, change nothing."""
    scene = random_scene(rng, ARM, 14, eye_in_hand=eye_in_hand, accuracy=ArmAccuracy())
    views = projected(rng, scene, PIXEL_NOISE)
    q = scene.readings.q.copy()
    q[[2, 9]] = q[[9, 2]]
    q[5, 3] += np.radians(0.5)

    found = calibrate_hand_eye(
        views, attrs.evolve(scene.readings, q=q), intrinsics=calibrate_intrinsics(views), eye_in_hand=eye_in_hand
    )

    assert found.wrong == (2, 5, 9)
    assert not found.contradictions
    assert np.all(np.abs(errors(found, scene)) < 4.5 * found.standard_errors)


def test_an_arm_that_is_worse_than_stated_is_doubtful(rng: np.random.Generator) -> None:
    """Errors of the arm five times as large as stated are told, with the accuracy that would explain them."""
    scene = random_scene(rng, ARM, 15, eye_in_hand=True, accuracy=ArmAccuracy(position=5e-4, orientation=2.5e-3))
    views = projected(rng, scene, PIXEL_NOISE)
    readings = attrs.evolve(scene.readings, accuracy=ArmAccuracy())

    found = calibrate_hand_eye(views, readings, lens=scene.lens)

    (reason,) = found.contradictions
    millimetres, milliradians = map(float, re.findall(r"([\d.]+) m(?:m|rad)", reason))
    assert 0.35 < millimetres < 0.7
    assert 1.75 < milliradians < 3.5


@pytest.mark.parametrize("eye_in_hand", [True, False])
def test_the_wrong_setup_is_refused(rng: np.random.Generator, *, eye_in_hand: bool) -> None:
    """A camera on the hand that is taken for one beside the arm contradicts the joint positions."""
    scene = random_scene(rng, ARM, 10, eye_in_hand=eye_in_hand, accuracy=ArmAccuracy())
    views = projected(rng, scene, PIXEL_NOISE)

    with pytest.raises(ContradictionError, match=r"the camera is on the tool,? or beside the arm|behind the camera"):
        calibrate_hand_eye(views, scene.readings, lens=scene.lens, eye_in_hand=not eye_in_hand)


def one_axis_scene(scene: Scene, joint: int, spread: float) -> Scene:
    """Return a scene in which one joint alone moves."""
    q = np.repeat(scene.readings.q[:1], 6, axis=0)
    q[:, joint] += np.linspace(0, spread, 6)
    return scene._replace(readings=attrs.evolve(scene.readings, q=q))


@SETUPS
def test_parallel_rotations_are_refused_with_their_direction(rng: np.random.Generator, *, eye_in_hand: bool) -> None:
    """Where one joint alone turns, the position of the camera along its axis is open; the message names the axis."""
    scene = random_scene(rng, ARM, 6, eye_in_hand=eye_in_hand, accuracy=ArmAccuracy())
    joint = 5 if eye_in_hand else 0
    moved = one_axis_scene(scene, joint, np.radians(40))
    X = np.repeat(scene.seen[:1], 6, axis=0)
    # The last axis of the arm is z of the tool, and the first one z of the base.
    with pytest.raises(
        InvalidValueError, match=r"about the direction \(0\.00, 0\.00, 1\.00\) of the (tool|base) frame"
    ):
        calibrate_hand_eye(
            projected(rng, scene._replace(seen=X), PIXEL_NOISE),
            moved.readings,
            lens=scene.lens,
            eye_in_hand=eye_in_hand,
        )


def test_missing_opencv_is_one_line(rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a known lens and a table of corners, too, a missing OpenCV is told with how to install it."""
    scene = random_scene(rng, ARM, 6, eye_in_hand=True, accuracy=ArmAccuracy())
    views = projected(rng, scene, PIXEL_NOISE)
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingExtraError, match="needs opencv-python-headless; install it by: pip install"):
        calibrate_hand_eye(views, scene.readings, lens=scene.lens)


def test_small_rotations_and_few_pictures_are_refused(rng: np.random.Generator) -> None:
    """Two pictures are too few, and rotations of two degrees too small."""
    scene = random_scene(rng, ARM, 6, eye_in_hand=True, accuracy=ArmAccuracy())
    views = projected(rng, scene, PIXEL_NOISE)
    near = attrs.evolve(scene.readings, q=scene.readings.q[:1] + np.radians(2) * np.eye(6))

    with pytest.raises(InvalidValueError, match=r"rotates by [23](\.\d)? degrees at most"):
        calibrate_hand_eye(views, near, lens=scene.lens)
    with pytest.raises(TooFewError, match=r"expected 3 pictures or more with joint positions, got 2"):
        calibrate_hand_eye(views.take([0, 1]), scene.readings.take([0, 1]), lens=scene.lens)
    with pytest.raises(ShapeError, match="as many pictures as joint positions, got 6 and 2"):
        calibrate_hand_eye(views, scene.readings.take([0, 1]), lens=scene.lens)
    with pytest.raises(ShapeError, match="either intrinsics or a known lens"):
        calibrate_hand_eye(views, scene.readings)


def test_wrong_length_of_squares_is_doubtful_or_refused(rng: np.random.Generator) -> None:
    """A board whose squares are a tenth larger than stated contradicts the motions of the arm."""
    scene = random_scene(rng, ARM, 12, eye_in_hand=True, accuracy=ArmAccuracy())
    views = projected(rng, scene, PIXEL_NOISE)
    smaller = attrs.evolve(views, board=Board(columns=9, rows=7, square=0.027, marker=0.02))

    try:
        reasons = calibrate_hand_eye(smaller, scene.readings, lens=scene.lens).contradictions
    except ContradictionError as error:
        reasons = (str(error),)

    assert "length of the squares" in reasons[0]


def test_random_poses_round_trip(rng: np.random.Generator) -> None:
    """The closed form needs two motions about different axes, and says so of one."""
    X, Z = random_pose(rng, 0.2), random_pose(rng, 1.0)
    E = np.array([random_pose(rng, 1.0) for _ in range(3)])
    C = inverse(X) @ inverse(E) @ Z

    np.testing.assert_allclose(closed_form(E, C), X, atol=1e-9)
    assert closed_form(E[:2], C[:2]) is None
