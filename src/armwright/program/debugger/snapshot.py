"""A machine as it is seen at a moment: with every arm where it is then, also in the middle of a motion."""

import copy

import attrs

from armwright.program.debugger.history import ProcessPath
from armwright.program.debugger.statements import Statements
from armwright.program.language.source import Span
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Activation, Process


def view_at(machine: Machine, ticks: int) -> Machine:
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
        last = machine.state.segments[name][-1] if machine.state.segments[name] else None
        if name not in moving and (last is None or view.now > last.t0 + last.duration):
            # It rests, and the frame table knows where.
            continue
        view.state.tree = view.state.tree.set_pose(name, view.gripper_pose(name))
    return view


def find_process(machine: Machine, path: ProcessPath) -> Process | None:
    """Return a process by its position among the branches; None where it has ended or not begun."""
    return next((process for process in machine.state.processes if process.path == path), None)


def moving_process(machine: Machine, frame: str) -> Process | None:
    """Return the process that moves a frame by moving an arm; None where it rests."""
    arm = machine.carrier(frame) if frame in machine.state.tree else None
    return None if arm is None else machine.moving_process(arm)


@attrs.frozen(kw_only=True)
class StackFrame:
    """One level of the stack of a process: the program itself, a procedure, the action of a MOVE or of a WHEN.

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


def call_stack(machine: Machine, process: Process, statements: Statements) -> list[StackFrame]:
    """Return where a process is, the innermost first."""
    frames = []
    cause = process.waiting or process.pending_effect or process.followed_motion or statements.statement_at(process.pc)
    index, span = process.pc, cause.span
    for activation in reversed(process.stack):
        title, procedure = _frame_title(machine, process, activation), statements.procedure_at(index)
        frames.append(StackFrame(process=process, title=title, span=span, activation=activation, procedure=procedure))
        index = activation.return_address
        if activation.call_span is not None:
            span = activation.call_span
    return frames


def _frame_title(machine: Machine, process: Process, activation: Activation) -> str:
    if activation.kind == "procedure":
        return machine.spelling(activation.name)
    if activation.interrupted is not None:
        return activation.interrupted.title
    return f"ON of a MOVE of {process.title}" if activation.kind == "action" else process.title
