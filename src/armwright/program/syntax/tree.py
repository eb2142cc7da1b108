"""The syntax tree: what a program says, and where it says it. Names are compared by ``key``, shown by ``text``."""

from collections.abc import Iterator
from typing import TypeAlias

import attrs

from armwright.program.text.source import Span


@attrs.frozen
class Name:
    """A name as used: of a variable, a station, a device."""

    span: Span
    text: str
    key: str


@attrs.frozen
class ArmName:
    """An arm; ``key`` is the canonical ``ARM_1``."""

    span: Span
    text: str
    key: str


@attrs.frozen
class Poison:
    """Something that was reported and is passed over from here on: what it contains is unknown.

    Attributes:
        span: where it stands.
        names: the keys of the names that occur in it.
    """

    span: Span
    names: frozenset[str] = frozenset()


@attrs.frozen
class Number:
    """A number with its sign.

    Attributes:
        span: where it stands.
        text: as written, sign and unit included.
        value: in the unit it is written in; NaN when it was reported.
        unit: in upper case, such as ``MM``; None without one.
    """

    span: Span
    text: str
    value: float
    unit: str | None = None


@attrs.frozen
class String:
    """``"characters"``; the value is what stands between the marks."""

    span: Span
    value: str


@attrs.frozen
class Index:
    """``name[i, j]``: an element of an array."""

    span: Span
    name: Name
    indices: tuple["Expression", ...]


@attrs.frozen
class Function:
    """``NAME(arguments)`` as a value."""

    span: Span
    name: Name
    arguments: tuple["Expression", ...]


@attrs.frozen
class Unary:
    """``-x`` or ``NOT x``; a minus right before a number is the number's sign and no operation."""

    span: Span
    operation: str
    operand: "Expression"


@attrs.frozen
class Binary:
    """``a * b``; the operation is one of ``+ - * / < <= = <> >= > AND OR``."""

    span: Span
    operation: str
    left: "Expression"
    right: "Expression"


@attrs.frozen
class Matrix:
    """Values in parentheses; twelve if all is well, n, o, a, p column by column."""

    span: Span
    items: tuple["Expression", ...]


Variable: TypeAlias = Name | Index | Poison
Mobile: TypeAlias = Name | Index | ArmName | Poison
Expression: TypeAlias = Number | Name | Index | ArmName | Function | Unary | Binary | Matrix | Poison


@attrs.frozen
class TypeName:
    """The type of a declaration.

    Attributes:
        span: where it stands.
        text: as written.
        key: SCALAR, TRANS, FRAME or EVENT; None when it is none of them.
        sizes: of an array, one for each index; empty for a single thing.
    """

    span: Span
    text: str
    key: str | None
    sizes: tuple[Number, ...] = ()


@attrs.frozen
class Declaration:
    """``a, b : TYPE``, in a VAR part or as a parameter."""

    span: Span
    names: tuple[Name, ...]
    type: TypeName


@attrs.frozen
class Import:
    """``IMPORT "file"``."""

    span: Span
    path: String


@attrs.frozen
class Units:
    """``UNITS unit, unit``."""

    span: Span
    units: tuple[Name, ...]


@attrs.frozen
class Procedure:
    """``PROCEDURE name (parameters) ; VAR ... BEGIN ... END``; ``head`` reaches up to the closing parenthesis."""

    span: Span
    head: Span
    name: Name
    parameters: tuple[Declaration, ...]
    declarations: tuple[Declaration, ...]
    body: "Block"


@attrs.frozen
class Assign:
    """``variable = value``."""

    span: Span
    target: Variable | ArmName
    value: Expression


@attrs.frozen
class Affix:
    """``AFFIX child TO parent [AT step] [RIGIDLY]``; ``link`` reaches from AFFIX to the parent."""

    span: Span
    link: Span
    child: Mobile
    parent: Mobile
    at: Expression | None
    rigid: bool = False


@attrs.frozen
class Unfix:
    """``UNFIX child FROM parent``; the parent is missing where it was left out."""

    span: Span
    child: Mobile
    parent: Mobile | None


@attrs.frozen
class Open:
    """``OPEN arm [TO width]``."""

    span: Span
    arm: Mobile
    width: Expression | None = None


@attrs.frozen
class Grasp:
    """``GRASP [arm]``."""

    span: Span
    arm: Mobile | None


@attrs.frozen
class Operate:
    """``OPERATE device [ON | OFF]``."""

    span: Span
    device: Mobile
    on: bool = True


@attrs.frozen
class ReadVisions:
    """``READ VISIONS (frame, frame)``."""

    span: Span
    targets: tuple[Mobile, ...]


@attrs.frozen
class ReadSystem:
    """``READ SYSTEM (arm)``."""

    span: Span
    arm: Mobile


@attrs.frozen
class Directly:
    """The shortest way for the joints."""

    span: Span


@attrs.frozen
class Straightly:
    """One straight line."""

    span: Span


@attrs.frozen
class Via:
    """``VIA (points)``."""

    span: Span
    points: tuple[Expression, ...]


@attrs.frozen
class Approach:
    """``WITH APPROACH = point``."""

    span: Span
    point: Expression


@attrs.frozen
class Departure:
    """``WITH DEPARTURE = point``."""

    span: Span
    point: Expression


@attrs.frozen
class Speed:
    """``WITH SPEED = value``."""

    span: Span
    value: Expression


@attrs.frozen
class Blend:
    """``WITH BLEND = distance``: how far from a via point its corner may be rounded."""

    span: Span
    value: Expression


@attrs.frozen
class Duration:
    """``WITH DURATION = seconds``."""

    span: Span
    value: Expression


@attrs.frozen
class On:
    """``ON condition DO action``; ``head`` reaches from ON to the end of the condition."""

    span: Span
    head: Span
    condition: Expression
    action: "Statement"


Clause: TypeAlias = Directly | Straightly | Via | Approach | Departure | Speed | Blend | Duration | On


@attrs.frozen
class Move:
    """``MOVE moved TO goal clauses``."""

    span: Span
    moved: Mobile
    goal: Expression
    clauses: tuple[Clause, ...]


@attrs.frozen
class Block:
    """``BEGIN statements END``; ``end`` is its END."""

    span: Span
    statements: tuple["Statement", ...]
    end: Span


@attrs.frozen
class If:
    """``IF condition THEN statement [ELSE statement]``; ``head`` reaches up to THEN."""

    span: Span
    head: Span
    condition: Expression
    then: "Statement"
    otherwise: "Statement | None"


@attrs.frozen
class While:
    """``WHILE condition DO statement``; ``head`` reaches up to DO."""

    span: Span
    head: Span
    condition: Expression
    body: "Statement"


@attrs.frozen
class Repeat:
    """``REPEAT statements UNTIL condition``; ``tail`` reaches from UNTIL to the end."""

    span: Span
    body: tuple["Statement", ...]
    tail: Span
    condition: Expression


@attrs.frozen
class For:
    """``FOR variable = first TO last [STEP step] DO statement``; ``head`` reaches up to DO."""

    span: Span
    head: Span
    variable: Name | Poison
    first: Expression
    last: Expression
    step: Expression | None
    body: "Statement"


@attrs.frozen
class Branch:
    """``[PRIORITY number :] BEGIN ... END``; ``head`` is its first line's words up to BEGIN."""

    span: Span
    head: Span
    priority: Number | None
    body: Block


@attrs.frozen
class Cobegin:
    """``COBEGIN branches COEND``."""

    span: Span
    branches: tuple[Branch, ...]


@attrs.frozen
class Signal:
    """``SIGNAL event``."""

    span: Span
    event: Variable


@attrs.frozen
class Wait:
    """``WAIT event``."""

    span: Span
    event: Variable


@attrs.frozen
class Pause:
    """``PAUSE seconds``."""

    span: Span
    duration: Expression


@attrs.frozen
class Lock:
    """``LOCK (frames) DO statement``; ``head`` reaches up to DO."""

    span: Span
    head: Span
    targets: tuple[Variable, ...]
    body: "Statement"


@attrs.frozen
class Try:
    """``TRY statements RECOVER statements END``."""

    span: Span
    body: tuple["Statement", ...]
    recovery: tuple["Statement", ...]


@attrs.frozen
class Retry:
    """``RETRY``."""

    span: Span


@attrs.frozen
class Halt:
    """``HALT``."""

    span: Span


@attrs.frozen
class Print:
    """``PRINT (values and strings)``."""

    span: Span
    items: tuple[Expression | String, ...]


@attrs.frozen
class Call:
    """``name (arguments)``."""

    span: Span
    name: Name
    arguments: tuple[Expression, ...]


Statement: TypeAlias = (
    Assign
    | Affix
    | Unfix
    | Open
    | Grasp
    | Operate
    | ReadVisions
    | ReadSystem
    | Move
    | Block
    | If
    | While
    | Repeat
    | For
    | Cobegin
    | Signal
    | Wait
    | Pause
    | Lock
    | Try
    | Retry
    | Halt
    | Print
    | Call
    | Poison
)
Header: TypeAlias = Declaration | Import | Units | Procedure


@attrs.frozen
class Program:
    """A whole program.

    Attributes:
        span: from the first token to the last.
        headers: declarations, imports, units and procedures, in the order of the text.
        statements: in order.
        end: the closing END.
    """

    span: Span
    headers: tuple[Header, ...]
    statements: tuple[Statement, ...]
    end: Span

    @property
    def declarations(self) -> tuple[Declaration, ...]:
        """The declarations of the VAR parts."""
        return tuple(header for header in self.headers if isinstance(header, Declaration))

    @property
    def procedures(self) -> tuple[Procedure, ...]:
        """The procedures."""
        return tuple(header for header in self.headers if isinstance(header, Procedure))


def walk(node: object) -> Iterator[object]:
    """Give a node and all nodes below it, in the order of the text."""
    waiting = [node]
    while waiting:
        now = waiting.pop()
        if isinstance(now, tuple):
            waiting += reversed(now)
        elif attrs.has(type(now)) and not isinstance(now, Span):
            yield now
            waiting += [value for _, value in reversed([*_fields(now)])]


def dump(node: object, depth: int = 0, field: str = "") -> Iterator[str]:
    """Return a tree as lines of text, two blanks per level, leaves on the line of their parent."""
    head = "  " * depth + (f"{field}: " if field else "")
    if isinstance(node, tuple):
        if all(isinstance(item, Number) for item in node):
            yield head + " ".join(item.text for item in node)
            return
        for item in node:
            yield from dump(item, depth, field)
        return
    if not attrs.has(type(node)):
        yield f"{head}{node}"
        return
    own = type(node).__name__
    parts = {name: value for name, value in _fields(node) if name != "key" and value is not None and value != ()}
    leaves = [str(value) for value in parts.values() if isinstance(value, str | float)]
    yield head + " ".join((own, *leaves[:1]))
    for name, value in parts.items():
        if not isinstance(value, str | float | frozenset):
            yield from dump(value, depth + 1, name)


def _fields(node: object) -> Iterator[tuple[str, object]]:
    for attribute in type(node).__attrs_attrs__:  # type: ignore[attr-defined]
        value = getattr(node, attribute.name)
        if not isinstance(value, Span):
            yield attribute.name, value
