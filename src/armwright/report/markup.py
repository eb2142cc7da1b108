"""An HTML file from a template, styles, scripts and escaped data."""

import html
import json
import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from string import Template

import attrs
import numpy as np

from armwright.arrays import Array

# Five significant digits are below a pixel on any screen; instants of a long run take more.
_DIGITS, _DIGITS_OF_SCALARS = 5, 8
# Decimals at most; smaller parts of a number are rounding errors.
_DECIMALS = 7
# Metadata of an attrs field with numbers from which a page computes others: all their digits are written.
EXACT = {"exact": True}
# Stands for a row that equals the previous row.
_REPEATED_ROW = 0
_NO_SCRIPTS_NOTE = (
    '<noscript><p class="empty">This page draws with a script of its own; please allow scripts for it.</p></noscript>'
)
# The scripts of a page, and their data.
_SCRIPT = """\
<script type="application/json" id="data">$data</script>
<script>
(() => {
"use strict";
$script
})();
</script>"""


def page_html(
    *,
    title: str,
    main: str,
    generated: str,
    badge: str = "",
    facts: str = "",
    notes: str = "",
    styles: Sequence[str] = (),
    scripts: Sequence[str] = (),
    data: object = None,
    film: bool = True,
) -> str:
    """Return a page: the head and heading of all pages, and its own parts below them.

    Args:
        title: plain text.
        main: HTML text of the page's own parts.
        generated: plain text, the program and command that made it.
        badge: HTML text beside the heading.
        facts: HTML text below the heading, names and texts.
        notes: HTML text below the heading, items of a list.
        styles: names of style sheets beyond the common one.
        scripts: names of the page's scripts, in the order in which the browser reads them: each uses only earlier
            ones.
        data: data of the scripts: attrs objects, mappings, sequences, arrays, strings, numbers, None.
        film: whether a page with scripts has a clock, and what is moved by it.

    Returns:
        HTML text.
    """
    after = ""
    if scripts:
        moving = ("basics.js", "clock.js") if film else ()
        script = "\n".join(asset(name) for name in (*moving, *scripts))
        after = asset("film.html") * film + Template(_SCRIPT).substitute(data=json_text(data), script=script)
        styles = ("film.css", *styles) if film else styles
    allowed = "script-src 'unsafe-inline'; " if scripts else ""
    policy = f"default-src 'none'; style-src 'unsafe-inline'; {allowed}img-src data:"
    return Template(asset("page.html")).substitute(
        head=page_head(title, policy, "\n".join(asset(name) for name in ("page.css", *styles))),
        title=html.escape(title),
        badge=badge,
        facts=facts,
        notes=notes,
        before=_NO_SCRIPTS_NOTE if scripts else "",
        main=main,
        generated=html.escape(generated),
        after=after,
    )


def page_head(title: str, policy: str, style: str) -> str:
    """Return the beginning of a page, up to the end of its head, which is open.

    Args:
        title: plain text.
        policy: what the page may do, as of Content-Security-Policy.
        style: its style sheet.
    """
    return Template(asset("head.html")).substitute(
        title=html.escape(title), policy=html.escape(policy, quote=False), style=style
    )


def json_text(data: object) -> str:
    """Return ``data`` as JSON for a script element: in ASCII, and without ``<``."""
    text = json.dumps(_to_json_types(data), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def asset(name: str, package: str = "armwright.report") -> str:
    """Return a file of the assets of a package."""
    return (files(package) / "assets" / name).read_text(encoding="utf-8")


def _to_json_types(value: object) -> object:
    """Convert ``value`` to types of JSON."""
    if isinstance(value, np.ndarray):
        return _array_rows(value)
    if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
        return _round_significant(float(value), _DIGITS_OF_SCALARS)
    if attrs.has(type(value)):
        return {
            field.name: _exact(item) if field.metadata.get("exact") else _to_json_types(item)
            for field in attrs.fields(type(value))  # type: ignore[arg-type]
            for item in [getattr(value, field.name)]
        }
    if isinstance(value, Mapping):
        return {str(key): _to_json_types(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_to_json_types(item) for item in value]
    return value


def _exact(value: float | np.ndarray) -> object:
    """Return numbers with all their digits."""
    return value.tolist() if isinstance(value, np.ndarray) else float(value)


def _round_significant(number: float, digits: int) -> float | int | None:
    """Round to significant digits; an integral number becomes an int, and an infinite one None."""
    if not math.isfinite(number):
        return None
    rounded = round(float(f"{number:.{digits}g}"), _DECIMALS)
    return int(rounded) if rounded.is_integer() else rounded


def _array_rows(array: Array) -> list[object]:
    """Return an array over time: numbers for a single axis, else a flat list per row, or 0 for a repeated row."""
    if array.ndim == 1:
        return [_round_significant(number, _DIGITS_OF_SCALARS) for number in array.tolist()]
    rows: list[object] = []
    last: list[object] | None = None
    exact: list[float] | None = None
    for numbers in array.reshape(len(array), math.prod(array.shape[1:])).tolist():
        # Numbers that are equal are equal when rounded, too.
        if last is not None and numbers == exact:
            rows.append(_REPEATED_ROW)
            continue
        row: list[object] = [_round_significant(number, _DIGITS) for number in numbers]
        rows.append(_REPEATED_ROW if row == last else row)
        last, exact = row, numbers
    return rows
