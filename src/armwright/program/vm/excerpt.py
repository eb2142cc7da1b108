"""The beginning and the end of what a run did, where all of it is too much to show; the whole is in events.jsonl."""

from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")
R = TypeVar("R")

# Rows of a table, or lines, that a terminal shows; items that a page or a record lists; letters of one of them.
ON_A_TERMINAL, IN_A_LIST, IN_A_LINE = 1000, 4000, 1000
# Where all is: in the files of the run, or nowhere, where none were asked for.
KEPT, NOT_KEPT = "all in events.jsonl", "`-o FOLDER` keeps all in events.jsonl"


class Excerpt(NamedTuple, Generic[T]):
    """Items, or the first and the last of them.

    Attributes:
        first: from the beginning on.
        last: up to the end; empty where nothing is left out.
        left_out: how many stand between.
    """

    first: Sequence[T]
    last: Sequence[T]
    left_out: int

    def mapped(self, show: Callable[[T], R]) -> "Excerpt[R]":
        """Return what ``show`` makes of each."""
        return Excerpt([*map(show, self.first)], [*map(show, self.last)], self.left_out)

    def joined(self, *others: T) -> list[T]:
        """Return the items, with ``rest`` instead of those that are left out."""
        return [*self.first, *(others if self.left_out else ()), *self.last]


def excerpt(items: Sequence[T], most: int) -> Excerpt[T]:
    """Return as many items as can be shown.

    Args:
        items: in order; a text is one of letters.
        most: how many, half of them from the end.
    """
    if len(items) <= most:
        return Excerpt(items, (), 0)
    half = most // 2
    return Excerpt(items[:half], items[len(items) - half :], len(items) - 2 * half)


def more(left_out: int, where: str = KEPT) -> str:
    """Say how many items are not shown, and where they are."""
    return f"... and {left_out:,} more; {where}"


def one_line(text: str, where: str = KEPT) -> str:
    """Return a text as one line of a list: the midst of a very long one is left out."""
    shown = excerpt(text, IN_A_LINE)
    return "".join(shown.joined(f" {more(shown.left_out, where)} "))


def listed(texts: Sequence[str], most: int, where: str = KEPT) -> list[str]:
    """Return lines of a list, with one that says how many there are more."""
    shown = excerpt(texts, most)
    return [one_line(text, where) for text in shown.joined(more(shown.left_out, where))]
