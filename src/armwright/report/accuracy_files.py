"""The files of an assessment by ISO 9283: the measures of each test, a page and figures."""

import json

from armwright.accuracy.assessment import Assessment
from armwright.report.accuracy_figures import accuracy_drawings
from armwright.report.elements import Card, figures, tables
from armwright.report.static_page import static_page


def accuracy_files(assessment: Assessment, *, title: str, command: str) -> dict[str, str]:
    """Return the files of an assessment by name.

    Args:
        assessment: of the tests.
        title: heading of the page.
        command: the command line that made it.
    """
    drawn = accuracy_drawings(assessment)
    bounded = any(measure.limit is not None for measure in assessment.measures)
    good = not assessment.exceeded
    return {
        "measures.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=title,
            command=command,
            sections=[
                Card("Characteristics", tables(assessment.tables(), symbols=(0,))),
                Card("Figures", figures(drawn)),
            ],
            notes=assessment.notes,
            verdict=("all limits hold" if good else "limit exceeded", good) if bounded else None,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }
