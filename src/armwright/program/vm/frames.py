"""AFFIX and UNFIX."""

import itertools
from collections.abc import Mapping

from armwright.cell.frames import WORLD
from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.language.names import is_arm
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.process import Process


def _affix(machine: Machine, process: Process, step: Instruction) -> None:
    operands = [operand for operand in step.operands if operand != "RIGIDLY"]
    rigid = len(operands) < len(step.operands)
    child, parent = machine.resolve_name(process, operands[0]), machine.resolve_name(process, operands[1])
    spelled = machine.spelling
    if is_arm(child) or child == WORLD:
        text = "an arm cannot be affixed to a frame" if is_arm(child) else f"`{WORLD}` cannot be affixed"
        code = "E308" if is_arm(child) else "E309"
        raise machine.error(process, code, text, step.span, "cannot be attached to a frame")
    machine.require_placeable(process, child, step.span)
    if is_arm(parent):
        process.last_arm = parent
    step_X = machine.read_pose(process, operands[2], step.span) if step.op is Op.AFFAT else None
    machine.slot_value(process, parent, step.span)
    if step_X is None:
        machine.slot_value(process, child, step.span)
    if machine.state.tree.would_close_cycle(child, parent):
        note = "frames form a tree with the root WORLD; each is attached to one parent"
        label = f"{spelled(child)} cannot be attached to {'itself' if child == parent else spelled(parent)}"
        chain = [frame for frame in (parent, *machine.state.tree.ancestors(parent)) if frame != child]
        labels = (machine.origin_labels(frame, f"{spelled(frame)} got its pose here") for frame in chain)
        origins = list(itertools.chain.from_iterable(labels))[:3]
        text = "this AFFIX would close a cycle"
        raise machine.error(process, "E305", text, step.span, label, secondary=origins, notes=[note])
    machine.replace_tree(machine.state.tree.affix(child, parent, step_X, rigid=rigid), child, step.span)
    data = {"child": child, "parent": parent, "rigidly": rigid}
    machine.record_effect(process, "AFFIX", f"AFFIX {spelled(child)} -> {spelled(parent)}", step.span, data=data)


def _unfix(machine: Machine, process: Process, step: Instruction) -> None:
    child = machine.resolve_name(process, step.operands[0])
    spelled = machine.spelling
    if is_arm(child) or child == WORLD:
        code, text = "E308" if is_arm(child) else "E309", f"`{spelled(child)}` cannot be unfixed"
        raise machine.error(process, code, text, step.span, "has no parent")
    machine.require_placeable(process, child, step.span)
    machine.slot_value(process, child, step.span)
    parent_name = machine.state.tree.parent(child)
    if len(step.operands) > 1 and (parent := machine.resolve_name(process, step.operands[1])) != parent_name:
        actual = spelled(parent_name or WORLD)
        advice = "remove this UNFIX" if actual == WORLD else f"write `UNFIX {spelled(child)} FROM {actual}`"
        text = f"`{spelled(child)}` is not affixed to `{spelled(parent)}`"
        origins = machine.origin_labels(child, "it got its pose here")
        raise machine.error(
            process, "E306", text, step.span, f"is attached to {actual}", secondary=origins, helps=[advice]
        )
    machine.replace_tree(machine.state.tree.unfix(child), child, step.span)
    data = {"child": child, "parent": parent_name}
    machine.record_effect(process, "UNFIX", f"UNFIX {spelled(child)}", step.span, data=data)


HANDLERS: Mapping[Op, Handler] = {Op.AFFIX: _affix, Op.AFFAT: _affix, Op.UNFIX: _unfix}
