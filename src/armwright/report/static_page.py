"""A page that stands still: heading, headline numbers, notes, and sections of tables and figures."""

from collections.abc import Iterable, Sequence

from armwright.report.elements import Card, Tile, badge, cards, facts, headline, remarks, warnings as shown_warnings
from armwright.report.markup import page_html
from armwright.version import __version__


def static_page(
    *,
    title: str,
    command: str,
    sections: Iterable[Card],
    numbers: Iterable[Tile] = (),
    notes: Iterable[str] = (),
    warnings: Iterable[str] = (),
    named: Iterable[tuple[str, str]] = (),
    verdict: tuple[str, bool] | None = None,
    scripts: Sequence[str] = (),
    data: object = None,
) -> str:
    """Return the whole text of a page, one HTML file that needs no other.

    Args:
        title: heading of the page.
        command: the command line that made it.
        sections: of the page, in order.
        numbers: what a reader looks for first, above the sections.
        notes: plain facts beside the numbers.
        warnings: what a reader must not overlook.
        named: facts below the heading, by name.
        verdict: a word beside the heading, and whether it is a good one.
        scripts: names of the scripts of views that can be turned; see ``page_html``.
        data: of the scripts.

    Returns:
        HTML text; write it as UTF-8.
    """
    return page_html(
        title=title,
        badge="" if verdict is None else badge(verdict[0], good=verdict[1]),
        facts=facts(named),
        notes=shown_warnings(warnings),
        main="\n".join(filter(None, (headline(numbers), remarks(notes), cards(sections)))),
        generated=f"armwright {__version__}: {command}",
        styles=("figures.css",),
        scripts=scripts,
        data=data,
        film=False,
    )
