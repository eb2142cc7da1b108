"""Jumps, procedures, processes, events, locks, attempts, and the end of a program."""

import math
from collections.abc import Mapping, Sequence

from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.language.kinds import VariableKind
from armwright.program.language.source import Span
from armwright.program.vm.contact import contact_of, note_contact, stop
from armwright.program.vm.machine import Handler, Machine, RunError, jump_target
from armwright.program.vm.move import halt, release
from armwright.program.vm.process import Activation, Attempt, EarlyEnd, Pending, Process, Waiting
from armwright.program.vm.synchronization import give_up, lock, signal, unlock, wait

# A last pass that rounding would leave out is made.
_ROUNDING = 1e-9
# The longest pause; more is a slip of units [s].
_MAX_PAUSE = 1e6


def _jump(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    process.at = jump_target(step, 0)


def _jump_if_not(machine: Machine, process: Process, step: Instruction) -> None:
    if not machine.read(process, step.operands[0], step):
        process.at = jump_target(step, 1)


def _for(machine: Machine, process: Process, step: Instruction) -> None:
    variable, count, *bounds = step.operands[:5]
    done = machine.number(process, count, step)
    first, last, step_ = (machine.number(process, bound, step) for bound in bounds)
    if step_ == 0:
        raise machine.error(process, "E229", "the STEP of this FOR is 0", step.span, "it would never end")
    if done > (last - first) / step_ + _ROUNDING:
        process.at = jump_target(step, 5)
        return
    machine.write(process, variable, first + done * step_, step)
    machine.write(process, count, done + 1, step)


# ---- procedures ----------------------------------------------------------------------------------------------------


def _call(machine: Machine, process: Process, step: Instruction) -> None:
    name = str(step.operands[0])
    procedure = machine.code.procedures[name]
    if len(process.stack) > machine.limits.depth:
        text = f"procedure calls are nested more than {machine.limits.depth} deep"
        raise machine.error(process, "E505", text, step.span, f"`{machine.spelled(name)}` is called once more")
    machine.state.activations += 1
    bindings, own = {}, []
    for key, kind in procedure.types.items():
        slot = f"{key}'{machine.state.activations}"
        if key in procedure.parameters:
            operand = step.operands[1 + procedure.parameters.index(key)]
            by_value = not kind.sizes and kind.kind in (VariableKind.SCALAR, VariableKind.TRANS)
            if not by_value and machine.names_variable(process, operand):
                bindings[key] = machine.name(process, operand)
                continue
            if by_value:
                read = machine.number if kind.kind is VariableKind.SCALAR else machine.pose
                machine.state.values[slot] = read(process, operand, step)
            else:
                machine.grow(machine.state.tree.place(slot, machine.pose(process, operand, step)), slot, step.span)
        bindings[key] = slot
        machine.state.types[slot] = kind
        own.append(slot)
    inside = Activation(kind="procedure", name=name, bindings=bindings, back=process.at, called=step.span)
    inside.own, inside.locks = tuple(own), len(process.locks)
    process.stack.append(inside)
    process.at = procedure.start


def _return(machine: Machine, process: Process, step: Instruction) -> None:
    process.at = process.now.back
    _leave(machine, process, step.span)


def _leave(machine: Machine, process: Process, span: Span) -> None:
    """Leave the present activation: its variables are gone, its locks given back."""
    activation = process.stack.pop()
    release(machine, process, activation.locks)
    for slot in activation.own:
        kind = machine.state.types.pop(slot)
        elements = [name for name in machine.state.tree if name.startswith(f"{slot}[")] if kind.sizes else []
        for name in (slot, *elements):
            if kind.kind is VariableKind.FRAME and name in machine.state.tree:
                machine.grow(machine.state.tree.without(name), name, span)
                machine.state.written.pop(name, None)
                for hand in machine.state.hands.values():
                    hand.forget(name)
        for name in [value for value in machine.state.values if value == slot or value.startswith(f"{slot}[")]:
            del machine.state.values[name]
        machine.state.events.pop(slot, None)


# ---- processes -----------------------------------------------------------------------------------------------------


def _fork(machine: Machine, process: Process, step: Instruction) -> None:
    now = process.now
    _room(machine, process, step)
    rank = machine.number(process, step.operands[1], step) if len(step.operands) > 1 else process.priority
    branch = Process(
        path=(*process.path, len(process.branches)),
        priority=rank,
        at=jump_target(step, 0),
        wake=machine.state.ticks,
        stack=[Activation(kind="main", bindings=now.bindings, passing=dict(now.passing), wrote=dict(now.wrote))],
        parent=process,
        last_arm=process.last_arm,
    )
    process.branches.append(branch)


def _room(machine: Machine, process: Process, step: Instruction) -> None:
    """See to it that there is room for one process more: a procedure may begin a COBEGIN in which it is called again.

    Raises:
        RunError: there are too many of them.
    """
    most = machine.limits.processes
    deep = len(process.path) >= most // 10
    if not deep and len(machine.state.processes) + len(process.branches) < most:
        return
    text = f"COBEGINs are nested more than {most // 10} deep" if deep else f"more than {most} processes run"
    raise machine.error(process, "E505", text, step.span, "one more would begin here")


def _join(machine: Machine, process: Process, step: Instruction) -> None:
    """Let the branches go, all at once, and wait for them."""
    machine.state.processes += process.branches
    for branch in process.branches:
        branch.wake = machine.state.ticks
    process.waiting = Waiting("branches", (), step.span, machine.starts())


def _quit(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    end(machine, process)
    parent = process.parent
    assert parent is not None  # noqa: S101 - only branches end so
    if all(branch.done for branch in parent.branches):
        parent.branches = []
        parent.waiting, parent.wake = None, machine.state.ticks


def end(machine: Machine, process: Process) -> None:
    """Take a process out of the run."""
    give_up(machine, process)
    release(machine, process, 0)
    process.done = True
    process.motion = process.pending = None
    # Where the branch after it could not begin, its COBEGIN has let none go.
    if process in machine.state.processes:
        machine.state.processes.remove(process)


def _pause(machine: Machine, process: Process, step: Instruction) -> None:
    seconds = machine.number(process, step.operands[0], step)
    if not 0 <= seconds <= _MAX_PAUSE:
        text = f"a PAUSE of {seconds:g} s is not possible"
        raise machine.error(process, "E231", text, step.span, f"expected 0 to {_MAX_PAUSE:g} s")
    text = f"PAUSE {seconds:g}"
    machine.take_time(process, seconds, Pending(kind="PAUSE", text=text, since=machine.starts(), span=step.span))


# ---- attempts and ends ---------------------------------------------------------------------------------------------


def _try(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    attempt = Attempt(process.at - 1, jump_target(step, 0), recovering=False, locks=len(process.locks))
    process.now.attempts.append(attempt)


def _well(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    process.now.attempts.pop()
    process.at = jump_target(step, 0)


def _recovered(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    process.now.attempts.pop()


def _retry(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    attempts = process.now.attempts
    while not attempts[-1].recovering:
        attempts.pop()
    release(machine, process, attempts[-1].locks)
    # TRY itself is run again and puts the attempt back.
    process.at = attempts.pop().start


def _halt(machine: Machine, process: Process, step: Instruction) -> None:
    """End the program; in a procedure that an action calls, the MOVE of that action, as in the action itself."""
    if not any(activation.kind == "action" for activation in process.stack):
        finish(machine, process, step.span, "HALT")
        return
    while process.now.kind != "action":
        _leave(machine, process, step.span)
    halt(machine, process, step)


def _stop(machine: Machine, process: Process, step: Instruction) -> None:
    finish(machine, process, step.span, "END")


def rest(machine: Machine, span: Span) -> list[str]:
    """Bring every arm to rest and switch every device off: the run is over once all is still.

    Returns:
        The devices that were on.
    """
    for process in machine.state.processes:
        give_up(machine, process)
    ends = [_still(machine, process, span) for process in machine.state.processes]
    machine.state.ticks = max([*ends, *(_rest_of(machine, arm) for arm in machine.state.runs)])
    not_at_rest = sorted(machine.hardware.running())
    for device in not_at_rest:
        machine.hardware.operate(device, on=False)
    machine.state.over = True
    return not_at_rest


def _still(machine: Machine, process: Process, span: Span) -> int:
    """Give up the motion of a process, if it makes one; return when its arm is at rest [ticks]."""
    if process.motion is None:
        return _rest_of(machine, process.last_arm)
    motion, end = process.motion, stop(machine, process, span)
    note_contact(machine, motion, end)
    words, contact = contact_of(motion)
    process.motion, arm = None, motion.arm
    machine.effect(process, "STOP", f"{arm} stops{words}", span, until=end, arm=arm, data=contact)
    motion.ended, since = motion.ended or EarlyEnd.BRAKED, motion.begun
    data = {**motion.data, **contact}
    machine.effect(process, "MOVE", motion.trace, motion.span, since=since, until=end, arm=arm, data=data)
    return end


def _rest_of(machine: Machine, arm: str | None) -> int:
    """Return when an arm is at rest that nobody moves [ticks]: it may still brake after an error that was recovered."""
    runs = machine.state.runs.get(arm, ()) if arm is not None and machine.mover(arm) is None else ()
    end = math.ceil((runs[-1].t0 + runs[-1].duration) / machine.cell.period - _ROUNDING) if runs else 0
    return max(end, machine.state.ticks)


def finish(machine: Machine, process: Process, span: Span, word: str) -> None:
    """End the program: arms at rest, devices off, the frame table true."""
    not_at_rest = rest(machine, span)
    machine.effect(process, "END", f"{word}{words_of(machine, not_at_rest)}", span, data={"switched_off": not_at_rest})


def words_of(machine: Machine, not_at_rest: Sequence[str]) -> str:
    """Return what is said behind the end of a program of the devices that it switched off."""
    return "".join(f"; {machine.spelled(device)} OFF" for device in not_at_rest)


def recover(machine: Machine, process: Process, error: RunError) -> bool:
    """Go on in the RECOVER part of the innermost TRY around what went wrong.

    What the process had begun is stopped: its branches, its motion; branches without a TRY of their own hand the
    error to the process that began them.

    Returns:
        Whether there is one.
    """
    span, at_rest = error.diagnostic.span, machine.state.ticks
    while True:
        ends = [_cancel(machine, branch, span) for branch in process.branches]
        process.branches = []
        # The arm of the branch that failed may be the last to come to rest.
        process.wake = at_rest = max([at_rest, *ends, _still(machine, process, span)])
        give_up(machine, process)
        process.pending = None
        if (attempt := _attempt(machine, process, span)) is not None:
            process.at = attempt.recovery
            release(machine, process, attempt.locks)
            code, line = error.diagnostic.code, machine.code.source.line(span.start)
            text = f"{code} in line {line}: {error.diagnostic.message}"
            machine.effect(process, "ERROR", text, span, data={"code": code})
            return True
        if process.parent is None:
            machine.state.ticks = process.wake
            return False
        process = process.parent


def _attempt(machine: Machine, process: Process, span: Span) -> Attempt | None:
    """Return the innermost attempt that has not failed yet, now failed, with all activations inside it left."""
    while True:
        attempts = process.now.attempts
        while attempts:
            attempt = attempts.pop()
            if not attempt.recovering:
                failed = Attempt(attempt.start, attempt.recovery, recovering=True, locks=attempt.locks)
                attempts.append(failed)
                return failed
        if len(process.stack) == 1:
            return None
        _leave(machine, process, span)


def _cancel(machine: Machine, process: Process, span: Span) -> int:
    """End a branch with all its own; return when its arms are at rest."""
    if process.done:
        return machine.state.ticks
    ends = [_cancel(machine, branch, span) for branch in process.branches]
    ends.append(_still(machine, process, span))
    end(machine, process)
    return max(ends)


HANDLERS: Mapping[Op, Handler] = {
    Op.JMP: _jump,
    Op.JZ: _jump_if_not,
    Op.FOR: _for,
    Op.CALL: _call,
    Op.RET: _return,
    Op.FORK: _fork,
    Op.JOIN: _join,
    Op.QUIT: _quit,
    Op.SIG: signal,
    Op.WAIT: wait,
    Op.PAUSE: _pause,
    Op.LOCK: lock,
    Op.UNLK: unlock,
    Op.TRY: _try,
    Op.ENDT: _well,
    Op.ENDR: _recovered,
    Op.RETRY: _retry,
    Op.HALT: _halt,
    Op.STOP: _stop,
}
