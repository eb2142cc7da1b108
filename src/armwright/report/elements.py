"""HTML elements of a page, in which plain texts are escaped."""

import html
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain, repeat
from typing import NamedTuple

from armwright.files.result_table import ResultTable
from armwright.report.figures import Drawing, Film

# A table of more pixels than this has no other one beside it; what a character of a cell, one of a head, and the gap of
# a column take. Words go on in another line after so many characters.
_HALF_WIDTH, _IN_CELL, _IN_HEAD, _GAP, _LINE = 545, 6.3, 7.3, 14, 24


class Tile(NamedTuple):
    """A number of the headline.

    Attributes:
        value: the number with its unit.
        label: what it is.
        title: more about it.
        mark: ``warn`` or ``bad`` where it needs attention, else empty.
    """

    value: str
    label: str
    title: str = ""
    mark: str = ""


class Card(NamedTuple):
    """A section of a page.

    Attributes:
        title: plain text.
        content: HTML text.
        remark: plain text to the right of the title.
    """

    title: str
    content: str
    remark: str = ""


def length_text(x: float) -> str:
    """Return a length [m] as text: in mm with two or three decimals, small ones in µm."""
    if x < 1e-5:
        return f"{x * 1e6:.3g} µm"
    return f"{x * 1e3:.{2 if x >= 1e-3 else 3}f} mm"


def badge(text: str, *, good: bool) -> str:
    """Return the status beside the heading."""
    return f'<span id="status" class="badge{" good" if good else ""}">{html.escape(text)}</span>'


def facts(named: Iterable[tuple[str, str]]) -> str:
    """Return named facts for the head of a page; a command is shown as code."""
    shown = ((html.escape(name), ' class="code"' * (name == "Command"), html.escape(text)) for name, text in named)
    return "".join(f"<div><dt>{name}</dt><dd{code}>{text}</dd></div>" for name, code, text in shown)


def warnings(texts: Iterable[str]) -> str:
    """Return what a reader must not overlook, as items of a list."""
    return "".join(f'<li class="warning"><b>Note</b>{html.escape(text)}</li>' for text in texts)


def remarks(texts: Iterable[str]) -> str:
    """Return plain facts beside the numbers, as a list; empty where there are none."""
    items = "".join(f"<li>{html.escape(text)}</li>" for text in texts)
    return f'<ul class="remarks">{items}</ul>' if items else ""


def headline(tiles: Iterable[Tile]) -> str:
    """Return the numbers that a page is about; empty where there are none."""
    shown = "".join(map(_item, tiles))
    return f'<ul class="headline" aria-label="In short">{shown}</ul>' if shown else ""


def _item(tile: Tile) -> str:
    title = f' title="{html.escape(tile.title)}"' if tile.title else ""
    name = f"figure {tile.mark}".strip()
    return f'<li class="{name}"{title}><b>{html.escape(tile.value)}</b><small>{html.escape(tile.label)}</small></li>'


def pairs(named: Iterable[tuple[str, str]]) -> str:
    """Return a list of names, each with its text; an empty text is a line to fill in by hand."""
    items = (f"<dt>{html.escape(name)}</dt><dd{_blank(text)}>{html.escape(text)}</dd>" for name, text in named)
    return f'<dl class="pairs">{"".join(items)}</dl>'


def _blank(text: str) -> str:
    return "" if text else ' class="blank"'


def table(result: ResultTable, *, symbols: Collection[int] = (), last: Sequence[str] = ()) -> str:
    """Return a table of results, its numbers aligned right, its rows of the class of their marks.

    Args:
        result: the table.
        symbols: columns, from 0, of symbols: what follows an underscore is a subscript.
        last: HTML texts of one more column: its head, then a cell for each row; none where left out.
    """

    def cells(tag: str, texts: Iterable[str], more: str) -> str:
        kinds = (' class="number"' if index in result.numbers else "" for index in range(len(result.heads)))
        shown = (_symbol(text) if index in symbols else html.escape(text) for index, text in enumerate(texts))
        own = "".join(f"<{tag}{kind}>{text}</{tag}>" for kind, text in zip(kinds, shown, strict=True))
        return f'{own}<{tag} class="drawn">{more}</{tag}>' if last else own

    classes = (f' class="{mark}"' if mark else "" for mark in chain(result.marks, repeat("")))
    rows = zip(result.rows, classes, chain(last[1:], repeat("")), strict=False)
    body = "\n".join(f"<tr{name}>{cells('td', row, more)}</tr>" for row, name, more in rows)
    head = f"<thead><tr>{cells('th', result.heads, ''.join(last[:1]))}</tr></thead>"
    return f'<div class="scroll-x"><table>{head}\n<tbody>{body}</tbody></table></div>'


def _symbol(text: str) -> str:
    name, mark, index = text.partition("_")
    return f"{html.escape(name)}<sub>{html.escape(index)}</sub>" if mark else html.escape(text)


def tables(shown: Iterable[ResultTable], *, symbols: Collection[int] = ()) -> str:
    """Return tables side by side, wide ones alone, each below its title; those without rows are left out."""

    def block(result: ResultTable) -> str:
        wide = ' class="wide"' * (_width(result) > _HALF_WIDTH)
        remark = f'<p class="quiet">{html.escape(result.remark)}</p>' * bool(result.remark)
        return f"<div{wide}><h3>{html.escape(result.title)}</h3>{table(result, symbols=symbols)}{remark}</div>"

    return f'<div class="tables">{"".join(block(result) for result in shown if result.rows)}</div>'


def _width(shown: ResultTable) -> float:
    """Return how wide a table is, about [px]."""
    width = 0.0
    for k, (head, *cells) in enumerate(zip(shown.heads, *shown.rows, strict=True)):
        longest = max(map(len, cells), default=0)
        longest = longest if k in shown.numbers else min(longest, _LINE)
        width += max(_IN_HEAD * len(head), _IN_CELL * longest) + _GAP
    return width


def table_cards(shown: Iterable[ResultTable]) -> list[Card]:
    """Return a section for each table; those without rows are left out."""
    return [Card(result.title, table(result), result.remark) for result in shown if result.rows]


def cards(sections: Iterable[Card]) -> str:
    """Return the sections of a page; above several of them stand links to each."""
    shown = list(sections)
    links = "".join(f'<a href="#part-{i}">{html.escape(card.title)}</a>' for i, card in enumerate(shown, 1))
    parts = "\n".join(_card(card, f"part-{i}") for i, card in enumerate(shown, 1))
    return f'<nav class="sections" aria-label="Sections">{links}</nav>\n{parts}' if len(shown) > 2 else parts


def _card(card: Card, identifier: str) -> str:
    name, aside = html.escape(card.title), f'<span class="quiet">{html.escape(card.remark)}</span>' * bool(card.remark)
    head = f'<div class="card-head"><h2>{name}</h2>{aside}</div>'
    return f'<section class="card" id="{identifier}" aria-label="{name}">{head}\n{card.content}</section>'


def figures(drawn: Iterable[Drawing | Film]) -> str:
    """Return figures, with their data."""
    return '<div id="figures">' + "\n".join(drawing.element for drawing in drawn) + "</div>"


def downloads(files: Mapping[str, str], drawings: Iterable[Drawing] = ()) -> str:
    """Return links to files that lie beside the page, each with what it holds; figures by their captions to a colon."""
    beside = {**files, **{f"{one.name}.svg": one.caption.partition(":")[0] for one in drawings}}
    items = (
        f'<li><a href="{html.escape(name)}" download>{html.escape(name)}</a><span>{html.escape(text)}</span></li>'
        for name, text in beside.items()
    )
    return f'<ul class="files">{"".join(items)}</ul>'
