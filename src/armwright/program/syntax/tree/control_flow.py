"""Statements that hold others or decide what is done next."""

from typing import TYPE_CHECKING, TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Expression, Name, Node, Number, Poison, Variable

if TYPE_CHECKING:
    from armwright.program.syntax.tree.statements import Statement


@attrs.frozen
class Block(Node):
    """``BEGIN statements END``; ``end`` is its END."""

    statements: tuple["Statement", ...]
    end: Span


@attrs.frozen
class If(Node):
    """``IF condition THEN statement [ELSE statement]``; ``head`` reaches up to THEN."""

    head: Span
    condition: Expression
    then: "Statement"
    otherwise: "Statement | None"

    @property
    def else_if_chain(self) -> tuple[list["If"], "Statement | None"]:
        """This IF and all that follow it with ELSE IF, and the statement behind the last ELSE."""
        conditionals, last = [self], self.otherwise
        while isinstance(last, If):
            conditionals.append(last)
            last = last.otherwise
        return conditionals, last

    @property
    def statements(self) -> "tuple[Statement, ...]":
        """The statements of its chain of which one is done."""
        conditionals, last = self.else_if_chain
        return (*(conditional.then for conditional in conditionals), *(() if last is None else (last,)))


@attrs.frozen
class While(Node):
    """``WHILE condition DO statement``; ``head`` reaches up to DO."""

    head: Span
    condition: Expression
    body: "Statement"


@attrs.frozen
class Repeat(Node):
    """``REPEAT statements UNTIL condition``; ``tail`` reaches from UNTIL to the end."""

    body: tuple["Statement", ...]
    tail: Span
    condition: Expression


@attrs.frozen
class For(Node):
    """``FOR variable = first TO last [STEP step] DO statement``; ``head`` reaches up to DO."""

    head: Span
    variable: Name | Poison
    first: Expression
    last: Expression
    step: Expression | None
    body: "Statement"


@attrs.frozen
class Branch(Node):
    """``[PRIORITY number :] BEGIN ... END``; ``head`` is its first line's words up to BEGIN."""

    head: Span
    priority: Number | None
    body: Block


@attrs.frozen
class Cobegin(Node):
    """``COBEGIN branches COEND``; ``end`` is its COEND."""

    branches: tuple[Branch, ...]
    end: Span


@attrs.frozen
class Signal(Node):
    """``SIGNAL event``."""

    event: Variable


@attrs.frozen
class Wait(Node):
    """``WAIT event``."""

    event: Variable


@attrs.frozen
class Pause(Node):
    """``PAUSE seconds``."""

    duration: Expression


@attrs.frozen
class Lock(Node):
    """``LOCK (variables) DO statement``; ``head`` reaches up to DO."""

    head: Span
    targets: tuple[Variable, ...]
    body: "Statement"


@attrs.frozen
class Try(Node):
    """``TRY statements RECOVER statements END``; ``recover`` and ``end`` are its words, or where they are missing."""

    body: tuple["Statement", ...]
    recover: Span
    recovery: tuple["Statement", ...]
    end: Span


@attrs.frozen
class Retry(Node):
    """``RETRY``."""


@attrs.frozen
class Halt(Node):
    """``HALT``."""


@attrs.frozen
class Call(Node):
    """``name (arguments)``."""

    name: Name
    arguments: tuple[Expression, ...]


ControlStatement: TypeAlias = (
    Block | If | While | Repeat | For | Cobegin | Signal | Wait | Pause | Lock | Try | Retry | Halt | Call
)
