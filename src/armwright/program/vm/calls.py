"""Jumps, and procedures and functions: what a process needs beside values to work out a condition."""

from collections.abc import Mapping, Sequence

from armwright.program.bytecode.instructions import Instruction, Op, Operand
from armwright.program.language.kinds import BY_VALUE, VariableKind
from armwright.program.language.source import Span
from armwright.program.vm import expressions
from armwright.program.vm.machine import Handler, Machine, jump_target
from armwright.program.vm.process import Activation, ElementReference, Process
from armwright.program.vm.synchronization import release_locks

# A last pass that rounding would leave out is made.
_ROUNDING = 1e-9


def _jump(machine: Machine, process: Process, step: Instruction) -> None:  # noqa: ARG001 - a handler
    process.pc = jump_target(step, 0)


def _jump_if_not(machine: Machine, process: Process, step: Instruction) -> None:
    if not machine.read(process, step.operands[0], step.span):
        process.pc = jump_target(step, 1)


def _for(machine: Machine, process: Process, step: Instruction) -> None:
    variable, count, *bounds = step.operands[:5]
    passes = machine.read_number(process, count, step.span)
    first, last, increment = (machine.read_number(process, bound, step.span) for bound in bounds)
    if increment == 0:
        raise machine.error(process, "E229", "the STEP of this FOR is 0", step.span, "it would never end")
    if passes > (last - first) / increment + _ROUNDING:
        process.pc = jump_target(step, 5)
        return
    machine.write(process, variable, first + passes * increment, step.span)
    machine.write(process, count, passes + 1, step.span)


# ---- procedures ----------------------------------------------------------------------------------------------------


def _call(machine: Machine, process: Process, step: Instruction) -> None:
    _enter(machine, process, step, str(step.operands[0]), step.operands[1:])


def _call_function(machine: Machine, process: Process, step: Instruction) -> None:
    """Begin a function; where a process stands in a condition, all of it is done at once."""
    _enter(machine, process, step, str(step.operands[1]), step.operands[2:], result=str(step.operands[0]))


def _enter(
    machine: Machine, process: Process, step: Instruction, name: str, arguments: Sequence[Operand], *, result: str = ""
) -> None:
    """Begin a procedure or function with its arguments."""
    procedure = machine.code.procedures[name]
    if len(process.stack) > machine.limits.depth:
        text = f"procedure calls are nested more than {machine.limits.depth} deep"
        raise machine.error(process, "E505", text, step.span, f"`{machine.spelling(name)}` is called once more")
    machine.state.activation_count += 1
    bindings, local_slots = {}, []
    for key, kind in procedure.types.items():
        slot = f"{key}'{machine.state.activation_count}"
        if key in procedure.parameters:
            operand = arguments[procedure.parameters.index(key)]
            by_value = not kind.sizes and kind.kind in BY_VALUE and key not in procedure.inout
            argument = None if by_value else machine.variable_name(process, operand)
            if argument is not None:
                bindings[key] = argument
                continue
            if by_value:
                value = machine.read(process, operand, step.span)
                assert not isinstance(value, ElementReference)  # noqa: S101 - elements have been read
                machine.state.values[slot] = value
            else:
                X_WF = machine.read_pose(process, operand, step.span)
                machine.replace_tree(machine.state.tree.set_pose(slot, X_WF), slot, step.span)
        bindings[key] = slot
        machine.state.types[slot] = kind
        local_slots.append(slot)
    activation = Activation("procedure", name, bindings, return_address=process.pc, call_span=step.span, result=result)
    activation.local_slots, activation.lock_count = tuple(local_slots), len(process.locks)
    process.stack.append(activation)
    process.pc = procedure.start


def return_(machine: Machine, process: Process, step: Instruction) -> None:
    """Leave a procedure or an action, and go on where it was begun."""
    process.pc = process.activation.return_address
    leave_activation(machine, process, step.span)


def _return_value(machine: Machine, process: Process, step: Instruction) -> None:
    value, activation = machine.read(process, step.operands[0], step.span), process.activation
    process.pc = activation.return_address
    leave_activation(machine, process, step.span)
    machine.write(process, activation.result, value, activation.call_span or step.span)


def _no_value(machine: Machine, process: Process, step: Instruction) -> None:
    name = machine.spelling(process.activation.name)
    text = f"FUNCTION `{name}` has ended without a value"
    raise machine.error(process, "E234", text, step.span, "no RETURN came before this END")


def leave_activation(machine: Machine, process: Process, span: Span) -> None:
    """Leave the present activation: its variables are gone, its locks given back."""
    activation = process.stack.pop()
    release_locks(machine, process, activation.lock_count)
    process.forget_watches()
    for slot in activation.local_slots:
        kind = machine.state.types.pop(slot)
        elements = [name for name in machine.state.tree if name.startswith(f"{slot}[")] if kind.sizes else []
        for name in (slot, *elements):
            if kind.kind is VariableKind.FRAME and name in machine.state.tree:
                machine.replace_tree(machine.state.tree.without(name), name, span)
                machine.state.pose_origins.pop(name, None)
                for hand in machine.state.hands.values():
                    hand.forget_frame(name)
        for name in [value for value in machine.state.values if value == slot or value.startswith(f"{slot}[")]:
            del machine.state.values[name]
        machine.state.events.pop(slot, None)


# ---- conditions ----------------------------------------------------------------------------------------------------


def evaluate_instructions(machine: Machine, process: Process, steps: Sequence[Instruction], index: int = 0) -> None:
    """Do instructions that only give values, up to RET or the last: those of a condition or an expression."""
    while index < len(steps) and (step := steps[index]).op is not Op.RET:
        index += 1
        if step.op is Op.JZ:
            # AND and OR jump forwards; nothing else in an expression jumps.
            index = index if machine.read(process, step.operands[0], step.span) else jump_target(step, 1)
        elif step.op is Op.CALLF:
            _evaluate_function(machine, process, step)
        else:
            expressions.HANDLERS[step.op](machine, process, step)


def _evaluate_function(machine: Machine, process: Process, step: Instruction) -> None:
    """Do all of a function at once: it takes no time, and has no effects."""
    depth, outside, instructions = len(process.stack), process.pc, machine.code.instructions
    _call_function(machine, process, step)
    while len(process.stack) > depth:
        step = instructions[process.pc]
        machine.count_step(process, step.span)
        process.pc += 1
        _OF_FUNCTIONS[step.op](machine, process, step)
    process.pc = outside


def _raise(machine: Machine, process: Process, step: Instruction) -> None:
    """Fail with an error of the program's own."""
    kind = str(step.operands[0])
    text = f"error `{machine.spelling(kind)}` is raised"
    if len(step.operands) > 1:
        text = str(machine.read(process, step.operands[1], step.span)) or text
    helps = [f"write TRY and `RECOVER ({machine.spelling(kind)})` around it to go on"]
    error = machine.error(process, "E508", text, step.span, f"raised as {machine.spelling(kind)}", helps=helps)
    error.kind = kind
    raise error


CALLS: Mapping[Op, Handler] = {
    Op.RAISE: _raise,
    Op.JMP: _jump,
    Op.JZ: _jump_if_not,
    Op.FOR: _for,
    Op.CALL: _call,
    Op.CALLF: _call_function,
    Op.RETV: _return_value,
    Op.NORET: _no_value,
    Op.RET: return_,
}
_OF_FUNCTIONS = {**expressions.HANDLERS, **CALLS}
