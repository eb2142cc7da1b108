"""The page of an assessment by ISO 9283: the measures of each test, what was reduced, and the figures."""

from collections.abc import Sequence

from armwright.accuracy.assessment import Assessment
from armwright.report.figures import Drawing
from armwright.report.plain_page import plain_page


def accuracy_page(assessment: Assessment, drawn: Sequence[Drawing], *, title: str, command: str) -> str:
    """Return the whole text of the page, one HTML file that needs no other.

    Args:
        assessment: of the tests.
        drawn: its figures.
        title: heading of the page.
        command: the command line that made it.

    Returns:
        HTML text; write it as UTF-8.
    """
    bounded = any(measure.limit is not None for measure in assessment.measures)
    good = not assessment.exceeded
    return plain_page(
        title=title,
        command=command,
        tables=assessment.tables(),
        drawn=drawn,
        notes=assessment.notes,
        verdict=("all limits hold" if good else "limit exceeded", good) if bounded else None,
    )
