"""How two versions of a text differ, and where a position of the one is in the other."""

from collections.abc import Callable

import attrs

from armwright.program.language.source import Span


@attrs.frozen
class EditMap:
    """How two versions of a text differ: what is in front of ``start`` and behind the ends is the same.

    Attributes:
        start: where they begin to differ.
        old_end: where that ends in the old text.
        new_end: where it ends in the new one.
    """

    start: int
    old_end: int
    new_end: int

    def then(self, start: int, end: int, length: int) -> "EditMap":
        """Return how the old text differs from the new one when that is changed once more.

        Args:
            start: where the new text is changed.
            end: up to where.
            length: of what comes there.
        """
        if self.none:
            return EditMap(start, end, start + length)
        old_end = self.old_end + max(0, end - self.new_end)
        new_end = max(end, self.new_end) - end + start + length
        return EditMap(min(self.start, start), old_end, new_end)

    @property
    def none(self) -> bool:
        """Whether nothing has changed."""
        return self.start == self.old_end == self.new_end

    def old(self, offset: int) -> int | None:
        """Return where a place of the new text was; None where it was not there."""
        return _moved(offset, self.start, self.new_end, self.old_end)

    def new(self, offset: int) -> int | None:
        """Return where a place of the old text is now; None where it is gone."""
        return _moved(offset, self.start, self.old_end, self.new_end)

    def new_span(self, span: Span) -> Span | None:
        """Return where a stretch of the old text is now; None where some of its ends is gone."""
        start, end = self.new(span.start), self.new(span.end)
        return None if start is None or end is None or end < start else Span(start, end)


def _moved(offset: int, start: int, end: int, other_end: int) -> int | None:
    if offset >= end:
        return offset - end + other_end
    return offset if offset <= start else None


NO_DRIFT = EditMap(0, 0, 0)


def drift(old: str, new: str) -> EditMap:
    """Compare two versions of a text."""
    if old == new:
        return NO_DRIFT
    limit = min(len(old), len(new))
    start = _same(lambda n: old[:n] == new[:n], limit)
    behind = _same(lambda n: old[len(old) - n :] == new[len(new) - n :], limit - start)
    return EditMap(start, len(old) - behind, len(new) - behind)


def _same(equal: Callable[[int], bool], limit: int) -> int:
    """Return how many characters are the same, by halving."""
    low, high = 0, limit
    while low < high:
        middle = (low + high + 1) // 2
        if equal(middle):
            low = middle
        else:
            high = middle - 1
    return low
