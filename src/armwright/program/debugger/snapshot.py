"""A machine as it is seen at a moment: with every arm where it is then, also in the middle of a motion."""

import copy

import attrs

from armwright.cell.model import base_name
from armwright.kinematics.forward_kinematics import forward
from armwright.program.debugger.history import Path
from armwright.program.debugger.statements import Statements
from armwright.program.language.names import is_arm
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
    for name, arm in machine.cell.arms.items():
        last = machine.state.runs[name][-1] if machine.state.runs[name] else None
        if name not in moving and (last is None or view.now > last.t0 + last.duration):
            # It rests, and the frame table knows where.
            continue
        X_BH = forward(arm.arm, machine.hardware.configuration(name, view.now))
        view.state.tree = view.state.tree.place(name, view.state.tree.world(base_name(name)) @ X_BH)
    return view


def process_of(machine: Machine, path: Path) -> Process | None:
    """Return a process by its position among the branches; None where it has ended or not begun."""
    return next((process for process in machine.state.processes if process.path == path), None)


def mover(machine: Machine, frame: str) -> Process | None:
    """Return the process that moves a frame by moving an arm; None where it rests."""
    if frame not in machine.state.tree:
        return None
    above = (frame, *machine.state.tree.ancestors(frame))
    arm = next((name for name in above if is_arm(name)), None)
    return next(
        (process for process in machine.state.processes if process.motion is not None and process.motion.arm == arm),
        None,
    )


@attrs.frozen(kw_only=True)
class Frame:
    """One level of the stack of a process: the program itself, a procedure, the action of a MOVE.

    Attributes:
        title: for people.
        span: the statement that it is in.
        activation: its names.
        procedure: whose names these are; None for those of the program.
    """

    title: str
    span: Span
    activation: Activation
    procedure: str | None


def stack(machine: Machine, process: Process, statements: Statements) -> list[Frame]:
    """Return where a process is, the innermost first."""
    frames = []
    index, span = process.at, _where(process, statements)
    for activation in reversed(process.stack):
        procedure = statements.procedure(index)
        frames.append(
            Frame(title=_title(machine, process, activation), span=span, activation=activation, procedure=procedure)
        )
        index = activation.back
        if activation.called is not None:
            span = activation.called
    return frames


def _where(process: Process, statements: Statements) -> Span:
    if process.waiting is not None:
        return process.waiting.span
    if process.pending is not None:
        return process.pending.span
    if process.follows is not None:
        return process.follows.span
    return statements.at(process.at).span


def _title(machine: Machine, process: Process, activation: Activation) -> str:
    if activation.kind == "procedure":
        return machine.spelled(activation.name)
    return f"ON of a MOVE of {process.title}" if activation.kind == "action" else process.title
