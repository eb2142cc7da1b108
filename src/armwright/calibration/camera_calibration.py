"""The calibration of a camera as a result: its lens, where it is, tables, notes and the lines of a cell file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.arm_readings import ArmAccuracy, ArmReadings
from armwright.calibration.board import BoardViews
from armwright.calibration.camera_intrinsics import LENS_NUMBERS, CameraIntrinsics, calibrate_intrinsics
from armwright.calibration.camera_tables import PictureJoints
from armwright.calibration.hand_eye import HandEyeCalibration, calibrate_hand_eye
from armwright.errors import InvalidValueError, counted, listed
from armwright.files.result_table import ResultTable
from armwright.spatial.euler import to_rpy
from armwright.spatial.lens import Lens
from armwright.spatial.poses import to_noap

_AXES = ("x", "y", "z")
# The names of the twelve numbers of two poses.
POSE_NUMBERS = tuple(
    f"{body}.{kind}{axis}" for body in ("camera", "board") for kind in ("", "rotation.") for axis in _AXES
)
# How many pictures a note names.
_MAX_NAMED = 8


@attrs.frozen(kw_only=True, eq=False)
class CameraCalibration:
    """The calibration of a camera.

    Attributes:
        name: of the camera, in cell files.
        views: the pictures that show the board.
        lens: of the camera.
        intrinsics: the lens as estimated from the pictures alone; None where it was known.
        hand_eye: where the camera is; None without joint positions.
        without_joints: pictures whose joint positions are not given.
    """

    name: str
    views: BoardViews
    lens: Lens
    intrinsics: CameraIntrinsics | None
    hand_eye: HandEyeCalibration | None
    without_joints: tuple[str, ...] = ()

    @property
    def contradictions(self) -> tuple[str, ...]:
        """By what the pictures contradict the accuracy of the arm; empty where they do not."""
        return () if self.hand_eye is None else self.hand_eye.contradictions

    @property
    def lens_errors(self) -> tuple[Array, Array]:
        """Standard errors (9,) of the numbers of the lens, and half of their intervals; 0 where they are known."""
        errors, halves = np.zeros(len(LENS_NUMBERS)), np.zeros(len(LENS_NUMBERS))
        if self.hand_eye is not None:
            numbers = list(self.hand_eye.lens_numbers)
            errors[numbers], halves[numbers] = self.hand_eye.standard_errors[12:], self.hand_eye.half_widths[12:]
        elif self.intrinsics is not None:
            errors, halves = self.intrinsics.standard_errors, self.intrinsics.half_widths
        return errors, halves

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        return tuple(self._notes())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Those of the notes that a reader must not overlook: contradictions, and pictures without weight."""
        return tuple(self._warnings())

    def _warnings(self) -> Iterator[str]:
        yield from (f"DOUBTFUL: {reason}" for reason in self.contradictions)
        if self.hand_eye is not None and self.hand_eye.wrong:
            wrong = listed([self.hand_eye.names[i] for i in self.hand_eye.wrong], _MAX_NAMED)
            yield f"pictures that contradict the others, without weight: {wrong}"

    def _notes(self) -> Iterator[str]:
        yield from self._warnings()
        if self.intrinsics is not None:
            yield (
                f"{counted(len(self.intrinsics.views), 'picture')} with {len(self.intrinsics.residuals)} corners; the "
                f"residuals have a standard deviation of {self.intrinsics.sigma:.3g} pixels per coordinate"
            )
            yield from self.intrinsics.notes
        else:
            yield from (f"left out: {name}: {reason}" for name, reason in self.views.left_out.items())
        if self.without_joints:
            yield f"pictures without joint positions: {listed(self.without_joints, _MAX_NAMED)}"
        if self.hand_eye is None:
            return
        fit = self.hand_eye
        accuracy = fit.readings.accuracy
        stated = (
            f"{accuracy.position * 1e3:g} mm and {accuracy.orientation * 1e3:g} mrad"
            if accuracy.joints is None
            else "the standard deviations of its joints"
        )
        yield (
            f"the pictures are {fit.disagreement:.2f} times as far from where the arm puts the camera as {stated} "
            f"and the noise of pixels explain; the standard errors are right if this is about 1"
        )

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        errors, halves = self.lens_errors
        values = self.lens.numbers.tolist()
        data: dict[str, Any] = {
            "camera": self.name,
            "pictures": list(self.views.names),
            "left_out": dict(self.views.left_out if self.intrinsics is None else self.intrinsics.views.left_out),
            "width": self.lens.width,
            "height": self.lens.height,
            "lens": {
                name: _estimate(value, error, half)
                for name, value, error, half in zip(LENS_NUMBERS, values, errors, halves, strict=True)
            },
        }
        if self.intrinsics is not None:
            data |= {
                "sigma_px": self.intrinsics.sigma,
                "degrees_of_freedom": self.intrinsics.degrees_of_freedom,
                "rms_px": dict(zip(self.intrinsics.views.names, self.intrinsics.rms_by_picture.tolist(), strict=True)),
                "coverage": self.intrinsics.coverage,
            }
        if self.hand_eye is not None:
            data["hand_eye"] = _hand_eye_data(self.hand_eye)
            data["contradictions"] = list(self.contradictions)
        return data

    def tables(self) -> Iterator[ResultTable]:
        """Give the lens, the pose of the camera and of the board, and the pictures."""
        errors, halves = self.lens_errors
        rows = zip(LENS_NUMBERS, self.lens.numbers, errors, halves, strict=True)
        yield ResultTable(
            title=f"Lens of {self.name}, {self.lens.width} x {self.lens.height} pixels",
            heads=("number", "estimate", "standard error", "95 % ±"),
            rows=[(name, f"{value:z.6g}", *_error_texts(error, half)) for name, value, error, half in rows],
            numbers=(1, 2, 3),
        )
        if self.hand_eye is not None:
            yield from _pose_tables(self.hand_eye)
        yield self._picture_table()

    def cell_lines(self) -> str:
        """Return the lines of a cell file for this camera."""
        lens, fit = self.lens, self.hand_eye
        lines = [f"[cameras.{self.name}]"]
        if fit is not None:
            if fit.eye_in_hand:
                lines += [
                    "# The pose is in the frame of the tool: columns n, o, a, p; z is the axis of the lens.",
                    'on = "ARM_1"',
                ]
            else:
                lines.append(
                    "# The pose is in the base frame of the arm: columns n, o, a, p; z is the axis of the lens."
                )
            lines.append(f"pose = {_numbers_text(to_noap(fit.camera))}")
        lines += [
            f"width = {lens.width}",
            f"height = {lens.height}",
            f"focal_px = {_numbers_text(lens.focal)}",
            f"centre_px = {_numbers_text(lens.centre)}",
            f"distortion = {_numbers_text(lens.distortion)}",
        ]
        return "\n".join(lines) + "\n"

    def _picture_table(self) -> ResultTable:
        alone = self.intrinsics
        rms = {} if alone is None else dict(zip(alone.views.names, alone.rms_by_picture.tolist(), strict=True))
        fit = self.hand_eye
        arm = {} if fit is None else dict(zip(fit.names, fit.by_picture.tolist(), strict=True))
        wrong = set() if fit is None else {fit.names[i] for i in fit.wrong}
        rows = [
            (
                view.name,
                str(len(view.corners)),
                f"{rms[view.name]:.3f}" if view.name in rms else "",
                f"{arm[view.name]:.2f}" if view.name in arm else "",
            )
            for view in self.views.views
        ]
        return ResultTable(
            title="Pictures",
            heads=("picture", "corners", "rms px", "against the arm"),
            rows=rows,
            numbers=(1, 2, 3),
            marks=["over" if name in wrong or (rms and name not in rms) else "" for name, *_ in rows],
            remark="against the arm: how many times as far from where the arm puts the camera as expected",
        )


def calibrate_camera(
    views: BoardViews,
    *,
    name: str = "camera",
    lens: Lens | None = None,
    coefficients: int = 5,
    arm: Arm | None = None,
    joints: PictureJoints | None = None,
    accuracy: ArmAccuracy | None = None,
    eye_in_hand: bool = True,
    sigma: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> CameraCalibration:
    """Calibrate a camera from pictures of a board, and with joint positions also its pose by an arm.

    Args:
        views: pictures of a board.
        name: of the camera, in cell files.
        lens: of the camera, where it is known.
        coefficients: of the distortion that are fitted; see ``calibrate_intrinsics``.
        arm: that moved the camera or the board.
        joints: its positions at the pictures; None for the lens alone.
        accuracy: of the arm.
        eye_in_hand: whether the camera is on the tool and the board beside the arm; otherwise vice versa.
        sigma: standard deviation of a coordinate of a corner [px]; estimated from the residuals if left out.
        progress: called with what is being done.

    Raises:
        TooFewError: there are too few pictures.
        InvalidValueError: the pictures or the motions of the arm do not determine the result; the lens is of pictures
            of another size.
        ContradictionError: the pictures do not belong to the joint positions.
        MissingExtraError: OpenCV is not installed.
    """
    if lens is not None and (lens.width, lens.height) != (views.width, views.height):
        raise InvalidValueError(
            f"expected a lens of pictures of {views.width} x {views.height} pixels, got one of {lens.width} x "
            f"{lens.height}"
        )
    intrinsics = None
    if lens is None:
        if progress is not None:
            progress("calibrating the lens")
        intrinsics = calibrate_intrinsics(views, coefficients=coefficients)
        if joints is None:
            return CameraCalibration(name=name, views=views, lens=intrinsics.lens, intrinsics=intrinsics, hand_eye=None)
    if joints is None or arm is None:
        raise InvalidValueError("expected an arm and its joint positions: of a known lens, only its pose is calibrated")
    if progress is not None:
        progress("calibrating the pose of the camera")
    used = views if intrinsics is None else intrinsics.views
    present, q = joints.of(used.names)
    fit = calibrate_hand_eye(
        used.take(present),
        ArmReadings(arm=arm, q=q, accuracy=accuracy or ArmAccuracy()),
        intrinsics=intrinsics,
        lens=lens,
        eye_in_hand=eye_in_hand,
        sigma=sigma,
    )
    return CameraCalibration(
        name=name,
        views=views,
        lens=fit.lens,
        intrinsics=intrinsics,
        hand_eye=fit,
        without_joints=tuple(picture for i, picture in enumerate(used.names) if i not in present),
    )


# ---- inside --------------------------------------------------------------------------------------------------------


def _numbers_text(values: Array) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"


def _error_texts(error: float, half: float) -> tuple[str, str]:
    return (f"{error:.2g}", f"{half:.2g}") if error else ("", "")


def _estimate(value: float | None, error: float, half: float) -> dict[str, float]:
    data = {} if value is None else {"value": value}
    data["standard_error"] = float(error)
    if value is None:
        return {**data, "half_width": float(half)}
    return {**data, "lower": value - float(half), "upper": value + float(half)}


def _frames(fit: HandEyeCalibration) -> tuple[str, str]:
    """Return the frames that the poses of camera and board are in."""
    return ("tool", "base") if fit.eye_in_hand else ("base", "tool")


def _pose_tables(fit: HandEyeCalibration) -> Iterator[ResultTable]:
    errors, halves = fit.standard_errors, fit.half_widths
    for start, body, X, frame in zip((0, 6), ("Camera", "Board"), (fit.camera, fit.board), _frames(fit), strict=True):
        rows = []
        for i, axis in enumerate(_AXES):
            k = start + i
            rows.append((axis, f"{X[i, 3] * 1e3:z.4f}", f"{errors[k] * 1e3:.4f}", f"{halves[k] * 1e3:.4f}", "mm"))
        for i, (word, angle) in enumerate(zip(("roll", "pitch", "yaw"), to_rpy(X[:3, :3]), strict=True)):
            error, half = (math.degrees(float(x[start + 3 + i])) for x in (errors, halves))
            rows.append((word, f"{math.degrees(angle):z.4f}", f"{error:.4f}", f"{half:.4f}", "deg"))
        yield ResultTable(
            title=f"{body} in the {frame} frame",
            heads=("", "estimate", "standard error", "95 % ±", "unit"),
            rows=rows,
            numbers=(1, 2, 3),
            remark="errors of roll, pitch, yaw: of small rotations about x, y, z of this frame",
        )


def _hand_eye_data(fit: HandEyeCalibration) -> dict[str, Any]:
    poses = [*fit.camera[:3, 3].tolist(), None, None, None, *fit.board[:3, 3].tolist(), None, None, None]
    errors, halves = fit.standard_errors[:12].tolist(), fit.half_widths[:12].tolist()
    return {
        "setup": "eye-in-hand" if fit.eye_in_hand else "eye-to-hand",
        "camera": fit.camera.tolist(),
        "board": fit.board.tolist(),
        "errors": {
            name: _estimate(value, error, half)
            for name, value, error, half in zip(POSE_NUMBERS, poses, errors, halves, strict=True)
        },
        "covariance": fit.covariance.tolist(),
        "sigma_px": fit.sigma,
        "disagreement": fit.disagreement,
        "by_picture": dict(zip(fit.names, fit.by_picture.tolist(), strict=True)),
        "wrong_pictures": [fit.names[i] for i in fit.wrong],
    }
