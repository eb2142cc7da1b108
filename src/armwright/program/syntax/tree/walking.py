"""Going through trees: all nodes one after the other, or as lines of text."""

from collections.abc import Iterator

import attrs

from armwright.program.syntax.tree.values import Number
from armwright.program.text.source import Span


def walk(node: object) -> Iterator[object]:
    """Give a node and all nodes below it, in the order of the text."""
    waiting = [node]
    while waiting:
        now = waiting.pop()
        if isinstance(now, tuple):
            waiting += reversed(now)
        elif attrs.has(type(now)):
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
