"""PRINT."""

from collections.abc import Mapping

from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.vm.expressions import joined_text
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.process import Process


def _print(machine: Machine, process: Process, step: Instruction) -> None:
    line = joined_text(machine, process, step, step.operands)
    machine.record_effect(process, "PRINT", f'PRINT "{line}"', step.span, data={"printed": line})


HANDLERS: Mapping[Op, Handler] = {Op.PRINT: _print}
