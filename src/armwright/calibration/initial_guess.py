"""The initial guess of a fit: base, target, frames, planes and anchors registered to the nominal arm.

Readings that no registration brings near are of another arm, of other joints, or in other units, and are refused with a
question.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, JointErrorModel, kinematic_chain
from armwright.calibration.readings import Readings
from armwright.calibration.residuals import MeasurementModel, Plane
from armwright.errors import ContradictionError, TooFewError
from armwright.spatial.poses import homogeneous, one_pose
from armwright.spatial.rotations import nearest_rotation, rotation_vector

# A measurement that no rigid motion brings so near to the arm is of another arm, or in other units [m].
_MAX_DISTANCE = 0.2
# Rotations that differ by more than this from the arm's, in half of all, follow another convention [rad].
_MAX_ANGLE = 0.5
# From this rotation on the measured target is another frame, not the tool with an error [rad].
_MIN_TARGET_ANGLE = 0.05
# Points whose second width is a smaller part of the first lie on a line, and leave a rotation about it free.
_COLLINEARITY = 1e-3
_UNIT_MISTAKES = {1e3: "millimetres read as metres", 1e-3: "metres read as millimetres", 39.37: "inches read as metres"}


def initial_guess(
    arm: Arm, readings: Readings, *, base: Array | None = None, joint_errors: tuple[JointErrorModel, ...] = ()
) -> MeasurementModel:
    """Return the measurement model of a nominal arm, registered to readings.

    Args:
        arm: with n joints.
        readings: of it.
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; estimated when left out.
        joint_errors: models of its joints.

    Raises:
        ContradictionError: the readings are those of another arm, in another convention or in other units.
        TooFewError: there are too few readings of a frame, a plane or an anchor to locate it.
        InvalidValueError: ``base`` has no rotation in it.
        ShapeError: ``base`` is not (4, 4).
    """
    chain = kinematic_chain(arm)
    first = readings.with_point & (readings.frame == 0)
    _refuse_other_units(chain, readings, first)
    X = np.eye(4)
    if base is not None:
        X = one_pose(base, "base")
    elif first.any():
        X = register_base(chain, readings.q[first], readings.points[first])
    chain = kinematic_chain(arm, base=X)
    frames = (np.eye(4), *(_initial_frame(chain, readings, i) for i in range(1, len(readings.frames))))
    target = _target_rotation(chain, readings, frames)
    model = MeasurementModel(
        chain=kinematic_chain(arm, base=X, target_rotation=target, joint_errors=joint_errors),
        frames=dict(zip(readings.frames or ("",), frames, strict=True)),
        planes={name: _initial_plane(chain, readings, i) for i, name in enumerate(readings.planes)},
        anchors={name: _initial_anchor(chain, readings, i) for i, name in enumerate(readings.anchors)},
    )
    errors = model.pose_errors(readings)
    distance = float(np.median(errors.distance))
    if distance > _MAX_DISTANCE:
        raise ContradictionError(
            f"the median distance of the points from the tool of {arm.name} is {distance * 1e3:.4g} mm"
            f"{' with its base best-fitted' if base is None else ''}: are these its joints, in this order and these "
            f"units?"
        )
    angles = errors.angle[readings.with_rotation]
    # Points on a line leave a rotation of the base about it free, which the fit estimates.
    is_certain = base is not None or not _are_collinear(readings.points[first])
    if len(angles) and np.median(angles) > _MAX_ANGLE and is_certain:
        raise ContradictionError(
            f"the median rotation of the poses from the tool of {arm.name} is {np.degrees(np.median(angles)):.0f} "
            f"degrees with the target best-fitted: are these its rotations, in this order and these units?"
        )
    return model


def register_base(chain: Chain, q: Array, points: Array) -> Array:
    """Return (4, 4) the base frame with which the nominal arm fits the points best."""
    return _rigid_motion(chain.forward(q).position, points)


def _rigid_motion(points: Array, goals: Array) -> Array:
    """Return the pose (4, 4) that maps points to goals with the least squares of distances.

    Source:
        Kabsch (1976).
    """
    a, b = points - points.mean(axis=0), goals - goals.mean(axis=0)
    R = nearest_rotation(b.T @ a)
    return homogeneous(R, goals.mean(axis=0) - R @ points.mean(axis=0))


def _refuse_other_units(chain: Chain, readings: Readings, first: Array) -> None:
    """Refuse points and distances that are in other units."""
    pairs = np.flatnonzero(np.isfinite(readings.other[:, 0]))
    tool, other = chain.forward(readings.q).position, chain.forward(readings.other[pairs]).position
    for what, nominal, measured in (
        ("points spread", _mean_distance_from_centre(tool[first]), _mean_distance_from_centre(readings.points[first])),
        ("distances are", np.linalg.norm(tool[pairs] - other, axis=1).sum(), readings.distances[pairs].sum()),
    ):
        ratio = float(measured) / max(float(nominal), 1e-12)
        for factor, mistake in _UNIT_MISTAKES.items():
            if 0.8 < ratio / factor < 1.25:
                raise ContradictionError(
                    f"the {what} {ratio:.4g} times as far as {chain.arm.name} reaches in these configurations: "
                    f"are they {mistake}?"
                )


def _mean_distance_from_centre(points: Array) -> float:
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean()) if len(points) else 0.0


def _target_rotation(chain: Chain, readings: Readings, frames: Sequence[Array]) -> Array:
    """Return (3, 3) the rotation of the measured target in the tool; none where it is within the errors of the tool."""
    which = np.flatnonzero(readings.with_rotation)
    if not len(which):
        return np.eye(3)
    measured = np.stack([X[:3, :3] for X in frames])[readings.frame[which]] @ readings.rotations[which]
    R = nearest_rotation((chain.forward(readings.q[which]).rotation.swapaxes(1, 2) @ measured).sum(axis=0))
    return R if np.linalg.norm(rotation_vector(R)) > _MIN_TARGET_ANGLE else np.eye(3)


def _initial_frame(chain: Chain, readings: Readings, number: int) -> Array:
    """Return (4, 4) the pose of a further frame in the measuring frame."""
    which = readings.with_point & (readings.frame == number)
    measured, name = readings.points[which], readings.frames[number]
    if not which.any():
        return np.eye(4)  # these readings have no points in it
    if _are_collinear(measured):
        raise TooFewError(
            f"frame {name}: {len(measured)} points"
            f"{' on a line' if len(measured) > 2 else ''} do not determine its pose; measure 3 or more that are not "
            f"on a line"
        )
    return _rigid_motion(measured, chain.forward(readings.q[which]).position)


def _are_collinear(points: Array) -> bool:
    """Whether points (m, 3) are collinear or all the same, as fewer than three always are."""
    if len(points) < 3:
        return True
    widths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(widths[1] <= _COLLINEARITY * widths[0])


def _initial_plane(chain: Chain, readings: Readings, number: int) -> Plane:
    """Return the best-fit plane of the points at which the nominal arm touches it."""
    which = readings.plane == number
    if not which.any():
        return Plane(np.zeros(3), np.eye(3))
    _refuse_few("plane", readings.planes[number], int(which.sum()), "touches")
    points = chain.forward(readings.q[which]).position
    _, _, axes = np.linalg.svd(points - points.mean(axis=0))
    return Plane(points.mean(axis=0), axes.T)


def _initial_anchor(chain: Chain, readings: Readings, number: int) -> Array:
    """Return (3,) the position whose distances from the nominal arm's tool are as measured (trilateration)."""
    which = readings.anchor == number
    if not which.any():
        return np.zeros(3)
    _refuse_few("anchor", readings.anchors[number], int(which.sum()), "distances")
    points, distances = chain.forward(readings.q[which]).position, readings.distances[which]

    def residuals(position: Array) -> Array:
        return np.asarray(np.linalg.norm(points - position, axis=1) - distances, dtype=np.float64)

    # From all sides: if the points are near a plane, the mirror image of the anchor is a local minimum.
    centre, radius = points.mean(axis=0), float(np.median(distances))
    starts = [centre + radius * sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    solutions = [least_squares(residuals, start, loss="soft_l1", f_scale=1e-2) for start in starts]
    best: Array = min(solutions, key=lambda solution: float(solution.cost)).x
    return best


def _refuse_few(what: str, name: str, count: int, of: str) -> None:
    if count < 4:
        raise TooFewError(f"{what} {name}: {count} {of} do not determine its position; measure 4 or more")
