"""Following intermediate code: what is certain in front of each instruction, on every way there."""

import enum
import heapq
from collections.abc import Callable, Mapping
from typing import TypeAlias

import attrs

from armwright.errors import ArmwrightError
from armwright.program.bytecode.instructions import Code, JumpTarget, Op, Operand, ProcedureCode, Text
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.names import is_arm


class CodeError(ArmwrightError, ValueError):
    """Intermediate code cannot be interpreted.

    Attributes:
        instruction: the number of the instruction.
        fault: what is wrong with it.
    """

    def __init__(self, instruction: int, fault: str) -> None:
        """Keep what is wrong."""
        self.instruction, self.fault = instruction, fault
        super().__init__(f"instruction {instruction:04d}: {fault}")


class Value(enum.Enum):
    """What a value is while a program runs."""

    NUMBER = "a number"
    TRUTH = "a truth value"
    POSE = "a pose or a transformation"
    TEXT = "a text"


@attrs.frozen
class Element:
    """What a value in passing names: an element of an array."""

    kind: VariableKind


ValueType: TypeAlias = Value | Element
OF_KIND = {
    VariableKind.SCALAR: Value.NUMBER,
    VariableKind.TRANS: Value.POSE,
    VariableKind.FRAME: Value.POSE,
    VariableKind.BOOLEAN: Value.TRUTH,
    VariableKind.TEXT: Value.TEXT,
}
_FRAME = VariableType(VariableKind.FRAME)


class Routine(enum.Enum):
    """What a stretch of code is a part of."""

    PROGRAM = "the program"
    PROCEDURE = "a procedure"
    FUNCTION = "a function"
    BRANCH = "a branch"
    CONDITION = "a condition"
    ACTION = "an action"
    WATCH = "the action of a WHEN"


@attrs.frozen
class State:
    """What is certain in front of an instruction.

    Attributes:
        written: a bit for each value in passing.
        locks: the operands of the LOCKs it is in.
        attempts: the TRYs it is in.
    """

    written: int = 0
    locks: tuple[tuple[Operand, ...], ...] = ()
    attempts: tuple["Attempt", ...] = ()


@attrs.frozen
class Attempt:
    """A TRY: its instruction, whether its RECOVER part is meant, and the LOCKs around it."""

    start: int
    recovering: bool
    locks: tuple[tuple[Operand, ...], ...]


@attrs.frozen
class Entry:
    """Where a routine begins.

    Attributes:
        at: its first instruction.
        routine: what it is.
        types: its own names; ``None`` for those of the program alone.
        state: in front of the first instruction.
        truth: the value in passing that a condition leaves.
        result: what the value of a function is.
        begun: the instruction that begins it.
    """

    at: int
    routine: Routine
    types: Mapping[str, VariableType]
    state: State = State()
    truth: str = ""
    begun: int = -1
    result: Value | None = None


@attrs.frozen
class Flow:
    """What an instruction does to the flow.

    Attributes:
        state: behind it.
        target: where else it leads, and in which state.
        falls: whether it leads on to the next instruction.
    """

    state: State
    target: tuple[int, State] | None = None
    falls: bool = True


class Verifier:
    """Follows code.

    Attributes:
        code: the code.
        at: the instruction.
        entry: where its routine begins.
    """

    def __init__(self, code: Code, rule: "Callable[[Verifier, State], Flow]") -> None:
        """Stand in front of the first instruction.

        Args:
            code: whose operands have the sorts that their operations take, and whose jumps lead to instructions.
            rule: checks the instruction, and says what it does to the flow.
        """
        self.code, self._rule = code, rule
        self.at, self.entry = 0, Entry(0, Routine.PROGRAM, {})
        procedures = [_entry(own) for own in code.procedures.values()]
        self._entries = [self.entry, *procedures]
        self._owners: dict[int, Entry] = {}
        self._known: dict[int, State] = {}
        self._types: dict[str, ValueType] = {}
        self._bits: dict[str, int] = {}
        attempts = {number for number, step in enumerate(code.instructions) if step.op is Op.TRY}
        self._merges = jump_targets(code) | attempts

    @property
    def op(self) -> Op:
        """The operation of the instruction."""
        return self.code.instructions[self.at].op

    @property
    def operands(self) -> tuple[Operand, ...]:
        """The operands of the instruction."""
        return self.code.instructions[self.at].operands

    @property
    def targets(self) -> list[int]:
        """The numbers of the instructions that the instruction jumps to."""
        return [operand.index for operand in self.operands if isinstance(operand, JumpTarget)]

    def follow(self) -> None:
        """Follow every routine, until nothing new is learnt of any instruction.

        Stretches are taken in the order of their instructions: what leads forward to one is known before it is
        followed, so that code is gone through once, and loops again where less is certain at their end.

        Raises:
            CodeError: an instruction cannot be interpreted.
        """
        while self._entries:
            self.entry = self._entries.pop()
            waiting: list[int] = []
            self._lead_to(self.entry.at, self.entry.state, waiting)
            while waiting:
                number = heapq.heappop(waiting)
                if not waiting or waiting[0] != number:  # it may wait more than once
                    self._follow_on(number, waiting)

    def _follow_on(self, number: int, waiting: list[int]) -> None:
        """Follow one stretch, up to where paths meet."""
        state, last = self._known[number], len(self.code.instructions) - 1
        while True:
            self._enter(number)
            flow = self._rule(self, state)
            if flow.target is not None:
                self._lead_to(*flow.target, waiting)
                self.at = number
            if not flow.falls:
                return
            if number == last:
                raise self.wrong("execution would continue after the last instruction")
            state, number = flow.state, number + 1
            if number in self._merges:
                self._lead_to(number, state, waiting)
                return

    def _lead_to(self, number: int, state: State, waiting: list[int]) -> None:
        """Let a path lead to an instruction; it is followed on from there where less is certain than before."""
        self._enter(number)
        old = self._known.get(number)
        merged = state if old is None else self._merged(old, state)
        if merged != old:
            self._known[number] = merged
            heapq.heappush(waiting, number)

    def _enter(self, number: int) -> None:
        """Go to an instruction, which belongs to one routine alone."""
        self.at = number
        owner = self._owners.setdefault(number, self.entry)
        if (owner.at, owner.routine, owner.begun) != (self.entry.at, self.entry.routine, self.entry.begun):
            raise self.wrong(f"{self.entry.routine.value} leads to an instruction of another routine")

    def _merged(self, old: State, new: State) -> State:
        if (old.attempts, old.locks) != (new.attempts, new.locks):
            raise self.wrong("two paths lead here that differ in their open TRYs or LOCKs")
        return attrs.evolve(new, written=old.written & new.written)

    def begin(self, target: int, routine: Routine, state: State, truth: str = "") -> None:
        """Follow a routine that the instruction begins, with the values in passing that are known here."""
        inside = attrs.evolve(state, attempts=(), locks=())
        self._entries.append(Entry(target, routine, self.entry.types, inside, truth, self.at))

    def wrong(self, fault: str) -> CodeError:
        """Return the error of the instruction."""
        return CodeError(self.at, fault)

    def declared(self, name: str) -> VariableType | None:
        """Return what a declared name holds; None where it is not declared."""
        return self.entry.types.get(name) or self.code.types.get(name)

    def type_of(self, state: State, operand: Operand) -> VariableType:
        """Return what a name or an element holds; a name that is not declared is that of a frame of the cell."""
        if not isinstance(operand, str):
            raise self.wrong(f"expected a name, got {operand}")
        if operand.startswith("%"):
            kept = self._passing(state, operand)
            if not isinstance(kept, Element):
                raise self.wrong(f"expected a name, but {operand} is {kept.value}")
            return VariableType(kept.kind)
        return VariableType(VariableKind.FRAME) if is_arm(operand) else self.declared(operand) or _FRAME

    def need_name(self, state: State, operand: Operand, kind: VariableKind) -> None:
        """See to it that an operand names a variable of a kind."""
        if self.type_of(state, operand) != VariableType(kind):
            raise self.wrong(f"{self.op} expects the name of a variable of type {kind}, got {operand}")

    def value(self, state: State, operand: Operand) -> Value:
        """Return what the value of an operand is."""
        if not isinstance(operand, str):
            return Value.TEXT if isinstance(operand, Text) else Value.NUMBER
        if operand.startswith("%") and isinstance(kept := self._passing(state, operand), Value):
            return kept
        kind = self.type_of(state, operand)
        if kind.sizes or kind.kind not in OF_KIND:
            raise self.wrong(f"{operand} is {kind} and has no value")
        return OF_KIND[kind.kind]

    def need(self, state: State, operand: Operand, *wanted: Value) -> None:
        """See to it that an operand has a value of a sort."""
        value = self.value(state, operand)
        if value not in wanted:
            raise self.wrong(f"{self.op} expects {wanted[0].value}, but {operand} is {value.value}")

    def _passing(self, state: State, name: str) -> ValueType:
        bit = self._bits.get(name)
        if bit is None or not state.written >> bit & 1:
            raise self.wrong(f"{name} is read before it is written")
        return self._types[name]

    def write(self, state: State, to: Operand, value: Value) -> State:
        """Write a value to a variable, to the element that a value in passing names, or to a value in passing."""
        name = str(to)
        if name.startswith("%") and not isinstance(self._types.get(name), Element):
            return self.define(state, name, value)
        kind = self.type_of(state, name)
        if self.entry.routine is Routine.FUNCTION and name not in self.entry.types and not name.startswith("%"):
            raise self.wrong(f"a function must not change {name}, which is not its own")
        if kind.sizes or OF_KIND.get(kind.kind) is not value:
            raise self.wrong(f"{name} is {kind}, but the value is {value.value}")
        return state

    def define(self, state: State, name: str, kind: ValueType) -> State:
        """Write a value in passing."""
        if self._types.setdefault(name, kind) != kind:
            raise self.wrong(f"{name} would have two different types")
        return attrs.evolve(state, written=state.written | 1 << self._bits.setdefault(name, len(self._bits)))


def _entry(own: ProcedureCode) -> Entry:
    """Return where a procedure or function begins."""
    if own.result is None:
        return Entry(own.start, Routine.PROCEDURE, own.types)
    return Entry(own.start, Routine.FUNCTION, own.types, result=OF_KIND.get(own.result.kind))


def jump_targets(code: Code) -> set[int]:
    """Return the numbers of the instructions that others jump to."""
    return {operand.index for step in code.instructions for operand in step.operands if isinstance(operand, JumpTarget)}
