"""Nodes of the syntax tree: names, numbers and values, and going through a tree.

Names are compared by ``key``, shown by ``text``.
"""

from collections.abc import Iterator
from typing import TypeAlias

import attrs

from armwright.program.language.source import Span

# Deeper levels are not shown further to the right.
_MAX_SHOWN_DEPTH = 100


@attrs.frozen
class Node:
    """A part of the tree, and where it stands in the text."""

    span: Span


@attrs.frozen
class Name(Node):
    """A name as used: of a variable, a station, a device."""

    text: str
    key: str


@attrs.frozen
class ArmName(Node):
    """An arm; ``key`` is the canonical ``ARM_1``."""

    text: str
    key: str


@attrs.frozen
class Poison(Node):
    """Something that was reported and is passed over from here on: what it contains is unknown.

    Attributes:
        span: where it stands.
        names: the keys of the names that occur in it.
    """

    names: frozenset[str] = frozenset()


@attrs.frozen
class Number(Node):
    """A number with its sign.

    Attributes:
        span: where it stands.
        text: as written, sign and unit included.
        value: in the unit it is written in; NaN when it was reported.
        unit: in upper case, such as ``MM``; None without one.
    """

    text: str
    value: float
    unit: str | None = None


@attrs.frozen
class String(Node):
    """``"characters"``; the value is what stands between the marks."""

    value: str


@attrs.frozen
class Index(Node):
    """``name[i, j]``: an element of an array."""

    name: Name
    indices: tuple["Expression", ...]


@attrs.frozen
class Function(Node):
    """``NAME(arguments)`` as a value."""

    name: Name
    arguments: tuple["Expression", ...]


@attrs.frozen
class Unary(Node):
    """``-x`` or ``NOT x``; a minus right before a number is the number's sign and no operation."""

    operation: str
    operand: "Expression"


@attrs.frozen
class Binary(Node):
    """``a * b``; the operation is one of ``+ - * / < <= = <> >= > AND OR``."""

    operation: str
    left: "Expression"
    right: "Expression"


def operation_chain(node: Binary) -> tuple["Expression", list[Binary]]:
    """Return the first operand of a chain of operations, and the operations from the first to the last.

    ``a + b + c`` is ``(a + b) + c``: a sum of ten thousand terms is that deep on its left side, so nobody goes down
    there by calling himself.
    """
    operations, first = [node], node.left
    while isinstance(first, Binary):
        operations.append(first)
        first = first.left
    return first, operations[::-1]


@attrs.frozen
class Matrix(Node):
    """Values in parentheses; twelve if all is well, n, o, a, p column by column."""

    items: tuple["Expression", ...]


Variable: TypeAlias = Name | Index | Poison
Mobile: TypeAlias = Name | Index | ArmName | Poison
Expression: TypeAlias = Number | String | Name | Index | ArmName | Function | Unary | Binary | Matrix | Poison


def child_nodes(node: Node) -> Iterator[Node]:
    """Give the nodes right below a node, in the order of the text."""
    for _, value in _fields(node):
        yield from (part for part in (value if isinstance(value, tuple) else (value,)) if isinstance(part, Node))


def walk(node: Node) -> Iterator[Node]:
    """Give a node and all nodes below it, in the order of the text."""
    waiting = [node]
    while waiting:
        yield (now := waiting.pop())
        waiting += reversed([*child_nodes(now)])


def dump(node: object) -> Iterator[str]:
    """Return a tree as lines of text, two blanks per level, leaves on the line of their parent.

    A sum of ten thousand terms is that deep: beyond a hundred levels the blanks stay as they are, and a number states
    the level.
    """
    waiting: list[tuple[object, int, str]] = [(node, 0, "")]
    while waiting:
        now, depth, field = waiting.pop()
        level = f"({depth}) " if depth > _MAX_SHOWN_DEPTH else ""
        head = "  " * min(depth, _MAX_SHOWN_DEPTH) + level + (f"{field}: " if field else "")
        if isinstance(now, tuple):
            if all(isinstance(item, Number) for item in now):
                yield head + " ".join(item.text for item in now)
            else:
                waiting += [(item, depth, field) for item in reversed(now)]
            continue
        if not isinstance(now, Node):
            yield f"{head}{now}"
            continue
        parts = {name: value for name, value in _fields(now) if name != "key" and value is not None and value != ()}
        leaves = [str(value) for value in parts.values() if isinstance(value, str | float) and value != ""]
        yield head + " ".join((type(now).__name__, *leaves[:1]))
        inner = [(name, value) for name, value in parts.items() if not isinstance(value, str | float | frozenset)]
        waiting += [(value, depth + 1, name) for name, value in reversed(inner)]


def _fields(node: Node) -> Iterator[tuple[str, object]]:
    for attribute in type(node).__attrs_attrs__:
        value = getattr(node, attribute.name)
        if not isinstance(value, Span):
            yield attribute.name, value
