"""Where a fit begins: where the arm, further frames, planes and anchors are, if the arm is as it is said to be.

What cannot be brought near at all is of another arm, of other joints, or in other units, and is refused with a
question.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, JointErrorModel, chain_of
from armwright.calibration.measurement_model import MeasurementModel, Plane
from armwright.calibration.readings import Readings
from armwright.errors import ContradictionError, TooFewError
from armwright.spatial.poses import one_pose, pose
from armwright.spatial.rotations import nearest_rotation, rotation_vector

# A measurement that no rigid motion brings so near to the arm is of another arm, or in other units [m].
_FARTHEST = 0.2
# Poses that are turned farther than this from the arm's, in half of all, are told in another way [rad].
_FARTHEST_TURN = 0.5
# What is measured is another frame of the hand, not the tool a little off, from this turn on [rad].
_ANOTHER = 0.05
# Points whose second width is a smaller part of the first lie on a line, and leave a turn about it free.
_LINE = 1e-3
_UNITS = (
    (1e3, "millimetres read as metres"),
    (1e-3, "metres read as millimetres"),
    (39.37, "inches read as metres"),
)


def initial_guess(
    arm: Arm, readings: Readings, *, base: Array | None = None, bends: tuple[JointErrorModel, ...] = ()
) -> MeasurementModel:
    """Return the model of an arm as it is said to be, brought near to readings.

    Args:
        arm: with n joints.
        readings: of it.
        base: (4, 4) pose of the arm's base frame in the frame of the measurements, roughly; found when left out.
        bends: of its joints.

    Raises:
        ContradictionError: the readings are those of another arm, told otherwise or in other units.
        TooFewError: there are too few readings of a frame, a plane or an anchor to find it.
        InvalidValueError: ``base`` has no rotation in it.
        ShapeError: ``base`` is not (4, 4).
    """
    given = base is not None
    base = None if base is None else one_pose(base, "base")
    chain = chain_of(arm)
    first = readings.with_point & (readings.frame == 0)
    _refuse_other_units(chain, readings, first)
    if base is None:
        base = register(chain, readings.q[first], readings.points[first]) if first.any() else np.eye(4)
    chain = chain_of(arm, base=base, bends=bends)
    frames = (np.eye(4), *(_frame(chain, readings, i) for i in range(1, len(readings.frames))))
    model = MeasurementModel(
        chain=chain_of(arm, base=base, hand=_hand(chain, readings, frames), bends=bends),
        frames=frames,
        planes=tuple(_plane(chain, readings, i) for i in range(len(readings.planes))),
        anchors=tuple(_anchor(chain, readings, i) for i in range(len(readings.anchors))),
        frame_names=readings.frames or ("",),
        plane_names=readings.planes,
        anchor_names=readings.anchors,
    )
    off = model.off(readings)
    far = float(np.median(off.distance))
    if far > _FARTHEST:
        raise ContradictionError(
            f"the points lie {far * 1e3:.0f} mm from where {arm.name} would have its tool, wherever it stands: are "
            f"these its joints, in this order and these units?"
        )
    turns = off.turn[readings.with_rotation]
    # Points on a line leave a turn of the base about it free, which the fit finds.
    if len(turns) and np.median(turns) > _FARTHEST_TURN and (given or not _on_a_line(readings.points[first])):
        raise ContradictionError(
            f"half of the poses are turned {np.degrees(np.median(turns)):.0f} degrees or more from where {arm.name} "
            f"would have its hand, however the measured frame is fixed to it: are these its turns, in this order and "
            f"these units?"
        )
    return model


def register(chain: Chain, q: Array, points: Array) -> Array:
    """Return (4, 4) the base frame that brings the arm as it is said to be nearest to the points."""
    return _brought(chain.reach(q).position, points)


def _brought(points: Array, goals: Array) -> Array:
    """Return the pose (4, 4) that brings points nearest to goals.

    Source:
        Kabsch (1976).
    """
    a, b = points - points.mean(axis=0), goals - goals.mean(axis=0)
    R = nearest_rotation(b.T @ a)
    return pose(R, goals.mean(axis=0) - R @ points.mean(axis=0))


def _refuse_other_units(chain: Chain, readings: Readings, first: Array) -> None:
    """Refuse points and distances that are in other units."""
    away = np.flatnonzero(np.isfinite(readings.other[:, 0]))
    own, there = chain.reach(readings.q).position, chain.reach(readings.other[away]).position
    for what, nominal, seen in (
        ("points spread", _spread(own[first]), _spread(readings.points[first])),
        ("distances are", np.linalg.norm(own[away] - there, axis=1).sum(), readings.distances[away].sum()),
    ):
        ratio = float(seen) / max(float(nominal), 1e-12)
        for factor, word in _UNITS:
            if 0.8 < ratio / factor < 1.25:
                raise ContradictionError(
                    f"the {what} {ratio:.4g} times as far as {chain.arm.name} reaches in these postures: "
                    f"are they {word}?"
                )


def _spread(points: Array) -> float:
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean()) if len(points) else 0.0


def _hand(chain: Chain, readings: Readings, frames: Sequence[Array]) -> Array:
    """Return (3, 3) how the measured frame is turned in the tool; not at all where that is an error like others."""
    which = np.flatnonzero(readings.with_rotation)
    if not len(which):
        return np.eye(3)
    seen = np.stack([X[:3, :3] for X in frames])[readings.frame[which]] @ readings.rotations[which]
    R = nearest_rotation((chain.reach(readings.q[which]).rotation.swapaxes(1, 2) @ seen).sum(axis=0))
    return R if np.linalg.norm(rotation_vector(R)) > _ANOTHER else np.eye(3)


def _frame(chain: Chain, readings: Readings, number: int) -> Array:
    """Return (4, 4) where a further frame stands in the measuring frame."""
    which = readings.with_point & (readings.frame == number)
    seen, name = readings.points[which], readings.frames[number]
    if not which.any():
        return np.eye(4)  # nothing is read in it here
    if _on_a_line(seen):
        raise TooFewError(
            f"frame {name}: {len(seen)} points"
            f"{' on a line' if len(seen) > 2 else ''} do not tell where it stands; measure 3 or more that are not "
            f"on a line"
        )
    return _brought(seen, chain.reach(readings.q[which]).position)


def _on_a_line(points: Array) -> bool:
    """Whether points (m, 3) lie on a line or in one place, as fewer than three always do."""
    if len(points) < 3:
        return True
    widths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(widths[1] <= _LINE * widths[0])


def _plane(chain: Chain, readings: Readings, number: int) -> Plane:
    """Return the plane nearest to where the arm as said would have touched it."""
    which = readings.plane == number
    if not which.any():
        return Plane(np.zeros(3), np.eye(3))
    _refuse_few("plane", readings.planes[number], int(which.sum()), "touches")
    points = chain.reach(readings.q[which]).position
    _, _, axes = np.linalg.svd(points - points.mean(axis=0))
    return Plane(points.mean(axis=0), axes.T)


def _anchor(chain: Chain, readings: Readings, number: int) -> Array:
    """Return (3,) the place that is as far as measured from where the arm as said would have its tool."""
    which = readings.anchor == number
    if not which.any():
        return np.zeros(3)
    _refuse_few("anchor", readings.anchors[number], int(which.sum()), "distances")
    points, distances = chain.reach(readings.q[which]).position, readings.distances[which]

    def missing(place: Array) -> Array:
        return np.asarray(np.linalg.norm(points - place, axis=1) - distances, dtype=np.float64)

    # From all sides: points near a plane have an image of the anchor behind it.
    middle, far = points.mean(axis=0), float(np.median(distances))
    sides = [middle + far * sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    found = [least_squares(missing, side, loss="soft_l1", f_scale=1e-2) for side in sides]
    best: Array = min(found, key=lambda one: float(one.cost)).x
    return best


def _refuse_few(what: str, name: str, count: int, of: str) -> None:
    if count < 4:
        raise TooFewError(f"{what} {name}: {count} {of} only tell where it is; measure 4 or more")
