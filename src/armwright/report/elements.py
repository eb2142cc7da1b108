"""HTML elements of a page, in which plain texts are escaped."""

import html
from collections.abc import Iterable
from itertools import chain, repeat

from armwright.files.result_table import ResultTable
from armwright.report.figures import Drawing


def badge(text: str, *, good: bool) -> str:
    """Return the status beside the heading."""
    return f'<span id="status" class="badge{" good" if good else ""}">{html.escape(text)}</span>'


def facts(named: Iterable[tuple[str, str]]) -> str:
    """Return named facts for the head of a page; a command is shown as code."""
    shown = ((html.escape(name), ' class="code"' * (name == "Command"), html.escape(text)) for name, text in named)
    return "".join(f"<div><dt>{name}</dt><dd{code}>{text}</dd></div>" for name, code, text in shown)


def notes(texts: Iterable[str]) -> str:
    """Return notes as items of a list."""
    return "".join(f'<li class="warning"><b>Note</b>{html.escape(text)}</li>' for text in texts)


def pairs(named: Iterable[tuple[str, str]]) -> str:
    """Return a list of names, each with its text."""
    items = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in named)
    return f'<dl class="pairs">{items}</dl>'


def table(result: ResultTable) -> str:
    """Return a table of results, its numbers aligned right, its rows of the class of their marks."""

    def cells(tag: str, texts: Iterable[str]) -> str:
        kinds = (' class="number"' if index in result.numbers else "" for index in range(len(result.heads)))
        return "".join(f"<{tag}{kind}>{html.escape(text)}</{tag}>" for kind, text in zip(kinds, texts, strict=True))

    classes = (f' class="{mark}"' if mark else "" for mark in chain(result.marks, repeat("")))
    body = "\n".join(f"<tr{name}>{cells('td', row)}</tr>" for row, name in zip(result.rows, classes, strict=False))
    head = f"<thead><tr>{cells('th', result.heads)}</tr></thead>"
    return f'<div class="scroll-x"><table>{head}\n<tbody>{body}</tbody></table></div>'


def card(title: str, content: str, *, remark: str = "") -> str:
    """Return a section of a page with its title, and a remark to the right of the title."""
    name, aside = html.escape(title), f'<span class="quiet">{html.escape(remark)}</span>' if remark else ""
    head = f'<div class="card-head"><h2>{name}</h2>{aside}</div>'
    return f'<section class="card" aria-label="{name}">{head}\n{content}</section>'


def figures(drawn: Iterable[Drawing]) -> str:
    """Return figures, with their data."""
    return '<div id="figures">' + "\n".join(drawing.element for drawing in drawn) + "</div>"
