"""The stages of one move, planned together: point to point, straight line, through frames."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, joint_array, of_shape, read_only
from armwright.errors import ArmwrightError, IncapableArmError
from armwright.kinematics.inverse_kinematics.solution import violations_of
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.arc import arc, coarse_arc
from armwright.motion.branch_selection import nearest_configurations
from armwright.motion.certificate import Certificate
from armwright.motion.certified_motion import joined
from armwright.motion.detour import Detour, DetourMethod, line_or_detour
from armwright.motion.limited import limited_motion
from armwright.motion.mode_shaping import StageShaping
from armwright.motion.obstruction import Cause, PathError, cause_of, check_ends
from armwright.motion.path import Path
from armwright.motion.quintic_polynomials import point_to_point
from armwright.motion.rounded_corners import rounded_move
from armwright.motion.rounded_joint_path import rounded_run, rounding_within
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.straight import coarse_line
from armwright.motion.through import through
from armwright.motion.tool_limits import ToolLimits, tool_peaks
from armwright.motion.trajectory import Trajectory, hold, whole_ticks

# No arm reaches a thousand kilometres; squares of much larger numbers would overflow [m].
_FARTHEST = 1e6

# Points of the tool along a smooth motion from which its length is summed.
_LOOKS = 101

# Configurations nearer than this are the same [rad] or [m].
_SAME_CONFIGURATION = 1e-9
# A joint that moves at this part of its speed limit moves at it; a speed of which this part is reached is reached.
_AT_LIMIT, _REACHED = 0.98, 0.98

StageKind: TypeAlias = Literal["PTP", "LINE", "SPLINE", "BLEND", "ARC", "TRACK", "QUEUE", "SENSED"]


@attrs.frozen(kw_only=True)
class Manner:
    """How a move is to be made.

    Attributes:
        speed: 1 to 120, 100 is normal.
        deviation: allowed distance from straight lines [m].
        period: of the servo [s]; stages last a whole number of it.
        around: how to go round what stops a straight line, see ``line_or_detour``; None to stop there. Only a LINE is
            bypassed: a path through several frames is run without a stop, unlike a detour of one of its parts.
        tool: limits of the tool that are kept besides those of the joints; None for none. A speed of them is used
            instead of that of the report's rule.
    """

    speed: float = 100.0
    deviation: float = 1e-3
    period: float = 1e-3
    around: DetourMethod | None = None
    tool: ToolLimits | None = None


@attrs.frozen(kw_only=True, eq=False)
class StageGoal:
    """What one stage has to do.

    Attributes:
        kind: ``PTP`` to one pose, or past several with rounded corners; ``LINE`` to one pose; ``SPLINE`` and ``BLEND``
            past several without a stop; ``ARC`` through the position of the first of two to the second.
        poses: (k, 4, 4) tool poses in the base frame of the arm.
        joints: (n,) joint positions that a ``PTP`` is to end at, whose pose ``poses`` has; None for any that take it.
            Past several poses (k, n), with NaN for any.
        blend: how far from a corner the rounding may begin [m], one number or one for each; for ``BLEND``, and for
            ``PTP`` past several poses.
        corner: how far a ``SPLINE`` may be off the straight legs, and pass a pose [m]; None for the report's own
            X-spline through the poses.
    """

    kind: StageKind
    poses: Array
    joints: Array | None = None
    blend: float | Array | None = None
    corner: float | None = None


@attrs.frozen(kw_only=True, eq=False)
class Obstacle:
    """What stops the arm on its path, and where.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` configuration.
        reason: the same in words, with the joint and the amount.
        joint: number of the joint that stops it, from 1; None where it is no single one.
        pose: which pose of the stage the arm was moving to, from 0.
        fraction: how far along that path; 1 for the pose itself.
        length: of that path [m]; None for point to point, which has no path in space.
        place: (3,) where, seen from the base of the arm [m].
        certain: whether the pose itself cannot be taken, from any configuration.
    """

    cause: Cause
    reason: str
    joint: int | None = None
    pose: int
    fraction: float
    length: float | None = None
    place: Array = attrs.field(converter=read_only)
    certain: bool

    @property
    def along(self) -> float | None:
        """How far along that path [m]; None for point to point."""
        return None if self.length is None else self.fraction * self.length


@attrs.frozen(kw_only=True, eq=False)
class PlannedStage:
    """One stage, planned.

    Attributes:
        kind: of the trajectory.
        trajectory: of the joints, at rest at both ends, a whole number of servo periods long.
        length: of the path of the tool [m].
        certificate: what the motion keeps; None for point to point, which has no path, and for damped rates.
        deviation: upper bound of the distance of the tool from the path [m]; None for point to point.
        slowed: why it runs slower than asked, or empty.
        obstacle: what stopped the straight line; of a SPLINE what kept the arm from rounding its corners, so that it
            stops at every frame; None where there is nothing of the kind.
        detour: the detour, and its price; None where there is no obstacle, and of a SPLINE.
        goal: what it was planned for.
        unmet: the speeds of the tool that were asked for and that the limits of the arm do not allow; the first are
            those asked for, the second those that it reaches. None where the arm could do as asked.
        shaping: what was done against vibrations; None for nothing.
    """

    kind: StageKind
    trajectory: Trajectory
    length: float
    certificate: Certificate | None = None
    deviation: float | None = None
    slowed: str = ""
    obstacle: Obstacle | None = None
    detour: Detour | None = None
    goal: StageGoal | None = None
    unmet: tuple[ToolLimits, ToolLimits] | None = None
    shaping: StageShaping | None = None


class StageError(ArmwrightError, ValueError):
    """A stage cannot be made.

    Attributes:
        stage: which stage, from 0.
        obstacle: what stops it, and where.
    """

    def __init__(self, stage: int, obstacle: Obstacle) -> None:
        """Keep the obstacle; the text is its reason."""
        self.stage, self.obstacle = stage, obstacle
        super().__init__(obstacle.reason)


def plan(arm: AnyArm, q_start: ArrayLike, goals: Sequence[StageGoal], manner: Manner) -> list[PlannedStage]:
    """Plan the stages of one move, each beginning where the last one ended.

    A point-to-point stage has up to eight configurations to end in. The nearest comes first; when no straight line
    can go on from it, the next nearest is tried. What stops a line is bypassed, where ``manner`` asks for that, only
    when no configuration has straight lines for the whole move.

    Args:
        arm: any arm, or a compiled one, which plans faster; with a closed-form inverse all its configurations are
            known, without one those that are found.
        q_start: (n,) present joint positions.
        goals: the stages.
        manner: speed, deviation, servo period, detours.

    Returns:
        One planned stage per goal.

    Raises:
        FlatArcError: the positions of an arc are on one line.
        StageError: a stage cannot be made from any configuration; it names the first obstacle of the nearest one, on a
            straight line also where a detour was searched for in vain.
        InvalidValueError: speed or deviation are out of range.
        IncapableArmError: the arm cannot make such a motion, wherever it leads.
    """
    q = joint_array(q_start, solver_of(arm).arm.n, "q_start")
    try:
        return _plan(arm, q, goals, attrs.evolve(manner, around=None), 0)
    except StageError:
        if manner.around is None or not _worth_looking(arm, goals):
            raise
        try:
            return _plan(arm, q, goals, manner, 0)
        except StageError:
            pass
        raise


def _worth_looking(arm: AnyArm, goals: Sequence[StageGoal]) -> bool:
    """Whether there is a line that could be bypassed, and every pose can be taken in some configuration."""
    poses = [X for goal in goals for X in goal.poses]
    return any(goal.kind == "LINE" for goal in goals) and all(
        np.abs(X[:3, 3]).max() <= _FARTHEST and inverse(solver_of(arm).arm, X).allowed for X in poses
    )


def _plan(arm: AnyArm, q: Array, goals: Sequence[StageGoal], manner: Manner, number: int) -> list[PlannedStage]:
    if number == len(goals):
        return []
    errors: list[StageError] = []
    for candidate in _candidates(arm, q, goals[number], manner, number):
        stage = candidate if manner.tool is None else _with_tool_limits(arm, candidate, manner, manner.tool)
        try:
            following = _plan(arm, stage.trajectory(stage.trajectory.duration), goals, manner, number + 1)
            return [attrs.evolve(stage, goal=goals[number]), *following]
        except StageError as error:
            errors.append(error)
    raise errors[0]


def _with_tool_limits(arm: AnyArm, stage: PlannedStage, manner: Manner, tool: ToolLimits) -> PlannedStage:
    """Return a stage slowed so that the tool keeps its limits, with the speeds that the arm cannot reach."""
    model, trajectory = solver_of(arm).arm, stage.trajectory
    if not trajectory.duration:
        return stage
    factor = tool.slowing(model, trajectory)
    if factor > 1:
        slow, certificate = whole_ticks(trajectory.slowed(factor), manner.period), stage.certificate
        stretch = slow.duration / trajectory.duration
        certificate = None if certificate is None else certificate.retimed(stretch)
        stage = attrs.evolve(stage, trajectory=slow, certificate=certificate)
    reached = tool_peaks(model, stage.trajectory)
    speeds = limited_motion(model, stage.trajectory).peaks(1) / model.all_limits.speed
    too_fast = stage.kind != "PTP" and math.isfinite(tool.speed) and tool.speed > model.tool_speed
    at_limit = too_fast or bool(speeds.max() > _AT_LIMIT)
    # Where both are given, the one keeps the other from being reached.
    is_met = reached.speed > _REACHED * tool.speed or reached.rotation > _REACHED * tool.rotation
    asked = math.isfinite(tool.speed) or math.isfinite(tool.rotation)
    return attrs.evolve(stage, unmet=(tool, reached)) if asked and at_limit and not is_met else stage


def _candidates(arm: AnyArm, q: Array, goal: StageGoal, manner: Manner, number: int) -> Iterator[PlannedStage]:
    """Give the ways to make one stage, best first and one at least: one per configuration for PTP, else one."""
    poses = of_shape(goal.poses, (4, 4), "poses")
    far = np.abs(poses[:, :3, 3]).max(axis=-1)
    if far.max() > _FARTHEST:
        worst = int(far.argmax())
        raise StageError(number, _at_pose("reach", f"the pose is {far.max():.3g} m away", worst, poses[worst]))
    if goal.kind == "PTP" and len(poses) > 1:
        yield _past_configurations(arm, q, goal, manner, number)
        return
    if goal.kind == "PTP" and goal.joints is not None:
        for violation in violations_of(solver_of(arm).arm, goal.joints.tolist()):
            obstacle = _at_pose("limits", str(violation), 0, poses[0])
            raise StageError(number, attrs.evolve(obstacle, joint=violation.joint))
        yield _direct(arm, q, goal.joints, manner)
        return
    if goal.kind == "PTP":
        # Planned as they are asked for: nearly always the first one does.
        yield from (_direct(arm, q, end, manner) for end in _configurations(arm, poses[0], q, number))
        return
    if goal.kind == "ARC":
        yield _on_arc(arm, q, poses, manner, number)
        return
    path = Path(poses=np.concatenate([np.asarray(solver_of(arm).forward(q))[None], poses]))
    try:
        yield _along(arm, path, q, goal, manner)
    except PathError as error:
        obstacle = obstacle_on_path(arm, path, error)
        bypass = _bypass(arm, q, goal, manner, obstacle)
        if bypass is None:
            raise StageError(number, obstacle) from error
        yield bypass


def _past_configurations(arm: AnyArm, q: Array, goal: StageGoal, manner: Manner, number: int) -> PlannedStage:
    """Return the stage on which the joints go straight from configuration to configuration, past rounded corners."""
    points, blends = [q], np.broadcast_to(0.0 if goal.blend is None else goal.blend, len(goal.poses) - 1).tolist()
    distances: list[float] = []
    wanted = np.full((len(goal.poses), len(q)), np.nan) if goal.joints is None else goal.joints
    for pose, (X, joints) in enumerate(zip(goal.poses, wanted, strict=True)):
        try:
            end = _configurations(arm, X, points[-1], number)[0] if np.isnan(joints).any() else joints
        except StageError as error:
            raise StageError(number, attrs.evolve(error.obstacle, pose=pose)) from None
        for violation in violations_of(solver_of(arm).arm, end.tolist()):
            obstacle = _at_pose("limits", str(violation), pose, X)
            raise StageError(number, attrs.evolve(obstacle, joint=violation.joint))
        # A configuration that was there before is no corner.
        if np.abs(end - points[-1]).max() > _SAME_CONFIGURATION:
            points.append(end)
            distances.append(blends[pose] if pose < len(blends) else 0.0)
    corners = np.array(points)
    if len(corners) < 2:
        return PlannedStage(kind="PTP", trajectory=hold(q, 0.0), length=0.0)
    rounding = rounding_within(solver_of(arm), corners, np.array(distances[:-1]))
    motion = rounded_run(arm, corners, rounding, manner.speed).trajectory
    return PlannedStage(kind="PTP", trajectory=whole_ticks(motion, manner.period), length=tool_path_length(arm, motion))


def _on_arc(arm: AnyArm, q: Array, poses: Array, manner: Manner, number: int) -> PlannedStage:
    """Return the stage that follows an arc."""
    solver = solver_of(arm)
    through, end = poses
    try:
        try:
            motion = coarse_arc(arm, q, through, end, deviation=manner.deviation, speed=manner.speed, tool=manner.tool)
        except PathError:
            check_ends(solver, Path(poses=np.stack([np.asarray(solver.forward(q)), end])), q)
            raise
    except PathError as error:
        planned = arc(np.asarray(solver.forward(q)), through, end)
        # That the goal itself cannot be taken is said of the way to it.
        certain = error.fraction == 1 and not inverse(solver.arm, end).allowed
        segment = 1 if certain else error.segment
        part = planned.through if segment == 0 else 1 - planned.through
        obstacle = Obstacle(
            cause=error.cause,
            reason=error.reason,
            joint=error.joint,
            pose=segment,
            fraction=error.fraction,
            length=planned.length * part,
            place=planned.at(np.array(planned.part(segment, error.fraction)))[:3, 3],
            certain=certain,
        )
        raise StageError(number, obstacle) from error
    motion = motion.on_ticks(manner.period)
    certificate = motion.certificate
    return PlannedStage(
        kind="ARC",
        trajectory=motion.trajectory,
        length=tool_path_length(arm, motion.trajectory),
        certificate=certificate,
        deviation=certificate.deviation,
        slowed=certificate.slowed,
    )


def _along(arm: AnyArm, path: Path, q: Array, goal: StageGoal, manner: Manner) -> PlannedStage:
    """Return the stage that follows a path: a line, the report's spline, or rounded corners."""
    how = {"deviation": manner.deviation, "speed": manner.speed}
    stops, stopped_by = "", None
    if goal.kind == "LINE":
        try:
            motion = coarse_line(arm, q, path.poses[1], **how, tool=manner.tool)
        except PathError:
            check_ends(solver_of(arm), path, q)  # a goal that cannot be taken at all is said to be so
            raise
    elif goal.kind == "BLEND" or goal.corner is not None:
        run = rounded_move(arm, path, q, corner=goal.corner, blend=goal.blend, **how, tool=manner.tool)
        motion, stops, stopped_by = run.motion, run.stops, run.stopped_by
    else:
        motion = through(arm, path, q, **how)
    motion = motion.on_ticks(manner.period)
    return PlannedStage(
        kind=goal.kind,
        trajectory=motion.trajectory,
        length=_length(path.poses) if goal.kind == "LINE" else tool_path_length(arm, motion.trajectory),
        certificate=motion.certificate,
        deviation=motion.certificate.deviation,
        slowed=stops or motion.certificate.slowed,
        obstacle=None if stopped_by is None else obstacle_on_path(arm, path, stopped_by),
    )


def obstacle_on_path(arm: AnyArm, path: Path, error: PathError) -> Obstacle:
    """Return what stops the arm on a path, with its position."""
    ends = path.poses[error.segment : error.segment + 2]
    return Obstacle(
        cause=error.cause,
        reason=error.reason,
        joint=error.joint,
        pose=error.segment,
        fraction=error.fraction,
        length=_length(ends),
        place=path.at(error.segment, error.fraction)[:3, 3],
        certain=error.fraction == 1 and not inverse(solver_of(arm).arm, ends[1]).allowed,
    )


def _at_pose(cause: Cause, reason: str, pose: int, X: Array) -> Obstacle:
    """Return the obstacle that a pose itself is."""
    return Obstacle(cause=cause, reason=reason, pose=pose, fraction=1.0, place=X[:3, 3], certain=True)


def _bypass(arm: AnyArm, q: Array, goal: StageGoal, manner: Manner, obstacle: Obstacle) -> PlannedStage | None:
    """Return the stage that bypasses what stops a line; None where that is not asked for, or there is no path."""
    if manner.around is None or goal.kind != "LINE" or obstacle.certain:
        return None
    X, Y = solver_of(arm).forward(q), goal.poses[0]
    try:
        detour = line_or_detour(arm, q, Y, method=manner.around, deviation=manner.deviation, speed=manner.speed)
    except (PathError, IncapableArmError):
        # No path was found, or none on which the joints could hold the arm up.
        return None
    legs = joined(detour.legs).on_ticks(manner.period) if detour.legs else None
    trajectory = whole_ticks(detour.trajectory, manner.period)
    taken = detour.method != "line"
    corners = [X, Y] if detour.via is None else [X, detour.via, Y]
    deviation = 0.0 if legs is None else legs.certificate.deviation
    return PlannedStage(
        kind="LINE",
        trajectory=trajectory,
        length=_length(np.stack(corners)) if legs else tool_path_length(arm, trajectory),
        certificate=None if legs is None else legs.certificate,
        # The via pose is as far from the line as any position of the legs that meet in it.
        deviation=detour.price.distance + (deviation if taken else 0.0),
        slowed="" if legs is None else legs.certificate.slowed,
        obstacle=obstacle if taken else None,
        detour=detour if taken else None,
    )


def _length(poses: Array) -> float:
    """Return the length of the straight segments from pose to pose (k, 4, 4) [m]."""
    return float(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=-1).sum())


def tool_path_length(arm: AnyArm, trajectory: Trajectory) -> float:
    """Return the length of the path of the tool, sampled often enough for a smooth one [m]."""
    return _length(solver_of(arm).forward(trajectory(np.linspace(0.0, trajectory.duration, _LOOKS))))


def _configurations(arm: AnyArm, X: Array, q: Array, number: int) -> list[Array]:
    """Return the configurations inside the limits that reach a pose, revolutions included, nearest first."""
    solution = inverse(solver_of(arm).arm, X, q)
    if not solution.allowed:
        raise StageError(number, _at_pose(cause_of(solution), solution.explain(), 0, X))
    return nearest_configurations(solution, q)


def _direct(arm: AnyArm, q: Array, goal: Array, manner: Manner) -> PlannedStage:
    motion = point_to_point(solver_of(arm).arm, q, goal, manner.speed)
    return PlannedStage(kind="PTP", trajectory=whole_ticks(motion, manner.period), length=tool_path_length(arm, motion))
