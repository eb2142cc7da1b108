"""MOVE and its clauses."""

from typing import TYPE_CHECKING, TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Expression, Mobile

if TYPE_CHECKING:
    from armwright.program.syntax.tree.statements import Statement


@attrs.frozen
class Directly:
    """The shortest path for the joints."""

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
