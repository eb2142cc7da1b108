"""Waits that end in time: for a condition, which is looked at on every servo tick, and for an event."""

import math

from armwright.program.bytecode.instructions import Instruction
from armwright.program.vm.calls import evaluate_instructions
from armwright.program.vm.machine import MAX_PAUSE, Machine, jump_target
from armwright.program.vm.process import Process, WaitReason
from armwright.program.vm.synchronization import abandon_wait, record_wait

# A time this part of a period behind a tick is on it.
_TICK_TOLERANCE = 1e-9


def wait_until(machine: Machine, process: Process, step: Instruction) -> None:
    """Look at the condition; where it does not hold, look again on the next tick, until it is too late."""
    waiting = process.unfulfilled_wait
    if waiting is None:
        deadline = _deadline(machine, process, step, 3)
        waiting = WaitReason("condition", (), step.span, machine.next_start(), deadline)
    truth = str(step.operands[1])
    process.stack.append(process.activation.create_nested("condition"))
    evaluate_instructions(machine, process, machine.code.instructions, jump_target(step, 0))
    process.stack.pop()
    if process.activation.temporaries[truth]:
        process.unfulfilled_wait = waiting
        record_wait(machine, process, waiting)
    elif waiting.deadline is not None and machine.state.ticks >= waiting.deadline:
        process.unfulfilled_wait = waiting
        abandon_wait(machine, process)
        process.pc = jump_target(step, 2)
    else:
        process.pc -= 1
        process.unfulfilled_wait, process.wake_tick = waiting, machine.state.ticks + 1


def wait_within(machine: Machine, process: Process, step: Instruction) -> None:
    """Take an event, or wait until there is one or it is too late."""
    name = machine.resolve_name(process, step.operands[0])
    waiting = process.unfulfilled_wait
    if waiting is None:
        deadline = _deadline(machine, process, step, 2)
        waiting = WaitReason("event", (name,), step.span, machine.next_start(), deadline)
    process.unfulfilled_wait = waiting
    if machine.state.events.get(name, 0):
        machine.state.events[name] -= 1
        record_wait(machine, process, waiting)
    elif waiting.deadline is not None and machine.state.ticks < waiting.deadline:
        # A SIGNAL lets it look again before.
        process.pc -= 1
        process.wake_tick = waiting.deadline
    else:
        abandon_wait(machine, process)
        process.pc = jump_target(step, 1)


def too_late(machine: Machine, process: Process, step: Instruction) -> None:
    """Say that a condition did not hold in time.

    Raises:
        RunError: always.
    """
    text, label = "what this WAIT waits for did not come in time", "waited here"
    raise machine.error(process, "E507", text, step.span, label, helps=["write ELSE and what to do then"])


def _deadline(machine: Machine, process: Process, step: Instruction, operand: int) -> int | None:
    """Return the tick at which it is too late; None where the operand with the time is missing."""
    if len(step.operands) <= operand:
        return None
    seconds = machine.read_number(process, step.operands[operand], step.span)
    if not 0 <= seconds <= MAX_PAUSE:
        text = f"WITHIN {seconds:g} s is not possible"
        raise machine.error(process, "E231", text, step.span, f"expected 0 to {MAX_PAUSE:g} s")
    return machine.state.ticks + math.ceil(seconds / machine.cell.period - _TICK_TOLERANCE)
