"""PRINT."""

from collections.abc import Mapping

from armwright.program.bytecode.instructions import Instruction, Op, Text
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.process import Process
from armwright.program.vm.value_text import value_text


def _print(machine: Machine, process: Process, step: Instruction) -> None:
    units = machine.code.units
    line = " ".join(
        operand.value if isinstance(operand, Text) else value_text(machine.read(process, operand, step.span), units)
        for operand in step.operands
    )
    machine.record_effect(process, "PRINT", f'PRINT "{line}"', step.span, data={"printed": line})


HANDLERS: Mapping[Op, Handler] = {Op.PRINT: _print}
