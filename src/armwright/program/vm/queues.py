"""QUEUE and PUT: frames that extend the path of an arm while it moves."""

from __future__ import annotations

import math
from collections.abc import Mapping

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import IncapableArmError, counted
from armwright.motion.frame_queue import NEAR, FrameQueue, Pace
from armwright.motion.obstruction import PathError
from armwright.motion.path import Path
from armwright.motion.plan import PlannedStage, obstacle_on_path, tool_path_length
from armwright.motion.trajectory import hold
from armwright.program.bytecode.instructions import LEFT_OUT, Instruction, Op
from armwright.program.language.source import Span
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, MOST_FRAMES, NORMAL_SPEED
from armwright.program.vm.collisions import refuse_collision
from armwright.program.vm.contact import refuse_contact, rest_tick, send_trajectory
from armwright.program.vm.machine import Handler, Machine, RunError, jump_target
from armwright.program.vm.move_diagnostics import CODES, obstacle_location, obstacle_message
from armwright.program.vm.process import Interruption, Motion, Process, RingQueue
from armwright.program.vm.recording import RunStage, TrajectorySegment, peak_efforts, trajectory_efforts
from armwright.program.vm.tracking import leave_frame, rest_of_following, stop_following
from armwright.spatial.poses import inverse

# Frames that a queue holds when it is not told otherwise.
USUAL_FRAMES = 8
# A time this part of a period behind a tick is on it.
_TICK_TOLERANCE = 1e-6
# A corner is missed by this part of its half-width where the path goes straight back.
_MISS = 3 / 8
# Planning takes as long as so many steps of other kinds.
_STEPS_PER_FRAME = 1000


def _open(machine: Machine, process: Process, step: Instruction) -> None:
    """Open the queue of an arm, which stands until the first frame comes."""
    arm = machine.resolve_name(process, step.operands[0])
    machine.claim_arm(process, arm, step.span)
    if arm in machine.state.queues:
        raise _misused(machine, process, f"the queue of {arm} is open already", step.span, "opened a second time")
    if process.motion is not None or process.interruption is not None:
        raise _misused(machine, process, f"an action cannot open the queue of {arm}", step.span, "in an action")
    if arm in machine.state.following:
        stop_following(machine, process, arm, step.span)
    if (rest := rest_tick(machine, arm)) > machine.state.ticks:
        process.pc, process.wake_tick = process.pc - 1, rest
        return
    capacity, speed, velocity, blend = (_clause(machine, process, step, number) for number in range(1, 5))
    units = machine.code.units.metres
    machine.state.queues[arm] = RingQueue(
        arm=arm,
        span=step.span,
        capacity=round(capacity or USUAL_FRAMES),
        pace=Pace(
            speed or NORMAL_SPEED,
            None if velocity is None else velocity * units,
            machine.cell.corner_deviation / _MISS if blend is None else blend * units,
        ),
        start=machine.next_start(),
    )
    process.queues.append(arm)


# Of each clause: its name, the least and the largest value, and whether it is a whole number.
_CLAUSES = {
    1: ("CAPACITY", 1.0, float(MOST_FRAMES), True),
    2: ("SPEED", LOWEST_SPEED, HIGHEST_SPEED, False),
    3: ("VELOCITY", 0.0, math.inf, False),
    4: ("BLEND", 0.0, math.inf, False),
}


def _clause(machine: Machine, process: Process, step: Instruction, number: int) -> float | None:
    """Return the value of a clause; None where it was left out."""
    operand = step.operands[number]
    if operand == LEFT_OUT:
        return None
    value = machine.read_number(process, operand, step.span)
    name, least, most, whole = _CLAUSES[number]
    if not least <= value <= most or (least == 0 and value == 0) or (whole and value != round(value)):
        kind = "a whole number from" if whole else "from"
        expected = f"expected {kind} {least:g} to {most:g}" if math.isfinite(most) else "expected more than 0"
        code = "E207" if name == "SPEED" else "E231"
        raise machine.error(process, code, f"{name} {value:g} of a queue is not possible", step.span, expected)
    return value


def _put(machine: Machine, process: Process, step: Instruction) -> None:
    """Put a frame into a queue; wait where it is full, or go where the program refuses it then."""
    arm = machine.resolve_name(process, step.operands[0])
    machine.claim_arm(process, arm, step.span)
    queue = current_queue(machine, process, arm, step.span)
    if arm not in machine.state.following and (rest := rest_tick(machine, arm)) > machine.state.ticks:
        # It was stopped by an error.
        process.pc, process.wake_tick = process.pc - 1, rest
        return
    ahead = queue.ahead(machine.now)
    if ahead >= queue.capacity:
        assert queue.path is not None  # noqa: S101 - it has frames
        if len(step.operands) > 2:
            process.pc = jump_target(step, 2)
            return
        if queue.path.held:
            text = f"the queue of {arm} is full, and braked"
            raise machine.error(
                process, "E410", text, step.span, "it would wait for ever", helps=["write RESUME before"]
            )
        passed = queue.path.when_passed(len(queue.labels) - ahead, machine.now)
        process.pc, process.wake_tick = process.pc - 1, _tick_after(machine, passed)
        return
    X_WF, label = machine.read_pose(process, step.operands[1], step.span), _label(machine, process, step)
    _extend(machine, process, queue, X_WF, (label, step.span))
    text, data = f"{arm} PUT {label}", {"ahead": ahead + 1, "capacity": queue.capacity}
    machine.record_effect(process, "PUT", text, step.span, arm=arm, data=data)


def _label(machine: Machine, process: Process, step: Instruction) -> str:
    return machine.operand_text(process, step.operands[1])


def _extend(machine: Machine, process: Process, queue: RingQueue, X_WF: Array, goal_at: tuple[str, Span]) -> None:
    """Extend the path of an arm by a frame, and let it run on along that."""
    from armwright.program.vm.move import planner_of  # noqa: PLC0415 - MOVE knows this module

    machine.state.idle_steps += _STEPS_PER_FRAME
    (label, span), arm, now = goal_at, queue.arm, machine.now
    planner = planner_of(machine, arm)
    X_BF = inverse(machine.base_pose(arm)) @ X_WF
    try:
        path = queue.path or FrameQueue.at(planner, machine.hardware.sent_configuration(arm, now), queue.pace, now)
        grown = path.put(planner, X_BF, now)
    except PathError as error:
        model = machine.cell.arms[arm].arm
        obstacle = obstacle_on_path(planner, Path(poses=np.stack([path.X_last, X_BF])), error)
        text = obstacle_message(obstacle, label, arm, model)
        notes = [obstacle_location(obstacle, "LINE", (label,), arm)]
        raise machine.error(process, CODES[obstacle.cause], text, span, "not put into the queue", notes=notes) from None
    except IncapableArmError as error:
        text = f"{arm} cannot go on to `{label}` at any speed: {error}"
        raise machine.error(process, "E406", text, span, "not put into the queue") from None
    grown_queue = attrs.evolve(queue, labels=(*queue.labels, label), frames=(*queue.frames, X_WF))
    if grown.held:
        machine.state.queues[arm] = attrs.evolve(grown_queue, path=grown)
    else:
        _run_along(machine, process, grown_queue, grown, span)


def _run_along(machine: Machine, process: Process, queue: RingQueue, path: FrameQueue, span: Span) -> None:
    """Let an arm run along its path from now on, which is another one than before."""
    arm, label = queue.arm, queue.labels[-1]
    trajectory = path.trajectory(machine.now, machine.cell.period)
    if not path.held:
        refuse_collision(machine, process, arm, trajectory, (label, span))
    length = tool_path_length(machine.cell.arms[arm].arm, trajectory)
    stage = PlannedStage(kind="QUEUE", trajectory=trajectory, length=length, deviation=NEAR)
    _run(machine, process, queue, stage, label)
    machine.state.queues[arm] = attrs.evolve(queue, path=path)


def _run(machine: Machine, process: Process, queue: RingQueue, stage: PlannedStage, label: str) -> None:
    """Let an arm run on along its path, which has become longer."""
    arm, now, period, trajectory = queue.arm, machine.now, machine.cell.period, stage.trajectory
    motion = machine.state.following.get(arm) or Motion(
        arm=arm,
        moved=arm,
        X_HM=np.eye(4),
        span=queue.span,
        goal=label,
        implied_affix=False,
        text=f"{arm} QUEUE",
        stages=[],
        speed=queue.pace.speed,
        stack_depth=len(process.stack),
        start=queue.start,
        guards=[],
    )
    push = send_trajectory(machine, motion, trajectory)
    if machine.hardware.contact_time(arm) is not None:
        pressed = machine.hardware.peak_contact(arm, now + trajectory.duration)
        send_trajectory(machine, motion, rest_of_following(machine, arm) or hold(trajectory(0.0), period))
        refuse_contact(machine, process, motion, label, pressed)
    ticks = machine.ticks_run(trajectory.duration)
    tau = trajectory_efforts(machine.loaded_arm(arm), trajectory, period, push, ticks)
    is_put_at_once = leave_frame(machine, arm)
    peak, when = peak_efforts(machine.cell.arms[arm].arm, tau, period)
    run = RunStage(
        t0=now,
        arm=arm,
        span=queue.span,
        goal_names=(label,),
        speed=queue.pace.speed,
        stage=stage,
        motion=trajectory,
        length=stage.length,
        peak_effort=peak,
        peak_time=when,
    )
    segment = TrajectorySegment(t0=now, trajectory=trajectory, duration=trajectory.duration, tau=tau)
    if is_put_at_once:
        # What began at this very tick has not been run.
        machine.state.segments[arm][-1], machine.state.stages[motion.stage_index] = segment, run
    else:
        motion.stage_index = len(machine.state.stages)
        machine.state.stages.append(run)
        machine.state.segments[arm].append(segment)
    machine.state.following[arm] = motion


def brake_queues(machine: Machine, process: Process, interruption: Interruption, span: Span) -> None:
    """Brake the arms that run along queues of a process, on their paths; the process goes on when they are at rest."""
    for arm in list(machine.state.following):
        queue = machine.state.queues.get(arm)
        if queue is None or queue.path is None or process not in machine.state.owners.get(arm, ()):
            continue
        if not queue.path.held:
            _run_along(machine, process, queue, queue.path.braked(machine.now), span)
            interruption.held = (*interruption.held, arm)
            end = _tick_after(machine, machine.state.segments[arm][-1].t0 + machine.state.segments[arm][-1].duration)
            machine.record_effect(process, "BRAKE", f"{arm} BRAKE", span, until=end, arm=arm)
            process.wake_tick = max(process.wake_tick, end)


def resume_queues(machine: Machine, process: Process, interruption: Interruption, span: Span) -> None:
    """Let arms go on along their queues."""
    for arm in interruption.held:
        queue = machine.state.queues.get(arm)
        if queue is not None and queue.path is not None and arm in machine.state.following:
            _run_along(machine, process, queue, queue.path.resumed(machine.now), span)
            machine.record_effect(process, "RESUME", f"{arm} RESUME", span, arm=arm)
    interruption.held = ()


def leave_queues(machine: Machine, interruption: Interruption, span: Span) -> None:
    """Give up what is ahead in queues that an action has braked and not resumed: their arms stand there."""
    for arm in interruption.held:
        if machine.state.following.pop(arm, None) is not None:
            machine.update_hand_pose(arm, span)


def _close(machine: Machine, process: Process, step: Instruction) -> None:
    """Wait until the arm stands at its last frame, and close the queue."""
    arm = machine.resolve_name(process, step.operands[0])
    queue = current_queue(machine, process, arm, step.span)
    if process.queues[-1:] != [arm]:
        raise _misused(machine, process, f"{process.title} has not opened the queue of {arm}", step.span, "closed here")
    end = queue.path.end if queue.path is not None else machine.now
    if (tick := _tick_after(machine, end)) > machine.state.ticks:
        process.pc, process.wake_tick = process.pc - 1, tick
        return
    machine.state.following.pop(arm, None)
    close_queues(machine, process, len(process.queues) - 1)
    machine.update_hand_pose(arm, queue.span)
    hand = machine.state.hands[arm]
    last = queue.labels[-1] if queue.labels else ""
    hand.reached_frame = next((name for name in machine.state.tree if machine.spelling(name) == last), None)
    stops = 0 if queue.path is None else queue.path.stop_count
    dry = f", run dry {counted(stops, 'time')}" if stops else ""
    text = f"{arm} QUEUE: {counted(len(queue.labels), 'frame')}{dry}"
    data = {"frames": list(queue.labels), "run_dry": stops}
    machine.record_effect(process, "QUEUE", text, queue.span, since=queue.start, arm=arm, data=data)


def close_queues(machine: Machine, process: Process, keep_count: int) -> None:
    """Close the queues that a process opened after its first ``keep_count``: their arms are at rest, or brake."""
    for arm in process.queues[keep_count:]:
        machine.state.queues.pop(arm, None)
    del process.queues[keep_count:]


def require_no_queue(machine: Machine, process: Process, arm: str, span: Span) -> None:
    """See to it that an arm has no open queue.

    Raises:
        RunError: it has one.
    """
    if arm in machine.state.queues:
        raise _misused(machine, process, f"{arm} cannot make a MOVE while its queue is open", span, "not by a MOVE")


def current_queue(machine: Machine, process: Process, arm: str, span: Span) -> RingQueue:
    """Return the queue of an arm; without frames where an error has stopped the arm meanwhile.

    Raises:
        RunError: it has none.
    """
    queue = machine.state.queues.get(arm)
    if queue is None:
        text, help_ = f"{arm} has no open queue", f"write `QUEUE {arm} DO BEGIN ... END` around it"
        raise machine.error(process, "E410", text, span, "its queue is not open here", helps=[help_])
    return queue if arm in machine.state.following else attrs.evolve(queue, path=None, labels=(), frames=())


def _misused(machine: Machine, process: Process, text: str, span: Span, label: str) -> RunError:
    return machine.error(process, "E410", text, span, label, helps=["end the statement of QUEUE before"])


def _tick_after(machine: Machine, time: float) -> int:
    return math.ceil(time / machine.cell.period - _TICK_TOLERANCE)


HANDLERS: Mapping[Op, Handler] = {
    Op.QUEUE: _open,
    Op.PUT: _put,
    Op.QUEND: _close,
}
