"""The interpreter: intermediate code acts on the frame tree and on a cell, and leaves a recording.

All processes of a program share one clock. Of those that are due at the same tick the one with the highest priority is
served first, then the one that comes first in the text; so a run is the same on any machine.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.cell.hardware import Hardware, Mishap
from armwright.cell.model import Cell
from armwright.motion.limited import limited_label
from armwright.program.bytecode.instructions import Code, Op
from armwright.program.bytecode.verify import verify
from armwright.program.language.diagnostic import Diagnostic, Severity
from armwright.program.vm import control_flow, devices, expressions, frames, move, output, queues
from armwright.program.vm.collisions import threatened_error
from armwright.program.vm.contact import stop_too_deep
from armwright.program.vm.control_flow import recover, shut_down, switched_off_text
from armwright.program.vm.machine import Handler, Limits, Machine, RunError
from armwright.program.vm.move import advance_motion, begin_moves_ahead
from armwright.program.vm.move_diagnostics import clearance_warning, obstacle_warning, speed_warning
from armwright.program.vm.moves_ahead import is_done_at_once
from armwright.program.vm.process import Process
from armwright.program.vm.recording import Effect, Failure, Recording, RunStage, sort_effects
from armwright.program.vm.synchronization import deadlock_error
from armwright.program.vm.tracking import lose_frame, next_loss
from armwright.program.vm.watches import is_stuck, judge_watches

# No TRY helps a program that runs for ever: what is tried again would run for ever again.
_UNRECOVERABLE = ("E504", "E506")
# A simulated world that has become unstable remains so: a program that retries would retry for ever.
_RECOVERABLE_ONCE = "R607"
# A time this part of a period before a tick is on it.
_TICK_TOLERANCE = 1e-6

_FAMILIES = (expressions, frames, devices, move, queues, control_flow, output)
HANDLERS: Mapping[Op, Handler] = {op: handler for family in _FAMILIES for op, handler in family.HANDLERS.items()}

# Called now and then: the time on the clock [s], the line of the next statement.
Progress = Callable[[float, int], None]


def interpret(
    code: Code, cell: Cell, hardware: Hardware, progress: Progress | None = None, *, limits: Limits | None = None
) -> Recording:
    """Run a program in a cell.

    Args:
        code: of a program without errors.
        cell: arms, frames, servo period and deviation.
        hardware: the cell at work, simulated or real.
        progress: told before each statement of the program's own file.
        limits: when a program is taken to run for ever.

    Returns:
        All that happened, tick by tick.

    Raises:
        CodeError: the code cannot be interpreted; code of a program can.
        RunError: a goal is out of reach, a joint would pass its limits, the camera found nothing, a device is
            missing, a value is missing or out of range, processes wait for one another, or a limit of the run is
            passed, and no TRY was around it. The arms are at rest and the devices off then, as at the end.
    """
    verify(code)
    machine = Machine(code, cell, hardware, limits)
    run(machine, progress)
    return machine.recording()


def run(machine: Machine, progress: Progress | None = None) -> None:
    """Run a program on to its end.

    Raises:
        RunError: as ``interpret`` does.
    """
    instructions, source = machine.code.instructions, machine.code.source
    while not machine.state.has_ended:
        process = next_process(machine)
        if progress and (step := instructions[process.pc]).begins and not source.file_number(step.span.start):
            progress(machine.now, source.line(step.span.start))
        advance(machine, process)


def next_process(machine: Machine) -> Process:
    """Return the process that is served next.

    Raises:
        RunError: all wait for one another.
    """
    process = ready_process(machine)
    if process is None:
        raise _stopped_error(machine, deadlock_error(machine), machine.state.program, None)
    return process


def ready_process(machine: Machine) -> Process | None:
    """Return the process that is served next; None where all wait for one another."""
    best: tuple[tuple[int, float, tuple[int, ...]], Process] | None = None
    for process in machine.state.processes:
        if (due := process.due_tick) is not None:
            rank = (due, -process.priority, process.path)
            if best is None or rank < best[0]:
                best = (rank, process)
    # Who waits for others is served for its WHENs alone; where these can change nothing, all wait for ever.
    return None if best is None or (best[1].waiting is not None and is_stuck(machine)) else best[1]


def advance(machine: Machine, process: Process) -> None:
    """Let a process do its next instruction, or what its time has come for.

    Raises:
        RunError: something went wrong that no TRY is around.
    """
    try:
        mishap = _let_time_pass(machine, process)
        if mishap is not None:
            process = _affected_process(machine, mishap) or process
            raise _mishap_error(machine, process, mishap)
        if not judge_watches(machine, process):
            _advance(machine, process)
    except RunError as error:
        if not _is_recoverable(machine, error) or not recover(machine, process, error):
            raise _stopped_error(machine, error, process, process.last_arm) from None


def _is_recoverable(machine: Machine, error: RunError) -> bool:
    """Whether a TRY may go on after an error."""
    code = error.diagnostic.code
    if code != _RECOVERABLE_ONCE:
        return code not in _UNRECOVERABLE
    return not any(effect.kind == "ERROR" and effect.data.get("code") == code for effect in machine.state.effects)


def _let_time_pass(machine: Machine, process: Process) -> Mishap | None:
    """Let time go by until a process is served; return what goes wrong in the cell before that.

    Raises:
        RunError: the program has run for too long.
    """
    state, period = machine.state, machine.cell.period
    if process.due_tick is None or process.due_tick <= state.ticks:
        return None
    last = max(0, math.floor(machine.limits.time / period + _TICK_TOLERANCE))
    until, loss = min(process.due_tick, last), next_loss(machine)
    if loss is not None:
        until = min(until, max(loss[0], state.ticks))
    mishap = machine.hardware.advance(until * period)
    if mishap is not None:
        state.ticks, state.idle_steps = round(mishap.time / period), 0
        return mishap
    if loss is not None and loss[0] <= until:
        state.ticks, state.idle_steps = until, 0
        return lose_frame(machine, _user_of(machine, loss[1]) or process, loss[1])
    state.ticks, state.idle_steps = min(process.due_tick, last), 0
    if process.due_tick > last:
        # The clock stops there, and moving arms have come as far as that.
        under_way = process.pending_effect or process.motion or machine.code.instructions[process.pc]
        text = f"the program is still running after {machine.limits.time:g} s on the clock of the cell"
        raise machine.error(process, "E506", text, under_way.span, "it has reached this statement")
    return None


def _affected_process(machine: Machine, mishap: Mishap) -> Process | None:
    """Return the process that moves an arm to which something has happened, or that has used it last."""
    if mishap.arm is None:
        return None
    mover = machine.moving_process(mishap.arm)
    if mover is not None:
        return mover
    return _user_of(machine, mishap.arm)


def _user_of(machine: Machine, arm: str) -> Process | None:
    """Return the innermost process that has used an arm last."""
    users = [process for process in machine.state.processes if process.last_arm == arm]
    users = users or [process for process in machine.state.owners.get(arm, ()) if not process.done]
    return max(users, key=lambda process: len(process.path), default=None)


def _mishap_error(machine: Machine, process: Process, mishap: Mishap) -> RunError:
    """Return the error that tells a process what has gone wrong in the cell, at what it is doing."""
    under_way = process.motion or process.pending_effect or machine.code.instructions[process.pc]
    helps = mishap.helps
    return machine.error(process, mishap.code, mishap.message, under_way.span, mishap.label, helps=helps)


def _advance(machine: Machine, process: Process) -> None:
    motion = process.motion
    if motion is not None and motion.alarm_tick is not None and motion.alarm_tick <= machine.state.ticks:
        stop_too_deep(machine, process, motion)
    if motion is not None and motion.threat is not None:
        raise threatened_error(machine, process, motion)
    if (pending := process.pending_effect) is not None:
        process.pending_effect = None
        if pending.frame_pose is not None:
            machine.set_pose(process, *pending.frame_pose, pending.span)
        span, since, arm = pending.span, pending.start, pending.arm
        machine.record_effect(process, pending.kind, pending.text, span, since=since, arm=arm, data=pending.data)
        return
    if process.followed_motion is not None:
        advance_motion(machine, process)
        return
    step = machine.code.instructions[process.pc]
    if process.ahead is not None and not is_done_at_once(process, step):
        begin_moves_ahead(machine, process, process.ahead)
        return
    machine.count_step(process, step.span)
    process.pc += 1
    HANDLERS[step.op](machine, process, step)


def _stopped_error(machine: Machine, error: RunError, process: Process, arm: str | None) -> RunError:
    """Return the error with the frames as they are when all arms are at rest and all devices off."""
    switched_off = shut_down(machine, error.diagnostic.span)
    failure = Failure(diagnostic=error.diagnostic, time=error.time, arm=arm, process=process.title)
    recording = partial(_failure_recording, machine, failure, switched_off)
    stopped = RunError(error.diagnostic, machine.state.tree, machine.now, recording)
    stopped.kind = error.kind
    return stopped


def _failure_recording(machine: Machine, failure: Failure, switched_off: Sequence[str]) -> Recording:
    """Return all that happened up to a failure, and as the last thing the failure, with the devices it switched off."""
    fault, recording = failure.diagnostic, machine.recording()
    line = machine.code.source.place(fault.span.start)
    text = f"{fault.code} in line {line}: {fault.message}{switched_off_text(machine, switched_off)}"
    data = {"code": fault.code, "failed_at": failure.time, "switched_off": list(switched_off)}
    end = Effect(
        t0=failure.time,
        t1=machine.now,
        kind="ERROR",
        span=fault.span,
        text=text,
        process=failure.process,
        order=machine.next_start().order,
        arm=failure.arm,
        data=data,
    )
    return attrs.evolve(recording, effects=sort_effects((*recording.effects, end)), failure=failure)


def motion_warnings(stages: Iterable[RunStage], cell: Cell) -> tuple[Diagnostic, ...]:
    """Return the warnings about stages that were run in a cell.

    For every straight line that was gone round, every VIA with stops because corners cannot be rounded, every stage
    that comes too near to other bodies, every tool that is slower than asked for because of limits, and every joint or
    drive asked for too much effort.
    """
    diagnostics = []
    for stage in stages:
        if (warning := obstacle_warning(stage)) is not None:
            diagnostics.append(warning)
        if (warning := clearance_warning(stage, cell.clearance)) is not None:
            diagnostics.append(warning)
        arm = cell.arms[stage.arm].arm
        if (warning := speed_warning(stage, arm)) is not None:
            diagnostics.append(warning)
        excessive = np.flatnonzero(stage.peak_effort / arm.all_limits.effort > 1)
        diagnostics += [_effort_warning(stage, arm, number) for number in excessive.tolist()]
    return tuple(diagnostics)


def run_diagnostics(recording: Recording) -> tuple[Diagnostic, ...]:
    """Return the warnings about the motions of a run, and the error that ended it, if any."""
    failed = () if recording.failure is None else (recording.failure.diagnostic,)
    return (*motion_warnings(recording.stages, recording.cell), *failed)


def _effort_warning(stage: RunStage, arm: Arm, number: int) -> Diagnostic:
    """Return the warning about a joint, or the drive of one: see ``Arm.all_limits``."""
    needed, limit = float(stage.peak_effort[number]), float(arm.all_limits.effort[number])
    unit = arm.joints[number % arm.n].units.effort
    return Diagnostic(
        code="W401",
        severity=Severity.WARNING,
        message=f"{limited_label(arm, number)} of {stage.arm} would need {needed:.1f} {unit}, "
        f"{(needed / limit - 1) * 100:.0f} % more than its {limit:g} {unit}",
        span=stage.span,
        label=f"at {stage.t0 + stage.peak_time[number]:.3f} s, in {stage.stage.kind} to {stage.goal_names[-1]}",
        helps=(f"a speed below {stage.speed:g} reduces the effort due to acceleration, but not that due to gravity",),
    )
