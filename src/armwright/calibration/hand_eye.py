"""Hand-eye calibration: where a camera is on the tool of an arm, or beside the arm, from pictures of a board.

The corners in the pictures have noise, and so have the positions of the arm. Both count by their standard deviations in
one least-squares fit over the poses of camera and board, the corrections of the arm in each picture, and the numbers of
the lens, unless they are known. Pictures that contradict the others are left out.

Source:
    Dornaika & Horaud (1998), Simultaneous robot-world and hand-eye calibration; Strobl & Hirzinger (2006), Optimal
    hand-eye calibration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np
from scipy.stats import chi2, norm, t as student

from armwright.arrays import Array, positive
from armwright.calibration.arm_readings import ArmReadings
from armwright.calibration.board import BoardViews
from armwright.calibration.camera_intrinsics import CameraIntrinsics
from armwright.calibration.hand_eye_fit import HandEyeFit, HandEyeProblem, HandEyeState
from armwright.calibration.hand_eye_start import MIN_PICTURES, check_motions, hand_eye_start
from armwright.calibration.reprojection import BoardPose, board_pose, refined_board_pose, twist_between
from armwright.errors import ContradictionError, ShapeError
from armwright.spatial.lens import Lens
from armwright.spatial.poses import inverse
from armwright.spatial.rotations import skew_matrix

_CONFIDENCE = 0.95
# Rounds of leaving out pictures.
_ROUNDS = 10
# A picture that agrees less, by this probability, is wrong; scaled where all agree less than they should.
_WRONG = 1e-6
# Pictures in the first fit are not farther off than this multiple of the median.
_FIRST_LIMIT = 4.0
# More wrong pictures than this part contradict the arm or the board.
_MAX_WRONG = 1 / 3
# An arm is worse than it is said to be if chance does that more seldom.
_SIGNIFICANCE = 1e-4
# Pictures that disagree so many times more than they should have nothing to do with the joint positions.
_MAX_DISAGREEMENT = 40.0


@attrs.frozen(kw_only=True, eq=False)
class HandEyeCalibration:
    """The poses of a camera and a board by an arm.

    Attributes:
        eye_in_hand: whether the camera is on the tool and the board beside the arm; otherwise vice versa.
        camera: (4, 4) pose of the camera in the frame of the tool, or in the base frame.
        board: (4, 4) pose of the board in the base frame, or in the frame of the tool.
        lens: of the camera.
        lens_numbers: which numbers of the lens were fitted; see ``CameraIntrinsics``.
        covariance: (p, p) of position of the camera, rotation of it, both of the board, and the numbers of the lens.
            Positions and small rotations are along and about the axes of the frame that the pose is in.
        sigma: standard deviation of a coordinate of a corner [px].
        degrees_of_freedom: of sigma; infinite where it was given.
        disagreement: how many times as far as expected the pictures are from where the arm puts the camera; about 1.
        by_picture: (m,) the same of each picture.
        names: of all m pictures.
        wrong: numbers of pictures that contradict the others; they do not count.
        views: the other pictures.
        residuals: (c, 2) of their corners, seen minus expected [px].
        readings: of the arm, at all pictures.
    """

    eye_in_hand: bool
    camera: Array
    board: Array
    lens: Lens
    lens_numbers: tuple[int, ...]
    covariance: Array
    sigma: float
    degrees_of_freedom: float
    disagreement: float
    by_picture: Array
    names: tuple[str, ...]
    wrong: tuple[int, ...]
    views: BoardViews
    residuals: Array
    readings: ArmReadings

    @property
    def standard_errors(self) -> Array:
        """(p,) of camera x, y, z [m], rotations about x, y, z [rad], the same of the board, numbers of the lens."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def half_widths(self) -> Array:
        """(p,) half of the 95 % intervals, by Student's t where the noise of pixels was estimated."""
        probability = (1 + _CONFIDENCE) / 2
        known = math.isinf(self.degrees_of_freedom)
        factor = norm.ppf(probability) if known else student.ppf(probability, self.degrees_of_freedom)
        return np.asarray(float(factor) * self.standard_errors)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """By what the pictures contradict the accuracy of the arm; empty where they do not."""
        freedom = 6 * (len(self.names) - len(self.wrong)) - 12
        if self.disagreement**2 * freedom <= chi2.isf(_SIGNIFICANCE, freedom):
            return ()
        accuracy = self.readings.accuracy.scaled(self.disagreement)
        stated = (
            f"an accuracy of {accuracy.position * 1e3:.2g} mm and {accuracy.orientation * 1e3:.2g} mrad"
            if accuracy.joints is None
            else f"standard deviations of the joints {self.disagreement:.2g} times as large"
        )
        much = f"{self.disagreement:.3g} times as far from where the arm puts the camera as its accuracy allows"
        remedy = f"Calibrate the arm, check the length of the squares, or give {stated}"
        return (f"the pictures are {much}, so that the standard errors are too small. {remedy}",)


def calibrate_hand_eye(
    views: BoardViews,
    readings: ArmReadings,
    *,
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    eye_in_hand: bool = True,
    sigma: float | None = None,
) -> HandEyeCalibration:
    """Estimate the pose of a camera on the tool of an arm, or beside the arm.

    Args:
        views: m pictures of a board, which is fixed beside the arm, or on its tool.
        readings: of the arm in these pictures.
        intrinsics: the lens as estimated from these or other pictures; its numbers are fitted together with the poses.
        lens: the lens where it is known; its numbers stay.
        eye_in_hand: whether the camera is on the tool and the board beside the arm; otherwise vice versa.
        sigma: standard deviation of a coordinate of a corner [px]; estimated from the residuals if left out.

    Raises:
        ShapeError: pictures and readings are not as many, or neither or both of intrinsics and lens are given.
        TooFewError: there are too few pictures.
        InvalidValueError: the tool rotates too little or about one direction only, so that the pose is not determined.
        ContradictionError: the pictures do not belong to these joint positions.
        MissingExtraError: OpenCV is not installed.
    """
    if len(views) != len(readings.q):
        raise ShapeError(f"expected as many pictures as joint positions, got {len(views)} and {len(readings.q)}")
    known = lens if intrinsics is None else intrinsics.lens if lens is None else None
    if known is None:
        raise ShapeError("expected either intrinsics or a known lens")
    none = np.zeros((len(views), readings.corrections))
    X_BE = readings.hand(none)[0]
    check_motions(X_BE, eye_in_hand=eye_in_hand)
    carried = X_BE if eye_in_hand else inverse(X_BE)
    boards = _board_poses(views, known, None)
    freedom: float = math.inf
    if sigma is None:
        residuals = np.concatenate([board.residuals for board in boards])
        freedom = residuals.size - 6 * len(views) if intrinsics is None else intrinsics.degrees_of_freedom
        sigma = math.sqrt(float(np.sum(residuals**2)) / freedom) if intrinsics is None else intrinsics.sigma
        # Corners that were computed have no noise, and the arm's would then be divided by nothing.
        sigma = max(sigma, 1e-6)
    problem = HandEyeProblem(
        views=views,
        readings=readings,
        eye_in_hand=eye_in_hand,
        sigma=positive(sigma, "sigma", "px"),
        lens_numbers=() if intrinsics is None else intrinsics.fitted,
    )
    camera, board, distances = hand_eye_start(carried, np.array([board.pose for board in boards]))
    state = HandEyeState(camera=camera, board=board, lens=known, corrections=none)
    fit, used, squares = _fit_without_wrong(problem, state, _not_far(distances))
    spread = _mean_square(squares[used])
    _refuse_contradiction(views.names, used, spread)
    return HandEyeCalibration(
        eye_in_hand=eye_in_hand,
        camera=fit.state.camera,
        board=fit.state.board,
        lens=fit.state.lens,
        lens_numbers=problem.lens_numbers,
        covariance=_in_outer_axes(fit),
        sigma=problem.sigma,
        degrees_of_freedom=freedom,
        disagreement=math.sqrt(spread),
        by_picture=np.sqrt(squares / 6),
        names=views.names,
        wrong=tuple(i for i in range(len(views)) if i not in used),
        views=views.take(used),
        residuals=fit.residuals,
        readings=readings,
    )


# ---- inside --------------------------------------------------------------------------------------------------------


def _board_poses(views: BoardViews, lens: Lens, guesses: Array | None) -> list[BoardPose]:
    """Return the poses of the board that fit each picture best on its own."""
    points = views.board.points
    return [
        board_pose(lens, points[view.corners], view.pixels)
        if guesses is None
        else refined_board_pose(lens, points[view.corners], view.pixels, guesses[i])
        for i, view in enumerate(views.views)
    ]


def _not_far(distances: Array) -> list[int]:
    """Return the pictures that the first fit uses: those not far from what the first guess expects."""
    limit = max(_FIRST_LIMIT * float(np.median(distances)), float(np.sort(distances)[MIN_PICTURES - 1]))
    return [int(i) for i in np.flatnonzero(distances <= limit)]


def _fit_without_wrong(
    problem: HandEyeProblem, state: HandEyeState, used: list[int]
) -> tuple[HandEyeFit, list[int], Array]:
    """Return the fit to the pictures that agree, their numbers, and (m,) the squared disagreements of all pictures."""
    tried = set[tuple[int, ...]]()
    poses: Array | None = None
    while True:
        part = problem.take(used)
        fit = part.fit(attrs.evolve(state, corrections=state.corrections[used] * 0.0))
        boards = _board_poses(problem.views, fit.state.lens, poses)
        poses = np.array([board.pose for board in boards])
        squares = _disagreements(problem, fit.state, boards)
        limit = float(chi2.isf(_WRONG, 6)) * max(1.0, _median_square(squares[used]))
        agreeing = [int(i) for i in np.flatnonzero(squares <= limit)]
        tried.add(tuple(used))
        if agreeing == used or len(agreeing) < MIN_PICTURES or tuple(agreeing) in tried or len(tried) > _ROUNDS:
            return fit, used, squares
        used = agreeing


def _disagreements(problem: HandEyeProblem, state: HandEyeState, boards: Sequence[BoardPose]) -> Array:
    """Return (m,) how far the tool is from where each picture alone puts it: squares, in its standard deviations."""
    readings = problem.readings
    hand, twists = readings.hand(np.zeros((len(boards), readings.corrections)))
    poses = np.array([board.pose for board in boards])
    carried = state.camera @ poses @ inverse(state.board)
    by_picture = inverse(carried) if problem.eye_in_hand else carried
    twist = twist_between(hand, by_picture)
    # A twist of the tool moves the board: of its frame, as seen from the tool.
    frames = state.camera @ poses if problem.eye_in_hand else np.broadcast_to(state.board, poses.shape)
    by_board = _adjoint(frames)
    pixels = np.linalg.pinv(np.array([board.information for board in boards]) / problem.sigma**2, hermitian=True)
    covariance = twists @ np.swapaxes(twists, 1, 2) + by_board @ pixels @ np.swapaxes(by_board, 1, 2)
    return np.asarray(np.einsum("ki,ki->k", twist, np.linalg.solve(covariance, twist[..., None])[..., 0]))


def _adjoint(X: Array) -> Array:
    """Return (..., 6, 6) that takes twists in a frame to those of the frame that sees it at pose X (..., 4, 4)."""
    R = X[..., :3, :3]
    result = np.zeros((*X.shape[:-2], 6, 6))
    result[..., :3, :3] = result[..., 3:, 3:] = R
    result[..., :3, 3:] = skew_matrix(X[..., :3, 3]) @ R
    return result


def _mean_square(squares: Array) -> float:
    """Return the mean of squared disagreements, each of six numbers, twelve of which were fitted; about 1."""
    return float(squares.sum()) / (6 * len(squares) - 12)


def _median_square(squares: Array) -> float:
    """Return the same by the median, which wrong pictures do not move."""
    return float(np.median(squares) / chi2.ppf(0.5, 6)) * len(squares) / max(len(squares) - 2, 1)


def _refuse_contradiction(names: Sequence[str], used: list[int], spread: float) -> None:
    wrong = [name for i, name in enumerate(names) if i not in used]
    checks = (
        "check that the joint positions are those of these pictures, the arm, the length of the squares, and whether "
        "the camera is on the tool or beside the arm"
    )
    if len(wrong) > _MAX_WRONG * len(names):
        raise ContradictionError(
            f"{len(wrong)} of {len(names)} pictures contradict the others ({', '.join(wrong[:8])}): {checks}"
        )
    if spread > _MAX_DISAGREEMENT**2:
        raise ContradictionError(
            f"the pictures are {math.sqrt(spread):.0f} times as far from where the arm puts the camera as its accuracy "
            f"allows: {checks}"
        )


def _in_outer_axes(fit: HandEyeFit) -> Array:
    """Return the covariance with positions and rotations along the axes of the frames that the poses are in."""
    turn = np.eye(len(fit.covariance))
    for start, X in ((0, fit.state.camera), (6, fit.state.board)):
        turn[start : start + 3, start : start + 3] = turn[start + 3 : start + 6, start + 3 : start + 6] = X[:3, :3]
    return np.asarray(turn @ fit.covariance @ turn.T)
