"""What the instructions of one MOVE ask for, gathered and checked."""

from collections.abc import Mapping, Sequence
from itertools import takewhile
from types import MappingProxyType
from typing import NamedTuple

from armwright.arrays import Array
from armwright.motion.tool_limits import ToolLimits
from armwright.program.bytecode.instructions import Code, Form, Instruction, Op, Operand
from armwright.program.language.source import Span
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, NORMAL_SPEED
from armwright.program.vm.machine import Machine, jump_target
from armwright.program.vm.process import Correction, Guard, Process

# The parts of a MOVE that are numbers.
_NUMBERS = {
    Op.MVSPD: "speed",
    Op.MVBLD: "blend",
    Op.MVDUR: "duration",
    Op.MVVEL: "velocity",
    Op.MVROT: "rotation",
    Op.MVACC: "acceleration",
    Op.MVBND: "bound",
    Op.MVRAT: "rate",
}
# The longest MOVE; more is a slip of units [s].
_MAX_DURATION = 1e6
# What may take a pose: of the operations in a condition all others take numbers.
READS_POSES = {op for op in Op if set("Pvtx") & set(op.signature.partition("=")[2] or op.signature)}


class Goal(NamedTuple):
    """One frame of a MOVE: as its stages are called by, its operand, the part of the program that names it."""

    label: str
    operand: Operand
    span: Span


class MoveRequest(NamedTuple):
    """What the instructions of one MOVE ask for; the joint positions of its goal, or the joint target it is.

    ``correction`` is that of its path by a sensor, and ``tracked`` the frame of the cell with which the goal moves.

    Of several MOVEs in one, ``fixed`` has the poses (4, 4) of the tool at their goals, in the base of the arm, and
    ``fixed_joints`` the joint positions (n,) there, where JOINTS asks for some.
    """

    begin: Instruction
    form: Form
    goals: dict[str, Goal]
    speed: float
    blend: float | Array | None
    duration: float | None
    guards: list[Guard]
    span: Span
    joints: Sequence[float] | str | None = None
    tool: ToolLimits | None = None
    tracked: str | None = None
    correction: Correction | None = None
    fixed: Mapping[str, Array] = MappingProxyType({})
    fixed_joints: Mapping[str, Array] = MappingProxyType({})


def move_request(machine: Machine, process: Process, step: Instruction) -> MoveRequest:
    """Gather the instructions of a MOVE, from MVBEG to MVEND."""
    instructions, index = machine.code.instructions, process.pc - 1
    first = index
    while instructions[first].op is not Op.MVBEG:
        first -= 1
    begin, parts = instructions[first], instructions[first + 1 : index]
    goals: dict[str, list[Goal]] = {"goal": [_goal(machine, process, begin.operands[1], begin)]}
    numbers: dict[Op, float] = {}
    guards: list[Guard] = []
    joints: Sequence[float] | str | None = None
    tracked: str | None = None
    for part in parts:
        if part.op is Op.MVJNT:
            joints = [machine.read_number(process, operand, part.span) for operand in part.operands]
        elif part.op is Op.MVTGT:
            joints = str(part.operands[0])
        if part.op in (Op.MVJNT, Op.MVTGT):
            label = " ".join(machine.code.source.slice(part.span).split()) or "JOINTS"
            goals["goal"] = [Goal(label, part.op, part.span)]
        elif part.op in (Op.MVVIA, Op.MVAPP, Op.MVDEP):
            goals[part.op] = [_goal(machine, process, operand, part) for operand in part.operands]
        elif part.op in _NUMBERS:
            numbers[part.op] = _clause_value(machine, process, part)
        elif part.op is Op.MVTRK:
            tracked = machine.moving_frame_named(process, part)
        elif part.op is Op.MVON:
            guards.append(_guard(machine, part))
    _make_labels_unique(goals)
    form = Form(
        goal=goals["goal"][0].label,
        via=tuple(goal.label for goal in goals.get(Op.MVVIA, ())),
        approach=goals[Op.MVAPP][0].label if Op.MVAPP in goals else None,
        departure=goals[Op.MVDEP][0].label if Op.MVDEP in goals else None,
        straight=any(part.op is Op.MVSTR for part in parts),
        blend=Op.MVBLD in numbers,
        circular=any(part.op is Op.MVCIR for part in parts),
        tracking=tracked is not None,
        smooth=any(part.op is Op.MVSMO for part in parts),
    )
    duration, units = numbers.get(Op.MVDUR), machine.code.units
    limits = {
        name: numbers[op] * worth
        for name, op, worth in (
            ("speed", Op.MVVEL, units.metres),
            ("rotation", Op.MVROT, units.radians),
            ("acceleration", Op.MVACC, units.metres),
        )
        if op in numbers
    }
    at_speed = NORMAL_SPEED if duration is None and "speed" not in limits else HIGHEST_SPEED
    return MoveRequest(
        begin=begin,
        form=form,
        goals={goal.label: goal for goals_of_clause in goals.values() for goal in goals_of_clause},
        speed=numbers.get(Op.MVSPD, at_speed),
        blend=numbers.get(Op.MVBLD),
        duration=duration,
        guards=guards,
        span=step.span,
        joints=joints,
        tool=ToolLimits(**limits) if limits else None,
        tracked=tracked,
        correction=_correction(machine, parts, numbers),
    )


def _correction(machine: Machine, parts: Sequence[Instruction], numbers: Mapping[Op, float]) -> Correction | None:
    """Return how a sensor corrects the path of a MOVE; None where none does."""
    corrected, metres = next((part for part in parts if part.op is Op.MVCOR), None), machine.code.units.metres
    if corrected is None:
        return None
    bound, rate = numbers[Op.MVBND] * metres, numbers[Op.MVRAT] * metres
    return Correction(code=jump_target(corrected, 0), result=str(corrected.operands[1]), bound=bound, rate=rate)


def _goal(machine: Machine, process: Process, operand: Operand, step: Instruction) -> Goal:
    span = step.span
    if step.op is not Op.MVBEG and isinstance(operand, str) and operand.startswith("%"):
        span = process.activation.temporary_spans[operand]
    return Goal(machine.operand_text(process, operand), operand, span)


def _make_labels_unique(goals: dict[str, list[Goal]]) -> None:
    """Give each goal a label of its own, also where a program names two poses alike."""
    operands: dict[str, Operand] = {}
    for goals_of_clause in goals.values():
        for index, goal in enumerate(goals_of_clause):
            label = goal.label
            while operands.setdefault(label, goal.operand) != goal.operand:
                label += "'"
            goals_of_clause[index] = goal._replace(label=label)


def _clause_value(machine: Machine, process: Process, part: Instruction) -> float:
    """Return speed, blend [m], duration [s] or a limit of the tool, in units of the program, checked."""
    operand = part.operands[0]
    value = machine.read_number(process, operand, part.span)
    name = f"{machine.operand_text(process, operand)} = {value:g}" if isinstance(operand, str) else f"{value:g}"
    if part.op is Op.MVSPD:
        if not LOWEST_SPEED <= value <= HIGHEST_SPEED:
            message = f"speed {name} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}"
            raise machine.error(process, "E207", message, part.span, "out of range")
        return value
    quantity = f"the {_NUMBERS[part.op]}"
    if part.op is Op.MVDUR and value > _MAX_DURATION:
        text = f"{quantity} {name} s is not possible"
        raise machine.error(process, "E231", text, part.span, f"expected {_MAX_DURATION:g} s or less")
    if value <= 0:
        raise machine.error(process, "E231", f"{quantity} {name} is not above 0", part.span, "expected more than 0")
    return value * machine.code.units.metres if part.op is Op.MVBLD else value


def operations(code: Code, condition: int) -> set[Op]:
    """Return the operations of a condition, those of the functions that it calls among them."""
    ops: set[Op] = set()
    starts = [condition]
    for start in starts:
        for step in takewhile(lambda step: step.op not in (Op.RET, Op.NORET), code.instructions[start:]):
            ops.add(step.op)
            if step.op is Op.CALLF and (called := code.procedures[str(step.operands[1])].start) not in starts:
                starts.append(called)
    return ops


def _guard(machine: Machine, part: Instruction) -> Guard:
    condition, action = jump_target(part, 0), jump_target(part, 2)
    ops = operations(machine.code, condition)
    return Guard(
        condition=condition,
        result=str(part.operands[1]),
        action=action,
        reads_pose=not ops.isdisjoint(READS_POSES),
        reads_force=Op.FORCE in ops,
    )
