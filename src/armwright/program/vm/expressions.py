"""Values of expressions: constants, operations, elements of arrays, measured forces."""

import math
from collections.abc import Mapping, Sequence

from armwright.cell.hardware import DeviceError
from armwright.program.bytecode.instructions import Constant, Instruction, Op, Operand
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.operators import OPERATIONS, OPERATIONS_WITH_UNITS, EvaluationError
from armwright.program.vm.process import ElementReference, Process, Value
from armwright.program.vm.queues import current_queue
from armwright.program.vm.value_text import value_text

# Components of a wrench: forces, then moments.
_COMPONENTS = {"X": 0, "Y": 1, "Z": 2, "MX": 3, "MY": 4, "MZ": 5}
# An index this near to a whole number is that number.
_INTEGER_TOLERANCE = 1e-9
# Texts are messages: of longer ones a loop has made too much.
_MAX_TEXT = 1000


def _load(machine: Machine, process: Process, step: Instruction) -> None:
    constant = step.operands[1]
    assert isinstance(constant, Constant)  # noqa: S101 - the translator gives one
    machine.write(process, step.operands[0], machine.constants[constant.index], step.span)


def _copy(machine: Machine, process: Process, step: Instruction) -> None:
    machine.write(process, step.operands[0], machine.read(process, step.operands[1], step.span), step.span)


def _compute(machine: Machine, process: Process, step: Instruction) -> None:
    values = [machine.read(process, operand, step.span) for operand in step.operands[1:]]
    units = (machine.code.units,) if step.op in OPERATIONS_WITH_UNITS else ()
    try:
        value = OPERATIONS[step.op](*values, *units)
    except EvaluationError as fault:
        raise machine.error(process, fault.code, fault.message, step.span, fault.label) from None
    machine.write(process, step.operands[0], value, step.span)


def _element(machine: Machine, process: Process, step: Instruction) -> None:
    """Find an element; a value in passing becomes it, not what it holds."""
    array = machine.resolve_name(process, step.operands[1])
    sizes = machine.state.types[array].sizes
    indices = []
    for number, (operand, size) in enumerate(zip(step.operands[2:], sizes, strict=True), 1):
        value = machine.read_number(process, operand, step.span)
        index = round(value) if math.isfinite(value) else 0
        if abs(value - index) > _INTEGER_TOLERANCE or not 1 <= index <= size:
            index_name = f"index {number}" if len(sizes) > 1 else "the index"
            text = f"{index_name} of `{machine.spelling(array)}` is {value:g}, not an integer from 1 to {size}"
            raise machine.error(process, "E222", text, step.span, "no such element")
        indices.append(index)
    target = step.operands[0]
    assert isinstance(target, str)  # noqa: S101 - the translator gives a value in passing
    process.activation.temporaries[target] = ElementReference(f"{array}[{','.join(map(str, indices))}]")
    process.activation.temporary_spans[target] = step.span


def _force(machine: Machine, process: Process, step: Instruction) -> None:
    arm = process.motion.arm if process.motion else process.last_arm
    value = 0.0
    if arm is not None:
        value = float(machine.hardware.contact_wrench(arm, machine.now)[_COMPONENTS[str(step.operands[1])]])
    machine.write(process, step.operands[0], value, step.span)


def joined_text(machine: Machine, process: Process, step: Instruction, operands: Sequence[Operand]) -> str:
    """Return values and texts as PRINT writes them: with a blank between each two."""
    units = machine.code.units
    return " ".join(value_text(machine.read(process, operand, step.span), units) for operand in operands)


def _text(machine: Machine, process: Process, step: Instruction) -> None:
    text = joined_text(machine, process, step, step.operands[1:])
    if len(text) > _MAX_TEXT:
        message = f"a text of {len(text)} characters is too long"
        raise machine.error(process, "E240", message, step.span, f"more than {_MAX_TEXT}")
    machine.write(process, step.operands[0], text, step.span)


def _truth(machine: Machine, process: Process, step: Instruction) -> None:
    machine.write(process, step.operands[0], step.operands[1] == "TRUE", step.span)


def _message(machine: Machine, process: Process, step: Instruction) -> None:
    machine.write(process, step.operands[0], process.message, step.span)


def _time(machine: Machine, process: Process, step: Instruction) -> None:
    machine.write(process, step.operands[0], machine.now, step.span)


def _timer(machine: Machine, process: Process, step: Instruction) -> None:
    machine.write(process, step.operands[0], machine.timer(str(step.operands[1])), step.span)


def _signal(machine: Machine, process: Process, step: Instruction) -> None:
    """Read an input or a device."""
    name, is_input = str(step.operands[1]), step.op in (Op.INPUT, Op.ANALOG)
    try:
        if is_input:
            value = machine.hardware.read_input(name, analogue=step.op is Op.ANALOG)
        else:
            value = machine.hardware.read_output(name)
    except DeviceError as error:
        code = "R608" if is_input else "R602"
        raise machine.error(process, code, str(error), step.span, "it is read here") from None
    is_truth = step.op in (Op.INPUT, Op.OUTPUT)
    machine.write(process, step.operands[0], value != 0 if is_truth else value, step.span)


def _queue(machine: Machine, process: Process, step: Instruction) -> None:
    """Read how many frames are ahead of the arm, how many there may be, or where one of them is."""
    queue = current_queue(machine, process, str(step.operands[1]), step.span)
    ahead = queue.ahead(machine.now)
    if step.op is not Op.AWAITED:
        value: Value = float(ahead if step.op is Op.QUEUED else queue.capacity)
    else:
        asked = machine.read_number(process, step.operands[2], step.span)
        if asked != round(asked) or not 1 <= asked <= ahead:
            text = f"frame {asked:g} of the queue of {queue.arm} is not ahead"
            label = f"there are {ahead}" if ahead else "there is none"
            raise machine.error(process, "E222", text, step.span, label)
        value = queue.frames[len(queue.frames) - ahead + round(asked) - 1]
    machine.write(process, step.operands[0], value, step.span)


HANDLERS: Mapping[Op, Handler] = {
    Op.LOADM: _load,
    Op.LOADS: _load,
    Op.COPY: _copy,
    **dict.fromkeys(OPERATIONS, _compute),
    Op.ELEM: _element,
    Op.FORCE: _force,
    Op.TIME: _time,
    Op.MESSAGE: _message,
    Op.TIMER: _timer,
    **dict.fromkeys((Op.INPUT, Op.ANALOG, Op.OUTPUT, Op.SETTING), _signal),
    **dict.fromkeys((Op.QUEUED, Op.CAPACITY, Op.AWAITED), _queue),
    Op.TEXT: _text,
    Op.LOADB: _truth,
}
