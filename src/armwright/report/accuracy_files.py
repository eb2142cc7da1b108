"""The files of an assessment by ISO 9283: the measures of each test, a page and figures."""

import json
from collections.abc import Iterator

from armwright.accuracy.assessment import CONDITIONS, Assessment
from armwright.report.accuracy_figures import accuracy_drawings
from armwright.report.elements import Card, Tile, downloads, figures, pairs, tables
from armwright.report.static_page import static_page

# The measures that the headline has, as far as they are there, and how many of them.
_HEADLINE, _MOST = ("AP", "RP", "vAP", "AD", "RD", "AT", "RT", "E", "CR", "CO", "AV", "RV", "OV", "t"), 6


def accuracy_files(assessment: Assessment, *, title: str, command: str) -> dict[str, str]:
    """Return the files of an assessment by name.

    Args:
        assessment: of the tests.
        title: heading of the page.
        command: the command line that made it.
    """
    drawn = accuracy_drawings(assessment)
    bounded = any(measure.limit is not None for measure in assessment.measures)
    exceeded = ", ".join(dict.fromkeys(measure.symbol for measure in assessment.exceeded))
    few = [note for note in assessment.notes if note.startswith("fewer")]
    beside = {"measures.json": "every measure with its symbol, value in SI units, cycles and limit"}
    return {
        "measures.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=title,
            command=command,
            sections=[
                Card("Conditions", pairs((name, assessment.about.get(key, "")) for key, name in CONDITIONS.items())),
                Card("Characteristics", tables(assessment.tables(), symbols=(0,))),
                *([Card("Figures", figures(drawn))] if drawn else []),
                Card("Files", downloads(beside, drawn)),
            ],
            numbers=_tiles(assessment),
            # Exceeded limits are said beside the heading.
            notes=[note for note in assessment.notes if note not in few and not note.startswith("limit exceeded")],
            warnings=few,
            verdict=(f"limit exceeded: {exceeded}" if exceeded else "all limits hold", not exceeded)
            if bounded
            else None,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def _tiles(assessment: Assessment) -> Iterator[Tile]:
    """Give the largest of each measure, those with a limit first."""
    rounded = list(zip(assessment.measures, assessment.decimals, strict=True))
    known = {symbol: [one for one in rounded if one[0].symbol == symbol] for symbol in _HEADLINE}
    order = sorted(filter(None, known.values()), key=lambda same: same[0][0].limit is None)
    for same in order[:_MOST]:
        measure, decimals = max(same, key=lambda one: abs(one[0].value))
        of = f", largest of {len(same)}" if len(same) > 1 else ""
        limit = f"; limit {measure.displayed_limit} {measure.displayed_unit}" if measure.limit is not None else ""
        few = f"; {measure.displayed_cycles} cycles" if measure.few else ""
        mark = "bad" if measure.holds is False else "warn" if measure.few else ""
        label = f"{measure.symbol}, {measure.what}, of {measure.name}{of}{limit}{few}"
        yield Tile(f"{measure.rounded(decimals)} {measure.displayed_unit}", label, mark=mark)
