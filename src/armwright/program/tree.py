"""The syntax tree: what a program says, and where it says it. Names are compared by ``key``, shown by ``text``."""

from collections.abc import Iterator
from typing import TypeAlias

import attrs

from armwright.program.source import Span


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


Mobile: TypeAlias = Name | ArmName | Poison


@attrs.frozen
class Number:
    """A number with its sign."""

    span: Span
    text: str
    value: float


@attrs.frozen
class Matrix:
    """Numbers in parentheses; twelve if all is well, n, o, a, p column by column."""

    span: Span
    numbers: tuple[Number, ...]


@attrs.frozen
class TypeName:
    """The type of a declaration.

    Attributes:
        span: where it stands.
        text: as written.
        key: SCALAR, TRANS or FRAME; None when it is none of them.
    """

    span: Span
    text: str
    key: str | None


@attrs.frozen
class Declaration:
    """``a, b : TYPE``."""

    span: Span
    names: tuple[Name, ...]
    type: TypeName


@attrs.frozen
class Init:
    """``name = value``."""

    span: Span
    name: Name | ArmName
    value: Matrix | Number | Poison


@attrs.frozen
class Affix:
    """``AFFIX child TO parent [AT step]``; ``link`` reaches from AFFIX to the parent."""

    span: Span
    link: Span
    child: Mobile
    parent: Mobile
    at: Mobile | None


@attrs.frozen
class Unfix:
    """``UNFIX child FROM parent``; the parent is missing where it was left out."""

    span: Span
    child: Mobile
    parent: Mobile | None


@attrs.frozen
class Open:
    """``OPEN arm``."""

    span: Span
    arm: Mobile


@attrs.frozen
class Grasp:
    """``GRASP [arm]``."""

    span: Span
    arm: Mobile | None


@attrs.frozen
class Operate:
    """``OPERATE device``."""

    span: Span
    device: Mobile


@attrs.frozen
class ReadVisions:
    """``READ VISIONS (frame)``."""

    span: Span
    target: Mobile


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
    points: tuple[Mobile, ...]


@attrs.frozen
class Approach:
    """``WITH APPROACH = point``."""

    span: Span
    point: Mobile


@attrs.frozen
class Departure:
    """``WITH DEPARTURE = point``."""

    span: Span
    point: Mobile


@attrs.frozen
class Speed:
    """``WITH SPEED = value``."""

    span: Span
    value: Number | Mobile


Clause: TypeAlias = Directly | Straightly | Via | Approach | Departure | Speed


@attrs.frozen
class Move:
    """``MOVE moved TO goal clauses``."""

    span: Span
    moved: Mobile
    goal: Mobile
    clauses: tuple[Clause, ...]


Statement: TypeAlias = Init | Affix | Unfix | Open | Grasp | Operate | ReadVisions | ReadSystem | Move | Poison


@attrs.frozen
class Program:
    """A whole program.

    Attributes:
        span: from the first token to the last.
        declarations: of the VAR parts, in order.
        statements: in order.
        end: the closing END.
    """

    span: Span
    declarations: tuple[Declaration, ...]
    statements: tuple[Statement, ...]
    end: Span


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
