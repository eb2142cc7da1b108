"""A page that stands still: heading, notes, tables and figures."""

from collections.abc import Iterable

from armwright.files.result_table import ResultTable
from armwright.report.elements import badge, card, facts, figures, notes as shown_notes, table
from armwright.report.figures import Drawing
from armwright.report.markup import page_html
from armwright.version import __version__


def static_page(
    *,
    title: str,
    command: str,
    tables: Iterable[ResultTable],
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
    cards = [card(shown.title, table(shown), remark=shown.remark) for shown in tables if shown.rows]
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
