"""MOVEs that would run into something are refused before they begin; those that rely on a stopped arm are stopped."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.plan import PlannedStage
from armwright.motion.trajectory import Trajectory, hold, join
from armwright.physics.planned_move import PlannedMove
from armwright.program.language.source import Span
from armwright.program.vm.machine import Machine, RunError
from armwright.program.vm.move_diagnostics import collision_advice, collision_location, collision_message
from armwright.program.vm.move_request import MoveRequest
from armwright.program.vm.process import Motion, PendingStage, Process, Threat

if TYPE_CHECKING:
    from armwright.physics.collisions import Collision, MoveCheck
    from armwright.physics.planner import PlannedPath

# A motion that has so little left is over [s].
_ROUNDING = 1e-9


def checked_stages(
    machine: Machine,
    process: Process,
    request: MoveRequest,
    arm: str,
    planned: Sequence[tuple[PlannedStage, tuple[str, ...]]],
) -> list[PendingStage]:
    """Return the stages of a MOVE without collisions, with their clearances.

    Raises:
        RunError: the arm would run into something.
    """
    period = machine.cell.period
    starts = np.cumsum([0, *(round(stage.trajectory.duration / period) for stage, _ in planned)]).tolist()
    stages = [
        PendingStage(stage, names, machine.state.ticks + start)
        for (stage, names), start in zip(planned, starts, strict=False)
    ]
    collisions = machine.collisions
    if collisions is None:
        return stages
    from armwright.program.vm.planned_paths import can_be_passed, replanned  # noqa: PLC0415 - of cells with bodies

    hand = machine.state.hands[arm]
    move = PlannedMove(
        arm=arm,
        stages=tuple(stage.trajectory for stage, _ in planned),
        goal_part=_goal_part(machine, arm, [stage.trajectory for stage, _ in planned]),
        after_force=hand.pressed,
        on_force=any(guard.reads_force for guard in request.guards),
    )
    done = replanned(
        machine,
        move,
        [stage for stage, _ in planned],
        partial(_path_past, machine, request.speed),
        partial(_check, machine),
        fixed_duration=request.duration is not None,
        tool=request.tool,
        smooth=request.form.smooth,
    )
    move, check = done.move, done.check
    if check.collision is not None:
        goal = request.goals[planned[check.collision.stage][1][-1]]
        can_plan = not request.form.smooth and can_be_passed(check.collision, done.stages[check.collision.stage])
        error = _error(machine, process, check.collision, arm, (goal.label, goal.span), can_plan=can_plan)
        raise _with_failure(error, done.failure) if done.failure else error
    parts = machine.hardware.part_poses()
    hand.beside = frozenset({move.goal_part} if move.goal_part else ()) | hand.beside - set(parts.held_by(arm))
    hand.pressed = move.on_force
    starts = np.cumsum([0, *(round(stage.trajectory.duration / period) for stage in done.stages)]).tolist()
    return [
        PendingStage(stage, names, machine.state.ticks + starts[k], check.clearances[k], done.paths.get(k))
        for k, (stage, (_, names)) in enumerate(zip(done.stages, planned, strict=True))
    ]


def refuse_collision(
    machine: Machine,
    process: Process,
    arm: str,
    trajectory: Trajectory,
    goal_at: tuple[str, Span],
    *,
    ahead: float = math.inf,
) -> None:
    """Look whether an arm that runs on along another path would run into something, as far ahead as is told [s].

    Raises:
        RunError: it would.
    """
    if machine.collisions is None:
        return
    hand = machine.state.hands[arm]
    goal_part = _goal_part(machine, arm, [trajectory])
    move = PlannedMove(
        arm=arm,
        stages=(trajectory.until(min(ahead, trajectory.duration)),),
        goal_part=goal_part,
        after_force=hand.pressed,
        on_force=False,
    )
    collision = _check(machine, move, clearances=False).collision
    if collision is not None:
        raise _error(machine, process, collision, arm, goal_at)
    held = machine.hardware.part_poses().held_by(arm)
    hand.beside, hand.pressed = frozenset({goal_part} if goal_part else ()) | hand.beside - set(held), False


def _path_past(machine: Machine, speed: float, move: PlannedMove, stage: int, goals: Array) -> PlannedPath:
    """Plan a path instead of a stage of a MOVE."""
    collisions = machine.collisions
    assert collisions is not None  # noqa: S101 - asked for only then
    others, beside = _surroundings(machine, move.arm)
    parts = machine.hardware.part_poses()
    return collisions.path_past(move, others, parts, beside, now=machine.now, stage=stage, goals=goals, speed=speed)


def _with_failure(error: RunError, failure: str) -> RunError:
    """Return an error that also says why no path past the obstacle was planned."""
    notes = (*error.diagnostic.notes, f"no path past it was planned: {failure}")
    return RunError(attrs.evolve(error.diagnostic, notes=notes), error.tree, error.time)


def _goal_part(machine: Machine, arm: str, stages: Sequence[Trajectory]) -> str | None:
    """Return the part that a MOVE goes to; an arm that holds one goes to no other."""
    parts = machine.hardware.part_poses()
    if not machine.cell.parts or parts.held_by(arm):
        return None
    end = machine.now + sum(stage.duration for stage in stages)
    X_WT = machine.base_pose(arm) @ forward(machine.cell.arms[arm].arm, stages[-1](stages[-1].duration))
    return parts.graspable(arm, X_WT, _carriers(machine, end))


def _carriers(machine: Machine, time: float) -> dict[str, Array]:
    """Return the poses of the hands now, and of the frames that move by themselves at a time [s]."""
    return {name: machine.gripper_pose(name) for name in machine.cell.arms} | machine.cell.moving_poses(time)


def _check(machine: Machine, move: PlannedMove, *, clearances: bool = True) -> MoveCheck:
    """Check a motion of an arm for collisions, from now on."""
    collisions = machine.collisions
    assert collisions is not None  # noqa: S101 - asked for only then
    others, beside = _surroundings(machine, move.arm)
    return collisions.check(move, others, machine.hardware.part_poses(), beside, now=machine.now, clearances=clearances)


def _surroundings(machine: Machine, arm: str) -> tuple[dict[str, Trajectory], dict[str, frozenset[str]]]:
    """Return what all other arms do from now on, and the parts that the fingers of each arm may touch."""
    others = {name: _course(machine, name) for name in machine.cell.arms if name != arm}
    return others, {name: hand.beside for name, hand in machine.state.hands.items()}


def _course(machine: Machine, arm: str) -> Trajectory:
    """Return what an arm does from now on, as far as that is known: the stage it is on, and those after it."""
    rest = _rest_of_stage(machine, arm)
    parts = [] if rest is None else [rest]
    mover = machine.moving_process(arm)
    if mover is not None and mover.motion is not None and mover.motion.rest_tick is None:
        parts += [stage.planned.trajectory for stage in mover.motion.stages]
    return join(parts) if parts else hold(machine.hardware.sent_configuration(arm, machine.now), 0.0)


def _rest_of_stage(machine: Machine, arm: str) -> Trajectory | None:
    """Return the rest of the motion of an arm; None where it is at rest."""
    runs = machine.state.segments[arm]
    if not runs or machine.now - runs[-1].t0 >= runs[-1].duration - _ROUNDING:
        return None
    return runs[-1].trajectory.after(max(0.0, machine.now - runs[-1].t0))


def note_released(machine: Machine, held: dict[str, tuple[str, ...]]) -> None:
    """Let the fingers touch the parts that they have just released.

    Args:
        machine: that runs the program.
        held: what each arm held before.
    """
    parts = machine.hardware.part_poses()
    for name, before in held.items():
        hand = machine.state.hands[name]
        hand.beside |= set(before) - set(parts.held_by(name))


def held_parts(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Return what each arm holds."""
    parts = machine.hardware.part_poses()
    return {name: parts.held_by(name) for name in machine.cell.arms if machine.cell.parts}


# ---- what has changed meanwhile ------------------------------------------------------------------------------------


def check_late_stage(machine: Machine, process: Process, motion: Motion) -> None:
    """See whether the rest of a MOVE is still clear where its next stage begins at another time than was planned.

    Raises:
        RunError: it is not.
    """
    if machine.collisions is None or motion.stages[0].start_tick == machine.state.ticks:
        return
    stages = [stage.planned.trajectory for stage in motion.stages]
    check = _check(machine, _rest_of_move(machine, motion, stages), clearances=False)
    if check.collision is not None:
        goal = motion.stages[check.collision.stage].goal_names[-1]
        raise _error(machine, process, check.collision, motion.arm, (goal, motion.span))


def check_others(machine: Machine, stopped: str) -> None:
    """Find the moving arms that would run into one that has been stopped, or is late; they are stopped too.

    What an arm that is being stopped runs over on its path was looked at before: its stop keeps to that path.
    """
    if machine.collisions is None:
        return
    moving = [process.motion for process in machine.state.processes if process.motion is not None]
    # Others go on along their queues, or with frames, while their processes do other things.
    for motion in (*(it for it in moving if it.rest_tick is None), *machine.state.following.values()):
        if motion.arm == stopped or motion.threat is not None:
            continue
        rest = _rest_of_stage(machine, motion.arm)
        stages = [*([] if rest is None else [rest]), *(stage.planned.trajectory for stage in motion.stages)]
        if not stages:
            continue
        collision = _check(machine, _rest_of_move(machine, motion, stages), clearances=False).collision
        if collision is not None and collision.other_arm == stopped:
            motion.threat = Threat(machine.state.ticks, collision, stopped)


def _rest_of_move(machine: Machine, motion: Motion, stages: Sequence[Trajectory]) -> PlannedMove:
    """Return the rest of a MOVE that is running, whose fingers and tool may touch what they may touch all the time."""
    on_force = any(guard.reads_force for guard in motion.guards)
    return PlannedMove(
        arm=motion.arm,
        stages=tuple(stages),
        goal_part=_goal_part(machine, motion.arm, stages),
        on_force=on_force or machine.state.hands[motion.arm].pressed,
    )


def threatened_error(machine: Machine, process: Process, motion: Motion) -> RunError:
    """Return the error of a MOVE that would run into an arm which was stopped on its path."""
    threat = motion.threat
    assert threat is not None  # noqa: S101 - asked for only then
    motion.threat = None
    goal = motion.stages[-1].goal_names[-1] if motion.stages else motion.goal
    error = _error(machine, process, threat.collision, motion.arm, (goal, motion.span))
    note = f"{threat.stopped} was to be elsewhere by then, but it has been stopped"
    diagnostic = attrs.evolve(error.diagnostic, notes=(*error.diagnostic.notes, note))
    return RunError(diagnostic, error.tree, error.time)


def _error(
    machine: Machine,
    process: Process,
    collision: Collision,
    arm: str,
    goal_at: tuple[str, Span],
    *,
    can_plan: bool = False,
) -> RunError:
    """Return the error of a MOVE of an arm that would run into something on its way to a goal, called so there."""
    goal, span = goal_at
    plan_advice = ["`armwright run --plan` looks for a path past it"] if can_plan and not machine.cell.plan else []
    frame = next((name for name in machine.state.tree if machine.spelling(name) == goal), None)
    return machine.error(
        process,
        "E406",
        collision_message(collision, goal, arm),
        span,
        "cannot be reached on this path",
        secondary=machine.origin_labels(frame, f"`{goal}` got its pose here") if frame else [],
        notes=collision_location(collision, machine.now),
        helps=[*collision_advice(collision, arm), *plan_advice],
    )
