"""The stages of one move, planned together: point to point, straight line, through frames."""

from collections.abc import Iterator, Sequence
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, joint_array, of_shape
from armwright.errors import ArmwrightError
from armwright.kinematics.forward import forward
from armwright.kinematics.inverse.closed_form import inverse
from armwright.kinematics.inverse.turns import images, travel
from armwright.motion.follow import Cause, PathError, cause_of, follow
from armwright.motion.path import Path
from armwright.motion.quintic import point_to_point
from armwright.motion.trajectory import Trajectory, whole_ticks

# No arm reaches a thousand kilometres; squares of much larger numbers would overflow [m].
_FARTHEST = 1e6

StageKind: TypeAlias = Literal["PTP", "LINE", "SPLINE"]


@attrs.frozen(kw_only=True)
class Manner:
    """How a move is to be made.

    Attributes:
        speed: 1 to 120, 100 is normal.
        deviation: allowed distance from straight lines [m].
        period: of the servo [s]; stages last a whole number of it.
    """

    speed: float = 100.0
    deviation: float = 1e-3
    period: float = 1e-3


@attrs.frozen(kw_only=True, eq=False)
class StageGoal:
    """What one stage has to do.

    Attributes:
        kind: ``PTP`` to one pose, ``LINE`` to one pose, ``SPLINE`` through several.
        poses: (k, 4, 4) tool poses in the base frame of the arm.
    """

    kind: StageKind
    poses: Array


@attrs.frozen(kw_only=True, eq=False)
class Stage:
    """One stage, planned.

    Attributes:
        kind: of the trajectory.
        trajectory: of the joints, at rest at both ends, a whole number of servo periods long.
        length: of the way of the hand [m].
        knots: number of poses that were solved.
        deviation: largest distance from the path that was found [m]; None for point to point.
        slowed: why it runs slower than asked, or empty.
    """

    kind: StageKind
    trajectory: Trajectory
    length: float
    knots: int
    deviation: float | None
    slowed: str


class StageError(ArmwrightError, ValueError):
    """A stage cannot be made.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` posture.
        stage: which stage, from 0.
        pose: which of its poses the arm was on the way to, from 0.
        fraction: how far along that way; 1 for the pose itself.
    """

    def __init__(self, cause: Cause, stage: int, pose: int, fraction: float, message: str) -> None:
        """Say what stops the arm, and where."""
        self.cause, self.stage, self.pose, self.fraction = cause, stage, pose, fraction
        super().__init__(message)


def plan(arm: Arm, q_start: ArrayLike, goals: Sequence[StageGoal], manner: Manner) -> list[Stage]:
    """Plan the stages of one move, each beginning where the last one ended.

    A point-to-point stage has up to eight postures to end in. The nearest comes first; when no straight line
    can go on from it, the next nearest is tried.

    Args:
        arm: any arm; with a closed-form inverse all its postures are known, without one those that are found.
        q_start: (n,) present joint positions.
        goals: the stages.
        manner: speed, deviation, servo period.

    Returns:
        One planned stage per goal.

    Raises:
        StageError: a stage cannot be made from any posture; it names the first obstacle of the nearest one.
        InvalidValueError: speed or deviation are out of range.
    """
    return _plan(arm, joint_array(q_start, arm.n, "q_start"), goals, manner, 0)


def _plan(arm: Arm, q: Array, goals: Sequence[StageGoal], manner: Manner, number: int) -> list[Stage]:
    if number == len(goals):
        return []
    first_error: StageError | None = None
    for stage in _ways(arm, q, goals[number], manner, number):
        try:
            return [stage, *_plan(arm, stage.trajectory(stage.trajectory.duration), goals, manner, number + 1)]
        except StageError as error:
            first_error = first_error or error
    assert first_error is not None  # noqa: S101 - _ways gives at least one stage or raises
    raise first_error


def _ways(arm: Arm, q: Array, goal: StageGoal, manner: Manner, number: int) -> Iterator[Stage]:
    """Give the ways to make one stage, best first: one per posture for point to point, else one."""
    poses = of_shape(goal.poses, (4, 4), "poses")
    far = np.abs(poses[:, :3, 3]).max(axis=-1)
    if far.max() > _FARTHEST:
        raise StageError("reach", number, int(far.argmax()), 1.0, f"the pose is {far.max():.3g} m away")
    if goal.kind == "PTP":
        # Planned as they are asked for: nearly always the first one does.
        yield from (_direct(arm, q, posture, manner) for posture in _postures(arm, poses[0], q, number))
        return
    path = Path(poses=np.concatenate([forward(arm, q)[None], poses]))
    try:
        found = follow(arm, path, q, deviation=manner.deviation, speed=manner.speed)
    except PathError as error:
        raise StageError(error.cause, number, error.segment, error.fraction, str(error)) from error
    yield Stage(
        kind=goal.kind,
        trajectory=whole_ticks(found.trajectory, manner.period),
        length=float(np.linalg.norm(np.diff(path.poses[:, :3, 3], axis=0), axis=-1).sum()),
        knots=found.knots,
        deviation=found.deviation,
        slowed=found.slowed,
    )


def _postures(arm: Arm, X: Array, q: Array, number: int) -> list[Array]:
    """Return the postures inside the limits that reach a pose, whole turns included, nearest first."""
    solution = inverse(arm, X, q)
    if not solution.allowed:
        raise StageError(cause_of(solution), number, 0, 1.0, solution.explain())
    postures = [image for branch in solution.allowed for image in images(arm, branch.q)]
    return sorted(postures, key=lambda posture: travel(arm, q, posture))


def _direct(arm: Arm, q: Array, goal: Array, manner: Manner) -> Stage:
    trajectory = point_to_point(arm, q, goal, manner.speed)
    hand = forward(arm, trajectory(np.linspace(0.0, trajectory.duration, 101)))[:, :3, 3]
    return Stage(
        kind="PTP",
        trajectory=whole_ticks(trajectory, manner.period),
        length=float(np.linalg.norm(np.diff(hand, axis=0), axis=-1).sum()),
        knots=2,
        deviation=None,
        slowed="",
    )
