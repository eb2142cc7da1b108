"""MOVE and its clauses."""

from typing import TYPE_CHECKING, TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Expression, Mobile, Node

if TYPE_CHECKING:
    from armwright.program.syntax.tree.statements import Statement


@attrs.frozen
class Directly(Node):
    """The shortest path for the joints."""


@attrs.frozen
class Straightly(Node):
    """One straight line."""


@attrs.frozen
class Via(Node):
    """``VIA (points)``."""

    points: tuple[Expression, ...]


@attrs.frozen
class Approach(Node):
    """``WITH APPROACH = point``."""

    point: Expression


@attrs.frozen
class Departure(Node):
    """``WITH DEPARTURE = point``."""

    point: Expression


@attrs.frozen
class Speed(Node):
    """``WITH SPEED = value``."""

    value: Expression


@attrs.frozen
class Blend(Node):
    """``WITH BLEND = distance``: how far from a via point its corner may be rounded."""

    value: Expression


@attrs.frozen
class Duration(Node):
    """``WITH DURATION = seconds``."""

    value: Expression


@attrs.frozen
class On(Node):
    """``ON condition DO action``; ``head`` reaches from ON to the end of the condition."""

    head: Span
    condition: Expression
    action: "Statement"


Clause: TypeAlias = Directly | Straightly | Via | Approach | Departure | Speed | Blend | Duration | On


def clause_word(kind: type) -> str:
    """Return the word by which the clauses of a kind begin, behind WITH."""
    return kind.__name__.upper()


@attrs.frozen
class Move(Node):
    """``MOVE moved TO goal clauses``."""

    moved: Mobile
    goal: Expression
    clauses: tuple[Clause, ...]
