"""Events and locks: what processes wait for, and since when."""

from armwright.program.bytecode.instructions import Instruction
from armwright.program.language.diagnostic import Label
from armwright.program.vm.machine import Machine, RunError
from armwright.program.vm.move import release
from armwright.program.vm.process import Process, Waiting
from armwright.program.vm.recording import EffectKind


def signal(machine: Machine, process: Process, step: Instruction) -> None:
    """Raise an event, and let those go on that wait for it."""
    name = machine.name(process, step.operands[0])
    machine.state.events[name] = machine.state.events.get(name, 0) + 1
    for other in machine.state.processes:
        if other.waiting and other.waiting.what == "event" and name in other.waiting.names:
            other.waiting, other.wake = None, machine.state.ticks
    machine.effect(process, "SIGNAL", f"SIGNAL {machine.spelled(name)}", step.span, data={"event": name})


def wait(machine: Machine, process: Process, step: Instruction) -> None:
    """Take an event, or wait until there is one."""
    name = machine.name(process, step.operands[0])
    waiting = process.unmet or Waiting("event", (name,), step.span, machine.starts())
    if machine.state.events.get(name, 0) == 0:
        _hold(process, waiting)
        return
    machine.state.events[name] -= 1
    _description(machine, process, waiting)


def lock(machine: Machine, process: Process, step: Instruction) -> None:
    """Take the locks of several variables together, or wait until all of them can be had."""
    names = sorted({machine.name(process, operand) for operand in step.operands})
    waiting = process.unmet or Waiting("locks", tuple(names), step.span, machine.starts())
    if any(_locked_by(machine, name) - {process} for name in names):
        _hold(process, waiting)
        return
    for name in names:
        machine.state.locks[name] = process
    process.locks += names
    _description(machine, process, waiting)


def unlock(machine: Machine, process: Process, step: Instruction) -> None:
    """Give locks back."""
    names = {machine.name(process, operand) for operand in step.operands}
    release(machine, process, len(process.locks) - len(names))


def give_up(machine: Machine, process: Process) -> None:
    """Take note of an event or a lock that a process has waited for in vain, when it is ended."""
    if process.unmet is not None:
        _description(machine, process, process.unmet, in_vain=True)
    process.waiting = None


def _hold(process: Process, waiting: Waiting) -> None:
    """Let a process wait; when what it waits for comes, the same instruction is looked at again."""
    process.at -= 1
    process.waiting = process.unmet = waiting


def _description(machine: Machine, process: Process, waiting: Waiting, *, in_vain: bool = False) -> None:
    """Record what a process has waited for, from the time at which it began to wait."""
    names = waiting.names
    is_event = waiting.what == "event"
    kind: EffectKind = "WAIT" if is_event else "LOCK"
    text = f"{kind} {', '.join(map(machine.spelled, names))}{', in vain' if in_vain else ''}"
    data: dict[str, object] = {"event": names[0]} if is_event else {"variables": list(names)}
    if in_vain:
        data["in_vain"] = True
    machine.effect(process, kind, text, waiting.span, since=waiting.since, data=data)
    process.unmet = None


def _locked_by(machine: Machine, name: str) -> set[Process]:
    """Return the processes that hold a variable; a whole array and its elements keep one another waiting."""
    array, bracket, _ = name.partition("[")
    return {
        holder
        for locked, holder in machine.state.locks.items()
        if locked == name or (bracket and locked == array) or (not bracket and locked.startswith(f"{name}["))
    }


def deadlock(machine: Machine) -> RunError:
    """Return the error of processes that all wait for one another."""
    texts = []
    for process in (stuck := machine.state.stuck):
        assert process.waiting is not None  # noqa: S101 - chosen so
        names = ", ".join(map(machine.spelled, process.waiting.names))
        locks = process.waiting.what == "locks"
        holders = {holder for name in process.waiting.names if locks for holder in _locked_by(machine, name)}
        locked = ", ".join(holder.title for holder in sorted(holders - {process}, key=lambda holder: holder.path))
        text = f"{process.title} waits for {'the lock of ' if locks else ''}{names}"
        texts.append(Label(process.waiting.span, f"{text}, held by {locked}" if locked else text))
    first, *others = texts
    text = f"{len(texts)} processes wait for ever" if others else "the program waits for ever"
    return machine.error(stuck[0], "E501", text, first.span, first.text, secondary=others)
