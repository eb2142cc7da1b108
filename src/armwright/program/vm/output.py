"""PRINT and LOG."""

from collections.abc import Mapping

from armwright.program.bytecode.instructions import Instruction, Op, Text
from armwright.program.vm.expressions import joined_text
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.process import Process


def _print(machine: Machine, process: Process, step: Instruction) -> None:
    line = joined_text(machine, process, step, step.operands)
    machine.record_effect(process, "PRINT", f'PRINT "{line}"', step.span, data={"printed": line})


def _log(machine: Machine, process: Process, step: Instruction) -> None:
    name, titles, *operands = step.operands
    assert isinstance(name, Text)  # noqa: S101 - the verifier has seen to it
    assert isinstance(titles, Text)  # noqa: S101 - the verifier has seen to it
    values = [machine.read(process, operand, step.span) for operand in operands]
    shown = joined_text(machine, process, step, operands)
    data = {"log": name.value, "titles": titles.value, "values": values}
    machine.record_effect(process, "LOG", f'LOG "{name.value}" {shown}', step.span, data=data)


HANDLERS: Mapping[Op, Handler] = {Op.PRINT: _print, Op.LOG: _log}
