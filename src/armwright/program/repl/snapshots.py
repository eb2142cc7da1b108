"""A machine between two statements: going on from there without losing the way back."""

from collections.abc import Callable, Iterable, Mapping

import attrs

from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.cell.model import Cell
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.program.bytecode.instructions import Code, Op
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source, Span
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.vm.interpreter import advance, motion_warnings, next_process
from armwright.program.vm.machine import Limits, Machine
from armwright.program.vm.process import Process


def new_machine(cell: Cell, source: Source, limits: Limits) -> Machine:
    """Return a machine that has done nothing yet."""
    return Machine(Code(instructions=(), types=PREDECLARED, source=source), cell, kinematic_cell(cell), limits)


def load_code(machine: Machine, code: Code, limits: Limits) -> Machine:
    """Return a machine in the same state that stands in front of other code, with all that its program declares.

    Args:
        machine: between two statements.
        code: of what is to be done next.
        limits: when that is taken to run for ever.
    """
    loaded = machine.copy().with_code(code)
    state = loaded.state
    state.types, state.locks, state.owners, state.idle_steps = dict(code.types), {}, {}, 0
    for name, kind in code.types.items():
        if kind == VariableType(VariableKind.FRAME):
            state.tree = state.tree.declare(name)
    state.program = Process(wake_tick=state.ticks, last_arm=state.program.last_arm)
    state.processes = [state.program]
    loaded.limits = attrs.evolve(limits, time=machine.now + limits.time)
    return loaded


def run_statement(machine: Machine) -> None:
    """Run the code of a machine to its end, or to a HALT; devices that are on stay on.

    Raises:
        RunError: as ``interpret.run`` does.
    """
    program = machine.state.program
    while not machine.state.has_ended:
        process = next_process(machine)
        at_end = machine.code.instructions[program.pc].op is Op.STOP
        if process is program and at_end and program.pending_effect is None and program.motion is None:
            machine.state.ticks = max(machine.state.ticks, program.wake_tick)
            return
        advance(machine, process)


def new_warnings(before: Machine, after: Machine) -> tuple[Diagnostic, ...]:
    """Return the warnings about motions that one machine has made and its twin has not."""
    return motion_warnings(after.state.stages[len(before.state.stages) :], after.cell)


# ---- names and cells that change -----------------------------------------------------------------------------------


def rename_variables(machine: Machine, names: Mapping[str, str]) -> None:
    """Let variables have other names from now on."""

    def new_name(slot: str) -> str:
        base, bracket, indices = slot.partition("[")
        return f"{names.get(base, base)}{bracket}{indices}"

    machine.state.tree = _rename_frames(machine.state.tree, names, new_name)
    machine.state.trees = [(time, _rename_frames(tree, names, new_name)) for time, tree in machine.state.trees]
    machine.state.values = {new_name(name): value for name, value in machine.state.values.items()}
    machine.state.events = {new_name(name): count for name, count in machine.state.events.items()}
    machine.state.pose_origins = {new_name(name): span for name, span in machine.state.pose_origins.items()}
    for hand in machine.state.hands.values():
        hand.reached_frame = hand.reached_frame and new_name(hand.reached_frame)
        hand.held_frame = hand.held_frame and new_name(hand.held_frame)


def _rename_frames(tree: FrameTree, names: Mapping[str, str], new_name: Callable[[str], str]) -> FrameTree:
    if not any(name.partition("[")[0] in names for name in tree.nodes):
        return tree
    return FrameTree(
        {new_name(name): attrs.evolve(node, parent=new_name(node.parent)) for name, node in tree.nodes.items()}
    )


def remove_unused(machine: Machine, names: Iterable[str]) -> None:
    """Take declared variables away that were never used."""
    for name in names:
        if name in machine.state.tree and not machine.has_pose(name):
            machine.state.tree = machine.state.tree.without(name)


def import_frames(machine: Machine, frames: Mapping[str, Node], span: Span) -> None:
    """Put frames of an imported file where they stand, those aside that have a place already."""
    nodes = dict(machine.state.tree.nodes)
    remaining = {name: node for name, node in frames.items() if not machine.has_pose(name)}
    while ready := [name for name, node in remaining.items() if node.parent == WORLD or node.parent in nodes]:
        nodes.update((name, remaining.pop(name)) for name in ready)
    machine.cell = attrs.evolve(machine.cell, frames={**frames, **machine.cell.frames})
    machine.state.tree = FrameTree(nodes)
    for name in frames:
        if name in nodes:
            machine.replace_tree(machine.state.tree, name, span)
