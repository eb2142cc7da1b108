"""Verification of intermediate code: what passes can be interpreted, whatever made it.

The verifier follows every way through the code, as that of a stack machine does: operands have the sorts and types
that their operation takes, jumps lead to instructions, values in passing are written before they are read, and TRY,
LOCK, FORK and MOVE are closed as they were opened. What depends on values or on the cell (a frame without a value, an
arm that the cell does not have) is left to the run, which has messages for it.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import TypeAlias

import attrs
import numpy as np

from armwright.errors import counted
from armwright.program.bytecode.instructions import Code, Constant, JumpTarget, Op, Operand, Text
from armwright.program.bytecode.verifier import (
    OF_KIND,
    Attempt,
    CodeError,
    Element,
    Flow,
    Routine,
    State,
    Value,
    Verifier,
    index_of,
)
from armwright.program.language.kinds import VariableKind
from armwright.program.syntax.pose_literals import EXACT
from armwright.spatial.rotations import orthonormality_error

# What each operation takes: n a name or element, v a value, k a constant, p a jump target, t text or value, x a word;
# in brackets what may be left out, + for any number more of the last.
_TAKES: Mapping[str, str] = {
    "LOADM LOADS": "nk",
    "COPY NEG INV NOT ROTX ROTY ROTZ": "nv",
    "MUL DIV ADD SUB LT LE EQ NE GE GT DIST": "nvv",
    "XYZ": "nvvv",
    "MATX": "nvvvvvvvvvvvv",
    "FORCE": "nx",
    "ELEM": "nxv+",
    "AFFIX": "nn(x)",
    "AFFAT": "nnv(x)",
    "UNFIX": "n(n)",
    "OPEN": "x(v)",
    "GRASP": "(x)",
    "OPER": "xx",
    "READV": "n",
    "READS": "x",
    "MVBEG": "nv",
    "MVVIA": "v+",
    "MVAPP MVDEP MVSPD MVBLD MVDUR": "v",
    "MVON": "pnp",
    "MVDIR MVSTR MVEND MVHLT RET JOIN QUIT ENDR RETRY HALT STOP": "",
    "JMP TRY ENDT": "p",
    "JZ": "vp",
    "FOR": "nnvvvp",
    "CALL": "x(v+)",
    "FORK": "p(v)",
    "SIG WAIT": "n",
    "PAUSE": "v",
    "LOCK UNLK": "n+",
    "PRINT": "t+",
}
TAKES: Mapping[Op, str] = {Op[name]: takes for names, takes in _TAKES.items() for name in names.split()}
_PATTERNS = {
    op: re.compile(
        takes.replace("(", "(?:")
        .replace(")", ")?")
        .replace("n", "[wq]")
        .replace("v", "[wqd]")
        .replace("x", "w")
        .replace("t", "[wqds]")
    )
    for op, takes in TAKES.items()
}
_PARTS = {Op.MVDIR, Op.MVSTR, Op.MVVIA, Op.MVAPP, Op.MVDEP, Op.MVSPD, Op.MVBLD, Op.MVDUR, Op.MVON}
_ENDS = {Op.STOP, Op.RET, Op.QUIT, Op.JMP, Op.HALT, Op.MVHLT, Op.ENDT, Op.RETRY}

Rule: TypeAlias = Callable[[Verifier, State], Flow]


def verify(code: Code) -> None:
    """Check that code can be interpreted.

    Raises:
        CodeError: it cannot; an instruction that is wrong, and why.
    """
    for fault in (*_wrong_operands(code), *_wrong_neighbours(code), *_wrong_ends(code)):
        raise fault
    Verifier(code, _rule).follow()


def _rule(verifier: Verifier, state: State) -> Flow:
    """Check one instruction."""
    op = verifier.op
    if verifier.entry.routine is Routine.CONDITION and op not in _OF_CONDITIONS:
        raise verifier.wrong(f"the code of a condition must not contain {op}")
    return _RULES[op](verifier, state)


# ---- form ----------------------------------------------------------------------------------------------------------


def _wrong_operands(code: Code) -> Iterator[CodeError]:
    last = len(code.instructions)
    for number, step in enumerate(code.instructions):
        if not _PATTERNS[step.op].fullmatch("".join(map(_letter, step.operands))):
            yield CodeError(number, f"the operands of {step.op} have wrong kinds or a wrong number")
        for operand in step.operands:
            if fault := _fault(operand, last, len(code.constants)):
                yield CodeError(number, fault)


def _wrong_neighbours(code: Code) -> Iterator[CodeError]:
    """FORKs and their JOIN stand together, and so do the parts of a MOVE; nothing jumps into the middle."""
    targets = {
        operand.index for step in code.instructions for operand in step.operands if isinstance(operand, JumpTarget)
    }
    before = None
    for number, step in enumerate(code.instructions):
        op = step.op
        if (before is Op.FORK) != (op is Op.JOIN or (op is Op.FORK and before is Op.FORK)):
            yield CodeError(number, "expected FORKs and their JOIN without other instructions in between")
        if (before in _PARTS | {Op.MVBEG}) != (op in _PARTS | {Op.MVEND}):
            yield CodeError(number, "expected the parts of a MOVE in sequence, from MVBEG to MVEND")
        if number in targets and before in _PARTS | {Op.MVBEG, Op.FORK}:
            yield CodeError(number, "a jump must not lead into the middle of a MOVE or of FORKs")
        before = op


def _wrong_ends(code: Code) -> Iterator[CodeError]:
    last = len(code.instructions) - 1
    for name, procedure in code.procedures.items():
        if procedure.start > last:
            yield CodeError(last, f"procedure {name} begins after the last instruction")
    if code.instructions[last].op not in _ENDS:
        yield CodeError(last, "execution would continue after the last instruction")
    for index, value in enumerate(code.constants):
        numbers = np.array(value)
        if not np.isfinite(numbers).all():
            yield CodeError(0, f"constant c{index}: expected finite numbers")
        elif numbers.size > 1 and not orthonormality_error(numbers[:9].reshape(3, 3).T) <= EXACT:
            yield CodeError(0, f"constant c{index}: expected a pose, but its first nine numbers are not a rotation")


def _letter(operand: Operand) -> str:
    match operand:
        case str():
            return "q" if operand.startswith("%") else "w"
        case Constant():
            return "k"
        case JumpTarget():
            return "p"
        case Text():
            return "s"
        case _:
            return "d"


def _fault(operand: Operand, instructions: int, constants: int) -> str:
    match operand:
        case JumpTarget(index=index) if not 0 <= index < instructions:
            return f"there is no instruction @{index:04d}"
        case Constant(index=index) if not 0 <= index < constants:
            return f"there is no constant c{index}"
        case float() | int() if not math.isfinite(operand):
            return f"expected a finite number, got {operand:g}"
        case _:
            return ""


# ---- values --------------------------------------------------------------------------------------------------------


def _operation(operands: Value, result: Value) -> Rule:
    """Return the rule of an operation on values of one sort."""

    def rule(verifier: Verifier, state: State) -> Flow:
        to, *values = verifier.operands
        for operand in values:
            verifier.need(state, operand, operands)
        return Flow(verifier.write(state, to, result))

    return rule


def _load(verifier: Verifier, state: State) -> Flow:
    to, constant = verifier.operands
    assert isinstance(constant, Constant)  # noqa: S101 - the sorts of operands have been checked
    is_pose = isinstance(verifier.code.constants[constant.index], tuple)
    if is_pose != (verifier.op is Op.LOADM):
        raise verifier.wrong(f"{verifier.op} does not take a constant of {12 if is_pose else 1} numbers")
    return Flow(verifier.write(state, to, Value.POSE if is_pose else Value.NUMBER))


def _copy(verifier: Verifier, state: State) -> Flow:
    to, value = verifier.operands
    return Flow(verifier.write(state, to, verifier.value(state, value)))


def _multiply(verifier: Verifier, state: State) -> Flow:
    to, *factors = verifier.operands
    left, right = (verifier.value(state, factor) for factor in factors)
    if left is not right or left is Value.TRUTH:
        raise verifier.wrong("MUL expects two numbers, or two poses or transformations")
    return Flow(verifier.write(state, to, left))


def _not(verifier: Verifier, state: State) -> Flow:
    to, value = verifier.operands
    verifier.need(state, value, Value.TRUTH, Value.NUMBER)
    return Flow(verifier.write(state, to, Value.TRUTH))


def _force(verifier: Verifier, state: State) -> Flow:
    to, axis = verifier.operands
    if axis not in ("X", "Y", "Z"):
        raise verifier.wrong(f"FORCE expects the axis X, Y or Z, got {axis}")
    return Flow(verifier.write(state, to, Value.NUMBER))


def _element(verifier: Verifier, state: State) -> Flow:
    to, array, *indices = verifier.operands
    kind = verifier.declared(str(array))
    if kind is None or len(kind.sizes) != len(indices):
        raise verifier.wrong(f"{array} is not an array of {counted(len(indices), 'dimension')}")
    for index in indices:
        verifier.need(state, index, Value.NUMBER)
    if not str(to).startswith("%"):
        raise verifier.wrong("ELEM expects a temporary such as %1 for its result, got {to}")
    return Flow(verifier.define(state, str(to), Element(kind.kind)))


# ---- frames and devices --------------------------------------------------------------------------------------------


def _frames(verifier: Verifier, state: State) -> Flow:
    """AFFIX, AFFAT, UNFIX and READV: frames, then the step, then RIGIDLY."""
    op, operands = verifier.op, list(verifier.operands)
    most = {Op.AFFIX: 2, Op.AFFAT: 3}.get(op, len(operands))
    if len(operands) > most and operands.pop() != "RIGIDLY":
        raise verifier.wrong(f"the last operand of {op} may only be RIGIDLY")
    if op is Op.AFFAT:
        verifier.need(state, operands.pop(), Value.POSE)
    for operand in operands:
        verifier.need_name(state, operand, VariableKind.FRAME)
    return Flow(state)


def _open(verifier: Verifier, state: State) -> Flow:
    for width in verifier.operands[1:]:
        verifier.need(state, width, Value.NUMBER)
    return Flow(state)


def _operate(verifier: Verifier, state: State) -> Flow:
    if verifier.operands[1] not in ("ON", "OFF"):
        raise verifier.wrong(f"OPER expects ON or OFF, got {verifier.operands[1]}")
    return Flow(state)


def _nothing(_: Verifier, state: State) -> Flow:
    """The operands have been checked, and there is nothing else."""
    return Flow(state)


# ---- motion --------------------------------------------------------------------------------------------------------


def _begin_of_move(verifier: Verifier, state: State) -> Flow:
    moved, goal = verifier.operands
    verifier.need_name(state, moved, VariableKind.FRAME)
    verifier.need(state, goal, Value.POSE)
    return Flow(state)


def _all(wanted: Value) -> Rule:
    """Return the rule of an instruction that takes values of one sort, and gives none."""

    def rule(verifier: Verifier, state: State) -> Flow:
        for operand in verifier.operands:
            verifier.need(state, operand, wanted)
        return Flow(state)

    return rule


def _guard(verifier: Verifier, state: State) -> Flow:
    condition, truth, action = verifier.operands
    if not str(truth).startswith("%"):
        raise verifier.wrong("MVON expects a temporary such as %1 for the value of its condition, got {truth}")
    verifier.begin(condition, Routine.CONDITION, state, str(truth))
    verifier.begin(action, Routine.ACTION, state)
    return Flow(state)


# ---- control flow --------------------------------------------------------------------------------------------------


def _event(verifier: Verifier, state: State) -> Flow:
    verifier.need_name(state, verifier.operands[0], VariableKind.EVENT)
    return Flow(state)


def _lock(verifier: Verifier, state: State) -> Flow:
    for operand in verifier.operands:
        verifier.type_of(state, operand)
    return Flow(attrs.evolve(state, locks=(*state.locks, verifier.operands)))


def _unlock(verifier: Verifier, state: State) -> Flow:
    if not state.locks or state.locks[-1] != verifier.operands:
        raise verifier.wrong("UNLK must release the variables of the last LOCK")
    return Flow(attrs.evolve(state, locks=state.locks[:-1]))


def _call(verifier: Verifier, state: State) -> Flow:
    name, *arguments = verifier.operands
    procedure = verifier.code.procedures.get(str(name))
    if procedure is None:
        raise verifier.wrong(f"there is no procedure {name}")
    if len(arguments) != len(procedure.parameters):
        takes = counted(len(procedure.parameters), "parameter")
        raise verifier.wrong(f"{name} has {takes}, got {counted(len(arguments), 'argument')}")
    for argument, parameter in zip(arguments, procedure.parameters, strict=True):
        kind = procedure.types[parameter]
        if not kind.sizes and kind.kind in OF_KIND:
            verifier.need(state, argument, OF_KIND[kind.kind])
        elif (got := verifier.type_of(state, argument)) != kind:
            raise verifier.wrong(f"parameter {parameter} of {name} expects {kind}, got {got}")
    return Flow(state)


def _print(verifier: Verifier, state: State) -> Flow:
    for operand in verifier.operands:
        if not isinstance(operand, Text):
            verifier.value(state, operand)
    return Flow(state)


def _jump(verifier: Verifier, state: State) -> Flow:
    return Flow(state, (index_of(verifier.operands[0]), state), falls=False)


def _jump_if_not(verifier: Verifier, state: State) -> Flow:
    truth, operand = verifier.operands
    verifier.need(state, truth, Value.TRUTH, Value.NUMBER)
    target = index_of(operand)
    if verifier.entry.routine is Routine.CONDITION and target <= verifier.at:
        raise verifier.wrong("the code of a condition must not jump backward")
    return Flow(state, (target, state))


def _for(verifier: Verifier, state: State) -> Flow:
    variable, *numbers, over = verifier.operands
    verifier.need_name(state, variable, VariableKind.SCALAR)
    for operand in numbers:
        verifier.need(state, operand, Value.NUMBER)
    return Flow(state, (index_of(over), state))


def _fork(verifier: Verifier, state: State) -> Flow:
    target, *priority = verifier.operands
    for operand in priority:
        verifier.need(state, operand, Value.NUMBER)
    verifier.begin(target, Routine.BRANCH, state)
    return Flow(state)


def _try(verifier: Verifier, state: State) -> Flow:
    trying, recovering = (
        attrs.evolve(state, attempts=(*state.attempts, Attempt(verifier.at, recovers, state.locks)))
        for recovers in (False, True)
    )
    return Flow(trying, (index_of(verifier.operands[0]), recovering))


def _end_of_try(verifier: Verifier, state: State) -> Flow:
    outside = _without_attempt(verifier, state, recovering=False)
    return Flow(outside, (index_of(verifier.operands[0]), outside), falls=False)


def _end_of_recovery(verifier: Verifier, state: State) -> Flow:
    return Flow(_without_attempt(verifier, state, recovering=True))


def _without_attempt(verifier: Verifier, state: State, *, recovering: bool) -> State:
    if not state.attempts or state.attempts[-1].recovering is not recovering:
        raise verifier.wrong(f"{verifier.op} has no {'RECOVER' if recovering else 'TRY'} to end")
    return attrs.evolve(state, attempts=state.attempts[:-1])


def _retry(verifier: Verifier, state: State) -> Flow:
    """Go back to the TRY in whose RECOVER part this stands; what was locked since is given back by then."""
    recovering = [number for number, attempt in enumerate(state.attempts) if attempt.recovering]
    if not recovering:
        raise verifier.wrong("RETRY is outside of RECOVER")
    attempt = state.attempts[recovering[-1]]
    before = attrs.evolve(state, locks=attempt.locks, attempts=state.attempts[: recovering[-1]])
    return Flow(state, (attempt.start, before), falls=False)


def _end_of(*routines: Routine) -> Rule:
    """Return the rule of an instruction that ends routines of these sorts."""

    def rule(verifier: Verifier, state: State) -> Flow:
        entry = verifier.entry
        if entry.routine not in routines:
            raise verifier.wrong(f"{verifier.op} cannot end {entry.routine.value}")
        if entry.routine is Routine.CONDITION:
            verifier.need(state, entry.truth, Value.TRUTH, Value.NUMBER)
        return Flow(state, falls=False)

    return rule


_NUMBER, _TRUTH, _POSE = Value.NUMBER, Value.TRUTH, Value.POSE
_OF_VALUES: Mapping[Op, Rule] = {
    Op.LOADM: _load,
    Op.LOADS: _load,
    Op.COPY: _copy,
    Op.MUL: _multiply,
    **dict.fromkeys((Op.DIV, Op.ADD, Op.SUB, Op.NEG), _operation(_NUMBER, _NUMBER)),
    **dict.fromkeys((Op.LT, Op.LE, Op.EQ, Op.NE, Op.GE, Op.GT), _operation(_NUMBER, _TRUTH)),
    **dict.fromkeys((Op.XYZ, Op.ROTX, Op.ROTY, Op.ROTZ, Op.MATX), _operation(_NUMBER, _POSE)),
    Op.NOT: _not,
    Op.INV: _operation(_POSE, _POSE),
    Op.DIST: _operation(_POSE, _NUMBER),
    Op.FORCE: _force,
    Op.ELEM: _element,
}
_OF_CONDITIONS = {*_OF_VALUES, Op.JZ, Op.RET}
_RULES: Mapping[Op, Rule] = {
    **_OF_VALUES,
    **dict.fromkeys((Op.AFFIX, Op.AFFAT, Op.UNFIX, Op.READV), _frames),
    Op.OPEN: _open,
    Op.OPER: _operate,
    **dict.fromkeys((Op.GRASP, Op.READS, Op.MVDIR, Op.MVSTR, Op.MVEND, Op.JOIN), _nothing),
    Op.MVBEG: _begin_of_move,
    **dict.fromkeys((Op.MVVIA, Op.MVAPP, Op.MVDEP), _all(_POSE)),
    **dict.fromkeys((Op.MVSPD, Op.MVBLD, Op.MVDUR, Op.PAUSE), _all(_NUMBER)),
    Op.MVON: _guard,
    Op.SIG: _event,
    Op.WAIT: _event,
    Op.LOCK: _lock,
    Op.UNLK: _unlock,
    Op.CALL: _call,
    Op.PRINT: _print,
    Op.JMP: _jump,
    Op.JZ: _jump_if_not,
    Op.FOR: _for,
    Op.FORK: _fork,
    Op.TRY: _try,
    Op.ENDT: _end_of_try,
    Op.ENDR: _end_of_recovery,
    Op.RETRY: _retry,
    Op.RET: _end_of(Routine.PROCEDURE, Routine.CONDITION, Routine.ACTION),
    Op.QUIT: _end_of(Routine.BRANCH),
    Op.MVHLT: _end_of(Routine.ACTION),
    Op.HALT: _end_of(Routine.PROGRAM, Routine.PROCEDURE, Routine.BRANCH, Routine.ACTION),
    Op.STOP: _end_of(Routine.PROGRAM, Routine.PROCEDURE, Routine.BRANCH, Routine.ACTION),
}
