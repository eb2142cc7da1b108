"""Statements that hold others or decide what is done next."""

from typing import TYPE_CHECKING

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Expression, Name, Number, Poison, Variable

if TYPE_CHECKING:
    from armwright.program.syntax.tree.statements import Statement


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
        conditionals, last = [self], self.otherwise
        while isinstance(last, If):
            conditionals.append(last)
            last = last.otherwise
        return conditionals, last

    @property
    def statements(self) -> "tuple[Statement, ...]":
        """The statements of its chain of which one is done."""
        conditionals, last = self.chain
        return (*(conditional.then for conditional in conditionals), *(() if last is None else (last,)))


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
    """``COBEGIN branches COEND``; ``end`` is its COEND."""

    span: Span
    branches: tuple[Branch, ...]
    end: Span


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
    """``TRY statements RECOVER statements END``; ``recover`` and ``end`` are its words, or where they are missing."""

    span: Span
    body: tuple["Statement", ...]
    recover: Span
    recovery: tuple["Statement", ...]
    end: Span


@attrs.frozen
class Retry:
    """``RETRY``."""

    span: Span


@attrs.frozen
class Halt:
    """``HALT``."""

    span: Span


@attrs.frozen
class Call:
    """``name (arguments)``."""

    span: Span
    name: Name
    arguments: tuple[Expression, ...]
