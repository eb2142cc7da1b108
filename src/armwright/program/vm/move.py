"""MOVE at work: planning its stages, following them tick by tick, and its guards."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NoReturn

import attrs
import numpy as np

from armwright.arm.reach import reach_of
from armwright.arrays import Array
from armwright.compiled.arm import planning_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import IncapableArmError, counted
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.arc import FlatArcError
from armwright.motion.plan import Manner, Obstacle, PlannedStage, StageError, StageGoal, plan
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.trajectory import Trajectory, hold, slowed_together, whole_ticks
from armwright.program.bytecode.instructions import (
    MOVE_PARTS,
    Instruction,
    MotionKind,
    Op,
    StagePlan,
    stages_of,
    stages_text,
)
from armwright.program.language.diagnostic import Label
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.language.words import Standard
from armwright.program.vm.calls import evaluate_instructions
from armwright.program.vm.collisions import check_late_stage, checked_stages
from armwright.program.vm.contact import (
    contact_report,
    record_contact,
    refuse_contact,
    rest_tick,
    send_trajectory,
    stop_arm,
    update_depth_alarm,
)
from armwright.program.vm.corrections import begin_correction, correct, finish_correction, side_of, with_room
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.move_diagnostics import CODES, detour_advice, obstacle_location, obstacle_message
from armwright.program.vm.move_request import Goal, MoveRequest, move_request
from armwright.program.vm.moves_ahead import fits, goes_over, merged
from armwright.program.vm.process import EarlyEnd, Guard, Interruption, Motion, MovesAhead, Process
from armwright.program.vm.queues import require_no_queue
from armwright.program.vm.recording import RunStage, TrajectorySegment, peak_efforts, trajectory_efforts
from armwright.program.vm.smoothing import smoothed_stages
from armwright.program.vm.synchronization import release_locks
from armwright.program.vm.tracking import follow, leave_frame, plan_tracking, rest_of_following, stop_following
from armwright.spatial.poses import inverse

# A pose this many times farther than the arm reaches was probably typed in another unit.
_WRONG_UNIT_FACTOR = 50.0
# A gripper that closed on a frame still stands at it when both are so near [m], and entries of rotations.
_SAME_POSE = 1e-6
# Planning a MOVE takes as long as so many steps of other kinds, whether it can be made or not.
_STEPS_PER_MOVE = 1000


def move(machine: Machine, process: Process, step: Instruction) -> None:
    """Plan a MOVE and begin its first stage; in the action of a MOVE, when that one has come to rest."""
    if process.motion is not None and not _finish_enclosing_move(machine, process, process.motion, step.span):
        return
    if process.interruption is not None and (rest := rest_tick(machine, process.last_arm)) > machine.state.ticks:
        # It interrupts a process whose arm still brakes after an error.
        process.pc, process.wake_tick = process.pc - 1, rest
        return
    request = move_request(machine, process, step)
    moved = machine.resolve_name(process, request.begin.operands[0])
    arm, implied = _carrier(machine, process, moved, request.begin)
    machine.claim_arm(process, arm, step.span, moved)
    require_no_queue(machine, process, arm, step.span)
    _require_idle_arm(machine, process, arm, step.span)
    if arm in machine.state.following and request.tracked is None:
        stop_following(machine, process, arm, step.span)
    if (rest := rest_tick(machine, arm)) > machine.state.ticks:
        process.pc, process.wake_tick = process.pc - 1, rest
        return
    if process.ahead is not None or goes_over(request):
        ahead = process.ahead or MovesAhead(arm=arm, moved=moved, implied_affix=implied)
        _put_ahead(machine, process, ahead, request, moved)
        return
    _begin_move(machine, process, request, arm, moved, implied=implied)


def _put_ahead(machine: Machine, process: Process, ahead: MovesAhead, request: MoveRequest, moved: str) -> None:
    """Let a MOVE wait for the next one, which it goes over into; begin them all where this is the last of them."""
    if ahead.requests and not fits(ahead, request, moved):
        # When they are at rest the same instruction is looked at again.
        process.pc -= 1
        begin_moves_ahead(machine, process, ahead)
        return
    arm, goal = ahead.arm, request.goals[request.form.goal]
    X_BW, X_MH = inverse(machine.base_pose(arm)), inverse(machine.state.tree.relation(moved, arm))
    joints = _goal_joints(machine, process, request, arm)
    if joints is None:
        X_BH = X_BW @ _goal_pose(machine, process, goal) @ X_MH
        # What its operand names may be another thing when the MOVE begins.
        goal = goal._replace(operand=machine.variable_name(process, goal.operand) or "")
    else:
        X_BH = forward(machine.cell.arms[arm].arm, joints)
        goal = goal._replace(operand="")
    request = request._replace(goals={request.form.goal: goal})
    ahead = attrs.evolve(
        ahead, requests=(*ahead.requests, request), poses=(*ahead.poses, X_BH), joints=(*ahead.joints, joints)
    )
    if goes_over(request):
        process.ahead = ahead
        # What is worked out before the arm is there takes it for being there.
        reached = machine.state.tree.set_pose(arm, machine.base_pose(arm) @ X_BH)
        machine.replace_tree(reached, arm, request.span)
    else:
        begin_moves_ahead(machine, process, ahead)


def begin_moves_ahead(machine: Machine, process: Process, ahead: MovesAhead) -> None:
    """Begin the MOVEs that have waited for the next one, as one path that stops at its end."""
    process.ahead = None
    machine.update_hand_pose(ahead.arm, ahead.requests[0].span)
    request = merged(ahead)
    _begin_move(machine, process, request, ahead.arm, ahead.moved, implied=ahead.implied_affix)


def _begin_move(
    machine: Machine, process: Process, request: MoveRequest, arm: str, moved: str, *, implied: bool
) -> None:
    """Plan a MOVE and begin its first stage."""
    machine.state.idle_steps += _STEPS_PER_MOVE
    tracking = None
    if request.tracked is not None:
        stage, tracking = plan_tracking(machine, process, request, (arm, moved), planner_of(machine, arm))
        planned: list[tuple[PlannedStage, tuple[str, ...]]] = [(stage, (request.form.goal,))]
    else:
        planned = _plan_stages(machine, process, request, arm, moved)
    correction = request.correction
    if correction is not None:
        ((stage, names),) = planned
        side = side_of(machine, process, arm, stage, request.span)
        correction = attrs.evolve(correction, side=side)
        planned = [(with_room(machine, stage, request.duration), names)]
    stages = checked_stages(machine, process, request, arm, planned)
    spelled = machine.spelling(moved)
    subject = arm if moved == arm else f"{arm} [{spelled}]"
    speed_text = f"@{request.speed:g}" if request.duration is None else f"in {request.duration:g} s"
    if request.tool is not None and math.isfinite(request.tool.speed):
        speed_text = f"@{request.tool.speed * 1e3:g} mm/s"
    process.motion = Motion(
        arm=arm,
        moved=moved,
        X_HM=machine.state.tree.relation(moved, arm),
        span=request.span,
        text=f"{subject} MOVE: {stages_text(request.form).replace(' / ', '; ')} {speed_text}",
        goal=_goal_name(machine, process, request),
        implied_affix=implied,
        stages=stages,
        paths=tuple(stage.path for stage in stages if stage.path is not None),
        speed=request.speed,
        stack_depth=len(process.stack),
        start=machine.next_start(),
        guards=request.guards,
        tracking=tracking,
        correction=correction,
    )
    start_stage(machine, process, process.motion)


def advance_motion(machine: Machine, process: Process) -> None:
    """Follow a motion at a tick at which something may happen: a guard, the end of a stage, the end of the MOVE."""
    motion = process.motion
    assert motion is not None  # noqa: S101 - asked for only then
    for guard in motion.guards:
        if not guard.triggered and _condition_holds(machine, process, motion, guard):
            guard.triggered = True
            machine.update_hand_pose(motion.arm, motion.span)
            fields = {"return_address": process.pc, "call_span": motion.span, "lock_count": len(process.locks)}
            process.stack.append(process.activation.create_nested("action", **fields))
            process.pc = guard.action
            return
    due = motion.stage_end_tick
    # An arm that was stopped is corrected no more.
    if motion.correction is not None and motion.rest_tick is None:
        correct(machine, process, motion)
        due = min(motion.stage_end_tick, motion.correction.tick)
    if machine.state.ticks < motion.stage_end_tick:
        is_guarded = not all(guard.triggered for guard in motion.guards)
        process.wake_tick = machine.state.ticks + 1 if is_guarded else due
    elif motion.stages:
        start_stage(machine, process, motion)
    else:
        finish_move(machine, process, motion)


def halt_motion(machine: Machine, process: Process, step: Instruction) -> None:
    """End the motion from inside an action: the arm stops under control, and the MOVE is over."""
    motion, action = process.motion, process.stack.pop()
    assert action.kind == "action"  # noqa: S101 - procedures that it called have been left
    release_locks(machine, process, action.lock_count)
    process.forget_watches()
    process.pc = action.return_address
    if motion is None:
        # An error has stopped the arm before, and a TRY in the action has gone on from there.
        return
    stop_motion(machine, process, motion, step.span)


def stop_motion(machine: Machine, process: Process, motion: Motion, span: Span) -> None:
    """End a motion before its goal: its arm comes to rest, or is at rest already."""
    motion.stage_end_tick = process.wake_tick = stop_arm(machine, process, span)
    motion.stages, motion.guards = [], []
    motion.early_end = EarlyEnd.HALTED


def brake_motion(machine: Machine, process: Process, interruption: Interruption, span: Span) -> None:
    """Bring the arm of a MOVE that a WHEN has interrupted to rest on its path, and let the process wait for that."""
    motion = process.motion
    assert motion is not None  # noqa: S101 - asked for only then
    if motion.rest_tick is None:
        end = stop_arm(machine, process, span)
        interruption.braked = True
        machine.record_effect(process, "BRAKE", f"{motion.arm} BRAKE", span, until=end, arm=motion.arm)
    assert motion.rest_tick is not None  # noqa: S101 - it is being stopped
    process.wake_tick = max(machine.state.ticks, motion.rest_tick)


def _finish_enclosing_move(machine: Machine, process: Process, motion: Motion, span: Span) -> bool:
    """Whether another MOVE can begin in an action: the arm is at rest, and the MOVE around it over or put aside."""
    if (interruption := process.interruption_of(motion)) is not None:
        brake_motion(machine, process, interruption, span)
        if process.wake_tick > machine.state.ticks:
            process.pc -= 1
            return False
        interruption.motion, process.motion = motion, None
        return True
    if motion.early_end is EarlyEnd.HALTED:
        finish_move(machine, process, motion)
        return True
    stop_motion(machine, process, motion, span)
    # When the arm is at rest the same instruction is looked at again.
    process.pc -= 1
    return False


# ---- planning ------------------------------------------------------------------------------------------------------


def _goal_name(machine: Machine, process: Process, request: MoveRequest) -> str:
    """Return the frame that a MOVE goes to, or the expression of it."""
    if request.joints is not None:
        return request.form.goal
    if request.fixed:
        return str(request.goals[request.form.goal].operand) or request.form.goal
    return machine.variable_name(process, request.begin.operands[1]) or request.form.goal


def _carrier(machine: Machine, process: Process, moved: str, begin: Instruction) -> tuple[str, bool]:
    """Return the arm that carries what is moved, and whether it hangs there only from now on."""
    if is_arm(moved):
        return moved, False
    machine.slot_value(process, moved, begin.span)
    for name in machine.state.following:
        machine.update_frame(process, name)
    if (arm := machine.carrier(moved)) is not None:
        return arm, False
    X_WM = machine.state.tree.world(moved)
    for name, hand in machine.state.hands.items():
        if hand.held_frame == moved and np.allclose(machine.state.tree.world(name), X_WM, rtol=0, atol=_SAME_POSE):
            machine.replace_tree(machine.state.tree.affix(moved, name), moved, begin.span)
            return name, True
    spelled, likely = machine.spelling(moved), process.last_arm or min(machine.cell.arms, default="ARM_1")
    parent = next(iter(machine.state.tree.ancestors(moved)), None)
    text = f"`{spelled}` cannot be moved: it is not affixed to an arm"
    attached = f"is attached to {machine.spelling(parent)}, not to an arm" if parent else "is the root of all frames"
    origins = machine.origin_labels(moved, f"{spelled} got its pose here")
    helps = [f"grasp it and write `AFFIX {spelled} TO {likely}`"]
    raise machine.error(process, "E301", text, begin.span, attached, secondary=origins, helps=helps)


def _require_idle_arm(machine: Machine, process: Process, arm: str, span: Span) -> None:
    """See to it that no process around this one is in the middle of a MOVE of the same arm, with an action of that.

    Raises:
        RunError: one is.
    """
    if (other := machine.moving_process(arm)) is not None and other.motion is not None:
        text = f"{arm} cannot begin a MOVE in {process.title} before that of {other.title} is over"
        on_its_way = Label(other.motion.span, f"{arm} executes this MOVE")
        raise machine.error(process, "E503", text, span, "begins before the other has ended", secondary=[on_its_way])


def _plan_stages(
    machine: Machine, process: Process, request: MoveRequest, arm: str, moved: str
) -> list[tuple[PlannedStage, tuple[str, ...]]]:
    """Return the stages of a MOVE with the names of where they lead.

    Source:
        TR-83-008, third paper: ARM-1' = Base^-1 f2 f1^-1, where f1 is the relation from the arm to it.
    """
    cell, cell_arm = machine.cell, machine.cell.arms[arm]
    corner = cell.corner_deviation if machine.code.standard is Standard.RLO_2 else None
    plans = stages_of(request.form)
    X_BW = inverse(machine.base_pose(arm))
    X_MH = inverse(machine.state.tree.relation(moved, arm))
    joints = _goal_joints(machine, process, request, arm)

    def pose(label: str) -> Array:
        if label in request.fixed:
            return request.fixed[label]
        if joints is not None and label == request.form.goal:
            return forward(cell_arm.arm, joints)
        return X_BW @ _goal_pose(machine, process, request.goals[label]) @ X_MH

    goals = [
        StageGoal(
            kind=legs.kind.value,
            poses=np.stack([pose(label) for label in legs.frames]),
            joints=_stage_joints(request, joints, legs.frames, cell_arm.arm.n),
            blend=request.blend,
            corner=corner if legs.kind is MotionKind.SPLINE else None,
        )
        for legs in plans
    ]
    manner = Manner(
        speed=request.speed,
        deviation=cell.deviation,
        period=cell.period,
        around=cell.around if _has_detours(request) else None,
        tool=request.tool,
    )
    try:
        stages = plan(planner_of(machine, arm), machine.hardware.sent_configuration(arm, machine.now), goals, manner)
    except StageError as error:
        _fail_move(machine, process, error.obstacle, request=request, stage=plans[error.stage], arm=arm)
    except FlatArcError as error:
        text = f"no arc leads through `{request.form.via[0]}` to `{request.form.goal}`: they are on one line"
        helps = ["choose a frame to pass that is farther off the line, or write STRAIGHTLY instead"]
        raise machine.error(process, "E407", text, request.span, "no arc", notes=[str(error)], helps=helps) from None
    except IncapableArmError as error:
        text = f"{arm} cannot make this MOVE at any speed: {error}"
        raise machine.error(process, "E406", text, request.span, "asked for here") from None
    if request.form.smooth and any(stage.trajectory.duration for stage in stages):
        stages = smoothed_stages(machine, process, request, stages, arm=arm, planner=planner_of(machine, arm))
    elif request.duration is not None:
        stages = _slow_to_duration(machine, process, request, stages, request.duration)
    return [(stage, legs.frames) for stage, legs in zip(stages, plans, strict=True)]


def planner_of(machine: Machine, arm: str) -> AnyArm:
    """Return what a MOVE is planned with: the functions of the arm, and the efforts of what it holds as well."""
    own, loaded = machine.cell.arms[arm].arm, machine.loaded_arm(arm)
    if loaded is own:
        return planning_arm(own)
    return solver_of(planning_arm(own))._replace(arm=loaded, inverse_dynamics=partial(inverse_dynamics, loaded))


def _stage_joints(request: MoveRequest, joints: Array | None, frames: Sequence[str], count: int) -> Array | None:
    """Return the joint positions that a stage goes to, (n,) or past several frames (k, n); None for none."""
    if not request.fixed_joints:
        return joints if request.form.goal in frames else None
    rows = np.array([request.fixed_joints.get(label, np.full(count, np.nan)) for label in frames])
    return rows if len(frames) > 1 else rows[0]


def _goal_joints(machine: Machine, process: Process, request: MoveRequest, arm: str) -> Array | None:
    """Return the joint positions (n,) that a MOVE goes to; None where it goes to a frame.

    Raises:
        RunError: they do not fit the arm.
    """
    asked, span = request.joints, request.goals[request.form.goal].span
    model, targets = machine.cell.arms[arm].arm, machine.cell.joint_targets
    if asked is None:
        return None
    if isinstance(asked, str):
        if asked not in targets:
            known = [f"joint targets of the cell: {', '.join(sorted(targets)) or 'none'}"]
            text = f"the cell has no joint target `{machine.spelling(asked)}`"
            raise machine.error(process, "E246", text, span, "no such joint target", notes=known)
        if targets[asked].arm != arm:
            text = f"joint target `{machine.spelling(asked)}` is one of {targets[asked].arm}, not of {arm}"
            raise machine.error(process, "E246", text, span, "of another arm")
        return targets[asked].q
    if len(asked) != model.n:
        text = f"{arm} has {counted(model.n, 'joint')}, but JOINTS is given {len(asked)}"
        raise machine.error(process, "E246", text, span, f"expected {model.n} positions")
    units = machine.code.units
    return np.asarray(np.where(model.revolute, units.radians, units.metres) * np.array(asked))


def _goal_pose(machine: Machine, process: Process, goal: Goal) -> Array:
    return machine.read_pose(process, goal.operand, goal.span)


def _slow_to_duration(
    machine: Machine, process: Process, request: MoveRequest, stages: Sequence[PlannedStage], duration: float
) -> list[PlannedStage]:
    """Return the stages slowed so that the whole MOVE takes as long as was asked for."""
    shortest = sum(stage.trajectory.duration for stage in stages)
    if duration < shortest - machine.cell.period:
        text = f"this MOVE is infeasible in {duration:g} s"
        raise machine.error(process, "E405", text, request.span, f"it takes {shortest:.3f} s or more")
    if not shortest:
        # Nothing is to be moved: the arm stands still for so long.
        rest = hold(stages[0].trajectory(0.0), duration)
        return [attrs.evolve(stages[0], trajectory=whole_ticks(rest, machine.cell.period)), *stages[1:]]
    slow = slowed_together([stage.trajectory for stage in stages], duration, machine.cell.period)
    # What kept a stage slow does so no more where it is to take longer.
    longer = duration > shortest + machine.cell.period
    return [_retime_stage(stage, trajectory, longer=longer) for stage, trajectory in zip(stages, slow, strict=True)]


def _retime_stage(stage: PlannedStage, slow: Trajectory, *, longer: bool) -> PlannedStage:
    """Return a stage run as long as was asked for; no limit slows it where that is longer."""
    certificate = stage.certificate
    if certificate is not None and slow.duration:
        certificate = certificate.retimed(slow.duration / stage.trajectory.duration)
        certificate = attrs.evolve(certificate, factor=1.0, because=None) if longer else certificate
    unmet = None if longer else stage.unmet
    slowed = "" if longer else stage.slowed
    return attrs.evolve(stage, trajectory=slow, slowed=slowed, certificate=certificate, unmet=unmet)


def _has_detours(request: MoveRequest) -> bool:
    """Whether straight lines of a MOVE may be bypassed: they are corrected and shaped, and detours are not."""
    return request.correction is None and not request.form.smooth


def _fail_move(
    machine: Machine, process: Process, obstacle: Obstacle, *, request: MoveRequest, stage: StagePlan, arm: str
) -> NoReturn:
    label = stage.frames[min(obstacle.pose, len(stage.frames) - 1)]
    goal, kind = request.goals[label], stage.kind.value
    is_frame = not request.fixed and (request.joints is None or label != request.form.goal)
    frame = machine.variable_name(process, goal.operand) if is_frame else None
    secondary = machine.origin_labels(frame, f"`{label}` got its pose here") if frame else []
    raise machine.error(
        process,
        CODES[obstacle.cause],
        obstacle_message(obstacle, label, arm, machine.cell.arms[arm].arm),
        goal.span,
        "cannot be reached",
        secondary=secondary,
        notes=(obstacle_location(obstacle, kind, stage.frames, arm),),
        helps=(
            *(_unit_advice(machine, process, goal, arm) if is_frame else ()),
            *detour_advice(obstacle, kind, machine.cell.around, bypassed=_has_detours(request)),
        ),
    )


def _unit_advice(machine: Machine, process: Process, goal: Goal, arm: str) -> tuple[str, ...]:
    """Say what lengths are counted in, where a pose so far off can only be meant in another unit."""
    X_BW = inverse(machine.base_pose(arm))
    distance = np.linalg.norm((X_BW @ _goal_pose(machine, process, goal))[:3, 3])
    if distance <= _WRONG_UNIT_FACTOR * reach_of(machine.cell.arms[arm].arm):
        return ()
    unit = {"M": "metres", "MM": "millimetres", "CM": "centimetres", "IN": "inches"}[machine.code.units.length]
    return (f"`{goal.label}` is {distance:.4g} m away: lengths in this program are {unit}",)


# ---- meanwhile ----------------------------------------------------------------------------------------------------


def start_stage(machine: Machine, process: Process, motion: Motion) -> None:
    """Begin the next stage of a motion."""
    check_late_stage(machine, process, motion)
    (stage, goal_names, _, clearance, path, motion.course), period = motion.stages.pop(0), machine.cell.period
    arm, trajectory = machine.cell.arms[motion.arm].arm, stage.trajectory
    ticks = round(trajectory.duration / period)
    if motion.stage_index >= 0:
        record_contact(machine, motion)
    push = send_trajectory(machine, motion, trajectory)
    counted = machine.ticks_run(trajectory.duration)
    tau = trajectory_efforts(machine.loaded_arm(motion.arm), trajectory, period, push, counted)
    update_depth_alarm(machine, motion)
    touch = machine.hardware.contact_time(motion.arm)
    if not motion.guards and (touch is not None or motion.alarm_tick is not None):
        pressed = machine.hardware.peak_contact(motion.arm, machine.now + trajectory.duration)
        send_trajectory(machine, motion, rest_of_following(machine, motion.arm) or hold(trajectory(0.0), period))
        motion.alarm_tick = None
        refuse_contact(machine, process, motion, goal_names[-1], pressed)
    if touch is not None:
        motion.first_contact = (trajectory, touch - machine.now)
    leave_frame(machine, motion.arm)
    motion.stage_index, (peak, when) = len(machine.state.stages), peak_efforts(arm, tau, period)
    machine.state.stages.append(
        RunStage(
            t0=machine.now,
            arm=motion.arm,
            span=motion.span,
            goal_names=goal_names,
            speed=motion.speed,
            stage=stage,
            motion=trajectory,
            length=stage.length,
            peak_effort=peak,
            peak_time=when,
            clearance=clearance,
            path=path,
        )
    )
    run = TrajectorySegment(t0=machine.now, trajectory=trajectory, duration=trajectory.duration, tau=tau)
    machine.state.segments[motion.arm].append(run)
    # Who tracks a frame is there before the motion ends, and follows it then.
    lasts = ticks if motion.tracking is None else motion.tracking.reached
    motion.stage_start_tick, motion.stage_end_tick = machine.state.ticks, machine.state.ticks + lasts
    if any(guard.reads_pose for guard in motion.guards):
        motion.hand_poses = machine.base_pose(motion.arm) @ forward(arm, trajectory(np.arange(counted + 1) * period))
    process.wake_tick = machine.state.ticks if motion.guards else motion.stage_end_tick
    if motion.correction is not None:
        begin_correction(machine, motion)
        process.wake_tick = machine.state.ticks


def _condition_holds(machine: Machine, process: Process, motion: Motion, guard: Guard) -> bool:
    """Whether the condition of a guard holds now, with the arm where it is now."""
    tree, activation = machine.state.tree, process.activation
    if guard.reads_pose and len(motion.hand_poses):
        index = min(machine.state.ticks - motion.stage_start_tick, len(motion.hand_poses) - 1)
        machine.state.tree = tree.set_pose(motion.arm, motion.hand_poses[index])
    process.stack.append(activation.create_nested("condition"))
    evaluate_instructions(machine, process, machine.code.instructions, guard.condition)
    process.stack.pop()
    machine.state.tree = tree
    return bool(activation.temporaries[guard.result])


def finish_move(machine: Machine, process: Process, motion: Motion) -> None:
    """The MOVE is over: the frame table and the trace know where the arm is."""
    arm = motion.arm
    machine.update_hand_pose(arm, motion.span)
    hand = machine.state.hands[arm]
    reached = motion.early_end is not EarlyEnd.HALTED and machine.has_pose(motion.goal)
    hand.reached_frame = motion.moved if motion.moved != arm else motion.goal if reached else None
    held = hand.held_frame
    if held and held != hand.reached_frame and arm not in machine.state.tree.ancestors(held):
        hand.held_frame = None
    record_contact(machine, motion)
    if motion.correction is not None and motion.early_end is None:
        finish_correction(machine, motion)
    contact_text, contact = contact_report(motion)
    text, since, data = motion.trace_text + contact_text, motion.start, {**motion.event_data, **contact}
    machine.record_effect(process, "MOVE", text, motion.span, since=since, arm=arm, data=data)
    process.motion = None
    follow(machine, motion)


HANDLERS: Mapping[Op, Handler] = {
    Op.MVEND: move,
    Op.MVHLT: halt_motion,
    # The parts of a MOVE are gathered by its end.
    **dict.fromkeys(
        (Op.MVBEG, *sorted(MOVE_PARTS)),
        lambda *_: None,
    ),
}
