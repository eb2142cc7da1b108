"""AFFIX and UNFIX."""

from collections.abc import Mapping

from armwright.cell.frames import WORLD
from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.language.names import is_arm
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.process import Process


def _affix(machine: Machine, process: Process, step: Instruction) -> None:
    operands = [operand for operand in step.operands if operand != "RIGIDLY"]
    rigid = len(operands) < len(step.operands)
    child, parent = machine.name(process, operands[0]), machine.name(process, operands[1])
    spelled = machine.spelled
    if is_arm(child) or child == WORLD:
        text = "an arm cannot be affixed to a frame" if is_arm(child) else f"`{WORLD}` cannot be affixed"
        raise machine.error(
            process, "E308" if is_arm(child) else "E309", text, step.span, "cannot be attached to a frame"
        )
    if is_arm(parent):
        process.last_arm = parent
    step_X = machine.pose(process, operands[2], step) if step.op is Op.AFFAT else None
    machine.held(parent, step, process)
    if step_X is None:
        machine.held(child, step, process)
    if machine.state.tree.would_ring(child, parent):
        note = "frames form a tree with the root WORLD; each is attached to one parent"
        label = f"{spelled(child)} cannot be attached to {'itself' if child == parent else spelled(parent)}"
        chain = [frame for frame in (parent, *machine.state.tree.ancestors(parent)) if frame != child]
        hung = [got for frame in chain for got in machine.origin(frame, f"{spelled(frame)} got its pose here")][:3]
        text = "this AFFIX would close a cycle"
        raise machine.error(process, "E305", text, step.span, label, secondary=hung, notes=[note])
    machine.grow(machine.state.tree.affix(child, parent, step_X, rigid=rigid), child, step.span)
    data = {"child": child, "parent": parent, "rigidly": rigid}
    machine.effect(process, "AFFIX", f"AFFIX {spelled(child)} -> {spelled(parent)}", step.span, data=data)


def _unfix(machine: Machine, process: Process, step: Instruction) -> None:
    child = machine.name(process, step.operands[0])
    spelled = machine.spelled
    if is_arm(child) or child == WORLD:
        code, text = "E308" if is_arm(child) else "E309", f"`{spelled(child)}` cannot be unfixed"
        raise machine.error(process, code, text, step.span, "has no parent")
    machine.held(child, step, process)
    above = machine.state.tree.parent(child)
    if len(step.operands) > 1 and (parent := machine.name(process, step.operands[1])) != above:
        hangs = above is not None and above != WORLD
        instead = f"write `UNFIX {spelled(child)} FROM {spelled(above or WORLD)}`" if hangs else "remove this UNFIX"
        text = f"`{spelled(child)}` is not affixed to `{spelled(parent)}`"
        label = f"is attached to {spelled(above or WORLD)}"
        where = machine.origin(child, "it got its pose here")
        raise machine.error(process, "E306", text, step.span, label, secondary=where, helps=[instead])
    machine.grow(machine.state.tree.unfix(child), child, step.span)
    machine.effect(process, "UNFIX", f"UNFIX {spelled(child)}", step.span, data={"child": child, "parent": above})


HANDLERS: Mapping[Op, Handler] = {Op.AFFIX: _affix, Op.AFFAT: _affix, Op.UNFIX: _unfix}
