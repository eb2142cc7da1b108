"""Verification of intermediate code: what passes can be interpreted, whatever made it.

The verifier follows every way through the code, as that of a stack machine does: operands have the sorts and types
that their operation takes, jumps lead to instructions, values in passing are written before they are read, and TRY,
LOCK, FORK and MOVE are closed as they were opened. What depends on values or on the cell (a frame without a value, an
arm that the cell does not have) is left to the run, which has messages for it.
"""

import csv
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

import attrs
import numpy as np

from armwright.arrays import LARGEST
from armwright.errors import counted
from armwright.program.bytecode.instructions import (
    MOVE_PARTS,
    Code,
    Constant,
    JumpTarget,
    Op,
    Operand,
    ProcedureCode,
    Text,
)
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
    jump_targets,
)
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import LOG_NAME
from armwright.program.syntax.pose_literals import EXACT_TOLERANCE
from armwright.spatial.rotations import orthonormality_error

_VALUES = {"N": (Value.NUMBER,), "C": (Value.NUMBER,), "P": (Value.POSE,), "T": (Value.TRUTH, Value.NUMBER)}
_VALUES["W"] = (Value.TEXT,)
_NAMES = {"F": VariableKind.FRAME, "S": VariableKind.SCALAR, "E": VariableKind.EVENT}
# The words that an operand may be, and what is said of others.
_WORDS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "a": (("X", "Y", "Z", "MX", "MY", "MZ"), "{op} expects the axis X, Y or Z, or MX, MY or MZ, got {word}"),
    "o": (("ON", "OFF"), "{op} expects ON or OFF, got {word}"),
    "b": (("TRUE", "FALSE"), "{op} expects TRUE or FALSE, got {word}"),
    "r": (("RIGIDLY",), "the last operand of {op} may only be RIGIDLY"),
}
# The forms of operands, by the letters of `_letter`.
_FORMS: Mapping[str, str] = {
    "(": "(?:",
    ")": ")?",
    **dict.fromkeys("tx", "[wqds]"),
    "K": "k",
    **dict.fromkeys("nFSEC", "[wq]"),
    **dict.fromkeys("vNPT", "[wqd]"),
    "W": "[wqs]",
    **dict.fromkeys("aobr", "w"),
}


@attrs.frozen
class _Signature:
    """The result of an operation, the letters of all its operands, and the form that these have."""

    result: Value | None
    letters: str
    form: re.Pattern[str]

    def pairs(self, operands: Sequence[Operand]) -> Iterator[tuple[str, Operand]]:
        """Give each operand of an instruction with its letter."""
        return zip(self.letters.ljust(len(operands), self.letters[-1:] or " "), operands, strict=False)


def _signature(op: Op) -> _Signature:
    """Return the signature of an operation, of which the instruction set has the letters."""
    result, _, operands = op.signature.rpartition("=")
    letters = f"n{operands}" if result else operands
    form = re.compile("".join(_FORMS.get(letter, letter) for letter in letters))
    return _Signature(_VALUES[result][0] if result else None, re.sub(r"[()+]", "", letters), form)


_SIGNATURES = {op: _signature(op) for op in Op}
# What works a value out: all that a condition may do, beside jumps and its end.
_OF_CONDITIONS = {op for op in Op if _SIGNATURES[op].result} | {Op.COPY, Op.MUL, Op.ELEM, Op.CALLF, Op.JZ, Op.RET}
# All that a function may do.
_OF_FUNCTIONS = _OF_CONDITIONS - {Op.RET} | {Op.JMP, Op.FOR, Op.RAISE, Op.RETV, Op.NORET}
# The parts of a MOVE of which an arc has only two.
_TOOL_LIMITS = {Op.MVVEL, Op.MVROT, Op.MVACC}
_WAYS = {Op.MVSTR, Op.MVCIR, Op.MVVIA, Op.MVAPP, Op.MVDEP, Op.MVBLD, Op.MVJNT, Op.MVTGT}
# What a path that a sensor corrects needs.
_CORRECTED = {Op.MVSTR, Op.MVBND, Op.MVRAT}
# Ways to go that are not shaped.
_NOT_SMOOTH = {Op.MVCIR, Op.MVVIA, Op.MVBLD, Op.MVTRK, Op.MVCOR}
# Which routines an instruction ends, and what else does not lead on to the next.
_ENDED_ROUTINES: Mapping[Op, tuple[Routine, ...]] = {
    Op.RET: (Routine.PROCEDURE, Routine.CONDITION, Routine.ACTION, Routine.WATCH),
    Op.QUIT: (Routine.BRANCH,),
    **dict.fromkeys((Op.RETV, Op.NORET), (Routine.FUNCTION,)),
    Op.MVHLT: (Routine.ACTION,),
    **dict.fromkeys(
        (Op.HALT, Op.STOP), (Routine.PROGRAM, Routine.PROCEDURE, Routine.BRANCH, Routine.ACTION, Routine.WATCH)
    ),
}
_ENDS = {*_ENDED_ROUTINES, Op.JMP, Op.ENDT, Op.RETRY, Op.RAISE, Op.LATE}

# TRYs and LOCKs in one another; the compiler refuses programs with as many.
_MAX_NESTING = 200

Rule: TypeAlias = Callable[[Verifier, State], Flow]


def verify(code: Code) -> None:
    """Check that code can be interpreted.

    Raises:
        CodeError: it cannot; an instruction that is wrong, and why.
    """
    for fault in (*_wrong_operands(code), *_wrong_neighbours(code), *_wrong_ends(code)):
        raise fault
    Verifier(code, apply_rule).follow()


def apply_rule(verifier: Verifier, state: State) -> Flow:
    """Check one instruction: its operands, what it writes, and what it does to the flow."""
    op, operands, signature = verifier.op, verifier.operands, _SIGNATURES[verifier.op]
    if verifier.entry.routine is Routine.CONDITION and op not in _OF_CONDITIONS:
        raise verifier.wrong(f"the code of a condition must not contain {op}")
    if verifier.entry.routine is Routine.FUNCTION and op not in _OF_FUNCTIONS:
        raise verifier.wrong(f"the code of a function must not contain {op}")
    for letter, operand in signature.pairs(operands):
        _need(verifier, state, letter, operand)
    if signature.result is not None:
        state = verifier.write(state, operands[0], signature.result)
    rule = _RULES.get(op)
    return Flow(state) if rule is None else rule(verifier, state)


def _need(verifier: Verifier, state: State, letter: str, operand: Operand) -> None:
    """Check the value of an operand, which has the form that its letter stands for."""
    if letter in _VALUES:
        verifier.need(state, operand, *_VALUES[letter])
    elif letter in _NAMES:
        verifier.need_name(state, operand, _NAMES[letter])
    elif letter == "t":
        verifier.value(state, operand)
    elif letter in _WORDS:
        words, fault = _WORDS[letter]
        if operand not in words:
            raise verifier.wrong(fault.format(op=verifier.op, word=operand))
    elif isinstance(operand, Constant):
        is_pose = isinstance(verifier.code.constants[operand.index], tuple)
        if is_pose != (letter == "K"):
            raise verifier.wrong(f"{verifier.op} does not take a constant of {12 if is_pose else 1} numbers")


# ---- form ----------------------------------------------------------------------------------------------------------


def _wrong_operands(code: Code) -> Iterator[CodeError]:
    last = len(code.instructions)
    for number, step in enumerate(code.instructions):
        if not _SIGNATURES[step.op].form.fullmatch("".join(map(_letter, step.operands))):
            yield CodeError(number, f"the operands of {step.op} have wrong kinds or a wrong number")
        for operand in step.operands:
            if fault := _fault(operand, last, len(code.constants)):
                yield CodeError(number, fault)


def _wrong_neighbours(code: Code) -> Iterator[CodeError]:
    """FORKs and their JOIN stand together, and so do the parts of a MOVE; nothing jumps into the middle."""
    targets, before = jump_targets(code), None
    for number, step in enumerate(code.instructions):
        op = step.op
        if (before is Op.FORK) != (op is Op.JOIN or (op is Op.FORK and before is Op.FORK)):
            yield CodeError(number, "expected FORKs and their JOIN without other instructions in between")
        if (before in MOVE_PARTS | {Op.MVBEG}) != (op in MOVE_PARTS | {Op.MVEND}):
            yield CodeError(number, "expected the parts of a MOVE in sequence, from MVBEG to MVEND")
        if op is Op.MVCIR and not _is_arc(code, number):
            yield CodeError(number, "expected MVCIR with one frame in MVVIA, and without MVSTR, MVDEP, MVAPP and MVBLD")
        if op is Op.MVTRK and _parts_of(code, number) & (_WAYS - {Op.MVSTR} | _TOOL_LIMITS):
            yield CodeError(number, "expected MVTRK without another way to go and without limits of the tool")
        if op is Op.MVSMO and _parts_of(code, number) & _NOT_SMOOTH:
            yield CodeError(number, "expected MVSMO without MVCIR, MVVIA, MVBLD, MVTRK and MVCOR")
        if op is Op.MVCOR and not _is_corrected(_parts_of(code, number)):
            yield CodeError(number, "expected MVCOR with MVSTR, MVBND and MVRAT, and without another way to go")
        if number in targets and before in MOVE_PARTS | {Op.MVBEG, Op.FORK}:
            yield CodeError(number, "a jump must not lead into the middle of a MOVE or of FORKs")
        before = op


def _is_arc(code: Code, number: int) -> bool:
    """Whether a MOVE with MVCIR has nothing else that says which way it goes but one frame to pass."""
    first = last = number
    while code.instructions[first - 1].op in MOVE_PARTS:
        first -= 1
    while code.instructions[last + 1].op in MOVE_PARTS:
        last += 1
    parts = [step for step in code.instructions[first : last + 1] if step.op in _WAYS]
    return [(step.op, len(step.operands)) for step in parts] == [(Op.MVCIR, 0), (Op.MVVIA, 1)]


def _is_corrected(parts: set[Op]) -> bool:
    """Whether a path that a sensor corrects has what it needs, and nothing else says which way it goes."""
    return parts >= _CORRECTED and not parts & (_WAYS - {Op.MVSTR} | {Op.MVTRK})


def _parts_of(code: Code, number: int) -> set[Op]:
    """Return the parts of the MOVE that an instruction is one of."""
    first = last = number
    steps = code.instructions
    while first and steps[first - 1].op in MOVE_PARTS:
        first -= 1
    while last < len(steps) and steps[last].op in MOVE_PARTS:
        last += 1
    return {step.op for step in code.instructions[first:last]}


def _wrong_ends(code: Code) -> Iterator[CodeError]:
    last = len(code.instructions) - 1
    for name, procedure in code.procedures.items():
        if procedure.start > last:
            yield CodeError(last, f"procedure {name} begins after the last instruction")
    if code.instructions[last].op not in _ENDS:
        yield CodeError(last, "execution would continue after the last instruction")
    for index, value in enumerate(code.constants):
        numbers = np.array(value)
        if not (np.abs(numbers) <= LARGEST).all():
            yield CodeError(0, f"constant c{index}: expected numbers from {-LARGEST:g} to {LARGEST:g}")
        elif numbers.size > 1 and not orthonormality_error(numbers[:9].reshape(3, 3).T) <= EXACT_TOLERANCE:
            yield CodeError(0, f"constant c{index}: expected a pose, but its first nine numbers are not a rotation")


def _letter(operand: Operand) -> str:
    if isinstance(operand, str):
        return "q" if operand.startswith("%") else "w"
    return {Constant: "k", JumpTarget: "j", Text: "s"}.get(type(operand), "d")


def _fault(operand: Operand, instructions: int, constants: int) -> str:
    match operand:
        case JumpTarget(index=index) if not 0 <= index < instructions:
            return f"there is no instruction {operand}"
        case Constant(index=index) if not 0 <= index < constants:
            return f"there is no constant {operand}"
        case float() | int() if not abs(operand) <= LARGEST:
            return f"expected a number from {-LARGEST:g} to {LARGEST:g}, got {operand:g}"
        case _:
            return ""


# ---- values --------------------------------------------------------------------------------------------------------


def _copy(verifier: Verifier, state: State) -> Flow:
    to, value = verifier.operands
    return Flow(verifier.write(state, to, verifier.value(state, value)))


def _multiply(verifier: Verifier, state: State) -> Flow:
    to, *factors = verifier.operands
    left, right = (verifier.value(state, factor) for factor in factors)
    if left is not right or left is Value.TRUTH:
        raise verifier.wrong("MUL expects two numbers, or two poses or transformations")
    return Flow(verifier.write(state, to, left))


def _until(verifier: Verifier, state: State) -> Flow:
    (condition, late), truth = verifier.targets, verifier.operands[1]
    if not str(truth).startswith("%"):
        raise verifier.wrong(f"UNTIL expects a temporary such as %1 for the value of its condition, got {truth}")
    verifier.begin(condition, Routine.CONDITION, state, str(truth))
    return Flow(state, (late, state))


def _compare(verifier: Verifier, state: State) -> Flow:
    """EQ and NE compare numbers, or texts."""
    left, right = (verifier.value(state, operand) for operand in verifier.operands[1:])
    if left is not right or left not in (Value.NUMBER, Value.TEXT):
        raise verifier.wrong(f"{verifier.op} expects two numbers or two texts")
    return Flow(state)


def _element(verifier: Verifier, state: State) -> Flow:
    to, array, *indices = verifier.operands
    kind = verifier.declared(str(array))
    if kind is None or len(kind.sizes) != len(indices):
        raise verifier.wrong(f"{array} is not an array of {counted(len(indices), 'dimension')}")
    if not str(to).startswith("%"):
        raise verifier.wrong(f"ELEM expects a temporary such as %1 for its result, got {to}")
    return Flow(verifier.define(state, str(to), Element(kind.kind)))


def _correction(verifier: Verifier, state: State) -> Flow:
    (code,), value = verifier.targets, verifier.operands[1]
    if not str(value).startswith("%"):
        raise verifier.wrong(f"MVCOR expects a temporary such as %1 for its value, got {value}")
    verifier.begin(code, Routine.CONDITION, state, str(value))
    return Flow(state)


def _guard(verifier: Verifier, state: State) -> Flow:
    (condition, action), truth = verifier.targets, verifier.operands[1]
    if not str(truth).startswith("%"):
        raise verifier.wrong(
            f"{verifier.op} expects a temporary such as %1 for the value of its condition, got {truth}"
        )
    verifier.begin(condition, Routine.CONDITION, state, str(truth))
    verifier.begin(action, Routine.ACTION if verifier.op is Op.MVON else Routine.WATCH, state)
    return Flow(state)


def _disarm(verifier: Verifier, state: State) -> Flow:
    if any(verifier.code.instructions[target].op is not Op.WHEN for target in verifier.targets):
        raise verifier.wrong("DISARM expects instructions WHEN")
    return Flow(state)


def _log(verifier: Verifier, state: State) -> Flow:
    """The name of a log is that of a file, and its rows have as many values as titles."""
    name, titles, *values = verifier.operands
    if not isinstance(name, Text) or not LOG_NAME.fullmatch(name.value):
        raise verifier.wrong(f"LOG expects letters, digits, _ and - for its name, got {name}")
    if not isinstance(titles, Text) or len(next(csv.reader([titles.value]), [])) != len(values):
        raise verifier.wrong(f"LOG expects a title for each of its {len(values)} values")
    return Flow(state)


# ---- control flow --------------------------------------------------------------------------------------------------


def _lock(verifier: Verifier, state: State) -> Flow:
    for operand in verifier.operands:
        verifier.type_of(state, operand)
    _check_nesting(verifier, state.locks)
    return Flow(attrs.evolve(state, locks=(*state.locks, verifier.operands)))


def _check_nesting(verifier: Verifier, around: Sequence[object]) -> None:
    if len(around) >= _MAX_NESTING:
        raise verifier.wrong(f"more than {_MAX_NESTING} instructions {verifier.op} are nested")


def _unlock(verifier: Verifier, state: State) -> Flow:
    if not state.locks or state.locks[-1] != verifier.operands:
        raise verifier.wrong("UNLK must release the variables of the last LOCK")
    return Flow(attrs.evolve(state, locks=state.locks[:-1]))


def _call(verifier: Verifier, state: State) -> Flow:
    name, *arguments = verifier.operands
    if _called(verifier, state, name, arguments).result is not None:
        raise verifier.wrong(f"{name} is a function, which CALLF calls")
    return Flow(state)


def _call_function(verifier: Verifier, state: State) -> Flow:
    to, name, *arguments = verifier.operands
    result = _called(verifier, state, name, arguments).result
    if result is None or result.sizes or result.kind not in OF_KIND:
        raise verifier.wrong(f"{name} is not a function with a value")
    return Flow(verifier.write(state, to, OF_KIND[result.kind]))


def _called(verifier: Verifier, state: State, name: Operand, arguments: Sequence[Operand]) -> ProcedureCode:
    """Return what is called, its arguments checked."""
    procedure = verifier.code.procedures.get(str(name))
    if procedure is None:
        raise verifier.wrong(f"there is no procedure {name}")
    if len(arguments) != len(procedure.parameters):
        takes = counted(len(procedure.parameters), "parameter")
        raise verifier.wrong(f"{name} has {takes}, got {counted(len(arguments), 'argument')}")
    for argument, parameter in zip(arguments, procedure.parameters, strict=True):
        kind = procedure.types[parameter]
        if parameter in procedure.inout and not kind.sizes:
            verifier.need_name(state, argument, kind.kind)
        elif not kind.sizes and kind.kind in OF_KIND:
            verifier.need(state, argument, OF_KIND[kind.kind])
        elif (got := verifier.type_of(state, argument)) != kind:
            raise verifier.wrong(f"parameter {parameter} of {name} expects {kind}, got {got}")
    return procedure


def _jump_if_not(verifier: Verifier, state: State) -> Flow:
    if verifier.entry.routine is Routine.CONDITION and verifier.targets[0] <= verifier.at:
        raise verifier.wrong("the code of a condition must not jump backward")
    return Flow(state, (verifier.targets[0], state))


def _fork(verifier: Verifier, state: State) -> Flow:
    verifier.begin(verifier.targets[0], Routine.BRANCH, state)
    return Flow(state)


def _try(verifier: Verifier, state: State) -> Flow:
    _check_nesting(verifier, state.attempts)
    attempts = [Attempt(verifier.at, recovers, state.locks) for recovers in (False, True)]
    trying, recovering = (attrs.evolve(state, attempts=(*state.attempts, attempt)) for attempt in attempts)
    return Flow(trying, (verifier.targets[0], recovering))


def _end_attempt(verifier: Verifier, state: State) -> Flow:
    """ENDT ends a TRY and leads behind its RECOVER part, which ENDR ends."""
    recovering = verifier.op is Op.ENDR
    if not state.attempts or state.attempts[-1].recovering is not recovering:
        raise verifier.wrong(f"{verifier.op} has no {'RECOVER' if recovering else 'TRY'} to end")
    outside = attrs.evolve(state, attempts=state.attempts[:-1])
    return Flow(outside) if recovering else Flow(outside, (verifier.targets[0], outside), falls=False)


def _retry(verifier: Verifier, state: State) -> Flow:
    """Go back to the TRY in whose RECOVER part this stands; what was locked since is given back by then."""
    recovering = [number for number, attempt in enumerate(state.attempts) if attempt.recovering]
    if not recovering:
        raise verifier.wrong("RETRY is outside of RECOVER")
    attempt = state.attempts[recovering[-1]]
    before = attrs.evolve(state, locks=attempt.locks, attempts=state.attempts[: recovering[-1]])
    return Flow(state, (attempt.start, before), falls=False)


def _end_routine(verifier: Verifier, state: State) -> Flow:
    entry = verifier.entry
    if entry.routine not in _ENDED_ROUTINES[verifier.op]:
        raise verifier.wrong(f"{verifier.op} cannot end {entry.routine.value}")
    if verifier.op is Op.RETV and verifier.value(state, verifier.operands[0]) is not entry.result:
        raise verifier.wrong(f"RETV expects {entry.result.value if entry.result else 'a value'}")
    if entry.routine is Routine.CONDITION:
        verifier.need(state, entry.truth, Value.TRUTH, Value.NUMBER)
    return Flow(state, falls=False)


_RULES: Mapping[Op, Rule] = {
    Op.COPY: _copy,
    Op.MUL: _multiply,
    **dict.fromkeys((Op.EQ, Op.NE), _compare),
    Op.ELEM: _element,
    Op.MVON: _guard,
    Op.MVCOR: _correction,
    Op.WHEN: _guard,
    Op.DISARM: _disarm,
    Op.UNTIL: _until,
    Op.AWAIT: lambda verifier, state: Flow(state, (verifier.targets[0], state)),
    Op.PUT: lambda verifier, state: Flow(state, next(((target, state) for target in verifier.targets), None)),
    Op.LOG: _log,
    Op.LOCK: _lock,
    Op.UNLK: _unlock,
    Op.CALL: _call,
    Op.CALLF: _call_function,
    Op.JMP: lambda verifier, state: Flow(state, (verifier.targets[0], state), falls=False),
    Op.JZ: _jump_if_not,
    Op.FOR: lambda verifier, state: Flow(state, (verifier.targets[0], state)),
    Op.FORK: _fork,
    Op.TRY: _try,
    Op.ENDT: _end_attempt,
    Op.ENDR: _end_attempt,
    Op.RETRY: _retry,
    **dict.fromkeys((Op.RAISE, Op.LATE), lambda _verifier, state: Flow(state, falls=False)),
    **dict.fromkeys(_ENDED_ROUTINES, _end_routine),
}
