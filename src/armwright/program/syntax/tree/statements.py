"""What a program does, statement by statement, and the clauses of MOVE."""

from typing import TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import ArmName, Expression, Mobile, Name, Number, Poison, String, Variable


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

    @property
    def chain(self) -> tuple[list["If"], "Statement | None"]:
        """This IF and all that follow it with ELSE IF, and the statement behind the last ELSE."""
        found, last = [self], self.otherwise
        while isinstance(last, If):
            found.append(last)
            last = last.otherwise
        return found, last

    @property
    def statements(self) -> "tuple[Statement, ...]":
        """The statements of its chain of which one is done."""
        found, last = self.chain
        return (*(one.then for one in found), *(() if last is None else (last,)))


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
    """``LOCK (variables) DO statement``; ``head`` reaches up to DO."""

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
