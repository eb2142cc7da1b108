"""The beginning and the end of what a run did, where all of it is too much to show; the whole is in events.jsonl."""

from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")
R = TypeVar("R")

# Rows of a table, or lines, that a terminal shows; items that a page or a record lists; letters of one of them.
MAX_TERMINAL_LINES, MAX_LIST_ITEMS, MAX_LINE_LENGTH = 1000, 4000, 1000
# Where all is: in the files of the run, or nowhere, where none were asked for.
EVENT_LOG_HINT, NO_EVENT_LOG_HINT = "all in events.jsonl", "`-o FOLDER` keeps all in events.jsonl"


class Excerpt(NamedTuple, Generic[T]):
    """Items, or the first and the last of them.

    Attributes:
        first: from the beginning on.
        last: up to the end; empty where nothing is left out.
        omitted: how many stand between.
    """

    first: Sequence[T]
    last: Sequence[T]
    omitted: int

    def map(self, show: Callable[[T], R]) -> "Excerpt[R]":
        """Return what ``show`` makes of each."""
        return Excerpt([*map(show, self.first)], [*map(show, self.last)], self.omitted)

    def join(self, *replacement: T) -> list[T]:
        """Return the items, with ``rest`` instead of those that are left out."""
        return [*self.first, *(replacement if self.omitted else ()), *self.last]


def excerpt(items: Sequence[T], max_count: int) -> Excerpt[T]:
    """Return as many items as can be shown.

    Args:
        items: in order; a text is one of letters.
        max_count: how many, half of them from the end.
    """
    if len(items) <= max_count:
        return Excerpt(items, (), 0)
    half = max_count // 2
    return Excerpt(items[:half], items[len(items) - half :], len(items) - 2 * half)


def omission_text(omitted: int, hint: str = EVENT_LOG_HINT) -> str:
    """Say how many items are not shown, and where they are."""
    return f"... and {omitted:,} more; {hint}"


def shorten_line(text: str, hint: str = EVENT_LOG_HINT) -> str:
    """Return a text as one line of a list: the midst of a very long one is left out."""
    part = excerpt(text, MAX_LINE_LENGTH)
    return "".join(part.join(f" {omission_text(part.omitted, hint)} "))


def shorten_list(texts: Sequence[str], max_count: int, hint: str = EVENT_LOG_HINT) -> list[str]:
    """Return lines of a list, with one that says how many there are more."""
    part = excerpt(texts, max_count)
    return [shorten_line(text, hint) for text in part.join(omission_text(part.omitted, hint))]
