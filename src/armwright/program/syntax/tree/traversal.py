"""Going through trees: all nodes one after the other, or as lines of text."""

from collections.abc import Iterator

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Node, Number

# Deeper levels are not shown further to the right.
_MAX_SHOWN_DEPTH = 100


def walk(node: object) -> Iterator[object]:
    """Give a node and all nodes below it, in the order of the text."""
    waiting = [node]
    while waiting:
        now = waiting.pop()
        if isinstance(now, tuple):
            waiting += reversed(now)
        elif isinstance(now, Node):
            yield now
            waiting += [value for _, value in reversed([*_fields(now)])]


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
        leaves = [str(value) for value in parts.values() if isinstance(value, str | float)]
        yield head + " ".join((type(now).__name__, *leaves[:1]))
        inner = [(name, value) for name, value in parts.items() if not isinstance(value, str | float | frozenset)]
        waiting += [(value, depth + 1, name) for name, value in reversed(inner)]


def _fields(node: Node) -> Iterator[tuple[str, object]]:
    for attribute in type(node).__attrs_attrs__:
        value = getattr(node, attribute.name)
        if not isinstance(value, Span):
            yield attribute.name, value
