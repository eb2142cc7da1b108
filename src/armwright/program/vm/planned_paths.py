"""Paths past other bodies, planned where a point-to-point stage of a MOVE would run into one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.compiled.arm import planning_arm
from armwright.errors import IncapableArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import nearest_configurations
from armwright.motion.plan import PlannedStage, tool_path_length
from armwright.motion.tool_limits import ToolLimits
from armwright.motion.trajectory import Trajectory, whole_ticks
from armwright.physics.collisions import Collision, MoveCheck
from armwright.physics.planned_move import PlannedMove
from armwright.physics.planner import PlannedPath, PlanningError
from armwright.program.vm.machine import Machine

# Configurations nearer than this are the same [rad] or [m].
_SAME = 1e-6


class Replanned(NamedTuple):
    """A MOVE, some stages of which lead past other bodies.

    Attributes:
        move: the MOVE.
        stages: its stages.
        paths: by number of the stage, from 0, the path that was planned for it.
        check: what it still runs into.
        failure: why no path past that was planned; empty where none was looked for.
    """

    move: PlannedMove
    stages: Sequence[PlannedStage]
    paths: Mapping[int, PlannedPath]
    check: MoveCheck
    failure: str = ""


def replanned(
    machine: Machine,
    move: PlannedMove,
    stages: Sequence[PlannedStage],
    plan: Callable[[PlannedMove, int, Array], PlannedPath],
    check: Callable[[PlannedMove], MoveCheck],
    *,
    fixed_duration: bool,
    tool: ToolLimits | None = None,
    smooth: bool = False,
) -> Replanned:
    """Return a MOVE with planned paths instead of the point-to-point stages on which it runs into something.

    Args:
        machine: that runs the program.
        move: the MOVE.
        stages: its stages.
        plan: plans a path instead of a stage to one of several configurations.
        check: finds what a MOVE runs into.
        fixed_duration: whether no stage may take longer than it does.
        tool: limits of the tool besides those of the joints.
        smooth: whether the stages are shaped, so that no other path is planned: its corners would not be.
    """
    done = Replanned(move, stages, {}, check(move))
    while machine.cell.plan and not smooth and (collision := done.check.collision) is not None:
        k = collision.stage
        if k in done.paths or not can_be_passed(collision, done.stages[k]):
            break
        old = done.stages[k].trajectory
        try:
            path = plan(done.move, k, _goals(machine, move.arm, old, last=_is_free(done.stages, k)))
        except (PlanningError, IncapableArmError) as error:
            return done._replace(failure=str(error))
        motion = _within_tool_limits(machine, move.arm, path.trajectory, tool)
        if fixed_duration and motion.duration > old.duration:
            failure = f"a path that was planned past it takes {motion.duration:.3f} s, not {old.duration:.3f} s"
            return done._replace(failure=failure)
        if fixed_duration:
            motion = motion.retimed(old.duration)
        length = tool_path_length(planning_arm(machine.cell.arms[move.arm].arm), motion)
        new = [*done.stages]
        new[k] = attrs.evolve(new[k], trajectory=motion, length=length)
        moved = attrs.evolve(done.move, stages=tuple(stage.trajectory for stage in new))
        done = Replanned(moved, new, {**done.paths, k: path}, check(moved))
    return done


def _within_tool_limits(machine: Machine, arm: str, motion: Trajectory, tool: ToolLimits | None) -> Trajectory:
    """Return a motion slowed so that the tool keeps its limits."""
    factor = 1.0 if tool is None else tool.slowing(machine.cell.arms[arm].arm, motion)
    return whole_ticks(motion.slowed(factor), machine.cell.period) if factor > 1 else motion


def _is_free(stages: Sequence[PlannedStage], number: int) -> bool:
    """Whether a stage may end in any configuration that takes its pose: it is the last, and JOINTS asks for none."""
    goal = stages[number].goal
    return number == len(stages) - 1 and (goal is None or goal.joints is None)


def can_be_passed(collision: Collision, stage: PlannedStage) -> bool:
    """Whether a path past what a stage runs into may be planned."""
    is_one = stage.goal is None or len(stage.goal.poses) == 1
    return stage.kind == "PTP" and is_one and not (collision.at_start or collision.at_rest)


def _goals(machine: Machine, arm: str, old: Trajectory, *, last: bool) -> Array:
    """Return the configurations (k, n) that a stage may end at: the stages after it begin where they were to begin."""
    end = old(old.duration)
    if not last:
        return end[None]
    model = machine.cell.arms[arm].arm
    others = nearest_configurations(inverse(model, forward(model, end), old(0.0)), old(0.0))
    return np.stack([end, *(q for q in others if np.abs(q - end).max() > _SAME)])
