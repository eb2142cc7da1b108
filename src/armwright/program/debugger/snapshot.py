"""A machine as it is seen at a moment: with every arm where it is then, also in the middle of a motion."""

import copy

import attrs

from armwright.program.debugger.history import Path
from armwright.program.debugger.statements import Statements
from armwright.program.language.source import Span
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Activation, Process


def sampled(machine: Machine, ticks: int) -> Machine:
    """Return a machine for inspection, as things are at a tick; the machine itself stays as it is.

    Between the steps of a program its frame table says where an arm was last known to be. What one sees is where
    its sensors say that it is.

    Args:
        machine: not behind its next step.
        ticks: not behind the time of the next step.
    """
    view = copy.copy(machine)
    view.state = copy.copy(machine.state)
    view.state.ticks = ticks
    moving = {process.motion.arm for process in machine.state.processes if process.motion is not None}
    for name in machine.cell.arms:
        last = machine.state.runs[name][-1] if machine.state.runs[name] else None
        if name not in moving and (last is None or view.now > last.t0 + last.duration):
            # It rests, and the frame table knows where.
            continue
        view.state.tree = view.state.tree.place(name, view.gripper_pose(name))
    return view


def process_of(machine: Machine, path: Path) -> Process | None:
    """Return a process by its position among the branches; None where it has ended or not begun."""
    return next((process for process in machine.state.processes if process.path == path), None)


def mover(machine: Machine, frame: str) -> Process | None:
    """Return the process that moves a frame by moving an arm; None where it rests."""
    arm = machine.carrier(frame) if frame in machine.state.tree else None
    return None if arm is None else machine.mover(arm)


@attrs.frozen(kw_only=True)
class Frame:
    """One level of the stack of a process: the program itself, a procedure, the action of a MOVE.

    Attributes:
        process: whose stack it is of.
        title: for people.
        span: the statement that it is in.
        activation: its names.
        procedure: whose names these are; None for those of the program.
    """

    process: Process
    title: str
    span: Span
    activation: Activation
    procedure: str | None


def stack(machine: Machine, process: Process, statements: Statements) -> list[Frame]:
    """Return where a process is, the innermost first."""
    frames = []
    index, span = process.at, _where(process, statements)
    for activation in reversed(process.stack):
        title, procedure = _title(machine, process, activation), statements.procedure(index)
        frames.append(Frame(process=process, title=title, span=span, activation=activation, procedure=procedure))
        index = activation.back
        if activation.called is not None:
            span = activation.called
    return frames


def _where(process: Process, statements: Statements) -> Span:
    cause = process.waiting or process.pending or process.follows or statements.at(process.at)
    return cause.span


def _title(machine: Machine, process: Process, activation: Activation) -> str:
    if activation.kind == "procedure":
        return machine.spelled(activation.name)
    return f"ON of a MOVE of {process.title}" if activation.kind == "action" else process.title
