"""A page that stands still: heading, notes, tables and figures."""

from collections.abc import Collection, Iterable, Sequence

import attrs

from armwright.report.elements import badge, card, facts, figures, table
from armwright.report.elements import notes as shown_notes
from armwright.report.figures import Drawing
from armwright.report.markup import page_html
from armwright.version import __version__


@attrs.frozen(kw_only=True)
class Table:
    """A table of a page, in plain texts.

    Attributes:
        title: above it.
        heads: names of the columns.
        rows: texts of each row.
        numbers: columns of numbers, from 0.
        marks: of the rows: ``over`` or ``holds`` a limit, or empty; none needs one.
        remark: beside the title; may be empty.
    """

    title: str
    heads: Sequence[str]
    rows: Iterable[Sequence[str]]
    numbers: Collection[int] = ()
    marks: Iterable[str] = ()
    remark: str = ""


def plain_page(
    *,
    title: str,
    command: str,
    tables: Iterable[Table],
    drawn: Iterable[Drawing] = (),
    notes: Iterable[str] = (),
    named: Iterable[tuple[str, str]] = (),
    verdict: tuple[str, bool] | None = None,
) -> str:
    """Return the whole text of a page, one HTML file that needs no other.

    Args:
        title: heading of the page.
        command: the command line that made it.
        tables: in order; one without rows is left out.
        drawn: its figures, below.
        notes: what a reader must know beside the numbers.
        named: facts below the heading, by name.
        verdict: a word beside the heading, and whether it is a good one.

    Returns:
        HTML text; write it as UTF-8.
    """
    cards = []
    for one in tables:
        rows = list(one.rows)
        if rows:
            content = table(one.heads, rows, numbers=one.numbers, marks=one.marks)
            cards.append(card(one.title, content, remark=one.remark))
    pictures = list(drawn)
    if pictures:
        cards.append(card("Figures", figures(pictures)))
    return page_html(
        title=title,
        badge="" if verdict is None else badge(verdict[0], good=verdict[1]),
        facts=facts(named),
        notes=shown_notes(notes),
        main="\n".join(cards),
        generated=f"armwright {__version__}: {command}",
    )
