"""Events and locks: what processes wait for, and since when."""

from armwright.program.bytecode.instructions import Instruction
from armwright.program.language.diagnostic import Label
from armwright.program.vm.machine import Machine, RunError
from armwright.program.vm.process import Process, WaitReason
from armwright.program.vm.recording import EffectKind


def signal(machine: Machine, process: Process, step: Instruction) -> None:
    """Raise an event, and let those go on that wait for it."""
    name = machine.resolve_name(process, step.operands[0])
    machine.state.events[name] = machine.state.events.get(name, 0) + 1
    for other in machine.state.processes:
        if other.waiting and other.waiting.kind == "event" and name in other.waiting.names:
            other.waiting, other.wake_tick = None, machine.state.ticks
        elif (limited := other.unfulfilled_wait) and limited.deadline is not None and name in limited.names:
            other.wake_tick = machine.state.ticks
    machine.hardware.note_event(name)
    machine.record_effect(process, "SIGNAL", f"SIGNAL {machine.spelling(name)}", step.span, data={"event": name})


def wait(machine: Machine, process: Process, step: Instruction) -> None:
    """Take an event, or wait until there is one."""
    name = machine.resolve_name(process, step.operands[0])
    waiting = process.unfulfilled_wait or WaitReason("event", (name,), step.span, machine.next_start())
    if machine.state.events.get(name, 0) == 0:
        _suspend(process, waiting)
        return
    machine.state.events[name] -= 1
    record_wait(machine, process, waiting)


def lock(machine: Machine, process: Process, step: Instruction) -> None:
    """Take the locks of several variables together, or wait until all of them can be had."""
    names = sorted({machine.resolve_name(process, operand) for operand in step.operands})
    waiting = process.unfulfilled_wait or WaitReason("locks", tuple(names), step.span, machine.next_start())
    if any(_lock_holders(machine, name) - {process} for name in names):
        _suspend(process, waiting)
        return
    for name in names:
        machine.state.locks[name] = process
    process.locks += names
    record_wait(machine, process, waiting)


def unlock(machine: Machine, process: Process, step: Instruction) -> None:
    """Give locks back."""
    names = {machine.resolve_name(process, operand) for operand in step.operands}
    release_locks(machine, process, len(process.locks) - len(names))


def release_locks(machine: Machine, process: Process, keep_count: int) -> None:
    """Give back the locks that a process took after its first ``keep_count``; whoever waits for one looks again."""
    for name in process.locks[keep_count:]:
        if name not in process.locks[:keep_count]:
            machine.state.locks.pop(name, None)
    del process.locks[keep_count:]
    for other in machine.state.processes:
        if other.waiting and other.waiting.kind == "locks":
            other.waiting, other.wake_tick = None, machine.state.ticks


def abandon_wait(machine: Machine, process: Process) -> None:
    """Take note of an event or a lock that a process has waited for in vain, when it is ended."""
    if process.unfulfilled_wait is not None:
        record_wait(machine, process, process.unfulfilled_wait, in_vain=True)
    process.waiting = None


def _suspend(process: Process, waiting: WaitReason) -> None:
    """Let a process wait; when what it waits for comes, the same instruction is looked at again."""
    process.pc -= 1
    process.waiting = process.unfulfilled_wait = waiting


def record_wait(machine: Machine, process: Process, waiting: WaitReason, *, in_vain: bool = False) -> None:
    """Record what a process has waited for, from the time at which it began to wait."""
    if waiting.kind == "condition":
        data: dict[str, object] = {"in_vain": True} if in_vain else {}
        written = " ".join(machine.code.source.slice(waiting.span).split())
        text = f"{written}{', in vain' if in_vain else ''}"
        machine.record_effect(process, "WAIT", text, waiting.span, since=waiting.start, data=data)
        process.unfulfilled_wait = None
        return
    names = waiting.names
    is_event = waiting.kind == "event"
    kind: EffectKind = "WAIT" if is_event else "LOCK"
    text = f"{kind} {', '.join(map(machine.spelling, names))}{', in vain' if in_vain else ''}"
    data = {"event": names[0]} if is_event else {"variables": list(names)}
    if in_vain:
        data["in_vain"] = True
    machine.record_effect(process, kind, text, waiting.span, since=waiting.start, data=data)
    process.unfulfilled_wait = None


def _lock_holders(machine: Machine, name: str) -> set[Process]:
    """Return the processes that hold a variable; a whole array and its elements keep one another waiting."""
    array, bracket, _ = name.partition("[")
    return {
        holder
        for locked, holder in machine.state.locks.items()
        if locked == name or (bracket and locked == array) or (not bracket and locked.startswith(f"{name}["))
    }


def deadlock_error(machine: Machine) -> RunError:
    """Return the error of processes that all wait for one another."""
    texts = []
    for process in (stuck := machine.state.blocked_processes):
        assert process.waiting is not None  # noqa: S101 - chosen so
        names = ", ".join(map(machine.spelling, process.waiting.names))
        locks = process.waiting.kind == "locks"
        holders = {holder for name in process.waiting.names if locks for holder in _lock_holders(machine, name)}
        locked = ", ".join(holder.title for holder in sorted(holders - {process}, key=lambda holder: holder.path))
        running = process.interruption
        title = process.title if running is None else f"{running.title} of {process.title}"
        text = f"{title} waits for {'the lock of ' if locks else ''}{names}"
        texts.append(Label(process.waiting.span, f"{text}, held by {locked}" if locked else text))
    first, *others = texts
    text = f"{len(texts)} processes wait for ever" if others else "the program waits for ever"
    return machine.error(stuck[0], "E501", text, first.span, first.text, secondary=others)
