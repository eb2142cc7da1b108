"""What messages mean: for every code a page with a title, a few sentences, a wrong program and a right one."""

import re
from functools import cache
from pathlib import Path

import attrs

from armwright.errors import UnknownNameError

_PAGES = Path(__file__).parent / "pages"
# Errors first, then what devices say, then warnings, then the style of working.
_ORDER = "ERWL"
_RANGES = {
    "E1": "Syntax",
    "E2": "Names, types and values",
    "E3": "Frames",
    "E4": "Motion",
    "E5": "Processes, and programs without end",
    "E6": "Export to controllers",
    "R6": "Devices",
    "W": "Warnings",
    "L": "Style",
}
_CODE = re.compile(r"([EWLR]?)0*(\d{3})")
_PAGE = re.compile(
    r"# (?P<code>[EWLR]\d{3}): (?P<title>[^\n]+)\n\n(?P<text>.+?)\n\n"
    r"## Wrong\n\n```\n(?P<wrong>.+?)```\n\n## Right\n\n```\n(?P<right>.+?)```\n",
    re.DOTALL,
)


@attrs.frozen(kw_only=True)
class Page:
    """What one code means.

    Attributes:
        code: such as ``E206``.
        title: what is wrong, in a few words.
        text: what it means, why it matters, what to do.
        wrong: a program that draws it.
        right: the same program, cured.
    """

    code: str
    title: str
    text: str
    wrong: str
    right: str


@cache
def codes() -> tuple[str, ...]:
    """Return all codes that have a page: errors, devices, warnings, style."""
    return tuple(sorted((path.stem for path in _PAGES.glob("*.md")), key=lambda code: (_ORDER.index(code[0]), code)))


def codes_by_range() -> dict[str, tuple[str, ...]]:
    """Return the codes by what they are about."""
    return {name: tuple(code for code in codes() if code.startswith(head)) for head, name in _RANGES.items()}


def find_page(code: str) -> Page:
    """Return what a code means.

    Args:
        code: such as ``E206``; ``e206``, ``E0206`` and ``206`` are the same, and of several with one number the
            error is meant.

    Raises:
        UnknownNameError: there is no such code; the nearest is named.
    """
    known = codes()
    match = _CODE.fullmatch(code.strip().upper())
    matches = [one for one in known if match and one[1:] == match[2] and match[1] in ("", one[0])]
    if not matches:
        similar = [one for one in known if one[:2] == code.strip().upper()[:2]]
        raise UnknownNameError("code", code, similar or known)
    return _read_page(matches[0])


@cache
def _read_page(code: str) -> Page:
    match = _PAGE.fullmatch((_PAGES / f"{code}.md").read_text(encoding="utf-8"))
    assert match is not None, f"the page of {code} has not the form of a page"  # noqa: S101 - our own pages
    return Page(**match.groupdict())
