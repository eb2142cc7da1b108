"""The page of an assessment by ISO 9283: all measures in a table, what was reduced, and the figures."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armwright.accuracy.assessment import Assessment
from armwright.accuracy.characteristics import Measure
from armwright.files.result_table import ResultTable
from armwright.report.figures import Drawing
from armwright.report.plain_page import plain_page

# Units in which people read what is in SI units: name and how many of it are one.
_SHOWN = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180 / np.pi),
    "s": ("s", 1.0),
    "m/s": ("mm/s", 1e3),
    "m/N": ("mm/N", 1e3),
    "": ("%", 100.0),
}
# How many tests a note names.
_NAMED = 4


class Shown(NamedTuple):
    """A measure as people read it.

    Attributes:
        value: with its sign, or plus or minus.
        unit: mm, deg, s, mm/s, mm/N or %.
        cycles: of which it was made, and, where those are too few, how many the standard asks for.
        limit: in the same unit; may be empty.
        verdict: ``holds``, ``exceeds`` or empty.
    """

    value: str
    unit: str
    cycles: str
    limit: str
    verdict: str


def shown_measure(one: Measure) -> Shown:
    """Return a measure as people read it."""
    unit, scale = _SHOWN[one.unit]
    verdict = {None: "", True: "holds", False: "exceeds"}[one.holds]
    value = f"{one.value * scale:.4g}" if np.isfinite(one.value) else "never"
    return Shown(
        value=f"± {value}" if one.either_way else value,
        unit=unit,
        cycles=f"{one.cycles} of {one.asked}" if one.few else str(one.cycles),
        limit="" if one.limit is None else f"{one.limit * scale:.4g}",
        verdict=verdict,
    )


def unit_scale(symbol_unit: str) -> tuple[str, float]:
    """Return the unit in which people read an SI unit, and how many of it are one."""
    return _SHOWN[symbol_unit]


def notes_of(found: Assessment) -> list[str]:
    """Return what a reader must know beside the numbers."""
    notes = []
    if found.planar:
        names = [f"{test.kind} {test.name}" for test in found.tests if test.size == 2]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        which = "all tests" if len(names) == len(found.tests) else f"{', '.join(names[:_NAMED])}{more}"
        notes.append(f"planar reduction: {which} measured in a plane, without z; distances are taken in it")
    if found.few:
        notes.append("fewer cycles than ISO 9283 asks for, where n or the note says so: such a measure is an estimate")
    over = sorted({one.symbol for one in found.exceeded})
    if over:
        notes.append(f"limit exceeded: {', '.join(over)}")
    return notes


def accuracy_page(found: Assessment, drawn: Sequence[Drawing], *, title: str, command: str) -> str:
    """Return the whole text of the page, one HTML file that needs no other.

    Args:
        found: what was assessed.
        drawn: its figures.
        title: heading of the page.
        command: the command line that made it.

    Returns:
        HTML text; write it as UTF-8.
    """
    bounded = [one.holds for one in found.measures if one.holds is not None]
    kept = all(bounded)
    seen = [shown_measure(one) for one in found.measures]
    measures = ResultTable(
        title="Measures",
        remark="n: cycles measured, of those that ISO 9283 asks for",
        heads=("Test", "Of", "Symbol", "Measure", "Value", "Unit", "n", "Limit", "Note"),
        rows=map(_row, found.measures, seen),
        numbers=(4, 6, 7),
        marks=tuple({"exceeds": "over"}.get(one.verdict, one.verdict) for one in seen),
    )
    return plain_page(
        title=title,
        command=command,
        tables=[measures],
        drawn=drawn,
        notes=notes_of(found),
        verdict=("all limits hold" if kept else "limit exceeded", kept) if bounded else None,
    )


def _row(one: Measure, seen: Shown) -> tuple[str, ...]:
    of = f"{one.name}, {one.condition}" if one.condition else one.name
    note = " ".join(filter(None, (seen.verdict, one.note)))
    return one.test, of, one.symbol, one.what, seen.value, seen.unit, seen.cycles, seen.limit, note
