"""What a translated program consists of: values and statements that every writer prints in the language of its own.

Poses are those of the world, or of the tool for frames that an arm carries. Numbers count in the units of the program.
"""

from collections.abc import Iterable, Iterator
from typing import Any, Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, read_only
from armwright.cell.model import CellArm
from armwright.cell.outputs import Output
from armwright.export.conventions import ControllerArm
from armwright.program.language.source import Source, Span
from armwright.program.language.units import UnitSystem
from armwright.spatial.poses import inverse

Kind: TypeAlias = Literal["number", "truth", "pose"]

# ---- values --------------------------------------------------------------------------------------------------------


@attrs.frozen
class Number:
    """A number in the units of the program."""

    value: float


@attrs.frozen
class Truth:
    """A condition that always holds, or never."""

    value: bool


@attrs.frozen(eq=False)
class Pose:
    """A pose (4, 4), or a step between two."""

    X: Array = attrs.field(converter=read_only)

    @classmethod
    def identity(cls) -> "Pose":
        """Return the one that changes nothing."""
        return cls(np.eye(4))

    @property
    def is_identity(self) -> bool:
        """Whether it changes nothing."""
        return bool(np.array_equal(self.X, np.eye(4)))


@attrs.frozen
class Variable:
    """A variable, or an element of an array.

    Attributes:
        key: of its declaration.
        indices: of the element, from 1; empty for a single thing.
    """

    key: str
    indices: tuple["Value", ...] = ()


@attrs.frozen
class Operation:
    """A value that is worked out.

    Attributes:
        name: ``+ - * / negative``, ``< <= = <> >= >``, ``and or not``, ``compose inverse``, or that of a function of
            the language in lower case, such as ``xyz``.
        arguments: its operands.
    """

    name: str
    arguments: tuple["Value", ...]


@attrs.frozen
class FunctionCall:
    """The value of a function of the program."""

    procedure: str
    arguments: tuple["Value", ...]


@attrs.frozen
class Signal:
    """Whether a digital input, or an output, is on."""

    name: str
    address: Output
    is_input: bool


Value: TypeAlias = Number | Truth | Pose | Variable | Operation | FunctionCall | Signal


# ---- what the run says of a MOVE -----------------------------------------------------------------------------------


@attrs.frozen(kw_only=True, eq=False)
class Passages:
    """What a stage of a MOVE did in the run, each time that the program came past it.

    Attributes:
        reached: whether it was passed at all; else the numbers are those of a slow motion near the start.
        start: (k, n) joint positions where it began, each time.
        q: (k, m, n) those at the ends of its m legs.
        near: (n,) in the middle of those at its end.
        joint_speed: the largest of a joint at normal speed [rad/s].
        joint_acceleration: the largest [rad/s²].
        speed_part: the largest part of the speed limit of a joint at normal speed.
        speed: of the tool point at normal speed [m/s]; the slowest passage.
        turn_speed: of its rotation [rad/s]; the slowest passage.
        acceleration: of the tool point [m/s²]; the slowest passage.
        durations: (k,) of each passage [s].
        zones: (m,) from where on its corners are rounded [m].
        turns_only: whether the tool point stays where it is.
    """

    reached: bool
    start: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    near: Array = attrs.field(converter=read_only)
    joint_speed: float
    joint_acceleration: float
    speed_part: float
    speed: float
    turn_speed: float
    acceleration: float
    durations: Array = attrs.field(converter=read_only)
    zones: Array = attrs.field(converter=read_only)
    turns_only: bool


# ---- statements ----------------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Assign:
    """A variable gets a value."""

    span: Span
    target: Variable
    value: Value


@attrs.frozen(kw_only=True, eq=False)
class MoveTo:
    """One stage of a MOVE.

    Attributes:
        span: the MOVE in the program.
        straight: whether the tool goes along straight lines.
        targets: poses of the tool in the world, one after the other without a stop.
        passages: what it did in the run.
        speed: of the program, 100 being normal.
        duration: that the program gives the stage [s]; None where it gives a speed.
    """

    span: Span
    straight: bool
    targets: tuple[Value, ...]
    passages: Passages
    speed: Value
    duration: float | None = None


@attrs.frozen(kw_only=True)
class Switch:
    """A digital output is switched, for a time where there is one [s]."""

    span: Span
    name: str
    address: Output
    on: bool
    pulse: Value | None = None


@attrs.frozen(kw_only=True)
class Pause:
    """Nothing happens for a time [s]."""

    span: Span
    seconds: Value


@attrs.frozen(kw_only=True)
class Print:
    """Texts and values are shown in one line."""

    span: Span
    items: tuple[str | Value, ...]


@attrs.frozen(kw_only=True)
class WaitUntil:
    """Nothing happens until a condition holds, or a time is over [s], behind which other statements follow."""

    span: Span
    condition: Value
    limit: Value | None
    late: "tuple[Statement, ...]"


@attrs.frozen(kw_only=True)
class Choice:
    """One of two blocks."""

    span: Span
    condition: Value
    then: "tuple[Statement, ...]"
    otherwise: "tuple[Statement, ...]"


@attrs.frozen(kw_only=True)
class Loop:
    """A block as long as a condition holds, which is looked at before the block, or behind it where it is a REPEAT."""

    span: Span
    condition: Value
    body: "tuple[Statement, ...]"
    at_end: bool = False


@attrs.frozen(kw_only=True)
class Count:
    """A block for each number from one to another; the variable is set at its begin.

    Attributes:
        span: the FOR in the program.
        variable: that counts for the program.
        counter: that counts for the controller, whatever the block does to the other.
        limit: where the last number is kept while it runs; None where it is constant.
        first: number.
        last: number.
        step: constant, not 0.
        body: the block.
    """

    span: Span
    variable: Variable
    counter: Variable
    limit: Variable | None
    first: Value
    last: Value
    step: float
    body: "tuple[Statement, ...]"


@attrs.frozen(kw_only=True)
class Call:
    """A procedure of the program."""

    span: Span
    procedure: str
    arguments: tuple[Value, ...]


@attrs.frozen(kw_only=True)
class Return:
    """A function has its value."""

    span: Span
    value: Value


@attrs.frozen(kw_only=True)
class Halt:
    """The program ends."""

    span: Span


Statement: TypeAlias = (
    Assign | MoveTo | Switch | Pause | Print | WaitUntil | Choice | Loop | Count | Call | Return | Halt
)


# ---- the whole -----------------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True, eq=False)
class Declaration:
    """A variable: of the whole program, so that procedures see it.

    Attributes:
        key: its own.
        kind: of what it holds.
        sizes: of an array.
        initial: what it holds at the start.
    """

    key: str
    kind: Kind
    sizes: tuple[int, ...] = ()
    initial: Value

    @property
    def count(self) -> int:
        """How many elements it has."""
        return int(np.prod(self.sizes, dtype=int))


@attrs.frozen(kw_only=True)
class Procedure:
    """A procedure or function.

    Attributes:
        key: its own.
        parameters: by value: their keys and what they hold.
        result: of a function; None for a procedure.
        body: its statements.
    """

    key: str
    parameters: tuple[tuple[str, Kind], ...]
    result: Kind | None
    body: tuple[Statement, ...]


@attrs.frozen(kw_only=True, eq=False)
class ProgramCode:
    """A translated program.

    Attributes:
        name: as its file is called.
        source: text of the program.
        units: of its numbers.
        arm_name: of the arm in the cell.
        placed: the arm in the cell.
        mapped: the arm with the convention of its controller.
        declarations: of all variables that are used.
        procedures: each behind those that it calls.
        statements: of the program itself.
        kinds: what each variable and parameter holds.
        outputs: that OPERATE switches, by name; all are off at the end.
        notes: what is to be known of the translation, with lines.
    """

    name: str
    source: Source
    units: UnitSystem
    arm_name: str
    placed: CellArm
    mapped: ControllerArm
    declarations: tuple[Declaration, ...]
    procedures: tuple[Procedure, ...]
    statements: tuple[Statement, ...]
    kinds: dict[str, Kind]
    outputs: tuple[tuple[str, Output], ...]
    notes: tuple[str, ...]

    @property
    def X_CW(self) -> Array:
        """The world (4, 4), seen from the base frame of the controller."""
        return self.mapped.pose(np.asarray(inverse(self.placed.base)))

    def everything(self) -> Iterator[Statement]:
        """Give all statements, also those inside others."""
        return every_statement([self.statements, *(procedure.body for procedure in self.procedures)])


def every_statement(blocks: Iterable[tuple[Statement, ...]]) -> Iterator[Statement]:
    """Give all statements of blocks, also those inside others."""
    waiting = [*blocks]
    while waiting:
        for statement in waiting.pop():
            yield statement
            waiting += inner_blocks(statement)


def every_value(blocks: Iterable[tuple[Statement, ...]]) -> Iterator[Value]:
    """Give all values in the statements of blocks."""
    for statement in every_statement(blocks):
        yield from values_of(statement)


def inner_blocks(statement: Statement) -> list[tuple[Statement, ...]]:
    """Return the blocks inside a statement."""
    match statement:
        case WaitUntil(late=late):
            return [late]
        case Choice(then=then, otherwise=otherwise):
            return [then, otherwise]
        case Loop(body=body) | Count(body=body):
            return [body]
    return []


def values_of(part: Any) -> Iterator[Value]:
    """Give the values in a statement or a value, and those that they are made of, but not those of inner blocks."""
    if isinstance(part, Number | Truth | Pose | Variable | Operation | FunctionCall | Signal):
        yield part
    if isinstance(part, Operation | FunctionCall):
        inner: tuple[Any, ...] = part.arguments
    elif isinstance(part, Variable):
        inner = part.indices
    else:
        fields = {
            Assign: ("target", "value"),
            MoveTo: ("targets", "speed"),
            Switch: ("pulse",),
            Pause: ("seconds",),
            Print: ("items",),
            WaitUntil: ("condition", "limit"),
            Choice: ("condition",),
            Loop: ("condition",),
            Count: ("variable", "counter", "limit", "first", "last"),
            Call: ("arguments",),
            Return: ("value",),
        }.get(type(part), ())
        found = [getattr(part, name) for name in fields]
        inner = tuple(x for value in found for x in (value if isinstance(value, tuple) else (value,)))
    for value in inner:
        yield from values_of(value)
