"""The lens of a camera from pictures of a board: focal lengths, centre and distortion, with standard errors.

Source:
    Zhang (2000), A flexible new technique for camera calibration; OpenCV computes it.
"""

from __future__ import annotations

import math

import attrs
import numpy as np
from scipy.stats import t as student

from armwright.arrays import Array, integer
from armwright.calibration.board import BoardView, BoardViews, board_views
from armwright.errors import InvalidValueError, TooFewError, counted
from armwright.extras import opencv
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous

# The numbers of a lens, in the order of its attributes.
LENS_NUMBERS = ("focal.x", "focal.y", "centre.x", "centre.y", "k1", "k2", "p1", "p2", "k3")
# Which of them are fitted, by how many coefficients of distortion are asked for.
FITTED_NUMBERS = {0: (0, 1, 2, 3), 2: (0, 1, 2, 3, 4, 5), 4: (0, 1, 2, 3, 4, 5, 6, 7), 5: tuple(range(9))}
MIN_PICTURES = 3
# A corner is wrong if it is as many standard deviations off, which is far beyond chance.
_CORNER_LIMIT = 7.0
# Most corners of a picture are off alike if the median is this part of the largest, or more.
_ALIKE = 0.2
_ROUNDS = 20
# Standard deviation of a corner that tells whether pictures determine a lens, however well they fit [px].
_LEAST_SIGMA = 0.02
# Of a focal length, the largest standard error of a lens that is determined.
_MAX_FOCAL_ERROR = 0.03
# The board is tilted by this angle or more between two pictures [rad]. Noise tilts parallel boards by some degrees, and
# errors about a lens that follows from that are meaningless.
_MIN_TILT = math.radians(8)
# A focal length is within these multiples of the width of the picture, and coefficients of distortion are smaller.
_FOCAL_RANGE, _MAX_DISTORTION = (0.1, 15.0), 100.0
# The corners should be all over this part of the picture.
_MIN_COVERAGE = 0.5
_CONFIDENCE = 0.95


@attrs.frozen(kw_only=True, eq=False)
class CameraIntrinsics:
    """The lens of a camera, estimated from pictures of a board.

    Attributes:
        lens: of the camera.
        standard_errors: (9,) of its numbers, focal lengths, centre, distortion; 0 where they were not fitted.
        fitted: which of these were fitted.
        views: the pictures that it was estimated from, without corners that are wrong.
        poses: (m, 4, 4) of the board in the frame of the camera.
        residuals: (c, 2) of the corners, seen minus expected [px].
        sigma: standard deviation of a coordinate of a corner, from the residuals [px].
        degrees_of_freedom: how many more coordinates there are than unknowns.
        wrong_corners: how many corners were left out, as they are far from where they should be.
    """

    lens: Lens
    standard_errors: Array
    fitted: tuple[int, ...]
    views: BoardViews
    poses: Array
    residuals: Array
    sigma: float
    degrees_of_freedom: int
    wrong_corners: int

    @property
    def half_widths(self) -> Array:
        """(9,) half of the 95 % intervals of the numbers, by Student's t."""
        factor = float(student.ppf((1 + _CONFIDENCE) / 2, self.degrees_of_freedom))
        return factor * self.standard_errors

    @property
    def rms_by_picture(self) -> Array:
        """(m,) root mean square of the distances between seen and expected corners [px]."""
        squares = np.bincount(self.views.picture, np.sum(self.residuals**2, axis=1))
        return np.sqrt(squares / np.bincount(self.views.picture))

    @property
    def coverage(self) -> float:
        """The part of the picture in which there are corners, of its 64 fields of equal size."""
        fields = np.floor(self.views.pixels / [self.lens.width, self.lens.height] * 8).clip(0, 7) @ [8, 1]
        return len(np.unique(fields)) / 64

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        notes = [f"left out: {name}: {reason}" for name, reason in self.views.left_out.items()]
        if self.wrong_corners:
            notes.append(f"{counted(self.wrong_corners, 'corner')} left out, far from where the others put them")
        if self.coverage < _MIN_COVERAGE:
            notes.append(
                f"the corners are in {self.coverage:.0%} of the picture only; elsewhere the distortion is extrapolated"
            )
        return tuple(notes)


def calibrate_intrinsics(views: BoardViews, *, coefficients: int = 5) -> CameraIntrinsics:
    """Estimate the lens of a camera from pictures of a board that was tilted in different directions.

    Args:
        views: of the board.
        coefficients: of the distortion that are fitted: 0, 2 (k1, k2), 4 (and p1, p2) or 5 (and k3).

    Raises:
        TooFewError: there are too few pictures.
        InvalidValueError: the pictures do not determine the lens, because the board was never tilted, or always alike.
        MissingExtraError: OpenCV is not installed.
    """
    if integer(coefficients, "coefficients of distortion", least=0) not in FITTED_NUMBERS:
        raise InvalidValueError(f"coefficients of distortion: expected 0, 2, 4 or 5, got {coefficients}")
    if len(views) < MIN_PICTURES:
        raise TooFewError(f"expected {MIN_PICTURES} pictures or more of the board, tilted, got {len(views)}")
    all_corners = len(views.pixels)
    left_out = 0
    for _ in range(_ROUNDS):
        estimate = _estimate(views, coefficients)
        better, removed = _without_wrong(estimate)
        left_out += removed
        if better is views:
            break
        if len(better) < MIN_PICTURES or len(better.pixels) < all_corners / 2:
            raise InvalidValueError(
                f"half of the pictures or corners do not fit a camera: the median picture is "
                f"{np.median(estimate.rms_by_picture):.2g} pixels off; is this the board, and did it stay flat?"
            )
        views = better
    _refuse_undetermined(estimate)
    return attrs.evolve(estimate, wrong_corners=left_out)


# ---- inside --------------------------------------------------------------------------------------------------------


def _estimate(views: BoardViews, coefficients: int) -> CameraIntrinsics:
    cv2 = opencv("calibrating a camera")
    fixed = {
        0: cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3,
        2: cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3,
        4: cv2.CALIB_FIX_K3,
        5: 0,
    }
    points = [np.float32(views.board.points[view.corners]) for view in views.views]
    pixels = [np.float32(view.pixels) for view in views.views]
    criteria = (cv2.TERM_CRITERIA_MAX_ITER + cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    size = views.width, views.height
    try:
        _, matrix, distortion, rotations, translations, errors, *_ = cv2.calibrateCameraExtended(
            points, pixels, size, None, None, flags=fixed[coefficients], criteria=criteria
        )
    except cv2.error as error:
        raise _undetermined(views, None, None) from error
    values = np.concatenate([matrix[[0, 1, 0, 1], [0, 1, 2, 2]], np.ravel(distortion)[:5]])
    poses = homogeneous([cv2.Rodrigues(rotation)[0] for rotation in rotations], np.reshape(translations, (-1, 3)))
    errors = np.ravel(errors)[:9]
    low, high = np.multiply(_FOCAL_RANGE, max(size))
    largest = np.array([high, high, high, high, *[_MAX_DISTORTION] * 5])
    # Comparisons with NaN are false.
    if not (np.isfinite(errors).all() and (low < values[:2]).all() and (np.abs(values) < largest).all()):
        raise _undetermined(views, None, None)
    lens = Lens(width=views.width, height=views.height, focal=values[:2], centre=values[2:4], distortion=values[4:])
    residuals = np.concatenate(
        [
            view.pixels - cv2.projectPoints(object_points, rotation, translation, matrix, distortion)[0][:, 0]
            for view, object_points, rotation, translation in zip(
                views.views, points, rotations, translations, strict=True
            )
        ]
    )
    fitted = FITTED_NUMBERS[coefficients]
    freedom = residuals.size - 6 * len(views) - len(fitted)
    if freedom < 1:
        raise TooFewError(
            f"{residuals.size} coordinates of corners do not determine {len(fitted)} numbers of a lens and the poses "
            f"of {len(views)} boards; take more pictures"
        )
    sigma = math.sqrt(float(np.sum(residuals**2)) / freedom)
    return CameraIntrinsics(
        lens=lens,
        standard_errors=errors,
        fitted=fitted,
        views=views,
        poses=poses,
        residuals=residuals,
        sigma=sigma,
        degrees_of_freedom=freedom,
        wrong_corners=0,
    )


def _refuse_undetermined(estimate: CameraIntrinsics) -> None:
    normals = estimate.poses[:, :3, 2]
    tilt = math.acos(float(np.clip((normals @ normals.T).min(), -1, 1)))
    if tilt < _MIN_TILT:
        raise _undetermined(estimate.views, None, tilt)
    error = float((estimate.standard_errors[:2] / estimate.lens.focal).max())
    error *= max(1.0, _LEAST_SIGMA / max(estimate.sigma, 1e-12))
    if error > _MAX_FOCAL_ERROR:
        raise _undetermined(estimate.views, error, tilt)


def _undetermined(views: BoardViews, error: float | None, tilt: float | None) -> InvalidValueError:
    """Return the error that pictures do not determine a lens."""
    much = "" if error is None else f", which has a standard error of {error:.1%}"
    angle = ""
    if tilt is not None:
        angle = f": the board is tilted by {math.degrees(tilt):.2g} degrees at most between them"
    return InvalidValueError(
        f"{counted(len(views), 'picture')} do not determine the focal length{much}{angle}. Tilt the board against the "
        "camera by 20 to 45 degrees, in several directions"
    )


def _without_wrong(estimate: CameraIntrinsics) -> tuple[BoardViews, int]:
    """Return the pictures without corners that are far off, and how many; or the same pictures, if there are none.

    A corner that is far off pulls the others of its picture along. Those that are half as far off as the worst are left
    out, and the others are looked at again; a picture goes as a whole where most corners are off alike.
    """
    views, distances = estimate.views, np.linalg.norm(estimate.residuals, axis=1)
    # The median of the distances of a normal distribution in the plane is 1.1774 standard deviations.
    limit = _CORNER_LIMIT * max(float(np.median(distances)), 1e-6) / 1.1774
    kept, left_out, count = list[BoardView](), dict(views.left_out), 0
    for view, own in zip(views.views, np.split(distances, np.cumsum(views.sizes)[:-1]), strict=True):
        median, largest = float(np.median(own)), float(own.max())
        if largest <= limit:
            kept.append(view)
        elif median > max(limit, _ALIKE * largest):
            left_out[view.name] = f"its corners are {median:.2g} pixels off, those of all pictures {limit:.2g} at most"
        else:
            near = own <= max(limit, largest / 2)
            count += int((~near).sum())
            kept.append(attrs.evolve(view, corners=view.corners[near], pixels=view.pixels[near]))
    if len(kept) == len(views) and not count:
        return views, 0
    size = views.width, views.height
    return board_views(views.board, size, kept, least=0, left_out=left_out), count
