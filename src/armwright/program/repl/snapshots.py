"""A machine between two statements: going on from there without losing the way back."""

import copy
from collections.abc import Callable, Iterable, Mapping

import attrs

from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.cell.model import Cell
from armwright.cell.simulator import Simulator
from armwright.program.bytecode.instructions import Code, Op
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source, Span
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.vm.interpreter import advance, due, warnings
from armwright.program.vm.machine import Hand, Limits, Machine
from armwright.program.vm.process import Activation, Process
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import from_noap


def fresh(cell: Cell, source: Source, limits: Limits) -> Machine:
    """Return a machine that has done nothing yet."""
    return Machine(Code(instructions=(), types=PREDECLARED, source=source), cell, Simulator(cell), limits)


def twin(machine: Machine) -> Machine:
    """Return a machine in the same state, between two statements; what one of them does does not change the other."""
    hardware = machine.hardware
    assert isinstance(hardware, Simulator)  # noqa: S101 - only a simulated cell can be taken back
    other = copy.copy(machine)
    other.hardware = hardware.twin()
    other.types, other.values = dict(machine.types), dict(machine.values)
    other.events, other.written = dict(machine.events), dict(machine.written)
    other.locks, other.owners = {}, {}
    other.hands = {name: Hand(hand.at, hand.holds) for name, hand in machine.hands.items()}
    other.effects, other.stages, other.trees = list(machine.effects), list(machine.stages), list(machine.trees)
    other.runs = {name: list(runs) for name, runs in machine.runs.items()}
    other.pushes = {name: list(pushes) for name, pushes in machine.pushes.items()}
    other.program = Process(
        path=(),
        priority=0.0,
        at=0,
        wake=machine.ticks,
        stack=[Activation(kind="main")],
        last_arm=machine.program.last_arm,
    )
    other.processes = [other.program]
    return other


def with_code(machine: Machine, code: Code, limits: Limits) -> Machine:
    """Return a machine in the same state that stands in front of other code, with all that its program declares.

    Args:
        machine: between two statements.
        code: of what is to be done next.
        limits: when that is taken to run for ever.
    """
    other = twin(machine)
    other.code, other.types = code, dict(code.types)
    other.constants = [from_noap(value) if isinstance(value, tuple) else float(value) for value in code.constants]
    other.limits = attrs.evolve(limits, time=machine.now + limits.time)
    other.idle = 0
    for name, kind in code.types.items():
        if kind == VariableType(VariableKind.FRAME):
            other.tree = other.tree.declare(name)
    return other


def go_through(machine: Machine) -> None:
    """Run the code of a machine to its end, or to a HALT; devices that are on stay on.

    Raises:
        RunError: as ``interpret.run`` does.
    """
    program = machine.program
    while not machine.over:
        process = due(machine)
        at_end = machine.code.instructions[program.at].op is Op.STOP
        if process is program and at_end and program.pending is None and program.motion is None:
            machine.ticks = max(machine.ticks, program.wake)
            return
        advance(machine, process)


def new_warnings(before: Machine, after: Machine) -> tuple[Diagnostic, ...]:
    """Return the warnings about motions that one machine has made and its twin has not."""
    stages = tuple(after.stages[len(before.stages) :])
    if not stages:
        return ()
    recording = Recording(
        cell=after.cell,
        duration=after.now,
        effects=(),
        stages=stages,
        streams=(),
        trees=tuple(after.trees),
        postures={},
    )
    return warnings(recording)


# ---- names and cells that change -----------------------------------------------------------------------------------


def rename(machine: Machine, names: Mapping[str, str]) -> None:
    """Let variables have other names from now on."""

    def other(kept: str) -> str:
        base, bracket, indices = kept.partition("[")
        return f"{names.get(base, base)}{bracket}{indices}"

    machine.tree = _renamed(machine.tree, names, other)
    machine.trees = [(time, _renamed(tree, names, other)) for time, tree in machine.trees]
    machine.values = {other(name): value for name, value in machine.values.items()}
    machine.events = {other(name): count for name, count in machine.events.items()}
    machine.written = {other(name): span for name, span in machine.written.items()}
    for hand in machine.hands.values():
        hand.at = hand.at and other(hand.at)
        hand.holds = hand.holds and other(hand.holds)


def _renamed(tree: FrameTree, names: Mapping[str, str], other: Callable[[str], str]) -> FrameTree:
    if not any(name.partition("[")[0] in names for name in tree.nodes):
        return tree
    return FrameTree({other(name): attrs.evolve(node, parent=other(node.parent)) for name, node in tree.nodes.items()})


def forget(machine: Machine, names: Iterable[str]) -> None:
    """Take declared variables away that were never used."""
    for name in names:
        if name in machine.tree and not machine.has_place(name):
            machine.tree = machine.tree.without(name)


def bring(machine: Machine, frames: Mapping[str, Node], span: Span) -> None:
    """Put frames of an imported file where they stand, those aside that have a place already."""
    nodes = dict(machine.tree.nodes)
    waiting = {name: node for name, node in frames.items() if not machine.has_place(name)}
    while ready := [name for name, node in waiting.items() if node.parent == WORLD or node.parent in nodes]:
        nodes.update((name, waiting.pop(name)) for name in ready)
    machine.cell = attrs.evolve(machine.cell, frames={**frames, **machine.cell.frames})
    machine.tree = FrameTree(nodes)
    for name in frames:
        if name in nodes:
            machine.grow(machine.tree, name, span)
