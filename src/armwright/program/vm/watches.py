"""WHEN at work: conditions judged on every servo tick, actions that interrupt a process, BRAKE and RESUME."""

from collections.abc import Mapping

import attrs
import numpy as np

from armwright.motion.limited import resumed
from armwright.motion.plan import PlannedStage, tool_path_length
from armwright.motion.quintic_polynomials import point_to_point
from armwright.motion.trajectory import whole_ticks
from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.vm.calls import evaluate_instructions, return_
from armwright.program.vm.machine import Handler, Machine, jump_target
from armwright.program.vm.move import brake_motion, finish_move, start_stage, stop_motion
from armwright.program.vm.move_request import READS_POSES, operations
from armwright.program.vm.process import Course, EarlyEnd, Interruption, Motion, PendingStage, Process, Watch
from armwright.program.vm.queues import brake_queues, leave_queues, resume_queues
from armwright.program.vm.synchronization import record_wait

# Values that change without a statement of the program.
_READS_OUTSIDE = frozenset(
    (Op.TIME, Op.FORCE, Op.INPUT, Op.ANALOG, Op.OUTPUT, Op.SETTING, Op.TIMER, Op.QUEUED, Op.AWAITED)
)
# An arm so near to where it was braked has not been moved since [rad] or [m].
_SAME_CONFIGURATION = 1e-9
# No stage begins then: its path is checked for collisions anew.
_NEVER = -1


# ---- arming and judging --------------------------------------------------------------------------------------------


def _arm(machine: Machine, process: Process, step: Instruction) -> None:
    """Arm a WHEN until the end of its block; a condition that holds already begins its action at once."""
    ops, span = operations(machine.code, jump_target(step, 0)), step.span
    name = str(step.operands[4]) if len(step.operands) > 4 else ""
    written = " ".join(machine.code.source.slice(span).split())
    watch = Watch(
        start=process.pc - 1,
        name=name,
        title=f"WHEN {machine.spelling(name)}" if name else written,
        priority=machine.read_number(process, step.operands[3], span),
        condition=jump_target(step, 0),
        result=str(step.operands[1]),
        action=jump_target(step, 2),
        activation=process.activation,
        depth=len(process.stack),
        reads_pose=not ops.isdisjoint(READS_POSES),
        reads_outside=not ops.isdisjoint(_READS_OUTSIDE),
    )
    _disarm(process, {watch.start})
    process.watches.append(watch)
    process.judged_tick = max(process.judged_tick, machine.state.ticks)
    _judge(machine, process, watch)
    _begin_due(machine, process)


def _end_block(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    """Disarm the WHENs of a block at its end."""
    _disarm(process, {jump_target(step, number) for number in range(len(step.operands))})


def _disarm(process: Process, starts: set[int]) -> None:
    depth = len(process.stack)
    process.watches = [one for one in process.watches if one.depth != depth or one.start not in starts]


def _switch(machine: Machine, process: Process, step: Instruction) -> None:
    """Disarm a WHEN by its name, or arm it again."""
    name, is_on = str(step.operands[0]), step.operands[1] == "ON"
    watch = next((one for one in reversed(process.watches) if one.name == name), None)
    if watch is None or watch.armed is is_on:
        return
    watch.armed, watch.holds, watch.due = is_on, False, False
    if is_on:
        process.judged_tick = max(process.judged_tick, machine.state.ticks)
        _judge(machine, process, watch)
        _begin_due(machine, process)


def judge_watches(machine: Machine, process: Process) -> bool:
    """Judge the WHENs of a process, where that has not been done on this tick; return whether it was done now."""
    tick = process.judge_tick
    if tick is None or tick > machine.state.ticks:
        return False
    process.judged_tick = machine.state.ticks
    for watch in process.watches:
        if watch.armed:
            _judge(machine, process, watch)
    _begin_due(machine, process)
    return True


def _judge(machine: Machine, process: Process, watch: Watch) -> None:
    """See whether the condition of a WHEN holds: its action is due when it has not held before."""
    tree, motion = machine.state.tree, process.motion
    if watch.reads_pose and motion is not None:
        machine.state.tree = tree.set_pose(motion.arm, machine.gripper_pose(motion.arm))
    process.stack.append(watch.activation.create_nested("condition"))
    evaluate_instructions(machine, process, machine.code.instructions, watch.condition)
    process.stack.pop()
    machine.state.tree = tree
    holds = bool(watch.activation.temporaries[watch.result])
    watch.due = watch.due or (holds and not watch.holds)
    watch.holds = holds


def is_stuck(machine: Machine) -> bool:
    """Whether all processes wait for one another, and no WHEN can change that: their conditions stay as they are."""
    state = machine.state
    return all(
        process.waiting is not None
        and process.motion is None
        and (process.judge_tick is None or process.judged_tick > state.step_tick)
        and not any(watch.armed and watch.reads_outside for watch in process.watches)
        for process in state.processes
    )


# ---- actions -------------------------------------------------------------------------------------------------------


def _begin_due(machine: Machine, process: Process) -> None:
    """Begin the action that is due and comes first: of higher priority than the one that runs, then by the text."""
    running = process.interruption
    due = [one for one in process.watches if one.due and (running is None or one.priority > running.priority)]
    if not due:
        return
    watch = min(due, key=lambda one: (-one.priority, one.start))
    watch.due = False
    cause = process.followed_motion or process.waiting or process.pending_effect
    interruption = Interruption(
        title=watch.title,
        priority=watch.priority,
        wake_tick=process.wake_tick,
        waiting=process.waiting,
        unfulfilled_wait=process.unfulfilled_wait,
        pending_effect=process.pending_effect,
        last_arm=process.last_arm,
    )
    activation = watch.activation.create_nested(
        "watch",
        return_address=process.pc,
        call_span=(cause or machine.code.instructions[process.pc]).span,
        lock_count=len(process.locks),
        interrupted=interruption,
    )
    process.stack.append(activation)
    process.pc, process.wake_tick = watch.action, machine.state.ticks
    process.waiting = process.unfulfilled_wait = process.pending_effect = None
    if process.motion is not None:
        machine.update_hand_pose(process.motion.arm, process.motion.span)
    data = {"priority": watch.priority} | ({"name": watch.name} if watch.name else {})
    span = machine.code.instructions[watch.start].span
    machine.record_effect(process, "WHEN", interruption.title, span, data=data)


def _return(machine: Machine, process: Process, step: Instruction) -> None:
    """Leave a procedure, or an action; what that of a WHEN has interrupted goes on."""
    activation = process.activation
    interruption = activation.interrupted
    return_(machine, process, step)
    if interruption is None:
        return
    now = machine.state.ticks
    process.last_arm, process.pending_effect = interruption.last_arm, interruption.pending_effect
    process.wake_tick = max(now, interruption.wake_tick)
    if interruption.motion is not None:
        process.motion = interruption.motion
    leave_queues(machine, interruption, step.span)
    if interruption.braked and process.motion is not None:
        stop_motion(machine, process, process.motion, step.span)
    process.unfulfilled_wait = interruption.unfulfilled_wait
    if interruption.unfulfilled_wait is not None:
        # What it waits for may have come meanwhile: it looks again.
        process.wake_tick = now
    elif interruption.waiting is not None and process.branches:
        process.waiting = interruption.waiting
    elif interruption.waiting is not None:
        process.wake_tick = now
    _begin_due(machine, process)


def abandon_interrupted(machine: Machine, process: Process, interruption: Interruption) -> None:
    """Take note of what the action of a WHEN has interrupted, and what does not go on any more."""
    if interruption.unfulfilled_wait is not None:
        record_wait(machine, process, interruption.unfulfilled_wait, in_vain=True)
    if interruption.motion is not None:
        # Another MOVE may be on its way.
        outside, process.motion = process.motion, interruption.motion
        interruption.motion.early_end = EarlyEnd.BRAKED
        finish_move(machine, process, interruption.motion)
        process.motion = outside
    interruption.motion = interruption.unfulfilled_wait = interruption.pending_effect = None


# ---- the MOVE that is interrupted ----------------------------------------------------------------------------------


def _brake(machine: Machine, process: Process, step: Instruction) -> None:
    """Brake the MOVE that the action has interrupted, on its path; the action goes on when the arm is at rest."""
    motion = process.motion
    interruption = None if motion is None else process.interruption_of(motion)
    if interruption is not None:
        brake_motion(machine, process, interruption, step.span)
    elif motion is None and (interruption := process.interruption) is not None:
        brake_queues(machine, process, interruption, step.span)


def _resume(machine: Machine, process: Process, step: Instruction) -> None:
    """Let the MOVE that the action has braked go on, from where it was braked, while the action goes on too."""
    interruption = process.interruption
    if interruption is not None and interruption.held:
        resume_queues(machine, process, interruption, step.span)
    if interruption is None or not interruption.braked:
        return
    motion = interruption.motion or process.motion
    assert motion is not None  # noqa: S101 - it has been braked
    if motion.tracking is not None:
        text, help_ = "a MOVE that tracks a frame cannot be resumed", "leave RESUME out, and track it with another MOVE"
        raise machine.error(process, "E409", text, step.span, "the frame has gone on", helps=[help_])
    if motion.correction is not None:
        text, help_ = "a MOVE whose path is corrected cannot be resumed", "leave RESUME out, and write another MOVE"
        raise machine.error(process, "E412", text, step.span, "the line has been left", helps=[help_])
    interruption.motion, interruption.braked, process.motion = None, False, motion
    motion.stages[:0] = _stages_to_go_on(machine, motion)
    motion.rest_tick = motion.stopped = None
    machine.record_effect(process, "RESUME", f"{motion.arm} RESUME", step.span, arm=motion.arm)
    motion.stage_end_tick = interruption.wake_tick = machine.state.ticks
    if motion.stages:
        start_stage(machine, process, motion)
        interruption.wake_tick, process.wake_tick = process.wake_tick, machine.state.ticks


def _stages_to_go_on(machine: Machine, motion: Motion) -> list[PendingStage]:
    """Return the stages that lead a braked arm back to its path, where it has left that, and along the rest of it."""
    assert motion.stopped is not None  # noqa: S101 - it has been braked
    arm, period, (planned, reached) = machine.cell.arms[motion.arm].arm, machine.cell.period, motion.stopped
    stages = []
    if reached < planned.duration:
        run = machine.state.stages[motion.stage_index]
        rest, clock = attrs.astuple(resumed(arm, planned, reached, period=period), recurse=False)
        # What is resumed keeps to the path, and not to the time for which it was shaped.
        stage = attrs.evolve(run.stage, trajectory=rest, length=tool_path_length(arm, rest), shaping=None)
        stages.append(PendingStage(stage, run.goal_names, _NEVER, run.clearance, run.path, Course(planned, clock)))
    q = machine.hardware.sent_configuration(motion.arm, machine.now)
    if np.abs(q - planned(reached)).max() > _SAME_CONFIGURATION:
        back = whole_ticks(point_to_point(arm, q, planned(reached), motion.speed), period)
        to_path = PlannedStage(kind="PTP", trajectory=back, length=tool_path_length(arm, back))
        stages.insert(0, PendingStage(to_path, ("its path",), _NEVER))
    return stages


WATCHES: Mapping[Op, Handler] = {
    Op.WHEN: _arm,
    Op.DISARM: _end_block,
    Op.WHSET: _switch,
    Op.BRAKE: _brake,
    Op.RESUME: _resume,
    Op.RET: _return,
}
