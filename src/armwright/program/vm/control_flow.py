"""Jumps, procedures, processes, events, locks, attempts, and the end of a program."""

from collections.abc import Mapping, Sequence

import attrs

from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.language.source import Span
from armwright.program.vm.calls import CALLS, leave_activation
from armwright.program.vm.contact import contact_report, record_contact, rest_tick, stop_arm
from armwright.program.vm.machine import MAX_PAUSE, Handler, Machine, RunError, jump_target
from armwright.program.vm.move import halt_motion
from armwright.program.vm.process import (
    Activation,
    EarlyEnd,
    PendingEffect,
    Process,
    TryBlock,
    WaitReason,
)
from armwright.program.vm.queues import close_queues
from armwright.program.vm.synchronization import abandon_wait, lock, release_locks, signal, unlock, wait
from armwright.program.vm.tracking import stop_all_following
from armwright.program.vm.wait_until import too_late, wait_until, wait_within
from armwright.program.vm.watches import WATCHES, abandon_interrupted

# ---- processes -----------------------------------------------------------------------------------------------------


def _fork(machine: Machine, process: Process, step: Instruction) -> None:
    if process.interruption is not None and any(branch in machine.state.processes for branch in process.branches):
        text = "the action of a WHEN begins a COBEGIN while it interrupts another"
        raise machine.error(process, "E503", text, step.span, "the branches of that one still run")
    parent = process.activation
    names, temporaries, spans = parent.bindings, parent.temporaries, parent.temporary_spans
    _check_process_limit(machine, process, step)
    priority = machine.read_number(process, step.operands[1], step.span) if len(step.operands) > 1 else process.priority
    branch = Process(
        path=(*process.path, len(process.branches)),
        priority=priority,
        pc=jump_target(step, 0),
        wake_tick=machine.state.ticks,
        stack=[Activation("main", "", names, dict(temporaries), dict(spans))],
        parent=process,
        last_arm=process.last_arm,
    )
    process.branches.append(branch)


def _check_process_limit(machine: Machine, process: Process, step: Instruction) -> None:
    """See to it that there is room for one process more: a procedure may begin a COBEGIN in which it is called again.

    Raises:
        RunError: there are too many of them.
    """
    limit = machine.limits.processes
    is_too_deep = len(process.path) >= limit // 10
    if not is_too_deep and len(machine.state.processes) + len(process.branches) < limit:
        return
    text = f"COBEGINs are nested more than {limit // 10} deep" if is_too_deep else f"more than {limit} processes run"
    raise machine.error(process, "E505", text, step.span, "one more would begin here")


def _join(machine: Machine, process: Process, step: Instruction) -> None:
    """Let the branches go, all at once, and wait for them."""
    machine.state.processes += process.branches
    for branch in process.branches:
        branch.wake_tick = machine.state.ticks
    process.waiting = WaitReason("branches", (), step.span, machine.next_start())


def _quit(machine: Machine, process: Process, step: Instruction) -> None:
    stop_all_following(machine, process, step.span)
    end_process(machine, process)
    parent = process.parent
    assert parent is not None  # noqa: S101 - only branches end so
    if all(branch.done for branch in parent.branches):
        parent.branches = []
        if parent.waiting is not None and parent.waiting.kind == "branches":
            # The action of a WHEN goes on as it does, and finds that there is nothing more to wait for.
            parent.waiting, parent.wake_tick = None, machine.state.ticks


def end_process(machine: Machine, process: Process) -> None:
    """Take a process out of the run."""
    abandon_wait(machine, process)
    release_locks(machine, process, 0)
    close_queues(machine, process, 0)
    process.done, process.watches = True, []
    process.motion = process.pending_effect = None
    # Where the branch after it could not begin, its COBEGIN has let none go.
    if process in machine.state.processes:
        machine.state.processes.remove(process)


def _pause(machine: Machine, process: Process, step: Instruction) -> None:
    seconds = machine.read_number(process, step.operands[0], step.span)
    if not 0 <= seconds <= MAX_PAUSE:
        text = f"a PAUSE of {seconds:g} s is not possible"
        raise machine.error(process, "E231", text, step.span, f"expected 0 to {MAX_PAUSE:g} s")
    pending = PendingEffect(kind="PAUSE", text=f"PAUSE {seconds:g}", start=machine.next_start(), span=step.span)
    machine.schedule_effect(process, seconds, pending)


# ---- attempts and ends ---------------------------------------------------------------------------------------------


def _try(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    kinds = tuple(map(str, step.operands[1:]))
    held, watches = len(process.locks), len(process.watches)
    attempt = TryBlock(process.pc - 1, jump_target(step, 0), False, held, kinds, watches, len(process.queues))
    process.activation.try_blocks.append(attempt)


def _end_try(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    process.activation.try_blocks.pop()
    process.pc = jump_target(step, 0)


def _end_recover(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    process.activation.try_blocks.pop()


def _retry(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    try_blocks = process.activation.try_blocks
    while not try_blocks[-1].recovering:
        try_blocks.pop()
    release_locks(machine, process, try_blocks[-1].lock_count)
    del process.watches[try_blocks[-1].watch_count :]
    close_queues(machine, process, try_blocks[-1].queue_count)
    # TRY itself is run again and puts the attempt back.
    process.pc = try_blocks.pop().start


def _halt(machine: Machine, process: Process, step: Instruction) -> None:
    """End the program; in a procedure that the action of an ON calls, its MOVE alone, as in the action itself."""
    inner = next((one.kind for one in reversed(process.stack) if one.kind in ("action", "watch")), "watch")
    if inner == "watch":
        finish_program(machine, process, step.span, "HALT")
        return
    while process.activation.kind != "action":
        leave_activation(machine, process, step.span)
    halt_motion(machine, process, step)


def _stop(machine: Machine, process: Process, step: Instruction) -> None:
    finish_program(machine, process, step.span, "END")


def shut_down(machine: Machine, span: Span) -> list[str]:
    """Bring every arm to rest and switch every device off: the run is over once all is still.

    Returns:
        The devices that were on.
    """
    for process in machine.state.processes:
        abandon_wait(machine, process)
    ends = [_stop_motion(machine, process, span) for process in machine.state.processes]
    machine.state.ticks = max([*ends, *(rest_tick(machine, arm) for arm in machine.state.segments)])
    switched_off = sorted(machine.hardware.active_devices())
    for device in switched_off:
        machine.hardware.operate(device, on=False)
    machine.state.has_ended = True
    return switched_off


def _stop_motion(machine: Machine, process: Process, span: Span, inside: int = 0) -> int:
    """Give up the motion of a process, if it makes one; return when its arm is at rest [ticks].

    Args:
        machine: that runs the program.
        process: the process.
        span: what ends the motion.
        inside: how many of its activations stay. What the action of a WHEN among them has interrupted is kept.
    """
    for activation in process.stack[inside:]:
        if activation.interrupted is not None:
            abandon_interrupted(machine, process, activation.interrupted)
    if process.ahead is not None:
        # They have not begun, though the program has taken the arm for being at their goal.
        arm, process.ahead = process.ahead.arm, None
        machine.update_hand_pose(arm, span)
    followed = stop_all_following(machine, process, span)
    motion = process.motion
    if motion is None or any(one.kind == "watch" for one in process.stack[motion.stack_depth : inside]):
        return max(followed, rest_tick(machine, process.last_arm))
    end = stop_arm(machine, process, span)
    record_contact(machine, motion, end)
    contact_text, contact = contact_report(motion)
    process.motion, arm = None, motion.arm
    machine.record_effect(process, "STOP", f"{arm} stops{contact_text}", span, until=end, arm=arm, data=contact)
    motion.early_end, since = motion.early_end or EarlyEnd.BRAKED, motion.start
    data = {**motion.event_data, **contact}
    machine.record_effect(process, "MOVE", motion.trace_text, motion.span, since=since, until=end, arm=arm, data=data)
    return max(end, followed)


def finish_program(machine: Machine, process: Process, span: Span, word: str) -> None:
    """End the program: arms at rest, devices off, the frame table true."""
    switched_off = shut_down(machine, span)
    text, data = f"{word}{switched_off_text(machine, switched_off)}", {"switched_off": switched_off}
    machine.record_effect(process, "END", text, span, data=data)


def switched_off_text(machine: Machine, switched_off: Sequence[str]) -> str:
    """Return what is said behind the end of a program of the devices that it switched off."""
    return "".join(f"; {machine.spelling(device)} OFF" for device in switched_off)


def recover(machine: Machine, process: Process, error: RunError) -> bool:
    """Go on in the RECOVER part of the innermost TRY around what went wrong.

    What the process had begun is stopped: its branches, its motion; branches without a TRY of their own hand the
    error to the process that began them.

    Returns:
        Whether there is one.
    """
    span, at_rest = error.diagnostic.span, machine.state.ticks
    while True:
        kept, ends = _recovering_activation(process, error.kind), []
        if not _interrupts_branches(process, process.stack[:kept]):
            ends = [_cancel_branch(machine, branch, span) for branch in process.branches]
            process.branches = []
        # The arm of the branch that failed may be the last to come to rest.
        process.wake_tick = at_rest = max([at_rest, *ends, _stop_motion(machine, process, span, kept)])
        abandon_wait(machine, process)
        process.pending_effect = None
        if (try_block := _unwind_to_recovery(machine, process, span, error.kind)) is not None:
            process.pc, process.message = try_block.recovery, error.diagnostic.message
            release_locks(machine, process, try_block.lock_count)
            del process.watches[try_block.watch_count :]
            close_queues(machine, process, try_block.queue_count)
            code, line = error.diagnostic.code, machine.code.source.place(span.start)
            text = f"{code} in line {line}: {error.diagnostic.message}"
            machine.record_effect(process, "ERROR", text, span, data={"code": code, "kind": error.kind})
            return True
        if process.parent is None:
            machine.state.ticks = process.wake_tick
            return False
        process = process.parent
        at_rest = max(at_rest, _leave_actions(machine, process, span))


def _interrupts_branches(process: Process, activations: Sequence[Activation]) -> bool:
    """Whether one of these is the action of a WHEN that interrupts the wait for branches, which still run."""
    waits = (one.interrupted.waiting for one in activations if one.interrupted is not None)
    is_joining = process.waiting is not None and process.waiting.kind == "branches"
    return not is_joining and any(wait is not None and wait.kind == "branches" for wait in waits)


def _leave_actions(machine: Machine, process: Process, span: Span) -> int:
    """Leave the actions of WHENs that interrupt the wait for branches of which one has failed.

    Returns:
        When the arm that they moved is at rest [ticks].
    """
    end = machine.state.ticks
    while _interrupts_branches(process, process.stack):
        outside = max(depth for depth, one in enumerate(process.stack) if one.interrupted is not None)
        end = max(end, _stop_motion(machine, process, span, outside))
        while len(process.stack) > outside:
            leave_activation(machine, process, span)
    return end


def _recovering_activation(process: Process, kind: str) -> int:
    """Return how many activations stay when a process recovers from a kind of error; 0 where it does not."""
    for depth in range(len(process.stack), 0, -1):
        if any(block.recovers_from(kind) for block in process.stack[depth - 1].try_blocks):
            return depth
    return 0


def _unwind_to_recovery(machine: Machine, process: Process, span: Span, kind: str) -> TryBlock | None:
    """Return the innermost attempt that recovers from a kind of error and has not failed yet, now failed.

    All activations inside it are left.
    """
    while True:
        try_blocks = process.activation.try_blocks
        while try_blocks:
            try_block = try_blocks.pop()
            if try_block.recovers_from(kind):
                try_blocks.append(attrs.evolve(try_block, recovering=True))
                return try_block
        if len(process.stack) == 1:
            return None
        leave_activation(machine, process, span)


def _cancel_branch(machine: Machine, process: Process, span: Span) -> int:
    """End a branch with all its own; return when its arms are at rest."""
    if process.done:
        return machine.state.ticks
    ends = [_cancel_branch(machine, branch, span) for branch in process.branches]
    ends.append(_stop_motion(machine, process, span))
    end_process(machine, process)
    return max(ends)


HANDLERS: Mapping[Op, Handler] = {
    **CALLS,
    **WATCHES,
    Op.FORK: _fork,
    Op.JOIN: _join,
    Op.QUIT: _quit,
    Op.SIG: signal,
    Op.WAIT: wait,
    Op.AWAIT: wait_within,
    Op.UNTIL: wait_until,
    Op.LATE: too_late,
    Op.PAUSE: _pause,
    Op.LOCK: lock,
    Op.UNLK: unlock,
    Op.TRY: _try,
    Op.ENDT: _end_try,
    Op.ENDR: _end_recover,
    Op.RETRY: _retry,
    Op.HALT: _halt,
    Op.STOP: _stop,
}
