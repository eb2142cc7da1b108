"""Pieces of a page out of plain texts, which none of these can break out of."""

import html
from collections.abc import Collection, Iterable, Sequence

from armwright.report.figures import Drawing


def badge(text: str, *, good: bool) -> str:
    """Return a word beside the heading that says how it went."""
    return f'<span id="status" class="badge{" good" if good else ""}">{html.escape(text)}</span>'


def facts(named: Iterable[tuple[str, str]]) -> str:
    """Return facts below the heading by their names; a command is shown as code."""
    shown = ((html.escape(name), ' class="code"' * (name == "Command"), html.escape(text)) for name, text in named)
    return "".join(f"<div><dt>{name}</dt><dd{code}>{text}</dd></div>" for name, code, text in shown)


def notes(texts: Iterable[str]) -> str:
    """Return what a reader must know, above everything."""
    return "".join(f'<li class="warning"><b>Note</b>{html.escape(text)}</li>' for text in texts)


def pairs(named: Iterable[tuple[str, str]]) -> str:
    """Return a list of names, each with its text."""
    items = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in named)
    return f'<dl class="pairs">{items}</dl>'


def table(
    heads: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Collection[int] = (), marks: Iterable[str] = ()
) -> str:
    """Return a table.

    Args:
        heads: names of the columns.
        rows: texts of each row.
        numbers: columns of numbers, from 0; they end at the right.
        marks: of the rows: ``over`` or ``holds`` a limit, or empty; none needs one.
    """

    def cells(tag: str, texts: Iterable[str]) -> str:
        kinds = (' class="number"' if place in numbers else "" for place in range(len(heads)))
        return "".join(f"<{tag}{kind}>{html.escape(text)}</{tag}>" for kind, text in zip(kinds, texts, strict=True))

    marked = [f' class="{mark}"' if mark else "" for mark in marks]
    lines = [cells("td", row) for row in rows]
    marked += [""] * (len(lines) - len(marked))
    body = "\n".join(f"<tr{mark}>{line}</tr>" for mark, line in zip(marked, lines, strict=True))
    head = f"<thead><tr>{cells('th', heads)}</tr></thead>"
    return f'<div class="scroll-x"><table>{head}\n<tbody>{body}</tbody></table></div>'


def card(title: str, content: str, *, remark: str = "") -> str:
    """Return a part of a page with its title; a remark stands at the right of it."""
    name, said = html.escape(title), f'<span class="quiet">{html.escape(remark)}</span>' if remark else ""
    head = f'<div class="card-head"><h2>{name}</h2>{said}</div>'
    return f'<section class="card" aria-label="{name}">{head}\n{content}</section>'


def figures(drawn: Iterable[Drawing]) -> str:
    """Return figures, which the page carries."""
    return '<div id="figures">' + "\n".join(one.element for one in drawn) + "</div>"
