"""Tables of results, as a terminal and a page show them: what ``tables()`` of a result gives."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any, Protocol

import attrs


def _rows(rows: Iterable[Sequence[str]]) -> tuple[tuple[str, ...], ...]:
    return tuple(map(tuple, rows))


@attrs.frozen(kw_only=True)
class ResultTable:
    """A table of texts; numbers are written in the unit of the head of their column.

    Attributes:
        title: above it.
        heads: names of the columns.
        rows: texts of each row.
        numbers: columns of numbers, from 0.
        marks: of the rows: ``over`` or ``holds`` a limit, or empty; none needs one.
        exceeded: row and column, from 0, of the cells that exceed a limit.
        section_ends: rows after which a section ends.
        remark: beside the title; may be empty.
    """

    title: str
    heads: Sequence[str]
    rows: tuple[tuple[str, ...], ...] = attrs.field(converter=_rows)
    numbers: Collection[int] = ()
    marks: Sequence[str] = ()
    exceeded: Collection[tuple[int, int]] = ()
    section_ends: Collection[int] = ()
    remark: str = ""


class Result(Protocol):
    """What a command computes, and can print, write as JSON and put on a page."""

    @property
    def notes(self) -> Sequence[str]:
        """What a reader must know beside the numbers."""

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units, as JSON holds it."""

    def tables(self) -> Iterator[ResultTable]:
        """Give its tables; those without rows are not shown."""
